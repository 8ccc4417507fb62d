// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/islands/island_solver.h"
#include "bodies/step/collision_step.h"

#include <terrane/collision/bodies.h>

#include <deque>
#include <vector>

namespace terrane {

/// Arrays indexed by body, and what they share.
struct BodyWorld::State {
    explicit State(const BodyWorldSettings& settings);

    /// @param body complete but for its parts and its motion
    std::size_t add(const internal::RigidBody& body, internal::CentredShape&& shape,
                    const BodySettings& body_settings, const BodyState& state);
    void replace(std::size_t index, const BodyState& state);
    /// Wakes the body and its sleep group.
    void set_velocity(std::size_t index, const internal::Twist& velocity);
    StepReport step(const Ground& ground, double dt);

    BodyWorldSettings settings;
    std::vector<internal::RigidBody> bodies;
    std::vector<BodyState> states;
    std::vector<BodySettings> body_settings;
    std::vector<BodyNeed> needs;

private:
    void begin_step();
    void take_collision_step(const Ground& ground, const internal::StepSpan& span);
    void begin_body(std::size_t index, const Ground& ground, const internal::StepSpan& span);
    void find_islands(const Ground& ground, const internal::StepSpan& span);
    void end_body(std::size_t index, const Ground& ground, const internal::StepSpan& span);
    bool is_stepped(std::size_t index) const { return !is_asleep(index) && is_parked[index] == 0; }
    void finish_body(std::size_t index, const Ground& ground, StepReport& report);
    void fall_asleep(double dt);
    void put_to_sleep(std::size_t index, std::uint32_t group);
    void wake_group(std::uint32_t group);
    bool is_asleep(std::size_t index) const {
        return states[index].condition == BodyCondition::asleep;
    }

    std::deque<internal::BodyPart> parts;  // one each, centred; bodies point to them
    std::vector<Pose> frames;              // body_from_centred
    std::vector<internal::GroundContactCache> ground_contacts;
    std::vector<internal::BodyMotion> before;     // the step, for those that park in it
    std::vector<internal::SubstepAnswer> totals;  // of the step
    std::vector<internal::StepStart> starts;      // of the collision step
    std::vector<internal::Mobility> mobility;
    std::vector<double> quiet_times;          // how long each body has been slow and held, s
    std::vector<std::uint32_t> sleep_groups;  // the lowest body that it fell asleep with
    std::vector<std::uint8_t> is_parked;      // parked in this step
    std::vector<double> lifts;                // after the step
    internal::WorkerTeam team;
    internal::IslandSolver island_solver;
};

}  // namespace terrane
