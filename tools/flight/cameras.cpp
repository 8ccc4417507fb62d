// SPDX-License-Identifier: MIT
#include "flight/cameras.h"

#include <terrane/collision/query.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kLeastClearance = 0.6;  // least height above the ground, metres
constexpr double kCalmClearance = 2.0;   // wanted height above the ground, metres
constexpr double kCrestClearance = 0.8;  // of the line of sight above the ground, metres
constexpr double kSteepest = 1.0;        // largest slope of the line of sight over a crest
constexpr double kTurnTime = 0.6;        // time constant of the heading, seconds
constexpr double kHeightTime = 0.25;     // time constant of heights, seconds
constexpr double kMotionTime = 0.2;      // time constant of the target's velocity, seconds

constexpr double kProbeRadius = 0.35;        // of the sphere cast along the line of sight, metres
constexpr double kLeastDistance = 2.5;       // least distance of eye and target, metres
constexpr double kLookAhead[] = {0.4, 0.8};  // seconds
constexpr double kApproachRate = 50.0;       // largest acceleration along the line of sight, m/s^2
constexpr double kReturnRate = 5.0;          // the same while the eye moves away, m/s^2
constexpr double kReturnSpeed = 3.0;         // m/s

// Copies the numbers of a camera's state to an array, or back, in the order of visit_state().
struct StateWriter {
    double*& next;
    void operator()(double value) const { *next++ = value; }
    void operator()(const Eigen::Vector3d& v) const {
        for (int axis = 0; axis < 3; ++axis) *next++ = v[axis];
    }
};
struct StateReader {
    const double*& next;
    void operator()(double& value) const { value = *next++; }
    void operator()(Eigen::Vector3d& v) const {
        for (int axis = 0; axis < 3; ++axis) v[axis] = *next++;
    }
};

// Blend factor of a first-order lag (implicit Euler): stable for any dt.
double lag(double dt, double time) { return dt / (dt + time); }

}  // namespace

ChaseCamera::ChaseCamera(const HeightSource& source, const Pose& pose_world,
                         const ChaseCameraSettings& settings)
    : source_(&source), settings_(settings), place_world_(pose_world.translation) {
    heading_ = Eigen::Vector3d(pose_world.rotation(0, 0), pose_world.rotation(1, 0), 0.0);
    if (heading_.norm() > 1e-3) heading_.normalize();
    free_eye_world_ = wanted_eye(pose_world, heading_, nullptr);
    eye_world_ = free_eye_world_;
    target_world_ = target_of(pose_world);
}

// Height of the ground that the camera must stay above: the heightfield or, if the target is in a cave, its floor.
double ChaseCamera::floor_at(double x, double y, const Pose& pose_world, const Ground* ground) {
    const double height = source_->height(x, y);
    if (ground == nullptr || !ground->has_solids()) return height;
    const double top = pose_world.translation.z() + settings_.above;
    const HeightAnswer below = ground->height_below(x, y, top);
    is_complete_ = is_complete_ && below.status != QueryStatus::not_resident;
    return below.status == QueryStatus::ok ? below.height : std::min(height, top);
}

WorldPos ChaseCamera::target_of(const Pose& pose_world) const {
    return pose_world.translation + Eigen::Vector3d(0.0, 0.0, settings_.target_above);
}

// The eye that sees the target over the ground between them.
WorldPos ChaseCamera::wanted_eye(const Pose& pose_world, const Eigen::Vector3d& heading,
                                 const Ground* ground) {
    const double cosine = std::cos(settings_.bearing), sine = std::sin(settings_.bearing);
    const Eigen::Vector3d towards(cosine * heading.x() + sine * heading.y(),
                                  cosine * heading.y() - sine * heading.x(), 0.0);
    WorldPos eye = pose_world.translation - settings_.behind * towards;
    const double clearance = std::clamp(settings_.above, kLeastClearance, kCalmClearance);
    eye.z() = std::max(pose_world.translation.z() + settings_.above,
                       floor_at(eye.x(), eye.y(), pose_world, ground) + clearance);
    const WorldPos target = target_of(pose_world);
    const double highest = target.z() + kSteepest * settings_.behind;
    for (const double share : {0.25, 0.4, 0.55, 0.7, 0.85}) {
        const WorldPos between = target + share * (eye - target);
        const double floor = floor_at(between.x(), between.y(), pose_world, ground);
        const double needed = target.z() + (floor + kCrestClearance - target.z()) / share;
        eye.z() = std::max(eye.z(), std::min(needed, highest));
    }
    return eye;
}

// Distance by which the eye must come nearer, so that nothing is between it and the target now and soon, metres.
double ChaseCamera::wanted_approach(const Pose& pose_world, const Eigen::Vector3d& ahead,
                                    const Ground& ground, const World& world, BodyId own) {
    const QueryFilter filter{.except = own};
    const auto hidden_share = [&](const WorldPos& target, const WorldPos& eye) {
        Motion motion;
        motion.start.translation = target;
        motion.translation = eye - target;
        const CastQueryAnswer met = world.cast(ground, Sphere{kProbeRadius}, motion, filter);
        is_complete_ = is_complete_ && met.status != QueryStatus::not_resident;
        return met.hit ? 1.0 - met.fraction : 0.0;
    };
    double share = hidden_share(target_world_, free_eye_world_);
    for (const double time : kLookAhead) {
        Pose later = pose_world;
        later.translation += time * motion_;
        const Eigen::Vector3d heading =
            heading_ + (1.0 - std::exp(-time / kTurnTime)) * (ahead - heading_);
        share =
            std::max(share, hidden_share(target_of(later), wanted_eye(later, heading, &ground)));
    }
    const double distance = (free_eye_world_ - target_world_).norm();
    return std::clamp(share * distance, 0.0, std::max(distance - kLeastDistance, 0.0));
}

void ChaseCamera::follow(const Pose& pose_world, double dt, const Ground& ground,
                         const World& world, BodyId own) {
    const Eigen::Vector3d ahead(pose_world.rotation(0, 0), pose_world.rotation(1, 0), 0.0);
    heading_ += lag(dt, kTurnTime) * (ahead - heading_);
    const Eigen::Vector3d moved = (pose_world.translation - place_world_) / dt;
    motion_ += lag(dt, kMotionTime) * (moved - motion_);
    place_world_ = pose_world.translation;
    is_complete_ = true;

    const WorldPos before = eye_world_;
    const WorldPos wanted = wanted_eye(pose_world, heading_, &ground);
    const bool is_first = !std::exchange(is_following_, true);
    if (is_first) free_eye_world_.z() = wanted.z();
    free_eye_world_.x() = wanted.x();
    free_eye_world_.y() = wanted.y();
    free_eye_world_.z() += lag(dt, kHeightTime) * (wanted.z() - free_eye_world_.z());
    const WorldPos target = target_of(pose_world);
    target_world_.x() = target.x();
    target_world_.y() = target.y();
    target_world_.z() += lag(dt, kHeightTime) * (target.z() - target_world_.z());

    // The fastest speed from which the eye can stop at the wanted place, approached with bounded acceleration.
    const double approach = wanted_approach(pose_world, ahead, ground, world, own);
    if (is_first) approach_ = approach;
    const double missing = approach - approach_;
    const double rate = missing > 0.0 ? kApproachRate : kReturnRate;
    const double fastest = missing > 0.0
                               ? std::sqrt(2.0 * rate * missing)
                               : -std::min(std::sqrt(-2.0 * rate * missing), kReturnSpeed);
    const double largest = (missing > 0.0 || approach_speed_ > 0.0 ? kApproachRate : rate) * dt;
    approach_speed_ += std::clamp(fastest - approach_speed_, -largest, largest);
    approach_ += dt * approach_speed_;
    if (approach_ <= 0.0) approach_ = approach_speed_ = 0.0;

    const Eigen::Vector3d line = target_world_ - free_eye_world_;
    const double distance = line.norm();
    eye_world_ = free_eye_world_;
    if (approach_ > 0.0) eye_world_ += std::min(approach_ / distance, 1.0) * line;
    eye_world_.z() =
        std::max(eye_world_.z(),
                 floor_at(eye_world_.x(), eye_world_.y(), pose_world, &ground) + kLeastClearance);
    velocity_ = is_first ? moved : Eigen::Vector3d((eye_world_ - before) / dt);
}

BodyNeed ChaseCamera::need() const {
    const double distance = std::hypot(settings_.behind, settings_.above) +
                            std::abs(settings_.target_above) + kProbeRadius;
    const double seen_ahead = *std::max_element(std::begin(kLookAhead), std::end(kLookAhead));
    return {.centre_world = place_world_,
            .velocity = motion_,
            .radius = distance + seen_ahead * motion_.norm()};
}

template <class Camera, class Visit>
void ChaseCamera::visit_state(Camera& camera, const Visit& visit) {
    for (auto* v :
         {&camera.heading_, &camera.place_world_, &camera.motion_, &camera.free_eye_world_,
          &camera.eye_world_, &camera.target_world_, &camera.velocity_})
        visit(*v);
    visit(camera.approach_);
    visit(camera.approach_speed_);
}

CameraState<ChaseCamera::kStateSize> ChaseCamera::state() const {
    CameraState<kStateSize> state{};
    double* next = state.data();
    visit_state(*this, StateWriter{next});
    *next = is_following_ ? 1.0 : 0.0;
    return state;
}

void ChaseCamera::restore(const CameraState<kStateSize>& state) {
    const double* next = state.data();
    visit_state(*this, StateReader{next});
    is_following_ = *next != 0.0;
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

// Mean position and velocity of the bodies that move on the terrain, or of all if there are none.
struct Middle {
    WorldPos place = WorldPos::Zero();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // m/s
};
Middle find_middle(std::span<const BodyState> bodies) {
    const auto moves = [](const BodyState& body) {
        return body.condition != BodyCondition::left_world &&
               body.condition != BodyCondition::fixed && body.condition != BodyCondition::removed;
    };
    const bool is_any = std::ranges::any_of(bodies, moves);
    Middle middle;
    double count = 0.0;
    for (const BodyState& body : bodies) {
        if (is_any && !moves(body)) continue;
        middle.place += body.pose.translation;
        middle.velocity += body.velocity;
        ++count;
    }
    return {middle.place / count, middle.velocity / count};
}

}  // namespace

DropCamera::DropCamera(std::shared_ptr<const HeightSource> source,
                       std::span<const BodyState> bodies)
    : source_(std::move(source)), target_world_(find_middle(bodies).place) {
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
    // moves with the bodies, so that steady motion leaves no distance behind
    const Middle middle = find_middle(bodies);
    motion_ += share * (middle.velocity - motion_);
    target_world_ += dt * motion_;
    target_world_ += share * (middle.place - target_world_);
    const WorldPos before = eye_world_, moved = before + dt * motion_;
    const WorldPos wanted = find_eye();
    eye_world_ = clear_of_ground(moved + share * (wanted - moved), kClearanceShare);
    velocity_ = (eye_world_ - before) / dt;
}

template <class Camera, class Visit>
void DropCamera::visit_state(Camera& camera, const Visit& visit) {
    visit(camera.distance_);
    visit(camera.heading_);
    for (auto* v : {&camera.motion_, &camera.target_world_, &camera.eye_world_, &camera.velocity_})
        visit(*v);
}

CameraState<DropCamera::kStateSize> DropCamera::state() const {
    CameraState<kStateSize> state{};
    double* next = state.data();
    visit_state(*this, StateWriter{next});
    return state;
}

void DropCamera::restore(const CameraState<kStateSize>& state) {
    const double* next = state.data();
    visit_state(*this, StateReader{next});
}

View DropCamera::view(const View& view) const {
    return look_towards(view, eye_world_, target_world_);
}

}  // namespace terrane::tools
