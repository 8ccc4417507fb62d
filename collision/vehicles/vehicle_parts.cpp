// SPDX-License-Identifier: MIT
//
// Sources: Wong. Theory of ground vehicles. 2008, section 6.1 (skid-steering on a rigid ground: Coulomb friction across
//          the tracks is what turning has to overcome).
#include "vehicles/vehicle_parts.h"

#include "bodies/body_checks.h"
#include "bodies/step/offset_surface.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace terrane::internal {
namespace {

constexpr double kRolledOverTime = 1.0;  // seconds
/// Tilts from the vertical, as cosines, beyond which a vehicle has rolled over: 70 degrees; 45 degrees where no wheel
/// is in contact.
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
    if (auto ok = check_fields(fields); !ok) return ok;
    for (std::size_t i = 0; i < s.axles.size(); ++i) {
        if (auto ok = check_axle(s.axles[i], i); !ok) return ok;
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
    // Of the tracks; the inner one's throttle is less.
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
    // In free flight the time on its side or roof is unchanged.
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
