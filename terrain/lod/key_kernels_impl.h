// SPDX-License-Identifier: MIT
//
// The body of key_kernels_*.cpp: each of these defines TERRANE_KERNELS and includes this header once. Plain loops that
// compilers vectorise; only masks, windows and the parents of centres use intrinsics or shuffles. Everything has
// internal linkage: see simd_level.h.
#pragma once

#include "lod/key_kernels.h"

#include <cstring>

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

// Bit i: whether lane i of a comparison is true.
unsigned row_bits(IntRow lanes) {
#if defined(__AVX2__)
    return static_cast<unsigned>(_mm256_movemask_ps(load<__m256>(&lanes)));
#elif defined(__SSE2__)
    const auto* const halves = reinterpret_cast<const float*>(&lanes);
    return static_cast<unsigned>(_mm_movemask_ps(load<__m128>(halves)) |
                                 _mm_movemask_ps(load<__m128>(halves + 4)) << 4);
#else
    unsigned bits = 0;
    for (int i = 0; i < kSide; ++i) bits |= static_cast<unsigned>(lanes[i] & 1) << i;
    return bits;
#endif
}

std::uint64_t to_row(unsigned bits, int row) {
    return static_cast<std::uint64_t>(bits) << (kSide * row);
}

std::size_t bit_count(std::uint64_t word) {
    return static_cast<std::size_t>(__builtin_popcountll(word));
}

// Computes own keys by rows.
class OwnRows {
public:
    explicit OwnRows(const OwnKeys& own)
        : own_(own),
          x_(load<Row>(own.group.x)),
          x_squared_(gap_squared(x_, own.group.half_width)) {}

    Row key(int row) const {
        const VertexGroup& group = own_.group;
        const float y = group.y[row];
        const Row low = over_eye<Row>(load<ShortRow>(group.low + kSide * row), own_.eye);
        const Row high = over_eye<Row>(load<ShortRow>(group.high + kSide * row), own_.eye);
        const Row inverse = load_upper_halves(group.inverse_square_bounds + kSide * row);
        Row key = vertex_key(x_squared_ + gap_squared(y, group.half_width), low, high, inverse,
                             own_.eye.near_squared);
        if (own_.planes == nullptr) return key;
        const Row far = distance_sum(x_, y, low, high);
        const Row outside = distance_outside(x_, y, low, high, far, group.half_width, *own_.planes);
        if (row_bits(outside > Row{}) == 0) return key;
        return key * outside_factor(outside, far, group.half_width, *own_.planes);
    }
    Row limited_key(int row) const {
        const Row key = this->key(row);
        if (own_.limits == nullptr) return key;
        const Row limit = load<Row>(own_.limits + kSide * row);
        return limit < key ? limit : key;
    }

private:
    OwnKeys own_;  // a copy, whose values stay in registers across stores
    Row x_, x_squared_;
};

void own(const OwnKeys& own, float* keys_out) {
    const OwnRows rows(own);
    for (int row = 0; row < kSide; ++row) store(keys_out + kSide * row, rows.key(row));
}

void own_batch(const VertexBatch& batch, const KeyPlanes& planes, float near_squared,
               float* keys_out) {
    const Row x = load<Row>(&batch.x), y = load<Row>(&batch.y);
    const Row low = load<Row>(&batch.low), high = load<Row>(&batch.high);
    const Row flat = gap_squared(x, batch.half_width) + gap_squared(y, batch.half_width);
    const Row key =
        vertex_key(flat, low, high, load<Row>(&batch.inverse_square_bounds), near_squared);
    const Row far = distance_sum(x, y, low, high);
    const Row outside = distance_outside(x, y, low, high, far, batch.half_width, planes);
    store(keys_out, key * outside_factor(outside, far, batch.half_width, planes));
}

// Collects the keys of an area's rows.
class KeyRows {
public:
    KeyRows(const OwnKeys& own, float floor, const KeyWindow& window, float* keys)
        : own_(own),
          floor_(floor),
          held_limit_(floor / kNestMargin),
          low_(window.low),
          high_(window.high),
          keys_(keys) {}

    // Sets a row's keys from its parents' keys.
    void add(int row, Row parent, Row other_parent, Row fade) {
        Row key = max_of(parent, other_parent);
        if (row_bits((parent < floor_) | (other_parent < floor_)) != 0) {
            const Row own = own_.limited_key(row) * fade;
            held_ |= (own < held_limit_) & (own * kNestMargin < key);
            key = max_of(own, key);
            below_ |= to_row(row_bits(key < low_), row);
            below_high_ |= to_row(row_bits(key < high_), row);
        }
        store(keys_ + kSide * row, key);
    }
    FoundKeys finish(const AreaPlace& place, KeyWindow& window) const {
        return {below_, collect(keys_, below_, below_high_, place, window), row_bits(held_) != 0};
    }

    // Returns the number of keys below the window.
    static std::uint32_t collect(const float* keys, std::uint64_t below, std::uint64_t below_high,
                                 const AreaPlace& place, KeyWindow& window) {
        const std::size_t below_count = bit_count(below);
        window.below += 2 * below_count - bit_count(below & place.border);
        for (std::uint64_t inside = below_high & ~below; inside != 0; inside &= inside - 1) {
            const int i = __builtin_ctzll(inside);
            const bool is_border = (place.border >> i & 1) != 0;
            window.candidates[window.count++] = {keys[i], place.chunk,
                                                 static_cast<std::uint16_t>(place.first + i),
                                                 static_cast<std::uint16_t>(is_border ? 1 : 2)};
        }
        return static_cast<std::uint32_t>(below_count);
    }

private:
    OwnRows own_;
    float floor_, held_limit_, low_, high_;
    float* keys_;
    std::uint64_t below_ = 0, below_high_ = 0;
    IntRow held_{};
};

template <bool kEast>
void add_quarter(const ParentSides& parents, Row fade, KeyRows& keys) {
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
            keys.add(2 * b + half, from_x, from_y, fade);
        }
    }
}

FoundKeys find_centres(const OwnKeys& own, const ParentSides& parents, float floor,
                       const AreaPlace& place, KeyWindow& window, float* keys_out) {
    KeyRows keys(own, floor, window, keys_out);
    const Row fade = broadcast<Row>(own.fade);
    if (parents.column == 0) {
        add_quarter<false>(parents, fade, keys);
    } else {
        add_quarter<true>(parents, fade, keys);
    }
    return keys.finish(place, window);
}

FoundKeys find_along_x(const OwnKeys& own, const float* centres, const float* south, float floor,
                       const AreaPlace& place, KeyWindow& window, float* keys_out) {
    KeyRows keys(own, floor, window, keys_out);
    Row to_south = load<Row>(south);
    for (int row = 0; row < kSide; ++row) {
        const Row to_north = load<Row>(centres + kSide * row);
        keys.add(row, to_north, to_south, broadcast<Row>(row == 0 ? own.first_fade : own.fade));
        to_south = to_north;
    }
    return keys.finish(place, window);
}

FoundKeys find_along_y(const OwnKeys& own, const float* centres, const float* west, float floor,
                       const AreaPlace& place, KeyWindow& window, float* keys_out) {
    KeyRows keys(own, floor, window, keys_out);
    Row fade = broadcast<Row>(own.fade);
    fade[0] = own.first_fade;
    for (int row = 0; row < kSide; ++row) {
        const Row to_east = load<Row>(centres + kSide * row);
        const Row beyond = load<Row>(west + kSide * row);
        const Row to_west = __builtin_shufflevector(beyond, to_east, 7, 8, 9, 10, 11, 12, 13, 14);
        keys.add(row, to_east, to_west, fade);
    }
    return keys.finish(place, window);
}

std::uint64_t mask(const float* keys, float threshold) {
    std::uint64_t bits = 0;
    for (int row = 0; row < kSide; ++row) {
        bits |= to_row(row_bits(load<Row>(keys + kSide * row) < threshold), row);
    }
    return bits;
}

FoundKeys count(const float* keys, const AreaPlace& place, KeyWindow& window) {
    const std::uint64_t below = mask(keys, window.low);
    return {below, KeyRows::collect(keys, below, mask(keys, window.high), place, window), false};
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
    const unsigned even_rows = area.rows | area.rows << 1;
    for (int row = 0; row < kSide; ++row) {
        if ((even_rows >> row & 1) == 0) continue;
        const float* coarse = area.coarse + static_cast<std::size_t>(row) * area.coarse_stride;
        const Row low = load<Row>(coarse), low_next = load<Row>(coarse + 1);
        const std::int16_t* rise = area.rise + kSide * row;
        float* const even = area.offsets + in_row(2 * row);
        store_row(even, low,
                  morph_offset(less_one(area.along_x + kSide * row, area),
                               rise_of(rise + kAll, area), low, low_next));
        even[2 * kSide] = coarse[kSide];
        if ((area.rows >> row & 1) == 0) continue;
        const Row high = load<Row>(coarse + area.coarse_stride);
        const Row high_next = load<Row>(coarse + area.coarse_stride + 1);
        // an even square is cut from its south-western to its north-eastern corner
        const IntRow first_rises{-1, 0, -1, 0, -1, 0, -1, 0};
        const IntRow rises = row % 2 == 0 ? first_rises : ~first_rises;
        store_row(even + kRow,
                  morph_offset(less_one(area.along_y + kSide * row, area),
                               rise_of(rise + 2 * kAll, area), low, high),
                  morph_offset(less_one(area.centre + kSide * row, area), rise_of(rise, area),
                               rises ? low : low_next, rises ? high_next : high));
    }
    if ((even_rows >> kSide & 1) == 0) return;
    const float* last = area.coarse + kSide * area.coarse_stride;
    float* const to = area.offsets + in_row(2 * kSide);
    for (int i = 0; i <= kSide; ++i) to[2 * i] = last[i];
}

}  // namespace

extern const KeyKernels TERRANE_KERNELS;
const KeyKernels TERRANE_KERNELS = {&own,          &own_batch, &find_centres, &find_along_x,
                                    &find_along_y, &count,     &mask,         &morph_area};

}  // namespace terrane::internal
