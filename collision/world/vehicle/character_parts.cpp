// SPDX-License-Identifier: MIT
//
// Characters: contacts, steps, drive.
#include "world/vehicle/character_parts.h"

#include "world/solver/body_checks.h"

#include <terrane/collision/query.h>
#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane::internal {

// Contacts of a character, and its moves onto steps.

namespace {

/// A supporting contact may have a gap of up to the rest gap plus this, in tolerances.
constexpr double kStandingGap = 1.0 / 8.0;
constexpr std::size_t kMaxContactsOfBody = 24;
constexpr std::size_t kMaxBodies = 32;  // touched at once

QueryFilter filter_of(const RigidBody& body, BodyId self) {
    return {.layers = body.filter.collides_with,
            .except = self,
            .include_sensors = false,
            .include_ground = false};
}

}  // namespace

/// Finds the contacts with ground and bodies at the current pose.
void Character::find_contacts(const RigidBody& body, const Scene& scene) {
    contacts_.clear();
    GroundContactCache& below = gate_.contacts();
    below.invalidate();
    below.update(body, *scene.query.ground);
    if (!below.is_resident()) return;
    for (std::size_t i = 0; i < below.count(); ++i) {
        contacts_.push_back({below.contact(i, body, 0), BodyId::kNone});
    }
    const double margin = kContactMargin * body.tolerance;
    const Capsule wider{settings_.radius + margin, settings_.half_height};
    std::array<BodyId, kMaxBodies> near;
    const OverlapQueryAnswer answer =
        query_overlaps(scene.query, wider, body.pose, filter_of(body, scene.self), near);
    std::array<PairContact, kMaxContactsOfBody> found;
    for (std::size_t i = 0; i < answer.count; ++i) {
        const QueryBody& other = scene.query.bodies[near[i].index];
        const PairContactAnswer contacts = terrane::find_contacts(
            *body.shape, body.pose, *other.shape, other.world_from_shape, margin, found);
        for (std::size_t k = 0; k < contacts.count; ++k) {
            SolverContact contact;
            contact.point_a = found[k].point_world;
            contact.normal = found[k].normal;
            contact.rounding = settings_.radius;
            contact.gap = -found[k].depth;
            contact.rest_gap = kRestGap * body.tolerance;
            contacts_.push_back({contact, near[i].index});
        }
    }
}

/// Largest gap of a supporting contact, metres.
double Character::standing_gap(const RigidBody& body) {
    return (kRestGap + kStandingGap) * body.tolerance;
}

/// The flattest supporting contact; null in the air.
const Character::FootContact* Character::find_support(const RigidBody& body) const {
    const FootContact* support = nullptr;
    for (const FootContact& each : contacts_) {
        const SolverContact& contact = each.contact;
        if (contact.normal.z() < feet_.least_cosine || contact.gap > standing_gap(body)) continue;
        if (support == nullptr || contact.normal.z() > support->contact.normal.z()) {
            support = &each;
        }
    }
    return support;
}

/// Whether a contact that is too steep to stand on lies ahead.
bool Character::is_blocked(const RigidBody& body, const Eigen::Vector3d& direction) const {
    return std::any_of(contacts_.begin(), contacts_.end(), [&](const FootContact& each) {
        const SolverContact& contact = each.contact;
        return contact.normal.z() < feet_.least_cosine && dot(contact.normal, direction) < 0.0 &&
               contact.gap <= standing_gap(body);
    });
}

/// Moves the capsule by a displacement, or until a body or the ground stops it.
MoveAnswer Character::move(RigidBody& body, const Scene& scene,
                           const Eigen::Vector3d& displacement) {
    const Motion motion{body.pose, displacement, Eigen::Vector3d::Zero()};
    const CastQueryAnswer met =
        query_cast(scene.query, *body.shape, motion, filter_of(body, scene.self));
    const double fraction = met.hit ? met.fraction : 1.0;
    gate_.contacts().invalidate();
    MoveAnswer answer =
        gate_.move(body, *scene.query.ground, {fraction * displacement, Eigen::Vector3d::Zero()});
    answer.fraction *= fraction;
    return answer;
}

/// Finds the height of a step up onto a higher surface that the character can stand on; false if there is none. The
/// body is left in place.
bool Character::find_step(RigidBody& body, const Scene& scene, const Eigen::Vector3d& forward) {
    const BodyMotion before = body;
    const Eigen::Vector3d up(0.0, 0.0, settings_.max_step);
    const double highest = before.pose.translation.z() - settings_.radius - settings_.half_height +
                           settings_.max_step + body.tolerance;
    const double rise = move(body, scene, up).fraction;
    move(body, scene, forward);
    find_contacts(body, scene);
    // If the lower cap hit an edge, moves back until the cylindrical side is flush with the edge, then steps down.
    double back = 0.0;
    for (const FootContact& each : contacts_) {
        const Eigen::Vector3d& n = each.contact.normal;
        if (dot(n, forward) >= 0.0) continue;
        const double level = std::sqrt(n.x() * n.x() + n.y() * n.y());
        back = std::max(back, settings_.radius * (1.0 - level) + body.tolerance);
    }
    if (back > 0.0) move(body, scene, forward * (-back / length(forward)));
    const double fall = move(body, scene, -rise * up).fraction;
    find_contacts(body, scene);
    const bool is_higher = body.pose.translation.z() > before.pose.translation.z() + body.tolerance;
    const FootContact* const support = find_support(body);
    const bool could =
        fall < 1.0 && is_higher && support != nullptr && support->contact.point_a.z() <= highest;
    if (could) step_height_ = body.pose.translation.z();
    static_cast<BodyMotion&>(body) = before;
    return could;
}

// A character is a dynamic capsule with locked rotation. At supporting contacts, friction acts like a conveyor belt: it
// drives the character towards the commanded velocity with a force of at most settings_.strength, so that characters
// push and are pushed like any body. All other contacts are frictionless. If a steep contact stops a standing
// character, find_step() moves it up by max_step, forward and down again as a test. If it can stand there, the
// character moves up and then forward.

namespace {

constexpr double kClimb = 2.0;  // ratio of the speed up a step to the forward speed
/// A character that moves less than this share of the commanded distance is stopped.
constexpr double kStoppedShare = 0.9;
/// Ratio of foot friction to surface friction: with the default friction, feet hold on slopes of 60 degrees.
constexpr double kFootGrip = 3.0;
constexpr double kDefaultFriction = SurfaceProperties{}.friction;

/// Cosine, bit-identical with any C library.
double cosine_of(double angle) {
    const Motion turn{{}, Eigen::Vector3d::Zero(), Eigen::Vector3d(angle, 0.0, 0.0)};
    return turn.at(1.0).rotation(1, 1);
}

bool is_good(const CharacterControls& controls) {
    constexpr double kMaxControl = 1e4;  // metres per second
    return std::abs(controls.velocity.x()) <= kMaxControl &&
           std::abs(controls.velocity.y()) <= kMaxControl && controls.jump_speed >= 0.0 &&
           controls.jump_speed <= kMaxControl;
}

}  // namespace

Result<void> check_character(const CharacterSettings& s) {
    const FieldRange fields[] = {
        {"radius", s.radius, 1e-3, 1e3, "m"},
        {"half_height", s.half_height, 0.0, 1e3, "m"},
        {"mass", s.mass, 1e-3, 1e9, "kg"},
        {"max_slope", s.max_slope, 0.0, 1.57, "rad"},
        {"max_step", s.max_step, 0.0, 1e3, "m"},
        {"strength", s.strength, 0.0, 1e12, "N"},
        {"air_acceleration", s.air_acceleration, 0.0, 1e6, "m/s^2"},
        {"contact_tolerance", s.contact_tolerance, 0.0, 1e3, "m"},
    };
    return check_fields(fields);
}

Character::Character(const CharacterSettings& settings) : settings_(settings) {
    feet_.least_cosine = cosine_of(settings.max_slope);
    feet_.max_force = settings.strength;
}

bool Character::set_controls(const CharacterControls& controls) {
    if (!is_good(controls)) return false;
    const bool changes =
        controls.velocity != controls_.velocity || controls.jump_speed != controls_.jump_speed;
    controls_ = controls;
    return changes;
}

void Character::place(const BodyState& body) {
    state_ = {};
    state_.body = body;
    is_stepping_up_ = false;
    gate_ = {};
}

/// The commanded velocity without its components into contacts too steep to climb. Dynamic bodies are pushed instead.
Eigen::Vector2d Character::velocity_along_walls(const RigidBody& body, const Scene& scene) const {
    double x = controls_.velocity.x(), y = controls_.velocity.y();
    for (const FootContact& wall : contacts_) {
        const SolverContact& contact = wall.contact;
        if (contact.normal.z() >= feet_.least_cosine || contact.gap > standing_gap(body) ||
            (wall.body != BodyId::kNone && is_dynamic(scene.bodies[wall.body]))) {
            continue;
        }
        const double nx = contact.normal.x(), ny = contact.normal.y();
        const double into = (x * nx + y * ny) / (nx * nx + ny * ny);
        if (!(into < 0.0)) continue;
        x -= into * nx;
        y -= into * ny;
    }
    return {x, y};
}

double Character::foot_friction(const FootContact& support, const Scene& scene) const {
    if (support.body != BodyId::kNone) return kFootGrip * scene.bodies[support.body].friction;
    const WorldPos& point = support.contact.point_a;
    const auto surface = scene.query.ground->surface(point.x(), point.y());
    return kFootGrip * (surface ? surface->friction : kDefaultFriction);
}

void Character::begin_collision_step(RigidBody& body, const Scene& scene, double duration) {
    body.acceleration = acceleration_;
    find_contacts(body, scene);
    const FootContact* const support = find_support(body);
    const bool stands = support != nullptr || is_stepping_up_;
    const bool jumps = controls_.jump_speed > 0.0 && stands;
    const Eigen::Vector2d wanted = velocity_along_walls(body, scene);
    Eigen::Vector3d& velocity = body.velocity.linear;
    state_.stands = stands && !jumps;
    state_.support = {};
    state_.normal = Eigen::Vector3d::UnitZ();
    feet_.velocity = {wanted.x(), wanted.y(), 0.0};
    feet_.standing_gap = -1.0;  // no contact supports
    is_stepping_up_ = is_stepping_up_ && !jumps;
    if (jumps) {
        velocity.z() = std::max(velocity.z(), 0.0) + controls_.jump_speed;
    } else if (is_stepping_up_) {
        velocity = feet_.velocity;
        body.acceleration.setZero();
    } else if (support != nullptr) {
        state_.normal = support->contact.normal;
        if (support->body != BodyId::kNone) {
            state_.support = scene.query.bodies[support->body].id;
        }
        feet_.friction = foot_friction(*support, scene);
        feet_.standing_gap = standing_gap(body);
        feet_.contact_count = 0;
        for (const FootContact& each : contacts_) {
            feet_.contact_count += feet_.stands_on(each.contact, 1.0) ? 1 : 0;
        }
    } else {
        const double dx = wanted.x() - velocity.x(), dy = wanted.y() - velocity.y();
        const double size = std::sqrt(dx * dx + dy * dy);
        const double most = settings_.air_acceleration * duration;
        const double share = is_idle() ? 0.0 : size > most ? most / size : 1.0;
        velocity.x() += share * dx;
        velocity.y() += share * dy;
    }
}

bool Character::is_stopped(const RigidBody& body, const WorldPos& before, double duration) const {
    const Eigen::Vector3d wanted(controls_.velocity.x(), controls_.velocity.y(), 0.0);
    const Eigen::Vector3d gone = body.pose.translation - before;
    return state_.stands && !wanted.isZero(0.0) &&
           (is_stepping_up_ || dot(gone, wanted) < kStoppedShare * dot(wanted, wanted) * duration);
}

void Character::end_collision_step(RigidBody& body, const Scene& scene, const WorldPos& before,
                                   double duration) {
    const Eigen::Vector3d wanted(controls_.velocity.x(), controls_.velocity.y(), 0.0);
    const double speed = length(wanted);
    const Eigen::Vector3d gone = body.pose.translation - before;
    if (!is_stepping_up_) {
        find_contacts(body, scene);
        if (!is_blocked(body, wanted)) return;
        const Eigen::Vector3d ahead = (2.0 * settings_.radius / speed) * wanted;
        if (!find_step(body, scene, ahead)) return;
    }
    // Moves up, faster than the forward speed, then forward.
    const Eigen::Vector3d on = wanted * duration - gone;
    const double height = body.pose.translation.z();
    const double missing = std::max(0.0, step_height_ - height);
    move(body, scene, {0.0, 0.0, std::min(missing, kClimb * speed * duration)});
    move(body, scene, on);
    body.velocity.linear = wanted;
    const double reached = body.pose.translation.z();
    is_stepping_up_ = reached > height && reached < step_height_ - body.tolerance;
}

}  // namespace terrane::internal
