// SPDX-License-Identifier: MIT
#pragma once

#include "world/island_solver.h"
#include "world/solver/body_checks.h"

#include <terrane/collision/body.h>

#include <span>
#include <vector>

namespace terrane::internal {

/// A pair of touching bodies, or a body that touches the ground (`b` is none).
struct TouchingPair {
    BodyId a{}, b{};
    bool is_sensor = false;

    friend bool operator==(const TouchingPair&, const TouchingPair&) = default;
};

/// Compares the contacts after a step with those after the previous step, and generates contact events.
class ContactTracker {
public:
    /// Data of a world that the tracker reads, indexed by slot.
    struct Bodies {
        const SlotIds& ids;
        std::span<const RigidBody> bodies;
        std::span<GroundGate> gates;
        std::span<const Mobility> mobility;  ///< of the last collision step
    };

    /// Starts a step and clears the events.
    void begin_step();
    /// Adds the impulses of a collision step.
    void add_impulses(const IslandSolver& islands, std::span<const Mobility> mobility);
    /// Adds an impulse of the ground on a body, N s, that was not solved by the body's island.
    void add_ground_impulse(std::uint32_t body, const Eigen::Vector3d& impulse);
    /// Ends a step: finds touching pairs and generates the events.
    void end_step(const IslandSolver& islands, const Bodies& bodies);

    std::span<const ContactEvent> events() const { return events_; }
    std::span<const ContactPoint> points(const ContactEvent& event) const {
        return std::span(points_).subspan(event.first_point, event.point_count);
    }

    /// Pairs that touched after the last step, ascending.
    std::span<const TouchingPair> touching() const { return touching_; }
    void restore(std::vector<TouchingPair> touching) { touching_ = std::move(touching); }

private:
    struct Contact {
        std::uint32_t a, b;  // b: kNone for the ground
        bool is_sensor = false;
        bool touches = false;  // at the end of the step, or had an impulse
        Eigen::Vector3d impulse = Eigen::Vector3d::Zero();
        Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
        double least_gap = kInfinity;
        std::uint32_t first_point = 0, point_count = 0;
        std::uint32_t order = 0;  // position among all entries as they were added
    };
    void find_pairs(const IslandSolver& islands, const Bodies& bodies);
    void find_ground(const Bodies& bodies);
    void find_sensors(const IslandSolver& islands, const Bodies& bodies);
    void add_point(Contact& contact, const SolverContact& point, double gap);
    void merge_contacts();
    void make_events(const Bodies& bodies);
    void make_event(const TouchingPair& pair, ContactPhase phase, const Contact* contact);

    std::vector<Contact> contacts_;  // ascending, one per pair after merge_contacts()
    std::vector<TouchingPair> touching_, touching_before_;
    std::vector<ContactEvent> events_;
    std::vector<ContactPoint> points_;
};

}  // namespace terrane::internal
