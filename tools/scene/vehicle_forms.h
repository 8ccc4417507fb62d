// SPDX-License-Identifier: MIT
#pragma once

#include "scene/mesh_files.h"

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/collision/vehicle.h>

#include <cstddef>
#include <optional>
#include <vector>

namespace terrane::tools {

/// Meshes of a vehicle, made from its physical settings: the drawn form is where the vehicle collides.
struct VehicleForm {
    /// Chassis and bodywork, in the chassis's frame: x forward, z up. It exceeds the shapes that collide only by lamps,
    /// bumpers, mirrors and lips: by some centimetres at the size of a truck.
    MeshModel body;
    /// A wheel at the origin, of wheel_radius, with tracks smaller by the belt; its axle is y and its outer side is
    /// towards +y. See wheel_pose().
    MeshModel wheel;
    /// One link of a track: x along the track, z outwards, origin in the middle of the belt. None without tracks.
    std::optional<MeshModel> link;
    /// A sprocket of a track at the origin, axle y, outer side towards +y. None without tracks.
    std::optional<MeshModel> sprocket;
    /// Mouth of the exhaust pipe, in the chassis's frame.
    Eigen::Vector3d exhaust = Eigen::Vector3d::Zero();
    /// Direction in which the exhaust leaves, in the chassis's frame, unit length.
    Eigen::Vector3d exhaust_direction = -Eigen::Vector3d::UnitX();
};

/// The form of a vehicle. With a hood before its cab it is a pickup with a bed behind, without one a truck with its cab
/// over the engine and a deck; a tracked vehicle is a hull with sponsons over the tracks. The foremost box of the
/// bodywork is the cab; other parts of the bodywork are drawn as what they are: boxes with ribs, tanks, hulls.
///
/// Fails: invalid_argument as World::add_vehicle()
/// Cost:  some milliseconds
Result<VehicleForm> make_vehicle_form(const VehicleSettings& settings);

/// World pose of VehicleForm::wheel for a wheel: steered and spun, and for right wheels turned by pi about z.
Pose wheel_pose(const VehicleSettings& settings, const VehicleState& state, std::size_t wheel);

/// World poses of the links of both tracks, equally spaced on the belts around wheels and sprockets; the wheels' spin
/// moves them. Their number depends only on the settings. Empty without tracks, or if no axle has two wheels.
///
/// Cost: some microseconds a hundred links
std::vector<Pose> track_link_poses(const VehicleSettings& settings, const VehicleState& state);

/// World poses of the sprockets: those at the front before those at the rear, left before right. Empty as
/// track_link_poses().
std::vector<Pose> sprocket_poses(const VehicleSettings& settings, const VehicleState& state);

}  // namespace terrane::tools
