// SPDX-License-Identifier: MIT
//
// Implementation of height_kernels_*.cpp: each defines TERRANE_KERNELS and includes this file once. Everything has
// internal linkage: see simd_level.h.
#pragma once

#include "ground/height_kernels.h"

namespace terrane::internal {
namespace {

#if defined(__AVX512F__)
constexpr int kLanes = 8;
#elif defined(__AVX2__)
constexpr int kLanes = 4;
#else
constexpr int kLanes = 2;
#endif
static_assert(kHeightBlock % kLanes == 0);

constexpr std::size_t kRow = 129;     // samples in a row of a chunk
constexpr double kSideCells = 128.0;  // cells in a row of a chunk

using Doubles = double __attribute__((vector_size(8 * kLanes)));
using Masks = std::int64_t __attribute__((vector_size(8 * kLanes)));
using Ints = std::int32_t __attribute__((vector_size(4 * kLanes)));

Doubles load(const double* from) {
    Doubles value;
    __builtin_memcpy(&value, from, sizeof value);
    return value;
}
Ints load(const std::int32_t* from) {
    Ints value;
    __builtin_memcpy(&value, from, sizeof value);
    return value;
}
void store(double* to, Doubles value) { __builtin_memcpy(to, &value, sizeof value); }
void store(std::int32_t* to, Ints value) { __builtin_memcpy(to, &value, sizeof value); }

/// Exact below 2^51: adding 1.5 * 2^52 rounds to an integer.
Doubles floor_of(Doubles value) {
    constexpr double kRounding = 0x1.8p52;
    const Doubles nearest = (value + kRounding) - kRounding;
    return nearest > value ? nearest - 1.0 : nearest;
}

void find_cells(const AxisLines& lines, const double* p, AxisCells& out) {
    const auto line_at = [&](Doubles index) { return lines.origin + lines.spacing * index; };
    for (std::size_t k = 0; k < kHeightBlock; k += kLanes) {
        const Doubles at = load(p + k);
        // the product with the reciprocal is inexact; the index is corrected by comparison with the lines
        Doubles index = floor_of((at - lines.origin) * lines.inverse_spacing);
        index = at < line_at(index) ? index - 1.0 : index;
        index = at >= line_at(index + 1.0) ? index + 1.0 : index;
        const Masks is_inside =
            (at >= lines.low) & (at <= lines.high) & (index >= lines.first) & (index <= lines.last);
        const Doubles none{};
        const Doubles chunk = floor_of(index * (1.0 / kSideCells));
        const Doubles cell = index - kSideCells * chunk;
        const Doubles place = (at - line_at(index)) / lines.spacing;
        store(out.place + k, place < 1.0 ? place : none + 1.0);
        store(out.chunk + k, __builtin_convertvector(is_inside ? chunk : none, Ints));
        store(out.cell + k, __builtin_convertvector(is_inside ? cell : none - 1.0, Ints));
    }
}

/// Samples at an offset from the south-west corners.
Doubles samples_at(const std::int32_t* const* south_west, std::size_t offset) {
    Ints samples{};
    for (int lane = 0; lane < kLanes; ++lane) samples[lane] = south_west[lane][offset];
    return __builtin_convertvector(samples, Doubles);
}

void heights(const std::int32_t* const* corners, const AxisCells& x, const AxisCells& y,
             double quantum, BlockHeights& out) {
    const Doubles none{};
    for (std::size_t k = 0; k < kHeightBlock; k += kLanes) {
        const Doubles u = load(x.place + k), v = load(y.place + k);
        const Ints sum = load(x.cell + k) + load(y.cell + k);
        const Masks is_cut_to_north_east = __builtin_convertvector((sum & 1) == 0, Masks);
        const Doubles south_west = samples_at(corners + k, 0);
        const Doubles south_east = samples_at(corners + k, 1);
        const Doubles north_west = samples_at(corners + k, kRow);
        const Doubles north_east = samples_at(corners + k, kRow + 1);
        // as in height_in_cell(): whether the triangle has the southern edge of the cell, and the eastern one
        const Masks is_south = is_cut_to_north_east ? Masks(u >= v) : Masks(u + v <= 1.0);
        const Masks is_east = ~(is_south ^ is_cut_to_north_east);
        const Doubles south = quantum * (south_east - south_west);
        const Doubles east = quantum * (north_east - south_east);
        const Doubles slope_x = is_south ? south : quantum * (north_east - north_west);
        const Doubles slope_y = is_east ? east : quantum * (north_west - south_west);
        const Doubles far = (~is_south & ~is_cut_to_north_east) ? none + 1.0 : none;
        const Doubles rise = far * (south + east) + slope_x * (u - far) + slope_y * (v - far);
        store(out.height + k, quantum * south_west + rise);
        store(out.slope_x + k, slope_x);
        store(out.slope_y + k, slope_y);
    }
}

void normals(const BlockHeights& heights, double spacing, BlockNormals& out) {
    for (std::size_t k = 0; k < kHeightBlock; ++k) {
        const double x = -heights.slope_x[k] / spacing, y = -heights.slope_y[k] / spacing;
        const double length = __builtin_sqrt(x * x + y * y + 1.0);
        out.x[k] = x / length;
        out.y[k] = y / length;
        out.z[k] = 1.0 / length;
    }
}

}  // namespace

extern const HeightKernels TERRANE_KERNELS;
const HeightKernels TERRANE_KERNELS = {find_cells, heights, normals};

}  // namespace terrane::internal
