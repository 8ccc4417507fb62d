// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Point of a cubic lattice with a spacing of at most 2^-59 of the largest extent. Coordinates are 0 to 2^60, so that
/// the orientation predicate is exact in 192 bits.
using LatticePoint = std::array<std::int64_t, 3>;

/// The points of a hull in canonical order: sorted by lattice point, each lattice point once.
struct LatticePoints {
    std::vector<Eigen::Vector3d> positions;  ///< input points, metres; -0 became 0
    std::vector<LatticePoint> lattice;       ///< the same points, within 2^-53 of the extent
    double extent = 0.0;                     ///< largest over the three axes, metres
    double largest = 0.0;                    ///< largest absolute coordinate, metres
    double spacing = 0.0;                    ///< of the lattice, metres; may underflow to 0
    /// Points closer to a plane or line count as on it, in lattice spacings: 32 roundings of the largest coordinate, as
    /// a rotation leaves them, at most 2^-35 of the extent.
    double tolerance = 0.0;
};

/// @param points finite, at least one, absolute values at most 1e100
LatticePoints make_lattice_points(std::span<const Eigen::Vector3d> points);

/// From a to b, in spacings; each component is rounded once.
Eigen::Vector3d difference(const LatticePoint& a, const LatticePoint& b);

/// (b - a) x (c - a), rounded once from its exact value, in spacings squared.
Eigen::Vector3d triangle_normal(const LatticePoint& a, const LatticePoint& b,
                                const LatticePoint& c);

/// Orientation predicate: the exact sign of ((b - a) x (c - a)) . (d - a). 1 where a, b, c are counter-clockwise seen
/// from d, 0 where the four are coplanar.
int side_of_plane(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c,
                  const LatticePoint& d);

/// 2D orientation predicate: the exact sign of the axis component of (b - a) x (c - a); 1 is a left turn.
int turn(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c, int axis);

}  // namespace terrane::internal
