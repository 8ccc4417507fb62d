// SPDX-License-Identifier: MIT
#include "case_count.h"
#include "pair_cases.h"
#include "pair_oracle.h"

#include <gtest/gtest.h>

namespace terrane {
namespace shape_ray_test {

using internal::ConvexRay;
using test::Kind;
using test::Random;

constexpr std::uint64_t kSeed = 20261202;

class ShapeRays : public testing::TestWithParam<Kind> {};

INSTANTIATE_TEST_SUITE_P(All, ShapeRays,
                         testing::Values(Kind::sphere, Kind::capsule, Kind::box, Kind::hull),
                         [](const auto& each) { return test::name_of(each.param); });

// A ray is a hull of two points.
TEST_P(ShapeRays, MeetWhatASegmentMeetsAndWhereItFirstDoes) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    int hits = 0;
    for (int i = 0; i < test::case_count(10'000) && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const internal::ConvexView shape = test::random_shape(random, GetParam(), i % 5 == 3);
        Pose pose;
        pose.rotation = random.rotation();
        const double reach = internal::reach_of(shape) + 0.1;
        const Eigen::Vector3d from = random.between(0.0, 2.0) * reach * random.direction();
        const Eigen::Vector3d to =
            i % 7 == 0 ? from : Eigen::Vector3d(1.3 * reach * random.direction());
        const ConvexRay ray = cast_ray(
            internal::place(shape, orthonormalized(pose.rotation), Eigen::Vector3d::Zero()), from,
            to - from);
        const auto distance_up_to = [&](double share) {
            const test::TestHull segment({from, from + std::max(share, 1e-9) * (to - from)});
            return i % 7 == 0
                       ? test::oracle_distance(test::TestHull({from}).view(), Pose{}, shape, pose)
                       : test::oracle_distance(segment.view(), Pose{}, shape, pose);
        };
        const double distance = distance_up_to(1.0);
        if (std::abs(distance) > 1e-9) {
            EXPECT_EQ(ray.hit, distance < 0.0);
        }
        if (!ray.hit) continue;
        ++hits;
        EXPECT_NEAR(ray.normal.norm(), i % 7 == 0 ? ray.normal.norm() : 1.0, 1e-9);
        EXPECT_LE(ray.normal.dot(to - from), 1e-9);
        Pose at;
        at.translation = from + ray.fraction * (to - from);
        const double there = test::oracle_distance(Sphere{0.0}, at, shape, pose);
        if (ray.fraction > 0.0) {
            EXPECT_NEAR(there, 0.0, 1e-9);
            if (ray.fraction > 1e-6) {
                EXPECT_GE(distance_up_to(ray.fraction - 1e-7), -1e-9);
            }
        } else {
            EXPECT_LE(there, 1e-9);
        }
    }
    EXPECT_GT(hits, 1000);
}

TEST(ShapeRay, MeetsPeersFacts) {
    // A ball of radius 0.2 halfway along 30 m: the fraction is (15 - 0.2) / 30.
    Pose pose;
    pose.translation = {15.0, 0.0, 0.0};
    const ShapeRayAnswer ball = cast_ray(Sphere{0.2}, pose, {0, 0, 0}, {30, 0, 0});
    ASSERT_TRUE(ball.hit);
    EXPECT_NEAR(ball.fraction, (15.0 - 0.2) / 30.0, 1e-15);
    EXPECT_NEAR(ball.normal.x(), -1.0, 1e-15);
    // A ray in the plane of a face touches; one beside it does not.
    EXPECT_TRUE(cast_ray(Box{}, Pose{}, {-2, 0.5, 0}, {2, 0.5, 0}).hit);
    EXPECT_FALSE(cast_ray(Box{}, Pose{}, {-2, 0.5000001, 0}, {2, 0.5000001, 0}).hit);
    EXPECT_TRUE(cast_ray(Capsule{0.5, 1.0}, Pose{}, {-2, 0, 1.5}, {2, 0, 1.5}).hit);
    const ShapeRayAnswer far = cast_ray(Sphere{0.5}, Pose{}, {-1e6, 0.3, 0}, {1e6, 0.3, 0});
    ASSERT_TRUE(far.hit);
    EXPECT_NEAR(far.point_world.x(), -0.4, 1e-9);
    const ShapeRayAnswer within = cast_ray(Box{}, Pose{}, {0.1, 0.1, 0.1}, {2, 0.1, 0.1});
    EXPECT_TRUE(within.hit);
    EXPECT_EQ(within.fraction, 0.0);
    EXPECT_EQ(within.normal, Eigen::Vector3d(-1, 0, 0));
}

}  // namespace shape_ray_test
}  // namespace terrane
