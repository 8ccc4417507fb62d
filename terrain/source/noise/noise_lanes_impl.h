// SPDX-License-Identifier: MIT
//
// Part of noise_kernels_impl.h: vectors as wide as the including source may have.
#pragma once

#include "source/noise/noise_kernels.h"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace terrane::internal {
namespace {

#if defined(__AVX512F__)
constexpr int kLanes = 8;
#elif defined(__AVX2__)
constexpr int kLanes = 4;
#else
constexpr int kLanes = 2;
#endif
static_assert(kNoiseGroup % kLanes == 0 && kMaxNoiseColumns % kNoiseGroup == 0);

using Doubles = double __attribute__((vector_size(8 * kLanes)));
using Words = uint64_t __attribute__((vector_size(8 * kLanes)));

constexpr uint64_t kSign = uint64_t{1} << 63;

int whole_groups(int count) { return (count + kNoiseGroup - 1) / kNoiseGroup * kNoiseGroup; }

Doubles load(const double* from) {
    Doubles value;
    __builtin_memcpy(&value, from, sizeof(value));
    return value;
}
Words load(const uint64_t* from) {
    Words value;
    __builtin_memcpy(&value, from, sizeof(value));
    return value;
}
void store(double* to, Doubles value) { __builtin_memcpy(to, &value, sizeof(value)); }
void store(uint64_t* to, Words value) { __builtin_memcpy(to, &value, sizeof(value)); }

Words bits(Doubles value) { return __builtin_bit_cast(Words, value); }
Doubles doubles(Words value) { return __builtin_bit_cast(Doubles, value); }
Doubles spread(double value) { return value - Doubles{}; }  // a sum would lose the sign of -0.0

/// 0, 1, 2, ...
Words ramp() {
    constexpr uint64_t kRamp[] = {0, 1, 2, 3, 4, 5, 6, 7};
    return load(kRamp);
}

/// Of integers below 2^52.
Doubles to_doubles(Words value) {
    constexpr uint64_t kBits = 0x4330000000000000u;  // of 2^52
    return doubles(value | kBits) - 0x1p52;
}

/// Products of the low halves.
Words low_product(Words left, Words right) {
#if defined(__AVX512F__)
    return __builtin_bit_cast(Words, _mm512_maskz_mul_epu32(0xff, __builtin_bit_cast(__m512i, left),
                                                            __builtin_bit_cast(__m512i, right)));
#elif defined(__AVX2__)
    return __builtin_bit_cast(Words, _mm256_mul_epu32(__builtin_bit_cast(__m256i, left),
                                                      __builtin_bit_cast(__m256i, right)));
#elif defined(__SSE2__)
    return __builtin_bit_cast(Words, _mm_mul_epu32(__builtin_bit_cast(__m128i, left),
                                                   __builtin_bit_cast(__m128i, right)));
#else
    return (left & 0xffffffffu) * (right & 0xffffffffu);
#endif
}

Words mix(Words value) {
    value = (value ^ (value >> 30)) * kMixFirst;
    value = (value ^ (value >> 27)) * kMixSecond;
    return value ^ (value >> 31);
}

Doubles fade(Doubles t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

struct FadePair {
    Doubles first, second;
};
/// Two at once, step by step.
FadePair fade(Doubles s, Doubles t) {
    Doubles s_factor = s * 6.0, t_factor = t * 6.0;
    Doubles s_cube = s * s, t_cube = t * t;
    s_factor = s_factor - 15.0, t_factor = t_factor - 15.0;
    s_cube = s_cube * s, t_cube = t_cube * t;
    s_factor = s * s_factor, t_factor = t * t_factor;
    s_factor = s_factor + 10.0, t_factor = t_factor + 10.0;
    return {s_cube * s_factor, t_cube * t_factor};
}

#if defined(__AVX512F__)

/// The lanes of a register that make_lanes() names, or pick_next() the ones above them.
Doubles pick(Doubles from, Words lanes) {
    // All lanes enabled: the unmasked intrinsic triggers a warning of g++ 12.
    return _mm512_maskz_permutexvar_pd(0xff, __builtin_bit_cast(__m512i, lanes), from);
}
Doubles pick_next(Doubles from, Words lanes) { return pick(from, lanes + 1); }
Words make_lanes(Words relative) { return relative; }

#elif defined(__AVX2__)

/// The lanes of a register that make_lanes() names, or pick_next() the ones above them.
Doubles pick(Doubles from, Words lanes) {
    return __builtin_bit_cast(Doubles,
                              _mm256_permutevar8x32_ps(__builtin_bit_cast(__m256, from),
                                                       __builtin_bit_cast(__m256i, lanes)));
}
Doubles pick_next(Doubles from, Words lanes) {
    return pick(from, lanes + ((uint64_t{2} << 32) | 2));
}
/// Two halves for each lane.
Words make_lanes(Words relative) {
    return (relative << 1) | (relative << 33) | (uint64_t{1} << 32);
}

#else

/// Both lanes have the first node of two, or they would not be in one register.
Doubles pick(Doubles from, Words /*lanes*/) { return Doubles{from[0], from[0]}; }
Doubles pick_next(Doubles from, Words /*lanes*/) { return Doubles{from[1], from[1]}; }
Words make_lanes(Words relative) { return relative; }

#endif

}  // namespace
}  // namespace terrane::internal
