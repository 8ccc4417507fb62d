// SPDX-License-Identifier: MIT
// Pairs that are kept from update to update, against a broadphase that is made anew for each of them.
#include "support/random.h"

#include <terrane/collision/broadphase.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

namespace terrane {
namespace kept_pairs_test {

using test::Random;

constexpr std::uint64_t kSeed = 20261124;

struct Bodies {
    std::vector<Aabb> bounds;
    std::vector<BoundingSphere> balls;

    void add(const Eigen::Vector3d& centre, double half) {
        const Eigen::Vector3d around = Eigen::Vector3d::Constant(half);
        bounds.push_back({centre - around, centre + around});
        balls.push_back({centre, std::sqrt(3.0) * half});
    }
    void move(std::size_t i, const Eigen::Vector3d& by) {
        bounds[i].low += by;
        bounds[i].high += by;
        balls[i].centre += by;
    }
};

Bodies make_bodies(Random& random, int count, double width) {
    Bodies bodies;
    for (int i = 0; i < count; ++i) {
        const double x = random.between(0.0, width);
        const double y = random.between(0.0, width);
        bodies.add({x, y, random.between(0.0, width)}, 0.5);
    }
    return bodies;
}

/// Whether every kind, kept through all steps, finds the pairs of a fresh comparison of all boxes.
///
/// @param move void(Bodies&, step): called before each step
void expect_fresh_pairs(Bodies bodies, int steps, const std::function<void(Bodies&, int)>& move) {
    constexpr std::array kKinds{BroadphaseKind::sap, BroadphaseKind::grid,
                                BroadphaseKind::two_scene};
    std::array<std::unique_ptr<Broadphase>, kKinds.size()> kept;
    for (std::size_t k = 0; k < kKinds.size(); ++k) kept[k] = make_broadphase(kKinds[k], 0.01);
    for (int step = 0; step < steps; ++step) {
        move(bodies, step);
        const auto fresh = make_broadphase(BroadphaseKind::brute, 0.01);
        fresh->update(bodies.bounds, bodies.balls);
        const std::span<const BodyPair> expected = fresh->find_pairs();
        for (std::size_t k = 0; k < kKinds.size(); ++k) {
            SCOPED_TRACE(to_string(kKinds[k]));
            kept[k]->update(bodies.bounds, bodies.balls);
            // asking again gives the same
            for (int time = 0; time < 2; ++time) {
                const std::span<const BodyPair> found = kept[k]->find_pairs();
                ASSERT_TRUE(
                    std::equal(found.begin(), found.end(), expected.begin(), expected.end()))
                    << "step " << step << ", time " << time;
            }
        }
    }
}

TEST(KeptPairs, AreThoseOfAFreshComparisonWhileAllMove) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    Bodies bodies = make_bodies(random, 300, 12.0);
    std::vector<Eigen::Vector3d> velocities;
    for (int i = 0; i < 300; ++i) velocities.push_back(random.direction() / 60.0);
    expect_fresh_pairs(bodies, 80, [&](Bodies& all, int) {
        for (std::size_t i = 0; i < velocities.size(); ++i) all.move(i, velocities[i]);
    });
}

TEST(KeptPairs, AreThoseOfAFreshComparisonWhileAFewCrossTheOthers) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 1);
    Random random(kSeed + 1);
    Bodies bodies = make_bodies(random, 300, 10.0);
    for (int i = 0; i < 5; ++i) bodies.move(static_cast<std::size_t>(50 * i), {-20.0, 0.0, 0.0});
    expect_fresh_pairs(bodies, 40, [&](Bodies& all, int step) {
        // one more joins every eight steps
        for (int i = 0; i <= step / 8; ++i) {
            all.move(static_cast<std::size_t>(50 * i), {1.3, 0.1 * i, 0.0});
        }
    });
}

TEST(KeptPairs, AreThoseOfAFreshComparisonWhereEveryStepIsFar) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 2);
    Random random(kSeed + 2);
    Bodies bodies = make_bodies(random, 100, 8.0);
    expect_fresh_pairs(bodies, 60, [&](Bodies& all, int step) {
        // at rest from step 30 to 50
        if (step >= 30 && step < 50) return;
        for (std::size_t i = 0; i < all.bounds.size(); ++i) {
            all.move(i, 3.0 * random.direction() - 0.2 * all.balls[i].centre);
        }
    });
}

TEST(KeptPairs, HoldWhereAllAreInOnePlaceAndWhereSizesDifferByAnyFactor) {
    Bodies bodies;
    for (int i = 0; i < 40; ++i) bodies.add({1.0, 2.0, 3.0}, 0.0);
    for (int i = 0; i < 30; ++i) bodies.add({1.0, 2.0, 3.0}, std::pow(10.0, i - 15));
    bodies.add({0.0, 0.0, 0.0}, 1e149);
    expect_fresh_pairs(bodies, 20, [&](Bodies& all, int step) {
        for (std::size_t i = 0; i < all.bounds.size(); i += 3) {
            all.move(i, {0.01 * step, 0.0, -0.02});
        }
    });
}

TEST(KeptPairs, FollowBoxesThatBecomeEmptyWithoutMoving) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    Random random(kSeed + 3);
    Bodies whole = make_bodies(random, 60, 3.0);
    whole.add({1.5, 1.5, 1.5}, 0.05);
    expect_fresh_pairs(whole, 24, [&](Bodies& all, int step) {
        all = whole;
        if (step % 8 < 4) return;
        all.bounds[7].low.y() = kNone;
        all.bounds[8].high.z() = std::numeric_limits<double>::infinity();
        // turned inside out within its enlarged box
        std::swap(all.bounds.back().low, all.bounds.back().high);
        if (step % 8 < 6) return;
        for (std::size_t i = 20; i < 50; ++i) all.bounds[i].high.x() = kNone;
    });
}

TEST(KeptPairs, AreThoseOfTheLastOfSeveralUpdates) {
    Random random(kSeed + 4);
    Bodies bodies = make_bodies(random, 100, 6.0);
    const auto kept = make_broadphase(BroadphaseKind::grid, 0.0);
    const auto fresh = make_broadphase(BroadphaseKind::brute, 0.0);
    for (int step = 0; step < 60; ++step) {
        // others in each step: none, a few, or more than get new boxes alone
        for (int i = 0; i < step % 7 * 2; ++i) {
            bodies.move(static_cast<std::size_t>((11 * step + i) % 100), 1.5 * random.direction());
        }
        kept->update(bodies.bounds, bodies.balls);
        if (step % 3 != 0) continue;
        fresh->update(bodies.bounds, bodies.balls);
        const std::span<const BodyPair> found = kept->find_pairs();
        const std::span<const BodyPair> expected = fresh->find_pairs();
        ASSERT_TRUE(std::equal(found.begin(), found.end(), expected.begin(), expected.end()))
            << step;
    }
}

TEST(KeptPairs, AreNotSoughtAgainWhereNobodyLeavesItsBox) {
    Random random(kSeed + 5);
    Bodies bodies = make_bodies(random, 1000, 30.0);
    const auto kept = make_broadphase(BroadphaseKind::grid, 0.0);
    for (int step = 0; step < 10; ++step) {
        for (std::size_t i = 0; i < bodies.bounds.size(); ++i) {
            bodies.move(i, 0.02 * random.direction());
        }
        kept->update(bodies.bounds, bodies.balls);
        kept->find_pairs();
        if (step < 2) continue;
        EXPECT_EQ(kept->update_operations(), bodies.bounds.size()) << step;
        EXPECT_LT(kept->candidate_count(), bodies.bounds.size()) << step;
    }
}

}  // namespace kept_pairs_test
}  // namespace terrane
