// SPDX-License-Identifier: MIT
#include "collision/world/busy_world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace terrane::contact_events_test {

using namespace test;

const ContactEvent* find(const World& world, BodyId a, BodyId b = {}) {
    for (const ContactEvent& event : world.contact_events()) {
        if (event.a == a && event.b == b) return &event;
    }
    return nullptr;
}

TEST(ContactEvents, OfABounceBeginEndAndBeginAgain) {
    const Ground ground = make_flat();
    World world = make_world({.report_contacts = true});
    const BodyId ball =
        add(world, {.shape = Sphere{0.5}, .restitution = 0.6}, at({60.0, 60.0, 8.0}));
    std::string story;
    for (int i = 0; i < 600; ++i) {
        world.step(ground, kStep);
        const ContactEvent* event = find(world, ball);
        if (event == nullptr) continue;
        EXPECT_TRUE(event->is_ground());
        if (event->phase == ContactPhase::began) story += 'b';
        if (event->phase == ContactPhase::stayed && story.back() != 's') story += 's';
        if (event->phase == ContactPhase::ended) {
            story += 'e';
        } else {
            EXPECT_NEAR(event->normal.z(), 1.0, 1e-9);
        }
    }
    ASSERT_GE(story.size(), 6u) << story;
    EXPECT_EQ(story.substr(0, 4), "bebe") << story;
    EXPECT_EQ(story.back(), 's') << story;
    EXPECT_TRUE(is_asleep(world, ball));
}

TEST(ContactEvents, OfRestingBodiesHaveTheImpulseOfTheirWeight) {
    const Ground ground = make_flat();
    for (const double dt : {kStep, 1.0 / 240.0, 0.1}) {
        SCOPED_TRACE(dt);
        World world = make_world({.allow_sleep = false, .report_contacts = true});
        const BodyId lower = add(world, {.shape = Box{}, .mass = 3.0}, at({60.0, 60.0, 5.5}));
        const BodyId upper = add(world, {.shape = Box{}, .mass = 2.0}, at({60.0, 60.0, 6.5}));
        const BodyId ball = add(world, {.shape = Sphere{}, .mass = 7.0}, at({70.0, 60.0, 5.5}));
        for (double time = 0.0; time < 2.0; time += dt) world.step(ground, dt);
        const ContactEvent* const pair = find(world, lower, upper);
        for (const auto& [event, load] : {std::pair(pair, -2.0), std::pair(find(world, lower), 5.0),
                                          std::pair(find(world, ball), 7.0)}) {
            ASSERT_NE(event, nullptr);
            const double impulse = load * kGravity * dt;
            EXPECT_NEAR(event->impulse.z(), impulse, 0.01 * std::abs(impulse));
        }
        EXPECT_EQ(pair->phase, ContactPhase::stayed);
        EXPECT_LT(pair->normal.z(), -0.999);
        EXPECT_EQ(pair->point_count, 4u);
        for (const ContactPoint& point : world.contact_points(*pair)) {
            EXPECT_NEAR(point.point_world.z(), 6.0, 0.01);
            EXPECT_NEAR(std::abs(point.point_world.x() - 60.0), 0.5, 0.01);
            EXPECT_NEAR(point.gap, 0.0, 0.01);
        }
        EXPECT_EQ(find(world, upper), nullptr);
    }
}

/// A body's change of momentum equals the sum of its contact impulses and of gravity.
TEST(ContactEvents, HaveImpulsesThatAreTheChangeOfMomentum) {
    const Ground ground = make_flat();
    World world = make_world({.report_contacts = true});
    const std::vector<Shape> shapes = all_shapes(0.5);
    std::vector<BodyId> bodies;
    for (int i = 0; i < 10; ++i) {
        const int column = i % 5, row = i / 5;
        const BodySettings settings{
            .shape = shapes[static_cast<std::size_t>(column)], .mass = 0.5 + i, .restitution = 0.5};
        bodies.push_back(add(
            world, settings,
            at({60.0 + 6.0 * column, 60.0, 7.0 + 3.0 * row}, {0.1, 0.0, -3.0}, {0.5, 0.2, 0.0})));
    }
    int checked = 0;
    for (int step = 0; step < 60; ++step) {
        std::vector<Eigen::Vector3d> before;
        for (const BodyId body : bodies) before.push_back(world.state(body).velocity);
        world.step(ground, kStep);
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            Eigen::Vector3d impulse = Eigen::Vector3d::Zero();
            for (const ContactEvent& event : world.contact_events()) {
                if (event.a == bodies[i]) impulse += event.impulse;
                if (event.b == bodies[i]) impulse -= event.impulse;
            }
            const double mass = world.settings(bodies[i]).mass;
            const Eigen::Vector3d gained = mass * (world.state(bodies[i]).velocity - before[i] +
                                                   Eigen::Vector3d(0.0, 0.0, kGravity * kStep));
            if (impulse.norm() < 0.5 * mass) continue;  // only bounces are checked
            EXPECT_LT((impulse - gained).norm(), 0.03 * gained.norm()) << step << " body " << i;
            ++checked;
        }
    }
    EXPECT_GT(checked, 10);
}

TEST(ContactEvents, EndWhereABodyIsRemovedOrTeleportedAway) {
    const Ground ground = make_flat();
    World world = make_world({.report_contacts = true});
    const BodyId lower = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    const BodyId upper = add(world, {.shape = Box{}}, at({60.0, 60.0, 6.5}));
    world.step(ground, kStep);
    ASSERT_NE(find(world, lower, upper), nullptr);
    ASSERT_TRUE(world.teleport(upper, at({60.0, 60.0, 20.0})));
    world.step(ground, kStep);
    ASSERT_NE(find(world, lower, upper), nullptr);
    EXPECT_EQ(find(world, lower, upper)->phase, ContactPhase::ended);
    ASSERT_TRUE(world.remove(lower));
    world.step(ground, kStep);
    ASSERT_EQ(world.contact_events().size(), 1u);
    EXPECT_EQ(world.contact_events()[0].a, lower);
    EXPECT_EQ(world.contact_events()[0].phase, ContactPhase::ended);
    world.step(ground, kStep);
    EXPECT_TRUE(world.contact_events().empty());
}

TEST(ContactEvents, OfSleepersAreSilentUntilTheyAreWoken) {
    const Ground ground = make_flat();
    World world = make_world({.report_contacts = true});
    const BodyId lower = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    const BodyId upper = add(world, {.shape = Box{}}, at({60.0, 60.0, 6.5}));
    for (int i = 0; i < 120; ++i) world.step(ground, kStep);
    ASSERT_TRUE(is_asleep(world, upper));
    // A distant moving body keeps the world awake.
    add(world, {.shape = Sphere{}}, at({90.0, 60.0, 60.0}));
    for (int i = 0; i < 30; ++i) {
        world.step(ground, kStep);
        EXPECT_TRUE(world.contact_events().empty());
    }
    ASSERT_TRUE(world.wake(lower));
    world.step(ground, kStep);
    ASSERT_NE(find(world, lower, upper), nullptr);
    EXPECT_EQ(find(world, lower, upper)->phase, ContactPhase::stayed);
    EXPECT_EQ(find(world, lower)->phase, ContactPhase::stayed);
}

TEST(ContactEvents, ABoxWakesTheSleepersThatItReaches) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId near = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    const BodyId far = add(world, {.shape = Box{}}, at({90.0, 60.0, 5.5}));
    take_steps(world, ground, 120);
    ASSERT_TRUE(is_asleep(world, near) && is_asleep(world, far));
    world.wake(Aabb{WorldPos::Constant(kNan), WorldPos::Constant(kNan)});
    world.wake(Aabb{{60.0, 60.0, 9.0}, {60.0, 60.0, 12.0}});
    world.wake(Aabb{{1.0, 1.0, 1.0}, {-1.0, -1.0, -1.0}});
    world.step(ground, kStep);
    ASSERT_TRUE(is_asleep(world, near) && is_asleep(world, far));
    world.wake(Aabb{{58.0, 58.0, 3.0}, {59.6, 62.0, 5.2}});
    world.step(ground, kStep);
    EXPECT_FALSE(is_asleep(world, near));
    EXPECT_TRUE(is_asleep(world, far));
    EXPECT_TRUE(world.contact_events().empty()) << "events were not asked for";
}

/// In the busy world events are in ascending order with the ground last, and each pair's phases are began, stayed ...,
/// ended.
TEST(ContactEvents, AreOrderedAndTellAConsistentStory) {
    const Ground ground = make_busy_ground();
    World world = make_world({.report_contacts = true});
    const BusyBodies bodies = fill_busy_world(world);
    std::map<std::pair<BodyId, BodyId>, bool> touches;
    for (int step = 0; step < 300; ++step) {
        act_on_busy_world(world, bodies, step);
        world.step(ground, kStep);
        std::pair<std::uint32_t, std::uint32_t> last{0, 0};
        for (const ContactEvent& event : world.contact_events()) {
            const std::pair now{event.a.index, event.b.index};
            EXPECT_LT(last, now);
            last = now;
            EXPECT_LT(event.a.index, event.b.index);
            EXPECT_LT(event.normal.norm(), 1.0 + 1e-9);
            bool& touched = touches[{event.a, event.b}];
            EXPECT_EQ(touched, event.phase != ContactPhase::began) << step;
            touched = event.phase != ContactPhase::ended;
            EXPECT_LE(world.contact_points(event).size(), 64u);
        }
    }
    EXPECT_GT(touches.size(), 60u);
}

TEST(ContactEvents, AreTheSameWithAnyNumberOfThreads) {
    const Ground ground = make_busy_ground();
    World one = make_world({.report_contacts = true});
    World three = make_world({.report_contacts = true, .worker_count = 3});
    const BusyBodies in_one = fill_busy_world(one);
    const BusyBodies in_three = fill_busy_world(three);
    for (int step = 0; step < 150; ++step) {
        act_on_busy_world(one, in_one, step);
        act_on_busy_world(three, in_three, step);
        EXPECT_TRUE(one.step(ground, kStep) == three.step(ground, kStep));
        ASSERT_EQ(one.state_hash(), three.state_hash()) << step;
        ASSERT_NO_FATAL_FAILURE(expect_same_events(one, three));
        for (std::size_t i = 0; i < one.contact_events().size(); ++i) {
            EXPECT_EQ(one.contact_events()[i].first_point, three.contact_events()[i].first_point);
        }
    }
}

}  // namespace terrane::contact_events_test

// Which bodies collide: layers, the caller's callback, sensors.

namespace terrane::filters_test {

using namespace test;

/// Final height of a box with one filter dropped on a table with another; the table's top is at z = 10.
double dropped_height(const CollisionFilter& table, const CollisionFilter& box,
                      const WorldSettings& settings = {}) {
    World world = make_world(settings);
    add(world, {.shape = Box{{3.0, 3.0, 0.5}}, .type = BodyType::static_body, .filter = table},
        at({60.0, 60.0, 9.5}));
    const BodyId falling = add(world, {.shape = Box{}, .filter = box}, at({60.0, 60.0, 10.6}));
    take_steps(world, make_flat(), 180);
    return world.state(falling).pose.translation.z();
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
    EXPECT_NEAR(world.state(upper).pose.translation.z(), 6.5, 0.01);
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
    const std::vector<Shape> shapes = all_shapes(0.5);
    for (int i = 0; i < 60; ++i) {
        add(world, {.shape = shapes[static_cast<std::size_t>(i) % 5]},
            at({60.0 + 0.7 * (i % 4), 60.0 + 0.7 * (i / 4 % 4), 6.0 + 0.8 * (i / 16)}));
    }
    take_steps(world, ground, 100);
    EXPECT_GT(calls, 1000u);
}

BodySettings make_sensor(double radius, BodyType type = BodyType::static_body) {
    return {.shape = Sphere{radius}, .type = type, .is_sensor = true};
}

/// Phases of the sensor events of a step, such as "began".
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
        const double distance = std::abs(world.state(body).pose.translation.x() - 60.0);
        if (std::abs(distance - 2.5) > 1e-9) {
            EXPECT_EQ(phases == "began " || phases == "stayed ", distance < 2.5) << distance;
        }
        if (!phases.empty() && phases != "stayed ") story += phases;
    }
    EXPECT_EQ(story, "began ended ");
    EXPECT_EQ(world.state(body).velocity, Eigen::Vector3d(6.0, 0.0, 0.0));
}

TEST(Sensor, OfASleepingBodyIsSilentAndEndsWhenTheSensorIsRemoved) {
    const Ground ground = make_flat();
    World world = make_world({.report_contacts = true});
    const BodyId sensor = add(world, make_sensor(2.0), at({60.0, 60.0, 5.5}));
    const BodyId body = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    world.step(ground, kStep);
    EXPECT_EQ(sensor_phases(world), "began ");
    for (int i = 0; i < 120; ++i) world.step(ground, kStep);
    ASSERT_TRUE(is_asleep(world, body));
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
        ASSERT_TRUE(is_asleep(world, body));
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

}  // namespace terrane::filters_test
