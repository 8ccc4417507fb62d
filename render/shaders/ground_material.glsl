// SPDX-License-Identifier: MIT
// Materials of the ground: which material covers a point, and its albedo, normal and roughness. See ground_materials.h.
//
// A layer of the texture has one material at any scale. A pixel is covered by two neighbouring scales of a ladder, whose
// periods grow by kScaleRatio; its size selects them, so that the texels are about as large as pixels at any distance.
// Repetition is broken by an offset for each half period.
//
// Sources: E. Heitz, F. Neyret. High-Performance By-Example Noise using a Histogram-Preserving Blending Operator.
//            Proc. ACM Comput. Graph. Interact. Tech. 1(2), 2018 (offsets by cell, blending that keeps the variance).
//          M. Oren, S. Nayar. Generalization of Lambert's Reflectance Model. SIGGRAPH 1994 (rough surfaces).
// Deviations: the textures are made with a nearly normal histogram, so that it is not transformed. Cells are halves of
//             squares, and their weights are sharpened, so that most pixels need one lookup for each scale.

// ANISOTROPY, that of the texture's filter, and PIXELS, the pixels of a fragment, are defined by the program.

#ifdef MATERIALS
layout(binding = 12) uniform sampler2DArray materials;  // rg: slopes, b: tone, a: height, all with mean 1/2

// see ground_materials.cpp
layout(std140, binding = 5) uniform Ground {
    vec4 dark[6];           // of each material, rgb: albedo at tone 0, w: roughness
    vec4 light[6];          // rgb: albedo at tone 1, w: factor of the slopes
    vec4 lines;             // x: height of the snow line, y: 1 / width of its transition, z: steepness of rock,
                            // w: occlusion
    vec4 cover;             // shares of x: shrub, y: bare soil, z: scree, w: macro variation
    vec4 place[5];          // xyz: position of the eye in its period, 0 to 1, w: 1 / period, 1/m
    ivec4 cell[5] ;     // xyz: number of that period, modulo 2^32
} materials_of;

// Layers of the texture: six materials, and noise over large distances in all four channels.
const int kTurf = 0, kShrub = 1, kSoil = 2, kScree = 3, kRock = 4, kSnow = 5, kLarge = 6;
// Number of scales. kLarge covers the ground at the last one.
const int kScales = 5;
const float kMaterialTexels = 512.0;
const float kScaleRatio = 8.0;
// A scale's share of the step to the next one over which both are blended.
const float kScaleFrom = 0.60, kScaleTo = 1.00;
// Factor of the contrast of the nearest ground.
const float kNearContrast = 1.9;
// Difference of the weights of a cell's corners over which both are blended.
const float kBetweenCorners = 0.12;
// Share of the second material in a pixel up to which only the first is drawn.
const float kLeastShare = 0.30;
// Ground that faces the eye less than the inverse of this has less relief.
const float kGrazed = 3.0;
// Components of the normal up to this have no plane of projection.
const float kLeastPlane = 0.55;

// What is known of a point of the ground, and of pixels around it, before the material.
struct GroundPoint {
    vec3 p_eye;
    vec3 along;       // unit, from the eye
    float pixel_m;    // size of a pixel across the ray, metres
    vec3 normal, normals[PIXELS];  // of the samples
    // x: steepness over about 16 m, 1 - z of the normal, y: bend over about 128 m, above 0 in hollows
    vec2 lie, lies[PIXELS];
    float height_m;
    float above_water_m;  // 1e9 without water
#if PIXELS > 1
    bvec2 is_smooth;      // whether the blocks beside it along x and y are on the same surface
#endif
};
// The surface at some pixels.
struct GroundSurface {
    vec3 albedo[PIXELS];
    vec3 normal[PIXELS];
    float tone[PIXELS];  // albedo relative to the mean of its material
    float roughness;
};

vec2 offset_of(ivec2 corner, int salt) {
    uint hash = uint(corner.x) * 0x9e3779b1u ^ uint(corner.y) * 0x85ebca77u ^ uint(salt) * 0xc2b2ae3du;
    hash = (hash ^ (hash >> 15)) * 0x2c1b3c6du;
    hash ^= hash >> 13;
    return vec2(float(hash & 0xffffu), float(hash >> 16)) / 65536.0;
}

// The two heaviest corners of a triangle of half periods, and their weights; the second is 0 for most places.
// at, period: place in the eye's period, and number of that period
struct Corners {
    ivec2 first, second;
    vec2 weights;
};
Corners corners_of(vec2 at, ivec2 period) {
    vec2 place = 2.0 * at;
    vec2 corner = floor(place);
    vec2 inside = place - corner;
    ivec2 south_west = ivec2(corner) + 2 * period;
    ivec2 beside = inside.x > inside.y ? ivec2(1, 0) : ivec2(0, 1);
    float a = 1.0 - max(inside.x, inside.y), b = abs(inside.x - inside.y), c = min(inside.x, inside.y);
    bool is_a = a >= b && a >= c, is_b = !is_a && b >= c;
    ivec2 first = is_a ? ivec2(0) : (is_b ? beside : ivec2(1));
    bool is_second_a = !is_a && (is_b ? a >= c : a >= b), is_second_b = !is_b && (is_a ? b >= c : !is_second_a);
    ivec2 second = is_second_a ? ivec2(0) : (is_second_b ? beside : ivec2(1));
    float most = max(a, max(b, c));
    float middle = a + b + c - most - min(a, min(b, c));
    float share = max(0.5 - 0.5 * (most - middle) / kBetweenCorners, 0.0);
    vec2 weights = vec2(1.0 - share, share);
    return Corners(south_west + first, south_west + second, weights * inversesqrt(dot(weights, weights)));
}

// Weights of the materials, 1 in all.
struct Weights {
    vec3 low, high;  // turf, shrub, soil; scree, rock, snow
};
float weight_of(Weights weights, int layer) {
    vec3 of = layer < kScree ? weights.low : weights.high;
    int place = layer < kScree ? layer : layer - kScree;
    return place == 0 ? of.x : (place == 1 ? of.y : of.z);
}

// Heaviest and second heaviest material.
struct Cover {
    int first, second;
    float first_weight, second_weight;
};
void consider(int layer, float weight, inout Cover cover) {
    bool is_first = weight > cover.first_weight;
    bool is_second = weight > cover.second_weight;
    cover.second = is_first ? cover.first : (is_second ? layer : cover.second);
    cover.second_weight = is_first ? cover.first_weight : (is_second ? weight : cover.second_weight);
    cover.first = is_first ? layer : cover.first;
    cover.first_weight = is_first ? weight : cover.first_weight;
}
Cover cover_of(Weights weights) {
    Cover cover = Cover(kTurf, kTurf, 0.0, 0.0);
    consider(kSnow, weights.high.z, cover);
    consider(kRock, weights.high.y, cover);
    consider(kScree, weights.high.x, cover);
    consider(kSoil, weights.low.z, cover);
    consider(kShrub, weights.low.y, cover);
    consider(kTurf, weights.low.x, cover);
    return cover;
}

// 0 up to `from`, 1 from `from` + `width` on.
float ramp(float from, float width, float x) { return clamp((x - from) * (1.0 / width), 0.0, 1.0); }
// What selects the materials at a point, all of which varies slowly.
struct Site {
    vec3 normal;  // see GroundPoint
    vec2 lie;
    vec3 large;   // noise of kLarge, around 0
};
// Share of moisture, 0 to 1: hollows, and ground just above the water.
float moisture_of(vec2 lie, float above_water_m) {
    float hollow = ramp(0.005, 0.095, lie.y) * ramp(-0.20, 0.17, -lie.x);
    return max(0.6 * hollow, ramp(-1.2, 1.1, -above_water_m));
}

Weights weights_at(Site site, float height_m, float above_water_m, float moisture) {
    float bend = site.lie.y;
    // mostly over a fixed baseline, so that the cover does not depend on the distance
    float steep = mix(site.lie.x, 1.0 - site.normal.z, 0.35) + 0.12 * site.large.z - materials_of.lines.z;
    float high = (height_m - frame.tint.x) * frame.tint.y + 0.12 * site.large.z;
    float cold = (height_m - materials_of.lines.x) * materials_of.lines.y + 1.1 * site.large.z;
    Weights made;
    // snow stays on ground less steep than rock, longer in hollows
    made.high.z = ramp(-0.5, 1.0, cold + 2.0 * bend) * ramp(-0.16, 0.14, -steep);
    float rest = 1.0 - made.high.z;
    made.high.y = rest * ramp(0.0, 0.10, steep);
    rest -= made.high.y;
    made.high.x = rest * min(ramp(0.0, 0.25, high - materials_of.cover.z) +
                                0.8 * ramp(-0.04, 0.06, steep), 1.0);
    rest -= made.high.x;
    made.low.z = rest * max(ramp(0.10, 0.16, materials_of.cover.y + 0.3 * site.large.x - 0.15 - 2.0 * bend -
                                                0.2 * moisture),
                           ramp(-2.5, 1.7, 2.0 * site.large.z - above_water_m));
    rest -= made.low.z;
    made.low.y = rest * ramp(-0.10, 0.24, materials_of.cover.x + site.large.z + 1.5 * bend - 0.5 * high);
    made.low.x = rest - made.low.y;
    return made;
}

// The surface of the ground at pixels of one surface around a point.
GroundSurface ground_surface(GroundPoint at, vec3 p_eye[PIXELS]) {
    float facing = max(abs(dot(at.along, at.normal)), 0.08);
    float footprint = at.pixel_m * inversesqrt(facing);
#if ANISOTROPY > 1
    // the pixel's axes on the ground: away from the eye it is longer
    vec3 across = cross(at.along, at.normal);
    across *= at.pixel_m * inversesqrt(max(dot(across, across), 1e-6));
    vec3 away = at.along - at.normal * dot(at.along, at.normal);
    away *= at.pixel_m * inversesqrt(max(dot(away, away), 1e-6)) / facing;
#endif
    // mipmap of the first scale, and the place among scales
    float lod = log2(footprint * kMaterialTexels * materials_of.place[0].w);
    float wanted = clamp(lod / log2(kScaleRatio), 0.0, float(kScales - 1));

    vec4 last_place = materials_of.place[kScales - 1];
    // of the longer side of what shares the lookup, because aliases would show as patches of materials
    float large_lod = log2(sqrt(float(PIXELS)) * at.pixel_m / facing * kMaterialTexels * last_place.w);
    vec3 large = textureLod(materials, vec3(last_place.xy + at.p_eye.xy * last_place.w, float(kLarge)),
                            large_lod).xyz - 0.5;
    float moisture = moisture_of(at.lie, at.above_water_m);
#if PIXELS > 1
    // between the centres of blocks the noise is linear
    vec3 large_x = at.is_smooth.x ? 0.25 * dFdx(large) : vec3(0.0);
    vec3 large_y = at.is_smooth.y ? 0.25 * dFdy(large) : vec3(0.0);
#endif
    Weights weights[PIXELS], mean = Weights(vec3(0.0), vec3(0.0));
    for (int i = 0; i < PIXELS; ++i) {
        Site site = Site(at.normals[i], at.lies[i], large);
#if PIXELS > 1
        site.large += side_of(i).x * large_x + side_of(i).y * large_y;
#endif
        float rise = p_eye[i].z - at.p_eye.z;
        weights[i] = weights_at(site, at.height_m + rise, at.above_water_m + rise, moisture);
        mean.low += weights[i].low;
        mean.high += weights[i].high;
    }
    Cover cover = cover_of(mean);
    // shares of the second material
    float seconds[PIXELS], most_second = 0.0;
    for (int i = 0; i < PIXELS; ++i) {
        float first = weight_of(weights[i], cover.first), second = weight_of(weights[i], cover.second);
#if PIXELS > 1
        // far boundaries are as wide as blocks
        float mean_share = BLOCKS == NEAR_BLOCKS ? 0.0 : 1.0 / float(PIXELS);
        first += mean_share * cover.first_weight;
        second += mean_share * cover.second_weight;
#endif
        seconds[i] = smoothstep(kLeastShare, 1.0 - kLeastShare, second / max(first + second, 1e-6));
        most_second = max(most_second, seconds[i]);
    }

    int scale = min(int(wanted), kScales - 2);
    float next = smoothstep(kScaleFrom, kScaleTo, wanted - float(scale));
    vec2 scales = vec2(1.0 - next, next);
    // the smallest scale, whose texels are larger than pixels near the eye, has more contrast
    scales *= inversesqrt(dot(scales, scales)) * mix(kNearContrast, 1.0, smoothstep(0.3, 2.2, wanted));
    vec3 planes = max(abs(at.normal) - kLeastPlane, 0.0);
    planes *= planes;
    planes /= planes.x + planes.y + planes.z;

    // Lookups, a bit each: 3 for the plane's axis, times 2 for the scale, times 2 for the material, times 2 for the
    // corner. The corner's bit is added where it is needed. One loop, because a software rasteriser executes nested
    // ones and branches slowly.
    int axes = (planes.x > 0.0 ? 1 : 0) | (planes.y > 0.0 ? 2 : 0) | (planes.z > 0.0 ? 4 : 0);
    int lookups = (scales.x > 0.0 ? axes : 0) | (scales.y > 0.0 ? axes << 3 : 0);
    lookups |= most_second > 0.0 ? lookups << 6 : 0;
    vec4 detail[PIXELS], other[PIXELS];  // of both materials, xyz: slopes, w: tone
    float higher[PIXELS];                // height of the second one's texture above the first one's
    for (int i = 0; i < PIXELS; ++i) {
        detail[i] = other[i] = vec4(0.0);
        higher[i] = 0.0;
    }
    // the condition is at the end, because such a rasteriser completes the pass that a break leaves
    do {
        int bit = findLSB(lookups);
        lookups &= lookups - 1;
        bool is_corner = bit >= 12;
        int of = is_corner ? bit - 12 : bit;
        bool is_second = of >= 6;
        of = is_second ? of - 6 : of;
        bool is_next = of >= 3;
        int axis = is_next ? of - 3 : of;
        bool is_x = axis == 0, is_z = axis == 2;
        int at_scale = scale + (is_next ? 1 : 0);
        vec4 place = materials_of.place[at_scale];
        ivec3 period = materials_of.cell[at_scale].xyz;
        vec3 p = place.xyz + at.p_eye * place.w;
        vec2 on = is_z ? p.xy : (is_x ? p.yz : p.xz);
        Corners corners = corners_of(on, is_z ? period.xy : (is_x ? period.yz : period.xz));
        lookups |= !is_corner && corners.weights.y > 0.0 ? 1 << (bit + 12) : 0;
        int layer = is_second ? cover.second : cover.first;
        vec2 start = offset_of(is_corner ? corners.second : corners.first, layer) +
                     (is_z ? place.xy : (is_x ? place.yz : place.xz));
        float weight = (is_z ? planes.z : (is_x ? planes.x : planes.y)) * (is_next ? scales.y : scales.x) *
                       (is_corner ? corners.weights.y : corners.weights.x);
#if ANISOTROPY > 1
        vec2 shorter = place.w * (is_z ? across.xy : (is_x ? across.yz : across.xz));
        vec2 longer = place.w * (is_z ? away.xy : (is_x ? away.yz : away.xz));
#else
        float mipmap = lod - float(at_scale) * log2(kScaleRatio);
#endif
        for (int i = 0; i < PIXELS; ++i) {
            vec3 q = p_eye[i];
            vec3 texel_at = vec3(start + place.w * (is_z ? q.xy : (is_x ? q.yz : q.xz)), float(layer));
#if ANISOTROPY > 1
            vec4 texel = textureGrad(materials, texel_at, shorter, longer) - 0.5;
#else
            vec4 texel = textureLod(materials, texel_at, mipmap) - 0.5;
#endif
            texel *= weight;
            vec4 found = vec4(is_x ? 0.0 : texel.x, is_z ? texel.y : (is_x ? texel.x : 0.0), is_z ? 0.0 : texel.y,
                              texel.z);
            detail[i] += is_second ? vec4(0.0) : found;
            other[i] += is_second ? found : vec4(0.0);
            higher[i] += is_second ? texel.w : -texel.w;
        }
    } while (lookups != 0);

    vec4 dark = materials_of.dark[cover.first], light = materials_of.light[cover.first];
    vec4 other_dark = materials_of.dark[cover.second], other_light = materials_of.light[cover.second];
    float variation = materials_of.cover.w * large.y;
    // hollows see less of the sky
    float occlusion = materials_of.lines.w * clamp(5.0 * at.lie.y, -0.25, 1.0);
    float factor = (1.0 - 0.45 * moisture) * (1.0 - 0.6 * occlusion) * (1.0 + materials_of.cover.w * large.z);
    // the samples already have the slopes of larger pixels
    float finer = clamp(0.30 + 0.14 * log2(frame.grid.x / at.pixel_m), 0.15, 1.0);
#if ANISOTROPY == 1
    // along the ray a pixel of grazed ground covers several texels, whose mean has less relief
    finer *= min(kGrazed * facing, 1.0);
#endif
    GroundSurface made;
    made.roughness = mix(mix(dark.w, other_dark.w, seconds[0]), 0.1, moisture);
    for (int i = 0; i < PIXELS; ++i) {
        // the higher texture covers the lower one
        float second = seconds[i];
        float covered = clamp(second + 2.5 * min(second, 1.0 - second) * higher[i], 0.0, 1.0);
        vec2 tones = clamp(0.5 + variation + vec2(detail[i].w, other[i].w), 0.0, 1.0);
        made.albedo[i] = factor * mix(mix(dark.rgb, light.rgb, tones.x), mix(other_dark.rgb, other_light.rgb, tones.y),
                                      covered);
        made.tone[i] = 0.5 + mix(tones.x, tones.y, covered);
        vec3 rise = mix(light.w * detail[i].xyz, other_light.w * other[i].xyz, covered);
        made.normal[i] = normalize(at.normals[i] - finer * rise);
    }
    return made;
}

// Factor of the albedo that gives, under diffuse lighting, the light of a rough surface from the sun.
// along: unit, from the eye
float rough_factor(float roughness, vec3 normal, vec3 along) {
    float to_sun = max(dot(normal, frame.sun.xyz), 0.0);
    float to_eye = max(-dot(normal, along), 0.05);
    float between = -dot(frame.sun.xyz, along) - to_sun * to_eye;
    float squared = roughness * roughness;
    float a = 1.0 - 0.5 * squared / (squared + 0.33), b = 0.45 * squared / (squared + 0.09);
    float factor = a + b * between / (between > 0.0 ? max(to_sun, to_eye) : 1.0);
    return clamp(factor, 0.4, 1.5);
}
#endif
