// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.h"

#include <terrane/scene/culling.h>
#include <terrane/terrain/view.h>

#include <functional>

namespace terrane::test {

/// A view from near a place, with any direction, roll, field of view from 1 to 170 degrees and shape of picture.
View random_view(Random& random, const WorldPos& near_world);

/// A unit vector square to a unit vector, spread evenly.
Eigen::Vector3d any_perpendicular(const Eigen::Vector3d& direction, Random& random);

/// A box with any rotation and extents from 0 to about `size`.
OrientedBox random_box(Random& random, const WorldPos& centre_world, double size);

/// A closed convex set, by the nearest point of it to a point.
using Projection = std::function<Eigen::Vector3d(const Eigen::Vector3d& p)>;

Projection project_to_box(const OrientedBox& box);
Projection project_to_ball(const BoundingSphere& ball);
Projection project_to_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                               const Eigen::Vector3d& c);
/// The points of a view, by its make_frustum() and a far distance: Dykstra's algorithm over its half-spaces
/// (J. Boyle, R. Dykstra, 1986).
Projection project_to_view(const View& view, double far_distance);

/// How far apart two sets are.
enum class Apart { no, yes, unknown };

/// Alternating projections (W. Cheney, A. Goldstein, 1959). `no`: points of both within 1e-9 were found. `yes`: the
/// distance is above 1e-5 and has converged, so that it does not go to 0. `unknown`: neither.
Apart are_apart(const Projection& a, const Projection& b, const Eigen::Vector3d& start);

}  // namespace terrane::test
