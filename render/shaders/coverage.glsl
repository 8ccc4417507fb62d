// SPDX-License-Identifier: MIT
// Selects the samples of a pixel to which an object of partial coverage is drawn. The program defines SAMPLES.
// Thresholds are spread evenly over the samples of a pixel and over 8 x 8 pixels (B. Bayer, An optimum method for
// two-level rendition of continuous-tone pictures, ICC 1973).

// The threshold of a pixel's first sample times SAMPLES, in [0, 1).
float dither(ivec2 pixel) {
    int x = pixel.x ^ pixel.y, y = pixel.y;
    int rank = ((x & 1) << 5) | ((y & 1) << 4) | ((x & 2) << 2) | ((y & 2) << 1) | ((x & 4) >> 1) |
               ((y & 4) >> 2);
    return (float(rank) + 0.5) / 64.0;
}

// The threshold between drawn and undrawn pixels for a coverage, 0 to 1. A negative coverage is c - 1, rounded; a
// positive one is rounded in the same way, so that c and c - 1 have the same limit.
float limit_of(float coverage) {
    precise float below_one = coverage > 0.0 ? coverage - 1.0 : coverage;
    precise float limit = below_one + 1.0;
    return limit;
}

// coverage: see ObjectInstance. opacity: 0 to 1, rounded to samples, so that outlines are as smooth as those of
// triangles; dithered below one sample, so that thin features are not lost.
int covered_samples(float coverage, float opacity) {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float first = dither(pixel), other = dither(pixel + ivec2(3, 5));
    float limit = coverage == 0.0 ? 0.0 : limit_of(coverage);
    int mask = 0;
    for (int i = 0; i < SAMPLES; ++i) {
        float threshold = (float(i) + first) / float(SAMPLES);
        bool is_covered = coverage < 0.0 ? threshold >= limit : threshold < limit;
        int rank = SAMPLES - 1 - i;
        float level = rank > 0 ? 0.5 : other;
        bool is_opaque = (float(rank) + level) / float(SAMPLES) < opacity;
        if (is_covered && is_opaque) mask |= 1 << i;
    }
    return mask;
}

// Keeps the samples of the pixel that are in the mask.
void keep_samples(int mask) {
    if (mask == 0) discard;
#if SAMPLES > 1
    gl_SampleMask[0] = mask;
#endif
}
