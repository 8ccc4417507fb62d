// SPDX-License-Identifier: MIT
// Point lights. POINT_LIGHTS, the most that there are, is defined: see point_lights.h.
//
// Source:    B. Karis. Real Shading in Unreal Engine 4. SIGGRAPH 2013 (the window of the inverse square).
// Deviation: the squared distance is limited from below instead of increased by 1 m^2, so that the light at 1 m is the
//            intensity.

layout(std140, binding = 4) uniform PointLights {
    vec4 places[POINT_LIGHTS];       // xyz: metres from the eye, w: 1 / range^2
    vec4 intensities[POINT_LIGHTS];  // rgb: light of a white surface that faces the point from 1 m
} points;

// Least squared distance, m^2.
const float kLeastSquare = 0.01;

// Light of a white surface with a unit normal by all point lights. Those that are absent have no intensity: a loop of
// unknown length takes a software rasteriser three times as long.
vec3 point_light(vec3 p_eye, vec3 normal) {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < POINT_LIGHTS; ++i) {
        vec3 towards = points.places[i].xyz - p_eye;
        float square = max(dot(towards, towards), kLeastSquare);
        float share = square * points.places[i].w;
        float window = clamp(1.0 - share * share, 0.0, 1.0);
        float facing = max(dot(normal, towards), 0.0) * inversesqrt(square);
        sum += points.intensities[i].rgb * (window * window / square * facing);
    }
    return sum;
}
