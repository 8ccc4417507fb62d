// SPDX-License-Identifier: MIT
// Shadow of an impostor: the view nearest to the sun's direction, as a flat picture through the object's centre that
// faces the sun. See small_impostor.vert.
layout(std430, binding = 1) readonly buffer Instances {
    vec4 instances[];  // three per instance: see ObjectInstance
};

uniform int first_instance;
uniform vec3 centre;    // of the object's bounds, its frame, metres
uniform vec2 half_box;  // of the bounds: largest distance from the axis, half the height, metres
uniform ivec2 views;    // around the axis, from horizontal to above

out vec2 at;          // in the view, 0 to 1
flat out float view;  // layer
flat out float coverage;

const float kTurn = 6.283185307179586;

void main() {
    int instance = 3 * (first_instance + gl_VertexID / 6);
    vec4 place = instances[instance];
    vec4 rotation = instances[instance + 1];
    coverage = instances[instance + 2].x;
    vec3 towards = rotated(vec4(-rotation.xyz, rotation.w), frame.sun.xyz);
    int around = int(round(atan(towards.y, towards.x) / kTurn * float(views.x)));
    around = (around + views.x) % views.x;
    int above = int(round(clamp(asin(clamp(towards.z, -1.0, 1.0)) * 4.0 / kTurn, 0.0, 1.0) *
                          float(views.y - 1)));
    view = float(around + views.x * above);

    float level = length(towards.xy);
    vec3 right = level > 1e-4 ? vec3(-towards.y, towards.x, 0.0) / level : vec3(0.0, 1.0, 0.0);
    // with a ring of horizontal views the picture stands upright
    vec3 up = views.y > 1 ? cross(towards, right) : vec3(0.0, 0.0, 1.0);
    float elevation = views.y > 1 ? float(above) * 0.25 * kTurn / float(views.y - 1) : 0.0;
    vec2 size = vec2(half_box.x, half_box.y * cos(elevation) + half_box.x * sin(elevation));
    const vec2 corners[6] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, -1), vec2(1, 1),
                                   vec2(-1, 1));
    vec2 corner = corners[gl_VertexID % 6];
    at = 0.5 + 0.5 * corner;
    vec3 p_object = centre + right * (corner.x * size.x) + up * (corner.y * size.y);
    gl_Position =
        frame.clip_from_eye * vec4(place.xyz + rotated(rotation, place.w * p_object), 1.0);
}
