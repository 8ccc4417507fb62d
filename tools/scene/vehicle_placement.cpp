// SPDX-License-Identifier: MIT
#include "scene/vehicle_placement.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/world.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::tools {

std::vector<std::string> vehicle_names() { return {"truck", "tracked", "six-wheeler"}; }

VehicleSettings make_vehicle(VehicleKind kind) {
    switch (kind) {
        case VehicleKind::tracked:
            return make_tracked();
        case VehicleKind::six_wheeler:
            return make_six_wheeler();
        case VehicleKind::truck:
            break;
    }
    return make_truck();
}

Pose slope_pose(const HeightSource& source, const Eigen::Vector2d& place_world,
                const Eigen::Vector2d& along_world, const VehicleSettings& settings) {
    const Eigen::Vector2d along = along_world.normalized();
    const Eigen::Vector2d left(-along.y(), along.x());
    const auto ground = [&](double x, double y) {
        const Eigen::Vector2d p = place_world + x * along + y * left;
        return source.height(p.x(), p.y());
    };
    const double front = settings.chassis_half_extents.x(),
                 side = settings.chassis_half_extents.y();
    const double climb = (ground(front, 0.0) - ground(-front, 0.0)) / (2.0 * front);
    const double tilt = (ground(0.0, side) - ground(0.0, -side)) / (2.0 * side);
    const Eigen::Vector3d forward = Eigen::Vector3d(along.x(), along.y(), climb).normalized();
    const Eigen::Vector3d left_raw(left.x(), left.y(), tilt);
    const Eigen::Vector3d left_world = (left_raw - left_raw.dot(forward) * forward).normalized();
    Pose pose;
    pose.rotation.col(0) = forward;
    pose.rotation.col(1) = left_world;
    pose.rotation.col(2) =
        Eigen::Vector3d(forward.y() * left_world.z() - forward.z() * left_world.y(),
                        forward.z() * left_world.x() - forward.x() * left_world.z(),
                        forward.x() * left_world.y() - forward.y() * left_world.x());
    pose.translation = WorldPos(place_world.x(), place_world.y(),
                                ground(0.0, 0.0) + settings.centre_of_mass_height);
    return pose;
}

Result<Pose> pose_on_ground(const VehicleSettings& settings, Pose pose, const Ground& ground) {
    constexpr double kStartHeight = 0.05;  // metres
    // a separate world computes the positions of the hanging wheels
    TERRANE_TRY(World world, World::create({}));
    TERRANE_TRY(const BodyId vehicle, world.add_vehicle(settings, pose));
    double lift = -std::numeric_limits<double>::infinity();
    bool is_complete = true;
    const auto add = [&](const Shape& shape, const Pose& at) {
        const LiftAnswer answer = compute_lift(shape, at, ground);
        lift = std::max(lift, answer.lift);
        is_complete = is_complete && answer.status == QueryStatus::ok;
    };
    add(world.settings(vehicle).shape, pose);
    for (const WheelState& wheel : world.vehicle(vehicle)->wheels) {
        Pose at;
        at.translation = wheel.centre_world;
        add(Sphere{settings.wheel_radius}, at);
    }
    if (!is_complete) {
        return fail(
            ErrorCode::invalid_argument,
            fmt::format(
                "the ground at x {:.6g} m, y {:.6g} m, where the vehicle is put, is not loaded",
                pose.translation.x(), pose.translation.y()));
    }
    if (std::isfinite(lift)) pose.translation.z() += lift + kStartHeight;
    return pose;
}

}  // namespace terrane::tools
