// SPDX-License-Identifier: MIT
// Distances apart and depths of overlap against brute force.
#include "collision/ground_laws/oracles/brute_depth.h"
#include "collision/ground_laws/oracles/brute_gap.h"
#include "law_cases.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <cstdio>

namespace terrane {
namespace distance_laws_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260303;

TEST(LawsOfDistance, ApartIsTheDistanceToTheNearestTriangle) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const long count = count_of_cases(1'500, 250'000);
    for (const LawShape& shape : law_shapes()) {
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            const Pose pose = random_pose(random, scene, shape, random.between(-1.5, 0.0));
            SCOPED_TRACE(describe(scene, shape, pose));
            const auto gap =
                static_cast<double>(brute_gap<long double>(scene.soup, shape.oracle, pose, 2.0L));
            const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 2.0);
            ASSERT_EQ(answer.status, QueryStatus::complete);
            ASSERT_TRUE(answer.has_ground);
            ASSERT_NEAR(answer.distance, gap, 1e-9);
            // The closest point of the ground is on the surface.
            const Eigen::Vector3d on_ground = answer.point_world - answer.distance * answer.normal;
            const LawShape point{"point", Sphere{0.0}, make_oracle(Sphere{0.0})};
            Pose at;
            at.translation = on_ground;
            ASSERT_NEAR(
                static_cast<double>(brute_gap<long double>(scene.soup, point.oracle, at, 1.0L)),
                0.0, 1e-9);
            ASSERT_NEAR(answer.normal.norm(), 1.0, 1e-12);
        }
    }
}

TEST(LawsOfDistance, GrowsUpwardsAndNoFasterThanTheDisplacement) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed + 1);
    const long count = count_of_cases(300, 30'000);
    for (const LawShape& shape : law_shapes()) {
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(i);
            const double deepest = shallow_depth(shape);
            const Pose pose = random_pose(random, scene, shape, random.between(-0.5, deepest));
            SCOPED_TRACE(describe(scene, shape, pose));
            const DistanceAnswer start = signed_distance(shape.shape, pose, scene.ground, 2.0);
            if (start.distance < -deepest) continue;
            // Along its normal another part of rough ground may come nearer: only the rate is bounded.
            for (const Eigen::Vector3d& direction :
                 {start.normal, Eigen::Vector3d(0.0, 0.0, 1.0)}) {
                double last = start.distance;
                for (int k = 1; k <= 8; ++k) {
                    const double now =
                        signed_distance(shape.shape, moved(pose, 0.03 * k * direction),
                                        scene.ground, 4.0)
                            .distance;
                    if (now < -deepest) break;
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
    }
}

// Comparison with brute force for depths of at most a tenth of the smallest extent.
struct DepthScore {
    long shallow = 0;
    long not_separated = 0;  // lift above 1e-9 after the translation
    long too_short = 0;      // by more than 1e-9 shorter than the shortest
    long too_long = 0;       // by more than 1e-9 longer
    double longest_m = 0.0;
    std::string example;
};

DepthScore judge_depths(const LawShape& shape, long count, std::uint64_t seed) {
    Random random(seed);
    DepthScore score;
    for (long i = 0; i < count; ++i) {
        const LawScene& scene = scene_of(i);
        const double lift = shallow_depth(shape) * random.between(0.0, 1.3);
        const Pose pose = random_pose(random, scene, shape, lift);
        const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 1.0);
        const double depth = -answer.distance;
        if (depth > shallow_depth(shape)) continue;
        ++score.shallow;
        const Vec<long double> translation =
            static_cast<long double>(depth) * answer.normal.cast<long double>();
        if (is_deeper<long double>(scene.soup, shape.oracle, pose, translation, 1e-9L)) {
            ++score.not_separated;
        }
        const auto expected = static_cast<double>(
            brute_depth(scene.soup, shape.oracle, pose, static_cast<long double>(depth) + 1e-9L));
        score.too_short += depth < expected - 1e-9;
        score.too_long += depth > expected + 1e-9;
        if (depth - expected > score.longest_m) {
            score.longest_m = depth - expected;
            char numbers[80];
            std::snprintf(numbers, sizeof numbers, ": %.17g instead of %.17g", depth, expected);
            score.example = describe(scene, shape, pose) + numbers;
        }
    }
    std::printf(
        "%s: %ld shallow of %ld; not separated %ld, too short %ld, too long %ld, by up to %g "
        "m%s%s\n",
        shape.name.c_str(), score.shallow, count, score.not_separated, score.too_short,
        score.too_long, score.longest_m, score.example.empty() ? "" : ", ", score.example.c_str());
    return score;
}

TEST(LawsOfDepth, ShallowSeparatesAndIsNoShorterThanTheMinimum) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    const long count = count_of_cases(33, 50'000);
    for (const LawShape& shape : law_shapes()) {
        const DepthScore score = judge_depths(shape, count, kSeed + 2);
        EXPECT_GT(score.shallow, count / 4) << shape.name;
        EXPECT_EQ(score.not_separated, 0) << shape.name;
        EXPECT_EQ(score.too_short, 0) << shape.name;
    }
}

TEST(LawsOfDepth, ShallowIsTheMinimumTranslation) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    const long count = count_of_cases(33, 50'000);
    for (const LawShape& shape : law_shapes()) {
        const DepthScore score = judge_depths(shape, count, kSeed + 4);
        EXPECT_EQ(score.too_long, 0) << shape.name << ", " << score.example;
    }
}

TEST(LawsOfDepth, DeepSeparatesAndNoRandomDirectionIsMuchShorter) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed + 3);
    const long count = count_of_cases(2, 2'000);
    long turn = 0;
    for (const LawShape& shape : law_shapes()) {
        for (long i = 0; i < count; ++i) {
            const LawScene& scene = scene_of(turn++);
            const double lift = law_scale(shape) * random.between(0.5, 8.0);
            const Pose pose = random_pose(random, scene, shape, lift);
            SCOPED_TRACE(describe(scene, shape, pose));
            const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 1.0);
            ASSERT_EQ(answer.status, QueryStatus::complete);
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

}  // namespace distance_laws_test
}  // namespace terrane
