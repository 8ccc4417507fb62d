// SPDX-License-Identifier: MIT
//
// Part of noise_kernels_impl.h: vectors of the width that the including source is compiled for.
#pragma once

#include "source/fractal/noise_kernels.h"

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

/// Converts integers below 2^52.
Doubles to_doubles(Words value) {
    constexpr uint64_t kBits = 0x4330000000000000u;  // of 2^52
    return doubles(value | kBits) - 0x1p52;
}

/// Products of the lower 32 bits of the lanes.
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
/// Two fades at once, interleaved step by step.
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

/// Selects lanes of a register by the indices from make_lanes(); pick_next() selects the lane after each of them.
Doubles pick(Doubles from, Words lanes) {
    // all lanes enabled: the unmasked intrinsic triggers a warning of g++ 12
    return _mm512_maskz_permutexvar_pd(0xff, __builtin_bit_cast(__m512i, lanes), from);
}
Doubles pick_next(Doubles from, Words lanes) { return pick(from, lanes + 1); }
Words make_lanes(Words relative) { return relative; }

#elif defined(__AVX2__)

/// Selects lanes of a register by the indices from make_lanes(); pick_next() selects the lane after each of them.
Doubles pick(Doubles from, Words lanes) {
    return __builtin_bit_cast(Doubles,
                              _mm256_permutevar8x32_ps(__builtin_bit_cast(__m256, from),
                                                       __builtin_bit_cast(__m256i, lanes)));
}
Doubles pick_next(Doubles from, Words lanes) {
    return pick(from, lanes + ((uint64_t{2} << 32) | 2));
}
/// Indices of the two 32-bit halves of each lane.
Words make_lanes(Words relative) {
    return (relative << 1) | (relative << 33) | (uint64_t{1} << 32);
}

#else

/// A near run (NoiseRun) of two lanes has one lower node only, the first of the two nodes in the register.
Doubles pick(Doubles from, Words /*lanes*/) { return Doubles{from[0], from[0]}; }
Doubles pick_next(Doubles from, Words /*lanes*/) { return Doubles{from[1], from[1]}; }
Words make_lanes(Words relative) { return relative; }

#endif

}  // namespace

// Gradients of nodes, and the noise between four nodes.

namespace {

struct Gradients {
    Doubles x, y;
};
/// Gradients of two nodes per lane.
struct GradientPair {
    Gradients first, second;
};

#if defined(__AVX2__)

/// Hash of a node from the hashes of its two indices; its six highest bits are the index of the gradient.
[[gnu::always_inline]] inline Words node_hash(Words x_hash, Words y_hash) {
    const Words hash = (x_hash ^ y_hash) * kNodeFirst;
    const Words folded = hash ^ (hash >> 32);
#if defined(__AVX512F__)
    return folded * kNodeSecond;
#else
    // only the upper half of the product is needed
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

/// The lower and upper halves of kNoiseCosines.
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

/// Looks up indices in two tables of eight entries: in the second one where bit 3 of the index is set.
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

/// Computes eight gradients at once: packs the upper halves of the hashes in an order that unpacking reverses.
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

/// Index of a node's gradient. Scalar, because two lanes multiply 64-bit numbers no faster than one.
uint64_t node_index(uint64_t x_hash, uint64_t y_hash) {
    const uint64_t hash = (x_hash ^ y_hash) * kNodeFirst;
    return ((hash ^ (hash >> 32)) * kNodeSecond) >> 58;
}

/// Gradients of the nodes with hashes x[0], y[0] and x[1], y[1].
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
/// @param x_hashes [count] count must be a multiple of two vectors, or of one vector if that has eight lanes
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

/// Two nodes, one above the other, with their gradients blended along y.
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

// Nodes around points that are close together.

namespace {

/// Nodes to the west and east of points, in one row of nodes.
struct NodesBeside {
    Gradients west, east;
};

/// Reads nodes (x, y, x, y, ...) of a row: for each lane the node at row + at[lane] and the next one.
#if defined(__AVX512F__)
[[gnu::always_inline]] inline NodesBeside read_nodes(const double* row, const uint64_t* at) {
    const auto two = [=](int low, int high) {
        return __builtin_shufflevector(_mm256_loadu_pd(row + at[low]),
                                       _mm256_loadu_pd(row + at[high]), 0, 1, 2, 3, 4, 5, 6, 7);
    };
    // results: western nodes of two lanes, eastern nodes of these lanes, then the same for two other lanes
    const auto x_of = [](Doubles even, Doubles odd) {
        return __builtin_shufflevector(even, odd, 0, 8, 2, 10, 4, 12, 6, 14);
    };
    const auto y_of = [](Doubles even, Doubles odd) {
        return __builtin_shufflevector(even, odd, 1, 9, 3, 11, 5, 13, 7, 15);
    };
    const auto west_of = [](Doubles low, Doubles high) {
        return __builtin_shufflevector(low, high, 0, 1, 4, 5, 8, 9, 12, 13);
    };
    const auto east_of = [](Doubles low, Doubles high) {
        return __builtin_shufflevector(low, high, 2, 3, 6, 7, 10, 11, 14, 15);
    };
    const Doubles low_even = two(0, 2), low_odd = two(1, 3);
    const Doubles high_even = two(4, 6), high_odd = two(5, 7);
    const Doubles low_x = x_of(low_even, low_odd), high_x = x_of(high_even, high_odd);
    const Doubles low_y = y_of(low_even, low_odd), high_y = y_of(high_even, high_odd);
    return {{west_of(low_x, high_x), west_of(low_y, high_y)},
            {east_of(low_x, high_x), east_of(low_y, high_y)}};
}
#elif defined(__AVX2__)
[[gnu::always_inline]] inline NodesBeside read_nodes(const double* row, const uint64_t* at) {
    const auto lane = [=](int i) { return load(row + at[i]); };
    const __m256d first = lane(0), second = lane(1), third = lane(2), fourth = lane(3);
    const __m256d low_x = _mm256_unpacklo_pd(first, second);
    const __m256d low_y = _mm256_unpackhi_pd(first, second);
    const __m256d high_x = _mm256_unpacklo_pd(third, fourth);
    const __m256d high_y = _mm256_unpackhi_pd(third, fourth);
    return {
        {_mm256_permute2f128_pd(low_x, high_x, 0x20), _mm256_permute2f128_pd(low_y, high_y, 0x20)},
        {_mm256_permute2f128_pd(low_x, high_x, 0x31), _mm256_permute2f128_pd(low_y, high_y, 0x31)}};
}
#else
[[gnu::always_inline]] inline Gradients read_gradients(const double* row, const uint64_t* at) {
    const Doubles first = load(row + at[0]), second = load(row + at[1]);
    return {__builtin_shufflevector(first, second, 0, 2),
            __builtin_shufflevector(first, second, 1, 3)};
}
[[gnu::always_inline]] inline NodesBeside read_nodes(const double* row, const uint64_t* at) {
    return {read_gradients(row, at), read_gradients(row + 2, at)};
}
#endif

/// Writes nodes (x, y, x, y, ...).
[[gnu::always_inline]] inline void write_nodes(double* to, const Gradients& nodes) {
#if defined(__AVX512F__)
    store(to, __builtin_shufflevector(nodes.x, nodes.y, 0, 8, 1, 9, 2, 10, 3, 11));
    store(to + kLanes, __builtin_shufflevector(nodes.x, nodes.y, 4, 12, 5, 13, 6, 14, 7, 15));
#elif defined(__AVX2__)
    const __m256d even = _mm256_unpacklo_pd(nodes.x, nodes.y);
    const __m256d odd = _mm256_unpackhi_pd(nodes.x, nodes.y);
    store(to, _mm256_permute2f128_pd(even, odd, 0x20));
    store(to + kLanes, _mm256_permute2f128_pd(even, odd, 0x31));
#else
    store(to, __builtin_shufflevector(nodes.x, nodes.y, 0, 2));
    store(to + kLanes, __builtin_shufflevector(nodes.x, nodes.y, 1, 3));
#endif
}

/// The four nodes around points that all lie in one cell: each vector repeats one number.
struct SplatNodes {
    alignas(64) double numbers[8][kLanes];

    SplatNodes(const double* south, const double* north) {
        for (int i = 0; i < 4; ++i) {
            store(numbers[i], spread(south[i]));
            store(numbers[4 + i], spread(north[i]));
        }
    }
    NodesBeside south() const { return beside(0); }
    NodesBeside north() const { return beside(4); }

private:
    NodesBeside beside(int first) const {
        return {{load(numbers[first]), load(numbers[first + 1])},
                {load(numbers[first + 2]), load(numbers[first + 3])}};
    }
};

/// The nodes of an octave along an axis, from the one below the first unit to the one above the last unit.
struct NodeRange {
    uint64_t origin;  ///< of the first node, in units, including the axis's offset
    uint64_t count;

    NodeRange(const NoiseAxis& axis, uint64_t low, uint64_t extent) {
        const uint64_t shifted = low + axis.offset, inside_mask = (uint64_t{1} << axis.shift) - 1;
        origin = shifted & ~inside_mask;
        count = (((shifted & inside_mask) + extent) >> axis.shift) + 2;
    }
};

/// All nodes of an octave around a set of points, row by row.
struct NodePatch {
    static constexpr uint64_t kMaxNodes = 2048;

    uint64_t pitch;  ///< doubles per row
    alignas(64) double nodes[2 * kMaxNodes];

    static bool has_room(const NodeRange& x, const NodeRange& y) {
        return x.count <= kMaxNodes && y.count <= kMaxNodes && columns_of(x) * y.count <= kMaxNodes;
    }

    /// Requires that the nodes fit.
    void fill(const NoiseOctave& octave, const NodeRange& x, const NodeRange& y) {
        const uint64_t columns = columns_of(x);
        const uint64_t x_first = x.origin >> octave.x.shift, y_first = y.origin >> octave.y.shift;
        const uint64_t x_mask = ~uint64_t{0} >> octave.x.shift;
        const uint64_t y_mask = ~uint64_t{0} >> octave.y.shift;
        alignas(64) uint64_t hashes[kMaxNodes / 2];  // at least two rows
        for (uint64_t column = 0; column < columns; column += kLanes) {
            store(hashes + column, mix(octave.x.key + ((x_first + column + ramp()) & x_mask)));
        }
        pitch = 2 * columns;
        for (uint64_t row = 0; row < y.count; ++row) {
            const Words y_hash = mix(octave.y.key + ((y_first + row) & y_mask) + Words{});
            double* const to = nodes + row * pitch;
            for_each_gradients(
                hashes, static_cast<int>(columns), y_hash[0],
                [=](int column, const Gradients& here) { write_nodes(to + 2 * column, here); });
        }
    }

private:
    static uint64_t columns_of(const NodeRange& x) {
        return static_cast<uint64_t>(whole_groups(static_cast<int>(x.count)));
    }
};

}  // namespace
}  // namespace terrane::internal
