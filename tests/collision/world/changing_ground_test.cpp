// SPDX-License-Identifier: MIT
//
// The contact cache's clear distance: how far a body may move before its cached contacts must be found anew.
#include "collision/world/busy_world.h"
#include "world/solver/ground_gate.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace terrane::internal::changing_ground_test {

using namespace test;

RigidBody make_body(const Shape& shape, const Pose& pose) {
    RigidBody body;
    body.shape = &shape;
    body.radius = bounding_radius(shape);
    body.pose = pose;
    return body;
}

// More spheres touch the ground, each with a different normal, than the contact buffer holds.
TEST(GroundContactCache, PromisesNothingWhereContactsWereCutOff) {
    const Ground ground = make_test_ground(
        [](double x, double y) { return 0.4 * std::sin(0.9 * x) * std::sin(0.7 * y); }, 2.0, 1);
    const Pose pose{Eigen::Matrix3d::Identity(), {60.0, 60.0, 0.0}};
    std::vector<CompoundPart> parts;
    for (std::size_t i = 0; i < GroundContactCache::kMaxCount + 17; ++i) {
        const std::size_t column = i % 9, row = i / 9;
        const double x = 0.7 * static_cast<double>(column) - 2.8;
        const double y = 0.7 * static_cast<double>(row) - 2.5;
        Pose placed{Eigen::Matrix3d::Identity(), pose.translation + Eigen::Vector3d(x, y, 3.0)};
        placed.translation.z() += compute_lift(Sphere{0.3}, placed, ground).lift + 0.002;
        parts.push_back({Sphere{0.3}, {placed.rotation, placed.translation - pose.translation}});
    }
    const Shape many = Compound::create(parts).value();
    const RigidBody body = make_body(many, pose);
    GroundContactCache cache;
    cache.update(body, ground);
    ASSERT_EQ(cache.count(), GroundContactCache::kMaxCount);
    EXPECT_LE(cache.clear_distance(0.0), 0.0);

    // If the buffer holds all contacts, the distance is known.
    const Shape few = Compound::create(std::span(parts).last(9)).value();
    const RigidBody smaller = make_body(few, pose);
    cache.invalidate();
    cache.update(smaller, ground);
    ASSERT_GE(cache.count(), 9u);
    EXPECT_GT(cache.clear_distance(0.0), 0.0);
    EXPECT_LT(cache.clear_distance(0.0), 0.0025);
}

// No motion within the clear distance, in any direction and with any rotation, hits the offset surface, even after
// cached contacts have been reused.
TEST(GroundContactCache, IsKeptByEveryMotionThatItPromises) {
    SeededRandom random(17);
    const Ground ground = make_test_ground(
        [](double x, double y) { return 0.6 * std::sin(1.1 * x) * std::sin(0.9 * y); }, 1.0, 1);
    const std::vector<Shape> shapes{Sphere{0.5}, Capsule{0.4, 0.8}, Box{{0.6, 0.8, 0.5}},
                                    make_wedge(0.7), make_hammer(0.7)};
    int promised = 0;
    for (int run = 0; run < 20'000; ++run) {
        const Shape& shape = shapes[static_cast<std::size_t>(run) % shapes.size()];
        Pose pose;
        pose.rotation =
            Motion{{}, Eigen::Vector3d::Zero(), 3.0 * random.direction()}.at(1.0).rotation;
        pose.translation = {random.between(10.0, 118.0), random.between(10.0, 118.0), 0.0};
        pose.translation.z() += compute_lift(shape, pose, ground).lift;
        pose.translation.z() += random.between(-0.002, 0.006);
        RigidBody body = make_body(shape, pose);
        GroundContactCache cache;
        cache.update(body, ground);
        body.pose.translation += random.between(0.0, 0.0003) * random.direction();
        cache.update(body, ground);
        const double clear_distance = cache.clear_distance(0.0);
        if (!(clear_distance > 0.0)) continue;
        ++promised;
        const double share = random.between(0.0, 1.0);
        Motion motion{
            .start = raised(body.pose, offset_depth(body, 0)),
            .translation = share * clear_distance * random.direction(),
            .rotation_vector = (1.0 - share) * clear_distance / body.radius * random.direction()};
        const CastAnswer hit = cast(shape, motion, ground, {.tolerance = 1e-9});
        EXPECT_FALSE(hit.hit) << "run " << run;
    }
    EXPECT_GT(promised, 5'000);
}

// What a collision step has proved is reused in the next step only over the same chunks.

Ground make_waves(double height) {
    return make_test_ground(
        [height](double x, double y) {
            return height + 0.5 * std::sin(0.7 * x) + 0.4 * std::cos(0.9 * y);
        },
        1.0, 1);
}

World make_rolling_world(bool allow_sleep) {
    World world = make_world({.allow_sleep = allow_sleep});
    Random random(11);
    const std::vector<Shape> shapes = all_shapes(0.4);
    for (std::size_t i = 0; i < 40; ++i) {
        BodyState state = at({random.between(20.0, 100.0), random.between(20.0, 100.0), 8.0});
        state.pose.rotation = random.rotation();
        state.velocity = 4.0 * random.direction();
        add(world, {.shape = shapes[i % shapes.size()]}, state);
    }
    return world;
}

TEST(ChangingGround, WithTheSameHeightsInOtherChunksChangesNoBit) {
    // The second world's grounds have their own chunks, so that it reuses no proof.
    const Ground ground = make_waves(5.0);
    const std::vector<Ground> others{make_waves(5.0), make_waves(5.0)};
    World one = make_rolling_world(true), other = make_rolling_world(true);
    for (std::size_t i = 0; i < 300; ++i) {
        one.step(ground, kStep);
        other.step(others[i % 2], kStep);
        ASSERT_EQ(one.state_hash(), other.state_hash()) << i;
    }
}

/// A copy without proofs from previous steps.
World make_copy(const World& world) { return World::load(world.save()).value(); }

TEST(ChangingGround, ThatRisesUnderBodiesIsNoticedInTheNextStep) {
    const Ground low = make_waves(5.0), high = make_waves(6.5);
    World world = make_rolling_world(false);
    for (int i = 0; i < 600; ++i) world.step(low, kStep);
    EXPECT_EQ(world.step(low, kStep).too_deep, 0u);
    World copy = make_copy(world);
    const StepReport report = world.step(high, kStep);
    EXPECT_EQ(report.too_deep, report.awake);
    copy.step(high, kStep);
    EXPECT_EQ(world.state_hash(), copy.state_hash());
    for (int i = 0; i < 300; ++i) world.step(high, kStep);
    EXPECT_EQ(world.step(high, kStep).too_deep, 0u);
}

TEST(ChangingGround, ThatChangedWhileABodySleptIsNoticedWhenItWakes) {
    const Ground low = make_waves(5.0), high = make_waves(6.5);
    World world = make_rolling_world(true);
    StepReport report;
    for (int i = 0; i < 1200; ++i) report = world.step(low, kStep);
    ASSERT_GT(report.asleep, 10u);
    world.step(high, kStep);
    World copy = make_copy(world);
    for (World* const each : {&world, &copy}) {
        for (std::size_t i = 0; i < each->states().size(); ++i) {
            const WorldPos& place = each->states()[i].pose.translation;
            ASSERT_TRUE(each->apply_impulse(each->id(i), place, {0.0, 0.0, 1e-9}));
        }
        report = each->step(high, kStep);
        EXPECT_EQ(report.too_deep, report.awake);
    }
    EXPECT_EQ(world.state_hash(), copy.state_hash());
}

}  // namespace terrane::internal::changing_ground_test

// Bodies whose ground is not loaded stop, and continue with the same bits once it is.

namespace terrane::parked_bodies_test {

using namespace test;

/// Two by two chunks of 128 m; all resident by default.
Ground make_ground(std::function<double(double, double)> height,
                   std::function<bool(int column, int row)> is_resident) {
    TableGroundSettings settings{.roots = 2, .is_resident = std::move(is_resident)};
    return make_test_ground(std::move(height), settings);
}

Ground make_flat(std::function<bool(int column, int row)> is_resident = {}) {
    return make_ground([](double, double) { return 5.0; }, std::move(is_resident));
}

Ground make_rough(std::function<bool(int column, int row)> is_resident = {}) {
    const auto height = [](double x, double y) {
        const double furrow = (x + 2.0 * y) / 8.0;
        return 5.0 + 0.02 * x + 0.5 * (furrow - std::floor(furrow));
    };
    return make_ground(height, std::move(is_resident));
}

bool is_western(int column, int) { return column == 0; }
bool is_none(int, int) { return false; }

bool is_same(const BodyState& a, const BodyState& b) {
    return a.pose.rotation == b.pose.rotation && a.pose.translation == b.pose.translation &&
           a.velocity == b.velocity && a.angular_velocity == b.angular_velocity;
}

/// Waves with tight height intervals over small rectangles, as rasters have.
class LocalWaves final : public ForwardedHeights {
public:
    explicit LocalWaves(std::shared_ptr<const HeightSource> waves)
        : ForwardedHeights(std::move(waves)) {}
    HeightInterval interval(const WorldRect& rect) const override {
        if (rect.east - rect.west > 200.0) return ForwardedHeights::interval(rect);
        HeightInterval heights{1e9, -1e9};
        for (int i = 0; i < 33 * 33; ++i) {
            const int column = i % 33, row = i / 33;
            const double h = height(rect.west + (rect.east - rect.west) * column / 32.0,
                                    rect.south + (rect.north - rect.south) * row / 32.0);
            heights = {std::min(heights.low, h - 10.0), std::max(heights.high, h + 10.0)};
        }
        return heights;
    }
};

// Bounds of coarse chunks stop bodies far above ground that the source knows to be lower and that no body reaches
// within a short horizon.
TEST(ParkedBody, GetsItsGroundHoweverShortThePagersHorizon) {
    Lattice lattice{.finest_level = 7};
    const auto source = std::make_shared<const LocalWaves>(
        std::make_shared<const WaveHeights>(lattice, 60.0, 700.0));
    constexpr double kPlace = 300.0;
    for (const double above : {2.0, 20.0, 60.0, 200.0, 1000.0}) {
        Pager pager = Pager::create(source, {.worker_count = 0, .horizon = 2.0 * kStep}).value();
        World world = make_world();
        const double ground_z = source->height(kPlace, kPlace);
        const BodyId body = add(world, {}, at({kPlace, kPlace, ground_z + above}));
        std::uint64_t parked = 0;
        for (int step = 0; step < 60 * 30; ++step) {
            pager.update({}, world.needs(), step * kStep);
            parked += world.step(pager.ground(), kStep).parked;
        }
        EXPECT_LE(parked, 2u) << above;
        const WorldPos& end = world.state(body).pose.translation;
        EXPECT_NEAR(end.z(), source->height(end.x(), end.y()), 2.0) << above;
    }
}

TEST(ParkedBody, KeepsItsStateForAnyNumberOfSteps) {
    const Ground absent = make_flat(is_western);
    for (const Shape& shape : all_shapes()) {
        World world = make_world();
        const BodyState before = at({190.0, 64.0, 8.0}, {1.0, 2.0, -3.0}, {0.3, -4.0, 0.1});
        const BodyId id = add(world, {.shape = shape}, before);
        ASSERT_TRUE(world.add({.shape = shape}, at({60.0, 64.0, 8.0})));  // over resident ground
        for (int step = 0; step < 1000; ++step) {
            const StepReport report = world.step(absent, step % 3 == 0 ? 0.1 : kStep);
            ASSERT_EQ(report.parked, 1u);
            ASSERT_EQ(report.awake + report.asleep, 1u);
            ASSERT_EQ(world.state(id).condition, BodyCondition::parked);
            ASSERT_TRUE(is_same(world.state(id), before));
        }
        // a parked body needs its ground
        const BodyNeed need = world.needs()[0];
        const double off_centre = (need.centre_world - before.pose.translation).norm();
        EXPECT_TRUE(need.is_waiting);
        EXPECT_FALSE(world.needs()[1].is_waiting);
        EXPECT_EQ(need.velocity, before.velocity);
        EXPECT_LE(off_centre, shape.index() < 3 ? 0.0 : bounding_radius(shape));
        EXPECT_GT(need.radius, bounding_radius(shape) - off_centre);
    }
}

// In the air, in contact, and after deep penetration.
TEST(ParkedBody, GoesOnAsIfItHadNotWaited) {
    SeededRandom random(41);
    const Ground whole = make_rough(), absent = make_rough(is_none);
    for (int run = 0; run < 60; ++run) {
        SCOPED_TRACE("run " + std::to_string(run));
        const BodySettings settings{.shape = all_shapes()[static_cast<std::size_t>(run % 5)]};
        BodyState start =
            at({random.between(100, 156), random.between(100, 156), random.between(6, 14)});
        start.velocity = {random.between(-20, 20), random.between(-20, 20), random.between(-30, 0)};
        start.angular_velocity = random.between(0, 12) * random.direction();
        World straight = make_world(), waiting = make_world();
        add(straight, settings, start);
        add(waiting, settings, start);
        for (int step = 0; step < 120; ++step) {
            while (random.below(3) == 0) {
                const StepReport report = waiting.step(absent, kStep);
                ASSERT_EQ(report.parked + report.asleep, 1u);
            }
            straight.step(whole, kStep);
            waiting.step(whole, kStep);
            ASSERT_EQ(straight.state_hash(), waiting.state_hash()) << "step " << step;
        }
    }
}

TEST(ParkedBody, WaitsForAllOfItsGroundAndLivesAndLosesNoTime) {
    const Ground whole = make_flat();
    // near the corner of four chunks, which it reaches one by one
    const BodyState start = at({127.0, 127.0, 6.2}, {0.5, 0.5, -1.0});
    World world = make_world();
    const BodyId body = add(world, {.shape = Box{{2.0, 2.0, 1.0}}}, start);
    for (int present = 0; present < 15; ++present) {
        const Ground partly = make_flat(
            [present](int column, int row) { return (present >> (2 * row + column) & 1) != 0; });
        for (int step = 0; step < 5; ++step) {
            const StepReport report = world.step(partly, kStep);
            ASSERT_EQ(report.parked, 1u) << present;
            EXPECT_EQ(report.awake + report.impacts, 0u);
            EXPECT_EQ(report.simulated_time + report.lost_time + report.max_depth_m, 0.0);
            ASSERT_TRUE(is_same(world.state(body), start)) << present;
        }
    }
    EXPECT_EQ(world.step(whole, kStep).awake, 1u);
}

TEST(ParkedBody, DoesNotWaitForGroundThatItCannotReach) {
    World world = make_world();
    ASSERT_TRUE(world.add({}, at({125.0, 64.0, 8.0})));
    const Ground partly = make_flat(is_western);
    for (int step = 0; step < 300; ++step) ASSERT_EQ(world.step(partly, kStep).parked, 0u);
}

// It stops at the end of the last step with resident ground and continues from there.
TEST(ParkedBody, StopsOnItsWayWhereTheGroundEnds) {
    const Ground whole = make_rough(), partly = make_rough(is_western);
    for (const Shape& shape : all_shapes()) {
        World straight = make_world(), waiting = make_world();
        const BodyState start = at({100.0, 64.0, 9.5}, {25.0, 1.0, 0.0}, {0.0, 3.0, 0.0});
        const BodyId in_straight = add(straight, {.shape = shape, .friction = 0.1}, start);
        const BodyId in_waiting = add(waiting, {.shape = shape, .friction = 0.1}, start);
        int lived = 0;
        while (waiting.step(partly, kStep).parked == 0) {
            ASSERT_LT(++lived, 600);
            straight.step(whole, kStep);
            ASSERT_EQ(straight.state_hash(), waiting.state_hash());
        }
        EXPECT_GT(lived, 20);
        EXPECT_LT(waiting.state(in_waiting).pose.translation.x(), 128.0);
        EXPECT_TRUE(is_same(waiting.state(in_waiting), straight.state(in_straight)));
        for (int step = 0; step < 50; ++step) EXPECT_EQ(waiting.step(partly, kStep).parked, 1u);
        EXPECT_TRUE(is_same(waiting.state(in_waiting), straight.state(in_straight)));
        for (int step = 0; step < 100; ++step) {
            EXPECT_EQ(straight.step(whole, kStep).too_deep, 0u);
            EXPECT_EQ(waiting.step(whole, kStep).too_deep, 0u);
            ASSERT_EQ(straight.state_hash(), waiting.state_hash());
        }
        EXPECT_GT(waiting.state(in_waiting).pose.translation.x(), 128.0);
    }
}

// A body at rest on flat ground, one step before it falls asleep or long afterwards.
std::pair<World, BodyId> rest(const Ground& ground, bool is_asleep) {
    World world = make_world(), sleeper = make_world();
    const BodyId body = add(world, {.shape = Box{}}, at({64.3, 64.3, 5.6}));
    add(sleeper, {.shape = Box{}}, at({64.3, 64.3, 5.6}));
    int steps = 0;
    while (sleeper.step(ground, kStep).asleep == 0 && steps < 600) ++steps;
    for (int step = 0; step < (is_asleep ? steps + 10 : steps - 1); ++step) {
        world.step(ground, kStep);
    }
    EXPECT_EQ(test::is_asleep(world, body), is_asleep);
    return {std::move(world), body};
}

TEST(SleepingBody, SleepsOnWhileItsGroundIsGone) {
    const Ground ground = make_flat(), absent = make_flat(is_none);
    auto [world, body] = rest(ground, true);
    const BodyState before = world.state(body);
    const std::uint64_t hash = world.state_hash();
    for (const Ground* now : {&absent, &ground, &absent}) {
        for (int step = 0; step < 200; ++step) {
            const StepReport report = world.step(*now, kStep);
            ASSERT_EQ(report.asleep, 1u);
            ASSERT_EQ(report.parked, 0u);
            ASSERT_EQ(world.state_hash(), hash);
        }
    }
    EXPECT_EQ(world.needs()[0].centre_world, before.pose.translation);  // it still needs its ground
    // awake over absent ground it is parked; it falls once the ground is resident
    BodyState moved = before;
    moved.pose.translation.z() += 3.0;
    ASSERT_TRUE(world.teleport(body, moved));
    EXPECT_EQ(world.step(absent, kStep).parked, 1u);
    EXPECT_TRUE(is_same(world.state(body), moved));
    EXPECT_EQ(world.step(ground, kStep).awake, 1u);
    EXPECT_LT(world.state(body).velocity.z(), 0.0);
}

TEST(ParkedBody, FallsAsleepOnlyOnItsGround) {
    const Ground ground = make_flat(), absent = make_flat(is_none);
    auto [world, body] = rest(ground, false);
    const BodyState before = world.state(body);
    for (int step = 0; step < 200; ++step) {
        const StepReport report = world.step(absent, kStep);
        ASSERT_EQ(report.parked, 1u);
        ASSERT_EQ(report.asleep, 0u);
        ASSERT_TRUE(is_same(world.state(body), before));
    }
    // it had been at rest for almost kSleepDelay
    for (int step = 0; step < 3; ++step) world.step(ground, kStep);
    EXPECT_TRUE(is_asleep(world, body));
}

TEST(ParkedBody, CannotBePutToSleep) {
    const Ground ground = make_flat(), absent = make_flat(is_none);
    World world = make_world();
    const BodyId body = add(world, {}, at({64.3, 64.3, 8.0}));
    BodyState asleep = at({64.3, 64.3, 8.0});
    asleep.condition = BodyCondition::asleep;
    ASSERT_TRUE(world.teleport(body, asleep));
    EXPECT_EQ(world.step(absent, kStep).parked, 1u);
    EXPECT_EQ(world.step(ground, kStep).awake, 1u);
    EXPECT_LT(world.state(body).velocity.z(), 0.0);
}

TEST(ParkedBody, NeverComesBackInUnderTheGroundFromBeyondTheWorld) {
    const Ground whole = make_flat(), absent = make_flat(is_none);
    for (const bool is_parked : {false, true}) {  // on its way, after it has left the world
        for (const Shape& shape : all_shapes()) {
            for (const double speed : {3.0, 30.0, 300.0}) {
                World world = make_world();
                const BodyId body =
                    add(world, {.shape = shape}, at({270.0, 64.0, 0.0}, {-speed, 0.0, 0.0}));
                for (int step = 0; is_parked && world.step(absent, kStep).parked == 0; ++step) {
                    ASSERT_EQ(world.state(body).condition, BodyCondition::left_world);
                    ASSERT_LT(step, 600);
                }
                const double place = world.state(body).pose.translation.x();
                EXPECT_GT(place, 255.0);
                for (int step = 0; step < 120; ++step) {
                    EXPECT_EQ(world.step(whole, kStep).too_deep, 0u);
                    ASSERT_GT(world.state(body).pose.translation.x(), 255.0) << speed << " m/s";
                }
                EXPECT_LT(world.state(body).pose.translation.z(), -10.0);
            }
        }
    }
}

}  // namespace terrane::parked_bodies_test
