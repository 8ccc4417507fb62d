// SPDX-License-Identifier: MIT
// The work of a search for the minimum translation is limited, however many cells a shape overlaps, where nothing is
// promised of its length.
#include "ground/heightfield/min_translation.h"
#include "hull_cases.h"

#include <gtest/gtest.h>

#include <algorithm>
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
    std::int64_t cells;        // tested
    std::int64_t of_one_lift;  // of the lift before
    double lift_after;
};

Searched search(const Shape& shape, const Pose& pose, const Ground& ground,
                const SearchLimits& limits) {
    const internal::LocalQuery query(shape, pose, ground);
    const double lift = query.lift().lift;
    const std::int64_t of_one_lift = query.ground.cells_tested();
    const MinTranslation found = find_min_translation(query.ground, query.body, lift, limits);
    const std::int64_t cells = query.ground.cells_tested() - of_one_lift;
    return {found, cells, of_one_lift, find_lift(query.ground, query.body, found.d).lift};
}

// A hull from (0, 0, 0) to a corner far away.
ConvexHull make_needle(const Eigen::Vector3d& tip) {
    return make_hull({{-0.9, -0.6, -0.3}, {1.2, -0.7, -0.4}, {-0.5, 0.1, 0.9}, tip});
}

TEST(DepthLimit, HoldsForLargeShapesThatAreDeeperThanTheyAreThick) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const Ground ground = make_test_ground(hash_height, 1.0, 1);
    const Points disc = stretched(sphere(random, 20), {30.0, 30.0, 1.0});
    int limited = 0;
    for (const auto& [name, shape] : std::initializer_list<std::pair<const char*, Shape>>{
             {"needle down", make_needle({-8e3, 2.4e4, -1.5e4})},
             {"needle along", make_needle({3e4, 1e4, 0.0})},
             {"disc", make_hull(disc)},
             {"plate", Box{{30.0, 25.0, 1.0}}},
             {"rod", Capsule{1.0, 30.0}}}) {
        for (int i = 0; i < 3; ++i) {
            SCOPED_TRACE(testing::Message() << name << ' ' << i);
            Pose pose;
            pose.rotation = random.rotation();
            pose.translation = {random.between(20.0, 100.0), random.between(20.0, 100.0), 0.0};
            const double depth = random.between(3.0, 40.0);
            pose.translation.z() += compute_lift(shape, pose, ground).lift - depth;
            const SearchLimits limits{.most_cells = 1 << 11};
            const Searched searched = search(shape, pose, ground, limits);
            // The first translation, the first triangles of the search, and shortening what it finds last, have no
            // limit.
            const std::int64_t first = search(shape, pose, ground, {.most_splits = 0}).cells;
            EXPECT_LE(searched.cells, 2 * first + limits.most_cells + 24 * searched.of_one_lift);
            EXPECT_GT(searched.found.d.norm(), 2.0 * smallest_half_extent(shape));
            EXPECT_LE(searched.lift_after, 1e-9);
            EXPECT_GE(searched.found.lower_bound, 0.0);
            EXPECT_LE(searched.found.lower_bound, searched.found.d.norm());

            const Searched unlimited = search(
                shape, pose, ground, {.most_cells = std::numeric_limits<std::int32_t>::max()});
            EXPECT_LE(unlimited.found.d.norm(), searched.found.d.norm() * (1.0 + 1e-12));
            EXPECT_GE(unlimited.found.d.norm(), searched.found.lower_bound);
            if (unlimited.cells > 4 * searched.cells) ++limited;
        }
    }
    EXPECT_GE(limited, 5);
}

// Up to half its smallest extent the minimum is promised for any shape.
TEST(DepthLimit, DoesNotHoldUpToHalfTheSmallestExtent) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 1);
    Random random(kSeed + 1);
    TableGroundSettings settings;
    settings.roots = 4;
    const Ground ground = make_test_ground(hash_height, settings);
    const Points ball = stretched(sphere(random, 20), {100.0, 100.0, 100.0});
    std::int64_t most_cells = 0;
    for (const auto& [name, shape] :
         std::initializer_list<std::pair<const char*, Shape>>{{"sphere", Sphere{100.0}},
                                                              {"capsule", Capsule{50.0, 50.0}},
                                                              {"box", Box{{100.0, 80.0, 60.0}}},
                                                              {"ball", make_hull(ball)}}) {
        for (int i = 0; i < 4; ++i) {
            SCOPED_TRACE(testing::Message() << name << ' ' << i);
            Pose pose;
            pose.rotation = random.rotation();
            pose.translation = {random.between(150.0, 350.0), random.between(150.0, 350.0), 0.0};
            const double depth = random.between(0.0, 1.0) * smallest_half_extent(shape);
            pose.translation.z() += compute_lift(shape, pose, ground).lift - depth;
            const Searched searched = search(shape, pose, ground, {});
            const double least = searched.found.d.norm() * (1.0 - 1e-6) - 1e-9;
            EXPECT_GE(searched.found.lower_bound, least);
            most_cells = std::max(most_cells, searched.cells);
        }
    }
    EXPECT_GT(most_cells, SearchLimits{}.most_cells);
}

}  // namespace depth_limit_test
}  // namespace terrane
