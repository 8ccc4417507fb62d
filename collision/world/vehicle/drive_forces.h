// SPDX-License-Identifier: MIT
#pragma once

#include "world/solver/contact_solver.h"

#include <terrane/collision/vehicle.h>

#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Foot drive of a character: friction at its supporting contacts drives it towards a velocity.
struct FootDrive {
    /// Target horizontal velocity relative to the support, m/s.
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    double friction = 0.0;      ///< between the feet and the support
    double max_force = 0.0;     ///< N
    double least_cosine = 0.0;  ///< least z of the unit normal of a supporting contact
    double standing_gap = 0.0;  ///< largest gap of supporting contacts, metres
    int contact_count = 1;      ///< contacts that share the force

    /// Whether a contact can be stood on.
    /// @param sign 1 if the character is the contact's body a, else -1
    bool stands_on(const SolverContact& contact, double sign) const {
        return sign * contact.normal.z() >= least_cosine && contact.gap <= standing_gap;
    }

    /// Makes the friction of a supporting contact drive the character.
    void drive(SolverContact& contact, double sign, double substep) const {
        if (!stands_on(contact, sign)) return;
        const Eigen::Vector3d& n = contact.normal;
        // Along the surface, with the target's horizontal components.
        const double climb = -(n.x() * velocity.x() + n.y() * velocity.y()) / n.z();
        contact.slip_velocity = sign * Eigen::Vector3d(velocity.x(), velocity.y(), climb);
        contact.friction = friction;
        contact.max_friction_impulse = max_force * substep / contact_count;
    }
};

/// Commands of a wheel for a step.
struct WheelCommand {
    double drive_force = 0.0;  ///< newtons, positive forward
    /// Force that a steering differential adds to one side and subtracts from the other, newtons, positive forward. It
    /// costs power only to the extent that one side runs faster.
    double turn_force = 0.0;
    double brake_force = 0.0;  ///< largest force against rolling, newtons
    double steer = 0.0;        ///< radians, positive to the left
};

/// Contact of a wheel: result of its cast, updated in substeps.
struct WheelContact {
    bool touches = false;
    std::uint32_t body = BodyId::kNone;  ///< body under the wheel; none for the ground
    Pose body_pose;                      ///< pose of that body in the substep
    Eigen::Vector3d point_world = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< towards the wheel
    Eigen::Vector3d centre_world = Eigen::Vector3d::Zero();
    double compression = 0.0;  ///< metres, found by the cast
    double friction = 0.0;     ///< of the tyre on the surface below
    // Set by WheelSet.
    Eigen::Vector3d point_chassis = Eigen::Vector3d::Zero();  ///< contact point, chassis frame
    Eigen::Vector3d point_body = Eigen::Vector3d::Zero();     ///< contact point, frame of `body`
    Eigen::Vector3d point_now = Eigen::Vector3d::Zero();      ///< world
    double compression_now = 0.0;
    double load_impulse = 0.0;                 ///< of the substep, N s
    double total_load_impulse = 0.0;           ///< of the step so far, N s
    double roll_speed = 0.0, side_slip = 0.0;  ///< m/s
};

/// Forces of a vehicle's wheels on its chassis and on the bodies below: springs, dampers, anti-roll bars and tyres.
/// Wheels have no mass.
class WheelSet {
public:
    explicit WheelSet(const VehicleSettings& settings);

    const VehicleSettings& settings() const { return settings_; }
    std::size_t count() const { return positions_.size(); }
    /// Centre of a wheel at the top of its travel, body frame.
    const Eigen::Vector3d& position(std::size_t wheel) const { return positions_[wheel]; }
    const AxleSettings& axle(std::size_t wheel) const { return settings_.axles[axles_[wheel]]; }

    std::span<WheelCommand> commands() { return commands_; }
    std::span<WheelContact> contacts() { return contacts_; }
    std::span<const WheelContact> contacts() const { return contacts_; }
    /// Rotation angles of the wheels, radians.
    std::span<double> spins() { return spins_; }
    std::span<const double> spins() const { return spins_; }
    bool in_contact() const;

    /// Initialises the contacts for the substeps from the casts.
    /// @param chassis pose at the cast
    /// @param bodies  [bodies]
    template <class Bodies>
    void begin_collision_step(const Pose& chassis, const Bodies& bodies) {
        for (WheelContact& contact : contacts_) {
            contact.compression_now = contact.compression;
            contact.point_now = contact.point_world;
            contact.point_chassis =
                rotated_back(chassis.rotation, contact.point_world - chassis.translation);
            if (!contact.touches || contact.body == BodyId::kNone) continue;
            const Pose& pose = bodies[contact.body].pose;
            contact.point_body =
                rotated_back(pose.rotation, contact.point_world - pose.translation);
        }
    }

    /// Applies the forces of a substep to the velocities.
    /// @param bodies       solver bodies with the velocities of the substep; bodies of infinite mass are not written
    /// @param chassis      index of the chassis in `bodies`
    /// @param chassis_pose in the substep; poses of the bodies below wheels are in the contacts
    /// @return kinetic energy added, J; < 0 if energy was removed
    double apply(std::span<SolverBody> bodies, std::uint32_t chassis, const Pose& chassis_pose,
                 double substep);

private:
    /// An impulse direction at a wheel contact, between the chassis and the body below.
    struct Lever {
        Eigen::Vector3d direction = Eigen::Vector3d::Zero();
        Eigen::Vector3d moment = Eigen::Vector3d::Zero(), spin = Eigen::Vector3d::Zero();
        Eigen::Vector3d other_moment = Eigen::Vector3d::Zero();
        Eigen::Vector3d other_spin = Eigen::Vector3d::Zero();
        double effective_mass = 0.0;
        SolverBody* other = nullptr;  // null for the ground
    };
    struct Tyre {
        Lever roll, side;
        double limit = 0.0;
        double drive = 0.0;
        double brake_limit = 0.0;
        double roll_impulse = 0.0, side_impulse = 0.0, brake_impulse = 0.0;
        bool grips = false;
    };

    static double speed(const Lever& lever, const SolverBody& chassis);
    static void push(const Lever& lever, SolverBody& chassis, double impulse);
    Lever make_lever(std::span<SolverBody> bodies, const SolverBody& chassis,
                     const WheelContact& contact, const Eigen::Vector3d& direction) const;
    void follow();
    void apply_drag(SolverBody& chassis, double substep) const;
    void apply_suspension(std::span<SolverBody> bodies, SolverBody& chassis, double substep);
    double roll_bar_compression(std::size_t wheel) const;
    void prepare_tyres(std::span<SolverBody> bodies, const SolverBody& chassis, double substep);
    void limit_power(const SolverBody& chassis, double substep);
    void solve_tyres(SolverBody& chassis);
    double energy(std::span<const SolverBody> bodies, const SolverBody& chassis) const;

    VehicleSettings settings_;
    std::vector<Eigen::Vector3d> positions_;
    std::vector<std::size_t> axles_;  // of each wheel
    std::vector<WheelCommand> commands_;
    std::vector<WheelContact> contacts_;
    std::vector<double> spins_;
    std::vector<Tyre> tyres_;
    Pose chassis_pose_;  // in the substep
};

}  // namespace terrane::internal
