// SPDX-License-Identifier: MIT
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 colour;

uniform vec3 centre;  // of the object, its frame, metres
uniform mat3 axes;    // rows: right, up, towards the viewer, over half the picture's extents and the radius

out vec3 surface_normal;
out vec3 surface_colour;
out float depth;  // towards the viewer, -1 to 1

void main() {
    vec3 p = axes * (position - centre);
    surface_normal = normal;
    surface_colour = colour.rgb;
    depth = p.z;
    // depth is reversed: largest at the nearest point
    gl_Position = vec4(p.xy, 0.5 + 0.49 * p.z, 1.0);
}
