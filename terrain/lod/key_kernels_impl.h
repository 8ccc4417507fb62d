// SPDX-License-Identifier: MIT
//
// The body of key_kernels_*.cpp: each of these defines TERRANE_KERNELS and includes this header once. Plain loops that
// compilers vectorise; only masks, windows and the parents of centres use intrinsics or shuffles. Everything has
// internal linkage: see simd_level.h.
#pragma once

#include "lod/key_kernels.h"

#include <cstring>
#include <limits>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace terrane::internal {
namespace {

constexpr int kSide = 8;  // vertices of one kind in a row of an area
constexpr int kAll = kSide * kSide;
constexpr std::size_t kRow = 129;  // samples in a row of a chunk

using Row = float __attribute__((vector_size(4 * kSide)));
using ShortRow = std::int16_t __attribute__((vector_size(2 * kSide)));
using IntRow = std::int32_t __attribute__((vector_size(4 * kSide)));

template <typename Vector, typename Value>
Vector load(const Value* from) {
    Vector value;
    std::memcpy(&value, from, sizeof value);
    return value;
}
void store(float* to, Row value) { std::memcpy(to, &value, sizeof value); }

Row load_upper_halves(const std::uint16_t* from) {
    using UnsignedRow = std::uint32_t __attribute__((vector_size(4 * kSide)));
    using HalfRow = std::uint16_t __attribute__((vector_size(2 * kSide)));
    const UnsignedRow bits = __builtin_convertvector(load<HalfRow>(from), UnsignedRow) << 16;
    return load<Row>(&bits);
}

void own(const VertexGroup& group, const EyeHeights& eye, float* keys_out) {
    const Row x_squared = gap_squared(load<Row>(group.x), group.half_width);
    for (int row = 0; row < kSide; ++row) {
        const float y_squared = gap_squared(group.y[row], group.half_width);
        const Row low = over_eye<Row>(load<ShortRow>(group.low + kSide * row), eye);
        const Row high = over_eye<Row>(load<ShortRow>(group.high + kSide * row), eye);
        const Row inverse = load_upper_halves(group.inverse_square_bounds + kSide * row);
        store(keys_out + kSide * row,
              vertex_key(x_squared + y_squared, low, high, inverse, eye.near_squared));
    }
}

void weigh(const VertexGroup& group, const EyeHeights& eye, const KeyPlanes& planes, float* keys) {
    const Row x = load<Row>(group.x);
    for (int row = 0; row < kSide; ++row) {
        const Row low = over_eye<Row>(load<ShortRow>(group.low + kSide * row), eye);
        const Row high = over_eye<Row>(load<ShortRow>(group.high + kSide * row), eye);
        store(keys + kSide * row,
              load<Row>(keys + kSide * row) *
                  outside_factor(x, group.y[row], low, high, group.half_width, planes));
    }
}

template <bool kEast>
bool trim_quarter(const ParentSides& parents, float floor, float* keys) {
    const Row limit = broadcast<Row>(floor / kNestMargin);
    IntRow held{};
    for (int b = 0; b < kSide / 2; ++b) {
        const Row sides = load<Row>(parents.along_y + kSide * (parents.row + b));
        const Row beyond = load<Row>(parents.east + kSide * (parents.row + b));
        const Row from_x = kEast ? __builtin_shufflevector(sides, beyond, 4, 5, 5, 6, 6, 7, 7, 8)
                                 : __builtin_shufflevector(sides, sides, 0, 1, 1, 2, 2, 3, 3, 4);
        for (int half = 0; half < 2; ++half) {
            const int line = parents.row + b + half;
            const Row along_x =
                load<Row>(line < kSide ? parents.along_x + kSide * line : parents.north);
            const Row from_y =
                kEast ? __builtin_shufflevector(along_x, along_x, 4, 4, 5, 5, 6, 6, 7, 7)
                      : __builtin_shufflevector(along_x, along_x, 0, 0, 1, 1, 2, 2, 3, 3);
            float* const row = keys + kSide * (2 * b + half);
            const Row most = max_of(from_x, from_y), key = load<Row>(row);
            held |= (key < limit) & (key * kNestMargin < most);
            store(row, max_of(key, most));
        }
    }
    std::int32_t any = 0;
    for (int i = 0; i < kSide; ++i) any |= held[i];
    return any != 0;
}

bool trim_centres(const ParentSides& parents, float floor, float* keys) {
    return parents.column == 0 ? trim_quarter<false>(parents, floor, keys)
                               : trim_quarter<true>(parents, floor, keys);
}

// Raises keys[i] to the larger key of its two parents. Returns whether a key below the floor was raised by more than
// kNestMargin.
inline int trim(float* __restrict keys, int count, const float* __restrict a,
                const float* __restrict b, float floor) {
    const float limit = floor / kNestMargin;
    int held = 0;
    for (int i = 0; i < count; ++i) {
        const float parents = max_of(a[i], b[i]);
        held |=
            static_cast<int>(keys[i] < limit) & static_cast<int>(keys[i] * kNestMargin < parents);
        keys[i] = max_of(keys[i], parents);
    }
    return held;
}

bool trim_along_x(const float* centres, const float* south, float floor, float* keys) {
    int held = trim(keys, kSide, centres, south, floor);
    held |= trim(keys + kSide, kAll - kSide, centres + kSide, centres, floor);
    return held != 0;
}

bool trim_along_y(const float* centres, const float* west, float floor, float* keys) {
    // the first column is separate, because its western parents are in the adjacent area
    float first[kSide];
    for (int row = 0; row < kSide; ++row) {
        first[row] = keys[kSide * row];
        keys[kSide * row] = std::numeric_limits<float>::infinity();
    }
    int held = trim(keys + 1, kAll - 1, centres + 1, centres, floor);
    for (int row = 0; row < kSide; ++row) {
        held |= trim(first + row, 1, centres + kSide * row, west + kSide * row + kSide - 1, floor);
        keys[kSide * row] = first[row];
    }
    return held != 0;
}

void take(float key, KeyWindow& window, std::uint32_t& below) {
    if (key < window.low) {
        ++below;
    } else if (key < window.high) {
        window.keys[window.count++] = key;
    }
}

std::uint32_t count(const float* keys, int count, KeyWindow& window) {
    std::uint32_t below = 0;
    int i = 0;
#if defined(__AVX512F__)
    const __m512 low = _mm512_set1_ps(window.low), high = _mm512_set1_ps(window.high);
    for (; i + 16 <= count; i += 16) {
        const __m512 key = _mm512_loadu_ps(keys + i);
        const __mmask16 is_below = _mm512_cmp_ps_mask(key, low, _CMP_LT_OQ);
        const __mmask16 is_inside =
            _mm512_mask_cmp_ps_mask(static_cast<__mmask16>(~is_below), key, high, _CMP_LT_OQ);
        below += static_cast<std::uint32_t>(__builtin_popcount(is_below));
        if (is_inside != 0) {
            _mm512_mask_compressstoreu_ps(window.keys + window.count, is_inside, key);
            window.count += static_cast<std::uint32_t>(__builtin_popcount(is_inside));
        }
    }
#elif defined(__AVX2__)
    const __m256 low = _mm256_set1_ps(window.low), high = _mm256_set1_ps(window.high);
    for (; i + 8 <= count; i += 8) {
        const __m256 key = _mm256_loadu_ps(keys + i);
        const auto is_below =
            static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(key, low, _CMP_LT_OQ)));
        auto is_inside =
            static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(key, high, _CMP_LT_OQ))) &
            ~is_below;
        below += static_cast<std::uint32_t>(__builtin_popcount(is_below));
        for (; is_inside != 0; is_inside &= is_inside - 1) {
            window.keys[window.count++] = keys[i + __builtin_ctz(is_inside)];
        }
    }
#elif defined(__SSE2__)
    const __m128 low = _mm_set1_ps(window.low), high = _mm_set1_ps(window.high);
    for (; i + 4 <= count; i += 4) {
        const __m128 key = _mm_loadu_ps(keys + i);
        const auto is_below = static_cast<unsigned>(_mm_movemask_ps(_mm_cmplt_ps(key, low)));
        auto is_inside =
            static_cast<unsigned>(_mm_movemask_ps(_mm_cmplt_ps(key, high))) & ~is_below;
        below += static_cast<std::uint32_t>(__builtin_popcount(is_below));
        for (; is_inside != 0; is_inside &= is_inside - 1) {
            window.keys[window.count++] = keys[i + __builtin_ctz(is_inside)];
        }
    }
#endif
    for (; i < count; ++i) take(keys[i], window, below);
    return below;
}

std::uint64_t mask(const float* keys, float threshold) {
    std::uint64_t bits = 0;
#if defined(__AVX512F__)
    const __m512 limit = _mm512_set1_ps(threshold);
    for (int i = 0; i < kAll / 16; ++i) {
        const __mmask16 part =
            _mm512_cmp_ps_mask(_mm512_loadu_ps(keys + 16 * i), limit, _CMP_LT_OQ);
        bits |= static_cast<std::uint64_t>(part) << (16 * i);
    }
#elif defined(__AVX2__)
    const __m256 limit = _mm256_set1_ps(threshold);
    for (int i = 0; i < kAll / 8; ++i) {
        const __m256 part = _mm256_cmp_ps(_mm256_loadu_ps(keys + 8 * i), limit, _CMP_LT_OQ);
        bits |= static_cast<std::uint64_t>(static_cast<unsigned>(_mm256_movemask_ps(part)))
                << (8 * i);
    }
#elif defined(__SSE2__)
    const __m128 limit = _mm_set1_ps(threshold);
    for (int i = 0; i < kAll / 4; ++i) {
        const __m128 part = _mm_cmplt_ps(_mm_loadu_ps(keys + 4 * i), limit);
        bits |= static_cast<std::uint64_t>(static_cast<unsigned>(_mm_movemask_ps(part))) << (4 * i);
    }
#else
    for (int i = 0; i < kAll; ++i) bits |= static_cast<std::uint64_t>(keys[i] < threshold) << i;
#endif
    return bits;
}

void store_row(float* to, Row even, Row odd) {
    store(to, __builtin_shufflevector(even, odd, 0, 8, 1, 9, 2, 10, 3, 11));
    store(to + kSide, __builtin_shufflevector(even, odd, 4, 12, 5, 13, 6, 14, 7, 15));
}

Row rise_of(const std::int16_t* from, const AreaMorph& area) {
    return to_number<Row>(load<ShortRow>(from)) * area.rise_unit;
}
Row less_one(const float* keys, const AreaMorph& area) {
    return share_less_one(load<Row>(keys), area.share);
}

void morph_area(const AreaMorph& area) {
    const auto in_row = [](int row) { return kRow * static_cast<std::size_t>(row); };
    for (int row = 0; row < kSide; ++row) {
        const float* coarse = area.coarse + static_cast<std::size_t>(row) * area.coarse_stride;
        const Row low = load<Row>(coarse), low_next = load<Row>(coarse + 1);
        const Row high = load<Row>(coarse + area.coarse_stride);
        const Row high_next = load<Row>(coarse + area.coarse_stride + 1);
        const std::int16_t* rise = area.rise + kSide * row;
        const Row centre = rise_of(rise, area), along_x = rise_of(rise + kAll, area);
        const Row along_y = rise_of(rise + 2 * kAll, area);
        float* const even = area.offsets + in_row(2 * row);
        store_row(even, low,
                  morph_offset(less_one(area.along_x + kSide * row, area), along_x, low, low_next));
        even[2 * kSide] = coarse[kSide];
        // an even square is cut from its south-western to its north-eastern corner
        const IntRow first_rises{-1, 0, -1, 0, -1, 0, -1, 0};
        const IntRow rises = row % 2 == 0 ? first_rises : ~first_rises;
        store_row(even + kRow,
                  morph_offset(less_one(area.along_y + kSide * row, area), along_y, low, high),
                  morph_offset(less_one(area.centre + kSide * row, area), centre,
                               rises ? low : low_next, rises ? high_next : high));
    }
    const float* last = area.coarse + kSide * area.coarse_stride;
    float* const to = area.offsets + in_row(2 * kSide);
    for (int i = 0; i <= kSide; ++i) to[2 * i] = last[i];
}

}  // namespace

extern const KeyKernels TERRANE_KERNELS;
const KeyKernels TERRANE_KERNELS = {&own,          &weigh, &trim_centres, &trim_along_x,
                                    &trim_along_y, &count, &mask,         &morph_area};

}  // namespace terrane::internal
