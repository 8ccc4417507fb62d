// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/solver/mass_properties.h"
#include "math/vector_math.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

// Sources:    Catto. Iterative dynamics with temporal coherence. GDC 2005 (sequential impulses, kept from step
//             to step).
//             Stewart. Rigid-body dynamics with friction and impact. SIAM Review 2000, section 2
//             (Poisson's restitution; that it may give energy, and when it cannot).
// Deviations: a plastic solve first and restitution after it, so that the energy can be checked: where Poisson's
//             impulses would add energy, the plastic impulses are scaled by 1 + restitution instead, which
//             provably adds none.
namespace terrane::internal {

/// Velocity, or a small displacement, of a rigid body: of its centre, and around it in world axes.
struct Twist {
    Eigen::Vector3d linear = Eigen::Vector3d::Zero();
    Eigen::Vector3d angular = Eigen::Vector3d::Zero();
};

double kinetic_energy(const MassProperties& mass, const Pose& pose, const Twist& velocity);

/// A body as the solver sees it.
struct SolverBody {
    MassProperties mass;
    Pose pose;  ///< that the points of its contacts belong to
    Twist velocity;
    Twist before, plastic;  ///< the solver's own
};

/// A contact of a body with the ground, or with another body.
struct SolverContact {
    static constexpr std::uint32_t kGround = ~std::uint32_t{0};

    std::uint32_t a = 0;        ///< index of the body that the normal points into
    std::uint32_t b = kGround;  ///< of the one that it points out of
    Eigen::Vector3d point_a = Eigen::Vector3d::Zero();  ///< world, on a
    Eigen::Vector3d point_b = Eigen::Vector3d::Zero();  ///< on b; not read for the ground
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    double rounding = 0.0;  ///< radius of the sphere of a that rolls at the contact; 0 for a corner
    double gap = 0.0;       ///< metres; negative: an overlap
    double rest_gap = 0.0;  ///< that the contact may close to, metres
    double wanted_gap = 0.0;  ///< below which separation opens it, metres
    double friction = 0.0;
    double restitution = 0.0;
    Eigen::Vector3d guess = Eigen::Vector3d::Zero();  ///< impulse on a to start from, N s
};

/// How long the solver tries: until no velocity changes by more than `tolerance` of the fastest approach, or
/// as many iterations as `patience` says have taken less than a tenth off that change.
struct SolverEffort {
    int iterations = 0;
    double tolerance = 0.0;
    int patience = std::numeric_limits<int>::max();
};

/// A contact with what solving it takes; made by ContactSolver::add().
class ContactRows {
    friend class ContactSolver;
    struct Row {
        Eigen::Vector3d direction;     // of the impulse on a, world
        Eigen::Vector3d moment, spin;  // of a: arm x direction; inverse inertia * moment
        Eigen::Vector3d other_moment, other_spin;  // of b; not set for the ground
        double give;                               // m/s of a unit impulse
        double effective_mass;                     // 1 / give
        double impulse;
    };
    Row normal_, tangent_, bitangent_;
    SolverBody* a_;
    SolverBody* b_;             // null for the ground
    Eigen::Vector3d core_arm_;  // of a, to the point that turning carries round
    double gap_, rest_gap_, wanted_gap_;
    double friction_, restitution_;
    double allowed_closing_;  // m/s
    double least_impulse_;
    double approach_speed_;
};

/// The impulses of the contacts of one body, or of bodies that touch each other, at one moment.
class ContactSolver {
public:
    /// @param bodies that contacts name by their index
    /// @param room   for as many contacts as will be taken
    ContactSolver(std::span<SolverBody> bodies, std::span<ContactRows> room)
        : bodies_(bodies), room_(room) {}

    /// Takes a contact; none where the room is full.
    void add(const SolverContact& contact);
    bool empty() const { return count_ == 0; }

    /// Changes the velocities so that no contact closes to less than its rest gap within `duration`:
    /// contacts with less gap do not close at all. The bodies' energy never grows.
    ///
    /// @param members      the bodies that the contacts name and that move
    /// @param bounce_speed contacts that approach more slowly do not bounce, m/s
    void solve_velocity(std::span<const std::uint32_t> members, double bounce_speed,
                        double duration, const SolverEffort& effort);

    /// The impulse of a contact on its body a in the last solve_velocity(), N s.
    Eigen::Vector3d impulse(std::size_t contact) const;

    /// Makes the velocities, which must be zero, the displacements that open every contact with less than its
    /// wanted gap half the way to it, and no contact by more than `max_distance`.
    /// @param may_turn false: by translations alone
    void solve_separation(double max_distance, bool may_turn);

private:
    using Row = ContactRows::Row;

    static Row make_row(const SolverContact& contact, const SolverBody& a, const SolverBody* b,
                        const Eigen::Vector3d& direction);
    static double speed(const ContactRows& contact, const Row& row);
    static void apply(const ContactRows& contact, const Row& row, double impulse);
    static double push(ContactRows& contact);
    static double rub(ContactRows& contact);
    std::span<ContactRows> contacts() const { return room_.first(count_); }
    bool aim(double duration);
    void iterate(const SolverEffort& effort, double tolerance);
    double energy(std::span<const std::uint32_t> members) const;
    void slow_down(std::span<const std::uint32_t> members, double scale);

    std::span<SolverBody> bodies_;
    std::span<ContactRows> room_;
    std::size_t count_ = 0;
};

}  // namespace terrane::internal
