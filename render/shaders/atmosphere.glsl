// SPDX-License-Identifier: MIT
// Light of a sun and a sky by scattering in the air: the functions of haze.glsl, from the maps of sky_light.h. Colours
// are linear and exposed until display().
//
// Sources: K. Narkowicz. ACES Filmic Tone Mapping Curve. 2016 (a fit of the reference rendering transform of the
//          Academy Color Encoding System). IEC 61966-2-1:1999 (sRGB).
// Deviation: the curve's toe is half as deep (0.10 in place of 0.03), so that shadows keep their detail.

layout(std140, binding = 6) uniform Air {
    vec4 rayleigh;        // rgb: extinction by molecules at sea level, 1/m, w: 1 / height over which it falls to 1 / e
    vec4 aerosol;         // the same of aerosols; all exponents and depths are for exp2
    vec4 rayleigh_depth;  // rgb: optical depth from sea level to the sun, w: density at the eye
    vec4 aerosol_depth;
    vec4 sun;             // rgb: light of a white surface that faces the sun, above molecules and aerosols, w: altitude
                          // of the eye, metres
    vec4 disc;            // rgb: of the sun's disc, w: cosine of its angular radius
    vec4 ambient_side;    // rgb: light of a white upright surface by the sky and the ground
    vec4 ambient_rise;    // rgb: linear and quadratic part of that light as a function of the normal's z
    vec4 ambient_bend;
    vec4 place;           // xy: horizontal direction to the sun, unit, z: altitude above the lower air, w: see air_map
    vec4 horizon;         // x: sine of its elevation, y, z: 1 / range of sines above and below it
} air;

layout(binding = 10) uniform sampler2D sky_map;  // x: azimuth from the sun, y: elevation from the horizon
layout(binding = 11) uniform sampler3D air_map;  // z: distance / (distance + air.place.w)

const vec3 kLampLight = vec3(2.6, 2.35, 2.0);

// Densities of molecules and aerosols at a point, relative to those at sea level.
vec2 densities(vec3 p_eye) {
    float altitude = max(air.sun.w + p_eye.z, 0.0);
    return exp2(-altitude * vec2(air.rayleigh.w, air.aerosol.w));
}

vec3 sun_light(vec3 p_eye) {
    vec2 density = densities(p_eye);
    return air.sun.rgb *
           exp2(-density.x * air.rayleigh_depth.rgb - density.y * air.aerosol_depth.rgb);
}
vec3 ambient_light(float upward) {
    return air.ambient_side.rgb +
           upward * (air.ambient_rise.rgb + upward * air.ambient_bend.rgb);
}
vec3 level_light(vec3 p_eye) {
    return sun_light(p_eye) * max(frame.sun.z, 0.0) + ambient_light(1.0);
}
vec3 lit_from(vec3 albedo, float towards_sun, float upward, vec3 p_eye) {
    return albedo * (sun_light(p_eye) * max(towards_sun, 0.0) + ambient_light(upward));
}
vec3 lit(vec3 albedo, vec3 normal, vec3 p_eye) {
    return lit_from(albedo, dot(normal, frame.sun.xyz), normal.z, p_eye);
}

vec3 display(vec3 light) {
    vec3 shown = min(light * (2.51 * light + 0.10) / (light * (2.43 * light + 0.59) + 0.14), 1.0);
    return mix(12.92 * shown, 1.055 * pow(shown, vec3(1.0 / 2.4)) - 0.055,
               step(vec3(0.0031308), shown));
}
// The inverse of display() for colours up to 0.95.
vec3 light_shown_as(vec3 colour) {
    vec3 encoded = min(colour, 0.95);
    vec3 shown = mix(encoded / 12.92, pow((encoded + 0.055) / 1.055, vec3(2.4)),
                     step(vec3(0.04045), encoded));
    vec3 square = 2.51 - 2.43 * shown, linear = 0.10 - 0.59 * shown;
    return (sqrt(linear * linear + 0.56 * square * shown) - linear) / (2.0 * square);
}

// Place in the maps, 0 to 1: of the azimuth and of the elevation of a unit direction.
vec2 place_in_sky(vec3 direction) {
    float level = inversesqrt(max(dot(direction.xy, direction.xy), 1e-12));
    float cosine = dot(direction.xy, air.place.xy) * level;
    float above = direction.z - air.horizon.x;
    float root = sqrt(min(abs(above) * (above < 0.0 ? air.horizon.z : air.horizon.y), 1.0));
    return vec2(sqrt(max(0.5 - 0.5 * cosine, 0.0)), 0.5 + 0.5 * (above < 0.0 ? -root : root));
}

// Light of the sky in a unit direction, without the sun's disc.
vec3 sky_light(vec3 direction) {
    const vec2 kTexels = vec2(48.0, 97.0);
    return textureLod(sky_map, (0.5 + place_in_sky(direction) * (kTexels - 1.0)) / kTexels, 0.0).rgb;
}
vec3 sky(vec3 direction) { return display(sky_light(direction)); }
// Displayed colour of the sky, given its light, with the sun's disc.
vec3 with_sun(vec3 light, vec3 direction) {
    // the picture's pixels smooth the disc's edge
    vec3 apart = direction - frame.sun.xyz;
    float outside = sqrt(dot(apart, apart)) - sqrt(2.0 - 2.0 * air.disc.w);
    float disc = clamp(0.5 - outside / frame.grid.w, 0.0, 1.0);
    disc *= direction.z > air.horizon.x ? 1.0 : 0.0;
    return display(light + disc * air.disc.rgb);
}
vec3 sky_with_sun(vec3 direction) { return with_sun(sky_light(direction), direction); }

// Share of light that passes from a point to the eye.
vec3 air_share(vec3 p_eye, float distance) {
    vec2 here = vec2(air.rayleigh_depth.w, air.aerosol_depth.w), there = densities(p_eye);
    // the mean of an exponential function of the altitude
    vec2 rise = (max(air.sun.w + p_eye.z, 0.0) - air.sun.w) * vec2(air.rayleigh.w, air.aerosol.w);
    vec2 exact = (here - there) / (rise * 0.6931472);
    vec2 mean = vec2(abs(rise.x) < 0.02 ? 0.5 * (here.x + there.x) : exact.x,
                     abs(rise.y) < 0.02 ? 0.5 * (here.y + there.y) : exact.y);
    return exp2(-distance * (mean.x * air.rayleigh.rgb + mean.y * air.aerosol.rgb));
}
// Light scattered to the eye before a point.
vec3 air_light(vec3 p_eye, float distance) {
    const vec3 kTexels = vec3(24.0, 33.0, 16.0);
    vec3 direction = p_eye / distance;
    float inside = max(distance - air.place.z / max(-direction.z, max(-air.horizon.x, 1e-9)), 0.0);
    vec3 at = vec3(place_in_sky(direction), inside / (inside + air.place.w));
    return textureLod(air_map, (0.5 + at * (kTexels - 1.0)) / kTexels, 0.0).rgb;
}
// The air between the eye and a point.
struct AirBefore {
    vec3 share, light;  // see air_share() and air_light()
};
AirBefore air_up_to(vec3 p_eye, float distance) {
    return AirBefore(air_share(p_eye, distance), air_light(p_eye, distance));
}
vec3 shown_behind(AirBefore before, vec3 light) { return display(light * before.share + before.light); }
vec3 shown_behind_air(vec3 light, vec3 p_eye, float distance) {
    return shown_behind(air_up_to(p_eye, distance), light);
}
