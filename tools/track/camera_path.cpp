// SPDX-License-Identifier: MIT
#include "track/camera_path.h"

#include "track/canyon_route.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kStep = 0.25;           // between control points, seconds
constexpr double kPad = 8.0;             // how far curves go on before and behind the path, seconds
constexpr double kGravity = 9.81;        // metres a second squared
constexpr double kDrop = 0.2;            // how steeply a camera looks down: a slope
constexpr double kClimb = 0.7;           // how much of a climb it follows with its look
constexpr double kTrackClearance = 2.0;  // metres that a recorded track keeps from the ground

std::size_t control_count(double duration) {
    return static_cast<std::size_t>((duration + 2.0 * kPad) / kStep) + 2;
}

double control_time(std::size_t i) { return static_cast<double>(i) * kStep - kPad; }

Eigen::Vector2d middle(const WorldRect& extent) {
    return {0.5 * (extent.west + extent.east), 0.5 * (extent.south + extent.north)};
}

std::vector<Eigen::Vector3d> make_straight(const WorldRect& extent, double speed, double duration) {
    const double width = extent.east - extent.west;
    const double height = extent.north - extent.south;
    const Eigen::Vector2d direction =
        width >= height ? Eigen::Vector2d(1.0, 0.0) : Eigen::Vector2d(0.0, 1.0);
    const double used = std::min(speed * duration, 0.96 * std::max(width, height));
    const Eigen::Vector2d start = middle(extent) - 0.5 * used * direction;
    std::vector<Eigen::Vector3d> control(control_count(duration));
    for (std::size_t i = 0; i < control.size(); ++i) {
        const Eigen::Vector2d p = start + speed * control_time(i) * direction;
        control[i] = {p.x(), p.y(), 0.0};
    }
    return control;
}

// Turns a vector step by step, so that no sine of a C library decides about bits.
std::vector<Eigen::Vector3d> make_orbit(const WorldRect& extent, double speed, double duration) {
    constexpr double kTurn = 6.283185307179586;
    constexpr double kLeast = 10.0;  // metres of radius
    const double room = 0.3 * std::min(extent.east - extent.west, extent.north - extent.south);
    const double radius = std::max(kLeast, std::min(speed * duration / kTurn, room));
    const double half = 0.5 * speed * kStep / radius;
    const double q = half * (1.0 + half * half / 3.0);  // the tangent of half a step's angle
    const double cosine = (1.0 - q * q) / (1.0 + q * q);
    const double sine = 2.0 * q / (1.0 + q * q);
    const Eigen::Vector2d centre = middle(extent);
    Eigen::Vector2d arm(0.0, -radius);
    std::vector<Eigen::Vector3d> control(control_count(duration));
    for (Eigen::Vector3d& point : control) {
        point = {centre.x() + arm.x(), centre.y() + arm.y(), 0.0};
        arm = {cosine * arm.x() - sine * arm.y(), sine * arm.x() + cosine * arm.y()};
    }
    return control;
}

Result<std::vector<Eigen::Vector3d>> make_canyon(const HeightSource& source, double speed,
                                                 double duration) {
    constexpr double kTurnTime = 8.0;  // seconds; a fast camera cannot follow every bend
    const std::size_t count = control_count(duration);
    const double length = speed * kStep * static_cast<double>(count);
    const Result<std::vector<Eigen::Vector2d>> route =
        find_canyon_route(source, length, kTurnTime * speed);
    if (!route) return tl::unexpected(route.error());
    std::vector<Eigen::Vector3d> control;
    for (const Eigen::Vector2d& p : resampled(*route, speed * kStep)) {
        control.emplace_back(p.x(), p.y(), 0.0);
    }
    return control;
}

// Gives a track times by its length: the same speed everywhere. Points on one place are dropped.
Result<void> retime(Track& track, double speed) {
    std::vector<TrackPoint> points{track.points.front()};
    points.front().time = 0.0;
    for (const TrackPoint& point : track.points) {
        const Eigen::Vector3d way = point.position_world - points.back().position_world;
        const double length = track.has_heights ? way.norm() : way.head<2>().norm();
        if (!(length > 0.0)) continue;
        points.push_back(point);
        points.back().time = points[points.size() - 2].time + length / speed;
    }
    if (points.size() < 2) {
        return fail(ErrorCode::invalid_argument,
                    "a track whose points are all one place has no way");
    }
    track.points = std::move(points);
    track.has_times = true;
    return {};
}

// Receivers round to a metre or two: the mean over about three seconds on both sides.
void smooth_recorded(Track& track) {
    const double mean_step =
        track.points.back().time / static_cast<double>(track.points.size() - 1);
    std::vector<Eigen::Vector3d> positions;
    for (const TrackPoint& point : track.points) positions.push_back(point.position_world);
    positions = smoothed(positions, static_cast<std::ptrdiff_t>(1.5 / mean_step));
    for (std::size_t i = 0; i < positions.size(); ++i)
        track.points[i].position_world = positions[i];
}

Eigen::Vector3d cross(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return {a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(),
            a.x() * b.y() - a.y() * b.x()};
}

// The part of a hint that is square to a direction, unit; north where they are parallel.
Eigen::Vector3d square_to(const Eigen::Vector3d& direction, const Eigen::Vector3d& hint) {
    Eigen::Vector3d right = cross(direction, hint);
    if (right.norm() < 1e-9) right = cross(direction, Eigen::Vector3d::UnitY());
    return cross(right, direction).normalized();
}

}  // namespace

bool CameraPath::is_built_in(const std::string& name) {
    return name == "straight" || name == "orbit" || name == "canyon";
}

Result<CameraPath> CameraPath::create(const std::string& built_in, const HeightSource& source,
                                      const CameraPathSettings& settings) {
    if (!is_built_in(built_in)) {
        return fail(ErrorCode::invalid_argument,
                    "a path is straight, orbit, canyon or a track file, got " + built_in);
    }
    const double speed = settings.speed.value_or(CameraPathSettings::kDefaultSpeed);
    const double altitude = settings.altitude.value_or(CameraPathSettings::kDefaultAltitude);
    CameraPath path;
    path.duration_ = settings.seconds.value_or(CameraPathSettings::kDefaultSeconds);
    std::vector<Eigen::Vector3d> control;
    if (built_in == "canyon") {
        Result<std::vector<Eigen::Vector3d>> made = make_canyon(source, speed, path.duration_);
        if (!made) return tl::unexpected(made.error());
        control = std::move(*made);
    } else if (built_in == "orbit") {
        control = make_orbit(source.extent(), speed, path.duration_);
        const Eigen::Vector2d centre = middle(source.extent());
        path.target_world_ =
            WorldPos(centre.x(), centre.y(), source.height(centre.x(), centre.y()));
    } else {
        control = make_straight(source.extent(), speed, path.duration_);
    }
    path.plan_ = SmoothCurve(-kPad, kStep, std::move(control));
    if (const Result<void> fit = path.fit_heights(source, altitude, 0.5 * altitude, speed); !fit) {
        return tl::unexpected(fit.error());
    }
    path.fit_look(std::clamp(3.0 * altitude / speed, 2.0, 6.0), built_in == "canyon");
    return path;
}

Result<CameraPath> CameraPath::create(Track track, const HeightSource& source,
                                      const CameraPathSettings& settings) {
    if (!track.has_times || settings.speed) {
        const double speed = settings.speed.value_or(CameraPathSettings::kDefaultSpeed);
        if (const Result<void> timed = retime(track, speed); !timed) {
            return tl::unexpected(timed.error());
        }
    }
    if (track.is_recorded) smooth_recorded(track);
    CameraPath path;
    path.track_plan_ = TrackCurve(track);
    path.start_ = settings.start;
    const double left = path.track_plan_.duration() - settings.start;
    if (!(left > 0.0)) {
        return fail(ErrorCode::invalid_argument,
                    fmt::format("the start must be before the track's end at {} s, got {} s",
                                path.track_plan_.duration(), settings.start));
    }
    path.duration_ = std::min(left, settings.seconds.value_or(left));

    double length = 0.0;
    for (std::size_t i = 1; i < track.points.size(); ++i) {
        length +=
            (track.points[i].position_world - track.points[i - 1].position_world).head<2>().norm();
    }
    const double speed = std::max(1.0, length / path.track_plan_.duration());
    path.has_own_heights_ = track.has_heights && !settings.altitude;
    const double altitude = settings.altitude.value_or(CameraPathSettings::kDefaultAltitude);
    if (!path.has_own_heights_ || track.is_recorded) {
        const double clearance = path.has_own_heights_ ? kTrackClearance : 0.5 * altitude;
        if (const Result<void> fit = path.fit_heights(source, altitude, clearance, speed); !fit) {
            return tl::unexpected(fit.error());
        }
    }
    path.fit_look(3.0, false);
    if (track.has_orientations) path.orientations_ = std::move(track.points);
    return path;
}

CurvePoint CameraPath::eye(double time) const {
    CurvePoint point = plan_.is_empty() ? track_plan_.at(start_ + time) : plan_.at(time);
    if (heights_.is_empty()) return point;
    const CurvePoint height = heights_.at(time);
    point.value.z() = height.value.z() + (has_own_heights_ ? point.value.z() : 0.0);
    point.rate.z() = height.rate.z() + (has_own_heights_ ? point.rate.z() : 0.0);
    return point;
}

// The ground under the path, smoothed, plus the altitude (or the track's own height), plus what
// keeps the clearance everywhere: the largest lack within the reach of the smoothing, smoothed. Each
// mean of it is over values that are at least the lack itself, so the clearance holds at every
// sample.
Result<void> CameraPath::fit_heights(const HeightSource& source, double altitude, double clearance,
                                     double speed) {
    constexpr double kMostSamples = 400'000.0;
    const std::size_t count = control_count(duration_);
    const double finest = std::max(1.0, source.lattice().spacing);
    const double most = std::max(4.0, kMostSamples / static_cast<double>(count));
    const auto per_step =
        static_cast<std::size_t>(std::clamp(std::ceil(kStep * speed / finest), 4.0, most));
    const double sample_step = kStep / static_cast<double>(per_step);

    std::vector<double> ground((count - 1) * per_step + 1);
    const auto sample_time = [&](std::size_t i) {
        return static_cast<double>(i) * sample_step - kPad;
    };
    for (std::size_t i = 0; i < ground.size(); ++i) {
        const Eigen::Vector3d p = eye(sample_time(i)).value;
        ground[i] = source.height(p.x(), p.y());
        if (!std::isfinite(ground[i])) {
            return fail(ErrorCode::io,
                        fmt::format("the terrain cannot be read at {}, {}", p.x(), p.y()));
        }
    }
    // slower and higher cameras follow less
    const double width = std::clamp(1.5 + 0.5 * altitude / speed, 1.5, 6.0);
    const auto half_width = static_cast<std::ptrdiff_t>(width / sample_step);
    std::vector<Eigen::Vector3d> control(count, Eigen::Vector3d::Zero());
    if (!has_own_heights_) {
        const std::vector<double> mean = smoothed(ground, half_width);
        for (std::size_t i = 0; i < count; ++i) control[i].z() = mean[i * per_step] + altitude;
    }
    const SmoothCurve base(-kPad, kStep, control);
    std::vector<double> lack(ground.size());
    for (std::size_t i = 0; i < ground.size(); ++i) {
        const double height = base.at(sample_time(i)).value.z() +
                              (has_own_heights_ ? eye(sample_time(i)).value.z() : 0.0);
        lack[i] = std::max(0.0, ground[i] + clearance - height);
    }
    const auto spline_reach = static_cast<std::ptrdiff_t>(2 * per_step);
    const std::vector<double> lift =
        smoothed(running_max(lack, 3 * half_width + spline_reach), half_width);
    for (std::size_t i = 0; i < count; ++i) control[i].z() += lift[i * per_step];
    heights_ = SmoothCurve(-kPad, kStep, std::move(control));
    return {};
}

// Looks along the way from a little behind to a time ahead, smoothed; a camera that stands keeps its
// look.
void CameraPath::fit_look(double ahead, bool has_lean) {
    constexpr double kLeastWay = 1.0;  // metres: less has no direction
    constexpr std::ptrdiff_t kHalfWidth = 3;
    const std::size_t count = control_count(duration_);
    std::vector<Eigen::Vector3d> look(count, Eigen::Vector3d::Zero());
    std::vector<Eigen::Vector3d> lean(count, Eigen::Vector3d::UnitZ());
    std::optional<Eigen::Vector3d> last;
    for (std::size_t i = 0; i < count; ++i) {
        const double time = control_time(i);
        Eigen::Vector3d way = eye(time + ahead).value - eye(time - 0.25 * ahead).value;
        const double length = way.head<2>().norm();
        if (length > kLeastWay) {
            way.z() = kClimb * way.z() - kDrop * length;
            if (!last) std::fill_n(look.begin(), i, way.normalized());
            last = way.normalized();
        }
        look[i] = last.value_or(Eigen::Vector3d(0.0, 1.0, -kDrop).normalized());
        if (!has_lean) continue;
        const Eigen::Vector3d push =
            (eye(time + kStep).rate - eye(time - kStep).rate) / (2.0 * kStep * kGravity);
        const Eigen::Vector3d right = Eigen::Vector3d(look[i].y(), -look[i].x(), 0.0).normalized();
        const double side = right.dot(push);
        lean[i] += right * (0.3 * side / (1.0 + std::abs(side)));
    }
    forward_ = SmoothCurve(-kPad, kStep, smoothed(look, kHalfWidth));
    up_ = SmoothCurve(-kPad, kStep, smoothed(lean, kHalfWidth));
}

CameraPose CameraPath::at(double time) const {
    CameraPose pose;
    const CurvePoint place = eye(time);
    pose.eye_world = place.value;
    pose.velocity = place.rate;
    Eigen::Vector3d up = up_.at(time).value;
    Eigen::Vector3d forward = forward_.at(time).value;
    if (target_world_) forward = *target_world_ - pose.eye_world;
    if (!orientations_.empty()) {
        const double at = std::clamp(start_ + time, 0.0, orientations_.back().time);
        const auto next = std::upper_bound(
            orientations_.begin() + 1, orientations_.end() - 1, at,
            [](double value, const TrackPoint& point) { return value < point.time; });
        const TrackPoint& before = *(next - 1);
        const double t = (at - before.time) / (next->time - before.time);
        forward = (1.0 - t) * before.forward + t * next->forward;
        up = (1.0 - t) * before.up + t * next->up;
    }
    if (forward.norm() > 1e-9) pose.forward = forward.normalized();
    pose.up = square_to(pose.forward, up);
    return pose;
}

}  // namespace terrane::tools
