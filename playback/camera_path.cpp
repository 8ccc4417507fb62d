// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "camera_legs.h"

#include <terrane/playback/camera_path.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace terrane {
namespace {

// The time of each point at a constant speed. Drops points that are not later than their predecessor.
std::vector<double> times_at(double speed, Track& track) {
    std::vector<double> times{0.0};
    std::vector<TrackPoint> points{track.points.front()};
    for (const TrackPoint& point : track.points) {
        const Eigen::Vector3d displacement = point.position_world - points.back().position_world;
        const double length =
            track.has_heights ? displacement.norm() : displacement.head<2>().norm();
        const double time = times.back() + length / speed;
        if (!(time > times.back())) continue;
        times.push_back(time);
        points.push_back(point);
    }
    track.points = std::move(points);
    return times;
}

// Sets the times of a track for a constant speed.
Result<void> retime(Track& track, double speed) {
    const std::vector<double> times = times_at(speed, track);
    if (times.size() < 2) {
        return fail(ErrorCode::invalid_argument, "a track whose points all coincide has no length");
    }
    for (std::size_t i = 0; i < times.size(); ++i) track.points[i].time = times[i];
    track.has_times = true;
    return {};
}

// The point of a track at a time between two of its points; t is 0 at the first, 1 at the second.
TrackPoint point_between(const TrackPoint& from, const TrackPoint& to, double t, double time) {
    const double s = 1.0 - t;
    TrackPoint point;
    point.time = time;
    point.position_world = s * from.position_world + t * to.position_world;
    point.forward = s * from.forward + t * to.forward;
    point.up = s * from.up + t * to.up;
    return point;
}

// Smooths the positions of a recorded track, because receivers round them and err by metres: takes their means over
// kSmoothTime on both sides, or over kSmoothLength if the track has no times, kSmoothings times. Before, intervals that
// are longer than this get further points, at most that far apart near their ends. They go one step beyond the reach of
// the means, so that corners are rounded within this distance and the middle of a long interval keeps its line.
//
// With the half width w and the fastest motion v around, the means move a point by at most w / 2 v each time, and a
// curve through points up to w apart is off by at most 0.53 w v: together by 1.53 w v, which is 2.3 s of motion, or
// 7.7 m. It depends on the means of the two points around a time, which reach twice over w and one further interval:
// v is the fastest motion in the 4 w = 6 s before and after.
void smooth_recorded(Track& track) {
    constexpr double kSmoothTime = 1.5;    // seconds
    constexpr double kSmoothLength = 5.0;  // metres
    constexpr int kSmoothings = 2;
    std::vector<double> at;
    if (track.has_times) {
        for (const TrackPoint& point : track.points) at.push_back(point.time);
    } else {
        at = times_at(1.0, track);
    }
    if (at.size() < 2) return;
    const double half_width = track.has_times ? kSmoothTime : kSmoothLength;
    std::vector<TrackPoint> points{track.points.front()};
    std::vector<double> point_at{at.front()};
    for (std::size_t i = 1; i < at.size(); ++i) {
        const double span = at[i] - at[i - 1];
        const auto add = [&](double from_start) {
            const double u = at[i - 1] + from_start;
            if (!(u > point_at.back() && u < at[i])) return;
            points.push_back(
                point_between(track.points[i - 1], track.points[i], from_start / span, u));
            point_at.push_back(u);
        };
        constexpr int kNearEnd = kSmoothings + 1;
        if (span > 2.0 * kNearEnd * half_width) {
            for (int j = 1; j <= kNearEnd; ++j) add(j * half_width);
            for (int j = kNearEnd; j >= 1; --j) add(span - j * half_width);
        } else {
            const int pieces = static_cast<int>(std::ceil(span / half_width));
            for (int j = 1; j < pieces; ++j) add(span * j / pieces);
        }
        points.push_back(track.points[i]);
        point_at.push_back(at[i]);
    }
    std::vector<Eigen::Vector3d> positions;
    for (const TrackPoint& point : points) positions.push_back(point.position_world);
    for (int i = 0; i < kSmoothings; ++i) {
        positions = internal::windowed_means(point_at, positions, half_width);
    }
    for (std::size_t i = 0; i < points.size(); ++i) points[i].position_world = positions[i];
    track.points = std::move(points);
}

Result<void> check_positive(const char* name, const std::optional<double>& value) {
    if (!value || (*value > 0.0 && std::isfinite(*value))) return {};
    return fail(ErrorCode::invalid_argument,
                std::string(name) + " must be above 0 and finite, got " + number_text(*value));
}

Result<void> check_place(const CameraPathSettings& settings) {
    if (settings.region) {
        const WorldRect& r = *settings.region;
        const bool has_area = r.west < r.east && r.south < r.north;
        if (!has_area || !std::isfinite(r.east - r.west) || !std::isfinite(r.north - r.south)) {
            return fail(ErrorCode::invalid_argument,
                        "region must have finite sides above 0, got " + number_text(r.west) +
                            " to " + number_text(r.east) + " and " + number_text(r.south) + " to " +
                            number_text(r.north));
        }
    }
    if (settings.start_world && !settings.start_world->allFinite()) {
        return fail(ErrorCode::invalid_argument, "start_world must be finite, got " +
                                                     number_text(settings.start_world->x()) + ", " +
                                                     number_text(settings.start_world->y()));
    }
    return {};
}

Result<void> check_settings(const CameraPathSettings& settings) {
    TERRANE_TRY(check_positive("speed", settings.speed));
    TERRANE_TRY(check_positive("altitude", settings.altitude));
    TERRANE_TRY(check_range("start", settings.start, 0.0, std::numeric_limits<double>::max()));
    TERRANE_TRY(check_positive("seconds", settings.seconds));
    TERRANE_TRY(check_positive("max_slope", settings.max_slope));
    TERRANE_TRY(check_positive("bump_reach", settings.bump_reach));
    if (!(settings.max_bump > 0.0)) {
        return fail(ErrorCode::invalid_argument,
                    "max_bump must be above 0, got " + number_text(settings.max_bump));
    }
    TERRANE_TRY(check_place(settings));
    return settings.seconds
               ? check_range("seconds", *settings.seconds, 0.0, CameraPathSettings::kMostSeconds)
               : Result<void>{};
}

}  // namespace

/// The legs between jumps.
struct CameraPath::Legs {
    double duration = 0.0;
    std::vector<internal::CameraLeg> legs;  // jumps.size() + 1
    std::vector<double> jumps;

    CameraPose at(std::size_t leg, double time) const {
        return legs[leg].at(leg == 0 ? time : time - jumps[leg - 1]);
    }
};

CameraPath::CameraPath(std::shared_ptr<const Legs> legs) : legs_(std::move(legs)) {}

double CameraPath::duration() const { return legs_->duration; }

std::span<const double> CameraPath::jumps() const { return legs_->jumps; }

bool CameraPath::is_built_in(const std::string& name) {
    return std::ranges::find(internal::built_in_names(), name) != internal::built_in_names().end();
}

std::string CameraPath::built_in_list() {
    std::string list;
    for (const std::string_view name : internal::built_in_names())
        list += (list.empty() ? "" : ", ") + std::string(name);
    return list;
}

std::vector<std::string> CameraPath::built_in_names() {
    const std::span<const std::string_view> names = internal::built_in_names();
    return {names.begin(), names.end()};
}

Result<CameraPath> CameraPath::create(const std::string& built_in, const HeightSource& source,
                                      const CameraPathSettings& settings) {
    if (!is_built_in(built_in)) {
        return fail(ErrorCode::invalid_argument,
                    "a path is " + built_in_list() + " or a track file, got " + built_in);
    }
    TERRANE_TRY(check_settings(settings));
    const double speed =
        settings.speed.value_or(built_in == "spins" ? CameraPathSettings::kDefaultSpinSpeed
                                                    : CameraPathSettings::kDefaultSpeed);
    const double altitude = settings.altitude.value_or(CameraPathSettings::kDefaultAltitude);
    std::optional<internal::GroundLimits> limits;
    if (settings.max_slope) {
        limits = {*settings.max_slope, settings.max_bump, settings.bump_reach};
    }
    Legs path;
    path.duration = settings.seconds.value_or(CameraPathSettings::kDefaultSeconds);
    TERRANE_TRY(std::vector<internal::LegPlan> plans,
                internal::plan_built_in(
                    built_in, source,
                    {settings.region.value_or(source.extent()), settings.start_world, limits},
                    speed, path.duration));
    double time = 0.0;
    for (internal::LegPlan& plan : plans) {
        if (time > 0.0) path.jumps.push_back(time);
        time += plan.duration;
        TERRANE_TRY(internal::CameraLeg leg,
                    internal::CameraLeg::create(std::move(plan), source, altitude, speed));
        path.legs.push_back(std::move(leg));
    }
    return CameraPath(std::make_shared<const Legs>(std::move(path)));
}

Result<CameraPath> CameraPath::create(Track track, const HeightSource& source,
                                      const CameraPathSettings& settings) {
    TERRANE_TRY(check_settings(settings));
    TERRANE_TRY(track.validate());
    if (track.is_recorded) smooth_recorded(track);
    if (!track.has_times || settings.speed) {
        const double speed = settings.speed.value_or(CameraPathSettings::kDefaultSpeed);
        TERRANE_TRY(retime(track, speed));
    }
    const double length = track.points.back().time;
    const double left = length - settings.start;
    if (!(left > 0.0)) {
        return fail(ErrorCode::invalid_argument, "start must be before the track's end at " +
                                                     number_text(length) + " s, got " +
                                                     number_text(settings.start) + " s");
    }
    Legs path;
    path.duration = std::min(left, settings.seconds.value_or(left));
    if (path.duration > CameraPathSettings::kMostSeconds) {
        return fail(ErrorCode::invalid_argument,
                    "a path lasts " + number_text(CameraPathSettings::kMostSeconds) +
                        " s at most, this track lasts " + number_text(path.duration) + " s");
    }
    std::optional<double> altitude = settings.altitude;
    if (!altitude && !track.has_heights) altitude = CameraPathSettings::kDefaultAltitude;
    TERRANE_TRY(internal::CameraLeg leg,
                internal::CameraLeg::create(std::move(track), source, settings.start, path.duration,
                                            altitude));
    path.legs.push_back(std::move(leg));
    return CameraPath(std::make_shared<const Legs>(std::move(path)));
}

CameraPose CameraPath::at(double time) const {
    const std::span<const double> jumps = legs_->jumps;
    const auto next = std::upper_bound(jumps.begin(), jumps.end(), time);
    return legs_->at(static_cast<std::size_t>(next - jumps.begin()), time);
}

CameraPose CameraPath::before(double time) const {
    const std::span<const double> jumps = legs_->jumps;
    const auto next = std::lower_bound(jumps.begin(), jumps.end(), time);
    return legs_->at(static_cast<std::size_t>(next - jumps.begin()), time);
}

std::vector<PathMoment> path_moments(const CameraPath& path) {
    constexpr double kStep = 0.05;
    std::vector<PathMoment> moments;
    auto jump = path.jumps().begin();
    const auto add_jumps = [&](double until) {
        for (; jump != path.jumps().end() && *jump <= until; ++jump) {
            moments.push_back({*jump, true, path.before(*jump)});
            moments.push_back({*jump, false, path.at(*jump)});
        }
    };
    for (int i = 0; i * kStep < path.duration(); ++i) {
        const double time = i * kStep;
        add_jumps(time);
        if (moments.empty() || moments.back().time < time) {
            moments.push_back({time, false, path.at(time)});
        }
    }
    add_jumps(path.duration());
    moments.push_back({path.duration(), false, path.at(path.duration())});
    return moments;
}

std::vector<CameraMoment> camera_trajectory(std::span<const PathMoment> path, double clock) {
    std::vector<CameraMoment> trajectory;
    trajectory.reserve(path.size());
    for (const PathMoment& moment : path) {
        trajectory.push_back({.time_s = clock + moment.time,
                              .eye_world = moment.pose.eye_world,
                              .forward = moment.pose.forward,
                              .up = moment.pose.up});
    }
    return trajectory;
}

}  // namespace terrane
