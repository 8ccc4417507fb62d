// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/lattice.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// Where a lattice or world coordinate lies between samples: `index` + `fraction`, 0 <= fraction < 1.
/// Not clamped to the raster.
struct SamplePlace {
    std::int64_t index = 0;
    double fraction = 0.0;
};

/// Positions of a raster's samples relative to lattice and world; rows count from the south.
///
/// The *base spacing* is 2^cell_log2 finest spacings. A grid is *aligned* if cells are square: the base spacing then is
/// a cell's side, and every sample is a lattice point. Otherwise the base spacing is the largest power of two times the
/// finest spacing that is not longer than a cell's shorter side.
struct BilinearGrid {
    int columns = 0, rows = 0;
    double cell_x = 0.0, cell_y = 0.0;
    double west = 0.0, south = 0.0;  ///< world position of the south-western sample
    bool aligned = false;
    int cell_log2 = 0;
    /// Lattice point of the south-western sample, a multiple of 2^cell_log2; only if aligned.
    LatticePoint first;
    Lattice lattice;

    double base_spacing() const { return lattice.spacing * static_cast<double>(base_step()); }
    std::int64_t base_step() const { return std::int64_t{1} << cell_log2; }

    SamplePlace column_at(double x) const { return split((x - west) / cell_x); }
    SamplePlace row_at(double y) const { return split((y - south) / cell_y); }
    /// Sample position of a lattice index. Non-decreasing, so that a region inside another one covers a subset of the
    /// other's samples.
    SamplePlace column_at_index(std::int64_t ix) const {
        return aligned ? split_index(ix - first.x) : column_at(lattice.x(ix));
    }
    SamplePlace row_at_index(std::int64_t iy) const {
        return aligned ? split_index(iy - first.y) : row_at(lattice.y(iy));
    }

private:
    static SamplePlace split(double u) {
        const double whole = std::floor(u);
        return {static_cast<std::int64_t>(whole), u - whole};
    }
    SamplePlace split_index(std::int64_t from_first) const {
        const std::int64_t whole = from_first >> cell_log2;
        const double rest = static_cast<double>(from_first - (whole << cell_log2));
        return {whole, rest / static_cast<double>(base_step())};
    }
};

/// Bilinear height between four samples. Exact at the samples and over constant ground.
inline double bilinear(double south_west, double south_east, double north_west, double north_east,
                       double fx, double fy) {
    const double south = south_west + fx * (south_east - south_west);
    const double north = north_west + fx * (north_east - north_west);
    return south + fy * (north - south);
}

/// A rectangle of samples, metres relative to the store's base; beyond the raster its edge is repeated.
struct RasterPatch {
    std::int64_t column = 0, row = 0;  ///< the south-western sample
    int columns = 0, rows = 0;
    std::vector<double> samples;

    double at(std::int64_t c, std::int64_t r) const {
        return samples[static_cast<std::size_t>(r - row) * static_cast<std::size_t>(columns) +
                       static_cast<std::size_t>(c - column)];
    }
    /// Second differences at a sample.
    double bend_x(std::int64_t c, std::int64_t r) const {
        return at(c - 1, r) - 2.0 * at(c, r) + at(c + 1, r);
    }
    double bend_y(std::int64_t c, std::int64_t r) const {
        return at(c, r - 1) - 2.0 * at(c, r) + at(c, r + 1);
    }
    /// South-west - south-east - north-west + north-east of a raster cell.
    double twist(std::int64_t c, std::int64_t r) const {
        return at(c, r) - at(c + 1, r) - at(c, r + 1) + at(c + 1, r + 1);
    }
};

}  // namespace terrane::internal
