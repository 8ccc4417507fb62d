// SPDX-License-Identifier: MIT
#include "drop/drop_camera.h"

#include "camera/look_towards.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kSpreads = 1.5;           // camera distance over the bodies' spread
constexpr double kNearest = 4.0;           // least camera distance, metres
constexpr double kRise = 0.5;              // height above the target over the distance
constexpr double kCameraClearance = 0.25;  // target height above the ground over the distance
constexpr double kLeastClearance = 0.05;   // least height above the ground over the distance
constexpr double kTurn = 0.08;             // angular velocity around the target, rad/s
constexpr double kLag = 0.7;               // time constant of the camera, seconds

// Mean position of the bodies on the terrain; of all bodies where none is on it.
WorldPos find_middle(std::span<const BodyState> bodies) {
    WorldPos sum = WorldPos::Zero(), sum_of_all = WorldPos::Zero();
    std::size_t count = 0;
    for (const BodyState& body : bodies) {
        sum_of_all += body.pose.translation;
        if (body.condition == BodyCondition::left_world) continue;
        sum += body.pose.translation;
        ++count;
    }
    return count > 0 ? WorldPos(sum / static_cast<double>(count))
                     : WorldPos(sum_of_all / static_cast<double>(bodies.size()));
}

}  // namespace

DropCamera::DropCamera(std::shared_ptr<const HeightSource> source,
                       std::span<const BodyState> bodies)
    : source_(std::move(source)), target_world_(find_middle(bodies)) {
    double square = 0.0;
    for (const BodyState& body : bodies) {
        square += (body.pose.translation - target_world_).squaredNorm();
    }
    const double spread = std::sqrt(square / static_cast<double>(bodies.size()));
    distance_ = std::max(kSpreads * spread, kNearest);
    // starts on the downhill side, which shows the slope best
    const double reach = distance_;
    const double east = source_->height(target_world_.x() + reach, target_world_.y()) -
                        source_->height(target_world_.x() - reach, target_world_.y());
    const double north = source_->height(target_world_.x(), target_world_.y() + reach) -
                         source_->height(target_world_.x(), target_world_.y() - reach);
    if (std::isfinite(east + north)) heading_ = std::atan2(-north, -east);
    eye_world_ = find_eye();
}

WorldPos DropCamera::find_eye() const {
    WorldPos eye =
        target_world_ + distance_ * Eigen::Vector3d(std::cos(heading_), std::sin(heading_), kRise);
    return clear_of_ground(eye, kCameraClearance);
}

// The position, raised to at least clearance * distance_ above the ground.
WorldPos DropCamera::clear_of_ground(WorldPos eye, double clearance) const {
    const double ground = source_->height(eye.x(), eye.y());
    if (std::isfinite(ground)) eye.z() = std::max(eye.z(), ground + clearance * distance_);
    return eye;
}

void DropCamera::follow(std::span<const BodyState> bodies, double dt) {
    const double share = dt / (dt + kLag);
    heading_ += kTurn * dt;
    target_world_ += share * (find_middle(bodies) - target_world_);
    const WorldPos before = eye_world_;
    const WorldPos wanted = find_eye();
    eye_world_ = clear_of_ground(before + share * (wanted - before), kLeastClearance);
    velocity_ = (eye_world_ - before) / dt;
}

View DropCamera::view(const View& view) const {
    return look_towards(view, eye_world_, target_world_);
}

}  // namespace terrane::tools
