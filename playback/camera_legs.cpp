// SPDX-License-Identifier: MIT
#include "camera_legs.h"

#include <terrane/base/text.h>
#include <terrane/terrain/chunk_source.h>
#include <terrane/terrain/lattice.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace terrane::internal {
namespace {

constexpr double kGravity = 9.81;  // m/s^2
constexpr double kDrop = 0.2;      // downward slope of the view direction on level paths
constexpr double kClimb = 0.7;     // share of the path's slope that the view direction follows
constexpr double kTrackClearance =
    2.0;  // least height of a recorded track above the ground, metres

Eigen::Vector3d cross(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return {a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(),
            a.x() * b.y() - a.y() * b.x()};
}

// The normalised component of `hint` perpendicular to a direction; if the two are parallel, that of north.
Eigen::Vector3d square_to(const Eigen::Vector3d& direction, const Eigen::Vector3d& hint) {
    Eigen::Vector3d right = cross(direction, hint);
    if (right.norm() < 1e-9) right = cross(direction, Eigen::Vector3d::UnitY());
    return cross(right, direction).normalized();
}

}  // namespace

std::size_t control_count(double duration) {
    return static_cast<std::size_t>((duration + 2.0 * kLegPad) / kLegStep) + 2;
}

double control_time(std::size_t i) { return static_cast<double>(i) * kLegStep - kLegPad; }

Result<CameraLeg> CameraLeg::create(LegPlan plan, const HeightSource& source, double altitude,
                                    double speed) {
    CameraLeg leg;
    leg.duration_ = plan.duration;
    leg.target_world_ = plan.target_world;
    leg.turn_ = std::move(plan.turn);
    leg.plan_ = SmoothCurve(-kLegPad, kLegStep, std::move(plan.control));
    TERRANE_TRY(leg.fit_heights(source, altitude, 0.5 * altitude, speed));
    leg.fit_orientation(std::clamp(3.0 * altitude / speed, 2.0, 6.0), plan.has_lean);
    return leg;
}

Result<CameraLeg> CameraLeg::create(Track track, const HeightSource& source, double start,
                                    double duration, std::optional<double> altitude) {
    CameraLeg leg;
    leg.track_plan_ = TrackCurve(track);
    leg.start_ = start;
    leg.duration_ = duration;
    double length = 0.0;
    for (std::size_t i = 1; i < track.points.size(); ++i) {
        length +=
            (track.points[i].position_world - track.points[i - 1].position_world).head<2>().norm();
    }
    const double speed = std::max(1.0, length / leg.track_plan_.duration());
    leg.has_own_heights_ = !altitude;
    if (altitude || track.is_recorded) {
        const double clearance = altitude ? 0.5 * *altitude : kTrackClearance;
        TERRANE_TRY(leg.fit_heights(source, altitude.value_or(0.0), clearance, speed));
    }
    leg.fit_orientation(3.0, false);
    if (track.has_orientations) leg.orientations_ = std::move(track.points);
    return leg;
}

CurvePoint CameraLeg::eye(double time) const {
    CurvePoint point = plan_.is_empty() ? track_plan_.at(start_ + time) : plan_.at(time);
    if (heights_.is_empty()) return point;
    const CurvePoint height = heights_.at(time);
    point.value.z() = height.value.z() + (has_own_heights_ ? point.value.z() : 0.0);
    point.rate.z() = height.rate.z() + (has_own_heights_ ? point.rate.z() : 0.0);
    return point;
}

namespace {

// The chunk of the finest level over a place; absent outside the root squares.
std::optional<ChunkKey> chunk_over(const Lattice& lattice, const Eigen::Vector2d& place) {
    const double side = kChunkCells * lattice.spacing;
    const double x = std::floor((place.x() - lattice.origin_x) / side);
    const double y = std::floor((place.y() - lattice.origin_y) / side);
    constexpr double kMost = std::numeric_limits<std::int32_t>::max();
    if (!(std::abs(x) < kMost && std::abs(y) < kMost)) return std::nullopt;
    const ChunkKey key{static_cast<std::int32_t>(x), static_cast<std::int32_t>(y),
                       static_cast<std::uint8_t>(lattice.finest_level)};
    if (!lattice.contains(key)) return std::nullopt;
    return key;
}

// Heights at places along a line. A source on a server is told which chunks come next, and reads several at once.
Result<std::vector<double>> heights_along(const HeightSource& source,
                                          std::span<const Eigen::Vector2d> places) {
    constexpr std::size_t kExpected = 16;
    std::vector<ChunkKey> keys;
    std::vector<std::size_t> first_places;  // of each key
    for (std::size_t i = 0; i < places.size(); ++i) {
        const auto key = chunk_over(source.lattice(), places[i]);
        if (!key || (!keys.empty() && keys.back() == *key)) continue;
        keys.push_back(*key);
        first_places.push_back(i);
    }
    std::vector<double> heights(places.size());
    std::size_t next = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
        if (next < keys.size() && first_places[next] == i) {
            const std::size_t count = std::min(kExpected, keys.size() - next);
            chunks_of(source).expect_chunks(std::span(keys).subspan(next++, count));
        }
        heights[i] = source.height(places[i].x(), places[i].y());
        if (!std::isfinite(heights[i])) {
            return fail(ErrorCode::io, "the terrain cannot be read at " +
                                           number_text(places[i].x()) + ", " +
                                           number_text(places[i].y()) + " m");
        }
    }
    return heights;
}

}  // namespace

// Height = smoothed ground + altitude + correction, or the track's own height + correction. The correction is the
// smoothed running maximum of the missing clearance over the support of the smoothing: each smoothed value is a mean of
// values that are not below the missing clearance, so the clearance holds at every sample.
Result<void> CameraLeg::fit_heights(const HeightSource& source, double altitude, double clearance,
                                    double speed) {
    constexpr double kMostSamples = 400'000.0;
    const std::size_t count = control_count(duration_);
    const double finest = std::max(1.0, source.lattice().spacing);
    const double most = std::max(4.0, kMostSamples / static_cast<double>(count));
    const auto per_step =
        static_cast<std::size_t>(std::clamp(std::ceil(kLegStep * speed / finest), 4.0, most));
    const double sample_step = kLegStep / static_cast<double>(per_step);

    std::vector<Eigen::Vector2d> places((count - 1) * per_step + 1);
    const auto sample_time = [&](std::size_t i) {
        return static_cast<double>(i) * sample_step - kLegPad;
    };
    for (std::size_t i = 0; i < places.size(); ++i) {
        places[i] = eye(sample_time(i)).value.head<2>();
    }
    TERRANE_TRY(const std::vector<double> ground, heights_along(source, places));
    // The smoothing is wider at larger altitudes and at lower speeds.
    const double width = std::clamp(1.5 + 0.5 * altitude / speed, 1.5, 6.0);
    const auto half_width = static_cast<std::ptrdiff_t>(width / sample_step);
    std::vector<Eigen::Vector3d> control(count, Eigen::Vector3d::Zero());
    if (!has_own_heights_) {
        const std::vector<double> mean = smoothed(ground, half_width);
        for (std::size_t i = 0; i < count; ++i) control[i].z() = mean[i * per_step] + altitude;
    }
    const SmoothCurve base(-kLegPad, kLegStep, control);
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
    heights_ = SmoothCurve(-kLegPad, kLegStep, std::move(control));
    return {};
}

// View directions: the smoothed displacement of the eye from 0.25 * ahead seconds earlier to `ahead` seconds later. A
// camera that stands still keeps its last direction.
void CameraLeg::fit_orientation(double ahead, bool has_lean) {
    constexpr double kLeastDisplacement = 1.0;  // metres: less gives no direction
    constexpr std::ptrdiff_t kHalfWidth = 3;
    const std::size_t count = control_count(duration_);
    std::vector<Eigen::Vector3d> direction(count, Eigen::Vector3d::Zero());
    std::vector<Eigen::Vector3d> lean(count, Eigen::Vector3d::UnitZ());
    std::optional<Eigen::Vector3d> last;
    for (std::size_t i = 0; i < count; ++i) {
        const double time = control_time(i);
        Eigen::Vector3d displacement = eye(time + ahead).value - eye(time - 0.25 * ahead).value;
        const double length = displacement.head<2>().norm();
        if (length > kLeastDisplacement) {
            displacement.z() = kClimb * displacement.z() - kDrop * length;
            if (!last) std::fill_n(direction.begin(), i, displacement.normalized());
            last = displacement.normalized();
        }
        direction[i] = last.value_or(Eigen::Vector3d(0.0, 1.0, -kDrop).normalized());
        if (!has_lean) continue;
        const Eigen::Vector3d acceleration_g =
            (eye(time + kLegStep).rate - eye(time - kLegStep).rate) / (2.0 * kLegStep * kGravity);
        const Eigen::Vector3d right =
            Eigen::Vector3d(direction[i].y(), -direction[i].x(), 0.0).normalized();
        const double side = right.dot(acceleration_g);
        lean[i] += right * (0.3 * side / (1.0 + std::abs(side)));
    }
    forward_ = SmoothCurve(-kLegPad, kLegStep, smoothed(direction, kHalfWidth));
    up_ = SmoothCurve(-kLegPad, kLegStep, smoothed(lean, kHalfWidth));
}

CameraPose CameraLeg::at(double time) const {
    CameraPose pose;
    const CurvePoint place = eye(time);
    pose.eye_world = place.value;
    pose.velocity = place.rate;
    Eigen::Vector3d up = up_.at(time).value;
    Eigen::Vector3d forward = forward_.at(time).value;
    if (target_world_) forward = *target_world_ - pose.eye_world;
    if (!turn_.is_empty()) {
        const Eigen::Vector2d turn = turn_.at(time).value.head<2>().normalized();
        forward.head<2>() = Eigen::Vector2d(turn.x() * forward.x() - turn.y() * forward.y(),
                                            turn.y() * forward.x() + turn.x() * forward.y());
    }
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

}  // namespace terrane::internal
