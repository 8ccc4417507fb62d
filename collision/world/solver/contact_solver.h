// SPDX-License-Identifier: MIT
#pragma once

#include "world/solver/solver_body.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

// Sources:    Catto. Iterative dynamics with temporal coherence. GDC 2005 (sequential impulses, warm start).
//             Stewart. Rigid-body dynamics with friction and impact. SIAM Review 2000, section 2
//             (Poisson's restitution, and conditions under which it adds energy).
// Deviations: restitution follows a plastic solve, so that its energy can be checked: if Poisson's impulses would add
//             energy, the plastic impulses are scaled by 1 + restitution instead, which provably adds none.
namespace terrane::internal {

inline constexpr double kClosingSlack =
    1e-11;  // m/s: a smaller excess of closing speed is rounding

/// Largest speed at which overlaps are separated, m/s. Separation does not change velocities.
inline constexpr double kSeparationSpeed = 0.5;

/// Approach speed below which contacts do not bounce, m/s: at least the speed gained by the acceleration in four
/// substeps.
/// @param acceleration m/s^2, >= 0
inline double least_bounce_speed(double acceleration, double duration) {
    return std::max(0.1, 4.0 * acceleration * duration);
}

/// A contact of a body with the ground or another body.
struct SolverContact {
    static constexpr std::uint32_t kGround = ~std::uint32_t{0};
    static constexpr double kNoLimit = std::numeric_limits<double>::infinity();

    std::uint32_t a = 0;        ///< index of the body that the normal points into
    std::uint32_t b = kGround;  ///< index of the body that the normal points out of
    Eigen::Vector3d point_a = Eigen::Vector3d::Zero();  ///< on a, world
    Eigen::Vector3d point_b = Eigen::Vector3d::Zero();  ///< on b, world; unused for the ground
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit
    double rounding = 0.0;    ///< radius of a's surface at the contact, metres; 0 for a corner
    double gap = 0.0;         ///< metres; negative: overlap
    double rest_gap = 0.0;    ///< contacts may close to this gap, metres
    double target_gap = 0.0;  ///< separation opens the contact to this gap, metres
    double friction = 0.0;
    double max_friction_impulse = kNoLimit;  ///< N s
    /// Tangential velocity of a relative to b towards which friction drives, m/s, for example that of a conveyor belt.
    /// Its normal component is ignored.
    Eigen::Vector3d slip_velocity = Eigen::Vector3d::Zero();
    double restitution = 0.0;
    Eigen::Vector3d initial_impulse = Eigen::Vector3d::Zero();  ///< warm start: on a, N s
};

/// When the solver stops: on convergence, after `iterations` sweeps, or if `patience` sweeps reduce the largest change
/// of a speed by less than 10 %. It has converged if no speed changes in a sweep by more than `tolerance` times the
/// speed of the fastest approach, at least 1 m/s.
struct StoppingRule {
    int iterations = 0;
    double tolerance = 0.0;
    int patience = std::numeric_limits<int>::max();
};

/// The constraint rows of a contact, one normal and two tangential; filled by ContactSolver::add().
class alignas(64) ContactRows {
    friend class ContactSolver;
    /// Impulses along one direction, in the coordinates of SolverBody.
    struct Row {
        Vector6 first,
            second;          // change of each body per unit impulse; its transpose gives the speed
        double start_speed;  // of the contact along the direction at the start of the solve, m/s
        double inverse_effective_mass;  // relative speed per unit impulse, m/s
        double effective_mass;
        double impulse;
    };
    // Members read in sweeps come first.
    Row normal_, tangent_, bitangent_;
    SolverBody* first_;
    SolverBody* second_;  // null for the ground and for a body of infinite mass
    double friction_, max_friction_impulse_;
    double allowed_closing_;  // allowed closing speed, m/s
    double least_impulse_;    // of the normal row
    std::uint32_t level_;     // see ContactSolver::sort_by_level()
    std::uint32_t slots_[2];  // scratch of sort_by_level()
    std::uint32_t sorted_;    // in element i: index of the i-th contact in solution order
    std::uint32_t visit_;     // as sorted_, for active contacts only
    bool is_active_;
    const SolverBody* a_;
    const SolverBody* b_;            // null for the ground
    Eigen::Vector3d direction_[3];   // of the rows, world
    Eigen::Vector3d arm_a_, arm_b_;  // from the bodies' centres to the contact points, world
    Eigen::Vector3d core_arm_;  // from a's centre to the contact point moved inward by `rounding`
    double slip_[2];            // target tangential speeds of friction, m/s
    double gap_, rest_gap_, target_gap_;
    double restitution_;
    double approach_speed_;  // before the solve, m/s
};

/// State of the conjugate directions for a contact's normal, tangential and bitangential impulses, N s.
struct ContactDirection {
    std::array<double, 3> impulses{};   ///< after the last step
    std::array<double, 3> direction{};  ///< of the last step
};

/// Projected Gauss-Seidel solver for the contacts of one body or one island.
class ContactSolver {
public:
    /// @param bodies  indexed by SolverContact::a and b
    /// @param storage room for the contacts
    ContactSolver(std::span<SolverBody> bodies, std::span<ContactRows> storage)
        : bodies_(bodies), rows_(storage) {}

    /// Adds a contact; ignores it if the storage is full.
    void add(const SolverContact& contact);
    bool empty() const { return count_ == 0; }
    /// Enables steps along conjugate directions between sweeps: sweeps alone converge slowly if a light body bears
    /// heavy ones. Call after adding all contacts.
    ///
    /// @param members the moving bodies of the contacts; they outlive the solver
    /// @param storage [contacts] room for the directions
    void use_conjugate_directions(std::span<const std::uint32_t> members,
                                  std::span<ContactDirection> storage) {
        direction_members_ = members;
        directions_ = storage;
    }
    /// Changes only the gap of a contact; the next solve starts from the impulses of the last one.
    void set_gap(std::size_t contact, double gap) { rows_[contact].gap_ = gap; }
    /// Moves the contact points on spinning bodies of infinite mass forward in time, to first order. Half a substep
    /// gives contacts the velocity at the middle of the substep, so that a body on a turntable hardly drifts outward.
    void turn_fixed_bodies(double time);
    /// Distance that a contact may close, metres; negative below its rest gap.
    double gap_to_rest(std::size_t contact) const {
        return rows_[contact].gap_ - rows_[contact].rest_gap_;
    }
    /// Whether separation would open a contact.
    bool is_below_target(std::size_t contact) const {
        return rows_[contact].gap_ < rows_[contact].target_gap_;
    }
    /// Closing speed of a contact due to the changes of the bodies' velocities, m/s.
    /// @param before_a, before_b velocities before the change; null: not changed
    double closing_speed(std::size_t contact, const Twist* before_a, const Twist* before_b) const;

    /// Changes the velocities so that no contact closes below its rest gap within `duration` seconds; contacts already
    /// below it do not close at all. The kinetic energy never grows.
    ///
    /// @param members      the moving bodies of the contacts
    /// @param bounce_speed contacts that close more slowly do not bounce, m/s
    void solve_velocity(std::span<const std::uint32_t> members, double bounce_speed,
                        double duration, const StoppingRule& rule);

    /// The plastic part of solve_velocity(): no contact bounces.
    ///
    /// @param removed_out kinetic energy removed, J, >= 0
    /// @return false if no contact closes faster than allowed: then all impulses are zero
    bool solve_plastic(std::span<const std::uint32_t> members, double duration,
                       const StoppingRule& rule, double& removed_out);

    /// Changes the velocities after solve_plastic() so that contacts separate at given speeds. The change is scaled
    /// down if the kinetic energy would grow by more than `max_energy` J.
    ///
    /// @param separating_speeds [contacts] m/s; negative: the contact does not bounce
    void solve_restitution(std::span<const std::uint32_t> members,
                           std::span<const double> separating_speeds, double max_energy,
                           const StoppingRule& rule);

    /// Scales the velocities down so that the kinetic energy is at most `most` J, unless a moving body of infinite mass
    /// or friction drives a contact.
    void limit_kinetic_energy(std::span<const std::uint32_t> members, double most);

    /// Approach speed of a contact before the last solve, m/s, and its normal impulse, N s.
    double approach_speed(std::size_t contact) const { return rows_[contact].approach_speed_; }
    double normal_impulse(std::size_t contact) const { return rows_[contact].normal_.impulse; }

    /// Impulse of a contact on its body a in the last solve, N s.
    Eigen::Vector3d impulse(std::size_t contact) const;

    /// Writes displacements into the velocities, which must be zero. Every contact with a gap below its target is
    /// opened by half of the missing distance, at most `max_distance` metres.
    /// @param may_turn if false, displacements are translations
    void solve_separation(double max_distance, bool may_turn);

private:
    using Row = ContactRows::Row;

    void make_row(ContactRows& contact, Row& row, const Eigen::Vector3d& direction) const;
    static double speed(const ContactRows& contact, const Row& row);
    static void apply(ContactRows& contact, Row& row, double impulse);
    template <bool kHasSecond>
    static double solve_normal(ContactRows& contact);
    template <bool kHasSecond>
    static double solve_friction(ContactRows& contact);
    std::span<ContactRows> contacts() const { return rows_.first(count_); }
    void begin();
    void end();
    double set_targets(double duration);
    bool begin_solve(double duration, const StoppingRule& rule, double& tolerance_out);
    void iterate_from_warm_start(double duration, const StoppingRule& rule, double tolerance);
    bool is_driven() const;
    void iterate(double duration, const StoppingRule& rule, double tolerance);
    double visit(bool is_forward, const auto& solve_pair, const auto& solve_single);
    double sweep_friction(bool is_forward);
    double sweep_normals(bool is_forward);
    void activate_closing();
    bool activate_violated();
    static std::array<double, 3> impulses_of(const ContactRows& contact) {
        return {contact.normal_.impulse, contact.tangent_.impulse, contact.bitangent_.impulse};
    }
    void restart_directions();
    void turn_directions(double share_of_last);
    double best_step_length() const;
    void step_along_directions();
    void sort_by_level();
    void list_active();
    double energy(std::span<const std::uint32_t> members) const;
    void scale_velocities(std::span<const std::uint32_t> members, double scale);

    std::span<SolverBody> bodies_;
    std::span<ContactRows> rows_;
    std::size_t count_ = 0;
    bool is_sorted_ = false;
    std::size_t active_count_ = 0;  // contacts that sweeps visit
    std::size_t pair_count_ = 0;    // contacts of two moving bodies, which come first
    std::span<const std::uint32_t> direction_members_;
    std::span<ContactDirection> directions_;  // [contacts]; empty: sweeps only
    double last_gradient_square_ = 0.0;       // squared norm of the last gradient, J
};

}  // namespace terrane::internal
