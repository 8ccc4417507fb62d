// SPDX-License-Identifier: MIT
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;

uniform mat3 axes;    // columns: the object's axes, unit
uniform vec3 extents; // half extents along the axes, metres
uniform vec3 centre;  // from the eye

out vec3 p_eye;
out vec3 surface_normal;

void main() {
    p_eye = centre + axes * (position * extents);
    surface_normal = axes * normal;  // exact for boxes, spheres and cylinders
    gl_Position = frame.clip_from_eye * vec4(p_eye, 1.0);
}
