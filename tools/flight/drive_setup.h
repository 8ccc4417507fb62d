// SPDX-License-Identifier: MIT
#pragma once

#include "flight/flight_options.h"
#include "options/command.h"

#include <terrane/collision/truck.h>

#include <cstddef>
#include <vector>

namespace terrane::tools {

inline constexpr double kLeastDriveSpeed = 0.1;     ///< m/s, the least that PathDriver accepts
inline constexpr double kGreatestDriveSpeed = 1e3;  ///< m/s

/// Path, speed and duration of a drive.
struct DrivePlan {
    std::vector<Eigen::Vector2d> points_world;  ///< two or more, at least 1 m apart
    double speed = 0.0;                         ///< cruise speed, m/s
    std::size_t frame_count = 0;
};

/// The plan for a camera path or track projected to the plane. Fails with exit_usage for too many frames; with
/// exit_failed for paths that jump, are shorter than 2 m, or cannot be read.
CommandResult<DrivePlan> make_drive_plan(const FlightOptions& options, const Terrain& terrain);

/// The pose of a truck parallel to the slope of the source at a point.
/// @param along_world heading, not zero
Pose slope_pose(const HeightSource& source, const Eigen::Vector2d& place_world,
                const Eigen::Vector2d& along_world, const TruckSettings& settings);

/// A truck at rest, moved vertically so that chassis and fully extended wheels are at least 5 cm above the contact
/// surface. Fails where the ground there is not resident or the pose is out of range.
Result<Truck> put_on_ground(const TruckSettings& settings, Pose pose, const Ground& ground);

}  // namespace terrane::tools
