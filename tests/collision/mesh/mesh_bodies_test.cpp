// SPDX-License-Identifier: MIT
//
// Bodies in a shaft and a cavern: none gets deeper than its tolerance, judged by formulas over the poses of all steps.
#include "cave_scene.h"
#include "collision/bodies/body_cases.h"
#include "support/random.h"

#include <terrane/collision/ground_contact.h>
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

}  // namespace mesh_bodies_test
}  // namespace terrane
