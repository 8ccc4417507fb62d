// SPDX-License-Identifier: MIT
// Lift, test and the sign of the signed distance, against brute force over every triangle of the ground.
#include "law_cases.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>

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

// A shape whose surface lies `growth` further out, or in where that is negative, metres.
LawShape grown(const Shape& shape, double growth) {
    Shape made = shape;
    if (auto* sphere = std::get_if<Sphere>(&made)) sphere->radius += growth;
    if (auto* capsule = std::get_if<Capsule>(&made)) capsule->radius += growth;
    if (auto* box = std::get_if<Box>(&made)) box->half_extents.array() += growth;
    return {"grown", made, make_oracle(made)};
}

// One ground of 128 cells of 1 m, `far` from the origin: random heights of up to `size`.
LawScene rounding_scene(double far, double size) {
    TableGroundSettings settings;
    settings.first_root = static_cast<std::int32_t>(far / 128.0);
    const auto height = [=](double x, double y) {
        Random random(static_cast<std::uint64_t>(x - far) * 0x10001 +
                      static_cast<std::uint64_t>(y - far));
        return random.between(0.0, size);
    };
    return make_scene("rounding", height, settings);
}

// The bound that docs/numerics.md derives.
TEST(LawsOfLift, LiesBetweenThoseOfShapesGrownAndShrunkByRounding) {
    static_assert(std::numeric_limits<long double>::digits >= 64);
    constexpr double kUnit = 0x1p-53, kRounding = 40.0;
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 3);
    Random random(kSeed + 3);
    const long count = count_of_cases(300, 100'000);
    for (const double far : {0.0, 128.0 * 7812, 1e9}) {
        for (const double size : {1.0, 1e5}) {
            const LawScene scene = rounding_scene(far, size);
            long double worst = 0, worst_share = 0;
            for (const char* name : {"sphere", "capsule", "box"}) {
                const LawShape& shape = shape_named(name);
                const double reach = bounding_radius(shape.shape) + 2.0;
                for (long i = 0; i < count; ++i) {
                    const Pose pose = random_pose(random, scene, shape, random.between(-1.0, 1.0));
                    const double lift = compute_lift(shape.shape, pose, scene.ground).lift;
                    const double growth = kRounding * kUnit * (reach + std::abs(lift));
                    const auto of = [&](const LawShape& other) {
                        return brute_lift<long double>(scene.soup, other.oracle, pose);
                    };
                    const long double exact = of(shape);
                    const long double most = of(grown(shape.shape, growth));
                    ASSERT_LE(lift, most) << describe(scene, shape, pose);
                    ASSERT_GE(lift, of(grown(shape.shape, -growth)))
                        << describe(scene, shape, pose);
                    worst = std::max(worst, std::abs(lift - exact));
                    worst_share = std::max(worst_share, (lift - exact) / (most - exact));
                }
            }
            std::printf("%g m out, heights of %g m: largest error %.2Lg m, %.3Lf of the bound\n",
                        far, size, worst, worst_share);
            EXPECT_GT(worst_share, 1e-3L);
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
