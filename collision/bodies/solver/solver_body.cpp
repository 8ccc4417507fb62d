// SPDX-License-Identifier: MIT
#include "bodies/solver/solver_body.h"

#include <cmath>

namespace terrane::internal {

double kinetic_energy(const MassProperties& mass, const Pose& pose, const Twist& velocity) {
    return 0.5 *
           (dot(velocity.linear, velocity.linear) / mass.inverse_mass +
            dot(velocity.angular, apply_tensor(pose.rotation, mass.inertia, velocity.angular)));
}

void SolverBody::set(const MassProperties& mass, const Pose& pose, const Twist& start_velocity) {
    change_ = {};
    level_ = 0;
    root_inverse_mass_ = std::sqrt(mass.inverse_mass);
    for (int axis = 0; axis < 3; ++axis) {
        root_inverse_inertia_[axis] = std::sqrt(mass.inverse_inertia[axis]);
    }
    velocity = start_velocity;
    mass_ = mass;
    pose_ = pose;
}

void SolverBody::set_fixed(const Pose& pose, const Twist& constant_velocity) {
    set({.inverse_mass = 0.0}, pose, constant_velocity);
}

Vector6 SolverBody::scaled(const Eigen::Vector3d& force, const Eigen::Vector3d& moment) const {
    const Eigen::Vector3d linear = root_inverse_mass_ * force;
    const Eigen::Vector3d moment_body = rotated_back(pose_.rotation, moment);
    const Eigen::Vector3d& root = root_inverse_inertia_;
    Vector6 result;
    result.pairs[0] = Vector6::Pair{linear[0], linear[1]};
    result.pairs[1] = Vector6::Pair{linear[2], root[0] * moment_body[0]};
    result.pairs[2] = Vector6::Pair{root[1] * moment_body[1], root[2] * moment_body[2]};
    return result;
}

Twist SolverBody::unscaled(const Vector6& change) const {
    const Vector6::Pair* const c = change.pairs;
    const Eigen::Vector3d& root = root_inverse_inertia_;
    const Eigen::Vector3d linear(c[0][0], c[0][1], c[1][0]);
    const Eigen::Vector3d angular_body(root[0] * c[1][1], root[1] * c[2][0], root[2] * c[2][1]);
    return {root_inverse_mass_ * linear, rotated(pose_.rotation, angular_body)};
}

}  // namespace terrane::internal
