// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/lattice.h>

#include <span>

namespace terrane {

class FractalBounds;

/// The smallest float that is not below a bound.
float round_up(double bound);

/// How far a fractal can leave its interpolation over triangles of one spacing, a priori.
struct SpacingBounds {
    double centre = 0.0;     ///< half squares of side 2 s: the diamond of a centre of spacing s
    double midpoint = 0.0;   ///< their halves: the diamond of a midpoint of spacing s
    double cell = 0.0;       ///< half cells of side s
    double half_cell = 0.0;  ///< half cells of side s / 2

    /// @param spacing  s, metres
    static SpacingBounds make(const FractalBounds& fractal, double spacing);
};

/// The samples that the bounds of a grid want: at half its step, with a margin around, addressed
/// in halves of the finest spacing (corner and step).
SampleGrid vertex_support(const SampleGrid& grid);
SampleGrid cell_support(const SampleGrid& grid);

/// HeightSource::vertex_bounds() of a fractal.
///
/// @param heights  of vertex_support(grid)
void compute_vertex_bounds(const SampleGrid& grid, std::span<const double> heights,
                           const SpacingBounds& bounds, std::span<float> bounds_out);

/// HeightSource::cell_bounds() of a fractal.
///
/// @param heights  of cell_support(grid)
void compute_cell_bounds(const SampleGrid& grid, std::span<const double> heights,
                         const SpacingBounds& bounds, std::span<float> bounds_out);

}  // namespace terrane
