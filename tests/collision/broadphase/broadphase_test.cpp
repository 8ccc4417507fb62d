// SPDX-License-Identifier: MIT
//
// Every broadphase against a brute-force comparison of all boxes.
#include "support/allocation_counter.h"
#include "support/random.h"

#include <terrane/collision/broadphase.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <ostream>
#include <string>
#include <vector>

namespace terrane {

inline void PrintTo(BroadphaseKind kind, std::ostream* out) { *out << to_string(kind); }

/// Indices of two bodies whose boxes are at most two margins apart along every axis, by comparing all; an empty box is
/// in no pair.
inline std::vector<BodyPair> compare_all(std::span<const Aabb> boxes, double margin) {
    const auto is_box = [](const Aabb& box) {
        return (box.low.array() <= box.high.array()).all() &&
               box.low.cwiseAbs().maxCoeff() <= 1e150 && box.high.cwiseAbs().maxCoeff() <= 1e150;
    };
    std::vector<BodyPair> pairs;
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
        if (!is_box(boxes[i])) continue;
        for (std::uint32_t j = i + 1; j < boxes.size(); ++j) {
            if (!is_box(boxes[j])) continue;
            const Eigen::Vector3d after = boxes[j].low - boxes[i].high;
            const Eigen::Vector3d before = boxes[i].low - boxes[j].high;
            if (after.maxCoeff() <= 2.0 * margin && before.maxCoeff() <= 2.0 * margin) {
                pairs.push_back({i, j});
            }
        }
    }
    return pairs;
}

/// Boxes of bodies.
struct Crowd {
    std::vector<Aabb> bounds;

    void add(const Eigen::Vector3d& centre, const Eigen::Vector3d& half) {
        bounds.push_back({centre - half, centre + half});
    }
    void add(const Eigen::Vector3d& centre, double half) {
        add(centre, Eigen::Vector3d::Constant(half));
    }
    Eigen::Vector3d middle(std::size_t i) const { return 0.5 * (bounds[i].low + bounds[i].high); }
    void move(std::size_t i, const Eigen::Vector3d& by) {
        bounds[i].low += by;
        bounds[i].high += by;
    }
};

/// Whether a broadphase finds the pairs of a comparison of all boxes, and the same when it is asked again.
inline void expect_all_pairs(Broadphase& broadphase, const Crowd& crowd, double margin) {
    broadphase.update(crowd.bounds);
    const std::vector<BodyPair> expected = compare_all(crowd.bounds, margin);
    for (int time = 0; time < 2; ++time) {
        const std::span<const BodyPair> found = broadphase.find_pairs();
        ASSERT_EQ(found.size(), expected.size());
        for (std::size_t k = 0; k < found.size(); ++k) ASSERT_EQ(found[k], expected[k]) << k;
        EXPECT_GE(broadphase.candidate_count(), found.size());
    }
}

namespace broadphase_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261122;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Eigen::Vector3d random_place(Random& random, const Eigen::Vector3d& width) {
    const double x = random.between(0.0, width.x());
    const double y = random.between(0.0, width.y());
    const double z = random.between(0.0, width.z());
    return {x, y, z};
}

/// Boxes of half a metre at random places of a cuboid.
Crowd make_spread(Random& random, int count, const Eigen::Vector3d& width) {
    Crowd crowd;
    for (int i = 0; i < count; ++i) crowd.add(random_place(random, width), 0.5);
    return crowd;
}

struct NamedCrowd {
    std::string name;
    Crowd crowd;
    double step;  ///< metres: slow motion
};

std::vector<NamedCrowd> make_crowds(Random& random) {
    std::vector<NamedCrowd> crowds;
    const auto add = [&](std::string name, double step) -> Crowd& {
        crowds.push_back({std::move(name), {}, step});
        return crowds.back().crowd;
    };
    add("equal, spread", 0.01) = make_spread(random, 400, {20.0, 20.0, 20.0});
    Crowd& clustered = add("clustered", 0.01);
    for (int i = 0; i < 400; ++i) {
        const double far = 1e5 * random.below(4);
        clustered.add(random_place(random, {3.0, 3.0, 3.0}) + Eigen::Vector3d(far, -far, far),
                      random_place(random, {0.3, 0.3, 0.3}));
    }
    for (int axis = 0; axis < 3; ++axis) {
        Crowd& stacked = add("stacked along axis " + std::to_string(axis), 0.01);
        // each box touches the next exactly
        for (int i = 0; i < 300; ++i) stacked.add(i * Eigen::Vector3d::Unit(axis), 0.5);
    }
    Crowd& crooked = add("end to end, of numbers that are no floats", 0.01);
    for (int i = 0; i < 300; ++i) {
        const Eigen::Vector3d low(0.1 * i, 0.1 * (i % 3), 0.1 * (i % 7));
        const Eigen::Vector3d high(0.1 * (i + 1), 0.1 * (i % 3 + 1), 0.1 * (i % 7 + 1));
        crooked.bounds.push_back({low, high});
    }
    Crowd& unequal = add("wildly unequal", 0.1);
    for (int i = 0; i < 400; ++i) {
        const double size = std::pow(10.0, random.between(-6.0, 2.0));
        unequal.add(random_place(random, {300.0, 300.0, 30.0}),
                    size * Eigen::Vector3d(1.0, random.between(0.0, 1.0), 1.0));
    }
    Crowd& sheet = add("flat, on a plane", 0.05);
    for (int i = 0; i < 400; ++i) {
        sheet.add(random_place(random, {100.0, 100.0, 0.0}), {1.0, 2.0, 0.0});
    }
    Crowd& far = add("a million kilometres away", 1.0);
    for (int i = 0; i < 300; ++i) {
        far.add(random_place(random, {20.0, 20.0, 20.0}) + Eigen::Vector3d(1e9, -1e9, 1e9), 0.5);
    }
    Crowd& points = add("points, many in one place", 0.5);
    for (int i = 0; i < 200; ++i) {
        points.add(
            {std::floor(random.between(0.0, 6.0)), 2.0, std::floor(random.between(0.0, 3.0))}, 0.0);
    }
    Crowd& lattice = add("on a lattice, touching", 1.0);
    for (int i = 0; i < 343; ++i) lattice.add(Eigen::Vector3d(i % 7, i / 7 % 7, i / 49), 0.5);
    return crowds;
}

class Broadphases : public testing::TestWithParam<BroadphaseKind> {};

TEST_P(Broadphases, FindWhatComparingAllFindsWhateverMoves) {
    SeededRandom random(kSeed);
    for (const NamedCrowd& named : make_crowds(random)) {
        SCOPED_TRACE(named.name);
        for (const double margin : {0.0, 0.05, 3.0}) {
            SCOPED_TRACE(margin);
            Crowd crowd = named.crowd;
            const auto broadphase = make_broadphase(GetParam(), margin);
            // at rest, slow, fast, teleporting, and at rest again
            for (const double speed : {0.0, 1.0, 30.0, 1e4, 0.0}) {
                for (int step = 0; step < 3; ++step) {
                    for (std::size_t i = 0; i < crowd.bounds.size(); ++i) {
                        crowd.move(i, speed * named.step * random.direction());
                    }
                    ASSERT_NO_FATAL_FAILURE(expect_all_pairs(*broadphase, crowd, margin)) << speed;
                }
            }
        }
    }
}

TEST_P(Broadphases, FollowBodiesThatComeAndGo) {
    SeededRandom random(kSeed + 1);
    const auto broadphase = make_broadphase(GetParam(), 0.1);
    Crowd crowd;
    for (const std::size_t count : {0u, 1u, 2u, 40u, 200u, 3u, 0u, 60u}) {
        while (crowd.bounds.size() > count) crowd.bounds.pop_back();
        while (crowd.bounds.size() < count) {
            crowd.add(random_place(random, {6.0, 6.0, 6.0}), {0.5, 0.4, 0.3});
        }
        ASSERT_NO_FATAL_FAILURE(expect_all_pairs(*broadphase, crowd, 0.1)) << count;
    }
}

TEST_P(Broadphases, PassOverWhatIsNoBox) {
    const auto broadphase = make_broadphase(GetParam(), 0.0);
    Crowd crowd;
    for (int i = 0; i < 20; ++i) crowd.add({0.4 * i, 0.0, 0.0}, 0.5);
    Crowd broken = crowd;
    broken.bounds[3].low.y() = kNan;
    broken.bounds[4].high.z() = kInfinity;
    broken.bounds[5].low.x() = -kInfinity;
    std::swap(broken.bounds[6].low, broken.bounds[6].high);
    broken.bounds[7].high.x() = 1e300;
    broken.bounds[8].low.z() = -std::numeric_limits<double>::max();
    for (const BodyPair& pair : compare_all(broken.bounds, 0.0)) {
        for (const std::uint32_t i : {pair.a, pair.b}) ASSERT_TRUE(i < 3 || i > 8) << i;
    }
    // valid, empty, and valid again
    for (const Crowd* now : {&crowd, &broken, &crowd}) {
        ASSERT_NO_FATAL_FAILURE(expect_all_pairs(*broadphase, *now, 0.0));
    }
}

TEST_P(Broadphases, HoldOutAtTheEndsOfTheWorld) {
    Crowd crowd;
    for (const double far : {-1e150, -1.0, 0.0, 1.0, 1e150}) {
        for (const double half : {0.0, 1e-150, 0.5, 1e149}) {
            crowd.add({0.8 * far, -0.8 * far, 0.0}, half);
        }
    }
    const auto broadphase = make_broadphase(GetParam(), 0.0);
    for (int step = 0; step < 2; ++step) {
        ASSERT_NO_FATAL_FAILURE(expect_all_pairs(*broadphase, crowd, 0.0));
    }
}

TEST_P(Broadphases, KeepTheirMemory) {
    Random random(kSeed + 2);
    const auto broadphase = make_broadphase(GetParam(), 0.0);
    const Crowd crowd = make_spread(random, 500, {10.0, 10.0, 10.0});
    const auto ask = [&] {
        broadphase->update(crowd.bounds);
        return broadphase->find_pairs().size();
    };
    // pairs are kept from the second update on
    const std::size_t pairs = ask();
    ASSERT_GT(pairs, 100u);
    EXPECT_EQ(ask(), pairs);
    const AllocationCounter counter;
    EXPECT_EQ(ask(), pairs);
    EXPECT_EQ(counter.count(), 0u);
}

INSTANTIATE_TEST_SUITE_P(All, Broadphases,
                         testing::Values(BroadphaseKind::sap, BroadphaseKind::grid,
                                         BroadphaseKind::two_scene),
                         [](const auto& tested) {
                             std::string name(to_string(tested.param));
                             std::erase(name, '-');
                             return name;
                         });

TEST(GridBroadphase, UpdatesInTheSameStepsABodyHoweverManyAndHoweverFarApart) {
    Random random(kSeed + 3);
    double least = kInfinity, most = 0.0;
    for (const int count : {1000, 10'000, 100'000}) {
        for (const double apart : {2.0, 2e4}) {
            const double width = apart * std::cbrt(count);
            const Crowd crowd = make_spread(random, count, {width, width, width});
            const auto grid = make_broadphase(BroadphaseKind::grid, 0.0);
            grid->update(crowd.bounds);
            const double steps =
                static_cast<double>(grid->update_operations()) / static_cast<double>(count);
            least = std::min(least, steps);
            most = std::max(most, steps);
        }
    }
    EXPECT_LE(most, 1.02 * least);
}

TEST(GridBroadphase, ComparesFewPairsOfLikeBodies) {
    Random random(kSeed + 4);
    // spheres fill 2 % of the volume
    const int count = 20'000;
    const double width = std::cbrt(count * 0.5236 / 0.02);
    const Crowd crowd = make_spread(random, count, {width, width, width});
    const auto grid = make_broadphase(BroadphaseKind::grid, 0.0);
    grid->update(crowd.bounds);
    const std::size_t pairs = grid->find_pairs().size();
    EXPECT_GT(pairs, 100u);
    // 27 cells, of which one row in three overlaps the neighbours of the other body, against 8 box volumes
    EXPECT_LT(grid->candidate_count(), 8 * pairs);
}

TEST(SapBroadphase, KeepsItsOrderWhereLittleMoves) {
    Random random(kSeed + 5);
    Crowd crowd = make_spread(random, 2000, {2000.0, 40.0, 40.0});
    const auto sap = make_broadphase(BroadphaseKind::sap, 0.0);
    const auto update = [&] {
        sap->update(crowd.bounds);
        return sap->update_operations();
    };
    const std::uint64_t from_scratch = update();
    EXPECT_LT(update(), from_scratch / 2);  // enlarged boxes
    const std::uint64_t kept = update();
    EXPECT_EQ(kept, crowd.bounds.size());
    // beyond the enlarged boxes
    for (std::size_t i = 0; i < crowd.bounds.size(); ++i) crowd.move(i, 1.0 * random.direction());
    const std::uint64_t sorted = update();
    EXPECT_LT(sorted, from_scratch / 2);
    EXPECT_GT(sorted, kept);
}

TEST(LazyBoxes, GiveThePairsOfTheBoxesAndComputeThoseOfOverlappingBoundsOnce) {
    SeededRandom random(kSeed + 6);
    Crowd boxes, bounds;
    for (int i = 0; i < 300; ++i) {
        const Eigen::Vector3d half(random.between(0.0, 0.2), random.between(0.0, 1.0), 0.3);
        boxes.add(random_place(random, {14.0, 14.0, 14.0}), half);
        bounds.add(boxes.middle(boxes.bounds.size() - 1), half.norm());
    }
    const auto outer = make_broadphase(BroadphaseKind::two_scene, 0.0);
    LazyBoxes lazy;
    std::size_t pair_count = 0;
    for (int step = 0; step < 20; ++step) {
        for (std::size_t i = 0; i < boxes.bounds.size(); ++i) {
            const Eigen::Vector3d by = 0.1 * random.direction();
            boxes.move(i, by);
            bounds.move(i, by);
        }
        // one that is empty and contained by its bounds
        if (step == 5) boxes.bounds[11].low.y() = kNan;
        outer->update(bounds.bounds);
        std::vector<int> calls(300, 0), wanted(300, 0);
        const std::span<const BodyPair> found =
            lazy.find_pairs(*outer, boxes.bounds.size(), [&](std::uint32_t body) {
                ++calls[body];
                return boxes.bounds[body];
            });
        const std::vector<BodyPair> expected = compare_all(boxes.bounds, 0.0);
        pair_count += expected.size();
        EXPECT_TRUE(std::equal(found.begin(), found.end(), expected.begin(), expected.end()));
        for (const BodyPair& pair : compare_all(bounds.bounds, 0.0)) {
            wanted[pair.a] = wanted[pair.b] = 1;
        }
        EXPECT_EQ(calls, wanted);
        const auto computed = static_cast<std::size_t>(std::count(calls.begin(), calls.end(), 1));
        EXPECT_EQ(lazy.computed_count(), computed);
        EXPECT_LT(computed, 300u);
    }
    EXPECT_GT(pair_count, 100u);
}

// Pairs kept over many updates, against a comparison of all boxes.

/// Whether every kind of broadphase, kept through all steps, finds the pairs of a fresh comparison of all boxes.
///
/// @param move void(Crowd&, step): called before each step
void expect_fresh_pairs(Crowd bodies, int steps, const std::function<void(Crowd&, int)>& move) {
    const auto sap = make_broadphase(BroadphaseKind::sap, 0.01);
    const auto grid = make_broadphase(BroadphaseKind::grid, 0.01);
    for (int step = 0; step < steps; ++step) {
        SCOPED_TRACE("step " + std::to_string(step));
        move(bodies, step);
        for (Broadphase* const kept : {sap.get(), grid.get()}) {
            ASSERT_NO_FATAL_FAILURE(expect_all_pairs(*kept, bodies, 0.01));
        }
    }
}

TEST(KeptPairs, AreThoseOfAFreshComparisonWhileAllMove) {
    SeededRandom random(kSeed);
    Crowd bodies = make_spread(random, 300, {12.0, 12.0, 12.0});
    std::vector<Eigen::Vector3d> velocities;
    for (int i = 0; i < 300; ++i) velocities.push_back(random.direction() / 60.0);
    expect_fresh_pairs(bodies, 80, [&](Crowd& all, int) {
        for (std::size_t i = 0; i < velocities.size(); ++i) all.move(i, velocities[i]);
    });
}

TEST(KeptPairs, AreThoseOfAFreshComparisonWhileAFewCrossTheOthers) {
    SeededRandom random(kSeed + 1);
    Crowd bodies = make_spread(random, 300, {10.0, 10.0, 10.0});
    for (int i = 0; i < 5; ++i) bodies.move(static_cast<std::size_t>(50 * i), {-20.0, 0.0, 0.0});
    expect_fresh_pairs(bodies, 40, [&](Crowd& all, int step) {
        // one body is added every eight steps
        for (int i = 0; i <= step / 8; ++i) {
            all.move(static_cast<std::size_t>(50 * i), {1.3, 0.1 * i, 0.0});
        }
    });
}

TEST(KeptPairs, AreThoseOfAFreshComparisonWhereEveryStepIsFar) {
    SeededRandom random(kSeed + 2);
    Crowd bodies = make_spread(random, 100, {8.0, 8.0, 8.0});
    expect_fresh_pairs(bodies, 60, [&](Crowd& all, int step) {
        // at rest from step 30 to 50
        if (step >= 30 && step < 50) return;
        for (std::size_t i = 0; i < all.bounds.size(); ++i) {
            all.move(i, 3.0 * random.direction() - 0.2 * all.middle(i));
        }
    });
}

TEST(KeptPairs, HoldWhereAllAreInOnePlaceAndWhereSizesDifferByAnyFactor) {
    Crowd bodies;
    for (int i = 0; i < 40; ++i) bodies.add({1.0, 2.0, 3.0}, 0.0);
    for (int i = 0; i < 30; ++i) bodies.add({1.0, 2.0, 3.0}, std::pow(10.0, i - 15));
    bodies.add({0.0, 0.0, 0.0}, 1e149);
    expect_fresh_pairs(bodies, 20, [&](Crowd& all, int step) {
        for (std::size_t i = 0; i < all.bounds.size(); i += 3) {
            all.move(i, {0.01 * step, 0.0, -0.02});
        }
    });
}

TEST(KeptPairs, FollowBoxesThatBecomeEmptyWithoutMoving) {
    Random random(kSeed + 3);
    Crowd whole = make_spread(random, 60, {3.0, 3.0, 3.0});
    whole.add({1.5, 1.5, 1.5}, 0.05);
    expect_fresh_pairs(whole, 24, [&](Crowd& all, int step) {
        all = whole;
        if (step % 8 < 4) return;
        all.bounds[7].low.y() = kNan;
        all.bounds[8].high.z() = kInfinity;
        // inverted within its enlarged box
        std::swap(all.bounds.back().low, all.bounds.back().high);
        if (step % 8 < 6) return;
        for (std::size_t i = 20; i < 50; ++i) all.bounds[i].high.x() = kNan;
    });
}

TEST(KeptPairs, AreThoseOfTheLastOfSeveralUpdates) {
    Random random(kSeed + 4);
    Crowd bodies = make_spread(random, 100, {6.0, 6.0, 6.0});
    const auto kept = make_broadphase(BroadphaseKind::grid, 0.0);
    for (int step = 0; step < 60; ++step) {
        // different bodies in each step: none, a few, or more than the limit for updating boxes one by one
        for (int i = 0; i < step % 7 * 2; ++i) {
            bodies.move(static_cast<std::size_t>((11 * step + i) % 100), 1.5 * random.direction());
        }
        if (step % 3 != 0) {
            kept->update(bodies.bounds);
        } else {
            ASSERT_NO_FATAL_FAILURE(expect_all_pairs(*kept, bodies, 0.0)) << step;
        }
    }
}

TEST(KeptPairs, AreNotSoughtAgainWhereNobodyLeavesItsBox) {
    Random random(kSeed + 5);
    Crowd bodies = make_spread(random, 1000, {30.0, 30.0, 30.0});
    const auto kept = make_broadphase(BroadphaseKind::grid, 0.0);
    for (int step = 0; step < 10; ++step) {
        for (std::size_t i = 0; i < bodies.bounds.size(); ++i) {
            bodies.move(i, 0.02 * random.direction());
        }
        kept->update(bodies.bounds);
        kept->find_pairs();
        if (step < 2) continue;
        EXPECT_EQ(kept->update_operations(), bodies.bounds.size()) << step;
        EXPECT_LT(kept->candidate_count(), bodies.bounds.size()) << step;
    }
}

}  // namespace broadphase_test
}  // namespace terrane
