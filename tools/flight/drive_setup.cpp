// SPDX-License-Identifier: MIT
#include "flight/drive_setup.h"

#include "camera/camera_path.h"
#include "track/track.h"

#include <terrane/collision/ground_contact.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kDefaultSpeed = 12.0;  // m/s

Result<CameraPath> open_drive_path(const FlightOptions& options, const Terrain& terrain,
                                   CameraPathSettings& settings) {
    if (!names_track_file(options.path)) {
        if (!settings.speed) settings.speed = kDefaultSpeed;
        return CameraPath::create(options.path, *terrain.source, settings);
    }
    Result<Track> track = read_track(options.path, terrain.dem ? &*terrain.dem : nullptr);
    if (!track) return tl::unexpected(track.error());
    if (!track->has_times && !settings.speed) settings.speed = kDefaultSpeed;
    return CameraPath::create(std::move(*track), *terrain.source, settings);
}

}  // namespace

CommandResult<DrivePlan> make_drive_plan(const FlightOptions& options, const Terrain& terrain) {
    CameraPathSettings settings;
    if (!std::isnan(options.speed)) settings.speed = options.speed;
    if (!std::isnan(options.seconds)) settings.seconds = options.seconds;
    const Result<CameraPath> path = open_drive_path(options, terrain, settings);
    if (!path) return pass_on(path.error());
    if (!path->jumps().empty()) {
        return pass_on({ErrorCode::invalid_argument,
                        fmt::format("a truck cannot jump as the path '{}' does", options.path)});
    }
    const CommandResult<std::size_t> frame_count = count_frames(options.fps, path->duration());
    if (!frame_count) return tl::unexpected(frame_count.error());

    constexpr double kSpacing = 1.0;  // least distance of points, metres
    constexpr double kTimeStep = 0.05;
    DrivePlan plan;
    plan.frame_count = *frame_count;
    double length = 0.0;
    for (double time = 0.0; time <= path->duration(); time += kTimeStep) {
        const Eigen::Vector2d p = path->at(time).eye_world.head<2>();
        const double step = plan.points_world.empty() ? 0.0 : (p - plan.points_world.back()).norm();
        if (!plan.points_world.empty() && step < kSpacing) continue;
        length += step;
        plan.points_world.push_back(p);
    }
    if (plan.points_world.size() < 2) {
        return pass_on(
            {ErrorCode::invalid_argument,
             fmt::format("the path '{}' is shorter than {} m", options.path, 2.0 * kSpacing)});
    }
    const double mean_speed = std::clamp(length / path->duration(), 1.0, kGreatestDriveSpeed);
    plan.speed = settings.speed.value_or(mean_speed);
    return plan;
}

Pose slope_pose(const HeightSource& source, const Eigen::Vector2d& place_world,
                const Eigen::Vector2d& along_world, const TruckSettings& settings) {
    const Eigen::Vector2d along = along_world.normalized();
    const Eigen::Vector2d left(-along.y(), along.x());
    const auto ground = [&](double x, double y) {
        const Eigen::Vector2d p = place_world + x * along + y * left;
        return source.height(p.x(), p.y());
    };
    const double front = 0.5 * settings.wheelbase, side = 0.5 * settings.track;
    const double climb = (ground(front, 0.0) - ground(-front, 0.0)) / settings.wheelbase;
    const double tilt = (ground(0.0, side) - ground(0.0, -side)) / settings.track;
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

Result<Truck> put_on_ground(const TruckSettings& settings, Pose pose, const Ground& ground) {
    constexpr double kClearance = 0.05;  // metres
    const Result<Truck> truck = Truck::create(settings, pose);
    if (!truck) return tl::unexpected(truck.error());
    double lift = -std::numeric_limits<double>::infinity();
    const auto add = [&](const Shape& shape, const Pose& at) {
        const LiftAnswer answer = compute_lift(shape, at, ground);
        lift = std::max(lift, answer.lift);
        return answer.status == QueryStatus::complete;
    };
    bool is_complete = add(Box{settings.chassis_half_extents}, pose);
    for (const WheelState& wheel : truck->wheels()) {
        Pose hanging;
        hanging.translation =
            wheel.centre_world - settings.suspension_travel * pose.rotation.col(2);
        is_complete = add(Sphere{settings.wheel_radius}, hanging) && is_complete;
    }
    if (!is_complete) {
        return fail(
            ErrorCode::invalid_argument,
            fmt::format(
                "the ground at x {:.6g} m, y {:.6g} m, where the truck is put, is not loaded",
                pose.translation.x(), pose.translation.y()));
    }
    if (std::isfinite(lift)) pose.translation.z() += lift + kClearance;
    return Truck::create(settings, pose);
}

}  // namespace terrane::tools
