// SPDX-License-Identifier: MIT
//
// Ground that ends within its cells, against brute force over the clipped triangles.
#include "law_cases.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

namespace terrane::extent_laws_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261129;

// A few cells, all shapes near an edge. In the second scene all edges cut the same cell. The corner's column and row
// have an even sum, as Soup requires.
std::vector<LawScene> cut_scenes() {
    const auto rough = [](double x, double y) {
        Random random(static_cast<std::uint64_t>(1e3 * x + y));
        return random.between(0.0, 1.0);
    };
    std::vector<LawScene> made;
    for (const WorldRect& extent :
         {WorldRect{60.3, 62.0, 68.75, 68.625}, WorldRect{60.25, 62.125, 60.875, 62.75},
          WorldRect{60.5, 62.5, 62.5, 64.5}}) {
        made.push_back(make_scene("cut", rough, {.extent = extent}));
        made.back().border = 0.01;
    }
    return made;
}

template <class Check>
void for_each_case(double least_lift, double most_lift, Check&& check) {
    SeededRandom random(kSeed);
    const long count = count_of_cases(60, 100'000);
    for (const LawScene& scene : cut_scenes()) {
        for (const LawShape& shape : law_shapes()) {
            for (long i = 0; i < count; ++i) {
                const double lift = random.between(least_lift, most_lift);
                const Pose pose = random_pose(random, scene, shape, lift);
                SCOPED_TRACE(describe(scene, shape, pose));
                check(scene, shape, pose, lift, random);
                if (testing::Test::HasFailure()) return;
            }
        }
    }
}

TEST(GroundCutByItsExtent, GivesTheLargestLiftOfWhatIsLeft) {
    for_each_case(
        -1.0, 1.0,
        [](const LawScene& scene, const LawShape& shape, const Pose& pose, double lift, Random&) {
            const LiftAnswer answer = compute_lift(shape.shape, pose, scene.ground);
            EXPECT_EQ(answer.status, QueryStatus::ok);
            EXPECT_NEAR(answer.lift, lift, 1e-9);
        });
}

TEST(GroundCutByItsExtent, IsAsFarAwayAsItsNearestTriangle) {
    for_each_case(
        -2.0, 0.0,
        [](const LawScene& scene, const LawShape& shape, const Pose& pose, double, Random&) {
            const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 4.0);
            EXPECT_EQ(answer.status, QueryStatus::ok);
            EXPECT_NEAR(
                answer.distance,
                static_cast<double>(brute_gap<long double>(scene.soup, shape.oracle, pose, 4.0L)),
                1e-9);
        });
}

TEST(GroundCutByItsExtent, IsLeftByNoShorterTranslationThanTheBound) {
    for_each_case(
        0.01, 1.0,
        [](const LawScene& scene, const LawShape& shape, const Pose& pose, double, Random& random) {
            const DistanceAnswer answer = signed_distance(shape.shape, pose, scene.ground, 1.0);
            const double depth = -answer.distance;
            EXPECT_GT(depth, 0.0);
            EXPECT_LE(answer.distance_lower_bound, depth);
            // a nanometre farther, because the lift is discontinuous at the side of the ground
            EXPECT_FALSE(is_deeper<long double>(
                scene.soup, shape.oracle, pose,
                (static_cast<long double>(depth) + 1e-9L) * answer.normal.cast<long double>(),
                1e-9L));
            const SampledDepthSettings few{.samples = 100, .starts = 2, .refinements = 30};
            EXPECT_GE(sampled_depth(scene.soup, shape.oracle, pose, depth, few, random),
                      answer.distance_lower_bound - 1e-9);
        });
}

TEST(GroundCutByItsExtent, IsHitByCastsWhereTheyTouchIt) {
    long hits = 0, misses = 0;
    for_each_case(-1.0, -0.01,
                  [&](const LawScene& scene, const LawShape& shape, const Pose& pose, double,
                      Random& random) {
                      Motion motion{
                          .start = pose,
                          .translation = 4.0 * random.direction() - 2.0 * Eigen::Vector3d::UnitZ(),
                          .rotation_vector = Eigen::Vector3d::Zero()};
                      if (random.below(2) == 0) motion.rotation_vector = 2.0 * random.direction();
                      const CastSettings settings;
                      const CastAnswer answer = cast(shape.shape, motion, scene.ground, settings);
                      EXPECT_EQ(answer.status, QueryStatus::ok);
                      ++(answer.hit ? hits : misses);
                      constexpr int kSteps = 60;
                      for (int k = 0; k <= kSteps; ++k) {
                          EXPECT_FALSE(is_deeper<double>(scene.soup, shape.oracle,
                                                         motion.at(answer.fraction * k / kSteps),
                                                         Eigen::Vector3d::Zero(), 1e-8))
                              << k;
                      }
                      if (!answer.hit) return;
                      const Pose there = motion.at(answer.fraction);
                      const Eigen::Vector3d& n = answer.contact.normal;
                      const bool is_at_side =
                          n.z() == 0.0 && is_deeper<double>(scene.soup, shape.oracle, there,
                                                            -2.0 * settings.tolerance * n, 1e-9);
                      if (!is_at_side) {
                          EXPECT_LE(brute_gap<double>(scene.soup, shape.oracle, there, 1.0),
                                    settings.tolerance + 1e-9);
                      }
                  });
    EXPECT_GT(hits, 100);
    EXPECT_GT(misses, 100);
}

}  // namespace terrane::extent_laws_test
