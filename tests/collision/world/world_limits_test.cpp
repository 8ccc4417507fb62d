// SPDX-License-Identifier: MIT
#include "collision/world/busy_world.h"
#include "support/allocation_counter.h"

#include <terrane/collision/shape_pairs.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <span>
#include <string>
#include <vector>

// Input at and beyond its limits; bounds on the cost of a step; queries of a changing world.

namespace terrane::world_limits_test {

using namespace test;

TEST(WorldLimits, TheLightestAndTheHeaviestBodyTouch) {
    const Ground ground = make_flat();
    for (const bool is_heavy_above : {false, true}) {
        World world = make_world();
        add(world, {.shape = Box{}, .mass = is_heavy_above ? 1e-9 : 1e12}, at({60.0, 60.0, 5.5}));
        add(world, {.shape = Box{}, .mass = is_heavy_above ? 1e12 : 1e-9}, at({60.0, 60.0, 7.0}));
        take_steps(world, ground, 300);
        for (const BodyState& state : world.states()) {
            EXPECT_TRUE(state.pose.translation.allFinite());
            EXPECT_TRUE(state.velocity.allFinite());
            EXPECT_LT(state.velocity.norm(), 10.0);
        }
    }
}

TEST(WorldLimits, StepsThatAreNoTimeAreRefusedAndNothingMoves) {
    const Ground ground = make_flat();
    World world = make_world({.report_contacts = true});
    const BodyId body = add(world, {}, at({60.0, 60.0, 20.0}, {1.0, 2.0, 3.0}));
    ASSERT_TRUE(world.add_force(body, {1.0, 0.0, 0.0}));
    const std::uint64_t hash = world.state_hash();
    const std::vector<std::byte> bytes = world.save();
    for (const double dt :
         {0.0, -0.0, -kStep, kNan, kInfinity, -kInfinity, 100.0, kMostStep + 1e-14}) {
        EXPECT_EQ(world.step(ground, dt).refused_steps, 1u) << dt;
        EXPECT_EQ(world.state_hash(), hash) << dt;
        EXPECT_EQ(world.save(), bytes) << dt;
    }
    for (const double dt : {kMostStep, 1e-12, std::numeric_limits<double>::denorm_min()}) {
        EXPECT_EQ(world.step(ground, dt).refused_steps, 0u) << dt;
        EXPECT_TRUE(world.state(body).pose.translation.allFinite());
    }
}

TEST(WorldLimits, ThousandsOfBodiesInOnePlaceAreCountedAndComeApartAboveTheGround) {
    const auto count = static_cast<std::uint64_t>(few_or_many(2'000, 10'000));
    World world = make_world({.report_contacts = true});
    for (std::uint64_t i = 0; i < count; ++i) {
        add(world, {.shape = Sphere{0.2}}, at({60.0, 60.0, 6.0}));
    }
    const StepReport report = world.step(make_flat(), kStep);
    EXPECT_EQ(report.too_deep, 0u);
    EXPECT_EQ(report.awake, count);
    EXPECT_GT(report.skipped_pairs, count * count / 10);
}

TEST(WorldLimits, AStepOfAThousandSleepersAsksAndChangesNothing) {
    const Ground ground = make_flat();
    std::uint64_t calls = 0;
    WorldSettings settings{.report_contacts = true};
    settings.callbacks.gravity_at = [&](const WorldPos&) {
        ++calls;
        return Eigen::Vector3d(0.0, 0.0, -9.81);
    };
    settings.callbacks.may_collide = [&](BodyId, BodyId) {
        ++calls;
        return true;
    };
    World world = make_world(settings);
    for (int i = 0; i < 1000; ++i) {
        add(world, {.shape = Box{}},
            at({20.0 + 2.0 * (i % 25), 20.0 + 2.0 * (i / 50), 5.5 + i / 25 % 2}));
    }
    take_steps(world, ground, 120);
    EXPECT_GE(calls, 1500u);
    calls = 0;
    const std::vector<std::byte> bytes = world.save();
    for (int i = 0; i < 10; ++i) EXPECT_EQ(world.step(ground, kStep).asleep, 1000u);
    EXPECT_EQ(calls, 0u);
    EXPECT_EQ(world.save(), bytes);
    // Also while another body is awake.
    add(world, {.shape = Sphere{}}, at({100.0, 100.0, 90.0}));
    for (int i = 0; i < 10; ++i) EXPECT_EQ(world.step(ground, kStep).asleep, 1000u);
    EXPECT_LE(calls, 10u + 10u * 500u);  // touching sleeping pairs still need a call
}

TEST(WorldLimits, CallsAndStepsWithEventsKinematicsAndSensorsDoNotAllocate) {
    if (!AllocationCounter::kCounts) GTEST_SKIP() << "this build counts no allocations";
    const Ground ground = make_flat();
    World world = make_world({.report_contacts = true});
    const BodySettings board{.shape = Box{{3.0, 3.0, 0.2}}, .type = BodyType::kinematic_body};
    const BodyId lift = add(world, board, at({50.0, 60.0, 8.0}));
    const BodyId conveyor = add(world, board, at({60.0, 60.0, 8.0}));
    for (const double x : {50.0, 60.0, 70.0}) {
        add(world, {.shape = Box{{0.4, 0.4, 0.4}}}, at({x, 60.0, 8.6}));
        add(world, {.shape = Sphere{0.4}, .restitution = 1.0}, at({x + 1.5, 60.0, 10.0}));
    }
    const BodyId pushed = add(world, {.shape = make_hammer()}, at({60.0, 80.0, 6.0}));
    BodySettings gate{.shape = Sphere{2.0}, .type = BodyType::kinematic_body, .is_sensor = true};
    const BodyId sensor = add(world, gate, at({55.0, 60.0, 8.0}));
    const auto step = [&](int number) {
        const double side = number / 60 % 2 == 0 ? 1.0 : -1.0;
        if (number % 60 == 0) {
            ASSERT_TRUE(world.move_kinematic(lift, at({50.0, 60.0, 9.0 + side}).pose, 1.0));
            ASSERT_TRUE(world.set_velocity(conveyor, {0.0, side, 0.0}, {0.0, 0.0, 0.0}));
            ASSERT_TRUE(world.set_velocity(sensor, {5.0 * side, 0.0, 0.0}, {0.0, 0.0, 0.0}));
            ASSERT_TRUE(world.teleport(pushed, at({60.0, 80.0, 6.0})));
            ASSERT_TRUE(world.move_to(pushed, at({65.0, 80.0, 8.0}).pose, ground));
        }
        ASSERT_TRUE(world.add_force(pushed, {60.0, 80.0, 6.0}, {3.0, 0.0, 0.0}));
        ASSERT_TRUE(world.add_torque(pushed, {0.0, 1.0, 0.0}));
        world.step(ground, kStep);
        EXPECT_FALSE(world.contact_events().empty());
        world.ray(ground, {60.0, 60.0, 30.0}, {60.0, 60.0, -9.0});
    };
    for (int i = 0; i < 600; ++i) step(i);
    const AllocationCounter allocations;
    for (int i = 600; i < 900; ++i) step(i);
    EXPECT_EQ(allocations.count(), 0u);
}

/// Queries compared with a loop over all bodies, while bodies are added, removed and moved.
TEST(WorldLimits, QueriesFindWhatBruteForceFindsAfterEveryChange) {
    SeededRandom random(8);
    const Ground ground = make_flat();
    World world = make_world();
    const std::vector<Shape> shapes = all_shapes(0.7);
    std::vector<BodyId> bodies;
    const auto any_place = [&] {
        return at(
            {random.between(50.0, 75.0), random.between(50.0, 75.0), random.between(6.0, 14.0)});
    };
    for (int i = 0; i < 400; ++i) {
        const int action = random.below(6);
        if (action < 3 || bodies.empty()) {
            BodyState state = any_place();
            state.pose.rotation = random.rotation();
            const auto type = static_cast<BodyType>(random.below(3));
            const auto shape = static_cast<std::size_t>(random.below(5));
            bodies.push_back(add(world, {.shape = shapes[shape], .type = type}, state));
        } else if (action == 4) {
            world.step(ground, kStep);
        } else {
            BodyId& any = bodies[static_cast<std::size_t>(i) * 7 % bodies.size()];
            if (action == 3) {
                ASSERT_TRUE(world.remove(any));
                any = bodies.back();
                bodies.pop_back();
            } else {
                BodyState state = world.state(any);
                state.pose.translation.x() = random.between(50.0, 75.0);
                ASSERT_TRUE(world.teleport(any, state));
            }
        }
        const Shape probe = Sphere{random.between(0.5, 3.0)};
        const Pose pose = any_place().pose;
        std::vector<BodyId> expected;
        double nearest = kInfinity;
        for (const BodyId body : bodies) {
            const Shape& shape = world.settings(body).shape;
            const Pose& other = world.state(body).pose;
            if (test_contact(probe, pose, shape, other).is_touching) expected.push_back(body);
            nearest = std::min(nearest, signed_distance(probe, pose, shape, other).distance);
        }
        std::ranges::sort(expected);
        std::array<BodyId, 400> found;
        const OverlapQueryAnswer answer = world.overlaps(ground, probe, pose, found);
        ASSERT_TRUE(std::ranges::equal(std::span(found).first(answer.count), expected)) << i;
        const NearestQueryAnswer near =
            world.nearest(ground, probe, pose, kInfinity, {.include_ground = false});
        ASSERT_EQ(near.is_found, !bodies.empty());
        if (near.is_found) {
            ASSERT_NEAR(near.distance, nearest, 1e-9) << i;
        }
    }
}

}  // namespace terrane::world_limits_test

namespace terrane::world_ids_test {

using namespace test;

TEST(WorldIds, OfBodiesThatWereRemovedAreRefusedByEveryFunction) {
    World world = make_world();
    const BodyId kept = add(world), old = add(world, {}, at({9.0, 9.0, 9.0}));
    ASSERT_TRUE(world.remove(old));
    const Ground ground = make_flat();
    for (const bool is_slot_used_again : {false, true}) {
        const BodyId next = is_slot_used_again ? add(world, {.mass = 7.0}) : BodyId{};
        if (is_slot_used_again) {
            ASSERT_EQ(next.index, old.index);
            EXPECT_EQ(world.state(next).condition, BodyCondition::awake);
            EXPECT_EQ(world.settings(next).mass, 7.0);
        }
        for (const BodyId id : {old, BodyId{}, BodyId{70, 0}}) {
            const std::uint64_t hash = world.state_hash();
            EXPECT_FALSE(world.contains(id));
            EXPECT_EQ(world.state(id).condition, BodyCondition::removed);
            const Eigen::Vector3d v = Eigen::Vector3d::UnitX();
            const std::vector<Result<void>> answers{
                world.remove(id),
                world.change(id, {}),
                world.teleport(id, {}),
                world.move_kinematic(id, {}, 0.1),
                world.set_velocity(id, v, v),
                world.apply_impulse(id, v, v),
                world.apply_angular_impulse(id, v),
                world.add_force(id, v, v),
                world.add_force(id, v),
                world.add_torque(id, v),
                world.move_to(id, {}, ground).map([](BodyMove) {}),
                world.wake(id)};
            for (std::size_t i = 0; i < answers.size(); ++i) {
                ASSERT_FALSE(answers[i]) << i;
                EXPECT_EQ(answers[i].error().code, ErrorCode::invalid_argument);
                EXPECT_NE(answers[i].error().message.find("body must be"), std::string::npos);
            }
            EXPECT_EQ(world.state_hash(), hash);
        }
    }
    EXPECT_TRUE(world.contains(kept));
}

TEST(WorldIds, UseTheSlotThatWasLeftLastWithAnotherGeneration) {
    World world = make_world();
    std::vector<BodyId> ids;
    for (int i = 0; i < 4; ++i) ids.push_back(add(world));
    for (const std::size_t i : {2u, 0u, 3u}) ASSERT_TRUE(world.remove(ids[i]));
    for (const std::uint32_t index : {3u, 0u, 2u}) {
        const BodyId id = add(world);
        EXPECT_EQ(id.index, index);
        EXPECT_EQ(id.generation, 1u);
    }
    EXPECT_EQ(add(world), (BodyId{4, 0}));
    EXPECT_EQ(world.states().size(), 5u);
}

TEST(WorldIds, AreNeverGivenTwice) {
    World world = make_world();
    std::set<BodyId> seen;
    std::vector<BodyId> present;
    for (int i = 0; i < 1000; ++i) {
        present.push_back(add(world));
        EXPECT_TRUE(seen.insert(present.back()).second);
        if (i % 3 == 0) continue;
        const std::size_t victim = static_cast<std::size_t>(i) * 7 % present.size();
        ASSERT_TRUE(world.remove(present[victim]));
        present.erase(present.begin() + static_cast<std::ptrdiff_t>(victim));
    }
    for (const BodyId id : present) {
        EXPECT_TRUE(world.contains(id));
        EXPECT_EQ(world.id(id.index), id);
    }
}

TEST(WorldIds, OfEmptySlotsAreNoneAndTheirStateIsRemoved) {
    World world = make_world();
    const BodyId body = add(world, {}, at({60.0, 60.0, 9.0}));
    ASSERT_TRUE(world.remove(body));
    EXPECT_FALSE(world.id(body.index).is_valid());
    EXPECT_FALSE(world.id(123).is_valid());
    ASSERT_EQ(world.states().size(), 1u);
    EXPECT_EQ(world.states()[body.index].condition, BodyCondition::removed);
    EXPECT_TRUE(world.needs().empty());
    const Ground ground = make_flat();
    const StepReport report = world.step(ground, 0.1);
    EXPECT_EQ(report.awake + report.asleep + report.parked + report.left_world, 0u);
    std::array<BodyId, 4> found;
    EXPECT_EQ(world.overlaps(ground, Sphere{50.0}, at({60.0, 60.0, 9.0}).pose, found).count, 0u);
    EXPECT_FALSE(world.ray(ground, {60.0, 60.0, 20.0}, {60.0, 60.0, 8.0}).hit);
}

TEST(WorldIds, AnswerQueriesAndEventsWithTheBodyThatHasTheSlotNow) {
    World world = make_world({.report_contacts = true});
    const Ground ground = make_flat();
    const BodyId old = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    world.step(ground, 0.01);
    ASSERT_TRUE(world.remove(old));
    const BodyId next = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    ASSERT_EQ(next.index, old.index);
    EXPECT_EQ(world.ray(ground, {60.0, 60.0, 20.0}, {60.0, 60.0, 5.2}).body, next);
    world.step(ground, 0.01);
    ASSERT_EQ(world.contact_events().size(), 2u);
    EXPECT_EQ(world.contact_events()[0].a, old);
    EXPECT_EQ(world.contact_events()[0].phase, ContactPhase::ended);
    EXPECT_EQ(world.contact_events()[1].a, next);
    EXPECT_EQ(world.contact_events()[1].phase, ContactPhase::began);
}

}  // namespace terrane::world_ids_test
