// SPDX-License-Identifier: MIT
#pragma once

#include "broadphase/body_queries.h"
#include "world/contact_tracker.h"
#include "world/island_solver.h"
#include "world/solver/body_checks.h"
#include "world/solver/body_step.h"
#include "world/vehicle/character_parts.h"
#include "world/vehicle/vehicle_parts.h"

#include <terrane/collision/world.h>

#include <atomic>
#include <deque>
#include <mutex>
#include <optional>
#include <vector>

namespace terrane {

namespace internal {
class FieldReader;
class FieldWriter;
class ShapeReader;
}  // namespace internal

/// Arrays indexed by slot, and shared data.
struct World::State {
    explicit State(const WorldSettings& settings);

    // ---- Bodies (world_bodies.cpp) ----

    /// @param shape centred
    /// @param mass  null: computed from the shape with uniform density
    BodyId add(const BodySettings& settings, internal::CentredShape&& shape,
               const BodyPlacement& placement, const internal::MassProperties* mass = nullptr);
    BodyId add_vehicle(std::unique_ptr<internal::Vehicle> vehicle, const BodySettings& settings,
                       Compound&& shape, const BodyPlacement& placement);
    void remove(BodyId body);
    void change(std::size_t index, const BodySettings& settings, internal::CentredShape&& shape,
                const BodyPlacement& placement);
    void place(std::size_t index, const BodyPlacement& placement);
    void set_velocity(std::size_t index, const internal::Twist& velocity);
    BodyMove move_to(std::size_t index, const Pose& world_from_shape, const Ground& ground);
    /// Wakes the body and its sleep group.
    void wake(std::size_t index);
    /// Radius around the centre of mass within which a dynamic body at rest can touch the ground, including wheels and
    /// steps.
    double reach(std::size_t index) const;
    /// Copies a body's motion into its state.
    void publish(std::size_t index);
    BodyType type(std::size_t index) const { return body_settings[index].type; }
    Result<void> check_body_id(BodyId body) const;
    Result<void> check_dynamic(BodyId body) const;
    /// Fails if the velocities would be out of range.
    Result<void> push(BodyId body, const Eigen::Vector3d& impulse,
                      const Eigen::Vector3d& angular_impulse);

    BodyId add_character(const CharacterSettings& settings, const BodySettings& body_settings,
                         const BodyPlacement& placement);
    internal::Character* character(BodyId body) const {
        return ids.contains(body) ? characters[body.index].get() : nullptr;
    }
    internal::Vehicle* vehicle(BodyId body) const {
        return ids.contains(body) ? vehicles[body.index].get() : nullptr;
    }
    Result<void> check_force(std::size_t index, const Eigen::Vector3d& force) const;
    Result<void> check_torque(std::size_t index, const Eigen::Vector3d& torque) const;

    // ---- Steps (world_step.cpp, world_step.cpp) ----

    StepReport step(const Ground& ground, double dt);

    // ---- Saved worlds (world_save.cpp) ----

    std::vector<std::byte> save() const;
    void resize(std::size_t count);
    /// Reads the body of a used slot.
    void load_body(std::size_t index, internal::FieldReader& in, internal::ShapeReader& shapes);
    void save_role(std::size_t index, internal::FieldWriter& out) const;
    void load_role(std::size_t index, const BodySettings& own, internal::FieldReader& in);
    void load_vehicle(std::size_t index, const BodySettings& own, internal::FieldReader& in);
    void load_character(std::size_t index, const BodySettings& own, internal::FieldReader& in);

    // ---- Queries (world.cpp) ----

    /// The bodies at their current poses.
    internal::QueryScene scene(const Ground& ground) const;
    /// Invalidates the query scene; call after changing anything that queries read.
    void touch() {
        is_idle = false;
        is_scene_current.store(false, std::memory_order_relaxed);
    }

    WorldSettings settings;
    internal::SlotIds ids;
    std::vector<internal::RigidBody> bodies;
    std::vector<BodyState> states;
    std::vector<BodySettings> body_settings;
    std::vector<BodyNeed> needs;
    std::vector<Eigen::Vector3d> forces, torques;  // of the next step; N, N m
    std::vector<std::optional<Pose>> targets;      // of kinematic bodies that move to a pose
    std::vector<double> target_times;              // seconds until the target is reached
    std::vector<Pose> frames;                      // body_from_centred
    std::vector<internal::GroundContactCache> ground_contacts;
    std::vector<double> quiet_times;  // time for which a body has been slow and supported, s
    std::vector<std::uint32_t> sleep_groups;   // lowest body of the group that fell asleep together
    std::vector<std::uint8_t> is_placed_anew;  // since the last step
    std::vector<std::unique_ptr<internal::Vehicle>> vehicles;      // null: not a vehicle
    std::vector<std::unique_ptr<internal::Character>> characters;  // null: not a character
    internal::ContactTracker contacts;
    internal::IslandSolver island_solver;

    bool is_idle = false;    ///< nothing moves and nothing has changed since the last step
    StepReport idle_report;  ///< report of a step of an idle world

    // ---- Helpers of steps ----

    void set_up(std::size_t index, const BodySettings& settings, internal::CentredShape&& shape,
                const internal::MassProperties* mass);
    void forget_contacts(std::size_t index);

    void begin_step();
    void take_collision_step(const Ground& ground, const internal::StepSpan& span);
    void begin_body(std::size_t index, const Ground& ground, const internal::StepSpan& span);
    void set_mobility(std::size_t index);
    void find_islands(const Ground& ground, const internal::StepSpan& span);
    void begin_drives(const Ground& ground, double duration);
    void cast_wheels(const internal::QueryScene& scene);
    void choose_drives();
    /// Copies the state of a vehicle's or character's body to it.
    void show_to_drives(std::size_t index);
    void end_drives(const Ground& ground, double duration);
    void finish_drives(const Ground& ground, double dt, StepReport& report);
    void end_body(std::size_t index, const Ground& ground, const internal::StepSpan& span);
    void finish_kinematic(std::size_t index, double dt, StepReport& report);
    void finish_dynamic(std::size_t index, const Ground& ground, StepReport& report);
    Eigen::Vector3d gravity_of(const internal::RigidBody& body);
    bool may_collide(std::uint32_t a, std::uint32_t b);
    void update_scene() const;
    void fall_asleep(double dt);
    void put_to_sleep(std::size_t index, std::uint32_t group);
    void wake_group(std::uint32_t group);
    bool is_asleep(std::size_t index) const {
        return states[index].condition == BodyCondition::asleep;
    }
    bool is_stepped(std::size_t index) const {
        return mobility[index] != internal::Mobility::absent &&
               type(index) == BodyType::dynamic_body && !is_asleep(index) && is_parked[index] == 0;
    }
    bool drives(std::size_t index) const {
        const internal::Twist& velocity = bodies[index].velocity;
        return is_placed_anew[index] != 0 ||
               !(velocity.linear.isZero(0.0) && velocity.angular.isZero(0.0));
    }

    std::vector<std::uint32_t> character_slots;    // ascending
    std::vector<const internal::FootDrive*> feet;  // as wheel_sets
    std::vector<std::uint32_t> vehicle_slots;      // ascending
    std::vector<internal::WheelSet*> wheel_sets;  // those that exert forces; empty without vehicles
    std::vector<BodyPair> wheel_links;            // vehicles and bodies under their wheels
    std::deque<Shape> body_shapes;                // centred; bodies point to them
    std::vector<internal::BodyMotion> before;  // state before the step, for bodies that park in it
    std::vector<internal::SubstepAnswer> totals;  // of the step
    std::vector<internal::StepStart> starts;      // of the collision step
    std::vector<internal::Mobility> mobility;
    std::vector<std::uint8_t> is_parked;  // parked in this step
    std::optional<Ground> ground_before;  // of the last collision step; keeps its chunks alive
    std::vector<double> lifts;            // after the step
    std::uint64_t failed_callbacks = 0;   // in this step
    internal::WorkerTeam team;

    // The scene of queries, built by the first query after a change.
    mutable std::mutex scene_mutex;
    mutable std::atomic<bool> is_scene_current{false};
    mutable std::vector<internal::QueryBody> query_bodies;
    mutable std::vector<Aabb> query_bounds;
    mutable internal::BodyTree tree;
    mutable int refit_count = 0;
};

}  // namespace terrane
