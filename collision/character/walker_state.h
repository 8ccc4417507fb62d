// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/step/offset_surface.h"

#include <terrane/collision/walker.h>

#include <span>
#include <vector>

namespace terrane {

inline constexpr std::size_t kMaxWalkerContacts = 128;
/// A walker stands on contacts with gaps up to this beyond the rest gap, in tolerances.
inline constexpr double kStandingGap = 1.0 / 8.0;

struct Walker::State {
    WalkerSettings settings;
    WalkerState state;
    WalkerControls controls;
    internal::BodyPart capsule;
    internal::RigidBody body;
    internal::GroundContactCache ground_contacts;
    double least_cosine = 0.0;    // of the normals of walkable contacts with z
    bool is_stepping_up = false;  // the last substep ended on a step up
    std::vector<internal::SolverContact> contacts;
    std::vector<internal::ContactRows> rows;

    void advance_substep(const Ground& ground, std::span<const Obstacle> obstacles, double substep,
                         StepReport& report);
    void gather(const Ground& ground, std::span<const Obstacle> obstacles);
    bool is_walkable(const internal::SolverContact& contact) const {
        return contact.normal.z() >= least_cosine;
    }
    const internal::SolverContact* find_support() const;
    void apply_controls(double substep);
    class Solver;
    void solve(double duration);
    void depenetrate(const Ground& ground, std::span<const Obstacle> obstacles, double substep);
    internal::MoveAnswer move(const Ground& ground, std::span<const Obstacle> obstacles,
                              const Eigen::Vector3d& displacement);
    bool could_step(const Ground& ground, std::span<const Obstacle> obstacles,
                    const Eigen::Vector3d& forward);
};

}  // namespace terrane
