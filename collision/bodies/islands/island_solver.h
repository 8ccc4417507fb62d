// SPDX-License-Identifier: MIT
#pragma once

#include "base/worker_team.h"
#include "bodies/islands/islands.h"
#include "bodies/islands/pair_manifolds.h"
#include "bodies/step/collision_step.h"

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

/// Finds the bodies that touch each other, and steps each island on its contacts. A body that touches no other is an
/// island of one. All orders are those of the bodies, so that the number of threads changes no bit.
class IslandSolver {
public:
    /// @param bodies_meet false: each body is an island of one
    IslandSolver(BroadphaseKind kind, bool bodies_meet)
        : broadphase_(make_broadphase(kind, 0.0)), bodies_meet_(bodies_meet) {}

    /// Finds the pairs that touch, or will within the step, and the islands of the moving bodies. Where a moving body
    /// touches a sleeping one, its whole sleep group becomes `moving`.
    ///
    /// @param groups [bodies] sleep group: sleepers with equal numbers wake together
    void find(std::span<const RigidBody> bodies, std::span<const std::uint32_t> groups,
              std::span<Mobility> mobility, const StepSpan& span, WorkerTeam& team);

    /// Steps the islands of the last find() in substeps, and separates overlapping bodies. The poses reached are not
    /// yet proved clear of the ground.
    /// @param ground_contacts [bodies]
    void step(std::span<RigidBody> bodies, std::span<GroundContactCache> ground_contacts,
              const StepSpan& span, WorkerTeam& team);

    /// Of the last find(); sleepers belong to none.
    const Islands& islands() const { return islands_; }
    /// Whether a contact of a moving body with the ground closed in the last step() fast enough to bounce.
    bool has_struck_ground(std::size_t body) const { return struck_[body] != 0; }
    /// Pairs of touching bodies of which at least one moves.
    std::size_t touching_pair_count() const { return pair_count_; }

private:
    /// A contact that has closed in the step, for the restitution after it.
    struct Impact {
        std::uint32_t body;       // on the ground, or kNone for a contact of two bodies
        double gap;               // that the contact had to close in the substep, metres
        double gravity;           // acceleration by gravity along the approach, m/s^2
        double restitution;       // 0 to 1
        double separating_speed;  // m/s; < 0: the contact does not bounce
    };
    /// Buffers of a thread that steps an island.
    struct Scratch {
        std::vector<ContactRows> rows;
        std::vector<Impact> impacts;            // [contacts]
        std::vector<double> separating_speeds;  // [contacts]
    };
    /// The arguments of step(), for all islands.
    struct Scene {
        std::span<RigidBody> bodies;
        std::span<GroundContactCache> ground_contacts;
        const StepSpan& span;
    };

    void update_bounds(std::span<const RigidBody> bodies, const StepSpan& span);
    void collect_pairs(std::span<const RigidBody> bodies, std::span<const Mobility> mobility,
                       double duration);
    void remove_separated();
    void wake(std::span<const std::uint32_t> groups, std::span<Mobility> mobility);
    void step_island(std::size_t island, Scratch& scratch, const Scene& scene);
    std::size_t count_contacts(std::size_t island, const Scene& scene) const;
    bool add_contacts(std::size_t island, int substep, ContactSolver& solver, Scratch& scratch,
                      const Scene& scene);
    void store_impulses(std::size_t island, const ContactSolver& solver, const Scene& scene);
    void separate(std::size_t island, ContactSolver& solver, const Scene& scene);
    void bounce(std::size_t island, ContactSolver& solver, Scratch& scratch, const Scene& scene,
                double max_energy);
    void limit_energy(std::size_t island, ContactSolver& solver, const Scene& scene,
                      const WorldPos& origin, double most);
    double total_energy(std::size_t island, const WorldPos& origin, const Scene& scene) const;

    std::unique_ptr<Broadphase> broadphase_;
    bool bodies_meet_;
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
    std::vector<SolverBody> solver_bodies_;
    std::vector<std::uint8_t> struck_;  // see has_struck_ground()
    std::vector<Scratch> scratch_;      // [workers]
};

}  // namespace terrane::internal
