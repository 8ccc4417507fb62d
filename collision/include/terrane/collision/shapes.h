// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/compound.h>
#include <terrane/collision/convex_hull.h>
#include <terrane/collision/primitives.h>
#include <terrane/terrain/math.h>
#include <terrane/terrain/result.h>

#include <variant>

namespace terrane {

/// A convex shape or a union of them.
using Shape = std::variant<Sphere, Capsule, Box, ConvexHull, Compound>;

/// Fails: invalid_argument, naming the field and its value, for a size that is negative, not finite or above 1e5 m.
///        Sizes of 0 are valid
Result<void> check(const Shape& shape);

/// Largest distance of a point of the shape from its origin, metres.
double bounding_radius(const Shape& shape);

/// Half of the shape's extent along its thinnest direction, metres. Tolerances scale with it.
double smallest_half_extent(const Shape& shape);

/// Default of BodySettings::contact_tolerance: the smaller of 1 cm and a tenth of the smallest half extent, metres.
double default_contact_tolerance(const Shape& shape);

/// Support function: largest coordinate of the shape along a unit direction of the body frame, metres.
double support_distance(const Shape& shape, const Eigen::Vector3d& direction_body);

}  // namespace terrane
