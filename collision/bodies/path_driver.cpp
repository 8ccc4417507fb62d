// SPDX-License-Identifier: MIT
//
// Sources:    Coulter. Implementation of the pure pursuit path tracking algorithm. CMU-RI-TR-92-01.
// Deviations: the steering angle of a curvature is a quotient of polynomials, not an arc tangent, so
//             that its bits do not depend on the C library.
#include "vector_math.h"

#include <terrane/collision/truck.h>
#include <terrane/terrain/assert.h>

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

constexpr double kLookAheadTime = 0.7;     // seconds
constexpr double kLeastLookAhead = 5.0;    // metres
constexpr double kMostLookAhead = 25.0;    // metres
constexpr double kSideAcceleration = 2.5;  // m/s^2 in curves: well below what turns a truck over
constexpr double kThrottleGain = 0.5;      // of full throttle for each m/s that is missing
constexpr double kBrakeGain = 0.25;        // of full brake for each m/s too much
constexpr double kBrakeSlack = 0.5;        // m/s too much that rolling takes off by itself
constexpr double kDoneDistance = 3.0;      // metres from the last point

/// atan(x) to 0.005 rad for |x| <= 1; steeper slopes are taken as 1.
double steer_of_slope(double x) {
    const double slope = std::clamp(x, -1.0, 1.0);
    return slope / (1.0 + 0.28125 * slope * slope);
}

struct Nearest {
    double along = 0.0;  ///< 0 to 1 along the segment
    double distance = 0.0;
};

Nearest nearest_on(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& p) {
    const double dx = b.x() - a.x(), dy = b.y() - a.y();
    const double square = dx * dx + dy * dy;
    Nearest nearest;
    if (square > 0.0) {
        nearest.along =
            std::clamp(((p.x() - a.x()) * dx + (p.y() - a.y()) * dy) / square, 0.0, 1.0);
    }
    const double ex = a.x() + nearest.along * dx - p.x(), ey = a.y() + nearest.along * dy - p.y();
    nearest.distance = std::sqrt(ex * ex + ey * ey);
    return nearest;
}

double distance_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const double dx = b.x() - a.x(), dy = b.y() - a.y();
    return std::sqrt(dx * dx + dy * dy);
}

}  // namespace

PathDriver::PathDriver(std::vector<Eigen::Vector2d> points_world, double cruise_speed)
    : points_(std::move(points_world)), cruise_speed_(cruise_speed) {
    TERRANE_ASSERT(points_.size() >= 2, "a path needs two points");
    TERRANE_ASSERT(cruise_speed_ > 0.0, "cruise_speed must be > 0");
}

TruckControls PathDriver::drive(const Truck& truck) {
    const BodyState& chassis = truck.chassis();
    const TruckSettings& settings = truck.settings();
    const Eigen::Vector2d here(chassis.pose.translation.x(), chassis.pose.translation.y());
    const Eigen::Vector3d ahead = chassis.pose.rotation.col(0);
    const double speed = internal::dot(chassis.velocity, ahead);

    // The path is never followed backwards: a segment is left when its end is nearest.
    while (next_ + 1 < points_.size() &&
           (nearest_on(points_[next_ - 1], points_[next_], here).along >= 1.0 ||
            nearest_on(points_[next_], points_[next_ + 1], here).distance <
                nearest_on(points_[next_ - 1], points_[next_], here).distance)) {
        ++next_;
    }
    const Nearest on_path = nearest_on(points_[next_ - 1], points_[next_], here);
    if (next_ + 1 == points_.size() &&
        (on_path.along >= 1.0 || distance_between(here, points_.back()) < kDoneDistance)) {
        done_ = true;
    }
    if (done_) return {.throttle = 0.0, .brake = 1.0, .steer = 0.0};

    // The point that is a look-ahead further along the path.
    double left = std::clamp(kLookAheadTime * speed, kLeastLookAhead, kMostLookAhead);
    Eigen::Vector2d from =
        points_[next_ - 1] + on_path.along * (points_[next_] - points_[next_ - 1]);
    Eigen::Vector2d target = points_.back();
    for (std::size_t i = next_; i < points_.size(); ++i) {
        const double length = distance_between(from, points_[i]);
        if (length >= left && length > 0.0) {
            target = from + (left / length) * (points_[i] - from);
            break;
        }
        left -= length;
        from = points_[i];
    }

    // Seen from the truck, in the world's plane.
    const double flat = std::sqrt(ahead.x() * ahead.x() + ahead.y() * ahead.y());
    const double fx = flat > 1e-6 ? ahead.x() / flat : 1.0,
                 fy = flat > 1e-6 ? ahead.y() / flat : 0.0;
    const double tx = target.x() - here.x(), ty = target.y() - here.y();
    const double forward = tx * fx + ty * fy, left_side = ty * fx - tx * fy;
    const double square = std::max(tx * tx + ty * ty, 1.0);
    double curvature = 2.0 * left_side / square;
    if (forward < 0.0) {  // behind: turn as tightly as it goes
        curvature = (left_side >= 0.0 ? 1.0 : -1.0) / settings.wheelbase;
    }
    const double angle = steer_of_slope(settings.wheelbase * curvature);
    const double steer = settings.max_steer > 0.0 ? angle / settings.max_steer : 0.0;

    const double curve_speed = std::sqrt(kSideAcceleration / std::max(std::abs(curvature), 1e-6));
    const double wanted = std::min(cruise_speed_, std::max(curve_speed, 1.0));
    TruckControls controls;
    controls.steer = std::clamp(steer, -1.0, 1.0);
    controls.throttle = std::clamp(kThrottleGain * (wanted - speed), 0.0, 1.0);
    controls.brake = std::clamp(kBrakeGain * (speed - wanted - kBrakeSlack), 0.0, 1.0);
    return controls;
}

}  // namespace terrane
