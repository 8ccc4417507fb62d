// SPDX-License-Identifier: MIT
//
// Sources:    Silcowitz, Niebe, Erleben. A nonsmooth nonlinear conjugate gradient method for interactive contact force
//             problems. The Visual Computer 26, 2010 (the change by a Gauss-Seidel sweep in the place of the gradient).
//             Saad. Iterative methods for sparse linear systems. 2003, chapter 9 (preconditioned conjugate gradients).
// Deviations: the gradient is the change by one sweep forwards and one backwards, which together are a symmetric
//             preconditioner. A step has the length that is best while no contact opens and none begins to slip; a
//             direction is made conjugate to the one before by its product with it, in the velocities that they make.
#include "bodies/solver/contact_solver.h"

#include <algorithm>

namespace terrane::internal {

/// Starts again from the present impulses, without a previous direction.
void ContactSolver::restart_directions() {
    last_gradient_square_ = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < directions_.size(); ++i) {
        directions_[i] = {.impulses = impulses_of(room_[i]), .direction = {}};
    }
    for (const std::uint32_t member : direction_members_) {
        bodies_[member].step_start_ = bodies_[member].change_;
        bodies_[member].direction_ = {};
    }
}

/// Makes the next direction: the gradient plus a multiple of the previous direction. Contacts that stay open are left
/// out.
void ContactSolver::turn_directions(double share_of_last) {
    for (const std::uint32_t member : direction_members_) bodies_[member].direction_ = {};
    for (std::size_t i = 0; i < directions_.size(); ++i) {
        const ContactRows& contact = room_[i];
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

/// The length of the step along the direction that minimises the energy, from the end of the last step.
double ContactSolver::best_step_length() const {
    double square = 0.0, slope = 0.0;
    for (const std::uint32_t member : direction_members_) {
        const SolverBody& body = bodies_[member];
        square += dot(body.direction_, body.direction_);
        slope += dot(body.direction_, body.step_start_) - dot(body.direction_, body.change_);
    }
    // The speeds of the contacts include what the sweeps have changed since the last step; the sum above subtracts it.
    for (std::size_t i = 0; i < directions_.size(); ++i) {
        const ContactRows& contact = room_[i];
        const std::array<double, 3>& along = directions_[i].direction;
        slope += along[0] * (speed(contact, contact.normal_) + contact.allowed_closing_);
        slope += along[1] * speed(contact, contact.tangent_);
        slope += along[2] * speed(contact, contact.bitangent_);
    }
    return square > 0.0 ? -slope / square : 0.0;
}

/// Replaces the changes of the sweeps since the last step by a step along a direction that is conjugate to the last.
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
    // The gradient grows where contacts open or begin to slip: earlier directions are not conjugate any more.
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
        ContactRows& contact = room_[i];
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
