// SPDX-License-Identifier: MIT
#pragma once

#include "broadphase/body_queries.h"
#include "world/contact_tracker.h"
#include "world/island_solver.h"
#include "world/solver/body_checks.h"
#include "world/solver/ground_gate.h"
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

/// Motion of a kinematic body to a pose.
struct KinematicTarget {
    Pose pose;
    double time_left = 0.0;  // s
};
}  // namespace internal

/// The bodies of a world, with the data of steps and queries.
struct World::State {
    /// Data of a body that neither solver nor gate reads.
    struct BodyRecord {
        Shape shape;                                       // centred: RigidBody::shape points to it
        Pose body_from_centred;                            // body: the frame of BodySettings::shape
        Eigen::Vector3d force = Eigen::Vector3d::Zero();   // applied in the next step, N
        Eigen::Vector3d torque = Eigen::Vector3d::Zero();  // applied in the next step, N m
        std::optional<internal::KinematicTarget> target;   // none: the body keeps its velocity
        double quiet_time = 0.0;                           // time spent slow and supported, s
        bool is_placed_anew = false;                       // placed since the last step
        std::unique_ptr<internal::Vehicle> vehicle;        // null: not a vehicle
        std::unique_ptr<internal::Character> character;    // null: not a character
    };
    /// Result of the last step for one body.
    struct BodyStep {
        internal::BodyMotion before;  // restored if the body parks
        internal::GateAnswer total;
        double lift = 0.0;  // after the step, metres
        bool is_parked = false;
    };
    /// Vehicles and characters, and their wheels and feet in a collision step.
    struct Actuators {
        std::vector<std::uint32_t> vehicles, characters;  // slots, ascending
        // [slots] null: the body exerts no forces. `wheels` is empty without vehicles, `feet` without characters.
        std::vector<internal::WheelSet*> wheels;
        std::vector<const internal::FootDrive*> feet;
        std::vector<BodyPair> wheel_links;  // pairs of a vehicle and a body under its wheels
    };
    /// The queries' copy of the bodies, rebuilt by the first query after a change.
    struct QueryCache {
        void update(const internal::SlotIds& slots, std::span<const internal::RigidBody> of_world);

        std::mutex mutex;
        std::atomic<bool> is_current{false};
        std::vector<internal::QueryBody> bodies;
        std::vector<Aabb> bounds;
        internal::BodyTree tree;
        int refit_count = 0;
    };

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
    /// Radius around the centre of mass within which a dynamic body at rest can touch the ground; includes suspension
    /// travel and step height.
    double reach(std::size_t index) const;
    /// Copies a body's motion into its state.
    void publish(std::size_t index);
    BodyType type(std::size_t index) const { return body_settings[index].type; }
    Result<void> check_body_id(BodyId body) const;
    Result<void> check_dynamic(BodyId body) const;
    /// Applies impulses. Fails if the velocities would be out of range.
    Result<void> push(BodyId body, const Eigen::Vector3d& impulse,
                      const Eigen::Vector3d& angular_impulse);

    BodyId add_character(const CharacterSettings& settings, const BodySettings& body_settings,
                         const BodyPlacement& placement);
    internal::Character* character(BodyId body) const {
        return ids.contains(body) ? records[body.index].character.get() : nullptr;
    }
    internal::Vehicle* vehicle(BodyId body) const {
        return ids.contains(body) ? records[body.index].vehicle.get() : nullptr;
    }
    Result<void> check_force(std::size_t index, const Eigen::Vector3d& force) const;
    Result<void> check_torque(std::size_t index, const Eigen::Vector3d& torque) const;

    // ---- Steps (world_step.cpp) ----

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

    /// The ground, and the bodies at their current poses.
    internal::QueryScene scene(const Ground& ground) const;
    /// Call after changing anything that steps or queries read.
    void touch() {
        idle_report.reset();
        queries.is_current.store(false, std::memory_order_relaxed);
    }

    // ---- Data ----

    WorldSettings settings;
    internal::SlotIds ids;

    // [slots] Separate arrays, because callers and the island solver get spans of them, and because loops over all
    // bodies read only a few.
    std::vector<BodyState> states;
    std::vector<BodySettings> body_settings;
    std::vector<internal::RigidBody> bodies;
    std::vector<internal::GroundGate> gates;
    std::vector<internal::Mobility> mobility;  // in the last collision step
    std::vector<std::uint32_t> sleep_groups;   // lowest body of the group that fell asleep together
    // [slots]
    std::deque<BodyRecord> records;  // a deque, because bodies point to its shapes
    std::vector<BodyStep> steps;

    Actuators actuators;
    internal::ContactTracker contacts;
    internal::IslandSolver island_solver;
    internal::WorkerTeam team;
    mutable QueryCache queries;
    std::vector<BodyNeed> needs;            // the answer of needs()
    std::uint64_t failed_callbacks = 0;     // in the last step
    std::optional<Ground> ground_before;    // of the last collision step; keeps its chunks alive
    std::optional<StepReport> idle_report;  // the report of all steps until something changes

    // ---- Helpers of steps ----

    void set_up(std::size_t index, const BodySettings& settings, internal::CentredShape&& shape,
                const internal::MassProperties* mass);
    void forget_contacts(std::size_t index);

    void begin_step();
    void enter_step(std::size_t index, const Eigen::Vector3d& acceleration);
    void run_collision_step(const Ground& ground, const internal::StepSpan& span);
    void begin_body(std::size_t index, const Ground& ground, const internal::StepSpan& span);
    void set_mobility(std::size_t index);
    void find_islands(const Ground& ground, const internal::StepSpan& span);
    void begin_actuators(const Ground& ground, double duration);
    void cast_wheels(const internal::QueryScene& scene);
    void choose_actuators();
    /// Copies the state of a vehicle's or character's body to it.
    void show_to_actuators(std::size_t index);
    void end_actuators(const Ground& ground, double duration);
    void finish_actuators(const Ground& ground, double dt, StepReport& report);
    void end_body(std::size_t index, const Ground& ground, const internal::StepSpan& span);
    void finish_kinematic(std::size_t index, double dt, StepReport& report);
    void finish_dynamic(std::size_t index, const Ground& ground, StepReport& report);
    Eigen::Vector3d gravity_of(const internal::RigidBody& body);
    bool may_collide(std::uint32_t a, std::uint32_t b);
    void fall_asleep(double dt);
    void put_to_sleep(std::size_t index, std::uint32_t group);
    void wake_group(std::uint32_t group);
    bool is_asleep(std::size_t index) const {
        return states[index].condition == BodyCondition::asleep;
    }
    bool is_stepped(std::size_t index) const {
        return mobility[index] != internal::Mobility::absent &&
               type(index) == BodyType::dynamic_body && !is_asleep(index) &&
               !steps[index].is_parked;
    }
    bool is_prescribed(std::size_t index) const {
        const internal::Twist& velocity = bodies[index].velocity;
        return records[index].is_placed_anew ||
               !(velocity.linear.isZero(0.0) && velocity.angular.isZero(0.0));
    }
};

}  // namespace terrane
