// SPDX-License-Identifier: MIT
//
// Overlaps of any depth: no shorter translation separates, and the certified lower bound holds.
#include "law_cases.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <tuple>
#include <vector>

namespace terrane::depth_laws_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261123;

// Lower limit that signed_distance() promises for the true minimum at a reported depth.
double least_of(double depth) { return depth * (1.0 - 1e-6) - 1e-9; }

// Two of three cases over noise, which has the widest spread of normals; the rest over all scenes.
const LawScene& noisy_scene(long i) { return i % 3 == 0 ? scene_of(i / 3) : scene_named("rough"); }

// Checks that hold at every depth. Returns the shortest separating translation that a random search finds.
double check_answer(const LawScene& scene, const LawShape& shape, const Pose& pose,
                    const DistanceAnswer& answer, Random& random) {
    const double depth = -answer.distance;
    EXPECT_EQ(answer.status, QueryStatus::ok);
    EXPECT_GE(answer.distance_lower_bound, 0.0);
    EXPECT_LE(answer.distance_lower_bound, depth);
    EXPECT_FALSE(is_deeper<long double>(
        scene.soup, shape.oracle, pose,
        static_cast<long double>(depth) * answer.normal.cast<long double>(), 1e-9L));
    const double found = sampled_depth(scene.soup, shape.oracle, pose, depth, {}, random);
    EXPECT_GE(found, answer.distance_lower_bound - 1e-9);
    return found;
}

bool expect_shortest(const LawScene& scene, const LawShape& shape, const Pose& pose,
                     Random& random) {
    SCOPED_TRACE(describe(scene, shape, pose));
    const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 1.0);
    const double depth = -answer.distance;
    if (!(depth > 0.0)) return false;
    EXPECT_GE(check_answer(scene, shape, pose, answer, random), least_of(depth));
    EXPECT_GE(answer.distance_lower_bound, least_of(depth));
    return true;
}

TEST(LawsOfDepth, UpToHalfTheSmallestExtentNoShorterTranslationSeparates) {
    SeededRandom random(kSeed);
    const long count = count_of_cases(12, 20'000);
    for (const LawShape& shape : law_shapes()) {
        long checked = 0;
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = noisy_scene(i);
            const Pose pose =
                random_pose(random, scene, shape, law_scale(shape) * random.between(0.0, 1.6));
            const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 1.0);
            if (-answer.distance > law_scale(shape)) continue;
            checked += expect_shortest(scene, shape, pose, random);
        }
        EXPECT_GT(checked, count / 3) << shape.name;
    }
}

TEST(LawsOfDepth, WithTheCoreAboveTheGroundNoShorterTranslationSeparates) {
    SeededRandom random(kSeed + 1);
    const long count = count_of_cases(9, 20'000);
    for (const auto& [name, shape, core] :
         std::initializer_list<std::tuple<const char*, Shape, Shape>>{
             {"sphere", Sphere{1.0}, Sphere{0.0}},
             {"large sphere", Sphere{3.0}, Sphere{0.0}},
             {"capsule", Capsule{0.4, 0.8}, Capsule{0.0, 0.8}},
             {"thick capsule", Capsule{2.0, 1.5}, Capsule{0.0, 1.5}}}) {
        const LawShape round{name, shape, make_oracle(shape)};
        const LawShape inside{name, core, make_oracle(core)};
        long checked = 0;
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = noisy_scene(i);
            // The core is less than a radius above the ground.
            const Pose pose = random_pose(random, scene, inside,
                                          -smallest_half_extent(shape) * random.between(0.01, 1.0));
            checked += expect_shortest(scene, round, pose, random);
        }
        EXPECT_GT(checked, count / 20) << name;
    }
}

TEST(LawsOfDepth, DeepOverlapsHaveABoundThatHoldsAndIsTight) {
    SeededRandom random(kSeed + 2);
    const long count = count_of_cases(9, 10'000);
    std::printf(
        "distance_lower_bound over depth    cases   median     1 %%     least  shorter found\n");
    for (const LawShape& shape : law_shapes()) {
        // Depths in units of half the smallest extent.
        for (const auto& [from, to] : {std::pair(1.0, 3.0), std::pair(3.0, 10.0)}) {
            std::vector<double> ratios;
            long shorter = 0;
            for (long i = 0; i < count; ++i) {
                const LawScene& scene = noisy_scene(i);
                const Pose pose =
                    random_pose(random, scene, shape, law_scale(shape) * random.between(from, to));
                SCOPED_TRACE(describe(scene, shape, pose));
                const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 1.0);
                const double depth = -answer.distance;
                ASSERT_GT(depth, 0.0);
                shorter += check_answer(scene, shape, pose, answer, random) < least_of(depth);
                ratios.push_back(answer.distance_lower_bound / depth);
            }
            std::sort(ratios.begin(), ratios.end());
            std::printf("%-12s lift %4.1f to %4.1f  %8zu %8.6f %8.6f %8.6f  %ld\n",
                        shape.name.c_str(), from, to, ratios.size(), ratios[ratios.size() / 2],
                        ratios[ratios.size() / 100], ratios[0], shorter);
            EXPECT_GT(ratios[ratios.size() / 2], 1.0 - 1e-6) << shape.name;
        }
    }
}

}  // namespace terrane::depth_laws_test

// Depths with closed forms.

namespace terrane::depth_extremes_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261124;

// Expects this depth and a lower bound equal to it.
void expect_depth(const Shape& shape, const Pose& pose, const Ground& ground, double depth) {
    const DistanceAnswer answer = signed_distance(shape, pose, ground, 1.0);
    ASSERT_EQ(answer.status, QueryStatus::ok);
    const double tolerance = 1e-6 * depth + 1e-9;
    EXPECT_NEAR(-answer.distance, depth, tolerance);
    EXPECT_NEAR(answer.distance_lower_bound, depth, tolerance);
    EXPECT_LE(answer.distance_lower_bound, -answer.distance);
}

TEST(ShortestTranslation, OverFlatGroundIsStraightUpAtAnyDepth) {
    const LawScene flat = make_scene(
        "flat", [](double, double) { return 2.0; }, TableGroundSettings{});
    for (const double depth : {1e-9, 1e-6, 1e-3, 0.3, 1.0, 7.0, 40.0}) {
        expect_depth(Sphere{0.5}, pose_at(64.3, 64.2, 2.5 - depth), flat.ground, depth);
        expect_depth(Capsule{0.4, 0.8}, pose_at(64.3, 64.2, 3.2 - depth), flat.ground, depth);
        expect_depth(Box{{1.0, 1.5, 0.5}}, pose_at(64.0, 64.0, 2.5 - depth), flat.ground, depth);
    }
}

TEST(ShortestTranslation, OverARampIsAlongItsNormal) {
    const LawScene ramp = make_scene(
        "ramp", [](double x, double) { return 0.75 * x; }, TableGroundSettings{});
    const double up = 1.25;  // vertical distance over distance along the normal
    for (const double depth : {1e-6, 1e-3, 0.3, 2.0, 15.0}) {
        expect_depth(Sphere{0.5}, pose_at(64.3, 64.2, 0.75 * 64.3 + up * (0.5 - depth)),
                     ramp.ground, depth);
        // A box that touches with one bottom edge, which is level along y.
        const double reach = 0.6 * 1.0 + 0.8 * 0.5;
        expect_depth(Box{{1.0, 1.5, 0.5}}, pose_at(64.3, 64.2, 0.75 * 64.3 + up * (reach - depth)),
                     ramp.ground, depth);
    }
}

TEST(ShortestTranslation, InAPitIsNotLongerThanRandomSearchFinds) {
    // One vertex at -4 m: a funnel one cell wide on each side.
    const LawScene pit = make_scene(
        "pit", [](double x, double y) { return x == 64.0 && y == 64.0 ? -4.0 : 0.0; },
        TableGroundSettings{});
    Random random(kSeed);
    long overlapping = 0;
    for (const double z : {0.9, 0.5, 0.0, -0.5, -2.0}) {
        for (const char* name : {"sphere", "capsule", "box", "hull", "compound"}) {
            const LawShape& shape = shape_named(name);
            const Pose pose = pose_at(64.1, 63.95, z);
            const DistanceAnswer answer = signed_distance(shape.shape, pose, pit.ground, 1.0);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            const double depth = -answer.distance;
            if (depth <= 0.0) continue;
            ++overlapping;
            const double found = sampled_depth(pit.soup, shape.oracle, pose, depth, {}, random);
            EXPECT_GE(found, depth * (1.0 - 1e-6) - 1e-9) << name << " at " << z;
            EXPECT_GE(answer.distance_lower_bound, depth * (1.0 - 1e-6) - 1e-9)
                << name << " at " << z;
        }
    }
    EXPECT_GT(overlapping, 3);
}

TEST(ShortestTranslation, OverCellsOfACentimetreIsExactForALargeShape) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    TableGroundSettings settings{.spacing = 0.01, .roots = 4};
    const LawScene fine = make_scene(
        "fine noise",
        [](double x, double y) {
            Random hash(static_cast<std::uint64_t>(std::lround(100.0 * x)) * 0x10001u +
                        static_cast<std::uint64_t>(std::lround(100.0 * y)));
            return 0.05 * hash.between(0.0, 1.0);
        },
        settings);
    Random random(kSeed);
    for (const Shape& kind :
         std::initializer_list<Shape>{Sphere{0.4}, Box{{0.3, 0.4, 0.2}}, Capsule{0.3, 0.2}}) {
        const LawShape shape{"large", kind, make_oracle(kind)};
        for (const double share : {0.02, 0.4, 1.0}) {
            Pose pose = pose_at(2.56, 2.561, 0.0);
            pose.rotation = random.rotation();
            pose.translation.z() = brute_lift<double>(fine.soup, shape.oracle, pose) -
                                   share * smallest_half_extent(kind);
            SCOPED_TRACE(describe(fine, shape, pose));
            const DistanceAnswer answer = signed_distance(kind, pose, fine.ground, 1.0);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            const double depth = -answer.distance;
            const double least = depth * (1.0 - 1e-6) - 1e-9;
            EXPECT_GE(answer.distance_lower_bound, least);
            const SampledDepthSettings few{.samples = 20, .starts = 1, .refinements = 10};
            EXPECT_GE(sampled_depth(fine.soup, shape.oracle, pose, depth, few, random), least);
        }
    }
}

// The sides of the ground do not block: the minimum translation may be horizontal.
TEST(ShortestTranslation, AtTheBorderOfTheGroundIsOutOverTheBorder) {
    const LawScene flat = make_scene(
        "flat", [](double, double) { return 0.0; }, TableGroundSettings{});
    const double west = flat.ground.extent().west;
    expect_depth(Sphere{0.5}, pose_at(west + 0.2, 64.2, -20.0), flat.ground, 0.7);
    expect_depth(Sphere{2.0}, pose_at(west + 3.25, 64.2, -20.0), flat.ground, 5.25);
    expect_depth(Capsule{0.4, 0.8}, pose_at(west + 0.2, 64.2, -20.0), flat.ground, 0.6);
    expect_depth(Box{{1.0, 1.5, 0.5}}, pose_at(west + 0.3, 64.2, -20.0), flat.ground, 1.3);
    // In a corner: out over the nearer side.
    const double south = flat.ground.extent().south;
    expect_depth(Sphere{0.5}, pose_at(west + 0.4, south + 0.1, -20.0), flat.ground, 0.6);
    // Near the surface the upward translation is shorter.
    expect_depth(Sphere{0.5}, pose_at(west + 0.2, 64.2, 0.1), flat.ground, 0.4);
}

TEST(ShortestTranslation, AtTheRimOfAHoleIsIntoTheHole) {
    TableGroundSettings settings{.is_outside = [](double x, double y) {
        return x > 60.0 && x < 70.0 && y > 60.0 && y < 70.0;
    }};
    const LawScene holed = make_scene(
        "holed", [](double, double) { return 0.0; }, settings);
    const LawScene narrow = [&] {
        settings.is_outside = [](double x, double y) {
            return x > 64.0 && x < 65.0 && y > 64.0 && y < 65.0;
        };
        return make_scene(
            "narrow hole", [](double, double) { return 0.0; }, settings);
    }();
    expect_depth(Sphere{0.5}, pose_at(59.8, 64.2, -20.0), holed.ground, 0.7);
    expect_depth(Box{{1.0, 1.5, 0.5}}, pose_at(59.8, 64.2, -20.0), holed.ground, 1.2);
    // A sphere that fits sinks into a hole of one cell; a larger one rests on its four sides.
    expect_depth(Sphere{0.25}, pose_at(63.9, 64.5, -20.0), narrow.ground, 0.35);
    expect_depth(Sphere{0.75}, pose_at(64.5, 64.5, -3.0), narrow.ground,
                 3.0 + std::sqrt(0.75 * 0.75 - 0.5 * 0.5));
}

TEST(ShortestTranslation, IntoGroundThatIsNotLoadedIsNotResident) {
    TableGroundSettings settings{.roots = 2,
                                 .is_resident = [](int column, int) { return column == 0; }};
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, settings);
    const double seam = ground.extent().west + 128.0;
    const DistanceAnswer deep =
        signed_distance(Sphere{0.25}, pose_at(seam - 0.5, 64.0, -20.0), ground, 1.0);
    EXPECT_EQ(deep.status, QueryStatus::not_resident);
    const DistanceAnswer far =
        signed_distance(Sphere{0.25}, pose_at(seam - 40.0, 64.0, -20.0), ground, 1.0);
    EXPECT_EQ(far.status, QueryStatus::ok);
    EXPECT_NEAR(far.distance, -20.25, 1e-6);
}

// Their lower bound is loose because it comes from single columns.
TEST(ShortestTranslation, OfShapesWithoutVolumeIsThatOfTheirLowestPoint) {
    const LawScene ramp = make_scene(
        "ramp", [](double x, double) { return 0.75 * x; }, TableGroundSettings{});
    for (const auto& [shape, below] : std::initializer_list<std::pair<Shape, double>>{
             {Sphere{0.0}, 1.0}, {Capsule{0.0, 0.5}, 0.5}, {make_hull({{0, 0, 0}}), 1.0}}) {
        const DistanceAnswer answer =
            signed_distance(shape, pose_at(64.3, 64.2, 0.75 * 64.3 - below), ramp.ground, 1.0);
        ASSERT_EQ(answer.status, QueryStatus::ok);
        EXPECT_NEAR(answer.distance, -0.8, 1e-9);
        EXPECT_GE(answer.distance_lower_bound, 0.0);
        EXPECT_LE(answer.distance_lower_bound, 0.8 + 1e-9);
    }
}

}  // namespace terrane::depth_extremes_test

// Gaps and overlap depths against brute force.

namespace terrane::distance_laws_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260303;

TEST(LawsOfDistance, ApartIsTheDistanceToTheNearestTriangle) {
    SeededRandom random(kSeed);
    const long count = count_of_cases(200, 250'000);
    for (const LawShape& shape : law_shapes()) {
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            const Pose pose = random_pose(random, scene, shape, random.between(-1.5, 0.0));
            SCOPED_TRACE(describe(scene, shape, pose));
            const auto gap =
                static_cast<double>(brute_gap<long double>(scene.soup, shape.oracle, pose, 2.0L));
            const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 2.0);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            ASSERT_TRUE(answer.has_ground);
            ASSERT_NEAR(answer.distance, gap, 1e-9);
            // The closest point of the ground is on the surface.
            const Eigen::Vector3d on_ground = answer.point_world - answer.distance * answer.normal;
            const LawShape point{"point", Sphere{0.0}, make_oracle(Sphere{0.0})};
            Pose at{.translation = on_ground};
            ASSERT_NEAR(
                static_cast<double>(brute_gap<long double>(scene.soup, point.oracle, at, 1.0L)),
                0.0, 1e-9);
            ASSERT_NEAR(answer.normal.norm(), 1.0, 1e-12);
        }
    }
}

TEST(LawsOfDistance, GrowsUpwardsAndNoFasterThanTheDisplacement) {
    SeededRandom random(kSeed + 1);
    const long count = count_of_cases(150, 30'000);
    for (const LawShape& shape : law_shapes()) {
        long compared = 0;
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            const double deepest = shallow_depth(shape);
            const Pose pose = random_pose(random, scene, shape, random.between(-0.5, deepest));
            SCOPED_TRACE(describe(scene, shape, pose));
            const DistanceAnswer start = signed_distance(shape.shape, pose, scene.ground, 2.0);
            if (start.distance < -deepest) continue;
            // Another part of rough ground may come nearer while the shape moves along its normal: only the rate is
            // bounded.
            for (const Eigen::Vector3d& direction :
                 {start.normal, Eigen::Vector3d(0.0, 0.0, 1.0)}) {
                double last = start.distance;
                for (int k = 1; k <= 8; ++k) {
                    const double now =
                        signed_distance(shape.shape, moved(pose, 0.03 * k * direction),
                                        scene.ground, 4.0)
                            .distance;
                    if (now < -deepest) break;
                    ++compared;
                    if (direction.z() == 1.0) {
                        ASSERT_GE(now, last - 1e-9) << k;
                    }
                    if (last >= 0.0 && now >= 0.0) {
                        ASSERT_LE(std::abs(now - last), 0.03 + 1e-9) << k;
                    }
                    last = now;
                }
            }
        }
        EXPECT_GT(compared, count) << shape.name;
    }
}

TEST(LawsOfDepth, ShallowSeparatesAndIsTheMinimumTranslation) {
    SeededRandom random(kSeed + 4);
    const long count = count_of_cases(33, 100'000);
    for (const LawShape& shape : law_shapes()) {
        long shallow = 0;
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            const double lift = shallow_depth(shape) * random.between(0.0, 1.3);
            const Pose pose = random_pose(random, scene, shape, lift);
            SCOPED_TRACE(describe(scene, shape, pose));
            const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 1.0);
            const double depth = -answer.distance;
            if (depth > shallow_depth(shape)) continue;
            ++shallow;
            const auto size = static_cast<long double>(depth);
            EXPECT_FALSE(is_deeper<long double>(scene.soup, shape.oracle, pose,
                                                size * answer.normal.cast<long double>(), 1e-9L));
            const long double least = brute_depth(scene.soup, shape.oracle, pose, size + 1e-9L);
            EXPECT_NEAR(depth, static_cast<double>(least), 1e-9);
        }
        EXPECT_GT(shallow, count / 4) << shape.name;
    }
}

TEST(LawsOfDepth, DeepSeparatesAndNoRandomDirectionIsMuchShorter) {
    SeededRandom random(kSeed + 3);
    const long count = count_of_cases(2, 2'000);
    long turn = 0;
    for (const LawShape& shape : law_shapes()) {
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(turn++);
            const double lift = law_scale(shape) * random.between(0.5, 8.0);
            const Pose pose = random_pose(random, scene, shape, lift);
            SCOPED_TRACE(describe(scene, shape, pose));
            const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 1.0);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            const double depth = -answer.distance;
            ASSERT_GT(depth, 0.0);
            EXPECT_FALSE(is_deeper<long double>(
                scene.soup, shape.oracle, pose,
                static_cast<long double>(depth) * answer.normal.cast<long double>(), 1e-9L));
            bool is_shorter_found = false;
            for (int k = 0; k < 10'000 && !is_shorter_found; ++k) {
                const Eigen::Vector3d d = 0.8 * depth * random.direction();
                is_shorter_found = !is_deeper<double>(scene.soup, shape.oracle, pose, d, 1e-9);
            }
            EXPECT_FALSE(is_shorter_found) << "by 0.8 of " << depth;
        }
    }
}

}  // namespace terrane::distance_laws_test
