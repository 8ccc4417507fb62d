// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/terrain/height_source.h>

#include <Eigen/Core>

#include <limits>
#include <optional>
#include <vector>

namespace terrane::internal {

/// Polylines in plan along low ground: through the valleys of the roughest part of a region of a terrain. The first is
/// the lowest. The others, for paths that have more to avoid than ridges, are overlapping sections of two valleys, each
/// in both directions.
///
/// The polylines are smoothed: a turn takes about `turn_length` metres. If the region is shorter than `length`, both
/// ends of a polyline are extended straight.
///
/// @param length metres, > 0
/// @return equidistant points, at least turn_length / 100 apart
///
/// Fails: io if the source cannot be read
/// Cost:  about 50,000 calls of HeightSource::height()
Result<std::vector<std::vector<Eigen::Vector2d>>> find_canyon_routes(const HeightSource& source,
                                                                     const WorldRect& region,
                                                                     double length,
                                                                     double turn_length);

/// A line in straight continuation of both ends of `line` by `length` metres.
std::vector<Eigen::Vector2d> extended(const std::vector<Eigen::Vector2d>& line, double length);

/// A rigid motion in the plane.
struct LinePlacement {
    Eigen::Vector2d from = Eigen::Vector2d::Zero();  ///< a point, metres
    Eigen::Vector2d to = Eigen::Vector2d::Zero();  ///< the place to which that point moves, metres
    Eigen::Vector2d turn = Eigen::Vector2d::UnitX();  ///< cosine and sine of the rotation

    Eigen::Vector2d moved(const Eigen::Vector2d& p) const {
        const Eigen::Vector2d arm = p - from;
        return {to.x() + (turn.x() * arm.x() - turn.y() * arm.y()),
                to.y() + (turn.y() * arm.x() + turn.x() * arm.y())};
    }
};

/// What can be driven over: see CameraPathSettings.
struct GroundLimits {
    double max_slope = 1.0;
    double max_bump = std::numeric_limits<double>::infinity();
    double bump_reach = 1.5;
};

/// Where a line may be laid.
struct RouteFreedom {
    GroundLimits limits;                              ///< of ground that can be climbed
    Eigen::Vector2d pivot = Eigen::Vector2d::Zero();  ///< the line turns about this point
    double reach = 0.0;                               ///< farthest move of the pivot, metres, >= 0
    bool is_fixed = false;                            ///< whether the line is not moved as a whole
};

/// A line over ground that can be climbed.
struct GroundRoute {
    std::vector<Eigen::Vector2d> line;  ///< smooth, half a step between points
    LinePlacement placement;            ///< the motion of the line as a whole
};

/// Lays a line over ground that can be climbed. Nothing if the first line is over such ground. Otherwise the lines are
/// moved as a whole to some places and headings near their own, unless the freedom forbids it. The best 30 then follow
/// the cheapest route in a strip of 26 steps to both sides, whose steps are 1 to 3 m long, or longer for a line of more
/// than 12 km; steep ground, bumps and turns have a cost. The cheapest of these routes is refined to steps of 1 m. If
/// there is no ground that can be climbed, the route is as little too steep as possible.
///
/// @param lines equidistant points, 2 or more, in each line; the first line is the wanted one
///
/// Fails: io if the source cannot be read
/// Cost:  up to 6,000,000 calls of HeightSource::height() for a line of 1 km; 9 calls a step if the line is not changed
Result<std::optional<GroundRoute>> lay_over_climbable_ground(
    const std::vector<std::vector<Eigen::Vector2d>>& lines, const HeightSource& source,
    const RouteFreedom& freedom);

}  // namespace terrane::internal
