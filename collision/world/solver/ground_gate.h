// SPDX-License-Identifier: MIT
#pragma once

#include "world/solver/ground_contact_cache.h"
#include "world/solver/rigid_body.h"

#include <terrane/collision/ground_queries.h>

#include <cstdint>
#include <optional>

namespace terrane::internal {

/// Duration and substeps of a collision step, the same for all bodies.
struct StepSpan {
    double duration = 0.0;  ///< of the collision step, seconds
    int substep_count = 1;  ///< number of equal substeps

    double substep() const { return duration / substep_count; }
};

/// How far a body was moved.
struct MoveAnswer {
    bool resident = true;
    bool hit = false;
    double fraction = 1.0;  ///< of the displacement
};

/// What happened to a body in a step, or in a part of it.
struct GateAnswer {
    /// False if ground needed for the result is not resident; then the pose may have changed.
    bool resident = true;
    bool touches = false;  ///< near enough to the ground for contacts
    std::uint64_t impacts = 0;
    double simulated_time = 0.0;
    double lost_time = 0.0;
    /// Impulse of the ground on the body, N s; excludes impulses that the island's solver applied.
    Eigen::Vector3d impulse = Eigen::Vector3d::Zero();

    void add(const GateAnswer& later) {
        resident = resident && later.resident;
        touches = later.touches;
        impacts += later.impacts;
        simulated_time += later.simulated_time;
        lost_time += later.lost_time;
        impulse += later.impulse;
    }
};

/// The gate between one body and the ground. It owns the body's ground contacts and the offset surface above which the
/// body stays, and moves the body only along motions that are proved clear of that surface or cast against it. Thereby
/// the penetration depth is bounded by construction, whatever solver and integrator do.
///
/// A collision step calls begin(). The island solver then moves the body in substeps, using contacts() and scratch
/// poses. Finally, end() applies the net displacement.
class GroundGate {
public:
    enum class State : std::uint8_t {
        open,          ///< the body takes part in the collision step
        too_deep,      ///< the body penetrates all offset surfaces: end() only recovers it
        not_resident,  ///< ground that it may touch is not resident: end() fails
    };

    // ---- A step of the world ----

    /// Invalidates the contacts of the previous step. If they were reused, results would depend on which other chunks
    /// are resident.
    void begin_step() { contacts_.begin_step(); }
    /// Restores the impulses of begin_step() and forgets the proofs since then, for a body whose step is undone.
    void undo_step();

    // ---- A collision step ----

    /// Finds the ground contacts that a body may have within the collision step, and the highest offset surface that it
    /// does not penetrate. Bodies above all reachable ground have no contacts.
    ///
    /// @param ground_before ground of the previous collision step, or null
    void begin(RigidBody& body, const Ground& ground, const Ground* ground_before,
               const StepSpan& span);
    State state() const { return state_; }
    /// Pose at begin().
    const Pose& start() const { return start_; }
    /// Sets State::not_resident, for a body whose wheels or feet lack resident ground.
    void set_not_resident() { state_ = State::not_resident; }
    /// Moves a body from its start to its current pose along one motion. If only part of the motion is proved clear,
    /// the body stops at the end of that part and is simulated alone for the remaining time. A body that is too deep
    /// recovers instead.
    GateAnswer end(RigidBody& body, const Ground& ground, const StepSpan& span);

    // ---- Outside of collision steps ----

    /// Moves a body by a displacement, or until it reaches the stop gap of the highest offset surface that it does not
    /// penetrate. A body that is too deep does not move.
    MoveAnswer move(RigidBody& body, const Ground& ground, const Twist& displacement);

    /// The contacts with the ground, at the poses of the substeps.
    GroundContactCache& contacts() { return contacts_; }
    const GroundContactCache& contacts() const { return contacts_; }
    /// Makes the next begin() test the body for penetration even if its pose and the ground are unchanged.
    void forget_proof() { clear_pose_.reset(); }
    /// Resets the gate to the state of a new one, but keeps its memory.
    void reset();

private:
    /// How advance() finds a hit if only part of the displacement is proved clear.
    enum class HitSearch {
        cast_rest,       ///< casts the remaining displacement: the hit is at first touch
        stop_at_proved,  ///< reports a hit at the end of the proved part, unless nothing is proved
    };
    /// The part of a lone step between two contact queries.
    struct Interval {
        GateAnswer answer;
        bool is_last = false;  ///< whether the interval ends with the step
    };

    bool is_proved_clear(const RigidBody& body, const Ground& ground,
                         const Ground* ground_before) const;
    bool choose_surface(RigidBody& body);
    GateAnswer step_alone(RigidBody& body, const Ground& ground, double duration);
    Interval step_interval(RigidBody& body, const Ground& ground, double duration);
    void solve(RigidBody& body, double duration) const;
    bool separate(RigidBody& body, const Ground& ground, double duration);
    MoveAnswer move_freely(RigidBody& body, const Ground& ground, double duration, bool is_flying);
    MoveAnswer advance(RigidBody& body, const Ground& ground, const Twist& displacement,
                       HitSearch hits = HitSearch::cast_rest);
    MoveAnswer advance_on_mesh(RigidBody& body, const Ground& ground, const Motion& motion,
                               const Pose& end);

    GroundContactCache contacts_;
    OffsetSurface surface_;
    Pose start_;
    State state_ = State::open;
    /// Pose at which the end of the previous collision step proved the body clear of the first offset surface.
    std::optional<Pose> clear_pose_;
};

/// Casts a wheel against the first offset surface of the given tolerance. Except near volumes, the wheel is raised
/// instead of the surface being lowered, so the contact is kFirstOffset tolerances too high.
CastAnswer cast_wheel(const Shape& shape, const Motion& motion, const Ground& ground,
                      double tolerance);

/// Largest lift of a body, metres, >= 0: an upper bound of its penetration depth.
double greatest_lift(const RigidBody& body, const Ground& ground);

/// The penetration depth of a body in the contact surface, or `at_least` if that is larger, metres.
/// @param lift greatest_lift() of the body; if this is at most `at_least`, no depth is computed
double deepest(const RigidBody& body, const Ground& ground, double lift, double at_least);

/// Whether there is no ground below or above a point.
bool is_outside(const Ground& ground, const WorldPos& point);

}  // namespace terrane::internal
