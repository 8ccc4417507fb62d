// SPDX-License-Identifier: MIT
#include "commands/travellers.h"

#include "scene/scene_bodies.h"

#include <terrane/collision/ground_queries.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace terrane::tools {
namespace {

int wheels_in_contact(const VehicleState& state) {
    return static_cast<int>(
        std::count_if(state.wheels.begin(), state.wheels.end(),
                      [](const WheelState& wheel) { return wheel.in_contact; }));
}

double tilt_deg(const VehicleState& state) {
    const double up = std::clamp(state.chassis.pose.rotation(2, 2), -1.0, 1.0);
    return std::acos(up) * 180.0 / std::numbers::pi;
}

}  // namespace

std::vector<std::string> vehicle_columns() { return {"wheels_on_ground", "tilt_deg"}; }

std::vector<double> vehicle_figures(const VehicleState& vehicle) {
    return {static_cast<double>(wheels_in_contact(vehicle)), tilt_deg(vehicle)};
}

std::vector<std::string> character_columns() { return {"stands"}; }

std::vector<double> character_figures(const CharacterState& character) {
    return {character.stands ? 1.0 : 0.0};
}

CameraPathSettings ground_limits(const VehicleSettings& settings) {
    constexpr double kLeastBump = 0.05, kLeastReach = 0.5;  // metres
    constexpr double kShare = 0.8;
    constexpr double kGravity = 9.81;  // m/s^2
    double track = 0.0, front = settings.axles.front().position, rear = front;
    for (const AxleSettings& axle : settings.axles) {
        track = std::max(track, axle.track);
        front = std::max(front, axle.position);
        rear = std::min(rear, axle.position);
    }
    const double stability = 0.5 * track / settings.centre_of_mass_height;
    const double engine = settings.max_drive_force / (settings.mass * kGravity);
    const double clearance = settings.centre_of_mass_height - settings.chassis_half_extents.z();
    return {
        .max_slope =
            kShare * std::min({settings.tyre_friction * settings.side_grip, engine, stability}),
        .max_bump = std::max(kLeastBump, kShare * std::min(clearance, settings.suspension_travel)),
        .bump_reach = std::max(kLeastReach, 0.5 * (front - rear))};
}

VehicleTraveller::VehicleTraveller(const VehicleSettings& settings, PathDriver driver,
                                   OnRoll on_roll, const HeightSource& source,
                                   const Eigen::Vector2d& start_world,
                                   const Eigen::Vector2d& along_world)
    : settings_(settings),
      driver_(std::move(driver)),
      on_roll_(on_roll),
      source_(source),
      start_(slope_pose(source, start_world, along_world, settings)) {}

BodyNeed VehicleTraveller::first_need() const {
    return {.centre_world = start_.translation,
            .radius = settings_.chassis_half_extents.norm() + settings_.centre_of_mass_height +
                      settings_.suspension_travel};
}

Pose VehicleTraveller::pose(const World& world) const {
    return world.contains(body_) ? state(world).chassis.pose : start_;
}

Result<BodyId> VehicleTraveller::enter(World& world, const Ground& ground, const World& obstacles) {
    TERRANE_TRY(const Pose pose, pose_on_ground(settings_, start_, ground));
    TERRANE_TRY(const BodyId added, world.add_vehicle(settings_, pose));
    if (!is_free(obstacles, ground, world.settings(added).shape, pose)) {
        return fail(ErrorCode::invalid_argument,
                    fmt::format("a body of the scene is at x {:.6g} m, y {:.6g} m, where the "
                                "vehicle starts",
                                pose.translation.x(), pose.translation.y()));
    }
    body_ = added;
    return body_;
}

RunAction VehicleTraveller::control(World& world, bool goes, double dt) {
    const VehicleControls controls =
        goes ? driver_.drive(settings_, state(world), dt) : VehicleControls{.brake = 1.0};
    const RunAction action = DriveVehicle{body_, controls};
    // the id of the body and its controls are valid: the call cannot fail
    (void)apply(action, world);
    return action;
}

bool VehicleTraveller::react(World& world, const Ground& ground, double) {
    if (ruts_ != nullptr) ruts_->roll(state(world), settings_.wheel_radius, ground);
    if (!state(world).is_rolled_over) return false;
    has_rolled_over_ = true;
    if (on_roll_ == OnRoll::stop) return false;
    const Pose& pose = state(world).chassis.pose;
    Eigen::Vector2d along = pose.rotation.col(0).head<2>();
    if (along.norm() < 1e-3) along = Eigen::Vector2d::UnitX();  // the nose or tail is up
    const Pose upright = slope_pose(source_, pose.translation.head<2>(), along, settings_);
    const Result<Pose> placed = pose_on_ground(settings_, upright, ground);
    BodyState state;
    if (placed) state.pose = *placed;
    const bool is_righted = placed && world.teleport(body_, state);
    if (is_righted) ++rights_;
    return is_righted;
}

bool VehicleTraveller::change_ground(World& world, Pager& pager) {
    if (ruts_ == nullptr) return false;
    const Aabb changed = ruts_->update(pager);
    world.wake(changed);
    return changed.low.x() <= changed.high.x();
}

std::span<const GroundEdit> VehicleTraveller::ground_edits() const {
    return ruts_ != nullptr ? ruts_->edits_in_force() : std::span<const GroundEdit>();
}

bool VehicleTraveller::has_ended(const World& world) const {
    return (has_rolled_over_ && on_roll_ == OnRoll::stop) ||
           (driver_.is_finished() && state(world).chassis.velocity.norm() < 0.1);
}

PathProgress VehicleTraveller::progress() const {
    return {driver_.is_finished(), driver_.path_share(), driver_.stuck_time(),
            driver_.stuck_place_world()};
}

bool VehicleTraveller::is_supported(const World& world) const {
    return wheels_in_contact(state(world)) > 0;
}

void VehicleTraveller::add_supports(const World& world, std::vector<BodyId>& bodies) const {
    for (const WheelState& wheel : state(world).wheels) {
        if (wheel.in_contact && wheel.body.is_valid()) bodies.push_back(wheel.body);
    }
}

std::vector<double> VehicleTraveller::figures(const World& world) const {
    return vehicle_figures(state(world));
}

Result<void> VehicleTraveller::show(const World& world, BodyNodes& nodes) const {
    return nodes.show(settings_, state(world));
}

namespace {

constexpr double kAhead = 2.0;   // metres of path from the nearest point to the point walked to
constexpr double kSearch = 6.0;  // metres of path ahead that are searched for the nearest point
constexpr double kSearchStep = 0.25;     // metres
constexpr double kNear = 1.0;            // metres from the end that count as arrived
constexpr double kStuckTime = 1.0;       // seconds without progress before a detour
constexpr double kFirstDetour = 1.0;     // seconds
constexpr double kLongestDetour = 20.0;  // seconds
constexpr double kPassed = 3.0;          // metres beyond an obstacle that count as past it
constexpr double kDetourTurn = 1.6;      // radians off the path, away from the obstacle
constexpr double kClearance = 0.02;      // metres above the ground at the start

Capsule capsule_of(const CharacterSettings& settings) {
    return {.radius = settings.radius, .half_height = settings.half_height};
}

Eigen::Vector2d turned(const Eigen::Vector2d& v, double angle) {
    return {std::cos(angle) * v.x() - std::sin(angle) * v.y(),
            std::sin(angle) * v.x() + std::cos(angle) * v.y()};
}

}  // namespace

CharacterTraveller::CharacterTraveller(const CharacterSettings& settings, Polyline path,
                                       double speed, const HeightSource& source)
    : settings_(settings), path_(std::move(path)), speed_(speed) {
    gait_.heading = path_.direction(0.0);
    const Eigen::Vector2d p = path_.at(0.0);
    start_ = {p.x(), p.y(), source.height(p.x(), p.y()) + settings.radius + settings.half_height};
}

BodyNeed CharacterTraveller::first_need() const {
    return {.centre_world = start_, .radius = bounding_radius(Shape(capsule_of(settings_)))};
}

Pose CharacterTraveller::pose(const World& world) const {
    return gait_.world_from_capsule(world.contains(body_) ? state(world).body.pose.translation
                                                          : start_);
}

Result<BodyId> CharacterTraveller::enter(World& world, const Ground& ground,
                                         const World& obstacles) {
    Pose at;
    at.translation = start_;
    const Shape shape = capsule_of(settings_);
    const LiftAnswer lift = compute_lift(shape, at, ground);
    if (lift.status != QueryStatus::ok) {
        return fail(ErrorCode::invalid_argument,
                    fmt::format("the ground at x {:.6g} m, y {:.6g} m, where the character "
                                "starts, is not loaded",
                                start_.x(), start_.y()));
    }
    if (std::isfinite(lift.lift)) at.translation.z() += lift.lift + kClearance;
    if (!is_free(obstacles, ground, shape, at)) {
        return fail(ErrorCode::invalid_argument,
                    fmt::format("a body of the scene is at x {:.6g} m, y {:.6g} m, where the "
                                "character starts",
                                start_.x(), start_.y()));
    }
    const Result<BodyId> added = world.add_character(settings_, at.translation);
    if (added) body_ = *added;
    return added;
}

Eigen::Vector2d CharacterTraveller::wanted_direction(const Eigen::Vector2d& here) const {
    const Eigen::Vector2d way = path_.at(along_ + kAhead) - here;
    const Eigen::Vector2d direction =
        way.norm() > 1e-3 ? way.normalized() : path_.direction(along_);
    return detour_time_ > 0.0 ? turned(direction, detour_side_ * kDetourTurn) : direction;
}

RunAction CharacterTraveller::control(World& world, bool goes, double) {
    controls_ = {};
    if (goes && !has_arrived()) {
        controls_.velocity =
            speed_ * wanted_direction(state(world).body.pose.translation.head<2>());
    }
    const RunAction action = WalkCharacter{body_, controls_};
    // the id of the body and its controls are valid: the call cannot fail
    (void)apply(action, world);
    return action;
}

bool CharacterTraveller::react(World& world, const Ground&, double dt) {
    gait_.follow(state(world), controls_, dt);
    const Eigen::Vector2d here = state(world).body.pose.translation.head<2>();
    double nearest = along_;
    for (double ahead = along_; ahead <= along_ + kSearch; ahead += kSearchStep) {
        if ((path_.at(ahead) - here).norm() < (path_.at(nearest) - here).norm()) nearest = ahead;
    }
    const bool progresses = nearest > along_ || has_arrived();
    if (progresses && is_stuck()) total_stuck_time_ += still_time_;
    still_time_ = progresses ? 0.0 : still_time_ + dt;
    const bool waits = progresses || detour_time_ > 0.0;
    stuck_time_ = waits ? 0.0 : stuck_time_ + dt;
    along_ = std::min(nearest, path_.length());
    detour_time_ = std::max(0.0, detour_time_ - dt);
    if (along_ > stuck_along_ + kPassed) detour_length_ = 0.0;
    if (stuck_time_ > kStuckTime + kSearchStep / speed_ && detour_time_ == 0.0) {
        stuck_world_ = here;
        detour_length_ = std::min(std::max(kFirstDetour, 2.0 * detour_length_), kLongestDetour);
        detour_time_ = detour_length_;
        detour_side_ = -detour_side_;
        stuck_along_ = along_;
        stuck_time_ = 0.0;
    }
    return false;
}

bool CharacterTraveller::has_arrived() const { return along_ >= path_.length() - kNear; }

bool CharacterTraveller::is_stuck() const {
    return still_time_ > kStuckTime + kSearchStep / speed_;
}

PathProgress CharacterTraveller::progress() const {
    return {has_arrived(), has_arrived() ? 1.0 : along_ / path_.length(),
            total_stuck_time_ + (is_stuck() ? still_time_ : 0.0), stuck_world_};
}

bool CharacterTraveller::has_ended(const World& world) const {
    return has_arrived() && state(world).body.velocity.norm() < 0.1;
}

void CharacterTraveller::add_supports(const World& world, std::vector<BodyId>& bodies) const {
    if (state(world).support.is_valid()) bodies.push_back(state(world).support);
}

std::vector<double> CharacterTraveller::figures(const World& world) const {
    return character_figures(state(world));
}

Result<void> CharacterTraveller::show(const World& world, BodyNodes& nodes) const {
    const double speed = state(world).body.velocity.head<2>().norm();
    return nodes.show(settings_, pose(world), gait_.walked, speed);
}

}  // namespace terrane::tools
