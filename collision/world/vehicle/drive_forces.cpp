// SPDX-License-Identifier: MIT
//
// Sources:    Catto. Soft constraints. GDC 2011 (springs and dampers as implicit impulses).
//             Pacejka. Tire and vehicle dynamics. 2012, section 1.2 (the friction circle).
//             Wong. Theory of ground vehicles. 2008, chapter 3 (tractive effort limited by power, aerodynamic drag,
//             rolling resistance).
//             Gillespie. Fundamentals of vehicle dynamics. 1992, chapter 7 (anti-roll bars).
//             ISO 2533:1975 (density of the standard atmosphere at sea level).
// Deviations: tyres have no slip curve: they stick inside the friction circle (an ellipse if side_grip < 1), and slide
//             on it.
#include "world/vehicle/drive_forces.h"

#include <terrane/collision/query.h>

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr double kStandardGravity = 9.81;  // m/s^2: design weight of the springs
constexpr double kAirDensity = 1.225;      // kg/m^3
/// Springs act along the contact normal, so their force grows with the angle between normal and suspension axis. The
/// cosine of this angle is taken as at least this, to limit the force.
constexpr double kLeastAlignment = 0.4;
/// Least length of the rolling direction projected onto the contact plane; below it a wheel has no grip.
constexpr double kLeastRoll = 0.1;
constexpr int kTyreIterations = 40;
constexpr double kTwoPi = 6.283185307179586;

}  // namespace

WheelSet::WheelSet(const VehicleSettings& settings) : settings_(settings) {
    const double omega = kTwoPi * settings.suspension_hertz;
    const double sag = std::min(kStandardGravity / (omega * omega), settings.suspension_travel);
    const double top =
        settings.wheel_radius - settings.centre_of_mass_height + settings.suspension_travel - sag;
    for (std::size_t axle = 0; axle < settings.axles.size(); ++axle) {
        const AxleSettings& a = settings.axles[axle];
        if (a.track > 0.0) {
            positions_.emplace_back(a.position, 0.5 * a.track, top);
            positions_.emplace_back(a.position, -0.5 * a.track, top);
            axles_.push_back(axle);
        } else {
            positions_.emplace_back(a.position, 0.0, top);
        }
        axles_.push_back(axle);
    }
    commands_.resize(count());
    contacts_.resize(count());
    spins_.resize(count(), 0.0);
    tyres_.resize(count());
}

bool WheelSet::in_contact() const {
    return std::any_of(contacts_.begin(), contacts_.end(),
                       [](const WheelContact& contact) { return contact.touches; });
}

double WheelSet::speed(const Lever& lever, const SolverBody& chassis) {
    double speed =
        dot(lever.direction, chassis.velocity.linear) + dot(lever.moment, chassis.velocity.angular);
    if (lever.other != nullptr) {
        speed -= dot(lever.direction, lever.other->velocity.linear) +
                 dot(lever.other_moment, lever.other->velocity.angular);
    }
    return speed;
}

void WheelSet::push(const Lever& lever, SolverBody& chassis, double impulse) {
    chassis.velocity.linear += lever.direction * (impulse * chassis.mass().inverse_mass);
    chassis.velocity.angular += lever.spin * impulse;
    // Bodies of infinite mass may be shared with other islands, so they are not written.
    if (lever.other == nullptr || !(lever.other->mass().inverse_mass > 0.0)) return;
    lever.other->velocity.linear -= lever.direction * (impulse * lever.other->mass().inverse_mass);
    lever.other->velocity.angular -= lever.other_spin * impulse;
}

WheelSet::Lever WheelSet::make_lever(std::span<SolverBody> bodies, const SolverBody& chassis,
                                     const WheelContact& contact,
                                     const Eigen::Vector3d& direction) const {
    Lever lever;
    lever.direction = direction;
    lever.moment = cross(contact.point_now - chassis_pose_.translation, direction);
    lever.spin = apply_tensor(chassis_pose_.rotation, chassis.mass().inverse_inertia, lever.moment);
    double inverse = chassis.mass().inverse_mass + dot(lever.moment, lever.spin);
    if (contact.body != BodyId::kNone) {
        lever.other = &bodies[contact.body];
        const SolverBody& other = *lever.other;
        lever.other_moment = cross(contact.point_now - contact.body_pose.translation, direction);
        lever.other_spin = apply_tensor(contact.body_pose.rotation, other.mass().inverse_inertia,
                                        lever.other_moment);
        inverse += other.mass().inverse_mass + dot(lever.other_moment, lever.other_spin);
    }
    lever.effective_mass = 1.0 / inverse;
    return lever;
}

/// Moves the contacts with the bodies. A contact keeps its normal; its compression follows the motion along the normal.
void WheelSet::follow() {
    const Eigen::Vector3d axis = chassis_pose_.rotation.col(2);
    for (WheelContact& contact : contacts_) {
        if (!contact.touches) continue;
        contact.point_now =
            rotated(chassis_pose_.rotation, contact.point_chassis) + chassis_pose_.translation;
        Eigen::Vector3d on_other = contact.point_world;
        if (contact.body != BodyId::kNone) {
            const Pose& pose = contact.body_pose;
            on_other = rotated(pose.rotation, contact.point_body) + pose.translation;
        }
        const double lean = std::max(dot(contact.normal, axis), kLeastAlignment);
        const double opened = dot(contact.normal, contact.point_now - on_other) / lean;
        contact.compression_now =
            std::clamp(contact.compression - opened, 0.0, settings_.suspension_travel);
    }
}

/// Applies drag at the centre of mass, implicit in the speed, so that it never reverses the motion.
void WheelSet::apply_drag(SolverBody& chassis, double substep) const {
    const double share = 0.5 * kAirDensity * settings_.drag_area * chassis.mass().inverse_mass *
                         length(chassis.velocity.linear) * substep;
    chassis.velocity.linear /= 1.0 + share;
}

/// Compression of the other wheel of the axle; of the wheel itself if the axle has no other.
double WheelSet::roll_bar_compression(std::size_t wheel) const {
    const std::size_t left = wheel > 0 && axles_[wheel - 1] == axles_[wheel] ? wheel - 1 : wheel;
    const std::size_t other = left == wheel ? wheel + 1 : left;
    if (other >= count() || axles_[other] != axles_[wheel]) return contacts_[wheel].compression_now;
    return contacts_[other].touches ? contacts_[other].compression_now : 0.0;
}

/// Springs and dampers are implicit, and thereby stable at any stiffness. All wheels use the same chassis velocity, so
/// that the result is symmetric.
void WheelSet::apply_suspension(std::span<SolverBody> bodies, SolverBody& chassis, double substep) {
    const double share = settings_.mass / static_cast<double>(count());
    const double omega = kTwoPi * settings_.suspension_hertz;
    const double spring = share * omega * omega;
    const double damping = 2.0 * settings_.damping_ratio * share * omega;
    const Eigen::Vector3d axis = chassis_pose_.rotation.col(2);
    const SolverBody before = chassis;
    for (std::size_t i = 0; i < count(); ++i) {
        WheelContact& contact = contacts_[i];
        contact.load_impulse = 0.0;
        if (!contact.touches) continue;
        const double alignment = dot(contact.normal, axis);
        if (!(alignment > 0.0)) continue;
        const double lean = std::max(alignment, kLeastAlignment);
        const Lever lever = make_lever(bodies, chassis, contact, contact.normal);
        const double bar = axle(i).anti_roll;
        const double force = spring * contact.compression_now +
                             bar * (contact.compression_now - roll_bar_compression(i));
        const double softness = substep * ((spring + bar) * substep + damping) / (lean * lean);
        const double wanted = substep * force / lean - softness * speed(lever, before);
        // All wheels act at once, so each moves its share of the mass; else the springs would not balance the weight.
        const double moved_mass = std::min(share, lever.effective_mass);
        contact.load_impulse = std::max(0.0, wanted / (1.0 + softness / moved_mass));
        push(lever, chassis, contact.load_impulse);
        contact.total_load_impulse += contact.load_impulse;
    }
}

void WheelSet::prepare_tyres(std::span<SolverBody> bodies, const SolverBody& chassis,
                             double substep) {
    for (std::size_t i = 0; i < count(); ++i) {
        const WheelContact& contact = contacts_[i];
        Tyre& tyre = tyres_[i];
        tyre = {};
        if (!(contact.load_impulse > 0.0)) continue;
        const Motion steering{
            {}, Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.0, commands_[i].steer)};
        const Eigen::Vector3d ahead =
            rotated(chassis_pose_.rotation, steering.at(1.0).rotation.col(0));
        const Eigen::Vector3d in_plane = ahead - contact.normal * dot(contact.normal, ahead);
        const double size = length(in_plane);
        if (size < kLeastRoll) continue;  // against a wall ahead
        const Eigen::Vector3d roll = in_plane / size;
        tyre.roll = make_lever(bodies, chassis, contact, roll);
        tyre.side = make_lever(bodies, chassis, contact, cross(contact.normal, roll));
        tyre.limit = contact.friction * contact.load_impulse;
        tyre.brake_limit = commands_[i].brake_force * substep +
                           settings_.rolling_resistance * contact.load_impulse;
        tyre.grips = true;
    }
}

/// Scales the drive impulses of a substep to the power limit: turning (the difference between the tracks) gets its
/// power first, driving (the common part) the remainder.
void WheelSet::limit_power(const SolverBody& chassis, double substep) {
    double drive = 0.0, turn = 0.0;  // commanded power, watts
    for (std::size_t i = 0; i < count(); ++i) {
        if (!tyres_[i].grips) continue;
        const double roll_speed = speed(tyres_[i].roll, chassis);
        drive += std::abs(commands_[i].drive_force * roll_speed);
        turn += commands_[i].turn_force * roll_speed;
    }
    const double power = settings_.max_drive_power;
    const double turn_share = turn > power ? power / turn : 1.0;
    const double left = std::max(0.0, power - turn_share * std::max(0.0, turn));
    const double drive_share = drive > left ? left / drive : 1.0;
    for (std::size_t i = 0; i < count(); ++i) {
        tyres_[i].drive =
            (drive_share * commands_[i].drive_force + turn_share * commands_[i].turn_force) *
            substep;
    }
}

/// Solves drive, brake and side forces jointly within each tyre's friction ellipse.
void WheelSet::solve_tyres(SolverBody& chassis) {
    for (int iteration = 0; iteration < kTyreIterations; ++iteration) {
        for (Tyre& tyre : tyres_) {
            if (!tyre.grips) continue;
            tyre.brake_impulse = std::clamp(
                tyre.brake_impulse - tyre.roll.effective_mass * speed(tyre.roll, chassis),
                -tyre.brake_limit, tyre.brake_limit);
            double roll = tyre.drive + tyre.brake_impulse;
            double side = tyre.side_impulse - tyre.side.effective_mass * speed(tyre.side, chassis);
            const double across = side / settings_.side_grip;
            const double size = std::sqrt(roll * roll + across * across);
            if (size > tyre.limit && settings_.is_tracked) {
                roll = std::clamp(roll, -tyre.limit, tyre.limit);
                const double left = std::sqrt(tyre.limit * tyre.limit - roll * roll);
                side = std::copysign(left * settings_.side_grip, side);
            } else if (size > tyre.limit) {
                roll *= tyre.limit / size;
                side *= tyre.limit / size;
            }
            push(tyre.roll, chassis, roll - tyre.roll_impulse);
            push(tyre.side, chassis, side - tyre.side_impulse);
            tyre.roll_impulse = roll;
            tyre.side_impulse = side;
        }
    }
}

/// Kinetic energy of the chassis and of moving bodies under the wheels; a body under several wheels counts once.
double WheelSet::energy(std::span<const SolverBody> bodies, const SolverBody& chassis) const {
    double energy = kinetic_energy(chassis.mass(), chassis_pose_, chassis.velocity);
    for (std::size_t i = 0; i < count(); ++i) {
        const std::uint32_t index = contacts_[i].body;
        if (!contacts_[i].touches || index == BodyId::kNone) continue;
        const bool is_counted = std::any_of(
            contacts_.begin(), contacts_.begin() + static_cast<std::ptrdiff_t>(i),
            [&](const WheelContact& other) { return other.touches && other.body == index; });
        const SolverBody& body = bodies[index];
        if (is_counted || !(body.mass().inverse_mass > 0.0)) continue;
        energy += kinetic_energy(body.mass(), contacts_[i].body_pose, body.velocity);
    }
    return energy;
}

double WheelSet::apply(std::span<SolverBody> bodies, std::uint32_t chassis_index,
                       const Pose& chassis_pose, double substep) {
    SolverBody& chassis = bodies[chassis_index];
    chassis_pose_ = chassis_pose;
    const double energy_before = energy(bodies, chassis);
    apply_drag(chassis, substep);
    follow();
    apply_suspension(bodies, chassis, substep);
    prepare_tyres(bodies, chassis, substep);
    limit_power(chassis, substep);
    solve_tyres(chassis);
    for (std::size_t i = 0; i < count(); ++i) {
        WheelContact& contact = contacts_[i];
        contact.side_slip = 0.0;
        // In the air a wheel keeps its spin.
        if (tyres_[i].grips) {
            contact.roll_speed = speed(tyres_[i].roll, chassis);
            contact.side_slip = speed(tyres_[i].side, chassis);
        }
        spins_[i] += contact.roll_speed / settings_.wheel_radius * substep;
    }
    return energy(bodies, chassis) - energy_before;
}

}  // namespace terrane::internal
