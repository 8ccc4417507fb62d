// SPDX-License-Identifier: MIT
//
// Sources:    Catto. Iterative dynamics with temporal coherence. GDC 2005 (rows of a contact, warm start).
// Deviations: velocities are scaled by the square roots of masses and inertias. In these coordinates the velocity
//             change by a unit impulse is the transpose of the row of the Jacobian, so that one vector serves as both.
//             A body of infinite mass has no scaled velocity. Therefore each row stores its speed at the start of a
//             solve, and each body its change of velocity since then.
#include "world/solver/contact_solver.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

/// Component against the normal of the centripetal acceleration of the end of an arm, m/s^2.
double bend(const Eigen::Vector3d& normal, const Eigen::Vector3d& spin,
            const Eigen::Vector3d& arm) {
    return dot(spin, spin) * dot(normal, arm) - dot(normal, spin) * dot(spin, arm);
}

}  // namespace

void ContactSolver::make_row(ContactRows& contact, Row& row,
                             const Eigen::Vector3d& direction) const {
    const auto of = [&](const SolverBody& body, double side, const Eigen::Vector3d& arm) {
        return body.scaled(side * direction, side * cross(arm, direction));
    };
    const bool is_a_first = contact.first_ == contact.a_;
    row.first =
        is_a_first ? of(*contact.a_, 1.0, contact.arm_a_) : of(*contact.b_, -1.0, contact.arm_b_);
    row.inverse_effective_mass = dot(row.first, row.first);
    if (contact.second_ != nullptr) {
        row.second = of(*contact.b_, -1.0, contact.arm_b_);
        row.inverse_effective_mass += dot(row.second, row.second);
    }
    row.effective_mass = 1.0 / row.inverse_effective_mass;
}

void ContactSolver::add(const SolverContact& contact) {
    if (count_ == rows_.size()) return;
    ContactRows& rows = rows_[count_++];
    is_sorted_ = false;
    SolverBody& a = bodies_[contact.a];
    SolverBody* const b = contact.b == SolverContact::kGround ? nullptr : &bodies_[contact.b];
    rows.a_ = &a;
    rows.b_ = b;
    // Bodies of infinite mass may be shared with other islands, so they are not written.
    rows.first_ = a.is_fixed() ? b : &a;
    rows.second_ = a.is_fixed() || b == nullptr || b->is_fixed() ? nullptr : b;
    std::uint32_t& level = rows.first_->level_;
    rows.level_ = rows.second_ != nullptr ? std::max(level, rows.second_->level_) : level;
    level = rows.level_ + 1;
    if (rows.second_ != nullptr) rows.second_->level_ = level;

    rows.arm_a_ = contact.point_a - a.pose().translation;
    if (b != nullptr) rows.arm_b_ = contact.point_b - b->pose().translation;
    const Eigen::Vector3d tangent = any_tangent(contact.normal);
    rows.direction_[0] = contact.normal;
    rows.direction_[1] = tangent;
    rows.direction_[2] = cross(contact.normal, tangent);
    int axis = 0;
    for (Row* row : {&rows.normal_, &rows.tangent_, &rows.bitangent_}) {
        const Eigen::Vector3d& direction = rows.direction_[axis++];
        make_row(rows, *row, direction);
        row->impulse = dot(contact.initial_impulse, direction);
    }
    rows.normal_.impulse = std::max(0.0, rows.normal_.impulse);
    // If the normal has changed, the warm start has a tangential part, which a row without friction would never remove.
    if (!(contact.friction > 0.0)) rows.tangent_.impulse = rows.bitangent_.impulse = 0.0;
    rows.core_arm_ = rows.arm_a_ + contact.rounding * contact.normal;
    rows.allowed_closing_ = 0.0;
    rows.gap_ = contact.gap;
    rows.rest_gap_ = contact.rest_gap;
    rows.target_gap_ = contact.target_gap;
    rows.friction_ = contact.friction;
    rows.max_friction_impulse_ = contact.max_friction_impulse;
    for (int axis_of_slip : {0, 1}) {
        rows.slip_[axis_of_slip] = dot(contact.slip_velocity, rows.direction_[axis_of_slip + 1]);
    }
    rows.restitution_ = contact.restitution;
}

void ContactSolver::turn_fixed_bodies(double time) {
    const auto turn = [time](const SolverBody* body, Eigen::Vector3d& arm) {
        if (body == nullptr || !body->is_fixed()) return;
        arm += cross(body->velocity.angular, arm) * time;
    };
    for (ContactRows& contact : contacts()) {
        turn(contact.a_, contact.arm_a_);
        turn(contact.b_, contact.arm_b_);
    }
}

double ContactSolver::closing_speed(std::size_t contact, const Twist* before_a,
                                    const Twist* before_b) const {
    const ContactRows& rows = rows_[contact];
    const auto opening = [&](const SolverBody* body, const Twist* before,
                             const Eigen::Vector3d& arm) {
        if (body == nullptr || before == nullptr) return 0.0;
        const Eigen::Vector3d angular = body->velocity.angular - before->angular;
        return dot(rows.direction_[0],
                   body->velocity.linear - before->linear + cross(angular, arm));
    };
    return opening(rows.b_, before_b, rows.arm_b_) - opening(rows.a_, before_a, rows.arm_a_);
}

/// Computes the speeds at the start of a solve; end() adds the changes to the velocities.
void ContactSolver::begin() {
    for (ContactRows& contact : contacts()) {
        const Twist& a = contact.a_->velocity;
        Eigen::Vector3d velocity = a.linear + cross(a.angular, contact.arm_a_);
        if (contact.b_ != nullptr) {
            const Twist& b = contact.b_->velocity;
            velocity -= b.linear + cross(b.angular, contact.arm_b_);
        }
        contact.normal_.start_speed = dot(contact.direction_[0], velocity);
        contact.tangent_.start_speed = dot(contact.direction_[1], velocity) - contact.slip_[0];
        contact.bitangent_.start_speed = dot(contact.direction_[2], velocity) - contact.slip_[1];
    }
}

void ContactSolver::end() {
    for (ContactRows& contact : contacts()) {
        for (SolverBody* const body : {contact.first_, contact.second_}) {
            if (body == nullptr || is_zero(body->change_)) continue;
            const Twist change = body->unscaled(body->change_);
            body->velocity.linear += change.linear;
            body->velocity.angular += change.angular;
            body->change_ = {};
        }
    }
}

double ContactSolver::speed(const ContactRows& contact, const Row& row) {
    const double speed = row.start_speed + dot(row.first, contact.first_->change_);
    if (contact.second_ == nullptr) return speed;
    return speed + dot(row.second, contact.second_->change_);
}

void ContactSolver::apply(ContactRows& contact, Row& row, double impulse) {
    add_scaled(contact.first_->change_, row.first, impulse);
    if (contact.second_ != nullptr) add_scaled(contact.second_->change_, row.second, impulse);
}

/// Sets the allowed closing speed of each contact. If the spin accelerates a corner towards the ground, the contact
/// must open at half this acceleration times the duration, so that the curved path ends at the gap at which it began.
/// Between bodies, the resulting overlap is tolerated. Returns the largest change of an allowed speed, m/s.
double ContactSolver::set_targets(double duration) {
    double change = 0.0;
    for (ContactRows& contact : contacts()) {
        double allowed = std::max(0.0, contact.gap_ - contact.rest_gap_) / duration;
        if (contact.b_ == nullptr) {
            const SolverBody& body = *contact.first_;
            const Eigen::Vector3d spin =
                body.velocity.angular + body.unscaled(body.change_).angular;
            allowed -= 0.5 * duration *
                       std::max(0.0, bend(contact.direction_[0], spin, contact.core_arm_));
        }
        change = std::max(change, std::abs(allowed - contact.allowed_closing_));
        contact.allowed_closing_ = allowed;
    }
    return change;
}

Eigen::Vector3d ContactSolver::impulse(std::size_t contact) const {
    const ContactRows& rows = rows_[contact];
    Eigen::Vector3d sum = rows.direction_[0] * rows.normal_.impulse;
    sum += rows.direction_[1] * rows.tangent_.impulse;
    sum += rows.direction_[2] * rows.bitangent_.impulse;
    return sum;
}

// Sources:    Silcowitz, Niebe, Erleben. A nonsmooth nonlinear conjugate gradient method for interactive contact force
//             problems. The Visual Computer 26, 2010 (the change by a Gauss-Seidel sweep replaces the gradient).
//             Saad. Iterative methods for sparse linear systems. 2003, chapter 9 (preconditioned conjugate gradients).
// Deviations: the gradient is the change by a forward and a backward sweep, which together form a symmetric
//             preconditioner. The step length is optimal as long as no contact opens or starts to slip. A direction is
//             made conjugate to the previous one by their inner product in the space of velocities.

/// Restarts from the current impulses without a previous direction.
void ContactSolver::restart_directions() {
    last_gradient_square_ = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < directions_.size(); ++i) {
        directions_[i] = {.impulses = impulses_of(rows_[i]), .direction = {}};
    }
    for (const std::uint32_t member : direction_members_) {
        bodies_[member].step_start_ = bodies_[member].change_;
        bodies_[member].direction_ = {};
    }
}

/// Computes the next direction: the gradient plus a multiple of the previous direction. Contacts that stay open are
/// left out.
void ContactSolver::turn_directions(double share_of_last) {
    for (const std::uint32_t member : direction_members_) bodies_[member].direction_ = {};
    for (std::size_t i = 0; i < directions_.size(); ++i) {
        const ContactRows& contact = rows_[i];
        ContactDirection& known = directions_[i];
        const std::array<double, 3> impulses = impulses_of(contact);
        const bool stays_open =
            impulses[0] == contact.least_impulse_ && known.impulses[0] == contact.least_impulse_;
        if (stays_open || !contact.is_active_) {
            known.direction = {};
            continue;
        }
        const std::array<const Row*, 3> rows{&contact.normal_, &contact.tangent_,
                                             &contact.bitangent_};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            double& along = known.direction[axis];
            along = impulses[axis] - known.impulses[axis] + share_of_last * along;
            add_scaled(contact.first_->direction_, rows[axis]->first, along);
            if (contact.second_ == nullptr) continue;
            add_scaled(contact.second_->direction_, rows[axis]->second, along);
        }
    }
}

/// The step length that minimises the energy along the direction, measured from the end of the last step.
double ContactSolver::best_step_length() const {
    double square = 0.0, slope = 0.0;
    for (const std::uint32_t member : direction_members_) {
        const SolverBody& body = bodies_[member];
        square += dot(body.direction_, body.direction_);
        slope += dot(body.direction_, body.step_start_) - dot(body.direction_, body.change_);
    }
    // These speeds include the changes by the sweeps since the last step; the sum above subtracts them.
    for (std::size_t i = 0; i < directions_.size(); ++i) {
        const ContactRows& contact = rows_[i];
        const std::array<double, 3>& along = directions_[i].direction;
        slope += along[0] * (speed(contact, contact.normal_) + contact.allowed_closing_);
        slope += along[1] * speed(contact, contact.tangent_);
        slope += along[2] * speed(contact, contact.bitangent_);
    }
    return square > 0.0 ? -slope / square : 0.0;
}

/// Replaces the changes by the sweeps since the last step with a step along a direction conjugate to the previous one.
void ContactSolver::step_along_directions() {
    double last_square = 0.0, product = 0.0, gradient_square = 0.0;
    for (const std::uint32_t member : direction_members_) {
        const SolverBody& body = bodies_[member];
        Vector6 gradient = body.change_;
        add_scaled(gradient, body.step_start_, -1.0);
        last_square += dot(body.direction_, body.direction_);
        product += dot(body.direction_, gradient);
        gradient_square += dot(gradient, gradient);
    }
    // The gradient grows if contacts open or start to slip: then earlier directions are no longer conjugate.
    const bool grows = !(gradient_square < last_gradient_square_);
    if (!grows) turn_directions(last_square > 0.0 ? -product / last_square : 0.0);
    const double length = grows ? 0.0 : best_step_length();
    if (!(length > 0.0)) {
        restart_directions();
        last_gradient_square_ = gradient_square;
        return;
    }
    last_gradient_square_ = gradient_square;
    for (std::size_t i = 0; i < directions_.size(); ++i) {
        ContactRows& contact = rows_[i];
        if (!contact.is_active_) continue;
        ContactDirection& known = directions_[i];
        const std::array<Row*, 3> rows{&contact.normal_, &contact.tangent_, &contact.bitangent_};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            double& next = known.impulses[axis];
            next += length * known.direction[axis];
            if (axis == 0) next = std::max(next, contact.least_impulse_);
            apply(contact, *rows[axis], next - rows[axis]->impulse);
            rows[axis]->impulse = next;
        }
    }
    for (const std::uint32_t member : direction_members_) {
        bodies_[member].step_start_ = bodies_[member].change_;
    }
}

}  // namespace terrane::internal
