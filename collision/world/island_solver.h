// SPDX-License-Identifier: MIT
#pragma once

#include "base/worker_team.h"
#include "world/solver/body_step.h"
#include "world/solver/pair_manifolds.h"
#include "world/vehicle/drive_forces.h"

#include <terrane/collision/broadphase.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace terrane::internal {

/// No body, island or manifold.
inline constexpr std::uint32_t kNone = ~std::uint32_t{0};

/// Connected components of the moving bodies that touch: solved together, asleep together. A body that touches no other
/// is an island of one. Islands are in order of their lowest body; bodies and links within them ascend.
class Islands {
public:
    /// @param links pairs that touch
    /// @param moves [bodies] 0: a body that connects nothing and belongs to no island
    void build(std::span<const BodyPair> links, std::span<const std::uint8_t> moves);

    std::size_t count() const { return body_starts_.size() - 1; }
    /// Indices of an island's bodies; at least one.
    std::span<const std::uint32_t> bodies(std::size_t island) const;
    /// Indices of an island's links.
    std::span<const std::uint32_t> links(std::size_t island) const;

private:
    std::uint32_t find_root(std::uint32_t body);

    std::vector<std::uint32_t> parents_;
    std::vector<std::uint32_t> islands_;  // of each body
    std::vector<std::uint32_t> bodies_, links_;
    std::vector<std::uint32_t> body_starts_{0}, link_starts_{0};
};

enum class Mobility : std::uint8_t {
    absent,   ///< no body has this index
    fixed,    ///< does not move, whatever touches it
    driving,  ///< moves whatever touches it, or has been placed anew: wakes sleepers that it touches
    asleep,   ///< at rest until a moving or driving body touches it
    moving,
};

/// Whether the owner lets two bodies collide, by their indices, a < b.
using PairFilter = std::function<bool(std::uint32_t a, std::uint32_t b)>;

/// [bodies] What drives them, or null; empty where nothing drives any.
struct BodyDrives {
    std::span<WheelSet* const> wheels;
    std::span<const FootDrive* const> feet;
};

/// Finds the bodies that touch each other, and steps each island on its contacts. A body that touches no other is an
/// island of one. All orders are those of the bodies, so that the number of threads changes no bit.
class IslandSolver {
public:
    /// @param collide_bodies false: each body is an island of one
    /// @param pair_filter    empty: all pairs that the bodies' filters permit
    /// @param records_impulses pair_impulses() and ground_impulses() are wanted
    IslandSolver(BroadphaseKind kind, bool collide_bodies, bool records_impulses,
                 PairFilter pair_filter)
        : broadphase_(make_broadphase(kind, 0.0)),
          collide_bodies_(collide_bodies),
          records_impulses_(records_impulses),
          pair_filter_(std::move(pair_filter)) {}

    /// Finds the pairs that touch, or will within the step, and the islands of the moving bodies. Where a moving or
    /// driving body touches a sleeping one, its whole sleep group becomes `moving`.
    ///
    /// @param groups      [bodies] sleep group: sleepers with equal numbers wake together
    /// @param wheel_links pairs of a vehicle and a body that its wheels stand on
    void find(std::span<const RigidBody> bodies, std::span<const std::uint32_t> groups,
              std::span<const BodyPair> wheel_links, std::span<Mobility> mobility,
              const StepSpan& span, WorkerTeam& team);

    /// Steps the islands of the last find() in substeps, and separates overlapping bodies. The poses reached are not
    /// yet proved clear of the ground.
    /// @param ground_contacts [bodies]
    /// @param drives          of the bodies that have wheels or feet
    void step(std::span<RigidBody> bodies, std::span<GroundContactCache> ground_contacts,
              const BodyDrives& drives, const StepSpan& span, WorkerTeam& team);

    /// The body's box is computed anew in the next find(). Needed where a body that does not move has been changed.
    void forget_bounds(std::size_t body) {
        if (body < has_bounds_.size()) has_bounds_[body] = 0;
    }

    /// Of the last find(); sleepers belong to none.
    const Islands& islands() const { return islands_; }
    /// Whether a driving body touches an island of the last find().
    bool is_driven(std::size_t island) const {
        for (const std::uint32_t link : islands_.links(island)) {
            for (const std::uint32_t body : {links_[link].a, links_[link].b}) {
                if (moves_[body] == 0 && driver_index_[body] != kNone) return true;
            }
        }
        return false;
    }
    /// Contacts between bodies, ascending by pair; the pairs of sleepers too.
    std::span<const PairManifold> manifolds() const { return manifolds_; }
    /// [manifolds] impulse on body a in the last step(), N s.
    std::span<const Eigen::Vector3d> pair_impulses() const { return pair_impulses_; }
    /// [bodies] impulse of the ground in the last step(), N s.
    std::span<const Eigen::Vector3d> ground_impulses() const { return ground_impulses_; }
    /// Sensors and dynamic bodies whose boxes overlapped in the last find(), ascending.
    std::span<const BodyPair> sensor_pairs() const { return sensor_pairs_; }
    /// Pairs of the last find() that were left out because too many bodies are in one place.
    std::size_t skipped_pair_count() const { return skipped_pair_count_; }

    /// Forgets the contacts of a body that has been removed or placed anew. Calls touched(other) for each body that it
    /// had contacts with.
    void forget_contacts(std::uint32_t body, const std::function<void(std::uint32_t)>& touched);
    /// Replaces the contacts by those of another solver's manifolds().
    void restore_contacts(std::vector<PairManifold> manifolds) {
        manifolds_ = std::move(manifolds);
    }
    /// Whether a contact of a moving body with the ground closed in the last step() fast enough to bounce.
    bool has_struck_ground(std::size_t body) const { return struck_[body] != 0; }
    /// Pairs of touching bodies of which at least one moves.
    std::size_t touching_pair_count() const { return pair_count_; }

private:
    /// A contact that has closed in the step, for the restitution after it.
    struct Impact {
        std::uint32_t a, b;   // b is kNone for a contact with the ground
        double gap;           // that the contact had to close in the substep, metres
        double acceleration;  // along the approach, m/s^2
        double pushed_speed;  // of the approach, by wheels in the substep, m/s
        double restitution;   // 0 to 1
    };
    /// Buffers of a thread that steps an island.
    struct Scratch {
        std::vector<ContactRows> rows;
        std::vector<ContactDirection> directions;  // [contacts]
        std::vector<Impact> impacts;               // [contacts]
        std::vector<double> separating_speeds;     // [contacts]
    };
    /// The arguments of step(), for all islands.
    struct Scene {
        std::span<RigidBody> bodies;
        std::span<GroundContactCache> ground_contacts;
        const BodyDrives& drives;
        const StepSpan& span;
    };

    void update_bounds(std::span<const RigidBody> bodies, std::span<const Mobility> mobility,
                       const StepSpan& span);
    void collect_pairs(std::span<const RigidBody> bodies, std::span<const Mobility> mobility,
                       double duration);
    bool is_crowded(const BodyPair& pair, bool is_limited);
    void find_drivers(std::span<const RigidBody> bodies, std::span<const Mobility> mobility,
                      const StepSpan& span);
    void remove_separated();
    void wake(std::span<const std::uint32_t> groups, std::span<const BodyPair> wheel_links,
              std::span<Mobility> mobility);
    void drive_feet(SolverContact& contact, std::uint32_t a, std::uint32_t b, const Scene& scene);
    double pushed_speed(std::size_t contact, const Impact& impact, const ContactSolver& solver,
                        const Scene& scene) const;
    double apply_wheels(std::span<const std::uint32_t> members, int substep, const Scene& scene);
    /// The contacts of a link; those of wheels have none.
    PairManifold* manifold(std::uint32_t link) {
        return link_manifolds_[link] == kNone ? nullptr : &manifolds_[link_manifolds_[link]];
    }
    std::size_t contact_count(std::uint32_t link) const {
        return link_manifolds_[link] == kNone ? 0 : manifolds_[link_manifolds_[link]].count();
    }
    void step_island(std::size_t island, Scratch& scratch, const Scene& scene);
    std::size_t count_contacts(std::size_t island, const Scene& scene) const;
    void add_contacts(std::size_t island, ContactSolver& solver, Scratch& scratch,
                      const Scene& scene);
    void follow(std::size_t island, int substep, ContactSolver& solver, const Scene& scene);
    bool begin_impacts(std::size_t contact_count, const ContactSolver& solver, Scratch& scratch,
                       const Scene& scene) const;
    void store_impulses(std::size_t island, const ContactSolver& solver, const Scene& scene);
    void record_impulses(std::size_t island, const ContactSolver& solver, const Scene& scene);
    const RigidBody& body_at(std::uint32_t body, int substep, const Scene& scene) const;
    void separate(std::size_t island, ContactSolver& solver, const Scene& scene);
    void bounce(std::size_t island, ContactSolver& solver, Scratch& scratch, const Scene& scene,
                double max_energy, const StoppingRule& rule);
    void limit_energy(std::size_t island, ContactSolver& solver, const Scene& scene,
                      const WorldPos& origin, double most);
    double total_energy(std::size_t island, const WorldPos& origin, const Scene& scene) const;

    std::unique_ptr<Broadphase> broadphase_;
    bool collide_bodies_, records_impulses_;
    PairFilter pair_filter_;
    std::vector<Aabb> bounds_;
    std::vector<std::uint8_t>
        has_bounds_;  // [bodies] the box of a body that does not move is known
    std::vector<std::uint8_t> partner_count_;  // [bodies] pairs so far, in a crowd
    std::vector<BodyPair> sensor_pairs_;
    std::size_t skipped_pair_count_ = 0;
    std::vector<BoundingSphere> spheres_;
    std::vector<PairManifold> manifolds_, previous_manifolds_;  // ascending by pair
    SeparatedPairs separated_;
    // Of each pair's first manifold: its index in previous_manifolds_, or kNone.
    std::vector<std::uint32_t> previous_index_;
    std::size_t pair_count_ = 0;   // see touching_pair_count()
    std::vector<BodyPair> links_;  // manifolds of which a body moves, then wheels on bodies
    std::vector<std::uint32_t> link_manifolds_;  // index of each link's manifold; kNone: wheels
    std::vector<std::uint8_t> wakes_;            // [groups]
    std::vector<std::uint8_t> moves_;
    Islands islands_;
    std::vector<SolverBody> solver_bodies_;    // [bodies]
    std::vector<RigidBody> later_drivers_;     // driving bodies of links in the later substeps
    std::vector<std::uint32_t> driver_index_;  // [bodies] in later_drivers_, or kNone
    std::vector<Eigen::Vector3d> pair_impulses_, ground_impulses_;
    std::vector<std::uint8_t> struck_;  // see has_struck_ground()
    std::vector<Scratch> scratch_;      // [workers]
};

}  // namespace terrane::internal
