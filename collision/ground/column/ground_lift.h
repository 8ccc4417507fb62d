// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/column.h"
#include "ground/column/local_shape.h"

namespace terrane::internal {

/// Largest gap that counts as touching because of rounding, metres.
inline constexpr double kTouch = 1e-9;

/// A limit that no lift exceeds.
inline constexpr double kAnyLift = std::numeric_limits<double>::infinity();

/// The lift of a shape and the triangle that attains it.
struct GroundLift {
    double lift = -std::numeric_limits<double>::infinity();
    Triangle triangle;        ///< the triangle that attains the lift; set if the lift is finite
    std::uint32_t part = 0;   ///< the part of a compound that attains the lift
    bool is_missing = false;  ///< a cell under the shape's bounds is not resident
    double error_m = 0.0;     ///< largest error of the cells tested, if LiftError::requested
};

/// Whether find_lift() computes error_m, which most callers do not need.
enum class LiftError { skipped, requested };

/// Lift of a shape translated by `d`: the maximum of surface height minus z over the shape, metres; minus infinity if
/// there is no ground over or under the shape.
///
/// @param floor  a lift of at most this may be returned as minus infinity
/// @param enough the search may stop at any lift above this
GroundLift find_lift(const LocalGround& local, const LocalShape& shape, const Eigen::Vector3d& d,
                     double floor = -kAnyLift, double enough = kAnyLift,
                     LiftError error = LiftError::skipped);

/// Largest lift over all parts of a body.
GroundLift find_lift(const LocalGround& local, const LocalBody& body, const Eigen::Vector3d& d,
                     double floor = -kAnyLift, double enough = kAnyLift,
                     LiftError error = LiftError::skipped);

/// The ground and a shape at its pose, in a local frame near it.
struct LocalQuery {
    LocalQuery(const Shape& shape, const Pose& world_from_shape, const Ground& ground_in)
        : ground(ground_in, world_from_shape.translation),
          body(shape, world_from_shape.rotation, ground.to_local(world_from_shape.translation)) {}

    /// Lift of the body, including error_m: see find_lift().
    GroundLift lift(double floor = -kAnyLift, double enough = kAnyLift) const {
        return find_lift(ground, body, Eigen::Vector3d::Zero(), floor, enough,
                         LiftError::requested);
    }

    LocalGround ground;
    LocalBody body;
};

/// Upper bound of the height of the ground in the cells under an AABB, metres: minus infinity if there is no ground,
/// infinity if the height is unknown or the range of cells is too large to read.
double bound_ground(const LocalGround& local, const Eigen::Vector3d& centre,
                    const Eigen::Vector3d& bounds);

/// Upper bound of the world z of the volumes that have a triangle near a box, among the volumes in the chunks that a
/// range of cells overlaps, metres; minus infinity if there are none.
double highest_solid(const Ground& ground, const CellRange& cells, const Aabb& box_world);

/// The distance between an AABB and a prism, metres.
inline double bound_distance(const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds,
                             const CellPrism& prism) {
    const double x =
        std::max({0.0, centre[0] - bounds[0] - prism.east, prism.west - centre[0] - bounds[0]});
    const double y =
        std::max({0.0, centre[1] - bounds[1] - prism.north, prism.south - centre[1] - bounds[1]});
    const double z = std::max(0.0, centre[2] - bounds[2] - prism.high);
    return std::sqrt(x * x + y * y + z * z);
}

/// Lower bound of the distance between a shape and a prism, from the AABB and the lower planes of the shape, metres.
inline double bound_distance(const LocalShape& shape, const CellPrism& prism) {
    double bound = bound_distance(shape.centre, shape.bounds, prism);
    visit_down_planes(shape, [&](const Eigen::Vector3d& n, double drop) {
        const double top =
            std::max(n[0] * (prism.west - shape.centre[0]), n[0] * (prism.east - shape.centre[0])) +
            std::max(n[1] * (prism.south - shape.centre[1]),
                     n[1] * (prism.north - shape.centre[1])) +
            n[2] * (prism.high - shape.centre[2]);
        bound = std::max(bound, -top - drop);
    });
    return bound;
}

}  // namespace terrane::internal
