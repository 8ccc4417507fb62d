// SPDX-License-Identifier: MIT
#include "flight/cameras.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kLeastClearance = 0.6;  // least height above the ground, metres
constexpr double kCalmClearance = 2.0;   // wanted height above the ground, metres
constexpr double kWallClearance = 0.5;   // between the eye and a wall behind it, metres
constexpr double kLeastSight = 0.5;      // least distance of the eye, relative to that of the wall
constexpr double kTurnTime = 0.6;        // time constant of the heading, seconds
constexpr double kHeightTime = 0.25;     // time constant of heights, seconds

// Blend factor of a first-order lag (implicit Euler): stable for any dt.
double lag(double dt, double time) { return dt / (dt + time); }

}  // namespace

ChaseCamera::ChaseCamera(const HeightSource& source, const Pose& pose_world,
                         const ChaseCameraSettings& settings)
    : source_(source), settings_(settings) {
    heading_ = Eigen::Vector3d(pose_world.rotation(0, 0), pose_world.rotation(1, 0), 0.0);
    if (heading_.norm() > 1e-3) heading_.normalize();
    eye_world_ = wanted_eye(pose_world, nullptr);
    target_world_ = pose_world.translation + Eigen::Vector3d(0.0, 0.0, settings_.target_above);
}

// Height of the ground that the camera must stay above: the heightfield or, if the target is in a cave, its floor.
double ChaseCamera::floor_at(double x, double y, const Pose& pose_world,
                             const Ground* ground) const {
    const double height = source_.height(x, y);
    if (ground == nullptr || !ground->has_solids()) return height;
    const double top = pose_world.translation.z() + settings_.above;
    const HeightAnswer below = ground->height_below(x, y, top);
    return below.status == QueryStatus::ok ? below.height : std::min(height, top);
}

WorldPos ChaseCamera::wanted_eye(const Pose& pose_world, const Ground* ground) const {
    WorldPos eye = pose_world.translation - settings_.behind * heading_;
    eye.z() = std::max(pose_world.translation.z() + settings_.above,
                       floor_at(eye.x(), eye.y(), pose_world, ground) + kCalmClearance);
    return eye;
}

// If a wall is between the eye and its target, moves the eye to the target's side of the wall.
void ChaseCamera::stay_in_sight(const Ground& ground) {
    const RayAnswer wall = ground.ray(target_world_, eye_world_);
    if (wall.status != QueryStatus::ok) return;
    const Eigen::Vector3d along = eye_world_ - target_world_;
    const double free = wall.fraction * along.norm();
    const double wanted = std::max(kLeastSight * free, free - kWallClearance);
    eye_world_ = target_world_ + wanted / along.norm() * along;
}

void ChaseCamera::follow(const Pose& pose_world, double dt, const Ground& ground) {
    const Eigen::Vector3d ahead(pose_world.rotation(0, 0), pose_world.rotation(1, 0), 0.0);
    heading_ += lag(dt, kTurnTime) * (ahead - heading_);
    const WorldPos before = eye_world_;
    const WorldPos wanted = wanted_eye(pose_world, &ground);
    eye_world_.x() = wanted.x();
    eye_world_.y() = wanted.y();
    eye_world_.z() += lag(dt, kHeightTime) * (wanted.z() - eye_world_.z());
    eye_world_.z() =
        std::max(eye_world_.z(),
                 floor_at(eye_world_.x(), eye_world_.y(), pose_world, &ground) + kLeastClearance);

    const WorldPos target =
        pose_world.translation + Eigen::Vector3d(0.0, 0.0, settings_.target_above);
    target_world_.x() = target.x();
    target_world_.y() = target.y();
    target_world_.z() += lag(dt, kHeightTime) * (target.z() - target_world_.z());
    if (ground.has_solids()) stay_in_sight(ground);
    velocity_ = (eye_world_ - before) / dt;
}

View ChaseCamera::view(const View& view) const {
    return look_towards(view, eye_world_, target_world_);
}

namespace {

constexpr double kSpreads = 1.5;           // camera distance, relative to the bodies' spread
constexpr double kNearest = 4.0;           // least camera distance, metres
constexpr double kRise = 0.5;              // height above the target, relative to the distance
constexpr double kCameraClearance = 0.25;  // wanted height above ground, relative to the distance
constexpr double kClearanceShare = 0.05;   // least height above ground, relative to the distance
constexpr double kTurn = 0.08;             // angular velocity around the target, rad/s
constexpr double kLag = 0.7;               // time constant of the camera, seconds

// Mean position of the bodies that have not left the world, or of all bodies if all have left it.
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
    eye_world_ = clear_of_ground(before + share * (wanted - before), kClearanceShare);
    velocity_ = (eye_world_ - before) / dt;
}

View DropCamera::view(const View& view) const {
    return look_towards(view, eye_world_, target_world_);
}

}  // namespace terrane::tools
