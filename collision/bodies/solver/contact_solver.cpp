// SPDX-License-Identifier: MIT
#include "bodies/solver/contact_solver.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr int kSeparationIterations = 12;
constexpr double kClosingSlack = 1e-11;  // m/s: closing faster than allowed by less is rounding

/// How far the end of an arm leaves its straight path against the normal, for small turns: m/s^2.
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
    double give = a.mass.inverse_mass + dot(row.moment, row.spin);
    if (b != nullptr) {
        row.other_moment = cross(contact.point_b - b->pose.translation, direction);
        row.other_spin = apply_tensor(b->pose.rotation, b->mass.inverse_inertia, row.other_moment);
        give += b->mass.inverse_mass + dot(row.other_moment, row.other_spin);
    }
    row.give = give;
    row.effective_mass = 1.0 / give;
    row.impulse = dot(contact.guess, direction);
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
    // What nothing moves may belong to the contacts of others, and is not written.
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
    // A guess for another normal has a share along this one's surface, which nothing would take back.
    if (!(contact.friction > 0.0)) rows.tangent_.impulse = rows.bitangent_.impulse = 0.0;
    rows.core_arm_ =
        contact.point_a - rows.a_->pose.translation + contact.rounding * contact.normal;
    rows.gap_ = contact.gap;
    rows.rest_gap_ = contact.rest_gap;
    rows.wanted_gap_ = contact.wanted_gap;
    rows.friction_ = contact.friction;
    rows.restitution_ = contact.restitution;
}

inline double ContactSolver::push(ContactRows& contact) {
    Row& row = contact.normal_;
    const double wanted =
        row.impulse - row.effective_mass * (speed(contact, row) + contact.allowed_closing_);
    const double change = std::max(wanted, contact.least_impulse_) - row.impulse;
    row.impulse += change;
    apply(contact, row, change);
    return std::abs(change) * row.give;
}

inline double ContactSolver::rub(ContactRows& contact) {
    Row& u = contact.tangent_;
    Row& v = contact.bitangent_;
    const double limit = contact.friction_ * contact.normal_.impulse;
    if (limit == 0.0 && u.impulse == 0.0 && v.impulse == 0.0) return 0.0;
    const double speed_u = speed(contact, u), speed_v = speed(contact, v);
    double wanted_u = u.impulse - u.effective_mass * speed_u;
    double wanted_v = v.impulse - v.effective_mass * speed_v;
    const double limit_square = limit * limit;
    if (wanted_u * wanted_u + wanted_v * wanted_v > limit_square) {
        // It slides, and friction is against the slip, whichever way the bodies give more.
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
    return std::max(std::abs(change_u) * u.give, std::abs(change_v) * v.give);
}

void ContactSolver::iterate(const SolverEffort& effort, double tolerance) {
    const std::span<ContactRows> rows = contacts();
    double change_before = std::numeric_limits<double>::infinity();
    for (int iteration = 0; iteration < effort.iterations; ++iteration) {
        // Up and down in turns: a sweep carries a load from one end of a stack to the other only one way.
        const auto at = [&](std::size_t i) -> ContactRows& {
            return rows[iteration % 2 == 0 ? i : rows.size() - 1 - i];
        };
        double change = 0.0;
        for (std::size_t i = 0; i < rows.size(); ++i) {
            if (at(i).friction_ > 0.0) change = std::max(change, rub(at(i)));
        }
        for (std::size_t i = 0; i < rows.size(); ++i) change = std::max(change, push(at(i)));
        if (change <= tolerance) return;
        if ((iteration + 1) % effort.patience != 0) continue;
        if (change > 0.9 * change_before) return;
        change_before = change;
    }
}

/// Sets how fast each contact may close. A turning body carries its corners round: where that bends a path
/// into the ground, the contact has to open by half of the bend, so that it has opened and closed as much by
/// the end. Bodies that touch each other may be overlapped by as little. Returns whether a contact closes faster
/// than it may.
bool ContactSolver::aim(double duration) {
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

/// Scales what the bodies' velocities have over that of their common centre of mass; all of it where they
/// touch what gives and takes momentum.
void ContactSolver::slow_down(std::span<const std::uint32_t> members, double scale) {
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

void ContactSolver::solve_velocity(std::span<const std::uint32_t> members, double bounce_speed,
                                   double duration, const SolverEffort& effort) {
    const bool closes = aim(duration);
    double largest_speed = 0.0;
    for (ContactRows& contact : contacts()) {
        contact.approach_speed_ = -speed(contact, contact.normal_);
        contact.least_impulse_ = 0.0;
        largest_speed = std::max(largest_speed, std::abs(contact.approach_speed_));
        if (!closes) {
            contact.normal_.impulse = contact.tangent_.impulse = contact.bitangent_.impulse = 0.0;
        }
    }
    if (!closes) return;

    for (const std::uint32_t member : members) bodies_[member].before = bodies_[member].velocity;
    const double energy_before = energy(members);
    const double tolerance = effort.tolerance * std::max(1.0, largest_speed);
    for (const ContactRows& contact : contacts()) {
        for (const Row* row : {&contact.normal_, &contact.tangent_, &contact.bitangent_}) {
            if (row->impulse != 0.0) apply(contact, *row, row->impulse);
        }
    }
    // The blow changes the spin, and with it the bends.
    iterate(effort, tolerance);
    if (aim(duration)) iterate(effort, tolerance);

    double bounce = 0.0;
    for (const std::uint32_t member : members) bodies_[member].plastic = bodies_[member].velocity;
    for (ContactRows& contact : contacts()) {
        if (contact.approach_speed_ <= bounce_speed ||
            contact.approach_speed_ <= contact.allowed_closing_) {
            continue;
        }
        contact.least_impulse_ = (1.0 + contact.restitution_) * contact.normal_.impulse;
        // The least that bounces decides where impulses would give energy.
        if (contact.restitution_ > 0.0) {
            bounce = bounce > 0.0 ? std::min(bounce, contact.restitution_) : contact.restitution_;
        }
    }
    if (bounce > 0.0) {
        iterate(effort, tolerance);
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
    // Opening for a bend costs nothing in truth, and may here: it is paid for by all of the velocity.
    const double energy_after = energy(members);
    if (energy_after > energy_before) {
        slow_down(members, std::sqrt(energy_before / energy_after));
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
            std::clamp(0.5 * (contact.wanted_gap_ - contact.gap_), 0.0, max_distance);
        // A contact with gap to spare may close by half of what it has.
        contact.allowed_closing_ =
            wanted > 0.0 ? -wanted : 0.5 * (contact.gap_ - contact.wanted_gap_);
        contact.least_impulse_ = 0.0;
        Row& row = contact.normal_;
        row.impulse = 0.0;
        if (may_turn) continue;
        row.moment.setZero();
        row.spin.setZero();
        double give = contact.a_->mass.inverse_mass;
        if (contact.b_ != nullptr) {
            row.other_moment.setZero();
            row.other_spin.setZero();
            give += contact.b_->mass.inverse_mass;
        }
        row.effective_mass = 1.0 / give;
    }
    for (int iteration = 0; iteration < kSeparationIterations; ++iteration) {
        for (ContactRows& contact : contacts()) push(contact);
    }
}

}  // namespace terrane::internal
