// SPDX-License-Identifier: MIT
//
// Sources:    Coulter. Implementation of the pure pursuit path tracking algorithm. CMU-RI-TR-92-01.
//             Velenis, Tsiotras. Minimum-time travel for a vehicle with acceleration limits. JOTA 138, 2008 (speed
//             along a given path: curvature limit, then backward integration of braking).
//             Wong. Theory of ground vehicles. 2008, section 6.1 (moment of turning resistance of tracks).
// Deviations: the steering angle for a curvature is a rational function instead of an arc tangent, so that its bits do
//             not depend on the C library.
#include "base/vector_math.h"
#include "world/solver/body_checks.h"

#include <terrane/collision/vehicle.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace terrane {
namespace {

constexpr double kLookAheadTime = 0.7;   // seconds
constexpr double kGravity = 9.81;        // m/s^2
constexpr double kLeastLookAhead = 5.0;  // metres
constexpr double kMostLookAhead = 25.0;  // metres
/// Length of the chords from which the path's curvature is computed, metres; a corner extends this far to both sides.
constexpr double kCornerReach = 5.0;
constexpr double kThrottleGain = 0.5;      // throttle per m/s below the target speed
constexpr double kBrakeGain = 0.25;        // brake per m/s above the target speed
constexpr double kBackingBrakeGain = 1.0;  // the same while it backs off, perhaps down a slope
constexpr double kHeldTime = 1.5;         // seconds without progress after which the throttle rises
constexpr double kHeldRate = 0.5;         // throttle per second and m/s below the target speed
constexpr double kTurnGain = 2.0;         // of tracks: steering per rad/s below the target rate
constexpr double kFullTurnRate = 0.1;     // rad/s that needs the steering against all friction
constexpr double kMostTurnRate = 0.6;     // rad/s
constexpr double kTurningSpeed = 3.0;     // m/s, at least, for the turn rate of a curvature
constexpr double kTurningThrottle = 0.5;  // throttle that steering leaves to tracks
constexpr double kSteepClimb = 0.12;      // sine of the pitch from which tracks climb straight only
constexpr double kHeldSpeed = 1.5;        // m/s below which they do
constexpr double kClimbSteer = 0.2;       // most steering while they do
constexpr double kClimbAngle = 0.4;       // sine of the angle to the target below which they do
constexpr double kBrakeSlack = 0.5;       // excess speed that rolling resistance removes, m/s
constexpr double kFinishDistance = 3.0;   // metres from the last point
constexpr double kLeastSpeed = 1.0;       // m/s in the sharpest corners
constexpr double kLeastDistance = 0.001;  // metres between points
constexpr double kMostCoordinate = 2e9;   // metres
/// Share that the driver uses of the accelerations allowed by friction, stability and brakes.
constexpr double kLimitShare = 0.5;
constexpr double kMostProgress = 1.0;  // metres along the path that always count as progress
constexpr double kPatience = 5.0;      // seconds without progress before the vehicle is stuck
constexpr double kFirstBacking =
    2.0;  // seconds, for the first two lines; twice as long for the next two
constexpr double kMostBacking = 8.0;   // seconds
constexpr double kBackingSpeed = 2.0;  // m/s
constexpr double kBackingSteer = 0.5;  // of full lock, turns the nose towards the next line
constexpr double kLineSpacing = 4.0;   // metres between lines on one side of the path
constexpr int kMostLines = 8;          // on both sides; then the first ones again
constexpr double kPassed = 15.0;       // metres along the path beyond an obstacle

/// atan(x) to 0.005 rad for |x| <= 1; steeper slopes are taken as 1 or -1.
double steer_of_slope(double x) {
    const double slope = std::clamp(x, -1.0, 1.0);
    return slope / (1.0 + 0.28125 * slope * slope);
}

struct Nearest {
    double share = 0.0;  ///< 0 to 1 along the segment
    double distance = 0.0;
};

double distance_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const double dx = b.x() - a.x(), dy = b.y() - a.y();
    return std::sqrt(dx * dx + dy * dy);
}

Nearest nearest_on(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& p) {
    const double dx = b.x() - a.x(), dy = b.y() - a.y();
    const double along = (p.x() - a.x()) * dx + (p.y() - a.y()) * dy;
    Nearest nearest;
    nearest.share = std::clamp(along / (dx * dx + dy * dy), 0.0, 1.0);
    const Eigen::Vector2d foot(a.x() + nearest.share * dx, a.y() + nearest.share * dy);
    nearest.distance = distance_between(foot, p);
    return nearest;
}

bool has_wheel_in_contact(const VehicleState& vehicle) {
    return std::any_of(vehicle.wheels.begin(), vehicle.wheels.end(),
                       [](const WheelState& wheel) { return wheel.in_contact; });
}

/// Distance from the first axle to the mean of the unsteered axles, metres; for tracks, half their length.
double wheelbase_of(const VehicleSettings& settings) {
    double first = settings.axles.front().position, last = first, sum = 0.0;
    int fixed_count = 0;
    for (const AxleSettings& axle : settings.axles) {
        first = std::max(first, axle.position);
        last = std::min(last, axle.position);
        if (axle.max_steer != 0.0) continue;
        sum += axle.position;
        ++fixed_count;
    }
    const double rear = fixed_count > 0 ? sum / fixed_count : last;
    return std::max(0.1, first - rear);
}

/// Largest steering angle, radians. Tracks at full lock are treated as a wheeled vehicle steered by one radian.
double max_steer_of(const VehicleSettings& settings) {
    if (settings.is_tracked) return 1.0;
    double most = 0.0;
    for (const AxleSettings& axle : settings.axles) most = std::max(most, axle.max_steer);
    return most;
}

double track_of(const VehicleSettings& settings) {
    double widest = 0.0;
    for (const AxleSettings& axle : settings.axles) widest = std::max(widest, axle.track);
    return widest;
}

/// Share of full steering at which a tracked vehicle's belts overcome the friction across them on level ground.
double turning_resistance(const VehicleSettings& s) {
    double middle = 0.0, lever = 0.0;
    for (const AxleSettings& axle : s.axles) middle += axle.position;
    middle /= static_cast<double>(s.axles.size());
    for (const AxleSettings& axle : s.axles) lever += std::abs(axle.position - middle);
    lever /= static_cast<double>(s.axles.size());
    const double resisting = s.tyre_friction * s.side_grip * s.mass * kGravity * lever;
    const double turning = 0.5 * s.max_drive_force * track_of(s);
    return turning > 0.0 ? std::min(1.0, resisting / turning) : 0.0;
}

/// Available accelerations of a vehicle on its current slope.
struct Reserve {
    double lateral = 0.0;        ///< to either side, before sliding or rolling over, m/s^2, >= 0
    double braking = 0.0;        ///< deceleration along its heading, m/s^2, >= 0
    double braking_share = 0.0;  ///< ratio of `braking` to its value on level ground, 0 to 1
};

/// Subtracts gravity along the vehicle's axes from the limits of friction, stability and brakes.
Reserve reserve_of(const VehicleSettings& s, const VehicleState& vehicle) {
    const Eigen::Matrix3d& rotation = vehicle.chassis.pose.rotation;
    const double upright = std::max(0.0, rotation(2, 2));
    const double descent = std::max(0.0, -rotation(2, 0));
    const double stability = 0.5 * track_of(s) / s.centre_of_mass_height;
    const double brakes = s.max_brake_force / (s.mass * kGravity);
    const double level = std::min(s.tyre_friction, brakes);
    const double lateral =
        std::min(s.tyre_friction, stability) * upright - std::abs(rotation(2, 1));
    const double braking = std::min(s.tyre_friction * upright, brakes) - descent;
    Reserve reserve;
    reserve.lateral = kGravity * std::max(0.0, lateral);
    reserve.braking = kGravity * std::max(0.0, braking);
    reserve.braking_share = level > 0.0 ? std::clamp(braking / level, 0.0, 1.0) : 0.0;
    return reserve;
}

/// The side and distance of the line that the n-th attempt takes, metres to the left of the path.
double line_offset(int attempt) {
    if (attempt == 0) return 0.0;
    const int line = (attempt - 1) % kMostLines;
    const int distance = 1 + line / 2;  // in spacings
    return (line % 2 == 0 ? kLineSpacing : -kLineSpacing) * distance;
}

}  // namespace

Result<PathDriver> PathDriver::create(std::vector<Eigen::Vector2d> points_world,
                                      const PathDriverSettings& settings) {
    const internal::FieldRange fields[] = {
        {"cruise_speed", settings.cruise_speed, 0.1, 1e3},
        {"lateral_acceleration", settings.lateral_acceleration, 0.1, 100.0},
        {"deceleration", settings.deceleration, 0.1, 100.0},
    };
    TERRANE_TRY(internal::check_fields(fields));
    std::vector<Vertex> path;
    for (std::size_t i = 0; i < points_world.size(); ++i) {
        const std::string name = "points_world[" + std::to_string(i) + "]";
        const Eigen::Vector3d point(points_world[i].x(), points_world[i].y(), 0.0);
        TERRANE_TRY(internal::check_vector(name.c_str(), point, kMostCoordinate));
        Vertex vertex{.p_world = points_world[i]};
        if (!path.empty()) {
            const double step = distance_between(path.back().p_world, vertex.p_world);
            if (step < kLeastDistance) continue;
            vertex.along = path.back().along + step;
        }
        path.push_back(vertex);
    }
    if (path.size() < 2) {
        return fail(ErrorCode::invalid_argument,
                    "a path needs 2 points that are at least 1 mm apart, got " +
                        std::to_string(points_world.size()) + " points, " +
                        std::to_string(path.size()) + " of them distinct");
    }
    return PathDriver(std::move(path), settings);
}

PathDriver::PathDriver(std::vector<Vertex> path, const PathDriverSettings& settings)
    : path_(std::move(path)), settings_(settings), patience_(kPatience) {
    std::size_t behind_end = 1, ahead_end = 1;  // ends of the segments that hold the chords' ends
    const auto point_from = [&](double along, std::size_t& end) {
        while (end + 1 < path_.size() && path_[end].along < along) ++end;
        return point_at(along, end);
    };
    for (Vertex& here : path_) {
        const Eigen::Vector2d behind = point_from(here.along - kCornerReach, behind_end);
        const Eigen::Vector2d ahead = point_from(here.along + kCornerReach, ahead_end);
        const double size_behind = distance_between(behind, here.p_world);
        const double size_ahead = distance_between(here.p_world, ahead);
        double turn = 0.0;  // between unit chords: reach times curvature
        if (size_behind > 0.0 && size_ahead > 0.0) {
            turn = distance_between((here.p_world - behind) / size_behind,
                                    (ahead - here.p_world) / size_ahead);
        }
        here.corner = settings_.lateral_acceleration * kCornerReach / std::max(turn, 1e-9);
    }
    double braked = path_.back().corner;
    for (std::size_t i = path_.size(); i-- > 0;) {
        if (i + 1 < path_.size()) {
            braked += 2.0 * settings_.deceleration * (path_[i + 1].along - path_[i].along);
        }
        braked = std::min(braked, path_[i].corner);
        path_[i].braked = braked;
    }
}

/// Advances along the path to the vehicle's position, never backwards. Moves on to the next segment if that is nearer
/// or the current one has been passed.
/// @return metres along the path
double PathDriver::advance(const Eigen::Vector2d& here) {
    const auto nearest = [&](std::size_t end) {
        return nearest_on(path_[end - 1].p_world, path_[end].p_world, here);
    };
    Nearest now = nearest(next_);
    while (next_ + 1 < path_.size()) {
        const Nearest later = nearest(next_ + 1);
        if (now.share < 1.0 && later.distance >= now.distance) break;
        ++next_;
        now = later;
    }
    if (next_ + 1 == path_.size() &&
        (now.share >= 1.0 || distance_between(here, path_.back().p_world) < kFinishDistance)) {
        is_finished_ = true;
    }
    const double start = path_[next_ - 1].along;
    return start + now.share * (path_[next_].along - start);
}

/// The end of the segment at a distance along the path, which is clamped to the path's ends.
/// @param end index at which the search starts: the end of a segment that starts at or before the point
std::size_t PathDriver::segment_at(double along, std::size_t end) const {
    while (end + 1 < path_.size() && path_[end].along < along) ++end;
    return end;
}

/// The point at a distance along the path, as segment_at().
Eigen::Vector2d PathDriver::point_at(double along, std::size_t end) const {
    end = segment_at(along, end);
    const Vertex& from = path_[end - 1];
    const Vertex& to = path_[end];
    const double length =
        to.along - from.along;  // 0 if rounding absorbs the step on a very long path
    const double share = length > 0.0 ? std::clamp((along - from.along) / length, 0.0, 1.0) : 0.0;
    return from.p_world + share * (to.p_world - from.p_world);
}

/// Speed from which the vehicle can still brake for all corners ahead and the end, m/s.
/// @param share fraction of the accelerations of the settings that is used
double PathDriver::corner_speed(double along, double share) const {
    double square = 2.0 * settings_.deceleration * (path_.back().along - along);
    for (std::size_t i = next_; i-- > 0 && path_[i].along > along - kCornerReach;) {
        square = std::min(square, path_[i].corner);
    }
    for (std::size_t i = next_; i < path_.size(); ++i) {
        const double before = path_[i].along - kCornerReach - along;
        if (before > 0.0) {
            square = std::min(square, path_[i].braked + 2.0 * settings_.deceleration * before);
            break;
        }
        square = std::min(square, path_[i].corner);
    }
    return std::sqrt(share * square);
}

double PathDriver::path_share() const {
    return is_finished_ ? 1.0 : std::clamp(progress_ / path_.back().along, 0.0, 1.0);
}

/// Observes the progress along the path. Begins an attempt whenever the patience is over.
void PathDriver::watch(double along, const Eigen::Vector2d& here, double dt) {
    backing_time_ = std::max(0.0, backing_time_ - dt);
    if (attempts_ > 0 && along > stuck_along_ + kPassed) attempts_ = 0;
    const double slow =
        0.2 * kPatience * settings_.cruise_speed;  // metres, at a fifth of the cruise speed
    if (along >= progress_ + std::min(kMostProgress, slow)) {
        progress_ = along;
        still_time_ = 0.0;
        patience_ = kPatience;
        return;
    }
    still_time_ += dt;
    if (still_time_ > kPatience) stuck_time_ += still_time_ - dt > kPatience ? dt : still_time_;
    if (still_time_ <= patience_) return;
    if (attempts_ == 0) stuck_along_ = along;
    ++attempts_;
    stuck_place_world_ = here;
    const int pairs = (attempts_ + 1) / 2;
    backing_time_ = std::min(kFirstBacking * pairs, kMostBacking);
    patience_ = still_time_ + kPatience + 3.0 * backing_time_;  // it has to come back, too
}

/// A point of the line that the vehicle follows: the path or, while an obstacle is not passed, a line beside it.
Eigen::Vector2d PathDriver::line_point(double along) const {
    const Eigen::Vector2d p = point_at(along, next_);
    if (attempts_ == 0) return p;
    const std::size_t end = segment_at(along, next_);
    const Eigen::Vector2d& a = path_[end - 1].p_world;
    const Eigen::Vector2d& b = path_[end].p_world;
    const double scale = line_offset(attempts_) / distance_between(a, b);
    return {p.x() - scale * (b.y() - a.y()), p.y() + scale * (b.x() - a.x())};
}

VehicleControls PathDriver::drive(const VehicleSettings& settings, const VehicleState& vehicle,
                                  double dt) {
    constexpr VehicleControls kStop{.throttle = 0.0, .brake = 1.0, .steer = 0.0};
    const BodyState& chassis = vehicle.chassis;
    const double wheelbase = wheelbase_of(settings), max_steer = max_steer_of(settings);
    const Eigen::Vector2d here(chassis.pose.translation.x(), chassis.pose.translation.y());
    const Eigen::Vector3d ahead = chassis.pose.rotation.col(0);
    const double speed = internal::dot(chassis.velocity, ahead);

    if (vehicle.is_rolled_over && !is_finished_) {
        status_ = DriverStatus::rolled_over;
        return kStop;
    }
    const double along = advance(here);
    // Time in the air, and beside ground that is not resident, does not count.
    const bool is_watched =
        has_wheel_in_contact(vehicle) && !is_finished_ &&
        (chassis.condition == BodyCondition::awake || chassis.condition == BodyCondition::asleep);
    if (is_watched) watch(along, here, dt > 0.0 && std::isfinite(dt) ? dt : 0.0);
    status_ = is_finished_              ? DriverStatus::finished
              : still_time_ > kPatience ? DriverStatus::stuck
                                        : DriverStatus::driving;
    if (is_finished_) return kStop;
    if (backing_time_ > 0.0) {
        VehicleControls back;
        back.throttle = std::clamp(kThrottleGain * (-kBackingSpeed - speed), -1.0, 0.0);
        back.brake =
            std::clamp(kBackingBrakeGain * (-kBackingSpeed - kBrakeSlack - speed), 0.0, 1.0);
        back.steer = line_offset(attempts_) > 0.0 ? -kBackingSteer : kBackingSteer;
        return back;
    }

    // Pure pursuit in the vehicle's frame, projected onto the horizontal plane.
    const double look_ahead = std::clamp(kLookAheadTime * speed, kLeastLookAhead, kMostLookAhead);
    const Eigen::Vector2d target = line_point(along + look_ahead);
    const double flat = std::sqrt(ahead.x() * ahead.x() + ahead.y() * ahead.y());
    const double fx = flat > 1e-6 ? ahead.x() / flat : 1.0,
                 fy = flat > 1e-6 ? ahead.y() / flat : 0.0;
    const double tx = target.x() - here.x(), ty = target.y() - here.y();
    const double forward = tx * fx + ty * fy, left_side = ty * fx - tx * fy;
    const double square = std::max(tx * tx + ty * ty, 1.0);
    double curvature = 2.0 * left_side / square;
    if (forward < 0.0) {  // behind: steer as tightly as possible
        curvature = (left_side >= 0.0 ? 1.0 : -1.0) / wheelbase;
    }
    const double angle = steer_of_slope(wheelbase * curvature);
    const double steer = max_steer > 0.0 ? angle / max_steer : 0.0;

    const Reserve reserve = reserve_of(settings, vehicle);
    const double lateral = std::min(settings_.lateral_acceleration, kLimitShare * reserve.lateral);
    const double share =
        std::min(lateral / settings_.lateral_acceleration,
                 std::min(1.0, kLimitShare * reserve.braking / settings_.deceleration));
    const double curve_speed = std::sqrt(lateral / std::max(std::abs(curvature), 1e-6));
    const double slope_speed = settings_.cruise_speed * std::sqrt(reserve.braking_share);
    const double wanted = std::min(
        settings_.cruise_speed,
        std::max(std::min({slope_speed, curve_speed, corner_speed(along, share)}), kLeastSpeed));
    VehicleControls controls;
    controls.steer = std::clamp(steer, -1.0, 1.0);
    // The throttle in proportion to the missing speed alone would not hold a slow vehicle on a climb.
    if (is_watched && dt > 0.0 && std::isfinite(dt) && (push_ > 0.0 || still_time_ > kHeldTime)) {
        push_ = std::clamp(push_ + kHeldRate * dt * (wanted - speed), 0.0, 1.0);
    }
    if (has_wheel_in_contact(vehicle)) {
        controls.throttle = std::clamp(kThrottleGain * (wanted - speed) + push_, 0.0, 1.0);
    }
    controls.brake = std::clamp(kBrakeGain * (speed - wanted - kBrakeSlack), 0.0, 1.0);
    if (settings.is_tracked) {
        const double wanted_rate =
            std::clamp(curvature * std::max(speed, kTurningSpeed), -kMostTurnRate, kMostTurnRate);
        const double rate = internal::dot(chassis.angular_velocity, chassis.pose.rotation.col(2));
        const double resistance =
            turning_resistance(settings) * std::clamp(wanted_rate / kFullTurnRate, -1.0, 1.0);
        controls.steer = std::clamp(resistance + kTurnGain * (wanted_rate - rate), -1.0, 1.0);
        // throttle beyond this would leave the belts less difference than the steering asks for
        controls.throttle =
            std::min(controls.throttle, std::max(kTurningThrottle, 1.0 - std::abs(controls.steer)));
        // against a slope the belts cannot climb and turn at once
        const bool is_ahead =
            forward > 0.0 && std::abs(left_side) < kClimbAngle * std::sqrt(square);
        if (is_ahead && has_wheel_in_contact(vehicle) && ahead.z() > kSteepClimb &&
            speed < kHeldSpeed) {
            controls.steer = std::clamp(controls.steer, -kClimbSteer, kClimbSteer);
            controls.throttle = 1.0;
        }
    }
    return controls;
}

}  // namespace terrane
