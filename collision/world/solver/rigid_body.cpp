// SPDX-License-Identifier: MIT
#include "world/solver/rigid_body.h"

#include <terrane/collision/query.h>

#include <cmath>

namespace terrane::internal {
namespace {

bool spins_freely(const RigidBody& body) {
    const Eigen::Vector3d& inertia = body.mass.inertia;
    return inertia.x() == inertia.y() && inertia.y() == inertia.z();
}

bool has_constant_spin(const RigidBody& body) {
    return spins_freely(body) || body.velocity.angular.isZero(0.0);
}

/// Spin for an angular momentum at a given rotation.
Eigen::Vector3d spin_at(const RigidBody& body, const Eigen::Matrix3d& rotation,
                        const Eigen::Vector3d& momentum) {
    return apply_tensor(rotation, body.mass.inverse_inertia, momentum);
}

double spin_energy(const RigidBody& body, const Eigen::Matrix3d& rotation,
                   const Eigen::Vector3d& spin) {
    return 0.5 * dot(spin, apply_tensor(rotation, body.mass.inertia, spin));
}

}  // namespace

double greatest_move(const RigidBody& body, const Pose& from, const Pose& to) {
    // A rotation moves a point by at most its distance times the spectral norm of the difference of the rotations,
    // which is bounded by the Frobenius norm.
    double turn = 0.0;
    for (int column = 0; column < 3; ++column) {
        const Eigen::Vector3d difference = to.rotation.col(column) - from.rotation.col(column);
        turn += dot(difference, difference);
    }
    return length(to.translation - from.translation) + body.radius * std::sqrt(turn);
}

Eigen::Vector3d rotation_in(const RigidBody& body, double duration, bool is_flying) {
    const Eigen::Vector3d spin = body.velocity.angular;
    if (!is_flying || has_constant_spin(body)) return spin * duration;
    const Eigen::Vector3d momentum = apply_tensor(body.pose.rotation, body.mass.inertia, spin);
    const Motion half{body.pose, Eigen::Vector3d::Zero(), 0.5 * duration * spin};
    return spin_at(body, half.at(1.0).rotation, momentum) * duration;
}

void conserve_momentum(RigidBody& body, const Eigen::Matrix3d& rotation_before) {
    if (has_constant_spin(body)) return;
    Eigen::Vector3d& spin = body.velocity.angular;
    const Eigen::Vector3d momentum = apply_tensor(rotation_before, body.mass.inertia, spin);
    const double energy = spin_energy(body, rotation_before, spin);
    spin = spin_at(body, body.pose.rotation, momentum);
    const double energy_after = spin_energy(body, body.pose.rotation, spin);
    if (energy_after > energy) spin *= std::sqrt(energy / energy_after);
}

Twist clamp_displacement(Twist displacement, double radius, double most) {
    const double reach = length(displacement.linear) + radius * length(displacement.angular);
    if (reach > most) {
        displacement.linear *= most / reach;
        displacement.angular *= most / reach;
    }
    return displacement;
}

void compensate_height_gain(RigidBody& body, const WorldPos& before) {
    const double work = -dot(body.acceleration, body.pose.translation - before);
    if (!(work > 0.0)) return;
    const double energy = kinetic_energy(body.mass, body.pose, body.velocity);
    const double left = energy - work / body.mass.inverse_mass;
    const double scale = left > 0.0 ? std::sqrt(left / energy) : 0.0;
    body.velocity.linear *= scale;
    body.velocity.angular *= scale;
}

void integrate(RigidBody& body, double duration, bool is_flying) {
    const Eigen::Matrix3d rotation = body.pose.rotation;
    const Motion motion{body.pose, body.velocity.linear * duration,
                        rotation_in(body, duration, is_flying)};
    body.pose = motion.at(1.0);
    conserve_momentum(body, rotation);
}

}  // namespace terrane::internal
