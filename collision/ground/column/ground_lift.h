// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/column.h"
#include "ground/column/local_shape.h"

namespace terrane::internal {

/// Gaps up to this count as touching, for rounding; metres.
inline constexpr double kTouch = 1e-9;

/// A limit that no lift reaches.
inline constexpr double kAnyLift = std::numeric_limits<double>::infinity();

/// The lift of a shape and the triangle that decides it.
struct GroundLift {
    double lift = -std::numeric_limits<double>::infinity();
    Triangle triangle;        ///< that decides it; set where lift is finite
    std::uint32_t part = 0;   ///< of a compound: the one that decides it
    bool is_missing = false;  ///< a cell that the shape's bounds meet is not resident
    double error_m = 0.0;     ///< largest of the cells tested, where LiftError::requested
};

/// Whether find_lift() reads the error of the ground, which most callers do not need.
enum class LiftError { skipped, requested };

/// Lift of a shape moved by `d`: largest of surface minus z over the shape, metres; minus infinity over no ground.
///
/// @param floor  a lift up to it may be returned as minus infinity
/// @param enough the search may stop at any lift above it
GroundLift find_lift(const LocalGround& local, const LocalShape& shape, const Eigen::Vector3d& d,
                     double floor = -kAnyLift, double enough = kAnyLift,
                     LiftError error = LiftError::skipped);

/// The same over all parts of a body.
GroundLift find_lift(const LocalGround& local, const LocalBody& body, const Eigen::Vector3d& d,
                     double floor = -kAnyLift, double enough = kAnyLift,
                     LiftError error = LiftError::skipped);

/// The ground and a shape at its pose, in a local frame near it.
struct LocalQuery {
    LocalQuery(const Shape& shape, const Pose& world_from_shape, const Ground& ground_in)
        : ground(ground_in, world_from_shape.translation),
          body(shape, world_from_shape.rotation, ground.to_local(world_from_shape.translation)) {}

    /// Lift of the body, with the error of the ground: see find_lift().
    GroundLift lift(double floor = -kAnyLift, double enough = kAnyLift) const {
        return find_lift(ground, body, Eigen::Vector3d::Zero(), floor, enough,
                         LiftError::requested);
    }

    LocalGround ground;
    LocalBody body;
};

/// An upper bound of the height of the ground in the cells that an AABB meets, metres: minus infinity where there is no
/// ground, infinity where it is not known or the range is too large to read.
double bound_ground(const LocalGround& local, const Eigen::Vector3d& centre,
                    const Eigen::Vector3d& bounds);

/// Upper bound of the height of the solids that have a triangle near a box, of the chunks of a range of cells; world z,
/// metres; minus infinity where there is none.
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

/// A lower bound of the distance between a shape and a prism, by its AABB and the planes below it, metres.
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
