// SPDX-License-Identifier: MIT
//
// Part of noise_kernels_impl.h: points anywhere in the plane. A chain of all the operations on a
// point is too long for a processor to look past its end, so points pass in batches through stages.
#pragma once

#include "source/noise/noise_patch_impl.h"

namespace terrane::internal {
namespace {

/// Whole units by rounding to even and stepping down where that went up.
void move_axis(int count, double units_per_metre, const double* metres, uint64_t* units,
               double* rests) {
    constexpr double kRounder = 0x1.8p52;
    for (int point = 0; point < count; point += kLanes) {
        const Doubles position = load(metres + point) * units_per_metre + load(rests + point);
        const Doubles rounder = position + kRounder;
        const Words whole = bits(rounder) - __builtin_bit_cast(uint64_t, kRounder);
        const Doubles rest = position - (rounder - kRounder);
        const Words below = __builtin_bit_cast(Words, rest < 0.0);
        store(units + point, load(units + point) + whole + below);
        store(rests + point, rest + doubles(below & __builtin_bit_cast(uint64_t, 1.0)));
    }
}

void move(NoisePoints& points, int first, int count, double units_per_metre, const double* x,
          const double* y) {
    move_axis(count, units_per_metre, x, points.x + first, points.rest_x + first);
    move_axis(count, units_per_metre, y, points.y + first, points.rest_y + first);
}

void enclose_axis(int count, const uint64_t* units, uint64_t& low_out, uint64_t& extent_out) {
    int64_t low = 0, high = 0;  // from the first point
    for (int point = 0; point < count; ++point) {
        const auto offset = static_cast<int64_t>(units[point] - units[0]);
        low = offset < low ? offset : low;
        high = offset > high ? offset : high;
    }
    low_out = units[0] + static_cast<uint64_t>(low);
    extent_out = static_cast<uint64_t>(high) - static_cast<uint64_t>(low);
}

void enclose(NoisePoints& points) {
    enclose_axis(points.count, points.x, points.low_x, points.extent_x);
    enclose_axis(points.count, points.y, points.low_y, points.extent_y);
}

/// What passes from stage to stage: few enough for the nearest cache.
struct PointBatch {
    static constexpr int kMax = 128;
    int first;  ///< of the points
    int count;
    alignas(64) double x[kMax], y[kMax];  ///< in cells from the node below
    alignas(64) double x_fades[kMax], y_fades[kMax];
};

/// Calls use(batch) for all points.
template <class Use>
void for_each_batch(const NoisePoints& points, Use use) {
    PointBatch batch;
    for (batch.first = 0; batch.first < points.count; batch.first += PointBatch::kMax) {
        const int left = points.count - batch.first;
        batch.count = left < PointBatch::kMax ? left : PointBatch::kMax;
        use(batch);
    }
}

/// The first stage: finds fractions and fades, and calls keep(point, x, y) with the cells of each
/// vector of points. Both axes go step by step: a processor looks past waiting operations, but not
/// past many.
///
/// @param x_origin  multiple of a cell in units, the axis's offset included: cells count from there
template <class Keep>
void place_points(const NoiseOctave& octave, uint64_t x_origin, uint64_t y_origin,
                  const NoisePoints& points, PointBatch& batch, Keep keep) {
    const uint64_t x_offset = octave.x.offset - x_origin, y_offset = octave.y.offset - y_origin;
    const uint64_t x_mask = (uint64_t{1} << octave.x.shift) - 1;
    const uint64_t y_mask = (uint64_t{1} << octave.y.shift) - 1;
    for (int point = 0; point < batch.count; point += kLanes) {
        const int at = batch.first + point;
        const Words x_units = load(points.x + at) + x_offset;
        const Words y_units = load(points.y + at) + y_offset;
        const Doubles x_inside = to_doubles(x_units & x_mask),
                      y_inside = to_doubles(y_units & y_mask);
        const Doubles x = (x_inside + load(points.rest_x + at)) * octave.x.cells_per_unit;
        const Doubles y = (y_inside + load(points.rest_y + at)) * octave.y.cells_per_unit;
        const FadePair fades = fade(x, y);
        store(batch.x + point, x);
        store(batch.y + point, y);
        store(batch.x_fades + point, fades.first);
        store(batch.y_fades + point, fades.second);
        keep(point, x_units >> octave.x.shift, y_units >> octave.y.shift);
    }
}

/// The last stage.
[[gnu::always_inline]] inline void add_noise(const PointBatch& batch, int point,
                                             const NodesBeside& south, const NodesBeside& north,
                                             double amplitude, double* sums) {
    const Doubles y = load(batch.y + point), y_fade = load(batch.y_fades + point);
    const Blend west = blend_of(south.west, north.west, y, y_fade);
    const Blend east = blend_of(south.east, north.east, y, y_fade);
    const Doubles noise =
        blend_along_x(west, east, load(batch.x + point), load(batch.x_fades + point));
    double* const sum = sums + batch.first + point;
    store(sum, load(sum) + amplitude * noise);
}

/// Whether all numbers are the first one.
bool are_equal(const uint64_t* numbers, int count) {
    if (numbers[count - 1] != numbers[0]) return false;  // as on fine octaves
    Words differences{};
    for (int i = 0; i < count; i += kLanes) differences |= load(numbers + i) ^ numbers[0];
    uint64_t all = 0;
    for (int lane = 0; lane < kLanes; ++lane) all |= differences[lane];
    return all == 0;
}

/// Points whose nodes fit in a patch.
void add_near(const NoiseOctave& octave, const NodeRange& x_range, const NodeRange& y_range,
              const NoisePoints& points, double* sums) {
    NodePatch patch;
    patch.fill(octave, x_range, y_range);
    const double* const south = patch.nodes;
    const double* const north = patch.nodes + patch.pitch;
    alignas(64) uint64_t nodes[PointBatch::kMax];
    for_each_batch(points, [&](PointBatch& batch) {
        place_points(octave, x_range.origin, y_range.origin, points, batch,
                     [&](int point, Words x, Words y) {
                         store(nodes + point, low_product(y, patch.pitch + Words{}) + (x << 1));
                     });
        if (are_equal(nodes, batch.count)) {  // mostly so on coarse octaves
            const SplatNodes splat(south + nodes[0], north + nodes[0]);
            for (int point = 0; point < batch.count; point += kLanes) {
                add_noise(batch, point, splat.south(), splat.north(), octave.amplitude, sums);
            }
        } else {
            for (int point = 0; point < batch.count; point += kLanes) {
                add_noise(batch, point, read_nodes(south, nodes + point),
                          read_nodes(north, nodes + point), octave.amplitude, sums);
            }
        }
    });
}

/// Hashes of the nodes below and above a batch of points on an axis.
struct AxisHashes {
    alignas(64) uint64_t low[PointBatch::kMax], high[PointBatch::kMax];

    void find(const NoiseAxis& axis, int point, Words cells) {
        store(low + point, mix(axis.key + cells));
        store(high + point, mix(axis.key + ((cells + 1) & (~uint64_t{0} >> axis.shift))));
    }
};

/// Points anywhere.
void add_scattered(const NoiseOctave& octave, const NoisePoints& points, double* sums) {
    AxisHashes x_hashes, y_hashes;
    for_each_batch(points, [&](PointBatch& batch) {
        place_points(octave, 0, 0, points, batch, [&](int point, Words x, Words y) {
            x_hashes.find(octave.x, point, x);
            y_hashes.find(octave.y, point, y);
        });
        for (int point = 0; point < batch.count; point += kLanes) {
            const auto row = [&](const uint64_t* hashes) {
                return gradients_of(x_hashes.low + point, x_hashes.high + point, hashes + point);
            };
            const GradientPair south = row(y_hashes.low), north = row(y_hashes.high);
            add_noise(batch, point, {south.first, south.second}, {north.first, north.second},
                      octave.amplitude, sums);
        }
    });
}

void add_points(const NoiseOctave& octave, const NoisePoints& points, double* sums) {
    constexpr uint64_t kFar = uint64_t{1} << 60;  // well below where ranges would wrap
    if (points.extent_x < kFar && points.extent_y < kFar) {
        const NodeRange x(octave.x, points.low_x, points.extent_x);
        const NodeRange y(octave.y, points.low_y, points.extent_y);
        if (NodePatch::has_room(x, y)) return add_near(octave, x, y, points, sums);
    }
    add_scattered(octave, points, sums);
}

}  // namespace
}  // namespace terrane::internal
