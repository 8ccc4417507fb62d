// SPDX-License-Identifier: MIT
#pragma once

#include "base/worker_team.h"
#include "bodies/islands/islands.h"
#include "bodies/islands/pair_manifolds.h"
#include "bodies/step/body_step.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

enum class Mobility : std::uint8_t {
    fixed,   ///< never moves, whatever touches it
    asleep,  ///< at rest until a moving body touches it
    moving,
};

/// Finds the bodies that touch each other and solves each island together with its ground contacts. All orders are
/// those of the bodies, so that the number of threads changes no bit.
class IslandSolver {
public:
    explicit IslandSolver(BroadphaseKind kind) : broadphase_(make_broadphase(kind, 0.0)) {}

    /// Finds the pairs that touch, or will within `duration` seconds, and the islands of the moving bodies. Where a
    /// moving body touches a sleeping one, its whole sleep group becomes `moving`.
    ///
    /// @param groups [bodies] sleep group: sleepers with equal numbers wake together
    void find(std::span<const RigidBody> bodies, std::span<const std::uint32_t> groups,
              std::span<Mobility> mobility, double duration, WorkerTeam& team);

    /// Solves the islands of the last find(), and separates overlapping bodies, each against its offset surface. Bodies
    /// that will bounce off each other are first advanced to their time of impact.
    /// @param ground_contacts [bodies] with this ground
    /// @param answers         [bodies] written for the bodies that were advanced
    void solve(std::span<RigidBody> bodies, std::span<GroundContactCache> ground_contacts,
               std::span<SubstepAnswer> answers, const Ground& ground, double gravity,
               double duration, WorkerTeam& team);

    /// Of the last find(); sleepers belong to none.
    const Islands& islands() const { return islands_; }
    /// Pairs of touching bodies of which at least one moves.
    std::size_t touching_pair_count() const { return pair_count_; }

private:
    void update_bounds(std::span<const RigidBody> bodies, double duration);
    void collect_pairs(std::span<const RigidBody> bodies, std::span<const Mobility> mobility,
                       double duration);
    void remove_separated();
    void wake(std::span<const std::uint32_t> groups, std::span<Mobility> mobility);
    struct Scene;
    void advance_to_impacts(std::size_t island, const Scene& scene);
    void solve_island(std::size_t island, int worker, const Scene& scene);

    std::unique_ptr<Broadphase> broadphase_;
    std::vector<Aabb> bounds_;
    std::vector<BoundingSphere> spheres_;
    std::vector<PairManifold> manifolds_, previous_manifolds_;  // ascending by pair
    // Of each pair's first manifold: its index in previous_manifolds_, or kNone.
    std::vector<std::uint32_t> previous_index_;
    std::size_t pair_count_ = 0;                 // see touching_pair_count()
    std::vector<BodyPair> links_;                // manifolds of which a body moves
    std::vector<std::uint32_t> link_manifolds_;  // index of each link's manifold
    std::vector<std::uint8_t> wakes_;            // [groups]
    std::vector<std::uint8_t> moves_;
    Islands islands_;
    // [bodies] share of the substep up to the impact that the body is advanced to; 1: none
    std::vector<double> impact_shares_;
    std::vector<SolverBody> solver_bodies_;
    std::vector<std::vector<ContactRows>> rows_;  // [workers]
};

}  // namespace terrane::internal
