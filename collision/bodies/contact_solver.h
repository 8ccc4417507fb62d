// SPDX-License-Identifier: MIT
#pragma once

#include "vector_math.h"

#include <terrane/collision/ground_contact.h>

#include <array>
#include <span>

// Sources:    Catto. Iterative dynamics with temporal coherence. GDC 2005 (sequential impulses).
//             Stewart. Rigid-body dynamics with friction and impact. SIAM Review 2000, section 2
//             (Poisson's restitution; that it may give energy, and when it cannot).
// Deviations: one body against a world that does not move; a plastic solve first and restitution
//             after it, so that the energy can be checked: where Poisson's impulses would add energy,
//             the plastic impulses are scaled by 1 + restitution instead, which provably adds none.
namespace terrane::internal {

/// Velocity, or a small displacement, of a rigid body: of its centre, and around it in world axes.
struct Twist {
    Eigen::Vector3d linear = Eigen::Vector3d::Zero();
    Eigen::Vector3d angular = Eigen::Vector3d::Zero();
};

/// Mass of a body in its own axes. An inverse inertia of 0 is a shape without size around that axis:
/// its spin never changes.
struct MassProperties {
    double inverse_mass = 1.0;
    Eigen::Vector3d inertia = Eigen::Vector3d::Zero();
    Eigen::Vector3d inverse_inertia = Eigen::Vector3d::Zero();
};

/// Inertia of the solid shape. Fails never; a shape without size has none.
MassProperties make_mass_properties(const Shape& shape, double mass);

double kinetic_energy(const MassProperties& mass, const Pose& pose, const Twist& velocity);

inline constexpr std::size_t kMaxSolverContacts = 64;

/// The impulses of one body's contacts at one moment.
class ContactSolver {
public:
    struct Surface {
        double friction = 0.0;
        double restitution = 0.0;
        double bounce_speed = 0.0;  ///< contacts that approach more slowly do not bounce, m/s
    };

    ContactSolver(const MassProperties& mass, const Pose& world_from_body)
        : mass_(mass), pose_(world_from_body) {}

    /// Takes contacts up to the capacity; their points must belong to the pose of the constructor.
    /// @param roundings radius of the sphere that rolls at each contact; 0 for a corner
    void add(std::span<const Contact> contacts, std::span<const double> roundings);
    bool empty() const { return count_ == 0; }

    /// Changes a velocity so that no contact closes to less than `rest_gap` within `duration`:
    /// contacts with less gap do not close at all. Energy never grows.
    void solve_velocity(Twist& velocity, const Surface& surface, double rest_gap, double duration);

    /// The displacement that opens every contact with less than `wanted_gap` half the way to it, and
    /// no contact by more than `max_distance`.
    /// @param may_turn false: by a translation alone
    Twist solve_separation(double wanted_gap, double max_distance, bool may_turn);

private:
    struct Row {
        Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< of the impulse, world
        Eigen::Vector3d moment = Eigen::Vector3d::Zero();     ///< arm x direction
        Eigen::Vector3d spin = Eigen::Vector3d::Zero();       ///< inverse inertia * moment
        double effective_mass = 0.0;
        double impulse = 0.0;
    };
    struct ContactRows {
        Row normal, tangent, bitangent;
        Eigen::Vector3d core_arm =
            Eigen::Vector3d::Zero();  ///< to the point that turning carries round
        double gap = 0.0;
        double allowed_closing = 0.0;  ///< m/s
        double least_impulse = 0.0;
        double approach_speed = 0.0;
    };

    Row make_row(const Eigen::Vector3d& arm, const Eigen::Vector3d& direction) const;
    static double speed(const Row& row, const Twist& velocity) {
        return dot(row.direction, velocity.linear) + dot(row.moment, velocity.angular);
    }
    void apply(const Row& row, double impulse, Twist& velocity) const {
        velocity.linear += row.direction * (impulse * mass_.inverse_mass);
        velocity.angular += row.spin * impulse;
    }
    bool aim(const Twist& velocity, double rest_gap, double duration);
    void iterate(Twist& velocity, double friction, double tolerance);
    double push(ContactRows& contact, Twist& velocity) const;
    double rub(ContactRows& contact, double friction, Twist& velocity) const;

    MassProperties mass_;
    Pose pose_;
    std::array<ContactRows, kMaxSolverContacts> contacts_;
    std::size_t count_ = 0;
};

}  // namespace terrane::internal
