// SPDX-License-Identifier: MIT
#pragma once

#include "support/grounds.h"

#include <terrane/collision/shapes.h>
#include <terrane/terrain/ground.h>

#include <array>
#include <span>
#include <vector>

// Hand-made scenes of triangles and a depth oracle that shares no code with the library.
namespace terrane::test {

/// Adds a rectangle of parts x parts squares, spanned by u and v from a corner; u x v points out of the solid.
void add_rectangle(SolidTriangles& solid, const Eigen::Vector3d& corner, const Eigen::Vector3d& u,
                   const Eigen::Vector3d& v, int parts);

/// An axis-aligned box of air below the ground.
struct AirBox {
    Eigen::Vector3d low, high;
};

/// Flat ground at kTop with a shaft down to a cavern; all walls are axis-aligned.
struct CaveScene {
    static constexpr double kTop = 40.0;

    Ground ground;
    std::vector<AirBox> air;  ///< below the ground
    /// All triangles near the cave, including the ground around the mouth.
    std::vector<std::array<Eigen::Vector3d, 3>> triangles;

    /// Signed distance of a point from triangles; negative in the solid.
    double distance(const Eigen::Vector3d& p,
                    std::span<const std::array<Eigen::Vector3d, 3>> near) const;
    /// Depth of a shape: the largest over sampled points, hence at most the true depth.
    double depth(const Shape& shape, const Pose& pose) const;
    bool is_air(const Eigen::Vector3d& p) const;
};

/// @param shift of the scene along x and y, whole metres
CaveScene make_cave(double shift = 0.0, bool is_closed = false);

}  // namespace terrane::test
