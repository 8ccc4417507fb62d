// SPDX-License-Identifier: MIT
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 colour;  // with display gamma
// of the instance: see ObjectInstance
layout(location = 3) in vec4 place;     // xyz: origin from the eye, metres, w: scale
layout(location = 4) in vec4 rotation;  // quaternion
layout(location = 5) in vec4 share;     // x: coverage, yzw: tint

out vec3 p_eye;
out vec3 surface_normal;
out vec3 surface_colour;
flat out float coverage;

void main() {
    p_eye = place.xyz + rotated(rotation, place.w * position);
    surface_normal = rotated(rotation, normal);
    surface_colour = colour.rgb * share.yzw;
    coverage = share.x;
    gl_Position = frame.clip_from_eye * vec4(p_eye, 1.0);
}
