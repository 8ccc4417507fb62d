// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/step/body_step.h"

#include <terrane/collision/truck.h>

#include <span>
#include <vector>

namespace terrane::internal {

/// A box on wheels, each with a spring, a damper and a tyre. The wheels at the top of their travel are parts of the
/// body that moves against the offset surface.
struct ChassisSettings {
    Eigen::Vector3d half_extents = Eigen::Vector3d::Zero();
    double mass = 0.0;
    double wheel_radius = 0.0;
    double suspension_travel = 0.0;
    double suspension_hertz = 0.0;
    double damping_ratio = 0.0;
    double tyre_friction = 0.0;
    /// Friction across the rolling direction, as a share of the friction along it.
    double side_grip = 1.0;
    /// Beyond the friction ellipse a belt keeps its longitudinal force and reduces the lateral one; a tyre reduces both
    /// in proportion.
    bool rolls_first = false;
    double max_drive_power = 0.0;     ///< of all wheels, watts
    double rolling_resistance = 0.0;  ///< force against the roll, as a share of the wheel's load
    double drag_area = 0.0;           ///< drag coefficient times frontal area, m^2
};

/// Commands of a wheel for a step.
struct WheelCommand {
    double drive_force = 0.0;  ///< newtons, positive forward
    /// Newtons, positive forward, that a steering differential adds to one side and takes from the other: they cost
    /// power only as far as one side runs faster.
    double turn_force = 0.0;
    double brake_force = 0.0;  ///< newtons at most, against its roll
    double steer = 0.0;        ///< radians, positive to the left
};

/// An impulse direction at a point of the chassis.
struct ChassisLever {
    Eigen::Vector3d direction = Eigen::Vector3d::Zero();
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    Eigen::Vector3d spin = Eigen::Vector3d::Zero();
    double effective_mass = 0.0;
};

class WheeledChassis {
public:
    /// @param wheels_body centres at the top of their travel
    WheeledChassis(const ChassisSettings& settings, std::span<const Eigen::Vector3d> wheels_body,
                   const BodyState& start);
    WheeledChassis(const WheeledChassis&) = delete;
    WheeledChassis& operator=(const WheeledChassis&) = delete;

    /// @param commands [wheels]
    StepReport step(const Ground& ground, std::span<const WheelCommand> commands, double dt);

    const BodyState& state() const { return state_; }
    std::span<const WheelState> wheels() const { return wheels_; }
    /// Whether it has lain on its side or roof for kRolledOverTime.
    bool is_rolled_over() const { return rolled_over_time_ >= kRolledOverTime; }
    BodyNeed need() const;

private:
    static constexpr double kRolledOverTime = 1.0;  // seconds

    /// A wheel's contact with the ground, and the suspension impulse of one substep.
    struct WheelContact {
        bool on_ground = false;
        double compression = 0.0;
        Eigen::Vector3d point_world = Eigen::Vector3d::Zero();
        Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
        Eigen::Vector3d centre_world = Eigen::Vector3d::Zero();
        double friction = 0.0;  // of the tyre on the ground's surface there
        double load_impulse = 0.0;
        double roll_speed = 0.0;
    };
    struct Tyre {
        ChassisLever roll, side;
        double limit = 0.0;
        double drive = 0.0;
        double brake_limit = 0.0;
        double roll_impulse = 0.0, side_impulse = 0.0, brake_impulse = 0.0;
        bool grips = false;
    };

    bool cast_wheels(const Ground& ground);
    void apply_drag(double substep);
    void apply_suspension(double substep);
    void limit_power(std::span<const WheelCommand> commands, double substep);
    void solve_tyres(std::span<const WheelCommand> commands, double substep);
    StepReport park();
    void update_rolled_over(bool touches_ground, double dt);

    ChassisSettings settings_;
    std::vector<BodyPart> parts_;  // the box, then the wheels
    RigidBody body_;
    GroundContactCache ground_contacts_;
    BodyState state_;
    std::vector<WheelState> wheels_, wheels_before_;
    std::vector<WheelContact> contacts_, contacts_before_;
    std::vector<Tyre> tyres_;
    BodyMotion before_;
    double rolled_over_time_ =
        0.0;  // seconds of contact on its side or roof, up to the limit; 0 once upright
};

/// Fails with invalid_argument, naming the field, where one is out of the range that it works in.
Result<void> check_settings(const ChassisSettings& settings);

}  // namespace terrane::internal
