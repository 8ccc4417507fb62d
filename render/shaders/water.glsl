// SPDX-License-Identifier: MIT
// Attenuates the light of a surface on its way to the eye: by haze and, if WATER is defined, by water up to a level.
//
// Sources: R. Pope, E. Fry. Absorption spectrum (380-700 nm) of pure water. Applied Optics 36(33), 1997 (absorption).
//          C. Schlick. An Inexpensive BRDF Model for Physically-based Rendering. Eurographics 1994 (reflection).
// Deviations: light is not refracted, and reflections show only the sky.
//
// With WAVES the surface moves, is rougher in the distance, and is transparent where it is shallow.

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

#ifdef WAVES
// Water below the ground that was drawn, metres: the sea of a raster has no bottom. Set by ground().
float extra_depth = 0.0;
// Depth of such a sea, the height above its level up to which ground is the sea, and the slope from which it is not.
const float kSeaDepth = 30.0, kSeaHeight = 0.01, kSeaSlope = 0.0015;
// Repeats of the two layers of waves within the noise's period, and factor of the sum of their slopes.
const float kWaves = 3.0, kShortWaves = 8.0, kWaveSlope = 0.22;
// Depth over which the surface becomes opaque, and up to which there is foam, metres.
const float kShore = 0.6, kFoam = 0.35;
// Exponent of the sun's highlight where no wave is resolved.
const float kFarGlint = 60.0;

float sea_depth(vec3 p_eye, vec3 normal) {
    float above = p_eye.z - frame.near.y;
    return kSeaDepth * step(-0.2, above) * step(above, kSeaHeight) *
           (1.0 - smoothstep(0.0, kSeaSlope, length(normal.xy)));
}
#else
const float extra_depth = 0.0;
#endif

// Length of the light's path in water for a point below the surface, down from the sun and up to the eye, metres.
float way_in_water(vec3 p_eye) {
    float level = frame.near.y;
    return (1.0 - level / p_eye.z) * length(p_eye) + level - p_eye.z + 2.0 * extra_depth;
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

#ifdef WAVES
// Normal of the water surface seen in a unit direction.
// height: of the waves, -1/2 to 1/2; blur: share of the waves that are smaller than pixels, 0 to 1
vec3 water_normal(vec3 p_eye, vec3 along, float distance, out float height, out float blur) {
    float footprint = distance * frame.grid.w * inversesqrt(max(abs(along.z), 0.01));
    vec2 at = frame.noise_phase.xy + p_eye.xy * frame.tint.z;
    float lod = log2(footprint * kWaves * frame.tint.z * 256.0) + kSharperRipples;
    vec3 first = textureLod(ripples, kWaves * at + frame.waves.xy, lod).xyz - 0.5;
    // a quarter turn, so that the layers do not align
    vec3 second = textureLod(ripples, kShortWaves * vec2(at.y, -at.x) + frame.waves.zw,
                             lod + log2(kShortWaves / kWaves)).xyz - 0.5;
    // gusts
    vec2 turned = vec2(3.0 * p_eye.x + 4.0 * p_eye.y, 3.0 * p_eye.y - 4.0 * p_eye.x);
    float gust = textureLod(ripples, frame.noise_phase.zw + turned * frame.tint.w,
                            log2(footprint * frame.tint.w * 5.0 * 256.0)).z;
    height = first.z + 0.5 * second.z;
    blur = smoothstep(0.0, 6.0, lod);
    vec2 slope = first.xy + 0.6 * vec2(-second.y, second.x);
    return normalize(vec3(-kWaveSlope * (0.4 + 1.2 * gust) * slope, 1.0));
}
#else
// Normal of the water surface seen in a unit direction.
vec3 water_normal(vec3 p_eye, vec3 along, float distance) {
    float footprint = distance * frame.grid.w * inversesqrt(max(abs(along.z), 0.01));
    vec2 at = kRepeats * (frame.noise_phase.xy + p_eye.xy * frame.tint.z);
    float lod = log2(footprint * kRepeats * frame.tint.z * 256.0) + kSharperRipples;
    vec2 slope = textureLod(ripples, at, lod).xy - 0.5;
    return normalize(vec3(-kSlope * slope, 1.0));
}
#endif

// Light of the water surface at a point, given the light from below.
// depth: metres of water
vec3 water_surface(vec3 light, vec3 p_eye, float depth) {
    float distance = length(p_eye);
    vec3 along = p_eye / distance;
#ifdef WAVES
    float height, blur;
    vec3 normal = water_normal(p_eye, along, distance, height, blur);
    float sharpness = mix(kGlint, kFarGlint, blur);
    float foam = 0.7 * smoothstep(0.02, 0.22, height + 0.25 - depth * (0.5 / kFoam));
    light = mix(light, 0.7 * level_light(p_eye), foam);
#else
    vec3 normal = water_normal(p_eye, along, distance);
    const float sharpness = kGlint;
#endif
    float grazing = 1.0 - max(dot(-along, normal), 0.0);
    float grazing2 = grazing * grazing;
    float reflected = kReflection + (1.0 - kReflection) * grazing2 * grazing2 * grazing;
    vec3 mirrored = reflect(along, normal);
    mirrored.z = abs(mirrored.z);
#ifdef WAVES
    // waves that are not resolved mirror the sky above
    reflected *= 1.0 - 0.35 * blur;
    mirrored = normalize(mirrored + vec3(0.0, 0.0, 0.12 * blur));
#endif
    float glint = pow(max(dot(mirrored, frame.sun.xyz), 0.0), sharpness);
#ifdef CASCADES
    if (glint > kLeastGlint) glint *= sun_share(p_eye, vec3(0.0, 0.0, 1.0));
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

// Displayed colour of a surface, given its light and the air before it.
vec3 shown_at(vec3 light, vec3 p_eye, AirBefore before) {
#ifdef WATER
    float distance = length(p_eye);
    float level = frame.near.y;
    if (level >= 0.0) {
        float wet = p_eye.z < level ? distance + level - p_eye.z : level / p_eye.z * distance;
        return display(through_water(light, wet, p_eye));
    }
    vec3 shown = shown_behind(before, light);
    if (p_eye.z < level)
#ifdef WAVES
    {
        float depth = level - p_eye.z + extra_depth;
        vec3 surface = water_surface(through_water(light, way_in_water(p_eye), p_eye),
                                     level / p_eye.z * p_eye, depth);
        shown = mix(shown, surface, smoothstep(0.0, kShore, depth));
    }
#else
        shown = water_surface(through_water(light, way_in_water(p_eye), p_eye),
                              level / p_eye.z * p_eye, level - p_eye.z);
#endif
    return shown;
#else
    return shown_behind(before, light);
#endif
}
// The same.
vec3 shown_at(vec3 light, vec3 p_eye) { return shown_at(light, p_eye, air_up_to(p_eye, length(p_eye))); }
