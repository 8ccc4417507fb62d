// SPDX-License-Identifier: MIT
//
// Part of noise_kernels_impl.h: the nodes around points that lie close together.
#pragma once

#include "source/noise/noise_gradients_impl.h"

namespace terrane::internal {
namespace {

/// Nodes west and east of points, on one row of nodes.
struct NodesBeside {
    Gradients west, east;
};

/// Reads nodes (x, y, x, y, ...) of a row: of each lane the one at row + at[lane], and the next.
#if defined(__AVX512F__)
[[gnu::always_inline]] inline NodesBeside read_nodes(const double* row, const uint64_t* at) {
    const auto two = [=](int low, int high) {
        return __builtin_shufflevector(_mm256_loadu_pd(row + at[low]),
                                       _mm256_loadu_pd(row + at[high]), 0, 1, 2, 3, 4, 5, 6, 7);
    };
    // west, west, east, east of two lanes; and of two others in the upper half
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

/// Nodes around points that all lie in one cell: vectors of one number each.
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

/// An axis's nodes from the one below a first unit to the one above a last one.
struct NodeRange {
    uint64_t origin;  ///< of the first node, in units and with the axis's offset
    uint64_t count;

    NodeRange(const NoiseAxis& axis, uint64_t low, uint64_t extent) {
        const uint64_t shifted = low + axis.offset, inside_mask = (uint64_t{1} << axis.shift) - 1;
        origin = shifted & ~inside_mask;
        count = (((shifted & inside_mask) + extent) >> axis.shift) + 2;
    }
};

/// All nodes of an octave around points, row by row.
struct NodePatch {
    static constexpr uint64_t kMaxNodes = 2048;

    uint64_t pitch;  ///< doubles from row to row
    alignas(64) double nodes[2 * kMaxNodes];

    static bool has_room(const NodeRange& x, const NodeRange& y) {
        return x.count <= kMaxNodes && y.count <= kMaxNodes && columns_of(x) * y.count <= kMaxNodes;
    }

    /// Requires: room.
    void fill(const NoiseOctave& octave, const NodeRange& x, const NodeRange& y) {
        const uint64_t columns = columns_of(x);
        const uint64_t x_first = x.origin >> octave.x.shift, y_first = y.origin >> octave.y.shift;
        const uint64_t x_mask = ~uint64_t{0} >> octave.x.shift;
        const uint64_t y_mask = ~uint64_t{0} >> octave.y.shift;
        alignas(64) uint64_t hashes[kMaxNodes / 2];  // there are two rows at least
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
