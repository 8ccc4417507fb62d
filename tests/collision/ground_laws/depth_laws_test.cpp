// SPDX-License-Identifier: MIT
// Overlaps at any depth: no shorter translation separates, and the certified lower bound holds.
#include "collision/ground_laws/oracles/sampled_depth.h"
#include "law_cases.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <tuple>
#include <vector>

namespace terrane {
namespace depth_laws_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261123;

// Lower limit of the true minimum that signed_distance() promises for a depth.
double least_of(double depth) { return depth * (1.0 - 1e-6) - 1e-9; }

// Two cases of three over noise, which has the widest spread of normals; else over every scene.
const LawScene& noisy_scene(long i) { return i % 3 == 0 ? scene_of(i / 3) : scene_named("rough"); }

// Checks what holds at every depth. Returns the length of the shortest separating translation of a random search.
double check_answer(const LawScene& scene, const LawShape& shape, const Pose& pose,
                    const DistanceAnswer& answer, Random& random) {
    const double depth = -answer.distance;
    EXPECT_EQ(answer.status, QueryStatus::complete);
    EXPECT_GE(answer.distance_lower_bound, 0.0);
    EXPECT_LE(answer.distance_lower_bound, depth);
    EXPECT_FALSE(is_deeper<long double>(
        scene.soup, shape.oracle, pose,
        static_cast<long double>(depth) * answer.normal.cast<long double>(), 1e-9L));
    const double found = sampled_depth(scene.soup, shape.oracle, pose, depth, {}, random);
    EXPECT_GE(found, answer.distance_lower_bound - 1e-9);
    return found;
}

void expect_shortest(const LawScene& scene, const LawShape& shape, const Pose& pose,
                     Random& random) {
    SCOPED_TRACE(describe(scene, shape, pose));
    const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 1.0);
    const double depth = -answer.distance;
    if (!(depth > 0.0)) return;
    EXPECT_GE(check_answer(scene, shape, pose, answer, random), least_of(depth));
    EXPECT_GE(answer.distance_lower_bound, least_of(depth));
}

TEST(LawsOfDepth, UpToHalfTheSmallestExtentNoShorterTranslationSeparates) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const long count = count_of_cases(12, 20'000);
    for (const LawShape& shape : law_shapes()) {
        long checked = 0;
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = noisy_scene(i);
            const Pose pose =
                random_pose(random, scene, shape, law_scale(shape) * random.between(0.0, 1.6));
            const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 1.0);
            if (-answer.distance > law_scale(shape)) continue;
            expect_shortest(scene, shape, pose, random);
            ++checked;
        }
        EXPECT_GT(checked, count / 3) << shape.name;
    }
}

TEST(LawsOfDepth, WithTheCoreAboveTheGroundNoShorterTranslationSeparates) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 1);
    Random random(kSeed + 1);
    const long count = count_of_cases(9, 20'000);
    for (const auto& [name, shape, core] :
         std::initializer_list<std::tuple<const char*, Shape, Shape>>{
             {"sphere", Sphere{1.0}, Sphere{0.0}},
             {"large sphere", Sphere{3.0}, Sphere{0.0}},
             {"capsule", Capsule{0.4, 0.8}, Capsule{0.0, 0.8}},
             {"thick capsule", Capsule{2.0, 1.5}, Capsule{0.0, 1.5}}}) {
        const LawShape round{name, shape, make_oracle(shape)};
        const LawShape inside{name, core, make_oracle(core)};
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = noisy_scene(i);
            // The core is above the ground by less than the radius.
            const Pose pose = random_pose(random, scene, inside,
                                          -smallest_half_extent(shape) * random.between(0.01, 1.0));
            expect_shortest(scene, round, pose, random);
        }
    }
}

TEST(LawsOfDepth, DeepOverlapsHaveABoundThatHoldsAndIsTight) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 2);
    Random random(kSeed + 2);
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

}  // namespace depth_laws_test
}  // namespace terrane
