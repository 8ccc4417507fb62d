// SPDX-License-Identifier: MIT
// Vehicles that drive over bodies, into them, and on what moves.
#include "lone_vehicle.h"
#include "support/allocation_counter.h"
#include "support/heights/table_ground.h"
#include "support/random.h"

#include <terrane/collision/shape_pairs.h>
#include <terrane/collision/vehicle.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace terrane {
namespace vehicle_among_bodies_test {

using test::LoneVehicle;
using test::make_test_ground;

constexpr double kStep = 1.0 / 60.0;

Ground make_flat() {
    return make_test_ground([](double, double) { return 0.0; }, {.spacing = 4.0});
}

Pose pose_at(const WorldPos& place) {
    Pose pose;
    pose.translation = place;
    return pose;
}

BodyId add_box(World& world, const Eigen::Vector3d& half_extents, const WorldPos& centre,
               BodySettings settings = {.type = BodyType::static_body}) {
    settings.shape = Box{half_extents};
    BodyState state;
    state.pose = pose_at(centre);
    return world.add(settings, state).value();
}

void drive(LoneVehicle& vehicle, const Ground& ground, const VehicleControls& controls,
           double seconds) {
    for (double time = 0.0; time < seconds - 1e-9; time += kStep) {
        const StepReport report = vehicle.step(ground, controls, kStep);
        ASSERT_EQ(report.too_deep, 0u);
    }
}

TEST(VehicleAmongBodies, TellsWhatItsWheelsStandOnAndTheirLoads) {
    const Ground ground = make_flat();
    LoneVehicle truck(pose_at({100.0, 100.0, 1.5}));
    const BodyId plate = add_box(truck.world(), {1.0, 3.0, 0.05}, {101.6, 100.0, 0.05});
    drive(truck, ground, {.brake = 1.0}, 3.0);
    double load = 0.0;
    for (std::size_t i = 0; i < truck.wheels().size(); ++i) {
        const WheelState& wheel = truck.wheels()[i];
        EXPECT_TRUE(wheel.in_contact);
        EXPECT_EQ(wheel.body, i < 2 ? plate : BodyId{}) << i;
        EXPECT_NEAR(wheel.normal.z(), 1.0, 1e-3);
        EXPECT_NEAR(wheel.point_world.z(), i < 2 ? 0.1 : 0.0, 0.01);
        load += wheel.load;
    }
    EXPECT_NEAR(load, truck.settings().mass * 9.81, 0.01 * truck.settings().mass * 9.81);
}

TEST(VehicleAmongBodies, CrossesABridgeOverAGap) {
    // A trench 10 m deep and 20 m wide, and planks across it.
    const Ground ground = make_test_ground(
        [](double x, double) { return x > 140.0 && x < 160.0 ? -10.0 : 0.0; }, {.spacing = 2.0});
    LoneVehicle truck(pose_at({110.0, 100.0, 1.0}));
    for (int plank = 0; plank < 12; ++plank) {
        add_box(truck.world(), {0.99, 2.0, 0.1}, {139.0 + 2.0 * plank, 100.0, 0.1});
    }
    PathDriver driver = PathDriver::create({{110.0, 100.0}, {200.0, 100.0}}, {}).value();
    double lowest = 10.0;
    for (int step = 0; step < 60 * 15; ++step) {
        ASSERT_EQ(truck.step(ground, driver.drive(truck.settings(), truck.state()), kStep).too_deep,
                  0u);
        lowest = std::min(lowest, truck.chassis().pose.translation.z());
    }
    EXPECT_TRUE(driver.is_finished());
    EXPECT_GT(lowest, 0.5);
    EXPECT_NEAR(truck.chassis().pose.translation.y(), 100.0, 0.5);
}

TEST(VehicleAmongBodies, PushesCratesAsideAndPassesThroughNone) {
    const Ground ground = make_flat();
    for (const VehicleSettings& settings : {make_truck(), make_tracked(), make_six_wheeler()}) {
        LoneVehicle vehicle(pose_at({60.0, 100.0, 1.5}), settings);
        std::vector<BodyId> crates;
        for (int i = 0; i < 12; ++i) {
            const double y = 100.0 + 0.6 * (i % 4 - 1.5);
            crates.push_back(add_box(vehicle.world(), {0.4, 0.4, 0.4}, {90.0 + 6.0 * i, y, 0.4},
                                     {.mass = 30.0}));
        }
        drive(vehicle, ground, {.throttle = 0.6}, 12.0);
        int moved = 0;
        const Shape& chassis = vehicle.world().settings()[vehicle.id().index].shape;
        for (std::size_t i = 0; i < crates.size(); ++i) {
            const BodyState& crate = vehicle.world().states()[crates[i].index];
            moved += (crate.pose.translation.head<2>() -
                      Eigen::Vector2d(90.0 + 6.0 * static_cast<double>(i),
                                      100.0 + 0.6 * (static_cast<double>(i % 4) - 1.5)))
                                 .norm() > 0.3
                         ? 1
                         : 0;
            EXPECT_GT(
                signed_distance(Box{{0.4, 0.4, 0.4}}, crate.pose, chassis, vehicle.chassis().pose)
                    .distance,
                -0.05);
        }
        EXPECT_GT(moved, 6);
        EXPECT_GT(vehicle.chassis().pose.translation.x(), 110.0);
        EXPECT_FALSE(vehicle.is_rolled_over());
    }
}

TEST(VehicleAmongBodies, IsHeldByAGuardRailAtAnySpeed) {
    const Ground ground = make_flat();
    for (const double speed : {5.0, 20.0, 45.0}) {
        LoneVehicle truck(pose_at({60.0, 100.0, 0.75}));
        add_box(truck.world(), {100.0, 0.1, 0.5}, {150.0, 106.0, 0.6});
        drive(truck, ground, {.brake = 1.0}, 1.0);
        BodyState state = truck.chassis();
        const double angle = 0.35;  // towards the rail
        state.pose.rotation << std::cos(angle), -std::sin(angle), 0.0, std::sin(angle),
            std::cos(angle), 0.0, 0.0, 0.0, 1.0;
        state.velocity = speed * state.pose.rotation.col(0);
        ASSERT_TRUE(truck.world().teleport(truck.id(), state));
        for (int step = 0; step < 300; ++step) {
            ASSERT_EQ(truck.step(ground, {}, kStep).too_deep, 0u);
            ASSERT_LT(truck.chassis().pose.translation.y(), 106.0) << speed << " m/s, " << step;
        }
    }
}

TEST(VehicleAmongBodies, RidesOnAPlatformThatMoves) {
    const Ground ground = make_flat();
    LoneVehicle truck(pose_at({100.0, 100.0, 1.8}));
    const BodyId ferry = add_box(truck.world(), {4.0, 3.0, 0.3}, {100.0, 100.0, 0.6},
                                 {.type = BodyType::kinematic_body});
    drive(truck, ground, {.brake = 1.0}, 3.0);
    const double x = truck.chassis().pose.translation.x();
    ASSERT_TRUE(truck.world().set_velocity(ferry, {2.0, 0.0, 0.0}, {0.0, 0.0, 0.0}));
    drive(truck, ground, {.brake = 1.0}, 10.0);
    const double gone = truck.world().states()[ferry.index].pose.translation.x() - 100.0;
    EXPECT_NEAR(gone, 20.0, 1e-6);
    EXPECT_NEAR(truck.chassis().pose.translation.x() - x, gone, 0.5);
    EXPECT_EQ(truck.wheels()[0].body, ferry);
}

TEST(VehicleAmongBodies, SleepsBrakedOnAPlankAndWakesWhenItIsRemoved) {
    const Ground ground = make_flat();
    LoneVehicle truck(pose_at({100.0, 100.0, 1.6}));
    const BodyId plank =
        add_box(truck.world(), {4.0, 3.0, 0.2}, {100.0, 100.0, 0.2}, {.mass = 500.0});
    drive(truck, ground, {.brake = 1.0}, 6.0);
    EXPECT_EQ(truck.chassis().condition, BodyCondition::asleep);
    const double z = truck.chassis().pose.translation.z();
    ASSERT_TRUE(truck.world().remove(plank));
    drive(truck, ground, {.brake = 1.0}, 2.0);
    EXPECT_LT(truck.chassis().pose.translation.z(), z - 0.3);
}

TEST(VehicleAmongBodies, LeansLessWithAntiRollBars) {
    const Ground ground =
        make_test_ground([](double, double) { return 0.0; },
                         {.spacing = 32.0, .origin_x = -2048.0, .origin_y = -2048.0});
    double upright[2];
    for (const int i : {0, 1}) {
        VehicleSettings settings;
        for (AxleSettings& axle : settings.axles) axle.anti_roll = i == 0 ? 0.0 : 60e3;
        LoneVehicle truck(pose_at({-500.0, 0.0, 0.8}), settings);
        for (int step = 0; step < 360; ++step) truck.step(ground, {.throttle = 0.7}, kStep);
        upright[i] = 1.0;
        for (int step = 0; step < 180; ++step) {
            truck.step(ground, {.throttle = 0.3, .steer = 0.4}, kStep);
            upright[i] = std::min(upright[i], truck.chassis().pose.rotation(2, 2));
        }
    }
    EXPECT_GT(1.0 - upright[0], 1.3 * (1.0 - upright[1]));
}

TEST(VehicleAmongBodies, GiveTheSameBitsWithAnyNumberOfWorkers) {
    const Ground ground = make_test_ground(
        [](double x, double y) { return 0.8 * std::sin(0.2 * x) * std::sin(0.17 * y); }, 1.0, 1);
    const auto run = [&](int workers) {
        test::Random random(3);
        World world = World::create({.report_contacts = true, .worker_count = workers}).value();
        std::vector<BodyId> vehicles;
        for (int i = 0; i < 4; ++i) {
            const VehicleSettings settings = i % 2 == 0 ? make_truck() : make_six_wheeler();
            vehicles.push_back(
                world.add_vehicle(settings, pose_at({40.0 + 12.0 * i, 40.0, 2.5})).value());
        }
        for (int i = 0; i < 40; ++i) {
            const double x = random.between(30.0, 100.0), y = random.between(45.0, 90.0);
            add_box(world, {0.4, 0.4, 0.4}, {x, y, 2.0}, {.mass = 40.0});
        }
        std::uint64_t hash = 0;
        const auto step = [&](int i) {
            for (const BodyId vehicle : vehicles) {
                EXPECT_TRUE(world.set_controls(
                    vehicle, VehicleControls{.throttle = 0.7, .steer = i % 120 < 60 ? 0.4 : -0.4}));
            }
            EXPECT_EQ(world.step(ground, kStep).too_deep, 0u);
            hash = hash * 31 + world.state_hash() + world.contact_events().size();
        };
        for (int i = 0; i < 300; ++i) step(i);
        return hash;
    };
    const std::uint64_t alone = run(1);
    EXPECT_EQ(run(2), alone);
    EXPECT_EQ(run(8), alone);
}

TEST(VehicleAmongBodies, AllocateNothingOnceTheyHaveTouched) {
    const Ground ground = make_flat();
    LoneVehicle truck(pose_at({100.0, 100.0, 1.6}), {}, {.allow_sleep = false});
    add_box(truck.world(), {4.0, 3.0, 0.2}, {100.0, 100.0, 0.2}, {.mass = 500.0});
    drive(truck, ground, {.brake = 1.0}, 2.0);
    const test::AllocationCounter counter;
    drive(truck, ground, {.brake = 1.0}, 1.0);
    EXPECT_EQ(counter.count(), 0u);
}

}  // namespace vehicle_among_bodies_test
}  // namespace terrane
