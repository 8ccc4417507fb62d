// SPDX-License-Identifier: MIT
// Lift, test and the sign of the signed distance, against brute force over every triangle of the ground.
#include "law_cases.h"

#include <terrane/collision/ground_contact.h>

#include <gtest/gtest.h>

namespace terrane {
namespace lift_laws_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260302;

TEST(LawsOfLift, IsTheLargestOverEveryTriangle) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const long count = count_of_cases(10'000, 1'000'000);
    for (const LawShape& shape : law_shapes()) {
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            const double lift = random.between(-1.0, 1.0);
            const Pose pose = random_pose(random, scene, shape, lift);
            const LiftAnswer answer = compute_lift(shape.shape, pose, scene.ground);
            ASSERT_EQ(answer.status, QueryStatus::complete);
            ASSERT_NEAR(answer.lift, lift, 1e-9) << describe(scene, shape, pose);
            ASSERT_EQ(pseudodistance(shape.shape, pose, scene.ground).pseudodistance, -answer.lift);
        }
    }
}

TEST(LawsOfSign, DistanceAndTestHaveTheSignOfTheLift) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed + 1);
    const long count = count_of_cases(1'000, 200'000);
    for (const LawShape& shape : law_shapes()) {
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            // of all sizes, down to little more than rounding
            const double size = std::pow(10.0, random.between(-8.0, 0.0));
            const double lift = random.below(2) == 0 ? size : -size;
            const Pose pose = random_pose(random, scene, shape, lift);
            SCOPED_TRACE(describe(scene, shape, pose));
            const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 4.0);
            ASSERT_EQ(answer.status, QueryStatus::complete);
            ASSERT_TRUE(answer.has_ground);
            const bool is_touching = test_contact(shape.shape, pose, scene.ground).is_touching;
            if (lift > 0.0) {
                ASSERT_LT(answer.distance, 0.0) << lift;
                ASSERT_GE(answer.distance, -lift - 1e-9);
                ASSERT_TRUE(is_touching);
            } else {
                ASSERT_GE(answer.distance, 0.0) << lift;
                ASSERT_LE(answer.distance, -lift + 1e-9);
                ASSERT_FALSE(is_touching);
            }
        }
    }
}

TEST(LawsOfSign, DistanceIsZeroWhereTheShapeTouches) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed + 2);
    const long count = count_of_cases(1'000, 200'000);
    for (const LawShape& shape : law_shapes()) {
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            const Pose pose = random_pose(random, scene, shape, 0.0);
            SCOPED_TRACE(describe(scene, shape, pose));
            ASSERT_NEAR(signed_distance(shape.shape, pose, scene.ground, 1.0).distance, 0.0, 1e-9);
            ASSERT_TRUE(test_contact(shape.shape, pose, scene.ground).is_touching);
        }
    }
}

}  // namespace lift_laws_test
}  // namespace terrane
