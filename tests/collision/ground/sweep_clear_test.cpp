// SPDX-License-Identifier: MIT
#include "ground/heightfield/heightfield_queries.h"
#include "ground_cases.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/shapes.h>

#include <gtest/gtest.h>

#include <limits>

namespace terrane {
namespace sweep_clear_test {

using namespace test;
using internal::is_sweep_clear;

constexpr std::uint64_t kSeed = 20261123;
constexpr double kMargin = 1e-3;
constexpr int kSamples = 48;  // of a motion

/// Hulls and compounds are off their origins, so that turning moves them.
std::vector<Shape> make_shapes() {
    std::vector<Shape> shapes{Sphere{0.5},          Capsule{0.4, 0.8},     Capsule{0.1, 0.0},
                              Box{{1.0, 2.0, 0.5}}, Box{{0.3, 0.2, 0.01}}, Box{{2.0, 0.0, 0.0}}};
    const std::vector<Eigen::Vector3d> wedge{{0.2, -0.6, -0.3}, {1.2, -0.7, -0.4}, {0.8, 0.9, -0.3},
                                             {0.1, 0.8, -0.4},  {0.3, 0.1, 0.9},   {0.6, 0.4, 0.7}};
    shapes.push_back(ConvexHull::create(wedge).value());
    Random random(kSeed + 1);
    std::vector<Eigen::Vector3d> stone;
    for (int i = 0; i < 80; ++i) stone.push_back(0.7 * random.direction());
    shapes.push_back(ConvexHull::create(stone).value());
    std::vector<CompoundPart> parts{{Box{{0.3, 0.8, 0.3}}, {}},
                                    {Capsule{0.25, 0.7}, {}},
                                    {Sphere{0.4}, {}},
                                    {std::get<ConvexHull>(shapes[6]), {}}};
    for (CompoundPart& part : parts) {
        part.body_from_part = {random.rotation(), 1.2 * random.direction()};
    }
    shapes.push_back(Compound::create(parts).value());
    return shapes;
}

/// A short motion that starts just above the ground, like those of bodies in a substep.
Motion random_short_motion(Random& random, const Shape& shape, const Ground& ground) {
    Motion motion;
    motion.start = random_pose(random, ground, 0.0, 1.0);
    const double above = random.below(2) == 0 ? 2.5e-3 : random.between(0.0, 0.3);
    motion.start.translation.z() += compute_lift(shape, motion.start, ground).lift + above;
    const double distance = std::exp(random.between(std::log(1e-4), std::log(0.3)));
    const double turn = std::exp(random.between(std::log(1e-4), std::log(0.5)));
    motion.translation = distance * random.direction();
    motion.rotation_vector = turn * random.direction();
    return motion;
}

/// Least distance to the ground at some poses of a motion, at most `most`.
double least_distance(const Shape& shape, const Motion& motion, const Ground& ground, double most) {
    double least = most;
    for (int i = 0; i <= kSamples; ++i) {
        const Pose pose = motion.at(static_cast<double>(i) / kSamples);
        least = std::min(least, signed_distance(shape, pose, ground, most).distance);
    }
    return least;
}

TEST(SweepClear, ProvedMotionsKeepTheMargin) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    int clear = 0, proved = 0, met = 0;
    for (const Scene& scene : make_scenes()) {
        SCOPED_TRACE(scene.name);
        const Ground ground = make_test_ground(scene.height, 1.0, 1);
        for (const Shape& shape : make_shapes()) {
            for (int i = 0; i < 150; ++i) {
                const Motion motion = random_short_motion(random, shape, ground);
                const double least = least_distance(shape, motion, ground, 2.0 * kMargin);
                if (is_sweep_clear(shape, motion, ground, kMargin)) {
                    EXPECT_GE(least, kMargin - 1e-9) << "motion " << i;
                    ++proved;
                }
                ++(least < kMargin ? met : clear);
            }
        }
    }
    // Enough cases of each kind.
    EXPECT_GT(met, 500);
    EXPECT_GT(clear, 500);
    EXPECT_GT(proved, clear / 2) << "of " << clear;
}

TEST(SweepClear, NeverProvesAMotionThatACastHits) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    int hits = 0;
    const Ground ground = make_test_ground(hash_height, 1.0, 1);
    for (const Shape& shape : make_shapes()) {
        for (int i = 0; i < 1000; ++i) {
            const Motion motion = random_short_motion(random, shape, ground);
            if (!cast(shape, motion, ground, {.tolerance = kMargin}).hit) continue;
            ++hits;
            EXPECT_FALSE(is_sweep_clear(shape, motion, ground, kMargin)) << "motion " << i;
        }
    }
    EXPECT_GT(hits, 500);
}

TEST(SweepClear, ProvesAFallThatEndsAboveOrBesideTheGround) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    const Box box{{1.0, 2.0, 0.5}};
    EXPECT_TRUE(
        is_sweep_clear(box, straight({64.0, 64.0, 2.0}, {0.3, 0.0, -1.4}), ground, kMargin));
    EXPECT_FALSE(
        is_sweep_clear(box, straight({64.0, 64.0, 2.0}, {0.3, 0.0, -1.5}), ground, kMargin));
    const Compound pair =
        Compound::create(std::vector<CompoundPart>{{Sphere{0.5}, {}}, {Box{{1.0, 2.0, 0.5}}, {}}})
            .value();
    EXPECT_TRUE(
        is_sweep_clear(pair, straight({64.0, 64.0, 2.0}, {0.3, 0.0, -1.4}), ground, kMargin));
    EXPECT_FALSE(
        is_sweep_clear(pair, straight({64.0, 64.0, 2.0}, {0.3, 0.0, -1.5}), ground, kMargin));
    EXPECT_TRUE(
        is_sweep_clear(box, straight({-50.0, 64.0, -2.0}, {0.3, 0.0, -1.4}), ground, kMargin));
}

TEST(SweepClear, ProvesNothingForLargeTurnsInvalidInputOrMissingGround) {
    const Ground flat = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    Motion high = straight({64.0, 64.0, 1000.0}, {0.1, 0.0, 0.0});
    ASSERT_TRUE(is_sweep_clear(Box{{1.0, 1.0, 1.0}}, high, flat, kMargin));
    high.rotation_vector.z() = 0.6;
    EXPECT_FALSE(is_sweep_clear(Box{{1.0, 1.0, 1.0}}, high, flat, kMargin));
    high.rotation_vector.z() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(is_sweep_clear(Box{{1.0, 1.0, 1.0}}, high, flat, kMargin));
    high.rotation_vector.z() = 0.0;
    high.translation.x() = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(is_sweep_clear(Box{{1.0, 1.0, 1.0}}, high, flat, kMargin));

    TableGroundSettings settings;
    settings.roots = 2;
    settings.is_resident = [](int column, int) { return column == 0; };
    settings.bound = 100.0f;
    const Ground half = make_test_ground([](double, double) { return 0.0; }, settings);
    const Eigen::Vector3d up(0.0, 0.0, 0.1);
    EXPECT_TRUE(is_sweep_clear(Sphere{1.0}, straight({120.0, 64.0, 2.0}, up), half, kMargin));
    EXPECT_FALSE(is_sweep_clear(Sphere{1.0}, straight({127.5, 64.0, 2.0}, up), half, kMargin));
}

}  // namespace sweep_clear_test
}  // namespace terrane
