// SPDX-License-Identifier: MIT
#pragma once

#include "surface.h"

#include <array>
#include <span>
#include <vector>

namespace judge {

enum class ShapeKind { sphere, capsule, box, hull };

/// A convex shape at a pose: its centre, and its axes as columns of a rotation. A body is one, or several that move
/// together.
struct Body {
    ShapeKind kind = ShapeKind::sphere;
    double radius = 0.5;       ///< of a sphere or capsule, metres
    double half_height = 0.0;  ///< of a capsule's core along its z
    Vec half_extents;          ///< of a box
    std::vector<Vec> points;   ///< of a hull, from its centre along its axes
    Vec centre;
    std::array<Vec, 3> axes{Vec{1, 0, 0}, Vec{0, 1, 0}, Vec{0, 0, 1}};

    double reach() const;   ///< largest distance of a point from the centre
    double bottom() const;  ///< world z of the lowest point
};

struct Lift {
    bool known = true;   ///< false: heights are missing under the body
    double value = 0.0;  ///< largest of surface minus z over the shape; 0 where they are apart
};

/// Brute force over every triangle under the bounding square of each part.
Lift compute_lift(std::span<const Body> parts, const Surface& surface);

/// Length of the shortest translation found that parts the body from the ground, at most its lift.
/// Searched over many directions: an upper bound of the true depth that is close to it.
double compute_depth(std::span<const Body> parts, const Surface& surface, double lift);

}  // namespace judge
