// SPDX-License-Identifier: MIT
#pragma once

#include "world/solver/contact_solver.h"

#include <terrane/collision/vehicle.h>

#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// How a character's feet drive it: by friction at the contacts that it stands on, towards a velocity.
struct FootDrive {
    /// Wanted, relative to what it stands on, m/s; horizontal.
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    double friction = 0.0;   ///< of the feet on what they stand on
    double max_force = 0.0;  ///< N
    double least_cosine =
        0.0;  ///< of the normals of contacts that can be stood on with the vertical
    double standing_gap = 0.0;  ///< contacts with larger gaps are not stood on, metres
    int contact_count = 1;      ///< contacts that share the force

    /// Whether a contact can be stood on.
    /// @param sign 1 where the character is the contact's body a, else -1
    bool stands_on(const SolverContact& contact, double sign) const {
        return sign * contact.normal.z() >= least_cosine && contact.gap <= standing_gap;
    }

    /// Changes a contact that can be stood on: its friction drives the character.
    void drive(SolverContact& contact, double sign, double substep) const {
        if (!stands_on(contact, sign)) return;
        const Eigen::Vector3d& n = contact.normal;
        // Along the surface, with the wanted horizontal components.
        const double climb = -(n.x() * velocity.x() + n.y() * velocity.y()) / n.z();
        contact.slip_velocity = sign * Eigen::Vector3d(velocity.x(), velocity.y(), climb);
        contact.friction = friction;
        contact.max_friction_impulse = max_force * substep / contact_count;
    }
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

/// What a wheel's cast has met, and what has become of it in the substeps since.
struct WheelContact {
    bool touches = false;
    std::uint32_t body = BodyId::kNone;  ///< that it stands on; of the ground: none
    Pose body_pose;                      ///< of that body in the substep
    Eigen::Vector3d point_world = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< towards the wheel
    Eigen::Vector3d centre_world = Eigen::Vector3d::Zero();
    double compression = 0.0;  ///< metres, as cast
    double friction = 0.0;     ///< of the tyre on what it stands on
    // Set by WheelSet.
    Eigen::Vector3d point_chassis = Eigen::Vector3d::Zero();  ///< the point, body frames
    Eigen::Vector3d point_body = Eigen::Vector3d::Zero();
    Eigen::Vector3d point_now = Eigen::Vector3d::Zero();  ///< world
    double compression_now = 0.0;
    double load_impulse = 0.0;                 ///< of the substep, N s
    double total_load_impulse = 0.0;           ///< of the step so far, N s
    double roll_speed = 0.0, side_slip = 0.0;  ///< m/s
};

/// The wheels of a vehicle as forces on its chassis and on the bodies that they stand on: springs, dampers, anti-roll
/// bars and tyres. Wheels have no mass.
class WheelSet {
public:
    explicit WheelSet(const VehicleSettings& settings);

    const VehicleSettings& settings() const { return settings_; }
    std::size_t count() const { return positions_.size(); }
    /// Centre at the top of its travel, body frame.
    const Eigen::Vector3d& position(std::size_t wheel) const { return positions_[wheel]; }
    const AxleSettings& axle(std::size_t wheel) const { return settings_.axles[axles_[wheel]]; }

    std::span<WheelCommand> commands() { return commands_; }
    std::span<WheelContact> contacts() { return contacts_; }
    std::span<const WheelContact> contacts() const { return contacts_; }
    /// Angle that a wheel has turned, radians.
    std::span<double> spins() { return spins_; }
    std::span<const double> spins() const { return spins_; }
    bool in_contact() const;

    /// Takes over what casts have met.
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
    /// @param bodies       the solver's, with the velocities of the substep; those of infinite mass are not written
    /// @param chassis      index
    /// @param chassis_pose in the substep; those of the bodies that wheels stand on are in the contacts
    /// @return the kinetic energy that was added, J; < 0 where more was taken
    double apply(std::span<SolverBody> bodies, std::uint32_t chassis, const Pose& chassis_pose,
                 double substep);

private:
    /// An impulse direction at a contact of the chassis with what it stands on.
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
