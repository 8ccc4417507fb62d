// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/collision/body.h>
#include <terrane/collision/broadphase.h>
#include <terrane/collision/query.h>
#include <terrane/collision/vehicle.h>
#include <terrane/collision/world_query.h>
#include <terrane/terrain/body_need.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/ground_batch.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace terrane {

/// Functions that a world calls in step(), on the thread of the caller. Their results must depend only on their
/// arguments, or equal calls no longer give equal bits. Exceptions that they throw are caught and counted in
/// StepReport::failed_callbacks.
struct WorldCallbacks {
    /// Gravity at a point of the world, m/s^2; replaces WorldSettings::gravity. Called once a step for each awake body,
    /// with its centre of mass. If it throws, or returns a component that is not finite or beyond 1e4,
    /// WorldSettings::gravity applies.
    std::function<Eigen::Vector3d(const WorldPos&)> gravity_at;
    /// Whether two bodies collide. Called for bodies that may touch and whose filters match. If it throws, the bodies
    /// collide.
    std::function<bool(BodyId, BodyId)> may_collide;
};

/// Settings of a world. Fixed once it is created, except the substep: World::set_max_substep().
struct WorldSettings {
    Eigen::Vector3d gravity = Eigen::Vector3d(0.0, 0.0, -9.81);  ///< m/s^2, world axes
    double max_substep = 1.0 / 120.0;  ///< largest substep of a step, s, 1e-5 to 1
    bool allow_sleep = true;           ///< islands at rest fall asleep, at no cost until touched
    bool collide_bodies = true;        ///< false: bodies pass through each other, at no cost
    bool report_contacts = false;      ///< whether step() fills contact_events()
    /// Whether step() measures StepReport::max_depth_m, too_deep and kinematic_in_ground. Costs one more contact query
    /// for each awake or kinematic body.
    bool measure_depth = true;
    BroadphaseKind broadphase = BroadphaseKind::sap;  ///< any kind gives the same bits
    int worker_count = 1;        ///< threads that step() uses, the caller's included, 1 to 64
    WorldCallbacks callbacks{};  ///< functions that step() calls
};

/// Longest step of a world, seconds.
inline constexpr double kMostStep = 10.0;

/// Counts and extremes of one step. Times are summed over bodies, seconds.
struct StepReport {
    std::uint64_t awake = 0;           ///< dynamic bodies that were simulated
    std::uint64_t parked = 0;          ///< BodyCondition::parked
    std::uint64_t left_world = 0;      ///< BodyCondition::left_world
    std::uint64_t asleep = 0;          ///< BodyCondition::asleep
    std::uint64_t touching_pairs = 0;  ///< pairs with a moving body, in the last collision step
    std::uint64_t islands = 0;         ///< groups of touching bodies in the last collision step
    std::uint64_t impacts = 0;         ///< on the ground
    double simulated_time = 0.0;       ///< time for which awake bodies moved
    double lost_time = 0.0;            ///< time not simulated, after too many impacts of a body
    double max_depth_m = 0.0;    ///< largest depth of an awake body in the ground after the step
    std::uint64_t too_deep = 0;  ///< bodies deeper than their tolerance, except placed ones
    /// Bodies deeper in the ground than their tolerance that were placed there since the previous step.
    std::uint64_t placed_deep = 0;
    /// Kinematic bodies, sensors excepted, that overlap the ground by more than their tolerance.
    std::uint64_t kinematic_in_ground = 0;
    /// Pairs that may touch but, in the last collision step, were not simulated: too many bodies are in one place.
    std::uint64_t skipped_pairs = 0;
    std::uint64_t refused_steps = 0;     ///< 1: dt was out of range, and nothing moved
    std::uint64_t failed_callbacks = 0;  ///< calls of callbacks that threw or gave an invalid value

    bool operator==(const StepReport&) const = default;
};

/// How far World::move_to() moved a body.
struct BodyMove {
    bool is_resident = true;  ///< false: it may hit ground that is not loaded; it did not move
    double fraction = 0.0;    ///< of the motion, 0 to 1; 0 if the body was too deep already
};

/// Rigid bodies on the ground and on each other.
///
/// Every pose change of a dynamic body is proved clear of the ground by a swept test, or is a cast against the ground;
/// no pose is set from a height lookup. The body's depth in the contact surface never exceeds its tolerance, whatever
/// acts on it. A body that was placed deeper moves out along contact normals at bounded speed and never gets deeper.
/// Overlapping bodies separate at bounded speed. Bodies that touch form an island, which sleeps and wakes as a whole;
/// if it is slower than 0.3 m/s, it gets angular damping of 4 /s so that it can sleep. A parked body acts on others as
/// if it had infinite mass. The same calls give the same bits with any number of workers.
///
/// A dynamic body that would leave the limit of positions is parked and keeps its velocity; a kinematic one stops.
///
/// Bodies are named by ids. Every call refuses the id of a removed body, even if its slot has been reused.
/// docs/bodies.md lists the limits and the missing features.
///
/// Fails:     all functions that return a Result: invalid_argument, naming the argument and its value, for an id that
///            names no body and for a value not finite or out of range; nothing is changed then
/// Threads:   one at a time, except for queries
/// Allocates: step() only when a thread has more bodies or contacts than ever before
class World {
public:
    /// A world without bodies.
    static Result<World> create(const WorldSettings& settings);
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;
    ~World();

    // ---- Bodies ----

    /// Adds a body. Sleeping bodies that it touches wake in the next step().
    ///
    /// Fails:     also for a static body with a velocity, a non-rotating body with a spin, or a dynamic sensor
    /// Allocates: the body's state; for a dynamic hull or compound also a copy of the shape in its centre-of-mass,
    ///            principal-axis frame, unless it is already given in that frame
    Result<BodyId> add(const BodySettings& settings, const BodyPlacement& placement);

    /// Removes a body and wakes the bodies that touch it.
    Result<void> remove(BodyId body);

    /// Replaces a body's settings and, as teleport() does, places it anew: at its pose, with its velocities. Velocities
    /// that the new settings do not allow become 0: all of a static body, the spin of a non-rotating one. Forces added
    /// for the next step are dropped. The body, and those that touch it, wake.
    Result<void> change(BodyId body, const BodySettings& settings);

    /// Replaces a body's pose and velocities without a cast. The body, and those that touched it, wake. If it is then
    /// deeper in the ground than its tolerance, the next step counts it as placed_deep, and it recovers.
    Result<void> teleport(BodyId body, const BodyPlacement& placement);

    /// Moves a dynamic body along the straight motion to a pose, until the ground stops it; other bodies do not. Wakes
    /// the body and keeps its velocity.
    ///
    /// Fails: also invalid_argument for a body that is not dynamic
    Result<BodyMove> move_to(BodyId body, const Pose& world_from_shape, const Ground& ground);

    /// Gives a kinematic body the velocity that brings it to a pose in `dt` seconds, 1e-6 to kMostStep. Steps that last
    /// `dt` in total end exactly at that pose; then the velocity is 0.
    Result<void> move_kinematic(BodyId body, const Pose& world_from_shape, double dt);

    /// Sets the velocities of a dynamic or kinematic body; wakes it.
    Result<void> set_velocity(BodyId body, const Eigen::Vector3d& velocity,
                              const Eigen::Vector3d& angular_velocity);

    /// Applies an impulse, N s, at a point of a dynamic body; wakes it.
    Result<void> apply_impulse(BodyId body, const WorldPos& point_world,
                               const Eigen::Vector3d& impulse);
    /// Applies an angular impulse, N m s, to a dynamic body; wakes it.
    Result<void> apply_angular_impulse(BodyId body, const Eigen::Vector3d& angular_impulse);

    /// Adds a force, N, at a point of a dynamic body for the duration of the next step; wakes it.
    Result<void> add_force(BodyId body, const WorldPos& point_world, const Eigen::Vector3d& force);
    /// Adds a force, N, at the centre of mass of a dynamic body for the duration of the next step; wakes it.
    Result<void> add_force(BodyId body, const Eigen::Vector3d& force);
    /// Adds a torque, N m, to a dynamic body for the duration of the next step; wakes it.
    Result<void> add_torque(BodyId body, const Eigen::Vector3d& torque);

    /// Wakes a body and its sleeping island.
    Result<void> wake(BodyId body);
    /// Wakes all sleeping dynamic bodies whose bounding spheres overlap a box, metres, and their islands. A sleeping
    /// body is not tested against the ground: call this after the ground has changed (VolumeEditor). A box with
    /// low > high or with a NaN wakes no body.
    ///
    /// Cost: O(bodies)
    void wake(const Aabb& box_world);

    /// Whether the id names a body of this world.
    bool contains(BodyId body) const;
    /// The id of the body with an index; an invalid id if there is no such body.
    BodyId id(std::size_t index) const;

    /// State of a body; BodyCondition::removed if the id names no body. Valid until the next call that is not const.
    const BodyState& state(BodyId body) const;
    /// The settings of a body. Valid until the next call that is not const. Requires contains(body); default settings
    /// otherwise.
    const BodySettings& settings(BodyId body) const;

    /// All states: one for each index that ever had a body. Valid until the next call that is not const.
    std::span<const BodyState> states() const;
    /// The settings of all bodies, in the order of states(). Valid until the next call that is not const.
    std::span<const BodySettings> settings() const;

    /// The needs of all dynamic bodies for a pager, parked and sleeping bodies included. Valid until the next call.
    std::span<const BodyNeed> needs();

    // ---- Vehicles ----

    /// Adds a vehicle: a dynamic body with wheels. All functions for bodies except change() accept its id.
    /// @param world_from_chassis pose of the chassis
    Result<BodyId> add_vehicle(const VehicleSettings& settings, const Pose& world_from_chassis);

    /// Sets the controls of a vehicle from the next step on; wakes the vehicle if they change. It falls asleep only
    /// while it brakes. Controls that are not finite are ignored: the last valid ones are used.
    Result<void> set_controls(BodyId vehicle, const VehicleControls& controls);

    /// State after the last step; null if the body is not a vehicle. Valid until the next call that is not const.
    const VehicleState* vehicle(BodyId body) const;
    /// The settings given to add_vehicle(); null if the body is not a vehicle.
    const VehicleSettings* vehicle_settings(BodyId body) const;

    // ---- Characters ----

    /// Adds a character: a dynamic capsule that stays upright, slides along obstacles, climbs steps, and rides on the
    /// body that it stands on. All functions for bodies except change() accept its id.
    /// @param place_world centre of the capsule
    Result<BodyId> add_character(const CharacterSettings& settings, const WorldPos& place_world);

    /// Sets the controls of a character from the next step on; wakes it if they change. Controls that are not finite or
    /// out of range are ignored: the last valid ones are used.
    Result<void> set_controls(BodyId character, const CharacterControls& controls);

    /// State after the last step; null if the body is not a character. Valid until the next call that is not const.
    const CharacterState* character(BodyId body) const;
    /// The settings given to add_character(); null if the body is not a character.
    const CharacterSettings* character_settings(BodyId body) const;

    // ---- Steps ----

    /// Moves every body by dt seconds, 0 < dt <= kMostStep. Any other dt is refused and counted, and nothing moves.
    StepReport step(const Ground& ground, double dt);

    /// Changes WorldSettings::max_substep from the next step on.
    Result<void> set_max_substep(double max_substep);

    /// The contacts that began, stayed or ended in the last step, in ascending order of (a, b); a body's contact with
    /// the ground comes last. Contacts between sleeping bodies last without events. Empty without
    /// WorldSettings::report_contacts. Valid until the next call that is not const.
    std::span<const ContactEvent> contact_events() const;
    /// The points of a contact of contact_events().
    std::span<const ContactPoint> contact_points(const ContactEvent& event) const;

    // ---- Queries ----
    //
    // Queries of the bodies at their current poses and of the ground: see world_query.h.
    //
    // Threads:   any number at once, while nothing else is called
    // Allocates: the first query after a change, if there are more bodies than ever before
    // Cost:      O(log bodies) plus one query for each body whose box the query reaches; O(bodies) for the first query
    //            after a change or a step

    /// The first point of the segment `from` to `to` that is inside or on a body, or on the ground.
    RayQueryAnswer ray(const Ground& ground, const WorldPos& from, const WorldPos& to,
                       const QueryFilter& filter = {}) const;
    /// The same with the ground of a RayFan, for many rays from one point; has the preconditions of RayFan::ray().
    RayQueryAnswer ray(const RayFan& ground, const WorldPos& from, const WorldPos& to,
                       const QueryFilter& filter = {}) const;
    /// The first contact of a moving shape.
    CastQueryAnswer cast(const Ground& ground, const Shape& shape, const Motion& motion,
                         const QueryFilter& filter = {}) const;
    /// The bodies that a shape touches or overlaps, and whether it touches the ground.
    OverlapQueryAnswer overlaps(const Ground& ground, const Shape& shape,
                                const Pose& world_from_shape, std::span<BodyId> bodies_out,
                                const QueryFilter& filter = {}) const;
    /// The body or the ground nearest to a shape.
    /// @param max_distance limit of the search, metres, >= 0; infinity is allowed
    NearestQueryAnswer nearest(const Ground& ground, const Shape& shape,
                               const Pose& world_from_shape, double max_distance,
                               const QueryFilter& filter = {}) const;

    // ---- State ----

    /// Hash of the bits of all states().
    std::uint64_t state_hash() const;

    /// Serialises the world, into the same bytes on every machine. The world that load() makes of them continues with
    /// the same bits. Callbacks, the thread count and the events of the last step are not saved.
    std::vector<std::byte> save() const;

    /// Restores a world from the bytes that save() wrote.
    ///
    /// Fails: bad_data for bytes not written by save(); invalid_argument if `callbacks` does not set the same functions
    ///        as the callbacks of the saved world, or for a worker_count that create() refuses
    static Result<World> load(std::span<const std::byte> bytes,
                              const WorldCallbacks& callbacks = {}, int worker_count = 1);

private:
    struct State;
    explicit World(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
