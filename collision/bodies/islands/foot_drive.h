// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/solver/contact_solver.h"

namespace terrane::internal {

/// How a character's feet drive it: by friction at the contacts that it stands on, towards a velocity.
struct FootDrive {
    /// Wanted, relative to what it stands on, m/s; horizontal.
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    double friction = 0.0;   ///< of the feet on what they stand on
    double max_force = 0.0;  ///< N
    double least_cosine =
        0.0;  ///< of the normals of contacts that can be stood on with the vertical
    double standing_gap = 0.0;  ///< contacts with larger gaps are not stood on, metres
    int contact_count = 1;      ///< contacts that share the force

    /// Whether a contact can be stood on.
    /// @param sign 1 where the character is the contact's body a, else -1
    bool stands_on(const SolverContact& contact, double sign) const {
        return sign * contact.normal.z() >= least_cosine && contact.gap <= standing_gap;
    }

    /// Changes a contact that can be stood on: its friction drives the character.
    void drive(SolverContact& contact, double sign, double substep) const {
        if (!stands_on(contact, sign)) return;
        const Eigen::Vector3d& n = contact.normal;
        // Along the surface, with the wanted horizontal components.
        const double climb = -(n.x() * velocity.x() + n.y() * velocity.y()) / n.z();
        contact.slip_velocity = sign * Eigen::Vector3d(velocity.x(), velocity.y(), climb);
        contact.friction = friction;
        contact.max_friction_impulse = max_force * substep / contact_count;
    }
};

}  // namespace terrane::internal
