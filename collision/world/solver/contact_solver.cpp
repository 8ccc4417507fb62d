// SPDX-License-Identifier: MIT
#include "world/solver/contact_solver.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr int kSeparationIterations = 12;
/// With conjugate directions: maximum number of sweep pairs, and convergence tolerance relative to the largest
/// permitted displacement.
constexpr int kConjugateSeparationIterations = 100;
constexpr double kSeparationTolerance = 1e-6;

}  // namespace

double ContactSolver::energy(std::span<const std::uint32_t> members) const {
    double energy = 0.0;
    for (const std::uint32_t member : members) {
        const SolverBody& body = bodies_[member];
        energy += kinetic_energy(body.mass_, body.pose_, body.velocity);
    }
    return energy;
}

/// Scales the velocities relative to the common centre of mass. If a contact is with the ground or a body of infinite
/// mass, momentum is not conserved, and the absolute velocities are scaled.
void ContactSolver::scale_velocities(std::span<const std::uint32_t> members, double scale) {
    bool is_free = true;
    for (const ContactRows& contact : contacts()) {
        is_free = is_free && contact.second_ != nullptr;
    }
    Eigen::Vector3d drift = Eigen::Vector3d::Zero();
    if (is_free) {
        double mass = 0.0;
        for (const std::uint32_t member : members) {
            const SolverBody& body = bodies_[member];
            mass += 1.0 / body.mass().inverse_mass;
            drift += body.velocity.linear / body.mass().inverse_mass;
        }
        drift /= mass;
        // The motion of the centre keeps its energy, so the relative motion must lose the whole difference.
        const double of_drift = 0.5 * mass * dot(drift, drift);
        const double now = energy(members), rest = now - of_drift;
        scale = rest > 0.0 ? std::sqrt(std::max(0.0, scale * scale * now - of_drift) / rest) : 0.0;
    }
    for (const std::uint32_t member : members) {
        Twist& velocity = bodies_[member].velocity;
        velocity.linear = drift + (velocity.linear - drift) * scale;
        velocity.angular *= scale;
    }
}

bool ContactSolver::begin_solve(double duration, const StoppingRule& rule, double& tolerance_out) {
    begin();
    set_targets(duration);
    bool closes = false;
    double largest_speed = 0.0;
    for (ContactRows& contact : contacts()) {
        contact.approach_speed_ = -contact.normal_.start_speed;
        contact.least_impulse_ = 0.0;
        largest_speed = std::max(largest_speed, std::abs(contact.approach_speed_));
        closes = closes || contact.approach_speed_ > contact.allowed_closing_ + kClosingSlack;
    }
    if (!closes) {
        for (ContactRows& contact : contacts()) {
            contact.normal_.impulse = contact.tangent_.impulse = contact.bitangent_.impulse = 0.0;
        }
    }
    tolerance_out = rule.tolerance * std::max(1.0, largest_speed);
    return closes;
}

void ContactSolver::iterate_from_warm_start(double duration, const StoppingRule& rule,
                                            double tolerance) {
    for (ContactRows& contact : contacts()) {
        for (Row* row : {&contact.normal_, &contact.tangent_, &contact.bitangent_}) {
            if (row->impulse != 0.0) apply(contact, *row, row->impulse);
        }
    }
    iterate(duration, rule, tolerance);
    end();
}

bool ContactSolver::solve_plastic(std::span<const std::uint32_t> members, double duration,
                                  const StoppingRule& rule, double& removed_out) {
    removed_out = 0.0;
    double tolerance = 0.0;
    if (!begin_solve(duration, rule, tolerance)) return false;
    const double energy_before = energy(members);
    iterate_from_warm_start(duration, rule, tolerance);
    const double energy_after = energy(members);
    removed_out = std::max(0.0, energy_before - energy_after);
    if (energy_after > energy_before && !is_driven()) {
        scale_velocities(members, std::sqrt(energy_before / energy_after));
    }
    return true;
}

void ContactSolver::solve_restitution(std::span<const std::uint32_t> members,
                                      std::span<const double> separating_speeds, double max_energy,
                                      const StoppingRule& rule) {
    for (const std::uint32_t member : members) bodies_[member].plastic_ = bodies_[member].velocity;
    const double energy_before = energy(members);
    double largest_speed = 0.0;
    for (std::size_t i = 0; i < count_; ++i) {
        if (separating_speeds[i] < 0.0) continue;
        rows_[i].allowed_closing_ = -separating_speeds[i];
        largest_speed = std::max(largest_speed, separating_speeds[i]);
    }
    begin();
    iterate(0.0, rule, rule.tolerance * std::max(1.0, largest_speed));
    end();
    if (is_driven() || energy(members) - energy_before <= max_energy) return;
    // Finds the share of the velocity change, change = velocity - plastic, that adds max_energy: the kinetic energy of
    // plastic + share * change is energy_before + linear * share + square * share^2, with the coefficients below.
    double square = 0.0, sum = energy(members) - energy_before;
    for (const std::uint32_t member : members) {
        const SolverBody& body = bodies_[member];
        square += kinetic_energy(body.mass_, body.pose_,
                                 {body.velocity.linear - body.plastic_.linear,
                                  body.velocity.angular - body.plastic_.angular});
    }
    const double linear = sum - square;
    const double root = std::sqrt(std::max(0.0, linear * linear + 4.0 * square * max_energy));
    // The larger root, without cancellation.
    const double share =
        linear > 0.0 ? 2.0 * max_energy / (linear + root) : (root - linear) / (2.0 * square);
    for (const std::uint32_t member : members) {
        Twist &velocity = bodies_[member].velocity, &plastic = bodies_[member].plastic_;
        velocity.linear = plastic.linear + share * (velocity.linear - plastic.linear);
        velocity.angular = plastic.angular + share * (velocity.angular - plastic.angular);
    }
}

void ContactSolver::limit_kinetic_energy(std::span<const std::uint32_t> members, double most) {
    const double now = energy(members);
    if (now > most && !is_driven()) {
        scale_velocities(members, most > 0.0 ? std::sqrt(most / now) : 0.0);
    }
}

/// Whether a contact may add energy, because friction drives it or one of its bodies has infinite mass and moves.
bool ContactSolver::is_driven() const {
    const std::span<const ContactRows> rows = rows_.first(count_);
    return std::any_of(rows.begin(), rows.end(), [](const ContactRows& contact) {
        const auto drives = [](const SolverBody* body) {
            return body != nullptr && body->is_fixed() &&
                   !(body->velocity.linear.isZero(0.0) && body->velocity.angular.isZero(0.0));
        };
        return contact.slip_[0] != 0.0 || contact.slip_[1] != 0.0 || drives(contact.a_) ||
               drives(contact.b_);
    });
}

void ContactSolver::solve_velocity(std::span<const std::uint32_t> members, double bounce_speed,
                                   double duration, const StoppingRule& rule) {
    double tolerance = 0.0;
    if (!begin_solve(duration, rule, tolerance)) return;
    for (const std::uint32_t member : members) bodies_[member].before_ = bodies_[member].velocity;
    const double energy_before = energy(members);
    iterate_from_warm_start(duration, rule, tolerance);

    double bounce = 0.0;
    for (const std::uint32_t member : members) bodies_[member].plastic_ = bodies_[member].velocity;
    for (ContactRows& contact : contacts()) {
        if (contact.approach_speed_ <= bounce_speed ||
            contact.approach_speed_ <= contact.allowed_closing_) {
            continue;
        }
        contact.least_impulse_ = (1.0 + contact.restitution_) * contact.normal_.impulse;
        // If Poisson's impulses would add energy, the smallest restitution applies to all contacts.
        if (contact.restitution_ > 0.0) {
            bounce = bounce > 0.0 ? std::min(bounce, contact.restitution_) : contact.restitution_;
        }
    }
    if (bounce > 0.0) {
        begin();
        iterate(0.0, rule, tolerance);
        end();
        if (energy(members) > energy_before) {
            for (const std::uint32_t member : members) {
                SolverBody& body = bodies_[member];
                const Twist &before = body.before_, &plastic = body.plastic_;
                body.velocity.linear = plastic.linear + bounce * (plastic.linear - before.linear);
                body.velocity.angular =
                    plastic.angular + bounce * (plastic.angular - before.angular);
            }
        }
    }
    // Opening for a curved path may add energy, which is removed from all velocities.
    const double energy_after = energy(members);
    if (energy_after > energy_before) {
        scale_velocities(members, std::sqrt(energy_before / energy_after));
    }
}

void ContactSolver::solve_separation(double max_distance, bool may_turn) {
    for (ContactRows& contact : contacts()) {
        const double wanted =
            std::clamp(0.5 * (contact.target_gap_ - contact.gap_), 0.0, max_distance);
        // Contacts with a larger gap may close by half of the excess.
        contact.allowed_closing_ =
            wanted > 0.0 ? -wanted : 0.5 * (contact.gap_ - contact.target_gap_);
        contact.least_impulse_ = 0.0;
        Row& row = contact.normal_;
        row.impulse = row.start_speed = 0.0;
        contact.is_active_ = true;
        if (may_turn) continue;
        contact.arm_a_.setZero();
        contact.arm_b_.setZero();
        make_row(contact, row, contact.direction_[0]);
    }
    list_active();
    const bool is_conjugate = !directions_.empty();
    const int most = is_conjugate ? kConjugateSeparationIterations : kSeparationIterations;
    restart_directions();
    for (int i = 0; i < most; ++i) {
        if (is_conjugate && i > 0) step_along_directions();
        sweep_normals(true);
        if (is_conjugate && sweep_normals(false) <= kSeparationTolerance * max_distance) break;
    }
    end();
}

// Sources:    Catto. Iterative dynamics with temporal coherence. GDC 2005 (sequential impulses).
//             Saad. Iterative methods for sparse linear systems. 2003, chapter 11 (level scheduling).
// Deviations: levels serve instruction-level parallelism, not threads: contacts of a level share no body, so they do
//             not depend on each other. Each body's contacts are solved in the order in which they were added, so that
//             levels do not change results.

namespace {

/// Contacts that close at more than this share of their allowed speed are active from the start.
constexpr double kActiveShare = 0.5;

/// Speed of a row, given the velocity changes a and b of its bodies.
template <bool kHasSecond>
inline double speed_of(const auto& row, const Vector6& a, const Vector6& b) {
    Vector6::Pair sum = products(row.first, a);
    if constexpr (kHasSecond) sum += products(row.second, b);
    return row.start_speed + (sum[0] + sum[1]);
}

}  // namespace

template <bool kHasSecond>
inline double ContactSolver::solve_normal(ContactRows& contact) {
    Row& row = contact.normal_;
    Vector6& a = contact.first_->change_;
    Vector6& b = kHasSecond ? contact.second_->change_ : a;
    const double wanted = row.impulse - row.effective_mass * (speed_of<kHasSecond>(row, a, b) +
                                                              contact.allowed_closing_);
    const double next = std::max(wanted, contact.least_impulse_);
    const double change = next - row.impulse;
    row.impulse = next;
    add_scaled(a, row.first, change);
    if constexpr (kHasSecond) add_scaled(b, row.second, change);
    return std::abs(change) * row.inverse_effective_mass;
}

template <bool kHasSecond>
inline double ContactSolver::solve_friction(ContactRows& contact) {
    Row& u = contact.tangent_;
    Row& v = contact.bitangent_;
    const double limit =
        std::min(contact.friction_ * contact.normal_.impulse, contact.max_friction_impulse_);
    if (limit == 0.0 && u.impulse == 0.0 && v.impulse == 0.0) return 0.0;
    Vector6& a = contact.first_->change_;
    Vector6& b = kHasSecond ? contact.second_->change_ : a;
    const double speed_u = speed_of<kHasSecond>(u, a, b);
    const double speed_v = speed_of<kHasSecond>(v, a, b);
    double wanted_u = u.impulse - u.effective_mass * speed_u;
    double wanted_v = v.impulse - v.effective_mass * speed_v;
    const double limit_square = limit * limit;
    if (wanted_u * wanted_u + wanted_v * wanted_v > limit_square) {
        // Sliding: one effective mass for both rows makes friction oppose the slip.
        const double mass = std::min(u.effective_mass, v.effective_mass);
        wanted_u = u.impulse - mass * speed_u;
        wanted_v = v.impulse - mass * speed_v;
        const double square = wanted_u * wanted_u + wanted_v * wanted_v;
        if (square > limit_square) {
            const double scale = limit / std::sqrt(square);
            wanted_u *= scale;
            wanted_v *= scale;
        }
    }
    const double change_u = wanted_u - u.impulse;
    const double change_v = wanted_v - v.impulse;
    u.impulse = wanted_u;
    v.impulse = wanted_v;
    add_scaled(a, u.first, change_u, v.first, change_v);
    if constexpr (kHasSecond) add_scaled(b, u.second, change_u, v.second, change_v);
    return std::max(std::abs(change_u) * u.inverse_effective_mass,
                    std::abs(change_v) * v.inverse_effective_mass);
}

/// Sorts the contacts: contacts of two moving bodies come first, and each kind is sorted by level. Contacts of a level
/// have no body in common, and each has a higher level than earlier contacts of its bodies.
void ContactSolver::sort_by_level() {
    const std::span<ContactRows> rows = contacts();
    // First the number of contacts of a kind and level, then the position of the next of them.
    const auto slot = [&](const ContactRows& contact) -> std::uint32_t& {
        return rows[contact.level_].slots_[contact.second_ != nullptr ? 0 : 1];
    };
    for (ContactRows& contact : rows) contact.slots_[0] = contact.slots_[1] = 0;
    std::uint32_t level_count = 0;
    for (const ContactRows& contact : rows) {
        ++slot(contact);
        level_count = std::max(level_count, contact.level_ + 1);
    }
    std::uint32_t start = 0;
    for (const int kind : {0, 1}) {
        for (std::uint32_t level = 0; level < level_count; ++level) {
            std::uint32_t& next = rows[level].slots_[kind];
            start += next;
            next = start - next;
        }
    }
    for (std::uint32_t i = 0; i < count_; ++i) rows[slot(rows[i])++].sorted_ = i;
    is_sorted_ = true;
}

void ContactSolver::list_active() {
    if (!is_sorted_) sort_by_level();
    const std::span<ContactRows> rows = contacts();
    std::uint32_t active = 0, pairs = 0;
    for (std::size_t i = 0; i < count_; ++i) {
        const ContactRows& contact = rows[rows[i].sorted_];
        if (!contact.is_active_) continue;
        if (contact.second_ != nullptr) ++pairs;
        rows[active++].visit_ = rows[i].sorted_;
    }
    active_count_ = active;
    pair_count_ = pairs;
}

/// Activates contacts that have an impulse or close at half of their allowed speed. Most contacts of a moving body
/// cannot close in a substep; they are solved only if other contacts make them close.
void ContactSolver::activate_closing() {
    for (ContactRows& contact : contacts()) {
        const bool has_impulse = contact.normal_.impulse != 0.0 ||
                                 contact.tangent_.impulse != 0.0 ||
                                 contact.bitangent_.impulse != 0.0;
        const double approach = -speed(contact, contact.normal_);
        contact.is_active_ = has_impulse || kActiveShare * contact.allowed_closing_ < approach;
    }
    list_active();
}

/// Activates contacts that close faster than allowed. Returns whether there are any.
bool ContactSolver::activate_violated() {
    if (active_count_ == count_) return false;
    bool is_violated = false;
    for (ContactRows& contact : contacts()) {
        if (contact.is_active_ ||
            !(-speed(contact, contact.normal_) > contact.allowed_closing_ + kClosingSlack)) {
            continue;
        }
        contact.is_active_ = is_violated = true;
    }
    if (is_violated) list_active();
    return is_violated;
}

/// Calls solve_pair for the active contacts of two moving bodies, then solve_single for the others, or both in reverse
/// order. Returns the largest change of speed.
double ContactSolver::visit(bool is_forward, const auto& solve_pair, const auto& solve_single) {
    ContactRows* const rows = rows_.data();
    double change = 0.0;
    if (is_forward) {
        std::size_t i = 0;
        for (; i < pair_count_; ++i) change = std::max(change, solve_pair(rows[rows[i].visit_]));
        for (; i < active_count_; ++i)
            change = std::max(change, solve_single(rows[rows[i].visit_]));
    } else {
        std::size_t i = active_count_;
        while (i > pair_count_) change = std::max(change, solve_single(rows[rows[--i].visit_]));
        while (i > 0) change = std::max(change, solve_pair(rows[rows[--i].visit_]));
    }
    return change;
}

double ContactSolver::sweep_friction(bool is_forward) {
    return visit(
        is_forward, [](ContactRows& contact) { return solve_friction<true>(contact); },
        [](ContactRows& contact) { return solve_friction<false>(contact); });
}

double ContactSolver::sweep_normals(bool is_forward) {
    return visit(
        is_forward, [](ContactRows& contact) { return solve_normal<true>(contact); },
        [](ContactRows& contact) { return solve_normal<false>(contact); });
}

/// Sweeps until `rule` stops it. Updates the targets once, because impulses change the spin on which they depend.
/// @param duration of the motion ahead, seconds; 0 if the targets are fixed
void ContactSolver::iterate(double duration, const StoppingRule& rule, double tolerance) {
    activate_closing();
    restart_directions();
    bool may_retarget = duration > 0.0;
    int next_check = 1;
    double change_before = std::numeric_limits<double>::infinity();
    for (int iteration = 1; iteration <= rule.iterations; ++iteration) {
        // Alternating order, because a sweep propagates loads through a stack in one direction only.
        const bool is_forward = iteration % 2 == 1;
        const double slip = sweep_friction(is_forward);
        const double change = std::max(slip, sweep_normals(is_forward));
        bool is_done = change <= tolerance;
        if (is_done || iteration == next_check) {
            next_check = 2 * iteration;
            if (may_retarget && (is_done || 2 * next_check > rule.iterations)) {
                may_retarget = false;
                if (set_targets(duration) > tolerance) is_done = false;
            }
            if (activate_violated()) is_done = false;
        }
        if (is_done) return;
        if (!directions_.empty() && !is_forward && iteration < rule.iterations) {
            step_along_directions();
        }
        if (iteration % rule.patience != 0) continue;
        if (change > 0.9 * change_before) return;
        change_before = change;
    }
}

}  // namespace terrane::internal
