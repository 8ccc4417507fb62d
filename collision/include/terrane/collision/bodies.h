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

struct BodySettings {
    /// Of uniform density; of flat shapes the area has mass, and of a compound's parts those that are solid, if any
    /// is. Where parts overlap, mass counts twice.
    Shape shape = Sphere{};
    double mass = 1.0;               ///< kilograms, 1e-9 to 1e12
    double friction = 0.6;           ///< Coulomb, 0 to 1e6
    double restitution = 0.2;        ///< 0 to 1
    double contact_tolerance = 0.0;  ///< metres, to 1000; 0: default_contact_tolerance(shape)
};

/// Why a body did not move in a step, if it did not.
enum class BodyCondition : std::uint8_t {
    awake,
    asleep,      ///< at rest on the ground
    parked,      ///< the ground that it may meet is not resident: pose and velocity kept
    left_world,  ///< beyond the ground's extent: in free fall
};

struct BodyState {
    Pose pose;                                                   ///< world_from_shape
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< of the centre of mass, m/s
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< world axes, rad/s
    BodyCondition condition = BodyCondition::awake;
};

struct BodyWorldSettings {
    Eigen::Vector3d gravity = Eigen::Vector3d(0.0, 0.0, -9.81);
    double max_substep = 1.0 / 120.0;  ///< steps are cut in equal parts not longer than this, s
    bool allow_sleep = true;
    bool bodies_meet = true;  ///< false: they pass through each other, and nothing is spent on it
    BroadphaseKind broadphase = BroadphaseKind::sap;  ///< `grid` for bodies of like size
    int worker_count = 1;  ///< threads that step() runs on, its caller's included, 1 to 64
};

/// What the last step cost and lost. Counts are of bodies, times of body seconds.
struct StepReport {
    std::uint64_t awake = 0;
    std::uint64_t parked = 0;
    std::uint64_t left_world = 0;
    std::uint64_t asleep = 0;
    std::uint64_t touching_pairs = 0;  ///< of bodies, not both at rest, in the last substep
    std::uint64_t islands = 0;  ///< groups of bodies that touch each other, in the last substep
    std::uint64_t impacts = 0;  ///< on the ground
    double simulated_time = 0.0;    ///< sum over awake bodies of the time that they moved for
    double lost_time = 0.0;     ///< sum of what was cut off after too many impacts in one substep
    double max_depth_m = 0.0;   ///< deepest of any awake body in the contact surface after the step
    std::uint64_t too_deep = 0;  ///< bodies deeper than their tolerance that did not start so
};

/// What a shape that moves through a world of bodies meets first.
struct WorldCastAnswer {
    static constexpr std::size_t kGround = ~std::size_t{0};

    QueryStatus status = QueryStatus::invalid;
    bool hit = false;
    double fraction = 1.0;       ///< of the motion
    std::size_t body = kGround;  ///< that was hit
    WorldPos point_world = WorldPos::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, towards the moving shape
};

/// Rigid bodies on the ground and on each other.
///
/// Every pose change passes one gate, which proves its way clear or casts it: nothing is ever set from a height lookup. A body
/// is never deeper than its tolerance in the contact surface, whoever pushes it; one that was put in deeper
/// comes out along contact normals at bounded speed and never gets deeper. Bodies that overlap each other part at
/// bounded speed. Bodies that touch sleep and wake together; where all of such a group are slower than 0.3 m/s
/// their spins lose 4 of themselves a second, or what rocks on others never came to rest. Parked bodies stand still for all others.
/// The same calls give the same bits with any number of workers.
///
/// Left out on purpose, so that each promise above holds without exception: joints, motors and springs; static and
/// kinematic bodies; forces that last (apply_impulse() in each step), drag and rolling resistance; collision filters and
/// sensors; removal of bodies (an index stays a body's name); lists of contacts (find_contacts() and shape_pairs.h
/// answer them for any pose). Trucks, tracked vehicles and walkers meet the ground, not these bodies. docs/bodies.md
/// says what to do instead.
///
/// Threads:   one at a time
/// Allocates: step() only where more bodies, or more that touch, take part on a thread than ever before
class BodyWorld {
public:
    static Result<BodyWorld> create(const BodyWorldSettings& settings);
    BodyWorld(BodyWorld&&) noexcept;
    BodyWorld& operator=(BodyWorld&&) noexcept;
    ~BodyWorld();

    /// Adds a body; its index is the count of bodies before.
    /// Fails with invalid_argument for anything not finite or out of range.
    ///
    /// Allocates: a hull or compound whose centre of mass is not its origin, or whose axes are not those of its
    /// inertia, is made anew for the body
    Result<std::size_t> add(const BodySettings& settings, const BodyState& state);

    /// Replaces a body's state (a teleport: not a motion, nothing is cast).
    /// Fails with invalid_argument, and keeps the last good state, for anything not finite.
    Result<void> set_state(std::size_t body, const BodyState& state);

    /// Changes a body's velocities by an impulse, N s, that acts at a point; wakes it and who sleeps with it.
    /// Fails with invalid_argument for anything not finite, or where the velocities would be out of range.
    Result<void> apply_impulse(std::size_t body, const WorldPos& point_world,
                      const Eigen::Vector3d& impulse);

    /// What a moving shape, a projectile say, meets first: bodies where they are now, or the ground. A body that
    /// it meets already at its start counts only where they move closer.
    ///
    /// @param except a body that is passed through: who shot
    /// Threads:   any number at once, while nothing else is called
    /// Allocates: nothing
    /// Cost:      O(bodies) for their bounds, and a cast for each that the way comes near
    WorldCastAnswer cast(const Ground& ground, const Shape& shape, const Motion& motion,
                         std::size_t except = WorldCastAnswer::kGround) const;

    std::span<const BodyState> states() const;
    std::span<const BodySettings> settings() const;

    /// What the bodies ask of a pager, parked ones included. Valid until the next call.
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
