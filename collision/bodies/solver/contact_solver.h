// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/solver/mass_properties.h"
#include "math/vector_math.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

// Sources:    Catto. Iterative dynamics with temporal coherence. GDC 2005 (sequential impulses, warm start).
//             Stewart. Rigid-body dynamics with friction and impact. SIAM Review 2000, section 2
//             (Poisson's restitution, and when it adds energy).
// Deviations: a plastic solve comes first and restitution after it, so that the energy can be checked: where Poisson's
//             impulses would add energy, the plastic impulses are scaled by 1 + restitution instead, which
//             provably adds none.
namespace terrane::internal {

/// Velocity or small displacement of a rigid body: of its centre of mass, and about it, in world axes.
struct Twist {
    Eigen::Vector3d linear = Eigen::Vector3d::Zero();
    Eigen::Vector3d angular = Eigen::Vector3d::Zero();
};

double kinetic_energy(const MassProperties& mass, const Pose& pose, const Twist& velocity);

/// The solver's copy of a body.
struct SolverBody {
    MassProperties mass;
    Pose pose;  ///< at which the contact points were computed
    Twist velocity;
    Twist before, plastic;  ///< scratch of the solver
};

/// A contact of a body with the ground, or with another body.
struct SolverContact {
    static constexpr std::uint32_t kGround = ~std::uint32_t{0};
    static constexpr double kNoLimit = std::numeric_limits<double>::infinity();

    std::uint32_t a = 0;        ///< index of the body that the normal points into
    std::uint32_t b = kGround;  ///< index of the body that it points out of
    Eigen::Vector3d point_a = Eigen::Vector3d::Zero();  ///< on a, world
    Eigen::Vector3d point_b = Eigen::Vector3d::Zero();  ///< on b, world; unused for the ground
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit
    double rounding = 0.0;    ///< radius of a's surface at the contact, metres; 0 for a corner
    double gap = 0.0;         ///< metres; negative: overlap
    double rest_gap = 0.0;    ///< the contact may close to this gap, metres
    double target_gap = 0.0;  ///< separation opens the contact to this gap, metres
    double friction = 0.0;
    double max_friction_impulse = kNoLimit;  ///< N s
    /// Tangential velocity of a relative to b that friction drives them to, m/s: a belt's. Its normal part is not used.
    Eigen::Vector3d slip_velocity = Eigen::Vector3d::Zero();
    double restitution = 0.0;
    Eigen::Vector3d initial_impulse = Eigen::Vector3d::Zero();  ///< warm start: on a, N s
};

/// When the solver stops: converged, i.e. no velocity changes by more than `tolerance` of the fastest approach in a
/// sweep; or `iterations` sweeps; or that change has fallen by less than a tenth in `patience` sweeps.
struct StoppingRule {
    int iterations = 0;
    double tolerance = 0.0;
    int patience = std::numeric_limits<int>::max();
};

/// The constraint rows of a contact, one normal and two tangential; made by ContactSolver::add().
class ContactRows {
    friend class ContactSolver;
    struct Row {
        Eigen::Vector3d direction;     // of the impulse on a, world
        Eigen::Vector3d moment, spin;  // of a: arm x direction; inverse inertia * moment
        Eigen::Vector3d other_moment, other_spin;  // of b; not set for the ground
        double inverse_effective_mass;             // relative speed of a unit impulse, m/s
        double effective_mass;
        double impulse;
    };
    Row normal_, tangent_, bitangent_;
    SolverBody* a_;
    SolverBody* b_;             // null for the ground
    Eigen::Vector3d core_arm_;  // from a's centre to the contact point moved inside by the rounding
    double gap_, rest_gap_, target_gap_;
    double friction_, restitution_;
    double max_friction_impulse_;
    double slip_tangent_, slip_bitangent_;  // speeds that friction drives to, m/s
    double allowed_closing_;                // closing speed, m/s
    double least_impulse_;                  // of the normal row
    double approach_speed_;                 // before the solve, m/s
    std::uint32_t active_;                  // in element i: index of the i-th active contact
};

/// Projected Gauss-Seidel solver for the contacts of one body or one island.
class ContactSolver {
public:
    /// @param bodies indexed by SolverContact::a and b
    /// @param room   storage for the contacts
    ContactSolver(std::span<SolverBody> bodies, std::span<ContactRows> room)
        : bodies_(bodies), room_(room) {}

    /// Adds a contact; ignored where the room is full.
    void add(const SolverContact& contact);
    bool empty() const { return count_ == 0; }

    /// Changes the velocities so that no contact closes to less than its rest gap within `duration` seconds; contacts
    /// with a smaller gap do not close at all. The kinetic energy never grows.
    ///
    /// @param members      the moving bodies of the contacts
    /// @param bounce_speed contacts that approach more slowly do not bounce, m/s
    void solve_velocity(std::span<const std::uint32_t> members, double bounce_speed,
                        double duration, const StoppingRule& rule);

    /// The plastic part of solve_velocity(): no contact bounces.
    ///
    /// @param removed_out the kinetic energy that it has removed, J, >= 0
    /// @return false where no contact closes faster than allowed: all impulses are zero
    bool solve_plastic(std::span<const std::uint32_t> members, double duration,
                       const StoppingRule& rule, double& removed_out);

    /// Changes the velocities after solve_plastic() so that contacts separate at given speeds. Where the kinetic
    /// energy would grow by more than `max_energy` J the change is made in part.
    ///
    /// @param separating_speeds [contacts] m/s; negative: the contact does not bounce
    void solve_restitution(std::span<const std::uint32_t> members,
                           std::span<const double> separating_speeds, double max_energy,
                           const StoppingRule& rule);

    /// Scales the velocities down so that the kinetic energy is at most `most` J, unless a moving body of infinite mass
    /// drives the others.
    void limit_kinetic_energy(std::span<const std::uint32_t> members, double most);

    /// Speed at which the bodies of a contact approached before the last solve, m/s; and its normal impulse, N s.
    double approach_speed(std::size_t contact) const { return room_[contact].approach_speed_; }
    double normal_impulse(std::size_t contact) const { return room_[contact].normal_.impulse; }

    /// Impulse of a contact on its body a in the last solve, N s.
    Eigen::Vector3d impulse(std::size_t contact) const;

    /// Writes displacements into the velocities, which must be zero: they open every contact below its target gap by
    /// half of what is missing, and by at most `max_distance` metres.
    /// @param may_turn false: translations only
    void solve_separation(double max_distance, bool may_turn);

private:
    using Row = ContactRows::Row;

    static Row make_row(const SolverContact& contact, const SolverBody& a, const SolverBody* b,
                        const Eigen::Vector3d& direction);
    static double speed(const ContactRows& contact, const Row& row);
    static void apply(const ContactRows& contact, const Row& row, double impulse);
    static double solve_normal(ContactRows& contact);
    static double solve_friction(ContactRows& contact);
    std::span<ContactRows> contacts() const { return room_.first(count_); }
    bool set_targets(double duration);
    bool begin_solve(double duration, const StoppingRule& rule, double& tolerance_out);
    void iterate_from_warm_start(double duration, const StoppingRule& rule, double tolerance);
    bool is_driven() const;
    void iterate(const StoppingRule& rule, double tolerance);
    void iterate_active(const StoppingRule& rule, double tolerance);
    void activate_closing();
    bool activate_violated();
    double energy(std::span<const std::uint32_t> members) const;
    void scale_velocities(std::span<const std::uint32_t> members, double scale);

    std::span<SolverBody> bodies_;
    std::span<ContactRows> room_;
    std::size_t count_ = 0;
    std::size_t active_count_ = 0;  // contacts that iterate() visits
};

}  // namespace terrane::internal
