// SPDX-License-Identifier: MIT
// The work of a search for the minimum translation is limited, however many columns a shape overlaps.
#include "ground/depth/min_translation.h"
#include "hull_cases.h"

#include <gtest/gtest.h>

#include <limits>

namespace terrane {
namespace depth_limit_test {

using namespace test;
using internal::find_lift;
using internal::find_min_translation;
using internal::MinTranslation;
using internal::SearchLimits;

constexpr std::uint64_t kSeed = 20261128;

struct Searched {
    MinTranslation found;
    std::int64_t columns;      // tested
    std::int64_t of_one_lift;  // of these
    double lift_after;
};

Searched search(const Shape& shape, const Pose& pose, const Ground& ground,
                const SearchLimits& limits) {
    const internal::LocalQuery query(shape, pose, ground);
    const double lift = query.lift().lift;
    const std::int64_t of_one_lift = query.ground.columns_tested();
    const MinTranslation found = find_min_translation(query.ground, query.body, lift, limits);
    const std::int64_t columns = query.ground.columns_tested() - of_one_lift;
    return {found, columns, of_one_lift, find_lift(query.ground, query.body, found.d).lift};
}

// A hull from (0, 0, 0) to a corner far away.
ConvexHull make_needle(const Eigen::Vector3d& tip) {
    return make_hull({{-0.9, -0.6, -0.3}, {1.2, -0.7, -0.4}, {-0.5, 0.1, 0.9}, tip});
}

TEST(DepthLimit, HoldsForLargeShapesOverRoughGround) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const Ground ground = make_test_ground(hash_height, 1.0, 1);
    Points ball;
    for (const Eigen::Vector3d& p : sphere(random, 20)) ball.push_back(30.0 * p);
    int limited = 0;
    for (const auto& [name, shape] : std::initializer_list<std::pair<const char*, Shape>>{
             {"needle down", make_needle({-8e3, 2.4e4, -1.5e4})},
             {"needle along", make_needle({3e4, 1e4, 0.0})},
             {"ball", make_hull(ball)},
             {"box", Box{{30.0, 25.0, 20.0}}},
             {"capsule", Capsule{20.0, 15.0}}}) {
        for (int i = 0; i < 3; ++i) {
            SCOPED_TRACE(testing::Message() << name << ' ' << i);
            Pose pose;
            pose.rotation = random.rotation();
            pose.translation = {random.between(20.0, 100.0), random.between(20.0, 100.0), 0.0};
            const double depth = random.between(0.1, 40.0);
            pose.translation.z() += compute_lift(shape, pose, ground).lift - depth;
            const SearchLimits limits{.most_columns = 1 << 12};
            const Searched searched = search(shape, pose, ground, limits);
            // The first translation and the search have the limit each. Each ends at a lift after it, and the search
            // makes some for its first triangles.
            EXPECT_LE(searched.columns, 2 * limits.most_columns + 24 * searched.of_one_lift);
            EXPECT_LE(searched.lift_after, 1e-9);
            EXPECT_GE(searched.found.lower_bound, 0.0);
            EXPECT_LE(searched.found.lower_bound, searched.found.d.norm());

            const Searched unlimited = search(
                shape, pose, ground, {.most_columns = std::numeric_limits<std::int32_t>::max()});
            EXPECT_LE(unlimited.found.d.norm(), searched.found.d.norm() * (1.0 + 1e-12));
            EXPECT_GE(unlimited.found.d.norm(), searched.found.lower_bound);
            if (unlimited.columns > 4 * searched.columns) ++limited;
        }
    }
    EXPECT_GE(limited, 5);
}

}  // namespace depth_limit_test
}  // namespace terrane
