// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/collision/vehicle.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/height_source.h>

#include <string>
#include <vector>

namespace terrane::tools {

/// Vehicles, in the order of the names of --vehicle.
enum class VehicleKind { truck, tracked, six_wheeler };
std::vector<std::string> vehicle_names();
VehicleSettings make_vehicle(VehicleKind kind);

/// The pose of a vehicle parallel to the slope of the source at a point.
/// @param along_world heading, not zero
Pose slope_pose(const HeightSource& source, const Eigen::Vector2d& place_world,
                const Eigen::Vector2d& along_world, const VehicleSettings& settings);

/// The pose, moved vertically so that chassis and hanging wheels are at least 5 cm above the contact surface. Fails if
/// the ground there is not resident or the pose is out of range.
Result<Pose> pose_on_ground(const VehicleSettings& settings, Pose pose, const Ground& ground);

}  // namespace terrane::tools
