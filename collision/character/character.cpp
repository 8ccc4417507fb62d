// SPDX-License-Identifier: MIT
//
// A character is a dynamic capsule that does not turn. On what it stands on, friction drives it to the wanted velocity
// with at most its strength, as a belt does, so that it pushes and is pushed like any body; at all other contacts it is
// without friction. A standing character that is stopped tests a step from max_step higher up; where it could stand
// there it moves up and on.
#include "bodies/body_checks.h"
#include "character/character_parts.h"

#include <terrane/collision/motion.h>

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr double kClimb = 2.0;  // speed up steps over the speed on
/// A character that moves less than this share of the wanted distance is stopped.
constexpr double kStoppedShare = 0.9;
/// Friction of feet over that of the surface they stand on: on a surface of the default friction they hold on slopes of
/// 60 degrees.
constexpr double kFootGrip = 3.0;
constexpr double kDefaultFriction = SurfaceProperties{}.friction;

/// Cosine with the same bits on every C library.
double cosine_of(double angle) {
    const Motion turn{{}, Eigen::Vector3d::Zero(), Eigen::Vector3d(angle, 0.0, 0.0)};
    return turn.at(1.0).rotation(1, 1);
}

bool is_good(const CharacterControls& controls) {
    constexpr double kMaxControl = 1e4;  // metres a second
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
    cache_ = {};
}

/// The wanted velocity without its components into contacts that are too steep to climb. Bodies that move are pushed.
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
    feet_.standing_gap = -1.0;  // of no contact
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
    // Up faster than it would have gone on, then on.
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
