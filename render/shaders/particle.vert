// SPDX-License-Identifier: MIT
layout(location = 0) in vec4 place;   // xyz: centre from the eye, metres, w: radius
layout(location = 1) in vec4 colour;  // rgb with display gamma, opacity at the centre

out vec3 p_eye;
out vec2 at;  // -1 to 1
flat out vec4 colour_of;
flat out float radius;

void main() {
    const vec2 corners[6] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, -1), vec2(1, 1),
                                   vec2(-1, 1));
    at = corners[gl_VertexID];
    // square to the direction from the eye: discs near the picture's edge are not stretched
    vec3 towards = -normalize(place.xyz);
    vec3 right = normalize(cross(normalize(frame.up.xyz), towards));
    vec3 up = cross(towards, right);
    p_eye = place.xyz + place.w * (right * at.x + up * at.y);
    colour_of = colour;
    radius = place.w;
    gl_Position = frame.clip_from_eye * vec4(p_eye, 1.0);
}
