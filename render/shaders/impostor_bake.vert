// SPDX-License-Identifier: MIT
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 colour;
#ifdef TEXTURED
layout(location = 9) in vec2 place_in_texture;
#endif

uniform vec3 centre;  // of the object, its frame, metres
uniform mat3 axes;    // rows: right, up, towards the viewer, over half the picture's extents and the radius

out vec3 surface_normal;
#ifdef TEXTURED
out vec3 p_object;
out vec4 surface_colour;
out vec2 texture_at;
#else
out vec3 surface_colour;
#endif
out float depth;  // towards the viewer, -1 to 1

void main() {
    vec3 p = axes * (position - centre);
    surface_normal = normal;
#ifdef TEXTURED
    p_object = position;
    surface_colour = colour;
    texture_at = place_in_texture;
#else
    surface_colour = colour.rgb;
#endif
    depth = p.z;
    // depth is reversed: largest at the nearest point
    gl_Position = vec4(p.xy, 0.5 + 0.49 * p.z, 1.0);
}
