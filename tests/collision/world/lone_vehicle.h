// SPDX-License-Identifier: MIT
#pragma once

#include "collision/world/body_cases.h"

#include <gtest/gtest.h>

#include <span>
#include <string>

namespace terrane::test {

/// Adds an axis-aligned box.
inline BodyId add_box(World& world, const Eigen::Vector3d& half_extents, const WorldPos& centre,
                      BodySettings settings = {.type = BodyType::static_body}) {
    settings.shape = Box{half_extents};
    return add(world, settings, at(centre));
}

/// A world with one vehicle.
class LoneVehicle {
public:
    explicit LoneVehicle(const Pose& start, const VehicleSettings& settings = {},
                         const WorldSettings& world_settings = {})
        : world_(make_world(world_settings)), id_(world_.add_vehicle(settings, start).value()) {}
    /// Ahead to the east.
    explicit LoneVehicle(const WorldPos& place, const VehicleSettings& settings = {},
                         const WorldSettings& world_settings = {})
        : LoneVehicle(Pose{.translation = place}, settings, world_settings) {}

    StepReport step(const Ground& ground, const VehicleControls& controls, double dt = kStep) {
        EXPECT_TRUE(world_.set_controls(id_, controls));
        return world_.step(ground, dt);
    }
    StepReport follow(const Ground& ground, PathDriver& driver, double dt = kStep) {
        return step(ground, driver.drive(settings(), state(), dt), dt);
    }
    /// Steps for some seconds and checks every report.
    void drive(const Ground& ground, const VehicleControls& controls, double seconds,
               double dt = kStep) {
        for (double time = 0.0; time < seconds - 1e-9; time += dt) {
            const StepReport report = step(ground, controls, dt);
            ASSERT_EQ(report.too_deep, 0u);
            ASSERT_EQ(report.parked, 0u);
        }
    }

    World& world() { return world_; }
    BodyId id() const { return id_; }
    const VehicleState& state() const { return *world_.vehicle(id_); }
    const BodyState& chassis() const { return state().chassis; }
    const WorldPos& place() const { return chassis().pose.translation; }
    std::span<const WheelState> wheels() const { return state().wheels; }
    bool is_rolled_over() const { return state().is_rolled_over; }
    const VehicleSettings& settings() const { return *world_.vehicle_settings(id_); }

private:
    World world_;
    BodyId id_;
};

/// The message that refuses a vehicle; empty if it is accepted.
inline std::string vehicle_refusal(const VehicleSettings& settings, const Pose& start = {}) {
    const Result<BodyId> added = make_world().add_vehicle(settings, start);
    return added ? std::string() : added.error().message;
}

/// Height of the default capsule's centre above its foot, metres.
inline constexpr double kTall = 0.9;

/// A world with one character and its obstacles.
class LoneCharacter {
public:
    explicit LoneCharacter(const WorldPos& place, const CharacterSettings& settings = {},
                           const WorldSettings& world_settings = {})
        : world_(make_world(world_settings)), id_(world_.add_character(settings, place).value()) {}

    /// Adds an axis-aligned box.
    BodyId add_box(const Eigen::Vector3d& half_extents, const WorldPos& centre,
                   const BodySettings& settings = {.type = BodyType::static_body}) {
        return test::add_box(world_, half_extents, centre, settings);
    }

    StepReport step(const Ground& ground, const CharacterControls& controls, double dt = kStep) {
        EXPECT_TRUE(world_.set_controls(id_, controls));
        return world_.step(ground, dt);
    }

    /// Steps for some seconds and checks every report.
    void walk(const Ground& ground, const CharacterControls& controls, double seconds,
              double dt = kStep) {
        for (double time = 0.0; time < seconds - 1e-9; time += dt) {
            const StepReport report = step(ground, controls, dt);
            ASSERT_EQ(report.too_deep, 0u);
            ASSERT_EQ(report.lost_time, 0.0);
        }
    }

    World& world() { return world_; }
    BodyId id() const { return id_; }
    const CharacterState& state() const { return *world_.character(id_); }
    const WorldPos& place() const { return state().body.pose.translation; }
    const BodyState& of(BodyId body) const { return world_.state(body); }

private:
    World world_;
    BodyId id_;
};

/// The message that refuses a character; empty if it is accepted.
inline std::string character_refusal(const CharacterSettings& settings,
                                     const WorldPos& place = {0, 0, 0}) {
    const Result<BodyId> added = make_world().add_character(settings, place);
    return added ? std::string() : added.error().message;
}

}  // namespace terrane::test
