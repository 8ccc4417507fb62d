// SPDX-License-Identifier: MIT
//
// Part of noise_kernels_impl.h: vectors as wide as the including source may have, and the noise of
// a vector of places.
#pragma once

#include "noise_kernels.h"

#if defined(__AVX2__) || defined(__AVX512F__)
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

Words mix(Words value) {
    value = (value ^ (value >> 30)) * kMixFirst;
    value = (value ^ (value >> 27)) * kMixSecond;
    return value ^ (value >> 31);
}

Doubles fade(Doubles t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

struct Gradients {
    Doubles x, y;
};

#if defined(__AVX512F__)

bool any(Words value) {
    const __m512i lanes = __builtin_bit_cast(__m512i, value);
    return _mm512_test_epi64_mask(lanes, lanes) != 0;
}

/// The lanes of a register that make_lanes() names, or pick_next() the ones above them.
Doubles pick(Doubles from, Words lanes) {
    // masked by nothing: the plain one makes g++ 12 warn of what it leaves undefined
    return _mm512_maskz_permutexvar_pd(0xff, __builtin_bit_cast(__m512i, lanes), from);
}
Doubles pick_next(Doubles from, Words lanes) { return pick(from, lanes + 1); }
Words make_lanes(Words relative) { return relative; }

Gradients gradients_of(Words hash) {
    const Doubles low = load(kNoiseCosines), high = load(kNoiseCosines + 8);
    const Words index = hash >> 58;
    const Doubles x = _mm512_permutex2var_pd(low, __builtin_bit_cast(__m512i, index), high);
    const Doubles y = _mm512_permutex2var_pd(low, __builtin_bit_cast(__m512i, index ^ 15), high);
    return {doubles(bits(x) ^ ((hash << 1) & kSign)), doubles(bits(y) ^ (hash & kSign))};
}

struct GradientPair {
    Gradients first, second;
};
GradientPair gradients_of(Words first, Words second) {
    return {gradients_of(first), gradients_of(second)};
}

#elif defined(__AVX2__)

bool any(Words value) {
    const __m256i lanes = __builtin_bit_cast(__m256i, value);
    return _mm256_testz_si256(lanes, lanes) == 0;
}

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

/// The halves of kNoiseCosines apart.
struct CosineHalves {
    alignas(32) uint32_t low[16] = {}, high[16] = {};
};
constexpr CosineHalves make_halves() {
    CosineHalves halves;
    for (int index = 0; index < 16; ++index) {
        const uint64_t all = __builtin_bit_cast(uint64_t, kNoiseCosines[index]);
        halves.low[index] = static_cast<uint32_t>(all);
        halves.high[index] = static_cast<uint32_t>(all >> 32);
    }
    return halves;
}
constexpr CosineHalves kHalves = make_halves();

/// Entries of a table of sixteen; of an index the four low bits count.
__m256 look_up(const uint32_t (&table)[16], __m256i index) {
    __m256 low, high;
    __builtin_memcpy(&low, table, sizeof(low));
    __builtin_memcpy(&high, table + 8, sizeof(high));
    return _mm256_blendv_ps(_mm256_permutevar8x32_ps(low, index),
                            _mm256_permutevar8x32_ps(high, index),
                            __builtin_bit_cast(__m256, _mm256_slli_epi32(index, 28)));
}

struct GradientPair {
    Gradients first, second;
};
/// Eight at once: their indices as the halves of one register, in the order that unpacking undoes.
GradientPair gradients_of(Words first, Words second) {
    const __m256i index = __builtin_bit_cast(
        __m256i, _mm256_shuffle_ps(__builtin_bit_cast(__m256, first >> 58),
                                   __builtin_bit_cast(__m256, second >> 58), 0x88));
    const __m256i mirrored = _mm256_xor_si256(index, _mm256_set1_epi32(15));
    const __m256 x_low = look_up(kHalves.low, index), x_high = look_up(kHalves.high, index);
    const __m256 y_low = look_up(kHalves.low, mirrored), y_high = look_up(kHalves.high, mirrored);
    const Words first_x = __builtin_bit_cast(Words, _mm256_unpacklo_ps(x_low, x_high));
    const Words second_x = __builtin_bit_cast(Words, _mm256_unpackhi_ps(x_low, x_high));
    const Words first_y = __builtin_bit_cast(Words, _mm256_unpacklo_ps(y_low, y_high));
    const Words second_y = __builtin_bit_cast(Words, _mm256_unpackhi_ps(y_low, y_high));
    return {{doubles(first_x ^ ((first << 1) & kSign)), doubles(first_y ^ (first & kSign))},
            {doubles(second_x ^ ((second << 1) & kSign)), doubles(second_y ^ (second & kSign))}};
}

#else

bool any(Words value) { return (value[0] | value[1]) != 0; }

/// Both lanes have the first node of two, or they would not be in one register.
Doubles pick(Doubles from, Words /*lanes*/) { return Doubles{from[0], from[0]}; }
Doubles pick_next(Doubles from, Words /*lanes*/) { return Doubles{from[1], from[1]}; }
Words make_lanes(Words relative) { return relative; }

struct GradientTable {
    double x[64] = {}, y[64] = {};
};
constexpr GradientTable make_table() {
    GradientTable table;
    for (int index = 0; index < 64; ++index) {
        const double x = kNoiseCosines[index & 15], y = kNoiseCosines[15 - (index & 15)];
        table.x[index] = (index & 16) != 0 ? -x : x;
        table.y[index] = (index & 32) != 0 ? -y : y;
    }
    return table;
}
constexpr GradientTable kGradients = make_table();

struct GradientPair {
    Gradients first, second;
};
GradientPair gradients_of(Words first, Words second) {
    const auto look_up = [](Words hash) {
        const uint64_t here = hash[0] >> 58, there = hash[1] >> 58;
        return Gradients{Doubles{kGradients.x[here], kGradients.x[there]},
                         Doubles{kGradients.y[here], kGradients.y[there]}};
    };
    return {look_up(first), look_up(second)};
}

#endif

/// Hash of a node from those of its two indices; its six highest bits name the gradient.
Words node_hash(Words x_hash, Words y_hash) {
    const Words hash = (x_hash ^ y_hash) * kNodeFirst;
    return (hash ^ (hash >> 32)) * kNodeSecond;
}

/// Two nodes above one another, their gradients blended along y.
struct Blend {
    Doubles slope, offset;
};
Blend blend_of(const Gradients& low, const Gradients& high, Doubles fraction, Doubles fade) {
    const Doubles low_offset = low.y * fraction;
    const Doubles high_offset = high.y * (fraction - 1.0);
    return {low.x + fade * (high.x - low.x), low_offset + fade * (high_offset - low_offset)};
}

Doubles blend_along_x(const Blend& low, const Blend& high, Doubles fraction, Doubles fade) {
    const Doubles from_low = low.slope * fraction + low.offset;
    const Doubles from_high = high.slope * (fraction - 1.0) + high.offset;
    return from_low + fade * (from_high - from_low);
}

}  // namespace
}  // namespace terrane::internal
