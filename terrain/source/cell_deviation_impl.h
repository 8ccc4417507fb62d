// SPDX-License-Identifier: MIT
//
// The body of cell_deviation_*.cpp: each defines TERRANE_RAISE_DEVIATIONS and includes this header once. Everything has
// internal linkage: see simd_level.h.
//
// The right angle of a half cell is at a midpoint m of spacing s; its diagonal joins a centre c and a vertex k of a
// coarser spacing. At a point with barycentric weights w, the height of the plane
//
//   of the half cell is w_m h_m + w_c h_c + w_k h_k;
//   of the triangle that m splits is lower by w_m rise_m, because h_m is replaced by the mean height of m's ends;
//   of the triangle that c splits is lower by w_c rise_c as well, because h_c is replaced by that of c's ends.
//
// Both triangles contain the half cell. (m's ends are c and a corner of c's square, or, if m is on an edge of this
// square, two of its corners.) Four half cells form the diamond of m, eight form the diamond of c.
#pragma once

#include "source/cell_deviation.h"

namespace terrane::internal {
namespace {

#if defined(__AVX512F__)
constexpr int kLanes = 8;
#elif defined(__AVX2__)
constexpr int kLanes = 4;
#else
constexpr int kLanes = 2;
#endif
static_assert(kCellGroup % kLanes == 0);

using Doubles = double __attribute__((vector_size(8 * kLanes)));

Doubles load(const double* from) {
    Doubles value;
    __builtin_memcpy(&value, from, sizeof(value));
    return value;
}
void store(double* to, Doubles value) { __builtin_memcpy(to, &value, sizeof(value)); }
Doubles larger(Doubles a, Doubles b) { return a > b ? a : b; }
Doubles magnitude(Doubles value) { return larger(value, -value); }

/// A half cell, mirrored so that its right angle is in the south-east.
struct HalfCell {
    Doubles foot, right, head;
    Doubles right_rise, centre_rise;
};

struct Deviations {
    Doubles cell, right, centre;
};

template <bool kMirrored, bool kHasRadii, bool kCentreIsFoot>
void measure(const CellRow& cells, int first, const HalfCell& half, Deviations& most) {
    constexpr double kStep = 1.0 / (kCellSamples - 1);
    const Doubles along = half.right - half.foot, up = half.head - half.right;
    for (int row = 0; row < kCellSamples; ++row) {
        for (int column = row; column < kCellSamples; ++column) {
            const double x = kStep * column, y = kStep * row;
            const int i = kMirrored ? column : row, j = kMirrored ? row : column;
            const Doubles plane = half.foot + x * along + y * up;
            const Doubles of_cell = load(cells.centres[i][j] + first) - plane;
            const Doubles of_right = of_cell + (x - y) * half.right_rise;
            const Doubles of_centre = of_right + (kCentreIsFoot ? 1.0 - x : y) * half.centre_rise;
            Doubles radius{};
            if constexpr (kHasRadii) radius = load(cells.radii[i][j] + first);
            most.cell = larger(most.cell, magnitude(of_cell) + radius);
            most.right = larger(most.right, magnitude(of_right) + radius);
            most.centre = larger(most.centre, magnitude(of_centre) + radius);
        }
    }
}

template <bool kHasRadii, bool kCentreIsFoot>
void raise(const CellRow& cells) {
    for (int first = 0; first < cells.count; first += kLanes) {
        const Doubles foot = load(cells.foot + first), head = load(cells.head + first);
        const Doubles rise = load(cells.centre_rise + first);
        Deviations most{load(cells.cell + first), load(cells.right_most + first),
                        load(cells.centre_most + first)};
        measure<false, kHasRadii, kCentreIsFoot>(
            cells, first,
            {foot, load(cells.right + first), head, load(cells.right_rise + first), rise}, most);
        store(cells.right_most + first, most.right);
        most.right = load(cells.left_most + first);
        measure<true, kHasRadii, kCentreIsFoot>(
            cells, first,
            {foot, load(cells.left + first), head, load(cells.left_rise + first), rise}, most);
        store(cells.left_most + first, most.right);
        store(cells.cell + first, most.cell);
        store(cells.centre_most + first, most.centre);
    }
}

void raise_any(const CellRow& cells) {
    if (cells.has_radii) {
        cells.centre_is_foot ? raise<true, true>(cells) : raise<true, false>(cells);
    } else {
        cells.centre_is_foot ? raise<false, true>(cells) : raise<false, false>(cells);
    }
}

}  // namespace

const FindMaxDeviations TERRANE_RAISE_DEVIATIONS = raise_any;

}  // namespace terrane::internal
