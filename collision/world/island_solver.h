// SPDX-License-Identifier: MIT
#pragma once

#include "base/worker_team.h"
#include "world/solver/ground_gate.h"
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

/// Connected components of touching moving bodies. The bodies of an island are solved and fall asleep together; a body
/// that touches no other is an island of one. Islands ascend by their lowest body; their bodies and links ascend too.
class Islands {
public:
    /// @param links touching pairs
    /// @param moves [bodies] 0: the body belongs to no island and does not connect its neighbours
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
    absent,      ///< no body has this index
    fixed,       ///< does not move, even if touched
    prescribed,  ///< unaffected by contacts; moves or was placed anew: wakes sleepers it touches
    asleep,      ///< at rest until a moving or prescribed body touches it
    moving,
};

/// Whether the owner permits a collision of two bodies, given by index, a < b.
using PairFilter = std::function<bool(std::uint32_t a, std::uint32_t b)>;

/// [bodies] Wheels or feet of each body, or null; empty if no body has any.
struct BodyActuators {
    std::span<WheelSet* const> wheels;
    std::span<const FootDrive* const> feet;
};

/// Finds touching bodies and steps each island on its contacts. All loops run in the order of the bodies' indices, so
/// that results are bit-identical for any number of threads.
class IslandSolver {
public:
    /// @param collide_bodies   false: each body is an island of one
    /// @param records_impulses whether to record pair_impulses() and ground_impulses()
    /// @param pair_filter      if empty, all pairs that the bodies' filters permit may collide
    IslandSolver(BroadphaseKind kind, bool collide_bodies, bool records_impulses,
                 PairFilter pair_filter)
        : broadphase_(make_broadphase(kind, 0.0)),
          is_two_scene_(kind == BroadphaseKind::two_scene),
          collide_bodies_(collide_bodies),
          records_impulses_(records_impulses),
          pair_filter_(std::move(pair_filter)) {}

    /// Finds the pairs that touch or may touch within the step, and the islands of moving bodies. If a moving or
    /// prescribed body touches a sleeping one, the whole sleep group of the sleeper becomes `moving`.
    ///
    /// @param groups      [bodies] sleep group: sleepers with equal numbers wake together
    /// @param wheel_links pairs of a vehicle and a body under its wheels
    void find(std::span<const RigidBody> bodies, std::span<const std::uint32_t> groups,
              std::span<const BodyPair> wheel_links, std::span<Mobility> mobility,
              const StepSpan& span, WorkerTeam& team);

    /// Steps the islands of the last find() in substeps, and separates overlapping bodies. The resulting poses are not
    /// yet proved clear of the ground.
    /// @param gates     [bodies] after GroundGate::begin(); their ground contacts are read and updated
    /// @param actuators wheels and feet of the bodies
    void step(std::span<RigidBody> bodies, std::span<GroundGate> gates,
              const BodyActuators& actuators, const StepSpan& span, WorkerTeam& team);

    /// Makes the next find() recompute the body's box; required after changing a body that does not move.
    void forget_bounds(std::size_t body) {
        if (body < has_bounds_.size()) has_bounds_[body] = 0;
    }

    /// Islands of the last find(); sleepers belong to none.
    const Islands& islands() const { return islands_; }
    /// Whether a prescribed body touches an island of the last find().
    bool is_driven(std::size_t island) const {
        for (const std::uint32_t link : islands_.links(island)) {
            for (const std::uint32_t body : {links_[link].a, links_[link].b}) {
                if (moves_[body] == 0 && prescribed_index_[body] != kNone) return true;
            }
        }
        return false;
    }
    /// Contacts between bodies, ascending by pair; includes pairs of sleepers.
    std::span<const PairManifold> manifolds() const { return manifolds_; }
    /// [manifolds] Impulse on body a in the last step(), N s.
    std::span<const Eigen::Vector3d> pair_impulses() const { return pair_impulses_; }
    /// [bodies] Impulse of the ground on the body in the last step(), N s.
    std::span<const Eigen::Vector3d> ground_impulses() const { return ground_impulses_; }
    /// Sensors and dynamic bodies whose boxes overlapped in the last find(), ascending.
    std::span<const BodyPair> sensor_pairs() const { return sensor_pairs_; }
    /// Number of pairs skipped in the last find() because too many bodies are in one place.
    std::size_t skipped_pair_count() const { return skipped_pair_count_; }

    /// Removes the contacts of a body that was removed or placed anew. Calls touched(other) for each body that it was
    /// in contact with.
    void forget_contacts(std::uint32_t body, const std::function<void(std::uint32_t)>& touched);
    /// Replaces the contacts by the manifolds() of another solver.
    void restore_contacts(std::vector<PairManifold> manifolds) {
        manifolds_ = std::move(manifolds);
    }
    /// Whether a contact of a moving body with the ground closed fast enough to bounce in the last step().
    bool has_struck_ground(std::size_t body) const { return struck_[body] != 0; }
    /// Number of pairs that have contacts and at least one moving body.
    std::size_t touching_pair_count() const { return pair_count_; }

private:
    /// Data of a contact that closes in the step, for restitution at its end.
    struct Impact {
        std::uint32_t a, b;   // b is kNone for a contact with the ground
        double gap;           // distance to close at the start of the substep, metres
        double acceleration;  // along the approach, m/s^2
        double pushed_speed;  // closing speed caused by wheels in the substep, m/s
        double restitution;   // 0 to 1
    };
    /// Per-thread buffers for stepping an island.
    struct Scratch {
        std::vector<ContactRows> rows;
        std::vector<ContactDirection> directions;  // [contacts]
        std::vector<Impact> impacts;               // [contacts]
        std::vector<double> separating_speeds;     // [contacts]
    };
    /// The arguments of step().
    struct Scene {
        std::span<RigidBody> bodies;
        std::span<GroundGate> gates;
        const BodyActuators& actuators;
        const StepSpan& span;

        GroundContactCache& ground_contacts(std::uint32_t body) const {
            return gates[body].contacts();
        }
    };

    void update_bounds(std::span<const RigidBody> bodies, std::span<const Mobility> mobility,
                       const StepSpan& span);
    std::span<const BodyPair> find_pairs(std::span<const RigidBody> bodies, double duration);
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
    /// The contacts of a link; null for links of wheels.
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
    bool is_two_scene_;
    bool collide_bodies_, records_impulses_;
    PairFilter pair_filter_;
    LazyBoxes boxes_;                          // of moving bodies, for two scenes
    std::vector<Aabb> bounds_;                 // boxes; for two scenes cubes of moving bodies
    std::vector<std::uint8_t> has_bounds_;     // [bodies] the body is still and its box is valid
    std::vector<std::uint8_t> partner_count_;  // [bodies] number of pairs so far, in a crowd
    std::vector<BodyPair> sensor_pairs_;
    std::size_t skipped_pair_count_ = 0;
    std::vector<PairManifold> manifolds_, previous_manifolds_;  // ascending by pair
    SeparatedPairs separated_;
    // For each pair's first manifold: index in previous_manifolds_, or kNone.
    std::vector<std::uint32_t> previous_index_;
    std::size_t pair_count_ = 0;   // see touching_pair_count()
    std::vector<BodyPair> links_;  // manifolds with a moving body, then wheels on bodies
    std::vector<std::uint32_t> link_manifolds_;  // index of each link's manifold; kNone: wheels
    std::vector<std::uint8_t> wakes_;            // [groups]
    std::vector<std::uint8_t> moves_;
    Islands islands_;
    std::vector<SolverBody> solver_bodies_;        // [bodies]
    std::vector<RigidBody> later_prescribed_;      // prescribed bodies of links, in later substeps
    std::vector<std::uint32_t> prescribed_index_;  // [bodies] index in later_prescribed_, or kNone
    std::vector<Eigen::Vector3d> pair_impulses_, ground_impulses_;
    std::vector<std::uint8_t> struck_;  // see has_struck_ground()
    std::vector<Scratch> scratch_;      // [workers]
};

}  // namespace terrane::internal
