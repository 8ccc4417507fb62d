// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/lattice.h>

#include <functional>
#include <span>

namespace terrane {

/// The smallest float >= a bound >= 0.
float round_up(double bound);

/// A-priori bounds of the deviation of a fractal from its interpolation over triangles of spacing s.
struct SpacingBounds {
    double centre = 0.0;    ///< half squares of side 2 s: the diamond of a centre of spacing s
    double midpoint = 0.0;  ///< their halves: the diamond of a midpoint of spacing s
    double cell = 0.0;      ///< half cells of side s
    /// Interpolation error between samples of spacing s / 4.
    double fine = 0.0;
};

/// Samples and bounds of a fractal around a grid of some spacing.
struct MeshSamples {
    /// Heights of a grid.
    std::function<void(const SampleGrid& grid, std::span<double> heights_out)> heights;
    /// Sampled intervals (centre and radius) that contain the heights of a grid, which is addressed in quarters of
    /// the finest spacing (corner and step). Between the samples the height is within the linear interpolation of
    /// the intervals over the triangles of this spacing, widened by SpacingBounds::fine.
    ///
    /// @param radii_out  empty where has_radii is false: they are all zero
    std::function<void(const SampleGrid& grid, std::span<double> centres_out,
                       std::span<double> radii_out)>
        fine;
    bool has_radii = false;
};

/// HeightSource::vertex_bounds() and cell_bounds() of a fractal in one call; skips an empty span. Vertex bounds require
/// a corner that is a multiple of 2 * step.
void compute_mesh_bounds(const SampleGrid& grid, const MeshSamples& samples,
                         const SpacingBounds& bounds, std::span<float> vertex_bounds_out,
                         std::span<float> cell_bounds_out);

}  // namespace terrane
