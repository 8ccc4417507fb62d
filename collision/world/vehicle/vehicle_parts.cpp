// SPDX-License-Identifier: MIT
//
// Sources of the presets:
//   Wong. Theory of ground vehicles. 2008, chapters 1, 3 and 4: tyres on dry asphalt, peak friction 0.8 to 0.9 and 0.75
//     sliding; rolling resistance of tyres on hard roads 0.012 to 0.015, of tracks on firm ground 0.04; drag.
//   NHTSA. Rating system for rollover resistance. Federal Register 66 FR 3388, 2001: static stability factor track / (2
//     height of the centre of mass); light trucks have 1.0 to 1.3. A vehicle slides before it rolls over if its tyre
//     friction is below this factor less the effect of suspension roll.
//   Gillespie. Fundamentals of vehicle dynamics. 1992, chapters 4, 5 and 7: bounce frequencies of 1 to 2 Hz, damping
//     ratios of 0.2 to 0.4; drag coefficients of pickups and utility vehicles about 0.45, over 3 m^2; anti-roll bars.
// The drive force is limited by the tyres' grip on a slope, as for trucks in low gear. The tracked vehicle's default
// power is what a 12 t M113 has at its tracks: 158 kW at an efficiency of 70 %.
// Deviations: power is specified at the wheels and is independent of speed, as with a gearbox of many ratios. The roll
//     axis lies on the ground: there is no suspension geometry. A track is a row of wheels of equal force; its belt has
//     neither mass nor tension.
#include "world/vehicle/vehicle_parts.h"

#include "world/solver/body_checks.h"
#include "world/solver/ground_gate.h"

#include <terrane/collision/vehicle.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace terrane {
namespace {

CompoundPart make_cab(double x, double z, const Eigen::Vector3d& half_extents) {
    CompoundPart cab{Box{half_extents}, {}};
    cab.body_from_part.translation = {x, 0.0, z};
    return cab;
}

}  // namespace

VehicleSettings make_truck() {
    VehicleSettings truck;
    truck.bodywork.push_back(make_cab(0.7, 0.75, {0.8, 0.8, 0.35}));
    return truck;
}

VehicleSettings make_tracked() {
    VehicleSettings tracked;
    tracked.chassis_half_extents = {2.6, 1.1, 0.5};
    tracked.mass = 12e3;
    tracked.centre_of_mass_height = 0.84;
    tracked.axles.clear();
    for (int i = 0; i < 5; ++i) tracked.axles.push_back({.position = 1.8 - 0.9 * i, .track = 2.2});
    tracked.wheel_radius = 0.4;
    tracked.suspension_hertz = 1.5;
    tracked.damping_ratio = 0.6;
    tracked.tyre_friction = 0.9;
    tracked.side_grip = 0.6;
    tracked.max_drive_force = 90e3;
    tracked.max_drive_power = 110e3;
    tracked.max_brake_force = 100e3;
    tracked.rolling_resistance = 0.04;
    tracked.drag_area = 6.0;
    tracked.is_tracked = true;
    return tracked;
}

VehicleSettings make_six_wheeler() {
    VehicleSettings six;
    six.chassis_half_extents = {3.4, 1.15, 0.45};
    six.bodywork.push_back(make_cab(2.3, 1.0, {0.9, 1.1, 0.55}));
    six.mass = 9e3;
    six.centre_of_mass_height = 1.0;
    six.axles = {{.position = 2.2, .track = 2.2, .max_steer = 0.5, .anti_roll = 40e3},
                 {.position = -0.6, .track = 2.2, .max_steer = 0.15, .anti_roll = 40e3},
                 {.position = -2.2, .track = 2.2, .max_steer = 0.0, .anti_roll = 40e3}};
    six.wheel_radius = 0.55;
    six.suspension_travel = 0.4;
    six.suspension_hertz = 1.5;
    six.max_drive_force = 60e3;
    six.max_drive_power = 180e3;
    six.max_brake_force = 75e3;
    six.drag_area = 5.0;
    return six;
}

}  // namespace terrane

// Sources: Wong. Theory of ground vehicles. 2008, section 6.1 (skid-steering on rigid ground: turning must overcome
//          Coulomb friction across the tracks).

namespace terrane::internal {
namespace {

constexpr double kRolledOverTime = 1.0;  // seconds
/// Cosines of the tilts beyond which a vehicle has rolled over: 70 degrees; 45 degrees if no wheel is in contact.
constexpr double kOverturned = 0.3420201433256687;
constexpr double kOverturnedWithoutWheels = 0.7071067811865476;
constexpr std::size_t kMaxAxles = 32;

Result<void> check_axle(const AxleSettings& axle, std::size_t index) {
    const std::string name = "axles[" + std::to_string(index) + "]";
    const std::string position = name + ".position", track = name + ".track",
                      steer = name + ".max_steer", bar = name + ".anti_roll";
    const FieldRange fields[] = {
        {position.c_str(), axle.position, -1e3, 1e3, "m"},
        {track.c_str(), axle.track, 0.0, 1e3, "m"},
        {steer.c_str(), axle.max_steer, -1.5, 1.5, "rad"},
        {bar.c_str(), axle.anti_roll, 0.0, 1e9, "N/m"},
    };
    return check_fields(fields);
}

}  // namespace

Result<void> check_vehicle(const VehicleSettings& s) {
    const FieldRange fields[] = {
        {"chassis_half_extents.x", s.chassis_half_extents.x(), 0.01, 1e3, "m"},
        {"chassis_half_extents.y", s.chassis_half_extents.y(), 0.01, 1e3, "m"},
        {"chassis_half_extents.z", s.chassis_half_extents.z(), 0.01, 1e3, "m"},
        {"mass", s.mass, 1e-3, 1e9, "kg"},
        {"centre_of_mass_height", s.centre_of_mass_height, s.chassis_half_extents.z(), 1e3, "m"},
        {"axles.size()", static_cast<double>(s.axles.size()), 1.0, kMaxAxles},
        {"wheel_radius", s.wheel_radius, 0.01, 1e2, "m"},
        {"suspension_travel", s.suspension_travel, 0.001, 1e2, "m"},
        {"suspension_hertz", s.suspension_hertz, 0.1, 10.0, "Hz"},
        {"damping_ratio", s.damping_ratio, 0.0, 10.0},
        {"tyre_friction", s.tyre_friction, 0.0, 100.0},
        {"side_grip", s.side_grip, 0.01, 1.0},
        {"max_drive_force", s.max_drive_force, 0.0, 1e12, "N"},
        {"max_drive_power", s.max_drive_power, 0.0, 1e12, "W"},
        {"max_brake_force", s.max_brake_force, 0.0, 1e12, "N"},
        {"rolling_resistance", s.rolling_resistance, 0.0, 1.0},
        {"drag_area", s.drag_area, 0.0, 1e4, "m^2"},
        {"friction", s.friction, 0.0, 1e6},
        {"restitution", s.restitution, 0.0, 1.0},
    };
    TERRANE_TRY(check_fields(fields));
    for (std::size_t i = 0; i < s.axles.size(); ++i) {
        TERRANE_TRY(check_axle(s.axles[i], i));
    }
    return {};
}

Result<Compound> make_chassis_shape(const VehicleSettings& settings, const WheelSet& wheels) {
    std::vector<CompoundPart> parts{{Box{settings.chassis_half_extents}, {}}};
    parts.insert(parts.end(), settings.bodywork.begin(), settings.bodywork.end());
    for (std::size_t i = 0; i < wheels.count(); ++i) {
        parts.push_back({Sphere{settings.wheel_radius}, {}});
        parts.back().body_from_part.translation = wheels.position(i);
    }
    return Compound::create(parts);
}

bool Vehicle::set_controls(const VehicleControls& controls) {
    if (!std::isfinite(controls.throttle) || !std::isfinite(controls.brake) ||
        !std::isfinite(controls.steer)) {
        return false;
    }
    const VehicleControls before = controls_;
    controls_ = {std::clamp(controls.throttle, -1.0, 1.0), std::clamp(controls.brake, 0.0, 1.0),
                 std::clamp(controls.steer, -1.0, 1.0)};
    update_commands();
    return controls_.throttle != before.throttle || controls_.brake != before.brake ||
           controls_.steer != before.steer;
}

void Vehicle::update_commands() {
    const VehicleSettings& s = settings();
    double driven = 0.0;
    for (std::size_t i = 0; i < wheels_.count(); ++i)
        driven += wheels_.axle(i).is_driven ? 1.0 : 0.0;
    const double force = driven > 0.0 ? s.max_drive_force / driven : 0.0;
    // Throttle of each track; the inner track of a turn gets less.
    const double left = std::clamp(controls_.throttle - controls_.steer, -1.0, 1.0);
    const double right = std::clamp(controls_.throttle + controls_.steer, -1.0, 1.0);
    for (std::size_t i = 0; i < wheels_.count(); ++i) {
        WheelCommand& command = wheels_.commands()[i];
        const AxleSettings& axle = wheels_.axle(i);
        command = {};
        command.brake_force =
            controls_.brake * s.max_brake_force / static_cast<double>(wheels_.count());
        if (!s.is_tracked) command.steer = controls_.steer * axle.max_steer;
        if (!axle.is_driven) continue;
        if (!s.is_tracked) {
            command.drive_force = controls_.throttle * force;
            continue;
        }
        const double side = wheels_.position(i).y();
        command.drive_force = 0.5 * (right + left) * force;
        command.turn_force = (side > 0.0 ? 0.5 : side < 0.0 ? -0.5 : 0.0) * (left - right) * force;
    }
}

void Vehicle::begin_step() {
    for (WheelContact& contact : wheels_.contacts()) contact.total_load_impulse = 0.0;
    spins_before_.assign(wheels_.spins().begin(), wheels_.spins().end());
}

void Vehicle::undo_step() {
    std::copy(spins_before_.begin(), spins_before_.end(), wheels_.spins().begin());
}

bool Vehicle::cast_wheels(const RigidBody& chassis, BodyId body, const QueryScene& scene) {
    const double travel = settings().suspension_travel;
    const Sphere wheel{settings().wheel_radius};
    const QueryFilter filter{.layers = chassis.filter.collides_with,
                             .except = body,
                             .include_sensors = false,
                             .include_ground = false};
    for (std::size_t i = 0; i < wheels_.count(); ++i) {
        Motion motion;
        motion.start.translation =
            chassis.pose.translation + rotated(chassis.pose.rotation, wheels_.position(i));
        motion.translation = -travel * chassis.pose.rotation.col(2);
        const CastAnswer below = cast_wheel(wheel, motion, *scene.ground, chassis.tolerance);
        if (below.status == QueryStatus::not_resident) return false;
        const CastQueryAnswer met = query_cast(scene, wheel, motion, filter);
        WheelContact& contact = wheels_.contacts()[i];
        const WheelContact before = contact;
        contact = {};
        contact.roll_speed = before.roll_speed;
        contact.side_slip = before.side_slip;
        contact.total_load_impulse = before.total_load_impulse;
        const bool is_body = met.hit && (!below.hit || met.fraction <= below.fraction);
        contact.touches = met.hit || below.hit;
        const double fraction = is_body ? met.fraction : below.hit ? below.fraction : 1.0;
        contact.compression = travel * (1.0 - fraction);
        contact.centre_world = motion.start.translation + motion.translation * fraction;
        contact.normal = is_body ? met.normal : below.contact.normal;
        contact.point_world = contact.centre_world - wheel.radius * contact.normal;
        contact.friction = settings().tyre_friction;
        if (is_body) {
            contact.body = met.body.index;
            contact.friction =
                combined_friction(contact.friction, scene.bodies[met.body.index].friction);
        } else if (const auto surface =
                       scene.ground->surface(contact.point_world.x(), contact.point_world.y())) {
            contact.friction = combined_friction(contact.friction, surface->friction);
        }
    }
    return true;
}

void Vehicle::place(const BodyState& chassis) {
    state_.chassis = chassis;
    rolled_over_time_ = 0.0;
    state_.is_rolled_over = false;
    for (std::size_t i = 0; i < wheels_.count(); ++i) {
        wheels_.contacts()[i] = {};
        state_.wheels[i] = {};
        state_.wheels[i].centre_world =
            chassis.pose.translation +
            rotated(chassis.pose.rotation,
                    wheels_.position(i) - Eigen::Vector3d(0.0, 0.0, settings().suspension_travel));
        state_.wheels[i].spin = wheels_.spins()[i];
    }
}

void Vehicle::end_step(const BodyState& chassis, const QueryScene& scene, bool touches, double dt) {
    state_.chassis = chassis;
    const Eigen::Vector3d up = chassis.pose.rotation.col(2);
    bool has_wheel = false;
    for (std::size_t i = 0; i < wheels_.count(); ++i) {
        const WheelContact& contact = wheels_.contacts()[i];
        WheelState& wheel = state_.wheels[i];
        wheel = {};
        wheel.centre_world = contact.centre_world;
        wheel.compression = contact.compression;
        wheel.spin = wheels_.spins()[i];
        wheel.steer = wheels_.commands()[i].steer;
        wheel.in_contact = contact.touches && dot(contact.normal, up) > 0.0;
        wheel.load = contact.total_load_impulse / dt;
        wheel.side_slip = contact.side_slip;
        if (wheel.in_contact) {
            wheel.point_world = contact.point_world;
            wheel.normal = contact.normal;
            if (contact.body != BodyId::kNone) wheel.body = scene.bodies[contact.body].id;
        }
        has_wheel = has_wheel || wheel.in_contact;
        touches = touches || contact.touches;
    }
    // In free flight, the time on side or roof does not change.
    if (up.z() >= (has_wheel ? kOverturned : kOverturnedWithoutWheels)) {
        rolled_over_time_ = 0.0;
    } else if (touches) {
        rolled_over_time_ = std::min(rolled_over_time_ + dt, kRolledOverTime);
    }
    state_.is_rolled_over = rolled_over_time_ >= kRolledOverTime;
}

bool Vehicle::stands_on(std::uint32_t body) const {
    const std::span<const WheelContact> contacts = wheels_.contacts();
    return std::any_of(contacts.begin(), contacts.end(), [&](const WheelContact& contact) {
        return contact.touches && contact.body == body;
    });
}

double Vehicle::wheel_depth(const Ground& ground) const {
    double depth = 0.0;
    for (const WheelState& wheel : state_.wheels) {
        Pose pose;
        pose.translation = wheel.centre_world;
        const DistanceAnswer distance =
            signed_distance(Sphere{settings().wheel_radius}, pose, ground, 0.0);
        if (distance.has_ground) depth = std::max(depth, -distance.distance);
    }
    return depth;
}

}  // namespace terrane::internal
