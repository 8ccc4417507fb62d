// SPDX-License-Identifier: MIT
// Imagery of the ground: see ground_imagery.h.

#ifdef IMAGERY
layout(binding = 8) uniform isamplerBuffer imagery_table;  // xy: square relative to the eye's, z: its level (-1: free),
                                                           // w: layer times 256, plus presence, 0 to 255
layout(binding = 9) uniform sampler2DArray imagery_squares;  // colour times opacity, opacity
layout(std140, binding = 3) uniform Imagery {
    float root_texel;  // side of a texel at level 0, metres
    int finest_level;
    int mask;          // of the table
    float texel;       // side of the finest texel of the source, metres
    vec4 levels[25];   // xy: position of the eye in its square of the level, 0 to 1, z: 1 / side, 1/m
} imagery;

const float kImageryTexels = 256.0, kImageryBorder = 4.0;
const float kMostMipmap = 2.0;
// Range of the source's texel width, in pixels, over which imagery loses a share of its colour to the procedural
// ground: coarse texels look blurred.
const float kCoarseFrom = 8.0, kCoarseTo = 200.0, kCoarseLoss = 0.35;

// Displayed colour times opacity, and opacity, filtered to the size of a pixel.
vec4 imagery_at(vec3 p_eye, float pixel_m) {
    float wanted = log2(imagery.root_texel / pixel_m);
    vec4 colour = vec4(0.0);
    float rest = 1.0;  // weight left for coarser squares
    for (int level = clamp(int(ceil(wanted)), 0, imagery.finest_level); level >= 0 && rest > 0.0;
         --level) {
        vec4 grid = imagery.levels[level];
        vec2 place = grid.xy + p_eye.xy * grid.z;
        int found = find_entry(imagery_table, imagery.mask, ivec2(floor(place)), level);
        float presence = found < 0 ? 0.0 : rest * float(found & 255) / 255.0;
        vec2 at = (kImageryBorder + (kImageryTexels - 2.0 * kImageryBorder) * fract(place)) /
                  kImageryTexels;
        float mipmap = clamp(float(level) - wanted, 0.0, kMostMipmap);
        colour += presence * textureLod(imagery_squares, vec3(at, float(found >> 8)), mipmap);
        rest -= presence;
    }
    float blur = smoothstep(log2(kCoarseFrom), log2(kCoarseTo), log2(imagery.texel / pixel_m));
    return colour * (1.0 - kCoarseLoss * blur);
}

// Albedo of ground that is displayed in this colour if it is level and sunlit: the inverse of display(), without its
// contrast.
vec3 albedo_of(vec3 shown) {
#ifdef ATMOSPHERE
    // exposed light of level ground at noon
    const float kNoon = 1.3;
    return light_shown_as(shown) / kNoon;
#else
    vec3 squared = min(shown * shown, 0.85);
    return 0.80 * squared / (1.0 - squared) / (kSunLight * max(frame.sun.z, 0.3) + kSkyLight);
#endif
}
#endif
