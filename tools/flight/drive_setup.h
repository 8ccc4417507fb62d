// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"
#include "flight/flight_options.h"

#include <terrane/collision/truck.h>

#include <cstddef>
#include <vector>

namespace terrane::tools {

inline constexpr double kLeastDriveSpeed = 0.1;     ///< metres a second, as PathDriver takes
inline constexpr double kGreatestDriveSpeed = 1e3;  ///< metres a second

/// Where a truck is to drive, and for how long.
struct DrivePlan {
    std::vector<Eigen::Vector2d> points_world;  ///< at least 1 m apart, two or more
    double speed = 0.0;                         ///< to keep where the path is straight enough, m/s
    std::size_t frame_count = 0;
};

/// The plan of a camera path or of a track, seen from above. Fails with exit_usage for too many frames; for paths
/// that jump, are shorter than 2 m, or cannot be read.
CommandResult<DrivePlan> make_drive_plan(const FlightOptions& options, const Terrain& terrain);

/// A pose at a place on the ground, level along the slope of the source there.
/// @param along_world direction to head in, not zero
Pose slope_pose(const HeightSource& source, const Eigen::Vector2d& place_world,
                const Eigen::Vector2d& along_world, const TruckSettings& settings);

/// A truck at rest, moved up or down so that the lowest of its chassis and hanging wheels is 5 cm clear of the
/// contact surface. Fails where the ground there is not resident or the pose is out of range.
Result<Truck> put_on_ground(const TruckSettings& settings, Pose pose, const Ground& ground);

}  // namespace terrane::tools
