// SPDX-License-Identifier: MIT
#include "collision/bodies/body_cases.h"

#include <terrane/collision/world.h>

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

// Which bodies collide: layers, the owner's callback, sensors.
namespace terrane {
namespace filters_test {

using test::at;
using test::make_flat;
using test::make_world;

constexpr double kStep = 1.0 / 60.0;

BodyId add(World& world, const BodySettings& settings, const BodyState& state) {
    return world.add(settings, state).value();
}

const BodyState& state_of(const World& world, BodyId body) { return world.states()[body.index]; }

/// Height of a box after it was dropped on a table whose top is at z = 10, of those filters.
double dropped_height(const CollisionFilter& table, const CollisionFilter& box,
                      const WorldSettings& settings = {}) {
    const Ground ground = make_flat();
    World world = make_world(settings);
    BodySettings body{.shape = Box{{3.0, 3.0, 0.5}}, .type = BodyType::static_body};
    body.filter = table;
    add(world, body, at({60.0, 60.0, 9.5}));
    body = {.shape = Box{}};
    body.filter = box;
    const BodyId falling = add(world, body, at({60.0, 60.0, 10.6}));
    for (int i = 0; i < 180; ++i) EXPECT_EQ(world.step(ground, kStep).too_deep, 0u);
    return state_of(world, falling).pose.translation.z();
}

TEST(CollisionFilter, NeedsTheConsentOfBothBodies) {
    struct Case {
        CollisionFilter a, b;
        bool collide;
    };
    constexpr std::uint32_t kAll = ~std::uint32_t{0};
    for (const Case& each :
         {Case{{1, kAll}, {1, kAll}, true}, Case{{2, 4}, {4, 2}, true}, Case{{2, 4}, {4, 1}, false},
          Case{{2, 1}, {4, 2}, false}, Case{{0, kAll}, {1, kAll}, false},
          Case{{1, 0}, {1, kAll}, false}, Case{{1u << 31, kAll}, {6, 1u << 31}, true}}) {
        const double z = dropped_height(each.a, each.b);
        EXPECT_NEAR(z, each.collide ? 10.5 : 5.5, 0.02) << each.a.layers << ' ' << each.b.layers;
        EXPECT_EQ(may_collide(each.a, each.b), each.collide);
    }
}

TEST(MayCollide, DecidesForBodiesThatFiltersPermit) {
    for (const bool answer : {true, false}) {
        WorldSettings settings;
        settings.callbacks.may_collide = [answer](BodyId a, BodyId b) {
            EXPECT_LT(a.index, b.index);
            return answer;
        };
        EXPECT_NEAR(dropped_height({}, {}, settings), answer ? 10.5 : 5.5, 0.02);
        settings.callbacks.may_collide = [](BodyId, BodyId) -> bool {
            ADD_FAILURE() << "the filters do not permit it";
            return true;
        };
        EXPECT_NEAR(dropped_height({2, 2}, {4, 4}, settings), 5.5, 0.02);
    }
}

TEST(MayCollide, IsAskedWithTheGenerationsOfTheBodies) {
    const Ground ground = make_flat();
    std::vector<BodyId> asked;
    WorldSettings settings;
    settings.callbacks.may_collide = [&](BodyId a, BodyId b) {
        asked.assign({a, b});
        return true;
    };
    World world = make_world(settings);
    const BodyId lower = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    ASSERT_TRUE(world.remove(add(world, {.shape = Box{}}, at({60.0, 60.0, 6.5}))));
    const BodyId upper = add(world, {.shape = Box{}}, at({60.0, 60.0, 6.5}));
    world.step(ground, kStep);
    EXPECT_EQ(asked, (std::vector{lower, upper}));
}

TEST(MayCollide, ThatThrowsIsCountedAndTheBodiesCollide) {
    const Ground ground = make_flat();
    WorldSettings settings;
    settings.callbacks.may_collide = [](BodyId, BodyId) -> bool { throw std::runtime_error("no"); };
    World world = make_world(settings);
    add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    const BodyId upper = add(world, {.shape = Box{}}, at({60.0, 60.0, 6.5}));
    for (int i = 0; i < 10; ++i) EXPECT_EQ(world.step(ground, kStep).failed_callbacks, 1u);
    EXPECT_NEAR(state_of(world, upper).pose.translation.z(), 6.5, 0.01);
}

TEST(MayCollide, MayAnswerWhateverItWants) {
    const Ground ground = make_flat();
    std::uint64_t calls = 0;
    WorldSettings settings;
    settings.callbacks.may_collide = [&](BodyId a, BodyId b) {
        ++calls;
        return (calls * 0x9e3779b97f4a7c15u + a.index * 31 + b.index) >> 60 < 8;
    };
    World world = make_world(settings);
    for (int i = 0; i < 60; ++i) {
        add(world, {.shape = test::all_shapes(0.5)[static_cast<std::size_t>(i) % 5]},
            at({60.0 + 0.7 * (i % 4), 60.0 + 0.7 * (i / 4 % 4), 6.0 + 0.8 * (i / 16)}));
    }
    for (int i = 0; i < 100; ++i) ASSERT_EQ(world.step(ground, kStep).too_deep, 0u);
    EXPECT_GT(calls, 1000u);
}

BodySettings make_sensor(double radius, BodyType type = BodyType::static_body) {
    BodySettings sensor{.shape = Sphere{radius}, .type = type};
    sensor.is_sensor = true;
    return sensor;
}

/// The phases of the sensor events of a step, such as "began".
std::string sensor_phases(const World& world) {
    std::string phases;
    for (const ContactEvent& event : world.contact_events()) {
        if (!event.is_sensor) continue;
        EXPECT_EQ(event.point_count, 0u);
        EXPECT_TRUE(event.impulse.isZero(0.0));
        constexpr const char* kNames[] = {"began ", "stayed ", "ended "};
        phases += kNames[static_cast<std::size_t>(event.phase)];
    }
    return phases;
}

TEST(Sensor, TellsWhenABodyEntersStaysAndLeavesAndDoesNotTouchIt) {
    const Ground ground = make_flat();
    World world = make_world({.gravity = {0, 0, 0}, .report_contacts = true});
    add(world, make_sensor(2.0), at({60.0, 60.0, 20.0}));
    const BodyId body = add(world, {.shape = Sphere{0.5}}, at({55.0, 60.0, 20.0}, {6.0, 0, 0}));
    std::string story;
    for (int i = 0; i < 120; ++i) {
        world.step(ground, kStep);
        const std::string phases = sensor_phases(world);
        const double distance = std::abs(state_of(world, body).pose.translation.x() - 60.0);
        if (std::abs(distance - 2.5) > 1e-9) {
            EXPECT_EQ(phases == "began " || phases == "stayed ", distance < 2.5) << distance;
        }
        if (!phases.empty() && phases != "stayed ") story += phases;
    }
    EXPECT_EQ(story, "began ended ");
    EXPECT_EQ(state_of(world, body).velocity, Eigen::Vector3d(6.0, 0.0, 0.0));
}

TEST(Sensor, OfASleepingBodyIsSilentAndEndsWhenTheSensorIsRemoved) {
    const Ground ground = make_flat();
    World world = make_world({.report_contacts = true});
    const BodyId sensor = add(world, make_sensor(2.0), at({60.0, 60.0, 5.5}));
    const BodyId body = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    world.step(ground, kStep);
    EXPECT_EQ(sensor_phases(world), "began ");
    for (int i = 0; i < 120; ++i) world.step(ground, kStep);
    ASSERT_EQ(state_of(world, body).condition, BodyCondition::asleep);
    world.step(ground, kStep);
    EXPECT_EQ(sensor_phases(world), "");
    ASSERT_TRUE(world.remove(sensor));
    world.step(ground, kStep);
    EXPECT_EQ(sensor_phases(world), "ended ");
    ASSERT_EQ(world.contact_events()[0].a, sensor);
    world.step(ground, kStep);
    EXPECT_EQ(sensor_phases(world), "");
}

TEST(Sensor, ThatMovesOverASleeperTellsSoAndLetsItSleep) {
    const Ground ground = make_flat();
    World world = make_world({.report_contacts = true});
    const BodyId body = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    for (int i = 0; i < 60; ++i) world.step(ground, kStep);
    const BodyState start = at({50.0, 60.0, 6.0}, {6.0, 0.0, 0.0});
    add(world, make_sensor(2.0, BodyType::kinematic_body), start);
    std::string story;
    for (int i = 0; i < 240; ++i) {
        EXPECT_EQ(world.step(ground, kStep).kinematic_in_ground, 0u);
        const std::string phases = sensor_phases(world);
        if (phases != "stayed ") story += phases;
        ASSERT_EQ(state_of(world, body).condition, BodyCondition::asleep);
    }
    EXPECT_EQ(story, "began ended ");
}

TEST(Sensor, IsSeenByQueriesThatAskForIt) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId sensor = add(world, make_sensor(2.0), at({60.0, 60.0, 20.0}));
    const WorldPos from(60.0, 60.0, 30.0), to(60.0, 60.0, 10.0);
    EXPECT_FALSE(world.ray(ground, from, to).hit);
    EXPECT_EQ(world.ray(ground, from, to, {.include_sensors = true}).body, sensor);
}

}  // namespace filters_test
}  // namespace terrane
