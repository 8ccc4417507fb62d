// SPDX-License-Identifier: MIT
#pragma once

#include "support/grounds.h"

#include <terrane/collision/shapes.h>
#include <terrane/terrain/ground.h>

#include <array>
#include <span>
#include <vector>

// Scenes of hand-made triangles, and a judge of depth that shares no code with the library.
namespace terrane::test {

/// An axis-aligned box of air.
struct AirBox {
    Eigen::Vector3d low, high;
};

/// Flat ground at kTop with a shaft down to a cavern, all walls along the axes.
struct CaveScene {
    static constexpr double kTop = 40.0;

    Ground ground;
    std::vector<AirBox> air;  ///< below the ground
    /// The whole surface near the cave, the ground around the mouth included.
    std::vector<std::array<Eigen::Vector3d, 3>> triangles;

    /// Distance of a point from triangles; negative in the solid.
    double distance(const Eigen::Vector3d& p,
                    std::span<const std::array<Eigen::Vector3d, 3>> near) const;
    /// How deep a shape is: the largest depth of points of it, at most what is to be found.
    double depth(const Shape& shape, const Pose& pose) const;
    bool is_air(const Eigen::Vector3d& p) const;
};

/// @param shift of the whole scene along x and y, metres, whole numbers
CaveScene make_cave(double shift = 0.0, bool is_closed = false);

}  // namespace terrane::test
