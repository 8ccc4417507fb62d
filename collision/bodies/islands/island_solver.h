// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/step/body_step.h"
#include "bodies/islands/islands.h"
#include "bodies/islands/pair_manifolds.h"
#include "base/worker_team.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

enum class Mobility : std::uint8_t {
    fixed,   ///< stays where it is, whatever meets it
    asleep,  ///< at rest until something that moves meets it
    moving,
};

/// Finds which bodies touch each other and solves them, island by island, together with the ground below them.
/// The order of everything is that of the bodies, so the number of threads changes no bit.
class Meetings {
public:
    explicit Meetings(BroadphaseKind kind) : broadphase_(make_broadphase(kind, 0.0)) {}

    /// Finds what touches, or will within `duration`, and the islands of what moves. All of a group whose sleep is
    /// disturbed by something that moves become `moving`.
    ///
    /// @param groups [bodies] which sleepers wake together: equal numbers
    void find(std::span<const RigidBody> bodies, std::span<const std::uint32_t> groups,
              std::span<Mobility> mobility, double duration, WorkerTeam& team);

    /// Solves the islands of the last find(), and parts what overlaps through the gate of each body. Bodies
    /// that fly at each other live until they meet, before they are solved.
    /// @param looks   [bodies] on this ground
    /// @param answers [bodies] written where a body has lived a part of the substep
    void solve(std::span<RigidBody> bodies, std::span<GroundLook> looks,
               std::span<SubstepAnswer> answers, const Ground& ground, double gravity,
               double duration, WorkerTeam& team);

    /// Of the last find(); sleepers belong to none.
    const Islands& islands() const { return islands_; }
    /// Pairs of bodies that touch and are not both at rest.
    std::size_t touching_pair_count() const { return pair_count_; }

private:
    void place_bounds(std::span<const RigidBody> bodies, double duration);
    void take_pairs(std::span<const RigidBody> bodies, std::span<const Mobility> mobility,
                    double duration);
    void erase_apart();
    void wake(std::span<const std::uint32_t> groups, std::span<Mobility> mobility);
    struct Scene;
    void fly_to_impacts(std::size_t island, const Scene& scene);
    void solve_island(std::size_t island, int worker, const Scene& scene);

    std::unique_ptr<Broadphase> broadphase_;
    std::vector<Aabb> bounds_;
    std::vector<BoundingSphere> balls_;
    std::vector<PairTouch> touches_, touches_before_;  // ascending by pair
    std::vector<std::uint32_t> before_;  // of the first touch of each pair: where it was, if it was
    std::size_t pair_count_ = 0;         // of what moves and touches
    std::vector<BodyPair> links_;        // touches that are not asleep
    std::vector<std::uint32_t> link_touches_;  // where each link's touch is
    std::vector<std::uint8_t> wakes_;          // [groups]
    std::vector<std::uint8_t> moves_;
    Islands islands_;
    std::vector<double>
        flights_;  // share of the substep that each body lives before it is solved; 1: none
    std::vector<SolverBody> solver_bodies_;
    std::vector<std::vector<ContactRows>> rows_;  // [workers]
};

}  // namespace terrane::internal
