// SPDX-License-Identifier: MIT
// Contacts between bodies.
#include "collision/world/body_cases.h"
#include "collision/world/busy_world.h"
#include "support/allocation_counter.h"
#include "support/random.h"

#include <terrane/collision/shape_pairs.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace terrane::meetings_test {

using namespace test;

struct Totals {
    Eigen::Vector3d momentum = Eigen::Vector3d::Zero();
    double energy = 0.0;
};

/// Of spheres, whose inertia is a single number.
Totals count_up(const World& world) {
    Totals totals;
    for (std::size_t i = 0; i < world.states().size(); ++i) {
        const BodyState& state = world.states()[i];
        const BodySettings& settings = world.settings()[i];
        const double r = std::get<Sphere>(settings.shape).radius;
        const Eigen::Vector3d p = settings.mass * state.velocity;
        const Eigen::Vector3d spin = 0.4 * settings.mass * r * r * state.angular_velocity;
        totals.momentum += p;
        totals.energy += 0.5 * p.dot(state.velocity) + 0.5 * spin.dot(state.angular_velocity);
    }
    return totals;
}

double deepest_overlap(const World& world) {
    double deepest = 0.0;
    for (std::size_t a = 0; a < world.states().size(); ++a) {
        for (std::size_t b = a + 1; b < world.states().size(); ++b) {
            const PairDistanceAnswer answer =
                signed_distance(world.settings()[a].shape, world.states()[a].pose,
                                world.settings()[b].shape, world.states()[b].pose);
            deepest = std::max(deepest, -answer.distance);
        }
    }
    return deepest;
}

TEST(MeetingBodies, TwoBallsBounceAsRestitutionSays) {
    const Ground ground = make_flat();
    for (const double restitution : {0.0, 0.5, 1.0}) {
        for (const double speed : {2.0, 20.0, 300.0, 3000.0}) {
            SCOPED_TRACE(std::to_string(restitution) + ", " + std::to_string(speed) + " m/s");
            World world = make_world({.gravity = Eigen::Vector3d::Zero()});
            const BodySettings light{.shape = Sphere{0.5}, .mass = 1.0, .restitution = restitution};
            BodySettings heavy = light;
            heavy.mass = 3.0;
            const BodyId fast = add(world, light, at({10.0, kMiddle, 50.0}, {speed, 0, 0}));
            const BodyId slow = add(world, heavy, at({40.0, kMiddle, 50.0}, {-0.5 * speed, 0, 0}));
            for (int step = 0; step * kStep < 40.0 / speed + 4.0 * kStep; ++step) {
                world.step(ground, kStep);
            }
            // Total momentum -0.5 m v; the separation speed is restitution * 1.5 v.
            const double common = -0.5 * speed / 4.0, parting = restitution * 1.5 * speed;
            EXPECT_NEAR(world.state(fast).velocity.x(), common - 0.75 * parting, 1e-9 * speed);
            EXPECT_NEAR(world.state(slow).velocity.x(), common + 0.25 * parting, 1e-9 * speed);
            EXPECT_NEAR(world.state(fast).velocity.y(), 0.0, 1e-9 * speed);
        }
    }
}

TEST(MeetingBodies, KeepMomentumAndGainNoEnergyInTheAir) {
    const Ground ground = make_flat();
    for (std::uint64_t seed = 7; seed < 27; ++seed) {
        SeededRandom random(seed);
        World world = make_world({.gravity = Eigen::Vector3d::Zero()});
        for (int i = 0; i < 40; ++i) {
            BodySettings settings{.shape = Sphere{random.between(0.2, 0.8)},
                                  .mass = random.between(0.1, 10.0),
                                  .friction = random.between(0.0, 1.0),
                                  .restitution = random.between(0.0, 1.0)};
            BodyState state = at({random.between(60.0, 68.0), random.between(60.0, 68.0),
                                  random.between(900.0, 908.0)});
            state.velocity = {random.between(-20.0, 20.0), random.between(-20.0, 20.0),
                              random.between(-20.0, 20.0)};
            state.angular_velocity = {random.between(-20.0, 20.0), 3.0, -2.0};
            add(world, settings, state);
        }
        const Totals start = count_up(world);
        double energy = start.energy;
        std::uint64_t touches = 0;
        for (int step = 0; step < 60; ++step) {
            touches += world.step(ground, kStep).touching_pairs;
            const Totals now = count_up(world);
            EXPECT_LE(now.energy, energy * (1.0 + 1e-12)) << "step " << step;
            energy = now.energy;
            EXPECT_LT((now.momentum - start.momentum).norm(), 1e-9 * start.momentum.norm());
        }
        EXPECT_GT(touches, 10u);
    }
}

TEST(MeetingBodies, FastOnesDoNotPassThroughEachOther) {
    const Ground ground = make_flat();
    SeededRandom random(11);
    for (const Shape& shape : all_shapes()) {
        for (const Shape& other : all_shapes()) {
            for (int run = 0; run < 10; ++run) {
                const double substep = run % 2 == 0 ? 1.0 / 120.0 : 1.0 / 60.0;
                World world =
                    make_world({.gravity = Eigen::Vector3d::Zero(), .max_substep = substep});
                const double speed = random.between(100.0, 2000.0);
                BodyState bullet = at({3.0, kMiddle, 50.0}, {speed, 0.0, 0.0});
                bullet.angular_velocity = {random.between(-20, 20), random.between(-20, 20), 1.0};
                add(world, {.shape = shape}, bullet);
                const BodyId target =
                    add(world, {.shape = other}, at({random.between(30.0, 60.0), kMiddle, 50.0}));
                for (double time = 0.0; time < 60.0 / speed + 3.0 * kStep; time += kStep) {
                    world.step(ground, kStep);
                }
                // It moves towards the centre of the other body: most momentum is transferred, at any rotation.
                SCOPED_TRACE("run " + std::to_string(run) + ", " + std::to_string(speed) +
                             " m/s, " + name_of(shape) + " at " + name_of(other));
                // A hammer may be hit far from its centre of mass.
                const bool is_eccentric = std::holds_alternative<Compound>(shape) ||
                                          std::holds_alternative<Compound>(other);
                const double least = is_eccentric ? 0.02 : 0.1;
                EXPECT_GT(world.state(target).velocity.x(), least * speed);
            }
        }
    }
}

TEST(MeetingBodies, StackStandsAndSleepsTogetherAndWakesTogether) {
    const Ground ground = make_flat();
    World world = make_world({});
    constexpr std::size_t kCount = 10;
    for (std::size_t i = 0; i < kCount; ++i) {
        add(world, {.shape = Box{}}, at({kMiddle, kMiddle, 5.5 + static_cast<double>(i)}));
    }
    int step = 0;
    while (world.step(ground, kStep).asleep < kCount && step < 600) ++step;
    EXPECT_LT(step, 300) << "asleep within 5 s";
    for (std::size_t i = 0; i < kCount; ++i) {
        const WorldPos& place = world.states()[i].pose.translation;
        EXPECT_NEAR(place.x(), kMiddle, 1e-3) << i;
        EXPECT_NEAR(place.y(), kMiddle, 1e-3) << i;
        EXPECT_NEAR(place.z(), 5.5 + static_cast<double>(i), 0.02) << i;
    }
    // A falling body that hits one of them wakes all.
    add(world, {.shape = Sphere{0.3}}, at({kMiddle, kMiddle, 17.0}));
    std::uint64_t asleep = kCount;
    for (step = 0; step < 120 && asleep == kCount; ++step)
        asleep = world.step(ground, kStep).asleep;
    EXPECT_EQ(asleep, 0u);
}

/// Ten flat boxes stacked along the normal of a slope.
class StackOnASlope : public testing::Test {
protected:
    static constexpr double kSlope = 0.36397023426620234;  // tan 20 degrees
    static constexpr std::size_t kCount = 10;

    Ground ground =
        make_test_ground([](double x, double) { return kSlope * x; }, {.quantum = 0x1p-20});

    World build(bool allow_sleep) {
        World world = make_world({.allow_sleep = allow_sleep});
        const Eigen::Vector3d normal = Eigen::Vector3d(-kSlope, 0.0, 1.0).normalized();
        Pose pose;
        pose.rotation.col(0) = Eigen::Vector3d(1.0, 0.0, kSlope).normalized();
        pose.rotation.col(1) = Eigen::Vector3d::UnitY();
        pose.rotation.col(2) = normal;
        const Eigen::Vector3d foot(kMiddle, kMiddle, kSlope * kMiddle);
        for (std::size_t i = 0; i < kCount; ++i) {
            pose.translation = foot + normal * (0.1 + 0.2 * static_cast<double>(i));
            add(world, {.shape = Box{{0.5, 0.5, 0.1}}, .friction = 0.8}, {{.pose = pose}});
        }
        return world;
    }
};

TEST_F(StackOnASlope, DoesNotMoveInAMinute) {
    World world = build(false);
    const std::vector<BodyState> start(world.states().begin(), world.states().end());
    double along = 0.0, down = 0.0;
    for (int step = 0; step < 3600; ++step) {
        world.step(ground, kStep);
        for (std::size_t i = 0; i < kCount; ++i) {
            const Eigen::Vector3d moved =
                start[i].pose.rotation.transpose() *
                (world.states()[i].pose.translation - start[i].pose.translation);
            along = std::max(along, std::hypot(moved.x(), moved.y()));
            down = std::max(down, std::abs(moved.z()));
        }
    }
    RecordProperty("along_mm", std::to_string(1e3 * along));
    EXPECT_LT(along, 1e-3);
    EXPECT_LT(down, 1e-3);
}

TEST_F(StackOnASlope, IsAsleepWithinFiveSeconds) {
    World world = build(true);
    StepReport report;
    for (int step = 0; step < 300; ++step) report = world.step(ground, kStep);
    EXPECT_EQ(report.asleep, kCount);
}

/// A heap in a pit: fast bodies, stacks, sleeping bodies and steep ground.
World make_heap(const WorldSettings& settings, std::size_t count) {
    Random random(3);
    World world = make_world(settings);
    const std::vector<Shape> shapes{Sphere{0.5}, Capsule{0.4, 0.5}, Box{{0.4, 0.6, 0.3}},
                                    make_wedge(0.6), make_hammer(0.6)};
    for (std::size_t i = 0; i < count; ++i) {
        BodyState state = at({random.between(58.0, 70.0), random.between(58.0, 70.0),
                              random.between(8.0, 8.0 + 0.15 * static_cast<double>(count))});
        state.velocity = {0.0, 0.0, random.between(-30.0, 0.0)};
        state.angular_velocity = {random.between(-9.0, 9.0), random.between(-9.0, 9.0), 1.0};
        const double mass = random.between(0.5, 5.0);
        add(world, {.shape = shapes[i % shapes.size()], .mass = mass}, state);
    }
    return world;
}

Ground make_pit() {
    return make_test_ground(
        [](double x, double y) {
            const double r = std::hypot(x - 64.0, y - 64.0);
            return 0.05 * r * r;
        },
        1.0, 1);
}

TEST(MeetingBodies, HeapSettlesWithoutOverlapsAndNobodyFalls) {
    const Ground ground = make_pit();
    World world = make_heap({}, 60);
    take_steps(world, ground, 1200);
    EXPECT_LT(deepest_overlap(world), 0.02);
    EXPECT_GT(world.step(ground, kStep).asleep, 50u) << "of 60";  // one may roll for a long time
}

/// A plate with two walls that slope from both sides to a line half a metre above its bottom.
Compound make_groove() {
    std::vector<CompoundPart> parts{{Box{{1.0, 1.0, 0.1}}, {}}};
    parts[0].body_from_part.translation.z() = 0.1;
    const double h = std::sqrt(0.5);
    for (const double side : {-1.0, 1.0}) {
        const Eigen::Vector3d along(h, 0.0, side * h), up(-side * h, 0.0, h);
        CompoundPart wall{Box{{0.8, 1.0, 0.1}}, {}};
        wall.body_from_part.rotation << along, Eigen::Vector3d::UnitY(), up;
        wall.body_from_part.translation =
            Eigen::Vector3d(0.0, 0.0, 0.5) + side * 0.8 * along - 0.1 * up;
        parts.push_back(wall);
    }
    return Compound::create(parts).value();
}

// Contacts on two sides at once.
TEST(MeetingBodies, ABallRestsInAGroove) {
    const Ground ground = make_flat();
    World world = make_world({.allow_sleep = false});
    const BodyId groove =
        add(world, {.shape = make_groove(), .mass = 50.0}, at({kMiddle, kMiddle, 5.0}));
    const double rest = 5.5 + 0.5 * std::sqrt(2.0);
    const BodyId id = add(world, {.shape = Sphere{0.5}, .friction = 0.3, .restitution = 0.0},
                          at({kMiddle + 0.1, kMiddle, rest + 0.3}));
    for (int step = 0; step < 300; ++step) world.step(ground, kStep);
    const BodyState& ball = world.state(id);
    double fastest = 0.0;
    for (int step = 0; step < 60; ++step) {
        world.step(ground, kStep);
        fastest = std::max(fastest, ball.velocity.norm());
    }
    EXPECT_LT(fastest, 1e-3);
    EXPECT_NEAR(ball.pose.translation.x(), world.state(groove).pose.translation.x(), 0.01);
    EXPECT_NEAR(ball.pose.translation.z(), rest, 0.01);
}

TEST(MeetingBodies, GiveTheSameBitsForEveryNumberOfWorkersAndBroadphase) {
    const Ground ground = make_pit();
    const auto hash_with = [&](const WorldSettings& settings) {
        World world = make_heap(settings, 60);
        take_steps(world, ground, 90);
        return world.state_hash();
    };
    const std::uint64_t alone = hash_with({});
    for (const int workers : {2, 3, 8}) {
        EXPECT_EQ(hash_with({.worker_count = workers}), alone) << workers << " workers";
    }
    for (const BroadphaseKind kind : {BroadphaseKind::grid, BroadphaseKind::two_scene}) {
        EXPECT_EQ(hash_with({.broadphase = kind}), alone) << to_string(kind);
    }
}

// Boxes of bodies that rest are kept over steps of other lengths.
TEST(MeetingBodies, GiveTheSameBitsForEveryBroadphaseInABusyWorld) {
    const Ground ground = make_busy_ground();
    std::vector<World> worlds;
    BusyBodies bodies;
    for (const BroadphaseKind kind :
         {BroadphaseKind::sap, BroadphaseKind::grid, BroadphaseKind::two_scene}) {
        worlds.push_back(make_world({.broadphase = kind}));
        bodies = fill_busy_world(worlds.back());
    }
    std::uint64_t asleep = 0, touching = 0;
    for (int step = 0; step < 130; ++step) {
        StepReport report;
        for (World& world : worlds) {
            act_on_busy_world(world, bodies, step);
            report = world.step(ground, step % 5 == 0 ? 2.0 * kStep : kStep);
            ASSERT_EQ(world.state_hash(), worlds[0].state_hash()) << step;
        }
        asleep += report.asleep;
        touching += report.touching_pairs;
    }
    EXPECT_GT(asleep, 0u);
    EXPECT_GT(touching, 0u);
}

TEST(Projectile, HitsTheFirstBodyOrTheGroundAndPushesIt) {
    const Ground ground = make_flat();
    World world = make_world({});
    const BodySettings settings{.shape = Sphere{0.5}, .mass = 2.0};
    const BodyId second = add(world, settings, at({40.0, kMiddle, 5.5}));
    const BodyId body = add(world, settings, at({30.0, kMiddle, 5.5}));
    add(world, settings, at({50.0, kMiddle, 5.5}));
    take_steps(world, ground, 120);
    ASSERT_TRUE(is_asleep(world, body));

    const Sphere ball{0.05};
    Motion flight{.start = at({20.0, kMiddle, 5.5}).pose, .translation = {100.0, 0.0, 0.0}};
    const CastQueryAnswer first = world.cast(ground, ball, flight);
    ASSERT_TRUE(first.hit);
    EXPECT_EQ(first.body, body);
    EXPECT_NEAR(first.fraction, (30.0 - 0.55 - 20.0) / 100.0, 1e-5);
    EXPECT_NEAR(first.normal.x(), -1.0, 1e-9);
    EXPECT_EQ(world.cast(ground, ball, flight, {.except = body}).body, second);

    flight.translation = {100.0, 0.0, -4.0};
    flight.start.translation.z() = 7.5;  // above all bodies, down to the ground
    const CastQueryAnswer low = world.cast(ground, ball, flight);
    ASSERT_TRUE(low.hit);
    EXPECT_TRUE(low.hits_ground());
    EXPECT_NEAR(low.fraction, 2.45 / 4.0, 1e-4);

    ASSERT_TRUE(world.apply_impulse(body, first.point_world, {3.0, 0.0, 0.0}));
    EXPECT_EQ(world.state(body).condition, BodyCondition::awake);
    EXPECT_NEAR(world.state(body).velocity.x(), 1.5, 1e-12);
    EXPECT_NEAR(world.state(body).angular_velocity.norm(), 0.0, 1e-6);
    world.step(ground, kStep);
    EXPECT_GT(world.state(body).pose.translation.x(), 30.01);
    const Result<void> refused = world.apply_impulse(body, first.point_world, {1e17, 0.0, 0.0});
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("velocity"), std::string::npos);
}

TEST(MeetingBodies, PassThroughEachOtherWhereTheyDoNotMeet) {
    const Ground ground = make_flat();
    World world = make_world({.gravity = Eigen::Vector3d::Zero(), .collide_bodies = false});
    const BodyId moving = add(world, {}, at({50.0, kMiddle, 50.0}, {5.0, 0.0, 0.0}));
    const BodyId still = add(world, {}, at({60.0, kMiddle, 50.0}));
    for (int step = 0; step < 240; ++step) {
        EXPECT_EQ(world.step(ground, kStep).touching_pairs, 0u);
    }
    EXPECT_NEAR(world.state(moving).pose.translation.x(), 70.0, 1e-6);
    EXPECT_EQ(world.state(still).pose.translation.x(), 60.0);
}

TEST(MeetingBodies, AllocateNothingOnceTheyHaveMet) {
    const Ground ground = make_pit();
    World world = make_heap({.allow_sleep = false}, 30);
    for (int step = 0; step < 600; ++step) world.step(ground, kStep);
    const AllocationCounter counter;
    for (int step = 0; step < 60; ++step) world.step(ground, kStep);
    EXPECT_EQ(counter.count(), 0u);
}

}  // namespace terrane::meetings_test
