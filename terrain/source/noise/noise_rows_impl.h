// SPDX-License-Identifier: MIT
//
// Part of noise_kernels_impl.h: rows of samples of a grid.
#pragma once

#include "source/noise/noise_gradients_impl.h"

namespace terrane::internal {
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

/// Of columns that share nodes.
void find_runs(NoiseColumnData& columns) {
    const uint64_t mask = columns.cell_mask;
    const uint64_t* const cells = columns.cells;
    uint64_t first = 0;
    columns.run_count = 0;
    columns.is_picked = true;
    const uint64_t cell_count = ((cells[columns.column_count - 1] - cells[0]) & mask) + 1;
    // short runs cost more in mispredicted branches than finding the same nodes again
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

/// Of nodes too far apart for a register.
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

/// In two passes: chains of operations that are as long as both keep a processor waiting.
template <Doubles (*shaped)(Doubles, const MultifractalShape&)>
void add_weighted(const NoiseColumnData& columns, const NoiseRow& row, double amplitude,
                  const MultifractalShape& shape, double* weights, double* sums) {
    alignas(64) double noises[kMaxNoiseColumns];
    for_each_noise(columns, row, [&](int column, Doubles noise) { store(noises + column, noise); });
    const MultifractalShape own = shape;  // nothing that is stored changes it
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
}  // namespace terrane::internal
