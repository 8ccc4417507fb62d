// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Points on a cubic lattice whose spacing is at most 2^-59 of the largest extent. Coordinates are
/// 0 to 2^60: then the side of a plane on which a point lies has an exact answer in 192 bits.
using LatticePoint = std::array<std::int64_t, 3>;

/// The points of a hull in canonical order: sorted by lattice place, each place once.
struct LatticePoints {
    std::vector<Eigen::Vector3d> places;  ///< as they were given, metres; -0 became 0
    std::vector<LatticePoint> lattice;    ///< within 2^-53 of the extent of the same
    double extent = 0.0;                  ///< largest over the three axes, metres
    double largest = 0.0;                 ///< coordinate, by its absolute value, metres
    double spacing = 0.0;                 ///< of the lattice, metres; may be 0 where it underflows
    /// Within this of a plane or a line, points count as on it, in lattice spacings: 32 roundings
    /// of the largest coordinate, which a rotation leaves, but no more than 2^-35 of the extent.
    double tolerance = 0.0;
};

/// @param points finite, at least one, absolute values at most 1e100
LatticePoints make_lattice_points(std::span<const Eigen::Vector3d> points);

/// From a to b, in spacings; each component is rounded once.
Eigen::Vector3d difference(const LatticePoint& a, const LatticePoint& b);

/// (b - a) x (c - a), rounded once from its exact value, in spacings squared.
Eigen::Vector3d triangle_normal(const LatticePoint& a, const LatticePoint& b,
                                const LatticePoint& c);

/// The exact sign of ((b - a) x (c - a)) . (d - a): 1 where d lies on the side from which a, b, c are
/// counter-clockwise, -1 on the other, 0 on the plane, and where a, b, c are on one line.
int side_of_plane(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c,
                  const LatticePoint& d);

/// The exact sign of (b - a) x (c - a) along one axis: 1 for a left turn seen from its tip.
int turn(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c, int axis);

}  // namespace terrane::internal
