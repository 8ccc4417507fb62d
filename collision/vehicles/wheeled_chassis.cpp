// SPDX-License-Identifier: MIT
//
// Sources:    Catto. Soft constraints. GDC 2011 (springs and dampers as implicit impulses).
//             Pacejka. Tire and vehicle dynamics. 2012, section 1.2 (the friction circle).
//             Wong. Theory of ground vehicles. 2008, chapter 3 (tractive effort limited by power, aerodynamic drag,
//             rolling resistance).
//             ISO 2533:1975 (density of the standard atmosphere at sea level).
// Deviations: tyres have no slip curve: inside the friction circle (an ellipse where side_grip < 1) they stick, on it
//             they slide.
#include "vehicles/wheeled_chassis.h"

#include "bodies/body_checks.h"
#include "bodies/step/body_depth.h"
#include "bodies/step/offset_surface.h"

#include <terrane/terrain/assert.h>

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr double kMaxSubstep =
    1.0 / 240.0;  // a hundredth of the period of the stiffest springs allowed
constexpr double kChassisFriction = 0.5;
constexpr double kAirDensity = 1.225;  // kg/m^3
/// Tilts from the vertical, as cosines, beyond which a vehicle has rolled over: 70 degrees; 45 degrees where no wheel
/// touches the ground.
constexpr double kOverturned = 0.3420201433256687;
constexpr double kOverturnedWithoutWheels = 0.7071067811865476;
/// Springs act along the ground's normal; their force does not grow where the cosine of its angle with the suspension
/// axis is below this.
constexpr double kLeastAlignment = 0.4;
constexpr int kTyreIterations = 40;
constexpr double kTwoPi = 6.283185307179586;

using Lever = ChassisLever;

Lever make_lever(const RigidBody& body, const Eigen::Vector3d& point_world,
                 const Eigen::Vector3d& direction) {
    Lever lever;
    lever.direction = direction;
    lever.moment = cross(point_world - body.pose.translation, direction);
    lever.spin =
        internal::apply_tensor(body.pose.rotation, body.mass.inverse_inertia, lever.moment);
    lever.effective_mass = 1.0 / (body.mass.inverse_mass + dot(lever.moment, lever.spin));
    return lever;
}

double speed(const Lever& lever, const Twist& velocity) {
    return dot(lever.direction, velocity.linear) + dot(lever.moment, velocity.angular);
}

void apply(RigidBody& body, const Lever& lever, double impulse) {
    body.velocity.linear += lever.direction * (impulse * body.mass.inverse_mass);
    body.velocity.angular += lever.spin * impulse;
}

}  // namespace

Result<void> check_settings(const ChassisSettings& s) {
    const FieldRange fields[] = {
        {"chassis_half_extents.x", s.half_extents.x(), 0.01, 1e3},
        {"chassis_half_extents.y", s.half_extents.y(), 0.01, 1e3},
        {"chassis_half_extents.z", s.half_extents.z(), 0.01, 1e3},
        {"mass", s.mass, 1e-3, 1e9},
        {"wheel_radius", s.wheel_radius, 0.01, 1e2},
        {"suspension_travel", s.suspension_travel, 0.001, 1e2},
        {"suspension_hertz", s.suspension_hertz, 0.1, 10.0},
        {"damping_ratio", s.damping_ratio, 0.0, 10.0},
        {"tyre_friction", s.tyre_friction, 0.0, 100.0},
        {"side_grip", s.side_grip, 0.01, 1.0},
        {"max_drive_power", s.max_drive_power, 0.0, 1e12},
        {"rolling_resistance", s.rolling_resistance, 0.0, 1.0},
        {"drag_area", s.drag_area, 0.0, 1e4},
    };
    return check_fields(fields);
}

WheeledChassis::WheeledChassis(const ChassisSettings& settings,
                               std::span<const Eigen::Vector3d> wheels_body, const BodyState& start)
    : settings_(settings), state_(start) {
    const Box box{settings.half_extents};
    const Sphere wheel{settings.wheel_radius};
    parts_.push_back({.shape = box});
    body_.radius = bounding_radius(box);
    for (const Eigen::Vector3d& place : wheels_body) {
        parts_.push_back({wheel, place});
        body_.radius = std::max(body_.radius, length(place) + settings.wheel_radius);
        wheels_.emplace_back().centre_world =
            start.pose.translation + rotated(start.pose.rotation, place);
    }
    wheels_before_ = wheels_;
    contacts_.resize(wheels_.size());
    contacts_before_ = contacts_;
    tyres_.resize(wheels_.size());
    body_.parts = parts_;
    body_.mass = make_mass_properties(box, settings.mass);
    body_.friction = kChassisFriction;
    body_.acceleration.z() = -kGravity;
    body_.tolerance = std::min(default_contact_tolerance(box), default_contact_tolerance(wheel));
    body_.pose = {orthonormalized(start.pose.rotation), start.pose.translation};
    body_.velocity = {start.velocity, start.angular_velocity};
}

BodyNeed WheeledChassis::need() const {
    return {body_.pose.translation, body_.velocity.linear,
            body_.radius + settings_.suspension_travel + body_.tolerance};
}

/// Casts the wheels from the top of their travel to its end. False where ground is not resident.
bool WheeledChassis::cast_wheels(const Ground& ground) {
    const double travel = settings_.suspension_travel;
    const Eigen::Vector3d axis = body_.pose.rotation.col(2);
    for (std::size_t i = 0; i < wheels_.size(); ++i) {
        const BodyPart& part = parts_[i + 1];
        Motion motion;
        motion.start.translation =
            body_.pose.translation + rotated(body_.pose.rotation, part.offset_body);
        motion.translation = -travel * axis;
        const CastAnswer answer = cast_part(part.shape, motion, ground, body_.tolerance);
        if (answer.status == QueryStatus::not_resident) return false;
        WheelContact& contact = contacts_[i];
        const double fraction = answer.hit ? answer.fraction : 1.0;
        contact.on_ground = answer.hit;
        contact.compression = travel * (1.0 - fraction);
        contact.centre_world = motion.start.translation + motion.translation * fraction;
        contact.normal = answer.contact.normal;
        contact.point_world = contact.centre_world - settings_.wheel_radius * contact.normal;
        contact.load_impulse = 0.0;
        contact.friction = settings_.tyre_friction;
        const auto surface = ground.surface(contact.point_world.x(), contact.point_world.y());
        if (surface) contact.friction = combined_friction(contact.friction, surface->friction);
    }
    return true;
}

/// Drag at the centre of mass, implicit in the speed: it never reverses the motion.
void WheeledChassis::apply_drag(double substep) {
    const double share = 0.5 * kAirDensity * settings_.drag_area * body_.mass.inverse_mass *
                         length(body_.velocity.linear) * substep;
    body_.velocity.linear /= 1.0 + share;
}

/// Springs and dampers, implicit: stable at any stiffness. All wheels use the same velocity, so that the result is
/// symmetric.
void WheeledChassis::apply_suspension(double substep) {
    const double share = settings_.mass / static_cast<double>(wheels_.size());
    const double omega = kTwoPi * settings_.suspension_hertz;
    const double stiffness = share * omega * omega;
    const double damping = 2.0 * settings_.damping_ratio * share * omega;
    const Eigen::Vector3d axis = body_.pose.rotation.col(2);
    const Twist velocity = body_.velocity;
    for (WheelContact& contact : contacts_) {
        if (!contact.on_ground) continue;
        const double alignment = dot(contact.normal, axis);
        if (!(alignment > 0.0)) continue;
        const double lean = std::max(alignment, kLeastAlignment);
        const Lever lever = make_lever(body_, contact.point_world, contact.normal);
        const double softness = substep * (stiffness * substep + damping) / (lean * lean);
        const double wanted =
            substep * stiffness * contact.compression / lean - softness * speed(lever, velocity);
        contact.load_impulse = std::max(0.0, wanted / (1.0 + softness / lever.effective_mass));
        apply(body_, lever, contact.load_impulse);
    }
}

/// Scales the drive impulses of a substep to the power limit: the difference between the tracks (turning) gets its
/// power first, the common part (driving) the remainder.
void WheeledChassis::limit_power(std::span<const WheelCommand> commands, double substep) {
    double drive = 0.0, turn = 0.0;  // watts that the commands ask for
    for (std::size_t i = 0; i < tyres_.size(); ++i) {
        if (!tyres_[i].grips) continue;
        const double roll_speed = speed(tyres_[i].roll, body_.velocity);
        drive += std::abs(commands[i].drive_force * roll_speed);
        turn += commands[i].turn_force * roll_speed;
    }
    const double power = settings_.max_drive_power;
    const double turn_share = turn > power ? power / turn : 1.0;
    const double left = std::max(0.0, power - turn_share * std::max(0.0, turn));
    const double drive_share = drive > left ? left / drive : 1.0;
    for (std::size_t i = 0; i < tyres_.size(); ++i) {
        tyres_[i].drive =
            (drive_share * commands[i].drive_force + turn_share * commands[i].turn_force) * substep;
    }
}

/// Drive, brakes and side forces, together within each tyre's friction circle.
void WheeledChassis::solve_tyres(std::span<const WheelCommand> commands, double substep) {
    for (std::size_t i = 0; i < wheels_.size(); ++i) {
        WheelContact& contact = contacts_[i];
        Tyre& tyre = tyres_[i];
        tyre = {};
        if (!contact.on_ground || contact.load_impulse <= 0.0) continue;
        const Motion steering{
            {}, Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.0, commands[i].steer)};
        const Eigen::Vector3d ahead =
            rotated(body_.pose.rotation, steering.at(1.0).rotation.col(0));
        const Eigen::Vector3d in_plane = ahead - contact.normal * dot(contact.normal, ahead);
        const double size = length(in_plane);
        if (size < 0.1) continue;  // the ground is a wall ahead: no rolling direction
        const Eigen::Vector3d roll = in_plane / size;
        tyre.roll = make_lever(body_, contact.point_world, roll);
        tyre.side = make_lever(body_, contact.point_world, cross(contact.normal, roll));
        tyre.limit = contact.friction * contact.load_impulse;
        tyre.brake_limit =
            commands[i].brake_force * substep + settings_.rolling_resistance * contact.load_impulse;
        tyre.grips = true;
    }
    limit_power(commands, substep);
    for (int iteration = 0; iteration < kTyreIterations; ++iteration) {
        for (Tyre& tyre : tyres_) {
            if (!tyre.grips) continue;
            tyre.brake_impulse = std::clamp(
                tyre.brake_impulse - tyre.roll.effective_mass * speed(tyre.roll, body_.velocity),
                -tyre.brake_limit, tyre.brake_limit);
            double roll = tyre.drive + tyre.brake_impulse;
            double side =
                tyre.side_impulse - tyre.side.effective_mass * speed(tyre.side, body_.velocity);
            const double across = side / settings_.side_grip;
            const double size = std::sqrt(roll * roll + across * across);
            if (size > tyre.limit && settings_.rolls_first) {
                roll = std::clamp(roll, -tyre.limit, tyre.limit);
                const double left = std::sqrt(tyre.limit * tyre.limit - roll * roll);
                side = std::copysign(left * settings_.side_grip, side);
            } else if (size > tyre.limit) {
                roll *= tyre.limit / size;
                side *= tyre.limit / size;
            }
            apply(body_, tyre.roll, roll - tyre.roll_impulse);
            apply(body_, tyre.side, side - tyre.side_impulse);
            tyre.roll_impulse = roll;
            tyre.side_impulse = side;
        }
    }
    for (std::size_t i = 0; i < wheels_.size(); ++i) {
        // In the air a wheel keeps its spin.
        if (tyres_[i].grips) contacts_[i].roll_speed = speed(tyres_[i].roll, body_.velocity);
        wheels_[i].spin += contacts_[i].roll_speed / settings_.wheel_radius * substep;
        wheels_[i].steer = commands[i].steer;
    }
}

StepReport WheeledChassis::park() {
    static_cast<BodyMotion&>(body_) = before_;
    wheels_ = wheels_before_;
    contacts_ = contacts_before_;
    state_.condition = BodyCondition::parked;
    StepReport report;
    report.parked = 1;
    return report;
}

StepReport WheeledChassis::step(const Ground& ground, std::span<const WheelCommand> commands,
                                double dt) {
    TERRANE_ASSERT(dt > 0.0 && dt <= 1.0, "dt must be > 0 and at most 1 s");
    before_ = body_;
    wheels_before_ = wheels_;
    contacts_before_ = contacts_;
    ground_contacts_.invalidate();
    SubstepAnswer total;
    const double substep_count = count_substeps(dt, kMaxSubstep);
    const double substep = dt / substep_count;
    if (!cast_wheels(ground)) return park();
    for (double done = 0.0; done < substep_count; done += 1.0) {
        body_.velocity.linear += body_.acceleration * substep;
        apply_drag(substep);
        apply_suspension(substep);
        solve_tyres(commands, substep);
        const SubstepAnswer answer = step_body(body_, ground_contacts_, ground, substep);
        if (!answer.resident || !cast_wheels(ground)) return park();
        total.add(answer);
    }
    StepReport report;
    report.impacts = total.impacts;
    report.simulated_time = total.simulated_time;
    report.lost_time = total.lost_time;
    bool touches = total.touches;
    report.max_depth_m = deepest(body_, ground, greatest_lift(body_, ground), 0.0);
    for (std::size_t i = 0; i < wheels_.size(); ++i) {
        const WheelContact& contact = contacts_[i];
        WheelState& wheel = wheels_[i];
        wheel.centre_world = contact.centre_world;
        wheel.compression = contact.compression;
        wheel.on_ground =
            contact.on_ground && dot(contact.normal, body_.pose.rotation.col(2)) > 0.0;
        touches = touches || contact.on_ground;
        Pose pose;
        pose.translation = contact.centre_world;
        const DistanceAnswer distance =
            signed_distance(Sphere{settings_.wheel_radius}, pose, ground, 0.0);
        if (distance.has_ground) {
            report.max_depth_m = std::max(report.max_depth_m, -distance.distance);
        }
    }
    if (report.max_depth_m > body_.tolerance && !body_.started_deep) report.too_deep = 1;
    const bool is_out = !touches && is_outside(ground, body_.pose.translation);
    (is_out ? report.left_world : report.awake) = 1;
    state_.condition = is_out ? BodyCondition::left_world : BodyCondition::awake;
    state_.pose = body_.pose;
    state_.velocity = body_.velocity.linear;
    state_.angular_velocity = body_.velocity.angular;
    update_rolled_over(touches, dt);
    return report;
}

/// In free flight the time on its side or roof is unchanged.
void WheeledChassis::update_rolled_over(bool touches_ground, double dt) {
    const bool has_wheel = std::any_of(wheels_.begin(), wheels_.end(),
                                       [](const WheelState& wheel) { return wheel.on_ground; });
    if (body_.pose.rotation(2, 2) >= (has_wheel ? kOverturned : kOverturnedWithoutWheels)) {
        rolled_over_time_ = 0.0;
    } else if (touches_ground) {
        rolled_over_time_ = std::min(rolled_over_time_ + dt, kRolledOverTime);
    }
}

}  // namespace terrane::internal
