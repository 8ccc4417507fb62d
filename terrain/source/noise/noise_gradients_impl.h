// SPDX-License-Identifier: MIT
//
// Part of noise_kernels_impl.h: gradients of nodes, and the noise between four of them.
#pragma once

#include "source/noise/noise_lanes_impl.h"

namespace terrane::internal {
namespace {

struct Gradients {
    Doubles x, y;
};
/// Of two nodes for each lane.
struct GradientPair {
    Gradients first, second;
};

#if defined(__AVX2__)

/// Hash of a node from those of its two indices; its six highest bits name the gradient.
[[gnu::always_inline]] inline Words node_hash(Words x_hash, Words y_hash) {
    const Words hash = (x_hash ^ y_hash) * kNodeFirst;
    const Words folded = hash ^ (hash >> 32);
#if defined(__AVX512F__)
    return folded * kNodeSecond;
#else
    // the upper half of the product: all that is read
    const Words swapped = (kNodeSecond >> 32 | kNodeSecond << 32) + Words{};
    const __m256i across = _mm256_mullo_epi32(__builtin_bit_cast(__m256i, folded),
                                              __builtin_bit_cast(__m256i, swapped));
    const __m256i low = __builtin_bit_cast(__m256i, low_product(folded, kNodeSecond + Words{}));
    return __builtin_bit_cast(
        Words, _mm256_add_epi32(_mm256_add_epi32(low, across), _mm256_slli_epi64(across, 32)));
#endif
}

#if defined(__AVX512F__)

[[gnu::always_inline]] inline Gradients gradients_of(Words hash) {
    const Doubles low = load(kNoiseCosines), high = load(kNoiseCosines + 8);
    const Words index = hash >> 58;
    const Doubles x = _mm512_permutex2var_pd(low, __builtin_bit_cast(__m512i, index), high);
    const Doubles y = _mm512_permutex2var_pd(low, __builtin_bit_cast(__m512i, index ^ 15), high);
    return {doubles(bits(x) ^ ((hash << 1) & kSign)), doubles(bits(y) ^ (hash & kSign))};
}

[[gnu::always_inline]] inline GradientPair gradients_of(Words first, Words second) {
    return {gradients_of(first), gradients_of(second)};
}

#else

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

/// Entries of two tables of eight, the second's where the index's bit 3 is set.
__m256 look_up(const uint32_t* low, const uint32_t* high, __m256i index, __m256i is_high) {
    __m256 from_low, from_high;
    __builtin_memcpy(&from_low, low, sizeof(from_low));
    __builtin_memcpy(&from_high, high, sizeof(from_high));
    return _mm256_blendv_ps(_mm256_permutevar8x32_ps(from_low, index),
                            _mm256_permutevar8x32_ps(from_high, index),
                            __builtin_bit_cast(__m256, is_high));
}

__m256 negate(__m256 values, __m256i signs) {
    const __m256i sign = _mm256_set1_epi32(static_cast<int>(0x80000000u));
    return _mm256_xor_ps(values, __builtin_bit_cast(__m256, _mm256_and_si256(signs, sign)));
}

/// Eight at once: the hashes' upper halves in one register, in the order that unpacking undoes.
[[gnu::always_inline]] inline GradientPair gradients_of(Words first, Words second) {
    const __m256i hash =
        __builtin_bit_cast(__m256i, _mm256_shuffle_ps(__builtin_bit_cast(__m256, first),
                                                      __builtin_bit_cast(__m256, second), 0xdd));
    const __m256i index = _mm256_srli_epi32(hash, 26), is_high = _mm256_slli_epi32(hash, 2);
    const __m256i mirrored = _mm256_xor_si256(index, _mm256_set1_epi32(15));
    const uint32_t* const lower = kHalves.low;
    const uint32_t* const upper = kHalves.high;
    const __m256 x_low = look_up(lower, lower + 8, index, is_high);
    const __m256 y_low = look_up(lower + 8, lower, mirrored, is_high);
    const __m256 x_high =
        negate(look_up(upper, upper + 8, index, is_high), _mm256_slli_epi32(hash, 1));
    const __m256 y_high = negate(look_up(upper + 8, upper, mirrored, is_high), hash);
    return {{__builtin_bit_cast(Doubles, _mm256_unpacklo_ps(x_low, x_high)),
             __builtin_bit_cast(Doubles, _mm256_unpacklo_ps(y_low, y_high))},
            {__builtin_bit_cast(Doubles, _mm256_unpackhi_ps(x_low, x_high)),
             __builtin_bit_cast(Doubles, _mm256_unpackhi_ps(y_low, y_high))}};
}

#endif

[[gnu::always_inline]] inline GradientPair gradients_of(const uint64_t* first_x,
                                                        const uint64_t* second_x,
                                                        const uint64_t* y) {
    const Words row = load(y);
    return gradients_of(node_hash(load(first_x), row), node_hash(load(second_x), row));
}

#else

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

/// Number of a node's gradient. Two lanes multiply 64 bits no faster than one.
uint64_t node_index(uint64_t x_hash, uint64_t y_hash) {
    const uint64_t hash = (x_hash ^ y_hash) * kNodeFirst;
    return ((hash ^ (hash >> 32)) * kNodeSecond) >> 58;
}

/// Of nodes with hashes x[0], y[0] and x[1], y[1].
[[gnu::always_inline]] inline Gradients gradients_of(const uint64_t* x, const uint64_t* y) {
    const uint64_t here = node_index(x[0], y[0]), there = node_index(x[1], y[1]);
    return {Doubles{kGradients.x[here], kGradients.x[there]},
            Doubles{kGradients.y[here], kGradients.y[there]}};
}
[[gnu::always_inline]] inline GradientPair gradients_of(const uint64_t* first_x,
                                                        const uint64_t* second_x,
                                                        const uint64_t* y) {
    return {gradients_of(first_x, y), gradients_of(second_x, y)};
}

#endif

/// Calls write(node, gradients) for each vector of a row of nodes.
///
/// @param x_hashes [count] a multiple of two vectors, or of one of eight lanes
template <class Write>
void for_each_gradients(const uint64_t* x_hashes, int count, uint64_t y_hash, Write write) {
    alignas(64) uint64_t row[kLanes];
    store(row, y_hash + Words{});
#if defined(__AVX512F__)
    for (int node = 0; node < count; node += kLanes) {
        write(node, gradients_of(node_hash(load(x_hashes + node), load(row))));
    }
#elif defined(__AVX2__)
    for (int node = 0; node < count; node += 2 * kLanes) {
        const GradientPair pair = gradients_of(x_hashes + node, x_hashes + node + kLanes, row);
        write(node, pair.first);
        write(node + kLanes, pair.second);
    }
#else
    for (int node = 0; node < count; node += kLanes) {
        write(node, gradients_of(x_hashes + node, row));
    }
#endif
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
