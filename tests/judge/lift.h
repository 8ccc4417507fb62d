// SPDX-License-Identifier: MIT
#pragma once

#include "surface.h"

#include <array>
#include <span>
#include <vector>

namespace judge {

enum class ShapeKind { sphere, capsule, box, hull };

/// A convex shape at a pose: centre, and axes as columns of a rotation. A body has one or more of them.
struct Body {
    ShapeKind kind = ShapeKind::sphere;
    double radius = 0.5;       ///< of a sphere or capsule, metres
    double half_height = 0.0;  ///< of a capsule's core along its z
    Vec half_extents;          ///< of a box
    std::vector<Vec> points;   ///< of a hull, relative to its centre, in its axes
    Vec centre;
    std::array<Vec, 3> axes{Vec{1, 0, 0}, Vec{0, 1, 0}, Vec{0, 0, 1}};

    double reach() const;   ///< largest distance of a point from the centre
    double bottom() const;  ///< world z of the lowest point
};

struct Lift {
    bool known = true;  ///< false: heights below the body are missing
    double value =
        0.0;  ///< vertical overlap: largest surface height minus z over the shape, 0 without overlap
};

/// Brute force over every triangle under the bounding square of each part.
Lift compute_lift(std::span<const Body> parts, const Surface& surface);

/// Penetration depth: length of the minimum translation that separates the body from the ground, at most its lift.
/// Searched over sampled directions and lengths: a close upper bound of the true depth.
double compute_depth(std::span<const Body> parts, const Surface& surface, double lift);

}  // namespace judge
