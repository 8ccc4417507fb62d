// SPDX-License-Identifier: MIT
// A billboard of two triangles around an object's bounds. With a ring of views it turns about the object's up axis
// only; with a hemisphere it is perpendicular to the view direction. Not instanced: six vertices form one billboard,
// because instances of two triangles cost a software rasteriser 6 microseconds each.
layout(std430, binding = 1) readonly buffer Instances {
    vec4 instances[];  // three per instance: see ObjectInstance
};

uniform int first_instance;
uniform vec3 centre;    // of the object's bounds, its frame, metres
uniform vec2 half_box;  // of the bounds: largest distance from the axis, half the height, metres
uniform ivec2 views;    // around the axis, from horizontal to above
uniform float texels;   // along the side of a view

out vec3 p_object;
flat out vec3 eye_object;
flat out vec4 place_of, rotation_of, share_of;
flat out ivec4 layers;
flat out vec4 weights;
flat out float map_level;  // mipmap level

const float kTurn = 6.283185307179586;
// Mipmap bias: multisampling already averages, so that the unbiased level would blur twice.
const float kSharper = 0.5;

void main() {
    int instance = 3 * (first_instance + gl_VertexID / 6);
    vec4 place = instances[instance];         // xyz: origin from the eye, metres, w: scale
    vec4 rotation = instances[instance + 1];  // quaternion
    vec4 share = instances[instance + 2];     // x: coverage, yzw: tint
    eye_object = rotated(vec4(-rotation.xyz, rotation.w), -place.xyz) / place.w;
    vec3 towards = normalize(eye_object - centre);
    float level = length(towards.xy);
    vec3 right = level > 1e-4 ? vec3(-towards.y, towards.x, 0.0) / level : vec3(0.0, 1.0, 0.0);
    vec3 up = views.y > 1 ? cross(towards, right) : vec3(0.0, 0.0, 1.0);
    vec2 size = half_box;
    if (views.y > 1) size.y = half_box.y * level + half_box.x * abs(towards.z);
    // perspective enlarges the nearer half of the object
    size *= 1.0 + length(half_box) / max(length(eye_object - centre), length(half_box));

    const vec2 corners[6] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, -1), vec2(1, 1),
                                   vec2(-1, 1));
    vec2 corner = corners[gl_VertexID % 6] * size;
    p_object = centre + right * corner.x + up * corner.y;

    float around = fract(atan(towards.y, towards.x) / kTurn) * float(views.x);
    int first = int(floor(around)) % views.x, second = (first + 1) % views.x;
    float above = clamp(asin(clamp(towards.z, -1.0, 1.0)) * 4.0 / kTurn, 0.0, 1.0) *
                  float(views.y - 1);
    int low = int(floor(above)), high = min(low + 1, views.y - 1);
    layers = ivec4(first, second, first, second) + views.x * ivec4(low, low, high, high);
    // mostly one view: blending several softens outlines
    vec2 t = smoothstep(0.2, 0.8, vec2(around - floor(around), above - float(low)));
    weights = vec4((1.0 - t.x) * (1.0 - t.y), t.x * (1.0 - t.y), (1.0 - t.x) * t.y, t.x * t.y);

    float pixel = length(eye_object - centre) * frame.grid.w;
    map_level = max(log2(pixel * texels / (2.0 * sqrt(half_box.x * size.y))) - kSharper, 0.0);

    place_of = place;
    rotation_of = rotation;
    share_of = share;
    gl_Position =
        frame.clip_from_eye * vec4(place.xyz + rotated(rotation, place.w * p_object), 1.0);
}
