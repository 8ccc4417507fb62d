// SPDX-License-Identifier: MIT
//
// Depth and time of contact over planes against closed forms in long double, within the bounds that docs/numerics.md
// derives.
#include "collision/ground/ground_cases.h"
#include "ground/heightfield/min_translation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

namespace terrane::exact_plane_test {

using namespace test;
using Long = long double;
using LongVec = Eigen::Matrix<Long, 3, 1>;
using LongMat = Eigen::Matrix<Long, 3, 3>;

static_assert(std::numeric_limits<Long>::digits >= 64, "the oracle needs 11 bits more than double");

constexpr std::uint64_t kSeed = 20261129;
constexpr Long kUnit = 0x1p-53L;  // unit roundoff u of double
constexpr Long kRounding = 40;    // rounding errors of the largest length, see docs/numerics.md

// A plane through the south-western corner of a ground of 128 cells of 1 m.
struct Plane {
    double at;  // x and y of the corner
    double slope_x, slope_y;
    Ground ground;
    LongVec normal;

    Plane(double corner, double x_slope, double y_slope)
        : at(corner),
          slope_x(x_slope),
          slope_y(y_slope),
          ground(make(corner, x_slope, y_slope)),
          normal(LongVec(-Long{x_slope}, -Long{y_slope}, 1).normalized()) {}

    static Ground make(double corner, double x_slope, double y_slope) {
        TableGroundSettings settings{.first_root = static_cast<std::int32_t>(corner / 128.0)};
        return make_test_ground(
            [=](double x, double y) { return x_slope * (x - corner) + y_slope * (y - corner); },
            settings);
    }
    Long above(const LongVec& p) const { return normal.dot(p - LongVec(at, at, 0)); }
};

std::vector<Plane> planes() {
    std::vector<Plane> made;
    for (const double at : {0.0, 128.0 * 7812, 1e9}) {
        for (const auto& [x, y] :
             {std::pair(0.0, 0.0), std::pair(0.25, -0.5), std::pair(-1000.25, 500.5)}) {
            made.emplace_back(at, x, y);
        }
    }
    return made;
}

// Support distance of a rotated shape opposite to a direction.
Long drop(const Shape& shape, const LongMat& rotation, const LongVec& n) {
    const LongVec m = rotation.transpose() * n;
    if (const auto* sphere = std::get_if<Sphere>(&shape)) return sphere->radius;
    if (const auto* capsule = std::get_if<Capsule>(&shape)) {
        return capsule->radius + capsule->half_height * std::abs(m.z());
    }
    return std::get<Box>(shape).half_extents.cast<Long>().dot(m.cwiseAbs());
}

LongMat turned(const LongVec& rotation_vector, const Eigen::Matrix3d& start) {
    const Long angle = rotation_vector.norm();
    if (angle == 0) return start.cast<Long>();
    const LongVec k = rotation_vector / angle;
    LongMat across;
    across << 0, -k.z(), k.y(), k.z(), 0, -k.x(), -k.y(), k.x(), 0;
    const LongMat turn =
        LongMat::Identity() + std::sin(angle) * across + (1 - std::cos(angle)) * across * across;
    return turn * start.cast<Long>();
}

Long gap_at(const Plane& plane, const Shape& shape, const Motion& motion, Long t) {
    const LongVec p = motion.start.translation.cast<Long>() + t * motion.translation.cast<Long>();
    const LongMat rotation = turned(t * motion.rotation_vector.cast<Long>(), motion.start.rotation);
    return plane.above(p) - drop(shape, rotation, plane.normal);
}

// A pose near the middle of the ground at a given gap from the plane.
Pose pose_with_gap(Random& random, const Plane& plane, const Shape& shape, double gap) {
    Pose pose{.rotation = random.rotation()};
    const double x = random.between(54.0, 74.0), y = random.between(54.0, 74.0);
    const Long over = drop(shape, pose.rotation.cast<Long>(), plane.normal) + Long{gap};
    pose.translation = {plane.at + x, plane.at + y,
                        static_cast<double>(Long{plane.slope_x} * x + Long{plane.slope_y} * y +
                                            over / plane.normal.z())};
    return pose;
}

// Length scale of a query: the shape, adjacent cells, and the motion.
Long length_of(const Shape& shape, const Motion& motion) {
    return bounding_radius(shape) * (1 + Long{motion.rotation_vector.norm()}) + 2 +
           motion.translation.norm();
}

TEST(ExactPlane, DepthIsWithinTheDerivedBound) {
    SeededRandom random(kSeed);
    Long worst = 0, worst_share = 0;
    for (const Plane& plane : planes()) {
        for (const Shape& shape : make_shapes()) {
            for (int i = 0; i < 300; ++i) {
                const double wanted = std::pow(10.0, random.between(-8.0, -1.0));
                Motion still{.start = pose_with_gap(random, plane, shape, -wanted)};
                const Long depth = -gap_at(plane, shape, still, 0);
                const DistanceAnswer answer =
                    signed_distance(shape, still.start, plane.ground, 1.0);
                const Long rounding = kRounding * kUnit * length_of(shape, still);
                // Lifts up to 1e-10 count as separated, and translations may be longer by as much.
                const Long bound = 1e-12L * depth + 2e-10L + rounding;
                const Long error = std::abs(-Long{answer.distance} - depth);
                ASSERT_LE(error, bound) << "depth " << wanted << ", case " << i;
                if (answer.distance < 0.0) {
                    ASSERT_LE(answer.distance_lower_bound, depth + rounding);
                }
                worst = std::max(worst, error);
                worst_share = std::max(worst_share, error / bound);
            }
        }
    }
    std::printf("depth: largest error %.2Lg m, %.3Lf of the bound\n", worst, worst_share);
    EXPECT_GT(worst_share, 1e-3L);
}

// A motion that meets the plane at about half its length near the middle of the ground.
Motion random_motion(Random& random, const Plane& plane, const Shape& shape, double spin) {
    Motion motion{
        .start = pose_with_gap(random, plane, shape, std::pow(10.0, random.between(-2.0, 1.0)))};
    const Long gap = gap_at(plane, shape, motion, 0);
    const Eigen::Vector3d n = plane.normal.cast<double>();
    const Eigen::Vector3d side = random.direction().cross(n);
    motion.translation =
        -static_cast<double>(gap) * random.between(1.1, 3.0) * n + random.between(0.0, 10.0) * side;
    motion.rotation_vector = spin * random.direction();
    return motion;
}

TEST(ExactPlane, TimeOfContactIsWithinTheDerivedBound) {
    SeededRandom random(kSeed + 1);
    for (const double tolerance : {1e-4, 1e-6}) {
        Long earliest = 0, latest = -1;
        for (const Plane& plane : planes()) {
            for (const Shape& shape : make_shapes()) {
                for (int i = 0; i < 100; ++i) {
                    const Motion motion = random_motion(random, plane, shape, 0.0);
                    const Long closing = -plane.normal.dot(motion.translation.cast<Long>());
                    const Long time = gap_at(plane, shape, motion, 0) / closing;
                    CastSettings settings{.tolerance = tolerance};
                    const CastAnswer answer = cast(shape, motion, plane.ground, settings);
                    ASSERT_TRUE(answer.hit);
                    const Long early = (time - Long{answer.fraction}) * closing;
                    const Long rounding = kRounding * kUnit * length_of(shape, motion);
                    ASSERT_LE(early, 0.25L * tolerance + rounding) << "case " << i;
                    ASSERT_GE(early, -rounding) << "case " << i;
                    earliest = std::max(earliest, early);
                    latest = std::max(latest, -early);
                }
            }
        }
        std::printf("tolerance %g m: %.3Lf to %.3Lf tolerances before the contact\n", tolerance,
                    -latest / tolerance, earliest / tolerance);
        EXPECT_GT(earliest, 0.01L * tolerance);
    }
}

TEST(ExactPlane, TurningShapesStopWithinTheDerivedBound) {
    SeededRandom random(kSeed + 2);
    const CastSettings settings;
    Long widest = 0;
    for (const Plane& plane : planes()) {
        for (const Shape& shape : make_shapes()) {
            long hits = 0;
            for (int i = 0; i < 60; ++i) {
                const Motion motion = random_motion(random, plane, shape, i % 2 == 0 ? 1.0 : 10.0);
                const CastAnswer answer = cast(shape, motion, plane.ground, settings);
                const Long rounding = kRounding * kUnit * length_of(shape, motion);
                for (int k = 0; k <= 100; ++k) {
                    const Long t = Long{answer.fraction} * k / 100;
                    ASSERT_GE(gap_at(plane, shape, motion, t), -rounding) << "case " << i;
                }
                if (!answer.hit) continue;
                ++hits;
                const Long gap = gap_at(plane, shape, motion, answer.fraction);
                ASSERT_LE(gap, 0.25L * settings.tolerance + rounding) << "case " << i;
                widest = std::max(widest, gap);
            }
            EXPECT_GT(hits, 3);
        }
    }
    std::printf("turning: gaps up to %.3Lf tolerances at the hit\n", widest / settings.tolerance);
    EXPECT_GT(widest, 0.01L * settings.tolerance);
}

}  // namespace terrane::exact_plane_test

// The search for the minimum translation does a bounded amount of work, however many cells a shape overlaps, wherever
// no accuracy is promised.

namespace terrane::depth_limit_test {

using namespace test;
using internal::find_lift;
using internal::find_min_translation;
using internal::MinTranslation;
using internal::SearchLimits;

constexpr std::uint64_t kSeed = 20261128;

struct Searched {
    MinTranslation found;
    std::int64_t cells;        // cells tested
    std::int64_t of_one_lift;  // cells tested by a single lift
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

// A hull with one corner at (0, 0, 0) and another one far away.
ConvexHull make_needle(const Eigen::Vector3d& tip) {
    return make_hull({{-0.9, -0.6, -0.3}, {1.2, -0.7, -0.4}, {-0.5, 0.1, 0.9}, tip});
}

TEST(DepthLimit, HoldsForLargeShapesThatAreDeeperThanTheyAreThick) {
    SeededRandom random(kSeed);
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
            Pose pose{random.rotation(),
                      {random.between(20.0, 100.0), random.between(20.0, 100.0), 0.0}};
            const double depth = random.between(3.0, 40.0);
            pose.translation.z() += compute_lift(shape, pose, ground).lift - depth;
            const SearchLimits limits{.most_cells = 1 << 11};
            const Searched searched = search(shape, pose, ground, limits);
            // The initial translation, the first triangles of the search and the final shortening are not limited.
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

// Up to half its smallest extent the minimum is promised for every shape.
TEST(DepthLimit, DoesNotHoldUpToHalfTheSmallestExtent) {
    SeededRandom random(kSeed + 1);
    const Ground ground = make_test_ground(hash_height, TableGroundSettings{.roots = 4});
    const Points ball = stretched(sphere(random, 20), {100.0, 100.0, 100.0});
    std::int64_t most_cells = 0;
    for (const auto& [name, shape] :
         std::initializer_list<std::pair<const char*, Shape>>{{"sphere", Sphere{100.0}},
                                                              {"capsule", Capsule{50.0, 50.0}},
                                                              {"box", Box{{100.0, 80.0, 60.0}}},
                                                              {"ball", make_hull(ball)}}) {
        for (int i = 0; i < 4; ++i) {
            SCOPED_TRACE(testing::Message() << name << ' ' << i);
            Pose pose{random.rotation(),
                      {random.between(150.0, 350.0), random.between(150.0, 350.0), 0.0}};
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

}  // namespace terrane::depth_limit_test
