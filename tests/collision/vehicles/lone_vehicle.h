// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/world.h>

#include <gtest/gtest.h>

#include <span>
#include <string>
#include <utility>

namespace terrane::test {

/// A world with one vehicle.
class LoneVehicle {
public:
    explicit LoneVehicle(const Pose& start, const VehicleSettings& settings = {},
                         const WorldSettings& world_settings = {})
        : world_(World::create(world_settings).value()) {
        const Result<BodyId> id = world_.add_vehicle(settings, start);
        EXPECT_TRUE(id.has_value());
        id_ = *id;
    }

    StepReport step(const Ground& ground, const VehicleControls& controls, double dt) {
        EXPECT_TRUE(world_.set_controls(id_, controls));
        return world_.step(ground, dt);
    }

    World& world() { return world_; }
    BodyId id() const { return id_; }
    const VehicleState& state() const { return *world_.vehicle(id_); }
    const BodyState& chassis() const { return state().chassis; }
    std::span<const WheelState> wheels() const { return state().wheels; }
    bool is_rolled_over() const { return state().is_rolled_over; }
    const VehicleSettings& settings() const { return *world_.vehicle_settings(id_); }

private:
    World world_;
    BodyId id_;
};

/// Why a vehicle is refused; empty where it is not.
inline std::string vehicle_refusal(const VehicleSettings& settings, const Pose& start = {}) {
    World world = World::create({}).value();
    const Result<BodyId> added = world.add_vehicle(settings, start);
    return added ? std::string() : added.error().message;
}

}  // namespace terrane::test
