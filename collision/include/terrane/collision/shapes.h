// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/compound.h>
#include <terrane/collision/convex_hull.h>
#include <terrane/collision/primitives.h>
#include <terrane/terrain/math.h>
#include <terrane/terrain/result.h>

#include <variant>

namespace terrane {

/// What questions are asked of: a convex shape, or a union of them.
using Shape = std::variant<Sphere, Capsule, Box, ConvexHull, Compound>;

/// Fails with invalid_argument, naming the field and its value, where a size is negative, not
/// finite, or above 1e5 m. Zero radii, cores and extents are legal.
Result<void> check(const Shape& shape);

/// Largest distance of a point of the shape from its origin, metres.
double bounding_radius(const Shape& shape);

/// Half of the shape's extent along its thinnest direction, metres: what tolerances scale with.
double smallest_half_extent(const Shape& shape);

/// How deep bodies of this shape may be in the contact surface, unless they say otherwise: the
/// smaller of 1 cm and a tenth of the smallest half extent.
double default_contact_tolerance(const Shape& shape);

/// Distance that the shape reaches from its origin in a unit direction of the body frame, metres.
double support_distance(const Shape& shape, const Eigen::Vector3d& direction_body);

}  // namespace terrane
