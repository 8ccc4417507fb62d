// SPDX-License-Identifier: MIT
//
// Bodies in a shaft and a cavern: none gets deeper than its tolerance, judged by formulas over the poses of all steps.
#include "cave_scene.h"
#include "collision/bodies/body_cases.h"
#include "support/allocation_counter.h"
#include "support/random.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/world.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

namespace terrane {
namespace mesh_bodies_test {

using namespace test;

/// Bodies of each shape: TERRANE_CAVE_BODIES, or a few.
int body_count() {
    const char* const count = std::getenv("TERRANE_CAVE_BODIES");
    return count != nullptr ? std::atoi(count) : 12;
}

struct Fall {
    double speed, dt;
    friend void PrintTo(const Fall& fall, std::ostream* out) {
        *out << fall.speed << " m/s, " << fall.dt << " s";
    }
};

class BodiesInACave : public ::testing::TestWithParam<Fall> {};

TEST_P(BodiesInACave, NeverGetDeeperThanTheirTolerance) {
    const auto [speed, dt] = GetParam();
    const CaveScene scene = make_cave();
    Random random(21);
    SCOPED_TRACE("seed 21");
    constexpr double kSeconds = 4.0;
    for (const Shape& shape : all_shapes(0.6)) {
        WorldSettings settings;
        settings.collide_bodies = false;
        World world = make_world(settings);
        std::vector<BodyId> bodies;
        for (int i = 0; i < body_count(); ++i) {
            BodyState state;
            // Over the mouth and its rim; or in the cavern, in any direction.
            if (i % 2 == 0) {
                state.pose.translation = {random.between(45.0, 53.0), random.between(45.0, 53.0),
                                          43.0};
                state.velocity = {0.05 * speed * random.between(-1.0, 1.0),
                                  0.05 * speed * random.between(-1.0, 1.0), -speed};
            } else {
                state.pose.translation = {random.between(43.0, 57.0), random.between(43.0, 57.0),
                                          random.between(13.0, 17.0)};
                state.velocity = speed * random.direction();
            }
            state.pose.rotation = random.rotation();
            state.angular_velocity = 10.0 * random.direction();
            bodies.push_back(world.add({.shape = shape}, state).value());
        }
        const double tolerance = default_contact_tolerance(shape);
        int in_cavern = 0;
        for (double time = 0.0; time < kSeconds; time += dt) {
            const StepReport report = world.step(scene.ground, dt);
            ASSERT_EQ(report.too_deep, 0u) << name_of(shape) << " at " << time;
            ASSERT_EQ(report.parked, 0u);
            for (const BodyId body : bodies) {
                const Pose& pose = world.states()[body.index].pose;
                if ((pose.translation.head<2>() - Eigen::Vector2d(64.0, 64.0))
                        .cwiseAbs()
                        .maxCoeff() > 60.0) {
                    continue;  // it flew to the border of the world
                }
                ASSERT_LT(scene.depth(world.settings()[body.index].shape, pose), tolerance + 1e-9)
                    << name_of(shape) << ' ' << body.index << " at " << time << ": "
                    << pose.translation.transpose();
            }
        }
        for (const BodyId body : bodies) {
            const WorldPos& p = world.states()[body.index].pose.translation;
            if (p.z() < 20.0) ++in_cavern;
        }
        EXPECT_GE(in_cavern, body_count() / 2) << name_of(shape);
    }
}

INSTANTIATE_TEST_SUITE_P(Falls, BodiesInACave,
                         ::testing::Values(Fall{0.0, 1.0 / 60.0}, Fall{300.0, 1.0 / 60.0},
                                           Fall{0.0, 0.1}, Fall{300.0, 0.1}));

TEST(BodiesOnAMesh, ComeToRestOnTheFloor) {
    const CaveScene scene = make_cave();
    for (const Shape& shape : all_shapes(0.6)) {
        World world = make_world();
        const BodyId body =
            world.add({.shape = shape, .restitution = 0.0}, at({55.3, 43.2, 12.0})).value();
        for (int i = 0; i < 1200; ++i) world.step(scene.ground, 1.0 / 60.0);
        EXPECT_EQ(world.states()[body.index].condition, BodyCondition::asleep) << name_of(shape);
        EXPECT_LT(std::abs(scene.depth(world.settings()[body.index].shape,
                                       world.states()[body.index].pose)),
                  default_contact_tolerance(shape))
            << name_of(shape);
    }
}

TEST(BodiesOnAMesh, ABoxSlidesOverInnerEdgesWithoutTurning) {
    const CaveScene scene = make_cave();
    World world = make_world();
    const Box box{{0.5, 0.4, 0.3}};
    const BodyId body = world
                            .add({.shape = box, .friction = 0.0, .restitution = 0.0},
                                 at({42.0, 55.1, 10.3}, {3.0, 0.37, 0.0}))
                            .value();
    for (int i = 0; i < 240; ++i) {
        world.step(scene.ground, 1.0 / 60.0);
        const BodyState& state = world.states()[body.index];
        ASSERT_LT(state.angular_velocity.norm(), 1e-6) << i;
        ASSERT_NEAR(state.velocity.x(), 3.0, 1e-6) << i;
        ASSERT_NEAR(state.velocity.y(), 0.37, 1e-6) << i;
        ASSERT_NEAR(state.pose.translation.z(), 10.3, 0.01) << i;
    }
}

TEST(BodiesOnAMesh, ASphereRollsOverTheRimAndFalls) {
    const CaveScene scene = make_cave();
    World world = make_world();
    const BodyId body =
        world.add({.shape = Sphere{0.5}}, at({43.0, 49.2, 40.5}, {2.0, 0.0, 0.0}, {0.0, 4.0, 0.0}))
            .value();
    for (int i = 0; i < 600; ++i) {
        ASSERT_EQ(world.step(scene.ground, 1.0 / 60.0).too_deep, 0u);
        const Pose& pose = world.states()[body.index].pose;
        ASSERT_LT(scene.depth(Sphere{0.5}, pose), 0.01) << i;
        // Nothing hits it before the rim.
        if (pose.translation.x() < 45.9) {
            ASSERT_NEAR(pose.translation.z(), 40.5, 0.01) << i;
            ASSERT_GT(world.states()[body.index].velocity.x(), 1.9) << i;
        }
    }
    EXPECT_LT(world.states()[body.index].pose.translation.z(), 11.0);
}

TEST(BodiesOnAMesh, PlacedInTheSolidComeOut) {
    const CaveScene scene = make_cave();
    for (const Shape& shape : all_shapes(0.5)) {
        World world = make_world();
        const BodyId body = world.add({.shape = shape}, at({55.0, 43.0, 8.0})).value();
        double deepest =
            scene.depth(world.settings()[body.index].shape, world.states()[body.index].pose);
        for (int i = 0; i < 400; ++i) {
            world.step(scene.ground, 1.0 / 60.0);
            const double depth =
                scene.depth(world.settings()[body.index].shape, world.states()[body.index].pose);
            ASSERT_LT(depth, std::max(deepest, default_contact_tolerance(shape)) + 1e-6)
                << name_of(shape) << i;
            deepest = std::min(deepest, depth);
        }
        EXPECT_LT(deepest, default_contact_tolerance(shape)) << name_of(shape);
        EXPECT_GT(world.states()[body.index].pose.translation.z(), 10.0) << name_of(shape);
    }
}

TEST(BodiesOnAMesh, GiveTheSameBitsWithAnyNumberOfWorkers) {
    const CaveScene scene = make_cave();
    const auto run = [&](int workers) {
        World world = make_world({.worker_count = workers});
        Random random(22);
        const std::vector<Shape> shapes = all_shapes(0.4);
        for (int i = 0; i < 40; ++i) {
            BodyState state = at({random.between(42.0, 58.0), random.between(42.0, 58.0),
                                  random.between(12.0, 18.0)});
            state.pose.rotation = random.rotation();
            state.velocity = 20.0 * random.direction();
            EXPECT_TRUE(
                world.add({.shape = shapes[static_cast<std::size_t>(i) % shapes.size()]}, state));
        }
        for (int i = 0; i < 120; ++i) world.step(scene.ground, 1.0 / 60.0);
        std::vector<double> numbers;
        for (const BodyState& state : world.states()) {
            for (int k = 0; k < 3; ++k) numbers.push_back(state.pose.translation[k]);
            for (int k = 0; k < 9; ++k) numbers.push_back(state.pose.rotation.data()[k]);
        }
        return numbers;
    };
    const std::vector<double> one = run(1);
    EXPECT_EQ(one, run(1));
    EXPECT_EQ(one, run(4));
}

TEST(BodiesOnAMesh, AStepAllocatesNothing) {
    if (!AllocationCounter::kCounts) GTEST_SKIP() << "this sanitizer replaces operator new";
    const CaveScene scene = make_cave();
    WorldSettings settings;
    settings.allow_sleep = false;
    World world = make_world(settings);
    Random random(23);
    const std::vector<Shape> shapes = all_shapes(0.4);
    for (int i = 0; i < 20; ++i) {
        BodyState state = at(
            {random.between(42.0, 58.0), random.between(42.0, 58.0), random.between(12.0, 18.0)});
        state.velocity = 5.0 * random.direction();
        ASSERT_TRUE(
            world.add({.shape = shapes[static_cast<std::size_t>(i) % shapes.size()]}, state));
    }
    for (int i = 0; i < 300; ++i) world.step(scene.ground, 1.0 / 60.0);
    const AllocationCounter counter;
    for (int i = 0; i < 100; ++i) world.step(scene.ground, 1.0 / 60.0);
    EXPECT_EQ(counter.count(), 0u);
}

TEST(BodiesOnAMesh, ParkBesideGroundThatIsNotResident) {
    // A room that ends at the border of the chunk, beyond which nothing is known.
    SolidTriangles solid;
    const auto quad = [&](Eigen::Vector3d p, Eigen::Vector3d u, Eigen::Vector3d v) {
        const auto first = static_cast<std::uint32_t>(solid.vertices_world.size());
        for (const Eigen::Vector3d& corner :
             {p, Eigen::Vector3d(p + u), Eigen::Vector3d(p + u + v), Eigen::Vector3d(p + v)}) {
            solid.vertices_world.push_back(corner);
        }
        solid.triangles.push_back({first, first + 1, first + 2});
        solid.triangles.push_back({first, first + 2, first + 3});
        solid.parts.insert(solid.parts.end(), 2, SolidPart::cavity);
    };
    quad({100.0, 60.0, 5.0}, {28.0, 0.0, 0.0}, {0.0, 8.0, 0.0});
    quad({100.0, 60.0, 9.0}, {0.0, 8.0, 0.0}, {28.0, 0.0, 0.0});
    TableGroundSettings settings;
    settings.roots = 2;
    settings.is_resident = [](int column, int) { return column == 0; };
    settings.solid = [&](const Chunk& chunk) -> std::shared_ptr<const SolidSurface> {
        if (chunk.key.x != 0 || chunk.key.y != 0) return nullptr;
        return std::make_shared<const SolidSurface>(solid);
    };
    const Ground ground = make_test_ground([](double, double) { return 20.0; }, settings);
    for (const Shape& shape : all_shapes(0.5)) {
        World world = make_world();
        const BodyId body =
            world.add({.shape = shape, .friction = 0.0}, at({110.0, 64.0, 6.5}, {20.0, 0.0, 0.0}))
                .value();
        bool is_parked = false;
        for (int i = 0; i < 120; ++i) {
            is_parked = world.step(ground, 1.0 / 60.0).parked > 0;
            ASSERT_LT(world.states()[body.index].pose.translation.x(), 128.0) << name_of(shape);
        }
        EXPECT_TRUE(is_parked) << name_of(shape);
        EXPECT_GT(world.states()[body.index].pose.translation.x(), 120.0) << name_of(shape);
    }
}

}  // namespace mesh_bodies_test
}  // namespace terrane
