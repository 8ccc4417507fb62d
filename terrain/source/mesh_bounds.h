// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/lattice.h>

#include <array>
#include <cstdint>
#include <functional>
#include <span>

// Outward rounding of bounds.
namespace terrane {

/// Factor that rounds a bound >= 0 outward: a few hundred operations on numbers >= 0 have a relative error below 2^-44.
inline constexpr double kOutward = 1.0 + 0x1p-40;

/// The square root of 2, rounded up.
inline constexpr double kSqrt2 = 1.4142135623730952;

/// Largest error of HeightSource::height(), metres, in addition to the rounding of its sums.
inline constexpr double kHeightAccuracy = 1e-9;

}  // namespace terrane

/// The triangles that HeightSource's bounds refer to, by lattice indices.
namespace terrane::internal {

using LatticeTriangle = std::array<LatticePoint, 3>;

/// The triangles of a square from corner `sw`, cut between the corners whose index sums, in units of `side`, are even.
inline std::array<LatticeTriangle, 2> cut_square(const LatticePoint& sw, std::int64_t side) {
    const LatticePoint se{sw.x + side, sw.y}, nw{sw.x, sw.y + side}, ne{sw.x + side, sw.y + side};
    if (cut_to_north_east(sw.x / side, sw.y / side)) return {{{sw, se, ne}, {sw, ne, nw}}};
    return {{{sw, se, nw}, {se, ne, nw}}};
}

inline bool is_odd(std::int64_t index) { return (index & 1) != 0; }

/// The diamond of a vertex of spacing s; the first two corners of both triangles are the vertex's ends.
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

/// A-priori bounds of the deviation of heights from linear interpolation over right triangles, for a spacing of s.
struct SpacingBounds {
    double centre = 0.0;    ///< half a square of side 2 s: the diamond of a centre of spacing s
    double midpoint = 0.0;  ///< half of that: the diamond of a midpoint of spacing s
    double cell = 0.0;      ///< half a cell of side s
    /// Interpolation error between samples of spacing s / 4.
    double fine = 0.0;
};

/// Functions that sample heights and intervals of heights around a grid.
struct MeshSamples {
    /// Heights of a grid.
    std::function<void(const SampleGrid& grid, std::span<double> heights_out)> heights;
    /// Samples intervals (centre and radius) that contain the heights, at the points of a grid whose corner and step
    /// are in quarters of the finest spacing. Between the samples the height is within the linear interpolation of the
    /// intervals over the triangles of this spacing, widened by SpacingBounds::fine.
    ///
    /// @param radii_out  empty if has_radii is false: all radii are zero
    std::function<void(const SampleGrid& grid, std::span<double> centres_out,
                       std::span<double> radii_out)>
        fine;
    bool has_radii = false;
};

/// Computes HeightSource::vertex_bounds() and cell_bounds() from samples in one call; an empty span is skipped. Vertex
/// bounds require a corner that is a multiple of 2 * step.
void compute_mesh_bounds(const SampleGrid& grid, const MeshSamples& samples,
                         const SpacingBounds& bounds, std::span<float> vertex_bounds_out,
                         std::span<float> cell_bounds_out);

}  // namespace terrane
