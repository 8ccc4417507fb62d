// SPDX-License-Identifier: MIT
// Attenuates the light of a surface on its way to the eye: by haze and, if WATER is defined, by water up to a level.
//
// Sources: R. Pope, E. Fry. Absorption spectrum (380-700 nm) of pure water. Applied Optics 36(33), 1997 (absorption).
//          C. Schlick. An Inexpensive BRDF Model for Physically-based Rendering. Eurographics 1994 (reflection).
// Deviations: light is not refracted, and reflections show only the sky.

#ifdef WATER
layout(binding = 7) uniform sampler2D ripples;  // see ground_shade.cpp

// Absorption per metre: pure water at 650, 550 and 450 nm, plus substances dissolved in a clear lake.
const vec3 kAbsorption = vec3(0.340, 0.057, 0.009) + vec3(0.06, 0.07, 0.11);
// Metres of water that transmit less than 1 / 400 of any colour.
const float kOpaque = 52.0;
// Albedo of water that is too deep to show its bottom.
const vec3 kDeepWater = vec3(0.010, 0.026, 0.030);
// Reflectance at normal incidence, for the refractive index 1.33.
const float kReflection = 0.02;
// Ripples: repeats of the noise within its period of 56 m, and factor of its slope.
const float kRepeats = 3.0, kSlope = 0.2;
// Exponent of the sun's highlight, and the highlight's least visible value.
const float kGlint = 500.0, kLeastGlint = 0.002;
// Mipmap bias, as in shade.frag.
const float kSharperRipples = -1.0;

// Length of the light's path in water for a point below the surface, down from the sun and up to the eye, metres.
float way_in_water(vec3 p_eye) {
    float level = frame.near.y;
    return (1.0 - level / p_eye.z) * length(p_eye) + level - p_eye.z;
}
// Whether water hides a point in it entirely from an eye above the surface.
bool is_hidden(vec3 p_eye) {
    float level = frame.near.y;
    return level < 0.0 && p_eye.z < level && way_in_water(p_eye) > kOpaque;
}

// Light of a point attenuated by some metres of water.
vec3 through_water(vec3 light, float metres, vec3 p_eye) {
    vec3 deep = kDeepWater * level_light(p_eye);
    return mix(deep, light, exp(-kAbsorption * metres));
}

// Normal of the water surface seen in a unit direction.
vec3 water_normal(vec3 p_eye, vec3 along, float distance) {
    float footprint = distance * frame.grid.w * inversesqrt(max(abs(along.z), 0.01));
    vec2 at = kRepeats * (frame.noise_phase.xy + p_eye.xy * frame.tint.z);
    float lod = log2(footprint * kRepeats * frame.tint.z * 256.0) + kSharperRipples;
    vec2 slope = textureLod(ripples, at, lod).xy - 0.5;
    return normalize(vec3(-kSlope * slope, 1.0));
}

// Light of the water surface at a point, given the light from below.
vec3 water_surface(vec3 light, vec3 p_eye) {
    float distance = length(p_eye);
    vec3 along = p_eye / distance;
    vec3 normal = water_normal(p_eye, along, distance);
    float grazing = 1.0 - max(dot(-along, normal), 0.0);
    float grazing2 = grazing * grazing;
    float reflected = kReflection + (1.0 - kReflection) * grazing2 * grazing2 * grazing;
    vec3 mirrored = reflect(along, normal);
    mirrored.z = abs(mirrored.z);
    float glint = pow(max(dot(mirrored, frame.sun.xyz), 0.0), kGlint);
#ifdef CASCADES
    for (int left = glint > kLeastGlint ? 1 : 0; left > 0; --left)
        glint *= sun_share(p_eye, vec3(0.0, 0.0, 1.0));
#endif
#ifdef ATMOSPHERE
    vec3 seen = mix(light, sky_light(mirrored), reflected) + glint * air.disc.rgb;
    return shown_behind_air(seen, p_eye, distance);
#else
    vec3 shown = mix(display(light), sky(mirrored), reflected);
    shown += glint * (1.0 - shown);
    return behind_air(shown, p_eye, distance);
#endif
}
#endif

// Displayed colour of a surface, given its light.
vec3 shown_at(vec3 light, vec3 p_eye) {
    float distance = length(p_eye);
#ifdef WATER
    float level = frame.near.y;
    if (level >= 0.0) {
        float wet = p_eye.z < level ? distance + level - p_eye.z : level / p_eye.z * distance;
        return display(through_water(light, wet, p_eye));
    }
    vec3 shown = shown_behind_air(light, p_eye, distance);
    // a loop instead of a branch: a software rasteriser executes both sides of a branch
    for (int left = p_eye.z < level ? 1 : 0; left > 0; --left)
        shown = water_surface(through_water(light, way_in_water(p_eye), p_eye), level / p_eye.z * p_eye);
    return shown;
#else
    return shown_behind_air(light, p_eye, distance);
#endif
}
