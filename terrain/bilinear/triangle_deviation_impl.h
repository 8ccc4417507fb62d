// SPDX-License-Identifier: MIT
//
// The body of triangle_deviation_*.cpp: each defines TERRANE_FIND_TRIANGLE_DEVIATIONS and includes this header once.
// Everything has internal linkage: see simd_level.h. Lanes perform the operations of add_triangle() in
// diamond_window.cpp.
#pragma once

#include "bilinear/triangle_deviation.h"

#include <cstdint>

#if defined(__x86_64__)
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
static_assert(kPhasePadding % kLanes == 0);

using Doubles = double __attribute__((vector_size(8 * kLanes)));
using Masks = std::int64_t __attribute__((vector_size(8 * kLanes)));
using Floats = float __attribute__((vector_size(4 * kLanes)));
using Ints = std::int32_t __attribute__((vector_size(4 * kLanes)));

Doubles load(const double* from) {
    Doubles value;
    __builtin_memcpy(&value, from, sizeof(value));
    return value;
}

// The second value if both are equal.
#if defined(__AVX512F__)
// Masked, because g++ 12 warns of an uninitialised value in the plain ones.
Doubles smaller(Doubles a, Doubles b) { return _mm512_maskz_min_pd(0xff, a, b); }
Doubles larger(Doubles a, Doubles b) { return _mm512_maskz_max_pd(0xff, a, b); }
#elif defined(__AVX2__)
Doubles smaller(Doubles a, Doubles b) { return _mm256_min_pd(a, b); }
Doubles larger(Doubles a, Doubles b) { return _mm256_max_pd(a, b); }
#elif defined(__x86_64__)
Doubles smaller(Doubles a, Doubles b) { return _mm_min_pd(a, b); }
Doubles larger(Doubles a, Doubles b) { return _mm_max_pd(a, b); }
#else
Doubles smaller(Doubles a, Doubles b) { return a < b ? a : b; }
Doubles larger(Doubles a, Doubles b) { return a > b ? a : b; }
#endif
Doubles magnitude(Doubles value) { return larger(value, -value); }

struct Range {
    Doubles low, high;
    void add(Doubles value) {
        low = smaller(value, low);
        high = larger(value, high);
    }
};

// The triangles of one shape at kLanes points.
struct Triangles {
    const PhasedHeights& heights;
    int x, y;  // of the right-angled corner of the first one
    int sign_x, sign_y;

    // Heights at a distance from the corner, in cells along the legs.
    [[gnu::always_inline]] Doubles at(int i, int j) const { return load(line(j) + offset(i)); }
    [[gnu::always_inline]] const double* line(int j) const {
        const auto first = static_cast<std::size_t>(y + j * sign_y) << heights.log2_stride;
        return heights.values + first * heights.pitch;
    }
    [[gnu::always_inline]] std::size_t offset(int i) const {
        const auto column = static_cast<std::size_t>(x + i * sign_x);
        const std::size_t phase = column & ((std::size_t{1} << heights.log2_stride) - 1);
        return phase * heights.pitch + (column >> heights.log2_stride);
    }
    [[gnu::always_inline]] Doubles corner_height(CornerHeight corner, int leg) const {
        if (corner == CornerHeight::mean_x) return 0.5 * (at(-leg, 0) + at(leg, 0));
        if (corner == CornerHeight::mean_y) return 0.5 * (at(0, -leg) + at(0, leg));
        return at(0, 0);
    }
};

// Legs of one cell: the surface can deviate only at the right-angled corner and on the hypotenuse, there by a quarter
// of the cell's twist.
void add_cells(const Triangles& t, CornerHeight corner, Range& range) {
    const Doubles at_corner = t.corner_height(corner, 1), own = t.at(0, 0);
    const Doubles difference = own - at_corner;
    range.add(difference);
    range.add(0.25 * (own + t.at(1, 1) - t.at(1, 0) - t.at(0, 1)));
}

// A leg of 0 is replaced by the shape's.
template <int kLeg>
void add_triangles(const Triangles& t, CornerHeight corner, int leg_of_shape, Range& range) {
    constexpr std::size_t kPoints = (kLeg > 0 ? kLeg : kMaxLeg) + 2;
    const int leg = kLeg > 0 ? kLeg : leg_of_shape;
    const Doubles at_corner = t.corner_height(corner, leg);
    const Doubles slope_x = (t.at(leg, 0) - at_corner) / static_cast<double>(leg);
    const Doubles slope_y = (t.at(0, leg) - at_corner) / static_cast<double>(leg);
    Doubles rows[2][kPoints];
    Doubles* here = rows[0];
    Doubles* above = rows[1];
    std::size_t offsets[kPoints];
    for (int i = 0; i <= leg; ++i) offsets[i] = t.offset(i);
    const auto differences = [&](int j, int count, Doubles* out) {
        const Doubles base = at_corner + static_cast<double>(j) * slope_y;
        const double* const line = t.line(j);
        for (int i = 0; i < count; ++i) {
            out[i] = load(line + offsets[i]) - (base + static_cast<double>(i) * slope_x);
        }
    };
    differences(0, leg + 1, here);
    for (int j = 0; j < leg; ++j) {
        const int whole = leg - 1 - j;  // cells of this row before the cut one
        differences(j + 1, whole + 2, above);
        const Doubles end = here[whole + 1], top = above[whole];
        const Doubles bow = here[whole] + above[whole + 1] - end - top;
        const Doubles across = top - end;
        const Doubles extreme = 0.5 * (end + top) + 0.25 * bow + across * across / (4.0 * bow);
        range.add(magnitude(across) < magnitude(bow) ? extreme : end);
        range.add(end);
        for (int i = 0; i <= whole; ++i) range.add(here[i]);
        Doubles* const next = here;
        here = above;
        above = next;
    }
    range.add(here[0]);
}

// As the function of this name in diamond_window.cpp.
Floats round_outward(Doubles deviation) {
    const Doubles wanted = deviation + 1e-9;
    const Floats nearest = __builtin_convertvector(wanted, Floats);
    const Masks is_below = __builtin_convertvector(nearest, Doubles) < wanted;
    const Masks is_positive = deviation > 0.0;
    Ints bits;
    __builtin_memcpy(&bits, &nearest, sizeof(bits));
    bits -= __builtin_convertvector(is_below, Ints);  // a true lane is -1
    bits &= __builtin_convertvector(is_positive, Ints);
    Floats rounded;
    __builtin_memcpy(&rounded, &bits, sizeof(rounded));
    return rounded;
}

void find(const PhasedHeights& heights, const TriangleShape* shapes, int shape_count, int x, int y,
          int count, float* out) {
    for (int first = 0; first < count; first += kLanes) {
        const Doubles none{};
        Range range{none, none};
        for (int i = 0; i < shape_count; ++i) {
            const TriangleShape& shape = shapes[i];
            const Triangles t{heights, x + shape.x + (first << heights.log2_stride), y + shape.y,
                              shape.sign_x, shape.sign_y};
            switch (shape.leg) {
                case 1:
                    add_cells(t, shape.corner, range);
                    break;
                case 2:
                    add_triangles<2>(t, shape.corner, 2, range);
                    break;
                case 4:
                    add_triangles<4>(t, shape.corner, 4, range);
                    break;
                case 8:
                    add_triangles<8>(t, shape.corner, 8, range);
                    break;
                default:
                    add_triangles<0>(t, shape.corner, shape.leg, range);
            }
        }
        const Floats rounded = round_outward(larger(range.high, -range.low));
        const int lanes = count - first < kLanes ? count - first : kLanes;
        __builtin_memcpy(out + first, &rounded, static_cast<std::size_t>(lanes) * sizeof(float));
    }
}

}  // namespace

extern const FindTriangleDeviations TERRANE_FIND_TRIANGLE_DEVIATIONS;
const FindTriangleDeviations TERRANE_FIND_TRIANGLE_DEVIATIONS = find;

}  // namespace terrane::internal
