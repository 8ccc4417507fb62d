// SPDX-License-Identifier: MIT
//
// Sources:    Catto. Soft constraints. GDC 2011 (springs and dampers as implicit impulses).
//             Pacejka. Tire and vehicle dynamics. 2012, section 1.2 (the friction circle).
// Deviations: tyres have no slip curve: up to the circle they hold, at it they slide.
#include "body_checks.h"
#include "body_step.h"

#include <terrane/collision/truck.h>
#include <terrane/terrain/assert.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace terrane {
namespace {

using internal::cross;
using internal::dot;
using internal::RigidBody;
using internal::rotated;
using internal::Twist;

constexpr double kGravity = 9.81;
constexpr double kMaxSubstep =
    1.0 / 240.0;  // a hundredth of the period of the stiffest springs allowed
constexpr double kChassisFriction = 0.5;
constexpr double kRollingResistance = 0.015;  // of the wheel's load
/// Springs push along the ground's normal; where that leans further from the wheel's axis than this
/// cosine, they push no harder.
constexpr double kLeastAlignment = 0.4;
constexpr int kTyreIterations = 40;
constexpr double kTwoPi = 6.283185307179586;
constexpr std::size_t kWheelCount = 4;

Result<void> check_settings(const TruckSettings& s) {
    const struct {
        const char* name;
        double value, low, high;
    } fields[] = {
        {"chassis_half_extents.x", s.chassis_half_extents.x(), 0.01, 1e3},
        {"chassis_half_extents.y", s.chassis_half_extents.y(), 0.01, 1e3},
        {"chassis_half_extents.z", s.chassis_half_extents.z(), 0.01, 1e3},
        {"mass", s.mass, 1e-3, 1e9},
        {"wheel_radius", s.wheel_radius, 0.01, 1e2},
        {"wheelbase", s.wheelbase, 0.01, 1e3},
        {"track", s.track, 0.01, 1e3},
        {"suspension_travel", s.suspension_travel, 0.001, 1e2},
        {"suspension_hertz", s.suspension_hertz, 0.1, 10.0},
        {"damping_ratio", s.damping_ratio, 0.0, 10.0},
        {"tyre_friction", s.tyre_friction, 0.0, 100.0},
        {"max_drive_force", s.max_drive_force, 0.0, 1e12},
        {"max_brake_force", s.max_brake_force, 0.0, 1e12},
        {"max_steer", s.max_steer, 0.0, 1.5},
    };
    for (const auto& field : fields) {
        if (auto ok = internal::check_value(field.name, field.value, field.low, field.high); !ok)
            return ok;
    }
    return {};
}

/// A wheel's touch with the ground, and the impulses of one substep.
struct WheelTouch {
    bool on_ground = false;
    double compression = 0.0;
    Eigen::Vector3d point_world = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    Eigen::Vector3d centre_world = Eigen::Vector3d::Zero();
    double load_impulse = 0.0;
    double roll_speed = 0.0;
};

/// Where an impulse acts on the chassis.
struct Lever {
    Eigen::Vector3d direction = Eigen::Vector3d::Zero();
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    Eigen::Vector3d spin = Eigen::Vector3d::Zero();
    double effective_mass = 0.0;
};

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

double clamped(double value, double low, double high) {
    return std::isfinite(value) ? std::clamp(value, low, high) : 0.0;
}

}  // namespace

struct Truck::State {
    TruckSettings settings;
    RigidBody body;
    internal::GroundLook look;
    BodyState chassis;
    TruckControls controls;
    std::array<WheelState, kWheelCount> wheels;
    std::array<WheelTouch, kWheelCount> touches;

    /// What a step that parks takes back.
    struct Before {
        internal::BodyMotion motion;
        std::array<WheelState, kWheelCount> wheels;
        std::array<WheelTouch, kWheelCount> touches;
    };

    bool feel_ground(const Ground& ground);
    void push_springs(double substep);
    void turn_tyres(double substep);
    StepReport park(const Before& before);
};

Truck::Truck(std::unique_ptr<State> state) : state_(std::move(state)) {}
Truck::Truck(Truck&&) noexcept = default;
Truck& Truck::operator=(Truck&&) noexcept = default;
Truck::~Truck() = default;

Result<Truck> Truck::create(const TruckSettings& settings, const Pose& start_world) {
    if (auto ok = check_settings(settings); !ok) return tl::unexpected<Error>(ok.error());
    const Box chassis{settings.chassis_half_extents};

    BodyState start;
    start.pose = start_world;
    if (auto ok = internal::check_state(start); !ok) return tl::unexpected<Error>(ok.error());

    auto state = std::make_unique<State>();
    state->settings = settings;
    state->chassis = start;
    RigidBody& body = state->body;
    body.parts[0].shape = chassis;
    for (std::size_t wheel = 0; wheel < kWheelCount; ++wheel) {
        // The wheel at the top of its travel is part of the hull that passes the gate.
        internal::BodyPart& part = body.parts[wheel + 1];
        part.shape = Sphere{settings.wheel_radius};
        part.offset_body = {(wheel < 2 ? 0.5 : -0.5) * settings.wheelbase,
                            (wheel % 2 == 0 ? 0.5 : -0.5) * settings.track,
                            -0.5 * settings.chassis_half_extents.z()};
        body.radius =
            std::max(body.radius, internal::length(part.offset_body) + settings.wheel_radius);
        state->wheels[wheel].centre_world =
            start_world.translation + rotated(start_world.rotation, part.offset_body);
    }
    body.part_count = 1 + kWheelCount;
    body.radius = std::max(body.radius, bounding_radius(chassis));
    body.mass = internal::make_mass_properties(chassis, settings.mass);
    body.friction = kChassisFriction;
    body.restitution = 0.0;
    body.tolerance = std::min(default_contact_tolerance(chassis),
                              default_contact_tolerance(Sphere{settings.wheel_radius}));
    body.pose = start_world;
    return Truck(std::move(state));
}

const BodyState& Truck::chassis() const { return state_->chassis; }
const TruckSettings& Truck::settings() const { return state_->settings; }
const std::array<WheelState, 4>& Truck::wheels() const { return state_->wheels; }

BodyNeed Truck::need() const {
    const RigidBody& body = state_->body;
    return {body.pose.translation, body.velocity.linear,
            body.radius + state_->settings.suspension_travel + body.tolerance};
}

/// Casts the wheels from the top of their travel to its end. False where ground is not resident.
bool Truck::State::feel_ground(const Ground& ground) {
    const double travel = settings.suspension_travel;
    const Eigen::Vector3d axis = body.pose.rotation.col(2);
    for (std::size_t i = 0; i < kWheelCount; ++i) {
        const internal::BodyPart& part = body.parts[i + 1];
        Motion motion;
        motion.start.translation =
            body.pose.translation + rotated(body.pose.rotation, part.offset_body);
        motion.translation = -travel * axis;
        const CastAnswer answer = internal::cast_part(part.shape, motion, ground, body.tolerance);
        if (answer.status == ContactStatus::not_resident) return false;
        WheelTouch& touch = touches[i];
        const double fraction = answer.hit ? answer.fraction : 1.0;
        touch.on_ground = answer.hit;
        touch.compression = travel * (1.0 - fraction);
        touch.centre_world = motion.start.translation + motion.translation * fraction;
        touch.normal = answer.contact.normal;
        touch.point_world = touch.centre_world - settings.wheel_radius * touch.normal;
        touch.load_impulse = 0.0;
    }
    return true;
}

/// Springs and dampers, implicit: stable at any stiffness. All four see the same velocity, so that
/// left and right are treated alike.
void Truck::State::push_springs(double substep) {
    const double share = settings.mass / kWheelCount;
    const double omega = kTwoPi * settings.suspension_hertz;
    const double stiffness = share * omega * omega;
    const double damping = 2.0 * settings.damping_ratio * share * omega;
    const Eigen::Vector3d axis = body.pose.rotation.col(2);
    const Twist velocity = body.velocity;
    for (WheelTouch& touch : touches) {
        if (!touch.on_ground) continue;
        const double alignment = dot(touch.normal, axis);
        if (!(alignment > 0.0)) continue;
        const double lean = std::max(alignment, kLeastAlignment);
        const Lever lever = make_lever(body, touch.point_world, touch.normal);
        const double give = substep * (stiffness * substep + damping) / (lean * lean);
        const double wanted =
            substep * stiffness * touch.compression / lean - give * speed(lever, velocity);
        touch.load_impulse = std::max(0.0, wanted / (1.0 + give / lever.effective_mass));
        apply(body, lever, touch.load_impulse);
    }
}

/// Drive, brakes and side forces, together within each tyre's friction circle.
void Truck::State::turn_tyres(double substep) {
    struct Tyre {
        Lever roll, side;
        double limit = 0.0;
        double drive = 0.0;
        double brake_limit = 0.0;
        double roll_impulse = 0.0, side_impulse = 0.0, brake_impulse = 0.0;
        bool grips = false;
    };
    std::array<Tyre, kWheelCount> tyres;
    const double steer = controls.steer * settings.max_steer;
    const Motion steering{{}, Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.0, steer)};
    const Eigen::Vector3d steered = steering.at(1.0).rotation.col(0);
    for (std::size_t i = 0; i < kWheelCount; ++i) {
        WheelTouch& touch = touches[i];
        Tyre& tyre = tyres[i];
        if (!touch.on_ground || touch.load_impulse <= 0.0) continue;
        const Eigen::Vector3d ahead =
            rotated(body.pose.rotation, i < 2 ? steered : Eigen::Vector3d(1.0, 0.0, 0.0));
        const Eigen::Vector3d in_plane = ahead - touch.normal * dot(touch.normal, ahead);
        const double size = internal::length(in_plane);
        if (size < 0.1) continue;  // the ground is a wall square ahead: nothing to roll on
        const Eigen::Vector3d roll = in_plane / size;
        tyre.roll = make_lever(body, touch.point_world, roll);
        tyre.side = make_lever(body, touch.point_world, cross(touch.normal, roll));
        tyre.limit = settings.tyre_friction * touch.load_impulse;
        tyre.drive = controls.throttle * settings.max_drive_force / kWheelCount * substep;
        tyre.brake_limit = controls.brake * settings.max_brake_force / kWheelCount * substep +
                           kRollingResistance * touch.load_impulse;
        tyre.grips = true;
    }
    for (int iteration = 0; iteration < kTyreIterations; ++iteration) {
        for (Tyre& tyre : tyres) {
            if (!tyre.grips) continue;
            tyre.brake_impulse = std::clamp(
                tyre.brake_impulse - tyre.roll.effective_mass * speed(tyre.roll, body.velocity),
                -tyre.brake_limit, tyre.brake_limit);
            double roll = tyre.drive + tyre.brake_impulse;
            double side =
                tyre.side_impulse - tyre.side.effective_mass * speed(tyre.side, body.velocity);
            const double size = std::sqrt(roll * roll + side * side);
            if (size > tyre.limit) {
                roll *= tyre.limit / size;
                side *= tyre.limit / size;
            }
            apply(body, tyre.roll, roll - tyre.roll_impulse);
            apply(body, tyre.side, side - tyre.side_impulse);
            tyre.roll_impulse = roll;
            tyre.side_impulse = side;
        }
    }
    for (std::size_t i = 0; i < kWheelCount; ++i) {
        // In the air a wheel keeps its turning.
        if (tyres[i].grips) touches[i].roll_speed = speed(tyres[i].roll, body.velocity);
        wheels[i].spin += touches[i].roll_speed / settings.wheel_radius * substep;
        wheels[i].steer = i < 2 ? steer : 0.0;
    }
}

StepReport Truck::State::park(const Before& before) {
    static_cast<internal::BodyMotion&>(body) = before.motion;
    wheels = before.wheels;
    touches = before.touches;
    chassis.condition = BodyCondition::parked;
    StepReport report;
    report.parked = 1;
    return report;
}

StepReport Truck::step(const Ground& ground, const TruckControls& controls, double dt) {
    TERRANE_ASSERT(dt > 0.0 && dt <= 1.0, "dt must be > 0 and at most 1 s");
    State& state = *state_;
    RigidBody& body = state.body;
    if (std::isfinite(controls.throttle) && std::isfinite(controls.brake) &&
        std::isfinite(controls.steer)) {
        state.controls = {clamped(controls.throttle, -1.0, 1.0), clamped(controls.brake, 0.0, 1.0),
                          clamped(controls.steer, -1.0, 1.0)};
    }
    const State::Before before{body, state.wheels, state.touches};
    state.look.forget();
    StepReport report;
    const double substep_count = std::max(1.0, std::ceil(dt / kMaxSubstep - 1e-9));
    const double substep = dt / substep_count;
    if (!state.feel_ground(ground)) return state.park(before);
    bool touches = false;
    for (double done = 0.0; done < substep_count; done += 1.0) {
        body.velocity.linear.z() -= kGravity * substep;
        state.push_springs(substep);
        state.turn_tyres(substep);
        const internal::SubstepAnswer answer =
            internal::step_body(body, state.look, ground, kGravity, substep);
        if (!answer.resident || !state.feel_ground(ground)) return state.park(before);
        report.impacts += answer.impacts;
        report.lived_time += answer.lived_time;
        report.lost_time += answer.lost_time;
        touches = answer.touches;
    }
    report.max_depth_m = internal::deepest(body, ground, 0.0);
    for (std::size_t i = 0; i < kWheelCount; ++i) {
        const WheelTouch& touch = state.touches[i];
        WheelState& wheel = state.wheels[i];
        wheel.centre_world = touch.centre_world;
        wheel.compression = touch.compression;
        wheel.on_ground = touch.on_ground;
        touches = touches || touch.on_ground;
        Pose pose;
        pose.translation = touch.centre_world;
        const DistanceAnswer distance =
            signed_distance(Sphere{state.settings.wheel_radius}, pose, ground, 0.0);
        if (distance.has_ground)
            report.max_depth_m = std::max(report.max_depth_m, -distance.distance);
    }
    if (report.max_depth_m > body.tolerance && !body.started_deep) report.too_deep = 1;

    const bool is_outside = !touches && internal::is_outside(ground, body.pose.translation);
    (is_outside ? report.left_world : report.awake) = 1;
    state.chassis.condition = is_outside ? BodyCondition::left_world : BodyCondition::awake;
    state.chassis.pose = body.pose;
    state.chassis.velocity = body.velocity.linear;
    state.chassis.angular_velocity = body.velocity.angular;
    return report;
}

}  // namespace terrane
