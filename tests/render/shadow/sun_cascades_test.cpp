// SPDX-License-Identifier: MIT
#include "light/shadow_maps.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace terrane::internal {
namespace sun_cascades_test {

constexpr int kTexels = 512;

struct Case {
    View view;
    Eigen::Vector3d sun;
    double distance = 0.0;
};

void turn(View& view, const Eigen::Vector3d& forward) {
    view.forward = forward;
    const Eigen::Vector3d side = std::abs(forward.z()) < 0.9 ? Eigen::Vector3d::UnitZ().eval()
                                                             : Eigen::Vector3d::UnitX().eval();
    view.up = (side - side.dot(forward) * forward).normalized();
}

std::vector<Case> random_cases(int count) {
    test::Random random(7);
    std::vector<Case> cases;
    for (int i = 0; i < count; ++i) {
        Case made;
        turn(made.view, random.direction());
        made.view.eye_world = 1e6 * random.direction();
        made.view.vertical_fov = random.between(0.1, 2.4);
        made.view.width_px = 100 + i % 7 * 200;
        made.sun = random.direction();
        made.sun.z() = std::abs(made.sun.z()) + 0.01;
        made.distance = std::exp2(random.between(0.0, 14.0));
        cases.push_back(made);
    }
    return cases;
}

TEST(SunCascades, HoldEveryPointThatTheViewShowsWithinTheirReach) {
    test::Random random(11);
    for (const Case& each : random_cases(200)) {
        const auto cascades = make_sun_cascades(each.view, each.sun, each.distance, kTexels);
        EXPECT_DOUBLE_EQ(cascades.back().reach, each.distance);
        const double half_height = std::tan(0.5 * each.view.vertical_fov);
        const double half_width = half_height * each.view.width_px / each.view.height_px;
        for (const SunCascade& cascade : cascades) {
            // two texels are left for the filter
            const double limit = cascade.half_side * (1.0 - 4.0 / kTexels);
            for (int i = 0; i < 50; ++i) {
                // corners of the picture too
                const double u = i < 4 ? 2.0 * (i & 1) - 1.0 : random.between(-1.0, 1.0);
                const double v = i < 4 ? (i & 2) - 1.0 : random.between(-1.0, 1.0);
                const Eigen::Vector3d ray = each.view.forward + u * half_width * each.view.right() +
                                            v * half_height * each.view.up;
                const double distance =
                    cascade.reach * (i % 3 == 0 ? 1.0 : random.between(0.0, 1.0));
                const WorldPos p = each.view.eye_world + distance * ray.normalized();
                const Eigen::Vector3d from_centre = cascade.axes * p - cascade.centre;
                for (int axis = 0; axis < 3; ++axis)
                    ASSERT_LE(std::abs(from_centre[axis]), limit) << axis;
            }
        }
    }
}

TEST(SunCascades, MoveByWholeTexelsAndKeepTheirSideWhereverTheEyeLooks) {
    test::Random random(13);
    for (const Case& each : random_cases(50)) {
        const auto before = make_sun_cascades(each.view, each.sun, each.distance, kTexels);
        View moved = each.view;
        turn(moved, random.direction());
        moved.eye_world += each.distance * random.direction();
        const auto after = make_sun_cascades(moved, each.sun, each.distance, kTexels);
        for (std::size_t i = 0; i < kCascades; ++i) {
            EXPECT_EQ(before[i].half_side, after[i].half_side);
            EXPECT_EQ(before[i].axes, after[i].axes);
            const Eigen::Vector3d steps =
                (after[i].centre - before[i].centre) * (kTexels / (2.0 * before[i].half_side));
            for (int axis = 0; axis < 2; ++axis)
                EXPECT_NEAR(steps[axis], std::round(steps[axis]), 1e-5);
        }
    }
}

TEST(SunCascades, MeetWhatIsBetweenTheMapAndTheSunAndLeaveTheRest) {
    test::Random random(17);
    int left_out = 0;
    for (const Case& each : random_cases(300)) {
        const auto cascades = make_sun_cascades(each.view, each.sun, each.distance, kTexels);
        for (const SunCascade& cascade : cascades) {
            const double side = cascade.half_side;
            // a point above the map
            const Eigen::Vector3d along =
                cascade.centre + Eigen::Vector3d(side * random.between(-1.0, 1.0),
                                                 side * random.between(-1.0, 1.0),
                                                 side * random.between(-1.0, 50.0));
            const WorldPos p = cascade.axes.transpose() * along;
            const Eigen::Vector3d size = random.between(0.0, side) * Eigen::Vector3d(1.0, 1.0, 1.0);
            const Eigen::Vector3d margin = size + Eigen::Vector3d::Constant(1e-7 * p.norm());
            EXPECT_TRUE(cascade.meets(Aabb{p - margin, p + 2.0 * margin}));
            EXPECT_TRUE(cascade.meets(BoundingSphere{p, 1e-7 * p.norm()}));
            // beside the map, and behind it
            for (const Eigen::Vector3d& away :
                 {Eigen::Vector3d(2.0, 0.0, 0.0), Eigen::Vector3d(0.0, -2.0, 3.0),
                  Eigen::Vector3d(0.0, 0.0, -2.0)}) {
                const WorldPos q = cascade.axes.transpose() * (cascade.centre + 1.01 * side * away);
                EXPECT_FALSE(cascade.meets(BoundingSphere{q, side}));
                const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * side);
                left_out += cascade.meets(Aabb{q - half, q + half}) ? 0 : 1;
            }
        }
    }
    // a box of half the map's side reaches at most 0.87 of it
    EXPECT_EQ(left_out, 300 * 9);
}

TEST(SunCascades, TheirMatrixPutsTheSunsSideNearest) {
    for (const Case& each : random_cases(50)) {
        const auto cascades = make_sun_cascades(each.view, each.sun, each.distance, kTexels);
        for (const SunCascade& cascade : cascades) {
            const auto clip = cascade.clip_from_eye(each.view.eye_world);
            const auto to_clip = [&](const Eigen::Vector3d& from_centre) {
                const Eigen::Vector3d p_eye =
                    cascade.axes.transpose() *
                    (cascade.centre_from(each.view.eye_world) + cascade.half_side * from_centre);
                Eigen::Vector3d clipped;
                for (std::size_t row = 0; row < 3; ++row) {
                    clipped[static_cast<int>(row)] =
                        static_cast<double>(clip[row]) * p_eye.x() +
                        static_cast<double>(clip[row + 4]) * p_eye.y() +
                        static_cast<double>(clip[row + 8]) * p_eye.z() +
                        static_cast<double>(clip[row + 12]);
                }
                return clipped;
            };
            EXPECT_LT((to_clip({0.0, 0.0, 1.0}) - Eigen::Vector3d(0.0, 0.0, 1.0)).norm(), 1e-5);
            EXPECT_LT((to_clip({1.0, -1.0, -1.0}) - Eigen::Vector3d(1.0, -1.0, 0.0)).norm(), 1e-5);
        }
    }
}

}  // namespace sun_cascades_test
}  // namespace terrane::internal
