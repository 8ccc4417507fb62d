// SPDX-License-Identifier: MIT
#include "scene/body_placement.h"
#include "support/meshes/objects.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace terrane::tools {
namespace object_bodies_test {

constexpr double kDt = 1.0 / 60.0;

// Hills, all resident, with boulders every 20 m that bodies collide with.
class Boulders : public ::testing::Test {
protected:
    Boulders() {
        pager_.require({-500.0, -500.0, 500.0, 500.0}, 0.0);
        pager_.update({}, {}, 0.0);
        objects_.meshes = {test::make_rock(2, 1)};
        objects_.files = {"rock.obj"};
        objects_.scatters = {{0, {.per_km2 = 2500.0, .seed = 2}, 0.1}};
    }

    Ground ground() const { return {pager_.resident(), pager_.contact_level()}; }
    ObjectBodies make() const { return ObjectBodies::create(source_, &objects_).value(); }

    // A ball that rolls over the hills.
    static BodyId add_ball(World& world, const WorldPos& at, double speed) {
        BodyState state;
        state.pose.translation = at;
        state.velocity.x() = speed;
        return world.add({.shape = Sphere{0.3}, .mass = 20.0}, state).value();
    }
    WorldPos above(double x, double y, double height) const {
        return {x, y, ground().height(x, y).height + height};
    }

    static std::size_t static_count(const World& world) {
        return static_cast<std::size_t>(std::count_if(
            world.states().begin(), world.states().end(),
            [](const BodyState& body) { return body.condition == BodyCondition::fixed; }));
    }

    std::shared_ptr<const HeightSource> source_ = FractalHeights::create({.seed = 3,
                                                                          .octave_count = 6,
                                                                          .amplitude = 40.0,
                                                                          .wavelength_log2 = 8,
                                                                          .root_size_log2 = 11})
                                                      .value();
    Pager pager_ = Pager::create(source_, {.worker_count = 0}).value();
    SceneObjects objects_;
};

TEST_F(Boulders, AreInTheWorldNearDynamicBodiesOnly) {
    World world = World::create({}).value();
    ObjectBodies objects = make();
    ASSERT_TRUE(objects.follow(world, ground()));
    EXPECT_EQ(static_count(world), 0u);
    const BodyId ball = add_ball(world, above(0.0, 0.0, 5.0), 0.0);
    ASSERT_TRUE(objects.follow(world, ground()));
    EXPECT_GT(static_count(world), 0u);
    for (const BodyState& state : world.states()) {
        if (state.condition != BodyCondition::fixed) continue;
        EXPECT_LT((state.pose.translation - above(0.0, 0.0, 5.0)).norm(), 40.0);
    }
    BodyState far;
    far.pose.translation = above(300.0, 200.0, 5.0);
    ASSERT_TRUE(world.teleport(ball, far));
    ASSERT_TRUE(objects.follow(world, ground()));
    EXPECT_GT(static_count(world), 0u);
    for (const BodyState& state : world.states()) {
        if (state.condition != BodyCondition::fixed) continue;
        EXPECT_LT((state.pose.translation - far.pose.translation).norm(), 40.0);
    }
    ASSERT_TRUE(world.remove(ball));
    ASSERT_TRUE(objects.follow(world, ground()));
    EXPECT_EQ(static_count(world), 0u);
}

// Against all points of the scatter.
TEST_F(Boulders, AreThereBeforeABodyCanReachThem) {
    World world = World::create({}).value();
    ObjectBodies objects = make();
    const Scatter scatter = Scatter::create(source_, objects_.scatters[0].settings).value();
    const BodyId ball = add_ball(world, above(-200.0, 10.0, 2.0), 60.0);
    for (int step = 0; step < 240; ++step) {
        ASSERT_TRUE(objects.follow(world, ground()));
        const BodyState& state = world.states()[ball.index];
        const double reach = 0.3 + 1.0 + kDt * state.velocity.norm();
        const ScatterRange range = scatter.squares_within(state.pose.translation, reach).value();
        for (std::int32_t y = range.low.y; y <= range.high.y; ++y) {
            for (std::int32_t x = range.low.x; x <= range.high.x; ++x) {
                const std::vector<ScatterPoint> points = scatter.objects_in({x, y}).value();
                for (const ScatterPoint& point : points) {
                    if ((point.position_world - state.pose.translation).norm() > reach) continue;
                    EXPECT_TRUE(std::any_of(world.states().begin(), world.states().end(),
                                            [&](const BodyState& body) {
                                                return body.condition == BodyCondition::fixed &&
                                                       body.pose.translation ==
                                                           point.position_world;
                                            }))
                        << step;
                }
            }
        }
        world.step(ground(), kDt);
    }
}

TEST_F(Boulders, ThatOverlapABodyAreLeftOutUntilItIsGone) {
    const Scatter scatter = Scatter::create(source_, objects_.scatters[0].settings).value();
    const std::vector<ScatterPoint> points =
        scatter.objects_in(scatter.square_at(0.0, 0.0)).value();
    ASSERT_FALSE(points.empty());
    const WorldPos at = points[0].position_world;
    const auto is_there = [&](const World& world) {
        return std::any_of(
            world.states().begin(), world.states().end(), [&](const BodyState& body) {
                return body.condition == BodyCondition::fixed && body.pose.translation == at;
            });
    };
    World world = World::create({}).value();
    ObjectBodies objects = make();
    const BodyId ball = add_ball(world, at, 0.0);
    ASSERT_TRUE(objects.follow(world, ground()));
    EXPECT_FALSE(is_there(world));
    BodyState beside;
    beside.pose.translation = at + WorldPos(0.0, 0.0, 6.0);
    ASSERT_TRUE(world.teleport(ball, beside));
    ASSERT_TRUE(objects.follow(world, ground()));
    EXPECT_TRUE(is_there(world));
}

TEST_F(Boulders, OfALoadedWorldGoOnWithTheSameBits) {
    World world = World::create({}).value();
    ObjectBodies objects = make();
    for (int i = 0; i < 8; ++i) add_ball(world, above(20.0 * i - 80.0, 15.0 * i, 3.0), 15.0);
    const auto run = [&](World& each, ObjectBodies& of_each, int steps) {
        for (int step = 0; step < steps; ++step) {
            ASSERT_TRUE(of_each.follow(each, ground()));
            each.step(ground(), kDt);
        }
    };
    run(world, objects, 60);
    World loaded = World::load(world.save()).value();
    ObjectBodies again = make();
    run(world, objects, 120);
    run(loaded, again, 120);
    EXPECT_GT(static_count(world), 10u);
    EXPECT_EQ(world.state_hash(), loaded.state_hash());
}

}  // namespace object_bodies_test
}  // namespace terrane::tools
