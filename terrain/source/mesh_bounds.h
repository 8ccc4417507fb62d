// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/lattice.h>

#include <array>
#include <cstdint>
#include <functional>
#include <span>

// How bounds of heights are rounded outward.
namespace terrane {

/// A bound >= 0 times this is above the exact one: a few hundred operations on numbers >= 0 lose less than
/// 2^-44 of it.
inline constexpr double kOutward = 1.0 + 0x1p-40;

/// The square root of 2, rounded up.
inline constexpr double kSqrt2 = 1.4142135623730952;

/// Of HeightSource::height(), metres, beside the rounding of its sums.
inline constexpr double kHeightAccuracy = 1e-9;

}  // namespace terrane

/// The triangles of HeightSource's bounds, by lattice indices.
namespace terrane::internal {

using LatticeTriangle = std::array<LatticePoint, 3>;

/// The two triangles of a square of lattice points of side `side`, cut between its corners of even
/// index sum.
inline std::array<LatticeTriangle, 2> cut_square(const LatticePoint& sw, std::int64_t side) {
    const LatticePoint se{sw.x + side, sw.y}, nw{sw.x, sw.y + side}, ne{sw.x + side, sw.y + side};
    if (cut_to_north_east(sw.x / side, sw.y / side)) return {{{sw, se, ne}, {sw, ne, nw}}};
    return {{{sw, se, nw}, {se, ne, nw}}};
}

inline bool is_odd(std::int64_t index) { return (index & 1) != 0; }

/// The diamond of a vertex of spacing s: the first two corners of both triangles are the vertex's ends.
inline std::array<LatticeTriangle, 2> diamond(const LatticePoint& vertex, std::int64_t s) {
    const auto at = [&](std::int64_t dx, std::int64_t dy) {
        return LatticePoint{vertex.x + dx * s, vertex.y + dy * s};
    };
    if (is_odd(vertex.x / s) && is_odd(vertex.y / s)) {
        const bool rises = cut_to_north_east((vertex.x - s) / (2 * s), (vertex.y - s) / (2 * s));
        const std::int64_t d = rises ? 1 : -1;  // the diagonal goes from (-1, -d) to (1, d)
        return {{{at(-1, -d), at(1, d), at(-1, d)}, {at(-1, -d), at(1, d), at(1, -d)}}};
    }
    if (is_odd(vertex.x / s)) {
        return {{{at(-1, 0), at(1, 0), at(0, 1)}, {at(-1, 0), at(1, 0), at(0, -1)}}};
    }
    return {{{at(0, -1), at(0, 1), at(1, 0)}, {at(0, -1), at(0, 1), at(-1, 0)}}};
}

}  // namespace terrane::internal

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
