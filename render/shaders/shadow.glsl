// SPDX-License-Identifier: MIT
// Light of a surface with the sun's shadows. CASCADES, the number of shadow maps, is defined where there are any: see
// sun_cascades.h and shadow_maps.h.

#ifdef CASCADES
layout(std140, binding = 2) uniform Shadow {
    vec4 right;             // xyz: axes of the maps; the third is frame.sun
    vec4 up;
    vec4 places[CASCADES];  // xyz: centre of the map from the eye along the axes, metres, w: 1 / side
    vec4 reach;             // xyz: of each cascade from the eye, metres, w: of a texel in the side
} shadow;
layout(binding = 6) uniform sampler2DArrayShadow shadow_maps;

// Displacement of the receiver along its normal, texels: see D. Holbert, Saying Goodbye to Shadow Acne, GDC 2011. Shadows
// become shorter by as much over the tangent of the sun's elevation. Measured: with 0 stripes stay, with 0.3 none.
const float kAway = 0.4;
// Distance of the filter's samples from the middle, texels; each is bilinear.
const float kFilter = 0.5;
// Share of a cascade's reach from which on it fades to the next one, and of the last one's to full light.
const float kBlendFrom = 0.9, kFadeFrom = 0.75;

// Share of the sun in one map.
float sun_share(vec3 p_eye, vec3 normal, int cascade) {
    vec4 place = shadow.places[cascade];
    vec3 p = p_eye + normal * (kAway * shadow.reach.w / place.w);
    p = vec3(dot(p, shadow.right.xyz), dot(p, shadow.up.xyz), dot(p, frame.sun.xyz));
    vec3 at = 0.5 + (p - place.xyz) * place.w;
    vec2 beside = vec2(kFilter, -kFilter) * shadow.reach.w;
    float layer = float(cascade);
    return 0.25 * (texture(shadow_maps, vec4(at.xy + beside.xx, layer, at.z)) +
                   texture(shadow_maps, vec4(at.xy + beside.xy, layer, at.z)) +
                   texture(shadow_maps, vec4(at.xy + beside.yx, layer, at.z)) +
                   texture(shadow_maps, vec4(at.xy + beside.yy, layer, at.z)));
}

// Share of the sun that reaches a point of a surface with a unit normal, 0 to 1.
float sun_share(vec3 p_eye, vec3 normal) {
    float distance = length(p_eye);
    float most = shadow.reach[CASCADES - 1];
    if (distance >= most) return 1.0;
    int cascade = 0;
    while (distance > shadow.reach[cascade]) ++cascade;
    float share = sun_share(p_eye, normal, cascade);
    if (cascade < CASCADES - 1) {
        float to_next = (distance / shadow.reach[cascade] - kBlendFrom) / (1.0 - kBlendFrom);
        if (to_next > 0.0) share = mix(share, sun_share(p_eye, normal, cascade + 1), to_next);
    }
    return mix(share, 1.0, smoothstep(kFadeFrom * most, most, distance));
}
#endif

// lit() with shadows, of a point of a surface.
// smooth_normal: of the surface without bumps
vec3 lit_at(vec3 albedo, vec3 normal, vec3 p_eye, vec3 smooth_normal) {
#ifdef CASCADES
    float towards_sun = dot(normal, frame.sun.xyz);
    if (towards_sun > 0.0) towards_sun *= sun_share(p_eye, smooth_normal);
    return lit_from(albedo, towards_sun, normal.z);
#else
    return lit(albedo, normal);
#endif
}
