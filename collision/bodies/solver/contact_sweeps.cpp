// SPDX-License-Identifier: MIT
//
// Sources:    Catto. Iterative dynamics with temporal coherence. GDC 2005 (sequential impulses).
//             Saad. Iterative methods for sparse linear systems. 2003, chapter 11 (level scheduling).
// Deviations: the levels are for the processor, not for threads: a contact has to wait for the one before it only where
//             they share a body, and the contacts of a level share none. Each body meets its contacts in the order in
//             which they were added, so that the levels change no result.
#include "bodies/solver/contact_solver.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

/// A contact is solved from the start if it closes at this share of its allowed speed.
constexpr double kActiveShare = 0.5;

/// Speed of a row whose bodies' changes are a and b.
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
        // Sliding: one effective mass for both rows, so that friction opposes the slip.
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

/// Sorts the contacts: those of two moving bodies first, then by level. Contacts of one level have no body in common,
/// and each is in a higher level than those with its bodies that were added before it.
void ContactSolver::sort_by_level() {
    const std::span<ContactRows> rows = contacts();
    // Number of contacts of each kind and level, then where the next of them goes.
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

/// Contacts that have an impulse, or that close at half of their allowed speed. Most contacts of a moving body cannot
/// close in a substep: they are solved only if the others make them.
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

/// Adds the contacts that close faster than allowed. Returns whether there are any.
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

/// Calls solve_pair for the active contacts of two moving bodies, then solve_single for the others; or backwards.
/// Returns the largest change of a speed.
double ContactSolver::visit(bool is_forward, const auto& solve_pair, const auto& solve_single) {
    ContactRows* const rows = room_.data();
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

/// @param duration of the motion ahead: the impulses change the spin, and with it the targets, which are set anew once;
///                 0 where they are fixed
void ContactSolver::iterate(double duration, const StoppingRule& rule, double tolerance) {
    activate_closing();
    restart_directions();
    bool may_retarget = duration > 0.0;
    int next_check = 1;
    double change_before = std::numeric_limits<double>::infinity();
    for (int iteration = 1; iteration <= rule.iterations; ++iteration) {
        // Alternating order: a sweep propagates a load through a stack in one direction only.
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
