// SPDX-License-Identifier: MIT
#include "bodies/solver/contact_solver.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr int kSeparationIterations = 12;
/// A contact is solved from the start if it closes at this share of its allowed speed.
constexpr double kActiveShare = 0.5;
constexpr double kClosingSlack = 1e-11;  // m/s: closing too fast by less than this is rounding

/// Acceleration of the end of an arm against the normal by rotation, m/s^2.
double bend(const Eigen::Vector3d& normal, const Eigen::Vector3d& spin,
            const Eigen::Vector3d& arm) {
    return dot(spin, spin) * dot(normal, arm) - dot(normal, spin) * dot(spin, arm);
}

}  // namespace

double kinetic_energy(const MassProperties& mass, const Pose& pose, const Twist& velocity) {
    return 0.5 *
           (dot(velocity.linear, velocity.linear) / mass.inverse_mass +
            dot(velocity.angular, apply_tensor(pose.rotation, mass.inertia, velocity.angular)));
}

ContactSolver::Row ContactSolver::make_row(const SolverContact& contact, const SolverBody& a,
                                           const SolverBody* b, const Eigen::Vector3d& direction) {
    Row row;
    row.direction = direction;
    row.moment = cross(contact.point_a - a.pose.translation, direction);
    row.spin = apply_tensor(a.pose.rotation, a.mass.inverse_inertia, row.moment);
    double inverse_effective_mass = a.mass.inverse_mass + dot(row.moment, row.spin);
    if (b != nullptr) {
        row.other_moment = cross(contact.point_b - b->pose.translation, direction);
        row.other_spin = apply_tensor(b->pose.rotation, b->mass.inverse_inertia, row.other_moment);
        inverse_effective_mass += b->mass.inverse_mass + dot(row.other_moment, row.other_spin);
    }
    row.inverse_effective_mass = inverse_effective_mass;
    row.effective_mass = 1.0 / inverse_effective_mass;
    row.impulse = dot(contact.initial_impulse, direction);
    return row;
}

inline double ContactSolver::speed(const ContactRows& contact, const Row& row) {
    const Twist& a = contact.a_->velocity;
    double speed = dot(row.direction, a.linear) + dot(row.moment, a.angular);
    if (contact.b_ != nullptr) {
        const Twist& b = contact.b_->velocity;
        speed -= dot(row.direction, b.linear) + dot(row.other_moment, b.angular);
    }
    return speed;
}

inline void ContactSolver::apply(const ContactRows& contact, const Row& row, double impulse) {
    // Bodies of infinite mass may be shared with other islands and are not written.
    if (contact.a_->mass.inverse_mass > 0.0) {
        Twist& a = contact.a_->velocity;
        a.linear += row.direction * (impulse * contact.a_->mass.inverse_mass);
        a.angular += row.spin * impulse;
    }
    if (contact.b_ != nullptr && contact.b_->mass.inverse_mass > 0.0) {
        Twist& b = contact.b_->velocity;
        b.linear -= row.direction * (impulse * contact.b_->mass.inverse_mass);
        b.angular -= row.other_spin * impulse;
    }
}

void ContactSolver::add(const SolverContact& contact) {
    if (count_ == room_.size()) return;
    ContactRows& rows = room_[count_++];
    rows.a_ = &bodies_[contact.a];
    rows.b_ = contact.b == SolverContact::kGround ? nullptr : &bodies_[contact.b];
    const Eigen::Vector3d tangent = any_tangent(contact.normal);
    rows.normal_ = make_row(contact, *rows.a_, rows.b_, contact.normal);
    rows.tangent_ = make_row(contact, *rows.a_, rows.b_, tangent);
    rows.bitangent_ = make_row(contact, *rows.a_, rows.b_, cross(contact.normal, tangent));
    rows.normal_.impulse = std::max(0.0, rows.normal_.impulse);
    // The warm start of a changed normal has a tangential part, which a row without friction would never remove.
    if (!(contact.friction > 0.0)) rows.tangent_.impulse = rows.bitangent_.impulse = 0.0;
    rows.core_arm_ =
        contact.point_a - rows.a_->pose.translation + contact.rounding * contact.normal;
    rows.gap_ = contact.gap;
    rows.rest_gap_ = contact.rest_gap;
    rows.target_gap_ = contact.target_gap;
    rows.friction_ = contact.friction;
    rows.restitution_ = contact.restitution;
    rows.max_friction_impulse_ = contact.max_friction_impulse;
    rows.slip_tangent_ = dot(contact.slip_velocity, rows.tangent_.direction);
    rows.slip_bitangent_ = dot(contact.slip_velocity, rows.bitangent_.direction);
}

inline double ContactSolver::solve_normal(ContactRows& contact) {
    Row& row = contact.normal_;
    const double wanted =
        row.impulse - row.effective_mass * (speed(contact, row) + contact.allowed_closing_);
    const double change = std::max(wanted, contact.least_impulse_) - row.impulse;
    row.impulse += change;
    apply(contact, row, change);
    return std::abs(change) * row.inverse_effective_mass;
}

inline double ContactSolver::solve_friction(ContactRows& contact) {
    Row& u = contact.tangent_;
    Row& v = contact.bitangent_;
    const double limit =
        std::min(contact.friction_ * contact.normal_.impulse, contact.max_friction_impulse_);
    if (limit == 0.0 && u.impulse == 0.0 && v.impulse == 0.0) return 0.0;
    const double speed_u = speed(contact, u) - contact.slip_tangent_;
    const double speed_v = speed(contact, v) - contact.slip_bitangent_;
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
    apply(contact, u, change_u);
    apply(contact, v, change_v);
    return std::max(std::abs(change_u) * u.inverse_effective_mass,
                    std::abs(change_v) * v.inverse_effective_mass);
}

/// Contacts that have an impulse, or that close at half of their allowed speed.
void ContactSolver::activate_closing() {
    active_count_ = 0;
    for (std::uint32_t i = 0; i < count_; ++i) {
        const ContactRows& contact = room_[i];
        const bool has_impulse = contact.normal_.impulse != 0.0 ||
                                 contact.tangent_.impulse != 0.0 ||
                                 contact.bitangent_.impulse != 0.0;
        const double approach = -speed(contact, contact.normal_);
        if (has_impulse || kActiveShare * contact.allowed_closing_ < approach) {
            room_[active_count_++].active_ = i;
        }
    }
}

/// Adds all contacts if one that is not active closes faster than allowed.
bool ContactSolver::activate_violated() {
    if (active_count_ == count_) return false;
    const std::span<ContactRows> rows = contacts();
    const bool is_violated = std::any_of(rows.begin(), rows.end(), [](const ContactRows& contact) {
        return -speed(contact, contact.normal_) > contact.allowed_closing_ + kClosingSlack &&
               contact.normal_.impulse == 0.0;
    });
    if (!is_violated) return false;
    for (std::uint32_t i = 0; i < count_; ++i) room_[i].active_ = i;
    active_count_ = count_;
    return true;
}

/// Most contacts of a moving body cannot close in a substep: they are solved only if the others make them.
void ContactSolver::iterate(const StoppingRule& rule, double tolerance) {
    activate_closing();
    iterate_active(rule, tolerance);
    if (activate_violated()) iterate_active(rule, tolerance);
}

void ContactSolver::iterate_active(const StoppingRule& rule, double tolerance) {
    const std::span<ContactRows> rows = contacts();
    const std::size_t count = active_count_;
    double change_before = std::numeric_limits<double>::infinity();
    for (int iteration = 0; iteration < rule.iterations; ++iteration) {
        // Alternating order: a sweep propagates a load through a stack in one direction only.
        const auto at = [&](std::size_t i) -> ContactRows& {
            return rows[rows[iteration % 2 == 0 ? i : count - 1 - i].active_];
        };
        double change = 0.0;
        for (std::size_t i = 0; i < count; ++i) {
            if (at(i).friction_ > 0.0) change = std::max(change, solve_friction(at(i)));
        }
        for (std::size_t i = 0; i < count; ++i) {
            change = std::max(change, solve_normal(at(i)));
        }
        if (change <= tolerance) return;
        if ((iteration + 1) % rule.patience != 0) continue;
        if (change > 0.9 * change_before) return;
        change_before = change;
    }
}

/// Sets the allowed closing speed of each contact. Where rotation curves the path of a corner into the ground, the
/// contact must open at half of that acceleration times the duration, so that its gap at the end is that at the start.
/// Contacts between bodies may overlap by as much. Returns whether a contact closes faster than allowed.
bool ContactSolver::set_targets(double duration) {
    bool closes = false;
    for (ContactRows& contact : contacts()) {
        contact.allowed_closing_ = std::max(0.0, contact.gap_ - contact.rest_gap_) / duration;
        if (contact.b_ == nullptr) {
            contact.allowed_closing_ -=
                0.5 * duration *
                std::max(0.0, bend(contact.normal_.direction, contact.a_->velocity.angular,
                                   contact.core_arm_));
        }
        const double approach = -speed(contact, contact.normal_);
        closes = closes || approach > contact.allowed_closing_ + kClosingSlack;
    }
    return closes;
}

double ContactSolver::energy(std::span<const std::uint32_t> members) const {
    double energy = 0.0;
    for (const std::uint32_t member : members) {
        const SolverBody& body = bodies_[member];
        energy += kinetic_energy(body.mass, body.pose, body.velocity);
    }
    return energy;
}

/// Scales the velocities relative to that of the common centre of mass; the whole velocities where a contact is with
/// the ground or a body of infinite mass, where momentum is not conserved.
void ContactSolver::scale_velocities(std::span<const std::uint32_t> members, double scale) {
    bool is_free = true;
    for (const ContactRows& contact : contacts()) {
        is_free = is_free && contact.b_ != nullptr && contact.a_->mass.inverse_mass > 0.0 &&
                  contact.b_->mass.inverse_mass > 0.0;
    }
    Eigen::Vector3d drift = Eigen::Vector3d::Zero();
    if (is_free) {
        double mass = 0.0;
        for (const std::uint32_t member : members) {
            const SolverBody& body = bodies_[member];
            mass += 1.0 / body.mass.inverse_mass;
            drift += body.velocity.linear / body.mass.inverse_mass;
        }
        drift /= mass;
    }
    for (const std::uint32_t member : members) {
        Twist& velocity = bodies_[member].velocity;
        velocity.linear = drift + (velocity.linear - drift) * scale;
        velocity.angular *= scale;
    }
}

bool ContactSolver::begin_solve(double duration, const StoppingRule& rule, double& tolerance_out) {
    const bool closes = set_targets(duration);
    double largest_speed = 0.0;
    for (ContactRows& contact : contacts()) {
        contact.approach_speed_ = -speed(contact, contact.normal_);
        contact.least_impulse_ = 0.0;
        largest_speed = std::max(largest_speed, std::abs(contact.approach_speed_));
        if (!closes) {
            contact.normal_.impulse = contact.tangent_.impulse = contact.bitangent_.impulse = 0.0;
        }
    }
    tolerance_out = rule.tolerance * std::max(1.0, largest_speed);
    return closes;
}

void ContactSolver::iterate_from_warm_start(double duration, const StoppingRule& rule,
                                            double tolerance) {
    for (const ContactRows& contact : contacts()) {
        for (const Row* row : {&contact.normal_, &contact.tangent_, &contact.bitangent_}) {
            if (row->impulse != 0.0) apply(contact, *row, row->impulse);
        }
    }
    // The impulses change the spin, and with it the targets.
    iterate(rule, tolerance);
    if (set_targets(duration)) iterate(rule, tolerance);
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
    for (const std::uint32_t member : members) bodies_[member].plastic = bodies_[member].velocity;
    const double energy_before = energy(members);
    double largest_speed = 0.0;
    for (std::size_t i = 0; i < count_; ++i) {
        if (separating_speeds[i] < 0.0) continue;
        room_[i].allowed_closing_ = -separating_speeds[i];
        largest_speed = std::max(largest_speed, separating_speeds[i]);
    }
    iterate(rule, rule.tolerance * std::max(1.0, largest_speed));
    if (is_driven() || energy(members) - energy_before <= max_energy) return;
    // The energy of plastic + share * change is energy_before + share * linear + share^2 * square.
    double square = 0.0, sum = energy(members) - energy_before;
    for (const std::uint32_t member : members) {
        const SolverBody& body = bodies_[member];
        square += kinetic_energy(body.mass, body.pose,
                                 {body.velocity.linear - body.plastic.linear,
                                  body.velocity.angular - body.plastic.angular});
    }
    const double linear = sum - square;
    const double root = std::sqrt(std::max(0.0, linear * linear + 4.0 * square * max_energy));
    // The larger root, without cancellation.
    const double share =
        linear > 0.0 ? 2.0 * max_energy / (linear + root) : (root - linear) / (2.0 * square);
    for (const std::uint32_t member : members) {
        Twist &velocity = bodies_[member].velocity, &plastic = bodies_[member].plastic;
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

/// Whether a contact may add energy: friction drives it, or it is with a body of infinite mass that moves.
bool ContactSolver::is_driven() const {
    const std::span<const ContactRows> rows = room_.first(count_);
    return std::any_of(rows.begin(), rows.end(), [](const ContactRows& contact) {
        const auto drives = [](const SolverBody* body) {
            return body != nullptr && body->mass.inverse_mass == 0.0 &&
                   !(body->velocity.linear.isZero(0.0) && body->velocity.angular.isZero(0.0));
        };
        return contact.slip_tangent_ != 0.0 || contact.slip_bitangent_ != 0.0 ||
               drives(contact.a_) || drives(contact.b_);
    });
}

void ContactSolver::solve_velocity(std::span<const std::uint32_t> members, double bounce_speed,
                                   double duration, const StoppingRule& rule) {
    double tolerance = 0.0;
    if (!begin_solve(duration, rule, tolerance)) return;
    for (const std::uint32_t member : members) bodies_[member].before = bodies_[member].velocity;
    const double energy_before = energy(members);
    iterate_from_warm_start(duration, rule, tolerance);

    double bounce = 0.0;
    for (const std::uint32_t member : members) bodies_[member].plastic = bodies_[member].velocity;
    for (ContactRows& contact : contacts()) {
        if (contact.approach_speed_ <= bounce_speed ||
            contact.approach_speed_ <= contact.allowed_closing_) {
            continue;
        }
        contact.least_impulse_ = (1.0 + contact.restitution_) * contact.normal_.impulse;
        // The least restitution is used for all where Poisson's impulses would add energy.
        if (contact.restitution_ > 0.0) {
            bounce = bounce > 0.0 ? std::min(bounce, contact.restitution_) : contact.restitution_;
        }
    }
    if (bounce > 0.0) {
        iterate(rule, tolerance);
        if (energy(members) > energy_before) {
            for (const std::uint32_t member : members) {
                SolverBody& body = bodies_[member];
                const Twist &before = body.before, &plastic = body.plastic;
                body.velocity.linear = plastic.linear + bounce * (plastic.linear - before.linear);
                body.velocity.angular =
                    plastic.angular + bounce * (plastic.angular - before.angular);
            }
        }
    }
    // Opening for a curved path may add energy here: it is taken from all velocities.
    const double energy_after = energy(members);
    if (energy_after > energy_before) {
        scale_velocities(members, std::sqrt(energy_before / energy_after));
    }
}

Eigen::Vector3d ContactSolver::impulse(std::size_t contact) const {
    const ContactRows& rows = room_[contact];
    Eigen::Vector3d sum = rows.normal_.direction * rows.normal_.impulse;
    sum += rows.tangent_.direction * rows.tangent_.impulse;
    sum += rows.bitangent_.direction * rows.bitangent_.impulse;
    return sum;
}

void ContactSolver::solve_separation(double max_distance, bool may_turn) {
    for (ContactRows& contact : contacts()) {
        const double wanted =
            std::clamp(0.5 * (contact.target_gap_ - contact.gap_), 0.0, max_distance);
        // A contact with a larger gap may close by half of the excess.
        contact.allowed_closing_ =
            wanted > 0.0 ? -wanted : 0.5 * (contact.gap_ - contact.target_gap_);
        contact.least_impulse_ = 0.0;
        Row& row = contact.normal_;
        row.impulse = 0.0;
        if (may_turn) continue;
        row.moment.setZero();
        row.spin.setZero();
        double inverse_effective_mass = contact.a_->mass.inverse_mass;
        if (contact.b_ != nullptr) {
            row.other_moment.setZero();
            row.other_spin.setZero();
            inverse_effective_mass += contact.b_->mass.inverse_mass;
        }
        row.effective_mass = 1.0 / inverse_effective_mass;
    }
    for (int iteration = 0; iteration < kSeparationIterations; ++iteration) {
        for (ContactRows& contact : contacts()) solve_normal(contact);
    }
}

}  // namespace terrane::internal
