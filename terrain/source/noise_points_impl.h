// SPDX-License-Identifier: MIT
//
// Part of noise_kernels_impl.h: points anywhere in the plane.
#pragma once

#include "noise_lanes_impl.h"

namespace terrane::internal {
namespace {

/// Whole units by rounding to even and stepping down where that went up.
void move_axis(int count, double units_per_metre, const double* metres, uint64_t* units,
               double* rests) {
    constexpr double kRounder = 0x1.8p52;
    for (int point = 0; point < count; point += kLanes) {
        const Doubles way = load(metres + point) * units_per_metre + load(rests + point);
        const Doubles rounder = way + kRounder;
        const Words whole = bits(rounder) - __builtin_bit_cast(uint64_t, kRounder);
        const Doubles rest = way - (rounder - kRounder);
        const Words below = __builtin_bit_cast(Words, rest < 0.0);
        store(units + point, load(units + point) + whole + below);
        store(rests + point, rest + doubles(below & __builtin_bit_cast(uint64_t, 1.0)));
    }
}

void move(NoisePoints& points, double units_per_metre, const double* x, const double* y) {
    move_axis(points.count, units_per_metre, x, points.x, points.rest_x);
    move_axis(points.count, units_per_metre, y, points.y, points.rest_y);
}

/// Hashes along an axis of the nodes around points.
struct AxisNodes {
    Words cells, low, high;
    bool is_known;

    /// Whether these points lie elsewhere than the ones before them.
    bool find(const NoiseAxis& axis, Words wanted) {
        if (is_known && !any(cells ^ wanted)) return false;
        cells = wanted;
        low = mix(axis.key + wanted);
        high = mix(axis.key + ((wanted + 1) & (~uint64_t{0} >> axis.shift)));
        is_known = true;
        return true;
    }
};

struct Places {
    Words cells;
    Doubles fractions;
};

Places places_of(const NoiseAxis& axis, const uint64_t* units, const double* rests) {
    const uint64_t inside_mask = (uint64_t{1} << axis.shift) - 1;
    const Words shifted = load(units) + axis.offset;
    return {shifted >> axis.shift,
            (to_doubles(shifted & inside_mask) + load(rests)) * axis.cells_per_unit};
}

void add_points(const NoiseOctave& octave, const NoisePoints& points, double* sums) {
    // neighbours mostly lie in one cell of a coarse octave
    AxisNodes x_nodes{}, y_nodes{};
    GradientPair west_nodes{}, east_nodes{};  // south, north
    for (int point = 0; point < points.count; point += kLanes) {
        const Places x = places_of(octave.x, points.x + point, points.rest_x + point);
        const Places y = places_of(octave.y, points.y + point, points.rest_y + point);
        const bool x_changed = x_nodes.find(octave.x, x.cells);
        const bool y_changed = y_nodes.find(octave.y, y.cells);
        if (x_changed || y_changed) {
            west_nodes = gradients_of(node_hash(x_nodes.low, y_nodes.low),
                                      node_hash(x_nodes.low, y_nodes.high));
            east_nodes = gradients_of(node_hash(x_nodes.high, y_nodes.low),
                                      node_hash(x_nodes.high, y_nodes.high));
        }
        const Doubles y_fade = fade(y.fractions);
        const Blend west = blend_of(west_nodes.first, west_nodes.second, y.fractions, y_fade);
        const Blend east = blend_of(east_nodes.first, east_nodes.second, y.fractions, y_fade);
        store(sums + point,
              load(sums + point) +
                  octave.amplitude * blend_along_x(west, east, x.fractions, fade(x.fractions)));
    }
}

}  // namespace
}  // namespace terrane::internal
