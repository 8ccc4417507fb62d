// SPDX-License-Identifier: MIT
#include "scene/body_placement.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <variant>

namespace terrane::tools {
namespace crates_test {

constexpr std::size_t kCount = 120;
constexpr double kStart = 8.0;

CrateLayout layout_of(std::uint64_t seed) {
    return {.path = Polyline({{-100.0, 0.0}, {0.0, 10.0}, {60.0, 90.0}}),
            .count = kCount,
            .seed = seed,
            .start_radius = kStart};
}

const std::shared_ptr<const HeightSource>& source() {
    static const auto heights = FractalHeights::create({.seed = 9}).value();
    return heights;
}

Ground load(const CrateLayout& layout) {
    Pager pager = Pager::create(source(), {.worker_count = 0}).value();
    pager.update({}, crate_needs(layout, *source()), 0.0);
    return {pager.resident(), pager.contact_level()};
}

TEST(Crates, LieOnTheGroundFreeOfEachOtherAndOfTheStart) {
    const CrateLayout layout = layout_of(3);
    const Ground ground = load(layout);
    World world = World::create({}).value();
    const auto crates = lay_out_crates(layout, ground, world);
    ASSERT_TRUE(crates) << crates.error().message;
    ASSERT_EQ(crates->size(), kCount);
    const Eigen::Vector2d start = layout.path.points().front();
    for (std::size_t i = 0; i < kCount; ++i) {
        const PlacedBody& crate = (*crates)[i];
        const Pose& pose = crate.state.pose;
        const LiftAnswer lift = compute_lift(crate.settings.shape, pose, ground);
        EXPECT_EQ(lift.status, QueryStatus::complete);
        EXPECT_NEAR(lift.lift, 0.0, 1e-9) << "crate " << i;
        EXPECT_GT((pose.translation.head<2>() - start).norm(), kStart);
        const Eigen::Vector3d& half = std::get<Box>(crate.settings.shape).half_extents;
        EXPECT_GE(half.minCoeff(), 0.2);
        EXPECT_LE(half.maxCoeff(), 0.5);
        EXPECT_GE(crate.settings.mass, 800.0 * half.prod());
        EXPECT_LE(crate.settings.mass, 3200.0 * half.prod());
        EXPECT_TRUE(is_free(world, ground, crate.settings.shape, pose)) << "crate " << i;
        ASSERT_TRUE(world.add(crate.settings, crate.state));
    }
}

TEST(Crates, AreTheSameForASeedAndOthersForAnother) {
    const Ground ground = load(layout_of(3));
    const World empty = World::create({}).value();
    const auto place = [&](std::uint64_t seed, std::size_t crate) {
        return (*lay_out_crates(layout_of(seed), ground, empty))[crate].state.pose.translation;
    };
    EXPECT_EQ(place(3, 50), place(3, 50));
    EXPECT_NE(place(3, 50), place(4, 50));
}

TEST(Crates, KeepClearOfObstacles) {
    const CrateLayout layout = layout_of(3);
    const Ground ground = load(layout);
    World world = World::create({}).value();
    BodyState state;
    const double z = source()->height(0.0, 10.0);
    state.pose.translation = {0.0, 10.0, z};
    const BodySettings wall{.shape = Box{{40.0, 3.0, 5.0}}, .type = BodyType::static_body};
    ASSERT_TRUE(world.add(wall, state));
    const auto crates = lay_out_crates(layout, ground, world);
    ASSERT_TRUE(crates) << crates.error().message;
    for (const PlacedBody& crate : *crates) {
        EXPECT_TRUE(is_free(world, ground, crate.settings.shape, crate.state.pose));
    }
}

TEST(Crates, WithoutGroundAreAFailureThatSaysWhy) {
    const World empty = World::create({}).value();
    Pager pager = Pager::create(source(), {.worker_count = 0}).value();
    pager.update({}, {}, 0.0);
    const Ground absent(pager.resident(), pager.contact_level());
    const auto crates = lay_out_crates(layout_of(1), absent, empty);
    ASSERT_FALSE(crates);
    EXPECT_NE(crates.error().message.find("120 crates"), std::string::npos);
    CrateLayout none = layout_of(1);
    none.count = 0;
    EXPECT_TRUE(crate_needs(none, *source()).empty());
    EXPECT_TRUE(lay_out_crates(none, absent, empty)->empty());
}

TEST(Polyline, GivesPointsAndDirectionsByArcLength) {
    const Polyline line({{0.0, 0.0}, {3.0, 0.0}, {3.0, 4.0}});
    EXPECT_EQ(line.length(), 7.0);
    EXPECT_EQ(line.at(-1.0), Eigen::Vector2d(0.0, 0.0));
    EXPECT_EQ(line.at(1.5), Eigen::Vector2d(1.5, 0.0));
    EXPECT_EQ(line.at(5.0), Eigen::Vector2d(3.0, 2.0));
    EXPECT_EQ(line.at(9.0), Eigen::Vector2d(3.0, 4.0));
    EXPECT_EQ(line.direction(1.0), Eigen::Vector2d(1.0, 0.0));
    EXPECT_EQ(line.direction(7.0), Eigen::Vector2d(0.0, 1.0));
}

}  // namespace crates_test
}  // namespace terrane::tools
