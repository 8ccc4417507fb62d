// SPDX-License-Identifier: MIT
//
// Noise at arbitrary points in the plane. The chain of operations on one point is longer than a processor's reorder
// window, so points pass through stages in batches.
#pragma once

#include "source/fractal/noise_gradients_impl.h"

namespace terrane::internal {
namespace {

/// Moves positions, which are whole units and fractions: rounds to even, and subtracts one where that rounded up.
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
    int64_t low = 0, high = 0;  // relative to the first point
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

/// A batch of points with the data that its stages pass on; small enough to stay in the L1 cache.
struct PointBatch {
    static constexpr int kMax = 128;
    int first;  ///< of the points
    int count;
    alignas(64) double x[kMax], y[kMax];  ///< relative to the node below, in cells
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

/// The first stage: computes fractions and fades, and calls keep(point, x, y) with the cells of each vector of points.
/// The operations on both axes are interleaved, because a processor looks ahead past only a few waiting operations.
///
/// @param x_origin origin of the cells' indices along x: a multiple of a cell, in units, including the axis's offset
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

/// The last stage: adds the noise to the sums.
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

/// Whether all numbers equal the first one.
bool are_equal(const uint64_t* numbers, int count) {
    if (numbers[count - 1] != numbers[0]) return false;  // common on fine octaves
    Words differences{};
    for (int i = 0; i < count; i += kLanes) differences |= load(numbers + i) ^ numbers[0];
    uint64_t all = 0;
    for (int lane = 0; lane < kLanes; ++lane) all |= differences[lane];
    return all == 0;
}

/// Adds noise at points whose nodes fit into a NodePatch.
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
        if (are_equal(nodes, batch.count)) {  // common on coarse octaves
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

/// Hashes of the nodes below and above each point of a batch, along one axis.
struct AxisHashes {
    alignas(64) uint64_t low[PointBatch::kMax], high[PointBatch::kMax];

    void find(const NoiseAxis& axis, int point, Words cells) {
        store(low + point, mix(axis.key + cells));
        store(high + point, mix(axis.key + ((cells + 1) & (~uint64_t{0} >> axis.shift))));
    }
};

/// Adds noise at arbitrary points.
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

// Rows of samples of a grid.

namespace {

void place(NoiseColumnData& columns, const NoiseAxis& axis, uint64_t first, uint64_t step) {
    const uint64_t inside_mask = (uint64_t{1} << axis.shift) - 1;
    columns.cell_mask = ~uint64_t{0} >> axis.shift;
    Words units = first + axis.offset + ramp() * step;
    for (int column = 0; column < columns.column_count; column += kLanes) {
        store(columns.cells + column, units >> axis.shift);
        store(columns.fractions + column, to_doubles(units & inside_mask) * axis.cells_per_unit);
        units += step * kLanes;
    }
}

/// Finds the runs of columns that share nodes.
void find_runs(NoiseColumnData& columns) {
    const uint64_t mask = columns.cell_mask;
    const uint64_t* const cells = columns.cells;
    uint64_t first = 0;
    columns.run_count = 0;
    columns.is_picked = true;
    const uint64_t cell_count = ((cells[columns.column_count - 1] - cells[0]) & mask) + 1;
    // short runs cost more in mispredicted branches than looking up the same nodes again
    const bool is_long = static_cast<uint64_t>(columns.column_count) >= cell_count * 2 * kLanes;
    for (int column = 0; column < columns.column_count; column += kLanes) {
        const int end = column + kLanes;
        if (is_long && column > 0 && cells[column - kLanes] == cells[end - 1]) {
            columns.runs[columns.run_count - 1].end = end;
            columns.is_picked = false;
            continue;
        }
        const uint64_t low = (cells[column] - cells[0]) & mask;
        const uint64_t last = (cells[end - 1] - cells[0]) & mask;
        if (last + 1 >= first + kLanes) first = low;
        const bool is_near = last + 1 < first + kLanes;
        columns.is_picked = columns.is_picked && is_near;
        columns.runs[columns.run_count++] = {static_cast<int>(first), end, is_near};
        const Words nodes = (load(cells + column) - cells[0]) & mask;
        store(columns.lanes + column, make_lanes(nodes - first));
    }
}

void arrange(NoiseColumnData& columns, uint64_t axis_key) {
    const int count = (columns.column_count + kLanes - 1) / kLanes * kLanes;
    columns.column_count = count;
    const uint64_t mask = columns.cell_mask;
    const uint64_t* const cells = columns.cells;
    uint64_t gaps = 0, ones = 0;
    for (int column = 1; column < count; ++column) {
        const uint64_t gap = (cells[column] - cells[column - 1]) & mask;
        gaps |= gap;
        ones += gap & 1;
    }
    if (gaps <= 1) {
        columns.upper = 1;
        const uint64_t last = (cells[count - 1] - cells[0]) & mask;
        columns.node_count = whole_groups(static_cast<int>(last) + 2);
        for (int node = 0; node < columns.node_count; node += kLanes) {
            const Words index = cells[0] + static_cast<uint64_t>(node) + ramp();
            store(columns.hashes + node, mix(axis_key + (index & mask)));
        }
    } else {
        columns.upper = count;
        columns.node_count = 2 * count;
        for (int column = 0; column < count; column += kLanes) {
            const Words index = load(cells + column);
            store(columns.hashes + column, mix(axis_key + (index & mask)));
            store(columns.hashes + count + column, mix(axis_key + ((index + 1) & mask)));
        }
    }
    for (int column = 0; column < count; column += kLanes) {
        store(columns.fades + column, fade(load(columns.fractions + column)));
    }
    columns.is_direct = columns.upper != 1 || ones == static_cast<uint64_t>(count) - 1;
    if (!columns.is_direct) find_runs(columns);
}

void find_gradients(const NoiseColumnData& columns, uint64_t row_hash, NoiseNodes& nodes_out) {
    for_each_gradients(columns.hashes, columns.node_count, row_hash,
                       [&](int node, const Gradients& here) {
                           store(nodes_out.x + node, here.x);
                           store(nodes_out.y + node, here.y);
                       });
}

void blend(const NoiseColumnData& columns, const NoiseNodes& low, const NoiseNodes& high,
           double fraction, double fade, NoiseRow& row_out) {
    const Doubles fractions = spread(fraction), fades = spread(fade);
    for (int node = 0; node < columns.node_count; node += kLanes) {
        const Blend here = blend_of({load(low.x + node), load(low.y + node)},
                                    {load(high.x + node), load(high.y + node)}, fractions, fades);
        store(row_out.slopes + node, here.slope);
        store(row_out.offsets + node, here.offset);
    }
}

/// Reads values of nodes that are too far apart for one register.
Doubles gather(const double* from, const NoiseColumnData& columns, int column) {
    Doubles values{};
    for (int lane = 0; lane < kLanes; ++lane) {
        values[lane] = from[(columns.cells[column + lane] - columns.cells[0]) & columns.cell_mask];
    }
    return values;
}

/// Calls use(column, noise) for each group of lanes.
template <class Use>
void for_each_noise(const NoiseColumnData& columns, const NoiseRow& row, Use use) {
    const auto noise_of = [&](int column, const Blend& low, const Blend& high) {
        return blend_along_x(low, high, load(columns.fractions + column),
                             load(columns.fades + column));
    };
    const int count = columns.column_count;
    if (columns.is_direct) {
        for (int column = 0; column < count; column += kLanes) {
            const int upper = column + columns.upper;
            use(column, noise_of(column, {load(row.slopes + column), load(row.offsets + column)},
                                 {load(row.slopes + upper), load(row.offsets + upper)}));
        }
        return;
    }
    const auto pick_both = [&](int first, int column, Blend& low, Blend& high) {
        const Doubles slopes = load(row.slopes + first), offsets = load(row.offsets + first);
        const Words lanes = load(columns.lanes + column);
        low = {pick(slopes, lanes), pick(offsets, lanes)};
        high = {pick_next(slopes, lanes), pick_next(offsets, lanes)};
    };
    Blend low, high;
    if (columns.is_picked) {
        for (int column = 0; column < count; column += kLanes) {
            pick_both(columns.runs[column / kLanes].first, column, low, high);
            use(column, noise_of(column, low, high));
        }
        return;
    }
    int column = 0;
    for (int i = 0; i < columns.run_count; ++i) {
        const NoiseRun run = columns.runs[i];
        if (run.is_near) {
            pick_both(run.first, column, low, high);
        } else {
            low = {gather(row.slopes, columns, column), gather(row.offsets, columns, column)};
            high = {gather(row.slopes + 1, columns, column),
                    gather(row.offsets + 1, columns, column)};
        }
        for (; column < run.end; column += kLanes) use(column, noise_of(column, low, high));
    }
}

void add(const NoiseColumnData& columns, const NoiseRow& row, double amplitude, double* sums) {
    for_each_noise(columns, row, [=](int column, Doubles noise) {
        store(sums + column, load(sums + column) + amplitude * noise);
    });
}

Doubles ridge(Doubles noise, const MultifractalShape& shape) {
    const Doubles height = doubles(bits(noise * kNoiseToUnit) & ~kSign);
    const Doubles crest = height < shape.crest ? height : spread(shape.crest);
    return 1.0 - (height + crest * (crest * shape.half_over_crest - 1.0));
}

Doubles lift(Doubles noise, const MultifractalShape& /*shape*/) {
    return noise * kNoiseToHalf + 0.5;
}

/// Works in two passes, because the combined chain of dependent operations would stall the processor.
template <Doubles (*shaped)(Doubles, const MultifractalShape&)>
void add_weighted(const NoiseColumnData& columns, const NoiseRow& row, double amplitude,
                  const MultifractalShape& shape, double* weights, double* sums) {
    alignas(64) double noises[kMaxNoiseColumns];
    for_each_noise(columns, row, [&](int column, Doubles noise) { store(noises + column, noise); });
    const MultifractalShape own = shape;  // a local copy, which stores cannot alias
    const auto add_value = [=](int column, Doubles noise) {
        const Doubles value = noise * load(weights + column);
        store(sums + column, load(sums + column) + amplitude * value);
        store(weights + column, own.heterogeneity * value + own.homogeneity);
    };
    const int count = columns.column_count;
    int column = 0;
    for (; column + 2 * kLanes <= count; column += 2 * kLanes) {
        const Doubles first = shaped(load(noises + column), own);
        const Doubles second = shaped(load(noises + column + kLanes), own);
        add_value(column, first);
        add_value(column + kLanes, second);
    }
    for (; column < count; column += kLanes) add_value(column, shaped(load(noises + column), own));
}

}  // namespace

// The loops of NoiseKernels, for the vectors that the including source is compiled for. Lanes perform the operations of
// noise() in noise.cpp in the same order. Everything here has internal linkage, and the intrinsics are always inlined;
// no wide instructions therefore reach other code.
//
// TERRANE_NOISE_KERNELS is the name of the table that the including source defines.

const NoiseKernels TERRANE_NOISE_KERNELS = {
    place, arrange, find_gradients, blend, add, add_weighted<ridge>, add_weighted<lift>,
    move,  enclose, add_points};

}  // namespace terrane::internal
