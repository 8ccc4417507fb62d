// SPDX-License-Identifier: MIT
#include "collision/ground/ground_cases.h"

#include <gtest/gtest.h>

namespace terrane::hull_lift_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261101;
constexpr int kFactor = TERRANE_LIFT_FACTOR;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(HullLift, IsThatOfClippedFaces) {
    SeededRandom random(kSeed);
    // 10^4 cases in total.
    const int count = 180 * kFactor;
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        for (const NamedHull& named : make_hulls(random)) {
            SCOPED_TRACE(named.name);
            const ConvexHull hull = make_hull(named.points);
            const std::vector<Points> cover = cover_hull(named.points);
            const double radius = bounding_radius(hull);
            for (int i = 0; i < count; ++i) {
                const Pose pose = random_pose(random, ground, -2.0, 2.0);
                const double expected =
                    clip_hull_lift(cover, pose, soup_around(ground, pose, radius));
                ASSERT_NEAR(compute_lift(hull, pose, ground).lift, expected, 1e-9);
            }
        }
    }
}

TEST(HullLift, OfANeedleIsThatOfClippedFaces) {
    SeededRandom random(kSeed);
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        for (const double reach : {6.0, 60.0, 600.0, 3e4}) {
            for (int i = 0; i < 3 * kFactor; ++i) {
                SCOPED_TRACE(testing::Message() << reach << " m, " << i);
                const Points points = transformed({{0.3, 0.0, 0.0},
                                                   {-0.2, 0.25, 0.0},
                                                   {-0.2, -0.2, 0.1},
                                                   {reach, random.between(-0.2, 0.2), 0.0}},
                                                  1.0, random.rotation(), {0.0, 0.0, 0.0});
                const Pose pose = random_pose(random, ground, -2.0, 2.0);
                const double expected =
                    clip_hull_lift(cover_hull(points), pose,
                                   soup_around(ground, pose, std::min(1.01 * reach, 130.0)));
                // Coordinates of 3e4 m are rounded by 4e-12 m; the needle's slope multiplies that.
                EXPECT_NEAR(compute_lift(make_hull(points), pose, ground).lift, expected, 1e-8);
            }
        }
    }
}

TEST(HullLift, IsThatOfTheBoxWhoseCornersItHas) {
    SeededRandom random(kSeed);
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        for (int i = 0; i < 100; ++i) {
            // Larger than a cell, some without thickness.
            const Box box{{random.between(0.0, 6.0), i % 5 == 0 ? 0.0 : random.between(0.0, 6.0),
                           i % 7 == 0 ? 0.0 : random.between(0.0, 3.0)}};
            const ConvexHull hull = make_hull(box_corners(box.half_extents));
            Pose pose = random_pose(random, ground, -3.0, 3.0);
            if (i % 3 == 0) pose.rotation.setIdentity();
            if (i % 6 == 0) pose.translation = pose.translation.array().round().matrix();
            const double lift = compute_lift(box, pose, ground).lift;
            EXPECT_NEAR(compute_lift(hull, pose, ground).lift, lift, 1e-9);
            EXPECT_EQ(test_contact(hull, pose, ground).is_touching,
                      test_contact(box, pose, ground).is_touching);
            EXPECT_NEAR(pseudodistance(hull, pose, ground).pseudodistance, -lift, 1e-9);
        }
    }
}

TEST(HullLift, OfTenThousandPointsIsBoundedByVerticesAndSphere) {
    SeededRandom random(kSeed);
    const Points points =
        transformed(sphere(random, 10'000), 0.8, Eigen::Matrix3d::Identity(), {0.0, 0.5, -0.3});
    const ConvexHull hull = make_hull(points);
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        for (int i = 0; i < 10; ++i) {
            const Pose pose = random_pose(random, ground, -1.0, 2.0);
            double sampled = -kInfinity;
            for (const Eigen::Vector3d& p : hull.vertices()) {
                const Eigen::Vector3d placed = pose * p;
                sampled =
                    std::max(sampled, ground.height(placed.x(), placed.y()).height - placed.z());
            }
            // Between the lift of the vertices and that of their circumscribed sphere.
            Pose centre = pose;
            centre.translation = pose * Eigen::Vector3d(0.0, 0.5, -0.3);
            const double lift = compute_lift(hull, pose, ground).lift;
            EXPECT_GE(lift, sampled - 1e-12);
            EXPECT_LE(lift, compute_lift(Sphere{0.8}, centre, ground).lift + 1e-12);
            EXPECT_GE(lift, compute_lift(Sphere{0.799}, centre, ground).lift);
        }
    }
}

TEST(HullLift, IsAccurateOnCliffs) {
    SeededRandom random(kSeed);
    TableGroundSettings settings{.quantum = 0x1p-10};
    const Ground ground =
        make_test_ground([](double x, double) { return x >= 64.0 ? 1e5 : 0.0; }, settings);
    for (const NamedHull& named : make_hulls(random)) {
        SCOPED_TRACE(named.name);
        const ConvexHull hull = make_hull(named.points);
        const std::vector<Points> cover = cover_hull(named.points);
        for (int i = 0; i < 40; ++i) {
            Pose pose = random_pose(random, ground, 0.0, 0.0);
            pose.translation.x() = random.between(60.0, 66.0);
            pose.translation.z() = random.between(-1.0, 1e5);
            const double expected = clip_hull_lift(cover, pose, soup_around(ground, pose, 3.0));
            // On the cliff a rounding error in x is amplified 1e5 times in z.
            EXPECT_NEAR(compute_lift(hull, pose, ground).lift, expected, 1e-8);
        }
    }
}

TEST(HullLift, IsThatOfTheBoxAtAnySizeAndFarFromTheBodysOrigin) {
    SeededRandom random(kSeed);
    const Ground ground = make_test_ground(hash_height, 1.0, 2);
    const Eigen::Vector3d shape(1.0, 0.6, 0.4);
    for (const double size : {1e-3, 1e-1, 10.0, 200.0, 1e4}) {
        for (const double off : {0.0, 9e4}) {
            SCOPED_TRACE(testing::Message() << size << " m, " << off << " m off");
            const Box box{size * shape};
            const Eigen::Vector3d offset(off, -off, off);
            const ConvexHull hull = make_hull(transformed(box_corners(box.half_extents), 1.0,
                                                          Eigen::Matrix3d::Identity(), offset));
            for (int i = 0; i < 20; ++i) {
                Pose pose = random_pose(random, ground, 0.0, 0.0);
                pose.translation.z() += compute_lift(box, pose, ground).lift;
                const Pose of_hull = moved(pose, -(pose.rotation * offset));
                // Coordinates of 1e5 m are rounded by 1e-11 m.
                EXPECT_NEAR(compute_lift(hull, of_hull, ground).lift, 0.0, 1e-9);
                EXPECT_NEAR(
                    signed_distance(hull, moved(of_hull, {0, 0, 0.5}), ground, 1.0).distance,
                    signed_distance(box, moved(pose, {0, 0, 0.5}), ground, 1.0).distance, 1e-9);
            }
        }
    }
}

}  // namespace terrane::hull_lift_test
