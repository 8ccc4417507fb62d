// SPDX-License-Identifier: MIT
#include "source/fractal/fractal_surface.h"

#include "source/fractal/noise.h"

#include <terrane/base/result.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace terrane {

void NoiseColumns::assign(const internal::NoiseAxis& axis, std::uint64_t first, std::uint64_t step,
                          int count) {
    TERRANE_ASSERT(count >= 1 && count <= internal::kMaxNoiseColumns, "too many columns");
    data_.column_count = count;
    kernels_.place(data_, axis, first, step);
    kernels_.arrange(data_, axis.key);
    has_row_ = false;
}

void NoiseColumns::assign(std::uint64_t axis_key, std::uint64_t cell_mask,
                          std::span<const NoiseCoordinate> coordinates) {
    TERRANE_ASSERT(!coordinates.empty() && coordinates.size() <= internal::kMaxNoiseColumns,
                   "too many columns");
    data_.column_count = static_cast<int>(coordinates.size());
    data_.cell_mask = cell_mask;
    const auto padded_count = static_cast<std::size_t>(padded(data_.column_count));
    for (std::size_t column = 0; column < padded_count; ++column) {
        const NoiseCoordinate& at = coordinates[std::min(column, coordinates.size() - 1)];
        data_.cells[column] = at.cell;
        data_.fractions[column] = at.fraction;
    }
    kernels_.arrange(data_, axis_key);
    has_row_ = false;
}

void NoiseColumns::find_row(std::uint64_t axis_key, std::uint64_t cell_mask, NoiseCoordinate y,
                            internal::NoiseRow& row_out) {
    if (!has_row_ || y.cell != row_cell_) {
        const auto hash = [&](std::uint64_t cell) { return mix64(axis_key + (cell & cell_mask)); };
        if (has_row_ && y.cell == ((row_cell_ + 1) & cell_mask)) {
            low_ = 1 - low_;  // the upper row becomes the lower one
        } else {
            kernels_.find_gradients(data_, hash(y.cell), data_.nodes[low_]);
        }
        kernels_.find_gradients(data_, hash(y.cell + 1), data_.nodes[1 - low_]);
        row_cell_ = y.cell;
        has_row_ = true;
    }
    kernels_.blend(data_, data_.nodes[low_], data_.nodes[1 - low_], y.fraction,
                   quintic_fade(y.fraction), row_out);
}

// Sources:
//   Musgrave, Kolb, Mace. The Synthesis and Rendering of Eroded Fractal Terrains. SIGGRAPH 1989. (multifractals)
//   Ebert, Musgrave, Peachey, Perlin, Worley. Texturing and Modeling. 3rd ed., 2003, ch. 16. (ridged and hybrid)
//   Quilez. Domain warping. 2002. (warped)
// Deviations, for tighter bounds (fractal_bounds.cpp): the crest, 1 - |n|, is rounded; the hybrid's first octave is
// weighted like the others; a weight is a linear function of the previous weighted value, not a multiple that is
// clamped to 1. The slope of the weights therefore grows from octave to octave no faster than that of the octaves.

namespace {

using internal::kMaxNoiseColumns;
using internal::NoiseAxis;
using internal::NoiseOctave;

constexpr double kUnitsPerMetre = 0x1p24;
/// Octaves of the warp are numbered separately, after those of the heights.
constexpr int kFirstWarpOctave = 64;

/// A coordinate in whole units and a fraction of a unit, 0 to 1.
struct FixedCoordinate {
    std::uint64_t units = 0;
    double rest = 0.0;

    void move(double displacement_in_units) {
        const double displacement = displacement_in_units + rest;
        const double whole = std::floor(displacement);
        units += static_cast<std::uint64_t>(static_cast<std::int64_t>(whole));
        rest = displacement - whole;
    }
};

FixedCoordinate to_fixed(double metres) {
    double wrapped = metres;
    if (std::abs(metres) >= 0x1p39) {
        wrapped = std::fmod(metres, 0x1p40);
        if (wrapped >= 0x1p39) wrapped -= 0x1p40;
        if (wrapped < -0x1p39) wrapped += 0x1p40;
    }
    const double units = wrapped * kUnitsPerMetre;
    const double whole = std::floor(units);
    return {static_cast<std::uint64_t>(static_cast<std::int64_t>(whole)), units - whole};
}

/// Offset of an octave: any number of cells plus a fraction between 1/4 and 3/4. With a fraction of 0 or 1, all samples
/// of a lattice coarser than the octave would be nodes, where noise is zero.
std::uint64_t make_offset(std::uint64_t hash, int shift) {
    const std::uint64_t half = std::uint64_t{1} << (shift - 1), quarter = half >> 1;
    return (hash & half) != 0 ? hash & ~quarter : hash | quarter;
}

NoiseAxis make_axis(std::uint64_t key, int shift) {
    return {key, make_offset(mix64(key), shift), shift, std::ldexp(1.0, -shift)};
}

/// @param first_number number of the seed's first octave to use; the numbers of the others follow by `stride`
std::vector<NoiseOctave> make_octaves(const FractalSettings& settings, int count, double amplitude,
                                      int first_number, int stride) {
    std::vector<NoiseOctave> octaves;
    for (int index = 0; index < count; ++index) {
        const int shift = settings.wavelength_log2 - index - kUnitLog2;
        const NoiseKeys keys = NoiseKeys::make(settings.seed, first_number + stride * index);
        octaves.push_back({make_axis(keys.x, shift), make_axis(keys.y, shift), amplitude});
        amplitude *= settings.gain;
    }
    return octaves;
}

double noise_at(const NoiseOctave& octave, const FixedCoordinate& x, const FixedCoordinate& y) {
    return noise(noise_place(octave.x, x.units, x.rest), noise_place(octave.y, y.units, y.rest));
}

double sum_at(std::span<const NoiseOctave> octaves, const FixedCoordinate& x,
              const FixedCoordinate& y) {
    double sum = 0.0;
    for (const NoiseOctave& octave : octaves) sum += octave.amplitude * noise_at(octave, x, y);
    return sum;
}

double shaped(FractalKind kind, double noise, const internal::MultifractalShape& shape) {
    if (kind == FractalKind::hybrid) return noise * internal::kNoiseToHalf + 0.5;
    const double height = std::abs(noise * internal::kNoiseToUnit);
    const double crest = height < shape.crest ? height : shape.crest;
    return 1.0 - (height + crest * (crest * shape.half_over_crest - 1.0));
}

/// A piece of a grid that is small enough to stay in the L2 cache while all octaves are added.
struct Tile {
    static constexpr int kMaxRows = 44;
    /// Pieces of a row may be read past their end, to the end of a group.
    using Rows = double[kMaxRows][kMaxNoiseColumns + internal::kNoiseGroup];

    UnitGrid grid;
    alignas(64) Rows sums;
    alignas(64) Rows weights;         ///< of multifractals
    alignas(64) Rows warp_x, warp_y;  ///< of warped ground

    static void fill(Rows& rows, int count, double value) {
        for (int row = 0; row < count; ++row) std::ranges::fill(rows[row], value);
    }
};

/// Calls add(octave, columns, noise_row, row) for each octave and row of a tile.
template <class Add>
void pass_over(std::span<const NoiseOctave> octaves, const UnitGrid& grid,
               const internal::NoiseKernels& kernels, const Add& add) {
    NoiseColumns columns(kernels);
    internal::NoiseRow noise_rows[2];
    for (const NoiseOctave& octave : octaves) {
        const auto find_row = [&](int row) {
            const std::uint64_t y = grid.y + grid.step * static_cast<std::uint64_t>(row);
            columns.find_row(octave.y.key, ~std::uint64_t{0} >> octave.y.shift,
                             noise_coordinate(octave.y, y, 0.0), noise_rows[row & 1]);
        };
        columns.assign(octave.x, grid.x, grid.step, grid.columns);
        find_row(0);
        for (int row = 0; row < grid.rows; ++row) {
            if (row + 1 < grid.rows) find_row(row + 1);
            add(octave, columns, noise_rows[row & 1], row);
        }
    }
}

void add_sums(std::span<const NoiseOctave> octaves, const UnitGrid& grid,
              const internal::NoiseKernels& kernels, Tile::Rows& sums) {
    pass_over(octaves, grid, kernels,
              [&](const NoiseOctave& octave, const NoiseColumns& columns,
                  const internal::NoiseRow& noise_row,
                  int row) { columns.add(noise_row, octave.amplitude, sums[row]); });
}

void add_multifractal(const FractalSurface& surface, std::span<const NoiseOctave> octaves,
                      const internal::NoiseKernels& kernels, Tile& tile) {
    const bool ridged = surface.kind() == FractalKind::ridged;
    pass_over(
        octaves, tile.grid, kernels,
        [&](const NoiseOctave& octave, const NoiseColumns& columns,
            const internal::NoiseRow& noise_row, int row) {
            double* const weights = tile.weights[row];
            double* const sums = tile.sums[row];
            if (ridged) {
                columns.add_ridged(noise_row, octave.amplitude, surface.shape(), weights, sums);
            } else {
                columns.add_hybrid(noise_row, octave.amplitude, surface.shape(), weights, sums);
            }
        });
}

/// Length of the equal pieces, at most `most` long, into which a side is divided; the last one may be shorter.
int piece_side(int side, int most) {
    const int pieces = (side + most - 1) / most;
    return (side + pieces - 1) / pieces;
}

/// Sets the points of a piece of a tile, row by row, each displaced by the warp.
void place_points(const Tile& tile, int west, int width, int south, int rows,
                  const internal::NoiseKernels& kernels, internal::NoisePoints& points_out) {
    const int padded_width = NoiseColumns::padded(width);
    for (int row = 0; row < rows; ++row) {
        const int first = row * width;
        for (int column = 0; column < padded_width; ++column) {  // padding: overwritten next
            points_out.x[first + column] =
                tile.grid.x + tile.grid.step * static_cast<std::uint64_t>(west + column);
            points_out.y[first + column] =
                tile.grid.y + tile.grid.step * static_cast<std::uint64_t>(south + row);
            points_out.rest_x[first + column] = points_out.rest_y[first + column] = 0.0;
        }
        kernels.move(points_out, first, padded_width, kUnitsPerMetre,
                     tile.warp_x[south + row] + west, tile.warp_y[south + row] + west);
    }
    const int count = rows * width;
    points_out.count = NoiseColumns::padded(count);
    const auto repeat_last = [=](auto& values) {
        std::fill(values + count, values + NoiseColumns::padded(count), values[count - 1]);
    };
    repeat_last(points_out.x);
    repeat_last(points_out.y);
    repeat_last(points_out.rest_x);
    repeat_last(points_out.rest_y);
    kernels.enclose(points_out);
}

void add_warped(const FractalSurface& surface, std::span<const NoiseOctave> octaves,
                const internal::NoiseKernels& kernels, Tile& tile) {
    // pieces are nearly square, because squares have the fewest nodes around them; a row may be written past its end
    constexpr int kMaxWidth = 24, kMaxHeight = internal::kMaxNoisePoints / kMaxWidth;
    Tile::fill(tile.warp_x, tile.grid.rows, 0.0);
    Tile::fill(tile.warp_y, tile.grid.rows, 0.0);
    add_sums(surface.warp_x(), tile.grid, kernels, tile.warp_x);
    add_sums(surface.warp_y(), tile.grid, kernels, tile.warp_y);
    internal::NoisePoints points;
    alignas(64) double sums[internal::kMaxNoisePoints];
    const int most_columns = piece_side(tile.grid.columns, kMaxWidth);
    const int most_rows = piece_side(tile.grid.rows, kMaxHeight);
    for (int south = 0; south < tile.grid.rows; south += most_rows) {
        const int rows = std::min(most_rows, tile.grid.rows - south);
        for (int west = 0; west < tile.grid.columns; west += most_columns) {
            const int width = std::min(most_columns, tile.grid.columns - west);
            place_points(tile, west, width, south, rows, kernels, points);
            std::fill_n(sums, points.count, 0.0);
            for (int row = 0; row < rows; ++row) {
                std::copy_n(tile.sums[south + row] + west, width, sums + row * width);
            }
            for (const NoiseOctave& octave : octaves) kernels.add_points(octave, points, sums);
            for (int row = 0; row < rows; ++row) {
                std::copy_n(sums + row * width, width, tile.sums[south + row] + west);
            }
        }
    }
}

}  // namespace

FractalSurface::FractalSurface(const FractalSettings& settings)
    : kind_(settings.kind),
      octaves_(make_octaves(settings, settings.octave_count, settings.amplitude, 0, 1)),
      shape_{settings.crest_rounding, 0.5 / settings.crest_rounding, settings.heterogeneity,
             1.0 - settings.heterogeneity} {
    if (kind_ != FractalKind::warped) return;
    const double displacement = settings.warp * std::ldexp(1.0, settings.wavelength_log2);
    warp_x_ = make_octaves(settings, kWarpOctaves, displacement, kFirstWarpOctave, 2);
    warp_y_ = make_octaves(settings, kWarpOctaves, displacement, kFirstWarpOctave + 1, 2);
}

double FractalSurface::height(double x, double y) const {
    FixedCoordinate fixed_x = to_fixed(x), fixed_y = to_fixed(y);
    if (kind_ == FractalKind::warped) {
        const double warp_x = sum_at(warp_x_, fixed_x, fixed_y);
        const double warp_y = sum_at(warp_y_, fixed_x, fixed_y);
        fixed_x.move(warp_x * kUnitsPerMetre);
        fixed_y.move(warp_y * kUnitsPerMetre);
    }
    if (kind_ == FractalKind::fbm || kind_ == FractalKind::warped) {
        return sum_at(octaves_, fixed_x, fixed_y);
    }
    double sum = 0.0, weight = 1.0;
    for (const NoiseOctave& octave : octaves_) {
        const double value = shaped(kind_, noise_at(octave, fixed_x, fixed_y), shape_) * weight;
        sum += octave.amplitude * value;
        weight = shape_.heterogeneity * value + shape_.homogeneity;
    }
    return sum;
}

void FractalSurface::sample(const UnitGrid& grid, internal::SimdLevel level,
                            std::span<double> heights_out) const {
    std::ranges::fill(heights_out, 0.0);
    add_octaves(grid, 0, static_cast<int>(octaves_.size()), level, heights_out, {});
}

void FractalSurface::add_octaves(const UnitGrid& grid, int first, int last,
                                 internal::SimdLevel level, std::span<double> sums,
                                 std::span<double> weights) const {
    const std::span octaves = std::span<const NoiseOctave>(octaves_).subspan(
        static_cast<std::size_t>(first), static_cast<std::size_t>(last - first));
    if (octaves.empty()) return;
    const internal::NoiseKernels& kernels = internal::noise_kernels(level);
    const int width = NoiseColumns::padded(piece_side(grid.columns, kMaxNoiseColumns));
    const int height = piece_side(grid.rows, Tile::kMaxRows);
    Tile tile;
    for (int south = 0; south < grid.rows; south += height) {
        for (int west = 0; west < grid.columns; west += width) {
            tile.grid = {grid.x + grid.step * static_cast<std::uint64_t>(west),
                         grid.y + grid.step * static_cast<std::uint64_t>(south), grid.step,
                         std::min(width, grid.columns - west), std::min(height, grid.rows - south)};
            const auto place = [&](std::span<double> values, int row) {
                const std::size_t begin =
                    static_cast<std::size_t>(south + row) * static_cast<std::size_t>(grid.columns) +
                    static_cast<std::size_t>(west);
                return values.subspan(begin, static_cast<std::size_t>(tile.grid.columns));
            };
            for (int row = 0; row < tile.grid.rows; ++row) {
                std::ranges::copy(place(sums, row), tile.sums[row]);
                if (!has_weights()) continue;
                if (weights.empty()) {
                    std::ranges::fill(tile.weights[row], 1.0);
                } else {
                    std::ranges::copy(place(weights, row), tile.weights[row]);
                }
            }
            if (kind_ == FractalKind::fbm) {
                add_sums(octaves, tile.grid, kernels, tile.sums);
            } else if (kind_ == FractalKind::warped) {
                add_warped(*this, octaves, kernels, tile);
            } else {
                add_multifractal(*this, octaves, kernels, tile);
            }
            for (int row = 0; row < tile.grid.rows; ++row) {
                const auto columns = static_cast<std::size_t>(tile.grid.columns);
                std::copy_n(tile.sums[row], columns, place(sums, row).begin());
                if (!weights.empty() && has_weights()) {
                    std::copy_n(tile.weights[row], columns, place(weights, row).begin());
                }
            }
        }
    }
}

}  // namespace terrane
