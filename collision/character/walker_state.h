// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/step/offset_surface.h"

#include <terrane/collision/walker.h>

#include <span>
#include <vector>

namespace terrane {

inline constexpr std::size_t kMaxWalkerContacts = 128;
/// A walker stands on contacts that are not wider than this beyond where bodies rest, in tolerances.
inline constexpr double kStandingGap = 1.0 / 8.0;

struct Walker::State {
    WalkerSettings settings;
    WalkerState state;
    WalkerControls controls;
    internal::BodyPart capsule;
    internal::RigidBody body;
    internal::GroundLook look;
    double least_cosine = 0.0;  // of what it stands on
    bool rises = false;         // onto a step
    std::vector<internal::SolverContact> contacts;
    std::vector<internal::ContactRows> rows;

    void live_substep(const Ground& ground, std::span<const Obstacle> obstacles, double substep,
                      StepReport& report);
    void gather(const Ground& ground, std::span<const Obstacle> obstacles);
    bool is_walkable(const internal::SolverContact& contact) const {
        return contact.normal.z() >= least_cosine;
    }
    const internal::SolverContact* find_support() const;
    void want(double substep);
    class Solver;
    void solve(double duration);
    void part(const Ground& ground, std::span<const Obstacle> obstacles, double substep);
    internal::MoveAnswer move(const Ground& ground, std::span<const Obstacle> obstacles,
                              const Eigen::Vector3d& way);
    bool could_step(const Ground& ground, std::span<const Obstacle> obstacles,
                    const Eigen::Vector3d& forward);
};

}  // namespace terrane
