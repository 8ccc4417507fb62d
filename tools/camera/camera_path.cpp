// SPDX-License-Identifier: MIT
#include "camera/camera_path.h"

#include "camera/built_in_plan.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

namespace terrane::tools {
namespace {

// Sets the times of a track for a constant speed. Drops points that coincide with the one before.
Result<void> retime(Track& track, double speed) {
    std::vector<TrackPoint> points{track.points.front()};
    points.front().time = 0.0;
    for (const TrackPoint& point : track.points) {
        const Eigen::Vector3d displacement = point.position_world - points.back().position_world;
        const double length =
            track.has_heights ? displacement.norm() : displacement.head<2>().norm();
        if (!(length > 0.0)) continue;
        points.push_back(point);
        points.back().time = points[points.size() - 2].time + length / speed;
    }
    if (points.size() < 2) {
        return fail(ErrorCode::invalid_argument, "a track whose points all coincide has no length");
    }
    track.points = std::move(points);
    track.has_times = true;
    return {};
}

// Receivers round positions to 1 or 2 m: averages over about 3 s to each side.
void smooth_recorded(Track& track) {
    const double mean_step =
        track.points.back().time / static_cast<double>(track.points.size() - 1);
    std::vector<Eigen::Vector3d> positions;
    for (const TrackPoint& point : track.points) positions.push_back(point.position_world);
    positions = smoothed(positions, static_cast<std::ptrdiff_t>(1.5 / mean_step));
    for (std::size_t i = 0; i < positions.size(); ++i)
        track.points[i].position_world = positions[i];
}

}  // namespace

bool CameraPath::is_built_in(const std::string& name) {
    return std::ranges::find(tools::built_in_names(), name) != tools::built_in_names().end();
}

std::string CameraPath::built_in_list() {
    return fmt::format("{}", fmt::join(tools::built_in_names(), ", "));
}

std::vector<std::string> CameraPath::built_in_names() {
    const std::span<const std::string_view> names = tools::built_in_names();
    return {names.begin(), names.end()};
}

Result<CameraPath> CameraPath::create(const std::string& built_in, const HeightSource& source,
                                      const CameraPathSettings& settings) {
    if (!is_built_in(built_in)) {
        return fail(ErrorCode::invalid_argument,
                    "a path is " + built_in_list() + " or a track file, got " + built_in);
    }
    const double speed =
        settings.speed.value_or(built_in == "spins" ? CameraPathSettings::kDefaultSpinSpeed
                                                    : CameraPathSettings::kDefaultSpeed);
    const double altitude = settings.altitude.value_or(CameraPathSettings::kDefaultAltitude);
    CameraPath path;
    path.duration_ = settings.seconds.value_or(CameraPathSettings::kDefaultSeconds);
    Result<std::vector<LegPlan>> plans = plan_built_in(built_in, source, speed, path.duration_);
    if (!plans) return tl::unexpected(plans.error());
    double time = 0.0;
    for (LegPlan& plan : *plans) {
        if (time > 0.0) path.jumps_.push_back(time);
        time += plan.duration;
        Result<CameraLeg> leg = CameraLeg::create(std::move(plan), source, altitude, speed);
        if (!leg) return tl::unexpected(leg.error());
        path.legs_.push_back(std::move(*leg));
    }
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
    const double length = track.points.back().time;
    const double left = length - settings.start;
    if (!(left > 0.0)) {
        return fail(
            ErrorCode::invalid_argument,
            fmt::format("--start-s must be before the track's end at {:.6g} s, got {:.6g} s",
                        length, settings.start));
    }
    CameraPath path;
    path.duration_ = std::min(left, settings.seconds.value_or(left));
    std::optional<double> altitude = settings.altitude;
    if (!altitude && !track.has_heights) altitude = CameraPathSettings::kDefaultAltitude;
    Result<CameraLeg> leg =
        CameraLeg::create(std::move(track), source, settings.start, path.duration_, altitude);
    if (!leg) return tl::unexpected(leg.error());
    path.legs_.push_back(std::move(*leg));
    return path;
}

CameraPose CameraPath::at(double time) const {
    const auto next = std::upper_bound(jumps_.begin(), jumps_.end(), time);
    const auto leg = static_cast<std::size_t>(next - jumps_.begin());
    return legs_[leg].at(leg == 0 ? time : time - jumps_[leg - 1]);
}

CameraPose CameraPath::before(double time) const {
    const auto next = std::lower_bound(jumps_.begin(), jumps_.end(), time);
    const auto leg = static_cast<std::size_t>(next - jumps_.begin());
    return legs_[leg].at(leg == 0 ? time : time - jumps_[leg - 1]);
}

}  // namespace terrane::tools
