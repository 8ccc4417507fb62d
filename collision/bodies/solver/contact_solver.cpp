// SPDX-License-Identifier: MIT
#include "bodies/solver/contact_solver.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr int kSeparationIterations = 12;
/// With conjugate directions: most pairs of sweeps, and the share of the largest displacement that ends them.
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

/// Scales the velocities relative to that of the common centre of mass; the whole velocities where a contact is with
/// the ground or a body of infinite mass, where momentum is not conserved.
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
        // The motion of the centre keeps its energy: the rest has to lose all that the whole loses.
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
        room_[i].allowed_closing_ = -separating_speeds[i];
        largest_speed = std::max(largest_speed, separating_speeds[i]);
    }
    begin();
    iterate(0.0, rule, rule.tolerance * std::max(1.0, largest_speed));
    end();
    if (is_driven() || energy(members) - energy_before <= max_energy) return;
    // The energy of plastic + share * change is energy_before + share * linear + share^2 * square.
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

/// Whether a contact may add energy: friction drives it, or it is with a body of infinite mass that moves.
bool ContactSolver::is_driven() const {
    const std::span<const ContactRows> rows = room_.first(count_);
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
        // The least restitution is used for all where Poisson's impulses would add energy.
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
    // Opening for a curved path may add energy here: it is taken from all velocities.
    const double energy_after = energy(members);
    if (energy_after > energy_before) {
        scale_velocities(members, std::sqrt(energy_before / energy_after));
    }
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

}  // namespace terrane::internal
