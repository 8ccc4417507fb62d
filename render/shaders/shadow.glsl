// SPDX-License-Identifier: MIT
// Lighting of a surface with the sun's shadows. CASCADES, the number of shadow maps, is defined if there are any: see
// shadow_maps.h. PENUMBRA is defined if the edges of shadows are as wide as the sun's disc makes them.
//
// Sources (PENUMBRA): R. Fernando. Percentage-Closer Soft Shadows. NVIDIA 2005. J. Isidoro. Shadow Mapping: GPU-based
//          Tips and Techniques. GDC 2006 (depth along the receiver's plane). H. Vogel. A better way to construct the
//          sunflower head. Mathematical Biosciences 44, 1979 (samples of a disc).
// Deviation: a penumbra is at most kMostRadius texels wide to either side.

#ifdef CASCADES
layout(std140, binding = 2) uniform Shadow {
    vec4 right;             // xyz: axes of the maps; the third is frame.sun. w: tangent of the sun's angular radius
    vec4 up;
    vec4 places[CASCADES];  // xyz: centre of the map from the eye along the axes, metres, w: 1 / side
    vec4 reach;             // xyz: reach of each cascade from the eye, metres, w: texel size relative to the side
} shadow;
layout(binding = 6) uniform sampler2DArrayShadow shadow_maps;

// Displacement of the receiver along its normal, texels: see D. Holbert, Saying Goodbye to Shadow Acne, GDC 2011.
// Shadows become shorter by this divided by the tangent of the sun's elevation. Measured: stripes remain with 0, but
// not with 0.3.
const float kAway = 0.4;
// Distance of the filter's samples from its centre, texels; each sample is bilinear.
const float kFilter = 0.5;
// kBlendFrom: share of a cascade's reach from which it fades to the next one. kFadeFrom: share of the last cascade's
// reach from which it fades to full light.
const float kBlendFrom = 0.9, kFadeFrom = 0.75;

#ifdef PENUMBRA
layout(binding = 14) uniform sampler2DArray shadow_depths;  // the same maps without comparison

// Least and largest radius of the filter, texels. With less, edges on walls along the sun's direction are jagged by
// texels; the 4 x 4 texels that are searched for casters surround the largest one.
const float kLeastRadius = 1.0, kMostRadius = 2.0;
// Least component of a receiver's normal towards the sun for the depth of its plane.
const float kLeastFacing = 0.1;
// Samples of the unit disc: the radius of the n-th is sqrt((n + 0.5) / 8), its azimuth n times the golden angle.
const vec2 kDisc[8] = vec2[](vec2(0.2500, 0.0000), vec2(-0.3193, 0.2925), vec2(0.0489, -0.5569),
                             vec2(0.4024, 0.5249), vec2(-0.7385, -0.1306), vec2(0.6996, -0.4450),
                             vec2(-0.2340, 0.8705), vec2(-0.4463, -0.8593));

// Share of sunlight that reaches a point according to one map, 0 to 1.
float sun_share(vec3 p_eye, vec3 normal, int cascade) {
    vec4 place = shadow.places[cascade];
    float texel = shadow.reach.w;
    vec3 p = p_eye + normal * (kAway * texel / place.w);
    p = vec3(dot(p, shadow.right.xyz), dot(p, shadow.up.xyz), dot(p, frame.sun.xyz));
    vec3 at = 0.5 + (p - place.xyz) * place.w;
    // depth of the receiver's plane per side of the map
    vec2 slope = -vec2(dot(normal, shadow.right.xyz), dot(normal, shadow.up.xyz)) /
                 max(dot(normal, frame.sun.xyz), kLeastFacing);
    float layer = float(cascade);
    // casters among the 4 x 4 texels around the place, and the sum of their heights above the receiver's plane
    vec2 first = floor(at.xy / texel - 0.5);
    float count = 0.0, height = 0.0;
    for (int i = 0; i < 4; ++i) {
        // corner of four texels
        vec2 corner = texel * (first + 2.0 * vec2(float(i & 1), float(i >> 1)));
        vec4 plane = at.z + dot(slope, corner - at.xy) +
                     0.5 * texel * (slope.x * vec4(-1.0, 1.0, 1.0, -1.0) + slope.y * vec4(1.0, 1.0, -1.0, -1.0));
        // the depth is 1 nearest to the sun
        vec4 above = textureGather(shadow_depths, vec3(corner, layer)) - plane;
        count += dot(step(0.0, above), vec4(1.0));
        height += dot(max(above, 0.0), vec4(1.0));
    }
    bool is_edge = count > 0.0 && count < 16.0;
    float radius = clamp(shadow.right.w * height / max(count, 1.0) / texel, kLeastRadius, kMostRadius);
    // a software rasteriser skips the passes of a loop that no pixel needs
    float share = 0.0;
    int i = is_edge ? 0 : 7;
    do {
        vec2 beside = radius * texel * kDisc[i];
        share += 0.125 * texture(shadow_maps, vec4(at.xy + beside, layer, at.z + dot(slope, beside)));
    } while (++i < 8);
    return is_edge ? share : (count > 0.0 ? 0.0 : 1.0);
}
#else
// Share of sunlight that reaches a point according to one map, 0 to 1.
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
#endif

// Share of sunlight that reaches a point of a surface with a unit normal, 0 to 1.
float sun_share(vec3 p_eye, vec3 normal) {
    float distance = length(p_eye);
    float most = shadow.reach[CASCADES - 1];
    // Avoids a variable index into a uniform vector, for which an NVIDIA driver (580.159) reads the wrong component
    // here.
    vec3 reach = shadow.reach.xyz;
    int cascade = int(distance > reach.x) + int(distance > reach.y) + int(distance > reach.z);
    float own_reach = cascade == 0 ? reach.x : (cascade == 1 ? reach.y : reach.z);
    // blend towards the next cascade, if any
    float to_next = (distance / own_reach - kBlendFrom) / (1.0 - kBlendFrom);
    to_next = cascade < CASCADES - 1 ? max(to_next, 0.0) : 0.0;
    int last = cascade + (to_next > 0.0 ? 1 : 0);
    // the condition is at the end: a software rasteriser completes the pass that a loop's first condition leaves
    float share = 0.0;
    int i = min(cascade, CASCADES - 1);
    do {
        share += (i == cascade ? 1.0 - to_next : to_next) * sun_share(p_eye, normal, i);
    } while (++i <= min(last, CASCADES - 1));
    return mix(share, 1.0, smoothstep(kFadeFrom * most, most, distance));
}
#ifdef PIXELS
// The same of pixels of one surface around a point. share: sun_share() of that point
void sun_shares(float share, vec3 centre, vec3 p_eye[PIXELS], vec3 normal, out float shares[PIXELS]) {
    bool is_edge = PIXELS > 1 && share > 0.0 && share < 1.0;
    float distance = length(centre);
    int cascade = min(int(distance > shadow.reach.x) + int(distance > shadow.reach.y), CASCADES - 1);
    vec4 place = shadow.places[cascade];
    vec3 away = normal * (kAway * shadow.reach.w / place.w);
    float most = shadow.reach[CASCADES - 1];
    float fade = smoothstep(kFadeFrom * most, most, distance);
    for (int i = 0; i < PIXELS; ++i) shares[i] = share;
    int i = is_edge ? 0 : PIXELS - 1;
    do {
        // of the pixel alone, one lookup
        vec3 p = p_eye[i] + away;
        p = vec3(dot(p, shadow.right.xyz), dot(p, shadow.up.xyz), dot(p, frame.sun.xyz));
        vec3 at = 0.5 + (p - place.xyz) * place.w;
        float own = mix(texture(shadow_maps, vec4(at.xy, float(cascade), at.z)), 1.0, fade);
        shares[i] = is_edge ? 0.5 * (share + own) : share;
    } while (++i < PIXELS);
}
#endif
#endif

// lit() with shadows and point lights, of a point of a surface.
// smooth_normal: of the surface without bumps
vec3 lit_at(vec3 albedo, vec3 normal, vec3 p_eye, vec3 smooth_normal) {
    float towards_sun = dot(normal, frame.sun.xyz);
#ifdef CASCADES
    towards_sun *= sun_share(p_eye, smooth_normal);
#endif
    vec3 light = lit_from(albedo, towards_sun, normal.z, p_eye);
#ifdef POINT_LIGHTS
    light += albedo * point_light(p_eye, normal);
#endif
    return light;
}
