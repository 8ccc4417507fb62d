// SPDX-License-Identifier: MIT
#include "drive/character_traveller.h"

#include "world/body_objects.h"
#include "world/placed_body.h"

#include <terrane/collision/ground_contact.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kAhead = 2.0;   // metres from the nearest point to the one walked towards
constexpr double kSearch = 6.0;  // metres of path ahead that are searched for the nearest point
constexpr double kSearchStep = 0.25;     // metres
constexpr double kNear = 1.0;            // metres from the end that count as arrived
constexpr double kStuckTime = 1.0;       // seconds without progress before a detour
constexpr double kFirstDetour = 1.0;     // seconds
constexpr double kLongestDetour = 20.0;  // seconds
constexpr double kPassed = 3.0;          // metres beyond an obstacle that count as past it
constexpr double kDetourTurn = 1.6;      // radians off the path, so that it leaves what stops it
constexpr double kTurnTime = 0.3;        // time constant of the drawn heading, seconds
constexpr double kClearance = 0.02;      // metres above the ground at the start
constexpr Colour kCoat{0.20f, 0.35f, 0.65f};
constexpr Colour kFace{0.88f, 0.72f, 0.58f};

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
    : settings_(settings), path_(std::move(path)), speed_(speed), heading_(path_.direction(0.0)) {
    const Eigen::Vector2d p = path_.at(0.0);
    start_ = {p.x(), p.y(), source.height(p.x(), p.y()) + settings.radius + settings.half_height};
}

BodyNeed CharacterTraveller::first_need() const {
    return {.centre_world = start_, .radius = bounding_radius(Shape(capsule_of(settings_)))};
}

Pose CharacterTraveller::pose(const World& world) const {
    Pose pose;
    pose.translation = world.contains(body_) ? state(world).body.pose.translation : start_;
    pose.rotation << heading_.x(), -heading_.y(), 0.0,  //
        heading_.y(), heading_.x(), 0.0,                //
        0.0, 0.0, 1.0;
    return pose;
}

Result<BodyId> CharacterTraveller::enter(World& world, const Ground& ground,
                                         const World& obstacles) {
    Pose at;
    at.translation = start_;
    const Shape shape = capsule_of(settings_);
    const LiftAnswer lift = compute_lift(shape, at, ground);
    if (lift.status != QueryStatus::complete) {
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

void CharacterTraveller::control(World& world, bool goes) {
    CharacterControls controls;
    if (goes && !has_arrived()) {
        controls.velocity = speed_ * wanted_direction(state(world).body.pose.translation.head<2>());
    }
    // Ids and controls of its own are valid: nothing to report.
    (void)world.set_controls(body_, controls);
}

void CharacterTraveller::react(World& world, const Ground&, double dt) {
    const Eigen::Vector2d here = state(world).body.pose.translation.head<2>();
    double nearest = along_;
    for (double ahead = along_; ahead <= along_ + kSearch; ahead += kSearchStep) {
        if ((path_.at(ahead) - here).norm() < (path_.at(nearest) - here).norm()) nearest = ahead;
    }
    const bool waits = nearest > along_ || has_arrived() || detour_time_ > 0.0;
    stuck_time_ = waits ? 0.0 : stuck_time_ + dt;
    along_ = std::min(nearest, path_.length());
    detour_time_ = std::max(0.0, detour_time_ - dt);
    if (along_ > stuck_along_ + kPassed) detour_length_ = 0.0;
    if (stuck_time_ > kStuckTime + kSearchStep / speed_ && detour_time_ == 0.0) {
        detour_length_ = std::min(std::max(kFirstDetour, 2.0 * detour_length_), kLongestDetour);
        detour_time_ = detour_length_;
        detour_side_ = -detour_side_;
        stuck_along_ = along_;
        stuck_time_ = 0.0;
    }
    heading_ += dt / (dt + kTurnTime) * (wanted_direction(here) - heading_);
    heading_ =
        heading_.norm() > 1e-3 ? Eigen::Vector2d(heading_.normalized()) : path_.direction(along_);
}

bool CharacterTraveller::has_arrived() const { return along_ >= path_.length() - kNear; }

bool CharacterTraveller::has_ended(const World& world) const {
    return has_arrived() && state(world).body.velocity.norm() < 0.1;
}

void CharacterTraveller::add_supports(const World& world, std::vector<BodyId>& bodies) const {
    if (state(world).support.is_valid()) bodies.push_back(state(world).support);
}

std::vector<double> CharacterTraveller::figures(const World& world) const {
    return {state(world).stands ? 1.0 : 0.0};
}

void CharacterTraveller::draw(const World& world, std::vector<DrawnObject>& objects) const {
    const Pose at = pose(world);
    add_objects(Shape(capsule_of(settings_)), at, kCoat, objects);
    const double r = settings_.radius;
    objects.push_back({DrawnObject::Form::ball,
                       {at.rotation, at * Eigen::Vector3d(0.35 * r, 0.0, settings_.half_height)},
                       Eigen::Vector3d(0.8 * r, 0.7 * r, 0.7 * r),
                       kFace});
}

}  // namespace terrane::tools
