// SPDX-License-Identifier: MIT
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 colour;  // with display gamma
// per instance: see ObjectInstance
layout(location = 3) in vec4 place;     // xyz: origin from the eye, metres, w: scale
layout(location = 4) in vec4 rotation;  // quaternion
layout(location = 5) in vec4 share;     // x: coverage, yzw: tint
// of the vertex in the next level
layout(location = 6) in vec3 next_position;
layout(location = 7) in vec3 next_normal;
layout(location = 8) in vec4 next_colour;
#ifdef TEXTURED
layout(location = 9) in vec2 place_in_texture;
layout(location = 10) in vec2 next_place_in_texture;
#endif

out vec3 p_eye;
out vec3 surface_normal;
#ifdef TEXTURED
out vec4 surface_colour;
out vec2 texture_at;
#else
out vec3 surface_colour;
#endif
flat out float coverage;

void main() {
    coverage = min(share.x, 1.0);
    float morph = max(share.x - 1.0, 0.0);
    p_eye = place.xyz + rotated(rotation, place.w * mix(position, next_position, morph));
    surface_normal = rotated(rotation, mix(normal, next_normal, morph));
#ifdef TEXTURED
    surface_colour = mix(colour, next_colour, morph) * vec4(share.yzw, 1.0);
    texture_at = mix(place_in_texture, next_place_in_texture, morph);
#else
    surface_colour = mix(colour.rgb, next_colour.rgb, morph) * share.yzw;
#endif
    gl_Position = frame.clip_from_eye * vec4(p_eye, 1.0);
}
