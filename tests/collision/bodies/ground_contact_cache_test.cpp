// SPDX-License-Identifier: MIT
// The cache's clear distance: how far a body may move without a cast.
#include "body_cases.h"
#include "support/heights/table_ground.h"
#include "support/random.h"
#include "world/solver/body_step.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace terrane::internal {
namespace ground_look_test {

using test::make_hammer;
using test::make_test_ground;
using test::make_wedge;

RigidBody make_body(const Shape& shape, const Pose& pose) {
    RigidBody body;
    body.shape = &shape;
    body.radius = bounding_radius(shape);
    body.pose = pose;
    return body;
}

// More spheres touch the ground, each along a normal of its own, than the contact buffer has room for.
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

    // With room for all contacts the distance is known.
    const Shape few = Compound::create(std::span(parts).last(9)).value();
    const RigidBody smaller = make_body(few, pose);
    cache.invalidate();
    cache.update(smaller, ground);
    ASSERT_GE(cache.count(), 9u);
    EXPECT_GT(cache.clear_distance(0.0), 0.0);
    EXPECT_LT(cache.clear_distance(0.0), 0.0025);
}

// No motion within the clear distance, in any direction and with any rotation, hits the offset surface; nor after the
// cached contacts have been reused.
TEST(GroundContactCache, IsKeptByEveryMotionThatItPromises) {
    constexpr std::uint64_t kSeed = 17;
    test::Random random(kSeed);
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
        Motion motion;
        motion.start = raised(body.pose, offset_depth(body, 0));
        motion.translation = share * clear_distance * random.direction();
        motion.rotation_vector = (1.0 - share) * clear_distance / body.radius * random.direction();
        const CastAnswer hit = cast(shape, motion, ground, {.tolerance = 1e-9});
        EXPECT_FALSE(hit.hit) << "seed " << kSeed << ", run " << run;
    }
    EXPECT_GT(promised, 5'000);
}

}  // namespace ground_look_test
}  // namespace terrane::internal
