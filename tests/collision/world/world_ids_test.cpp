// SPDX-License-Identifier: MIT
#include "collision/bodies/body_cases.h"

#include <terrane/collision/world.h>

#include <gtest/gtest.h>

#include <array>
#include <set>
#include <string>
#include <vector>

namespace terrane {
namespace world_ids_test {

using test::at;
using test::make_flat;
using test::make_world;

BodyId add(World& world, const BodySettings& settings = {}, const BodyState& state = {}) {
    return world.add(settings, state).value();
}

TEST(WorldIds, OfBodiesThatWereRemovedAreRefusedByEveryFunction) {
    World world = make_world();
    const BodyId kept = add(world), old = add(world, {}, at({9.0, 9.0, 9.0}));
    ASSERT_TRUE(world.remove(old));
    const Ground ground = make_flat();
    const BodyId beyond{70, 0};
    for (const bool is_slot_used_again : {false, true}) {
        const BodyId next = is_slot_used_again ? add(world) : BodyId{};
        for (const BodyId id : {old, BodyId{}, beyond}) {
            const std::uint64_t hash = world.state_hash();
            EXPECT_FALSE(world.contains(id));
            const Eigen::Vector3d v = Eigen::Vector3d::UnitX();
            std::vector<Result<void>> answers{world.remove(id),
                                              world.change(id, {}),
                                              world.teleport(id, {}),
                                              world.move_kinematic(id, {}, 0.1),
                                              world.set_velocity(id, v, v),
                                              world.apply_impulse(id, v, v),
                                              world.apply_angular_impulse(id, v),
                                              world.add_force(id, v, v),
                                              world.add_force(id, v),
                                              world.add_torque(id, v),
                                              world.wake(id)};
            const Result<BodyMove> moved = world.move_to(id, {}, ground);
            answers.push_back(moved ? Result<void>() : tl::unexpected(moved.error()));
            for (std::size_t i = 0; i < answers.size(); ++i) {
                ASSERT_FALSE(answers[i]) << i;
                EXPECT_EQ(answers[i].error().code, ErrorCode::invalid_argument);
                EXPECT_NE(answers[i].error().message.find("body must be"), std::string::npos);
            }
            EXPECT_EQ(world.state_hash(), hash);
        }
        if (next.is_valid()) {
            EXPECT_EQ(next.index, old.index);
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
    EXPECT_FALSE(world.id(0).is_valid());
    EXPECT_FALSE(world.id(123).is_valid());
    ASSERT_EQ(world.states().size(), 1u);
    EXPECT_EQ(world.states()[0].condition, BodyCondition::removed);
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

}  // namespace world_ids_test
}  // namespace terrane
