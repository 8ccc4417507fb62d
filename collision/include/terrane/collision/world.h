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

/// Functions that a world calls in step(), on the thread of the caller. They must not depend on anything but their
/// arguments, or the same calls no longer give the same bits. What they throw is counted, see
/// StepReport::failed_callbacks, and goes no further.
struct WorldCallbacks {
    /// Gravity at a point of the world, m/s^2, in place of WorldSettings::gravity. Called with the centre of mass of
    /// each awake body once a step. Where it throws, or a component is not finite or beyond 1e4, that setting is used.
    std::function<Eigen::Vector3d(const WorldPos&)> gravity_at;
    /// Whether two bodies whose filters permit it collide. Called for bodies that may touch. Where it throws they do.
    std::function<bool(BodyId, BodyId)> may_collide;
};

/// Settings of a world. Fixed once it is created.
struct WorldSettings {
    Eigen::Vector3d gravity = Eigen::Vector3d(0.0, 0.0, -9.81);  ///< m/s^2, world axes
    double max_substep = 1.0 / 120.0;  ///< largest substep of a step, s, 1e-5 to 1
    bool allow_sleep =
        true;  ///< islands at rest fall asleep, and cost nothing until they are touched
    bool collide_bodies = true;    ///< false: bodies pass through each other, at no cost
    bool report_contacts = false;  ///< true: step() makes contact_events()
    /// step() measures StepReport::max_depth_m and too_deep: one more contact query for each awake body.
    bool measure_depth = true;
    BroadphaseKind broadphase = BroadphaseKind::sap;  ///< `grid` for bodies of similar size
    int worker_count = 1;        ///< threads that step() uses, the caller's included, 1 to 64
    WorldCallbacks callbacks{};  ///< what the world asks and tells during a step
};

/// Longest step of a world, seconds.
inline constexpr double kMostStep = 10.0;

/// Counts and limits of one step. Times are summed over bodies, seconds.
struct StepReport {
    std::uint64_t awake = 0;       ///< dynamic bodies that were simulated
    std::uint64_t parked = 0;      ///< BodyCondition::parked
    std::uint64_t left_world = 0;  ///< BodyCondition::left_world
    std::uint64_t asleep = 0;      ///< BodyCondition::asleep
    std::uint64_t touching_pairs =
        0;                        ///< touching, at least one moving, in the last collision step
    std::uint64_t islands = 0;    ///< groups of touching bodies in the last collision step
    std::uint64_t impacts = 0;    ///< on the ground
    double simulated_time = 0.0;  ///< time that awake bodies moved for
    double lost_time = 0.0;       ///< time cut off after too many impacts in a substep
    double max_depth_m = 0.0;     ///< largest penetration depth of an awake body after the step
    std::uint64_t too_deep = 0;   ///< bodies deeper than their tolerance that were not placed so
    /// Bodies that began the step deeper than their tolerance in the ground because they were placed there.
    std::uint64_t placed_deep = 0;
    std::uint64_t kinematic_in_ground = 0;  ///< kinematic bodies, no sensors, that touch the ground
    /// Pairs that may touch but are not simulated because too many bodies are in one place.
    std::uint64_t skipped_pairs = 0;
    std::uint64_t refused_steps = 0;  ///< 1: dt was out of range, and nothing moved
    std::uint64_t failed_callbacks =
        0;  ///< calls of WorldCallbacks that threw or gave no valid value

    bool operator==(const StepReport&) const = default;
};

/// How far World::move_to() moved a body.
struct BodyMove {
    bool is_resident = true;  ///< false: ground that it may meet is not loaded, and it did not move
    double fraction = 0.0;  ///< of the motion, 0 to 1; 0 also where it is deeper than its tolerance
};

/// Rigid bodies on the ground and on each other.
///
/// Every pose change of a dynamic body is proved clear of the ground by a swept test, or cast against it; no pose is
/// set from a height lookup. Its penetration depth in the contact surface never exceeds its tolerance, whatever acts on
/// it; a body that was placed deeper moves out along contact normals at bounded speed and never gets deeper.
/// Overlapping bodies separate at bounded speed. Bodies that touch sleep and wake together; an island slower than 0.3
/// m/s gets angular damping of 4 /s so that it can sleep. Parked bodies have infinite mass to others. The same calls
/// give the same bits with any number of workers.
///
/// A dynamic body whose motion would take it beyond the limit of poses is parked, with its velocity; a kinematic one
/// stops.
///
/// Bodies are named by ids. A removed body's id is refused by every call, also when its slot has another body.
/// docs/bodies.md lists the limits and the missing features.
///
/// Fails:     all functions that return a Result: invalid_argument, naming the argument and its value, for an id of no
///            body, and anything not finite or out of range; nothing is changed then
/// Threads:   one at a time, but for queries
/// Allocates: step() only where more bodies or contacts take part on a thread than ever before
class World {
public:
    /// A world without bodies.
    static Result<World> create(const WorldSettings& settings);
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;
    ~World();

    // ---- Bodies ----

    /// Adds a body. It wakes sleepers that it touches.
    ///
    /// Fails:     also invalid_argument for a static body that has a velocity, a dynamic sensor
    /// Allocates: the body; and a copy of a dynamic hull or compound whose origin is not its centre of mass, or whose
    ///            axes are not its principal axes
    Result<BodyId> add(const BodySettings& settings, const BodyPlacement& placement);

    /// Removes a body; wakes those that touch it.
    Result<void> remove(BodyId body);

    /// Replaces a body's settings; its pose and velocities are kept, but a static body's velocity is 0, and so is the
    /// spin of one that does not rotate; forces for the next step are dropped. The body, and those that touch it, wake.
    /// Counts as placed anew: see teleport().
    Result<void> change(BodyId body, const BodySettings& settings);

    /// Replaces a body's pose and velocities: nothing is cast. The body, and those that touched it, wake. If it is then
    /// deeper in the ground than its tolerance, the next step counts it as placed_deep, and it recovers.
    Result<void> teleport(BodyId body, const BodyPlacement& placement);

    /// Moves a dynamic body along the straight motion to a pose, until the ground stops it. Bodies do not stop it. Its
    /// velocity is kept. Wakes it.
    ///
    /// Fails: also invalid_argument for a body that is not dynamic
    Result<BodyMove> move_to(BodyId body, const Pose& world_from_shape, const Ground& ground);

    /// Gives a kinematic body the velocity that brings it to a pose within `dt` seconds, to kMostStep. The next step
    /// ends it at that pose if it lasts `dt`; the velocity is then 0 again.
    Result<void> move_kinematic(BodyId body, const Pose& world_from_shape, double dt);

    /// Sets the velocities of a dynamic or kinematic body; wakes it.
    Result<void> set_velocity(BodyId body, const Eigen::Vector3d& velocity,
                              const Eigen::Vector3d& angular_velocity);

    /// Applies an impulse, N s, at a point to a dynamic body; wakes it.
    Result<void> apply_impulse(BodyId body, const WorldPos& point_world,
                               const Eigen::Vector3d& impulse);
    /// The same with an angular impulse, N m s.
    Result<void> apply_angular_impulse(BodyId body, const Eigen::Vector3d& angular_impulse);

    /// Adds a force, N, at a point of a dynamic body for the duration of the next step; wakes it.
    Result<void> add_force(BodyId body, const WorldPos& point_world, const Eigen::Vector3d& force);
    /// The same at its centre of mass.
    Result<void> add_force(BodyId body, const Eigen::Vector3d& force);
    /// The same with a torque, N m.
    Result<void> add_torque(BodyId body, const Eigen::Vector3d& torque);

    /// Wakes a body and those that it sleeps with.
    Result<void> wake(BodyId body);
    /// Wakes all sleeping dynamic bodies whose bounding spheres overlap a box, metres, and the bodies that they sleep
    /// with. A sleeping body is not tested against the ground: call this after the ground has changed (VolumeEditor). A
    /// box with low > high or with a NaN wakes no body.
    ///
    /// Cost: O(bodies)
    void wake(const Aabb& box_world);

    /// Whether the id names a body of this world.
    bool contains(BodyId body) const;
    /// The id of the body with an index; none where there is no body.
    BodyId id(std::size_t index) const;

    /// The state of a body. An id of no body gets a state of BodyCondition::removed. Valid until the next call that is
    /// not const.
    const BodyState& state(BodyId body) const;
    /// The settings of a body. Valid until the next call that is not const. Requires contains(body); default settings
    /// otherwise.
    const BodySettings& settings(BodyId body) const;

    /// All states, to iterate over: one for each index that ever had a body. Valid until the next call that is not
    /// const.
    std::span<const BodyState> states() const;
    /// The settings of the same bodies, in the same order and for as long.
    std::span<const BodySettings> settings() const;

    /// The needs for a pager, parked bodies included, one entry for each dynamic body. Valid until the next call.
    std::span<const BodyNeed> needs();

    // ---- Vehicles ----

    /// Adds a vehicle: a dynamic body with wheels, that all functions for bodies take but for change().
    /// @param world_from_chassis pose of the chassis
    Result<BodyId> add_vehicle(const VehicleSettings& settings, const Pose& world_from_chassis);

    /// Controls of a vehicle from the next step on; wakes it where they change. It falls asleep only while it brakes.
    /// Controls that are not finite are ignored: the last valid ones are used.
    Result<void> set_controls(BodyId vehicle, const VehicleControls& controls);

    /// State after the last step; null where the body is no vehicle. Valid until the next call that is not const.
    const VehicleState* vehicle(BodyId body) const;
    /// The settings given to add_vehicle(); null where the body is no vehicle.
    const VehicleSettings* vehicle_settings(BodyId body) const;

    // ---- Characters ----

    /// Adds a character: a dynamic capsule that stays upright, that all functions for bodies take but for change(). It
    /// slides along what it meets, climbs steps, and rides on what it stands on.
    Result<BodyId> add_character(const CharacterSettings& settings, const WorldPos& place_world);

    /// Controls of a character from the next step on; wakes it where they change. Controls that are not finite or out
    /// of range are ignored: the last valid ones are used.
    Result<void> set_controls(BodyId character, const CharacterControls& controls);

    /// State after the last step; null where the body is no character. Valid until the next call that is not const.
    const CharacterState* character(BodyId body) const;
    /// The settings given to add_character(); null where the body is no character.
    const CharacterSettings* character_settings(BodyId body) const;

    // ---- Steps ----

    /// Moves every body by dt seconds, 0 < dt <= kMostStep. Any other dt is refused and counted, and nothing moves.
    StepReport step(const Ground& ground, double dt);

    /// The contacts of the last step, in ascending order of (a, b), those of a body with the ground last: all that
    /// began or ended, and those that stayed where a body is awake. Empty without WorldSettings::report_contacts.
    /// Bodies that fall asleep keep their contacts without events. Valid until the next call that is not const.
    std::span<const ContactEvent> contact_events() const;
    /// The points of a contact of contact_events().
    std::span<const ContactPoint> contact_points(const ContactEvent& event) const;

    // ---- Queries ----
    //
    // Of the bodies at their present poses and of the ground, as world_query.h says.
    //
    // Threads:   any number at once, while nothing else is called
    // Allocates: the first query after a change, where there are more bodies than ever before
    // Cost:      O(log bodies) and the queries of bodies whose boxes are met; O(bodies) for the first query after a
    //            change or a step

    /// The first point of the segment `from` to `to` inside or on a body, or on the ground.
    RayQueryAnswer ray(const Ground& ground, const WorldPos& from, const WorldPos& to,
                       const QueryFilter& filter = {}) const;
    /// The same for rays from one point: see RayFan::ray() for what is required of them.
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

    /// Hash of every state's bits.
    std::uint64_t state_hash() const;

    /// The world as bytes, the same on every machine: a world that load() makes of them continues with the same bits.
    /// Callbacks, the thread count and the events of the last step are not saved.
    std::vector<std::byte> save() const;

    /// A world made by save().
    ///
    /// Fails: bad_data for bytes that are not those of a save(); invalid_argument where `callbacks` and the saved world
    ///        differ in which callbacks they have, or for a worker_count that create() refuses
    static Result<World> load(std::span<const std::byte> bytes,
                              const WorldCallbacks& callbacks = {}, int worker_count = 1);

private:
    struct State;
    explicit World(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
