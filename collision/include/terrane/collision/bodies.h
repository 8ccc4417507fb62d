// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/broadphase.h>
#include <terrane/collision/ground_cast.h>
#include <terrane/terrain/body_need.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane {

/// What a body is made of. Fixed once the body is added.
struct BodySettings {
    /// Of uniform density. The mass of a flat shape is on its area. In a compound with solid parts the flat ones have
    /// no mass, and overlaps count twice.
    Shape shape = Sphere{};
    double mass = 1.0;               ///< kilograms, 1e-9 to 1e12
    double friction = 0.6;           ///< Coulomb, 0 to 1e6
    double restitution = 0.2;        ///< 0 to 1
    double contact_tolerance = 0.0;  ///< metres, to 1000; 0: default_contact_tolerance(shape)
};

/// How a body takes part in a step.
enum class BodyCondition : std::uint8_t {
    awake,       ///< moves
    asleep,      ///< at rest, not stepped until something touches it
    parked,      ///< ground that it may meet is not resident: pose and velocity are kept
    left_world,  ///< outside the ground's extent: in free fall
};

/// Where a body is and how it moves.
struct BodyState {
    Pose pose;                                                   ///< world_from_shape
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< of the centre of mass, m/s
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< world axes, rad/s
    BodyCondition condition = BodyCondition::awake;
};

/// Settings of a world. Fixed once it is created.
struct BodyWorldSettings {
    Eigen::Vector3d gravity = Eigen::Vector3d(0.0, 0.0, -9.81);  ///< m/s^2, world axes
    double max_substep = 1.0 / 120.0;  ///< largest substep of a step, s, 1e-5 to 1
    bool allow_sleep = true;
    bool bodies_meet = true;  ///< false: bodies pass through each other, at no cost
    BroadphaseKind broadphase = BroadphaseKind::sap;  ///< `grid` for bodies of similar size
    int worker_count = 1;  ///< threads that step() uses, the caller's included, 1 to 64
};

/// Counts and limits of one step. Times are summed over bodies, seconds.
struct StepReport {
    std::uint64_t awake = 0;           ///< bodies that were simulated
    std::uint64_t parked = 0;          ///< BodyCondition::parked
    std::uint64_t left_world = 0;      ///< BodyCondition::left_world
    std::uint64_t asleep = 0;          ///< BodyCondition::asleep
    std::uint64_t touching_pairs = 0;  ///< touching, at least one moving, in the last substep
    std::uint64_t islands = 0;         ///< groups of touching bodies in the last substep
    std::uint64_t impacts = 0;         ///< on the ground
    double simulated_time = 0.0;       ///< time that awake bodies moved for
    double lost_time = 0.0;            ///< time cut off after too many impacts in a substep
    double max_depth_m = 0.0;    ///< largest penetration depth of an awake body after the step
    std::uint64_t too_deep = 0;  ///< bodies deeper than their tolerance that were not placed so
};

/// First hit of a moving shape in a world of bodies.
struct WorldCastAnswer {
    /// Value of `body` that stands for the ground.
    static constexpr std::size_t kGround = ~std::size_t{0};

    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool hit = false;                           ///< whether anything is met
    double fraction = 1.0;                      ///< of the motion, up to the hit
    std::size_t body = kGround;                 ///< index of the body that was hit, or kGround
    WorldPos point_world = WorldPos::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, towards the moving shape
};

/// Rigid bodies on the ground and on each other.
///
/// Every pose change is proved clear of the ground by a swept test, or cast against it; no pose is set from a height
/// lookup. The penetration depth of a body in the contact surface never exceeds its tolerance, whatever acts on it; a
/// body that was placed deeper moves out along contact normals at bounded speed and never gets deeper. Overlapping
/// bodies separate at bounded speed. Bodies that touch sleep and wake together; an island slower than 0.3 m/s gets
/// angular damping of 4 /s so that it can sleep. Parked bodies have infinite mass to others. The same calls give the
/// same bits with any number of workers.
///
/// Left out on purpose, so that these promises hold without exception: joints, motors and springs; static and kinematic
/// bodies; persistent forces (apply_impulse() in each step), drag and rolling resistance; collision filters and
/// sensors; removal of bodies (an index stays valid); lists of contacts (find_contacts() and shape_pairs.h compute them
/// for any pose). Trucks, tracked vehicles and walkers meet the ground, not these bodies. docs/bodies.md names
/// alternatives.
///
/// Threads:   one at a time
/// Allocates: step() only where more bodies or contacts take part on a thread than ever before
class BodyWorld {
public:
    /// A world without bodies. Fails with invalid_argument for settings out of range.
    static Result<BodyWorld> create(const BodyWorldSettings& settings);
    BodyWorld(BodyWorld&&) noexcept;
    BodyWorld& operator=(BodyWorld&&) noexcept;
    ~BodyWorld();

    /// Adds a body and returns its index: the number of bodies before.
    ///
    /// Fails:     invalid_argument for anything not finite or out of range
    /// Allocates: the body; and a copy of a hull or compound whose origin is not its centre of mass, or whose axes are
    ///            not its principal axes
    Result<std::size_t> add(const BodySettings& settings, const BodyState& state);

    /// Replaces a body's state: a teleport, nothing is cast. Its sleep group wakes.
    ///
    /// Fails: invalid_argument for anything not finite or out of range; the state is then unchanged
    Result<void> set_state(std::size_t body, const BodyState& state);

    /// Applies an impulse, N s, at a point; wakes the body and its sleep group.
    ///
    /// Fails: invalid_argument for anything not finite, or where the velocities would be out of range
    Result<void> apply_impulse(std::size_t body, const WorldPos& point_world,
                               const Eigen::Vector3d& impulse);

    /// First hit of a moving shape, such as a projectile, with the ground or with the bodies at their present poses. A
    /// body that it touches at its start counts only if they approach.
    ///
    /// @param except index of a body that is ignored, such as the one that fired
    ///
    /// Threads:   any number at once, while nothing else is called
    /// Allocates: nothing
    /// Cost:      O(bodies) for their bounds, and a cast for each body near the sweep
    WorldCastAnswer cast(const Ground& ground, const Shape& shape, const Motion& motion,
                         std::size_t except = WorldCastAnswer::kGround) const;

    /// One entry for each body, by its index. Valid until the next call that is not const.
    std::span<const BodyState> states() const;
    std::span<const BodySettings> settings() const;

    /// The bodies' needs for a pager, parked bodies included. Valid until the next call.
    std::span<const BodyNeed> needs();

    /// Moves every body by dt seconds, 0 < dt <= 1.
    StepReport step(const Ground& ground, double dt);

    /// Hash of every state's bits.
    std::uint64_t state_hash() const;

private:
    struct State;
    explicit BodyWorld(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
