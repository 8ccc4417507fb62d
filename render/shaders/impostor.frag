// SPDX-License-Identifier: MIT
// Blends the nearest views of an object. Each view is sampled where the ray from the eye meets the surface given by the
// view's depth, so that views agree on points that both see.
uniform vec3 centre;
uniform vec2 half_box;
uniform ivec2 views;
uniform float radius;  // range of the depths, metres

layout(binding = 0) uniform sampler2DArray colours;  // square root of linear colour times opacity, opacity
layout(binding = 1) uniform sampler2DArray shapes;   // normal and depth, times opacity

in vec3 p_object;
flat in vec3 eye_object;
flat in vec4 place_of, rotation_of, share_of;
flat in ivec4 layers;
flat in vec4 weights;
flat in float map_level;

layout(location = 0) out vec4 colour_out;

const float kTurn = 6.283185307179586;
// Opacity below which a sample has no surface.
const float kLeastOpacity = 1.0 / 64.0;

void main() {
    vec3 along = p_object - eye_object;
    vec4 colour = vec4(0.0), shape = vec4(0.0);
    float fraction = 0.0;
    for (int i = 0; i < 4; ++i) {
        // axes of the view, as in mesh_store.cpp
        float azimuth = float(layers[i] % views.x) * kTurn / float(views.x);
        float elevation =
            views.y > 1 ? float(layers[i] / views.x) * 0.25 * kTurn / float(views.y - 1) : 0.0;
        vec2 side = vec2(cos(azimuth), sin(azimuth));
        vec3 towards = vec3(side * cos(elevation), sin(elevation));
        vec3 right = vec3(-side.y, side.x, 0.0);
        vec3 up = cross(towards, right);
        vec2 size = vec2(half_box.x, half_box.y * cos(elevation) + half_box.x * sin(elevation));

        float across = dot(along, towards);
        float t = dot(centre - eye_object, towards) / across;
        // two steps to the surface, starting from the plane through the centre
        vec4 seen, form;
        for (int step = 0; step < 3; ++step) {
            vec3 p = eye_object + t * along - centre;
            vec3 at = vec3(vec2(dot(p, right), dot(p, up)) / (2.0 * size) + 0.5, float(layers[i]));
            seen = textureLod(colours, at, map_level);
            form = textureLod(shapes, at, map_level);
            if (step == 2 || seen.a < kLeastOpacity) break;
            float depth = (2.0 * form.w / seen.a - 1.0) * radius;
            t = (dot(centre - eye_object, towards) + depth) / across;
        }
        colour += weights[i] * seen;
        shape += weights[i] * form;
        fraction += weights[i] * seen.a * t;
    }
    if (colour.a < kLeastOpacity) discard;
    keep_samples(covered_samples(share_of.x, colour.a));
    vec3 normal = normalize(rotated(rotation_of, 2.0 * shape.xyz / colour.a - 1.0));
    vec3 p_eye = place_of.w * rotated(rotation_of, along * (fraction / colour.a));
    vec4 clip = frame.clip_from_eye * vec4(p_eye, 1.0);
    gl_FragDepth = clamp(clip.z / clip.w, 0.0, 1.0);
    vec3 root = colour.rgb / colour.a * pow(share_of.yzw, vec3(1.1));
    vec3 light = lit_at(root * root, normal, p_eye, normal);
    colour_out = vec4(shown_at(light, p_eye), 1.0);
}
