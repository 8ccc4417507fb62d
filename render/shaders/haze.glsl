// SPDX-License-Identifier: MIT
// Light of a sun and a sky of fixed colours, and haze. Colours are linear until display(). atmosphere.glsl has the same
// functions for a sky by scattering.

const vec3 kSunLight = vec3(2.75, 2.40, 1.90);
const vec3 kSkyLight = vec3(0.26, 0.35, 0.52);
const vec3 kGroundLight = vec3(0.16, 0.14, 0.10);
// Light of the lamp at the eye in volumes.
const vec3 kLampLight = vec3(5.2, 4.7, 4.0);

// Light of a white surface at a point that faces the sun, without shadows.
vec3 sun_light(vec3 p_eye) { return kSunLight; }
// Light of a white surface by sky and surrounding ground. upward: component of its normal.
vec3 ambient_light(float upward) { return mix(kGroundLight, kSkyLight, 0.5 + 0.5 * upward); }
// Light of a white surface that is level.
vec3 level_light(vec3 p_eye) { return kSunLight * max(frame.sun.z, 0.0) + kSkyLight; }

// Diffuse light of sun, sky and surrounding ground.
// towards_sun, upward: components of the normal.
vec3 lit_from(vec3 albedo, float towards_sun, float upward, vec3 p_eye) {
    return albedo * (sun_light(p_eye) * max(towards_sun, 0.0) + ambient_light(upward));
}
vec3 lit(vec3 albedo, vec3 normal, vec3 p_eye) {
    return lit_from(albedo, dot(normal, frame.sun.xyz), normal.z, p_eye);
}

// Tone mapping: a soft shoulder, gamma 2 (cheap), some contrast.
vec3 display(vec3 light) {
    vec3 shown = sqrt(light / (light + 0.80));
    return mix(shown, shown * shown * (3.0 - 2.0 * shown), 0.6);
}

// Glow of the air towards the sun.
vec3 glow(vec3 direction) {
    float towards = max(dot(direction, frame.sun.xyz), 0.0);
    float towards4 = towards * towards * towards * towards;
    float towards16 = towards4 * towards4 * towards4 * towards4;
    float towards48 = towards16 * towards16 * towards16;
    return vec3(1.0, 0.86, 0.62) * (0.10 * towards4 + 0.22 * towards48);
}

// Displayed colour of the sky in a unit direction.
vec3 sky(vec3 direction) {
    float height = max(direction.z, 0.0);
    vec3 colour = mix(frame.horizon.rgb, frame.zenith.rgb, 1.0 - exp(-3.6 * height));
    return colour + glow(direction) * (1.0 - colour);
}
// Light of the sky in a unit direction, for with_sun(): as displayed.
vec3 sky_light(vec3 direction) { return sky(direction); }
vec3 with_sun(vec3 colour, vec3 direction) {
    // the sun's disc, a quarter of a degree in radius
    float disc = smoothstep(0.99998, 0.999992, dot(direction, frame.sun.xyz));
    return mix(colour, vec3(1.0, 0.98, 0.92), disc);
}
vec3 sky_with_sun(vec3 direction) { return with_sun(sky(direction), direction); }

// The haze between the eye and a point.
struct AirBefore {
    float share;   // of the point's displayed colour
    vec3 colour;   // displayed
};
AirBefore air_up_to(vec3 p_eye, float distance) {
    vec3 along = p_eye / distance;
    return AirBefore(exp2(-frame.grid.z * distance), frame.horizon.rgb + glow(along) * (1.0 - frame.horizon.rgb));
}
// Displayed colour of a surface seen through haze.
vec3 behind_air(vec3 colour, vec3 p_eye, float distance) {
    AirBefore before = air_up_to(p_eye, distance);
    return mix(before.colour, colour, before.share);
}
// The same, given the surface's light.
vec3 shown_behind(AirBefore before, vec3 light) { return mix(before.colour, display(light), before.share); }
vec3 shown_behind_air(vec3 light, vec3 p_eye, float distance) {
    return shown_behind(air_up_to(p_eye, distance), light);
}
