// SPDX-License-Identifier: MIT

#include "collision/world/body_cases.h"
#include "collision/world/world_cases.h"
#include "support/allocation_counter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane::body_bounds_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261126;

/// Largest coordinate of a shape along a world axis: the maximum over its convex pieces.
double support_along(const Shape& shape, const Pose& pose, const Eigen::Vector3d& axis) {
    double most = -kInfinity;
    for (const Piece& piece : pieces_of(shape, pose)) {
        const Eigen::Vector3d local = piece.world_from_piece.rotation.transpose() * axis;
        most = std::max(most, axis.dot(piece.world_from_piece.translation) +
                                  support_distance(as_shape(piece.shape), local));
    }
    return most;
}

TEST(ComputeAabb, ContainsTheShapeAndIsTightForConvexShapes) {
    SeededRandom random(kSeed);
    for (int i = 0; i < 3000 && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const Shape& shape = TestScene::any_shape(random);
        Pose pose;
        if (i % 3 > 0) pose.rotation = random.rotation();
        const double far = i % 4 == 0 ? 1e7 : 10.0;
        pose.translation = far * random.direction();
        const Aabb box = internal::compute_aabb(shape, pose);
        const Aabb any_rotation = internal::compute_rotating_aabb(shape, pose.translation);
        // Rounding of the oracle.
        const double rounding = 1e-15 * far;
        for (int axis = 0; axis < 3; ++axis) {
            const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
            const double high = support_along(shape, pose, unit);
            const double low = -support_along(shape, pose, -unit);
            EXPECT_GE(box.high[axis], high - rounding);
            EXPECT_LE(box.low[axis], low + rounding);
            EXPECT_GE(any_rotation.high[axis], high - rounding);
            EXPECT_LE(any_rotation.low[axis], low + rounding);
            if (shape.index() == 4) continue;
            EXPECT_LE(box.high[axis], high + 1e-14 * far + 1e-11);
            EXPECT_GE(box.low[axis], low - 1e-14 * far - 1e-11);
        }
    }
}

TEST(ComputeAabb, OverlapsWhereShapesTouch) {
    SeededRandom random(kSeed + 1);
    int touching = 0;
    for (int i = 0; i < 2000 && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const Shape& a = TestScene::any_shape(random);
        const Shape& b = TestScene::any_shape(random);
        Pose pose_a, pose_b;
        if (i % 3 > 0) pose_a.rotation = random.rotation();
        if (i % 3 > 1) pose_b.rotation = random.rotation();
        pose_a.translation = (i % 2 == 0 ? 1e7 : 1.0) * random.direction();
        // One shape is moved until they just touch; their boxes must then overlap.
        pose_b.translation = pose_a.translation + 3.0 * Eigen::Vector3d::Unit(i % 3);
        for (int step = 0; step < 4; ++step) {
            pose_b.translation[i % 3] -=
                std::max(0.0, signed_distance(b, pose_b, a, pose_a).distance);
        }
        if (!test_contact(a, pose_a, b, pose_b).is_touching) continue;
        ++touching;
        EXPECT_TRUE(internal::overlap(internal::compute_aabb(a, pose_a),
                                      internal::compute_aabb(b, pose_b), 0.0));
    }
    EXPECT_GT(touching, 100);
}

TEST(ComputeAabb, OverlapsWhereShapesTouchWithinRounding) {
    SeededRandom random(kSeed + 2);
    for (int i = 0; i < 2000 && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const int axis = i % 3;
        const bool is_far = i % 2 == 0;
        const double radius = random.between(0.1, 1.0);
        const Shape ball = Sphere{radius};
        Pose a, b;
        a.translation[axis] = (is_far ? 1e7 : 1.0) * random.between(-1.0, 1.0);
        // Far away coordinates are multiples of nanometres; near the origin touching has a tolerance.
        b.translation[axis] = a.translation[axis] + 2.0 * radius + (is_far ? 0.0 : 1e-12 * radius);
        if (b.translation[axis] - a.translation[axis] > 2.0 * radius && is_far) {
            b.translation[axis] = std::nextafter(b.translation[axis], -1e9);
        }
        ASSERT_TRUE(test_contact(ball, a, ball, b).is_touching);
        EXPECT_TRUE(internal::overlap(internal::compute_aabb(ball, a),
                                      internal::compute_aabb(ball, b), 0.0));
    }
}

}  // namespace terrane::body_bounds_test

namespace terrane::body_tree_test {

using internal::BodyTree;
using internal::BoxSweep;
using namespace test;

constexpr std::uint64_t kSeed = 20261125;
using Slots = std::vector<std::uint32_t>;

Aabb random_box(Random& random, double width) {
    const double x = random.between(0.0, width), y = random.between(0.0, width);
    const double z = random.between(0.0, width);
    const Eigen::Vector3d half = random.between(0.0, 1.0) * random.direction().cwiseAbs();
    return {Eigen::Vector3d(x, y, z) - half, Eigen::Vector3d(x, y, z) + half};
}

/// Empty boxes in several representations.
const Aabb& no_box(int i) {
    static const std::array<Aabb, 5> boxes{
        Aabb{{1.0, 1.0, 1.0}, {0.0, 0.0, 0.0}},   {{0.0, kNan, 0.0}, {9.0, 9.0, 9.0}},
        {{kNan, kNan, kNan}, {kNan, kNan, kNan}}, {{0.0, 0.0, -kInfinity}, {1.0, 1.0, kInfinity}},
        {{0.0, 0.0, 2.0}, {9.0, 9.0, 1.0}},  // along one axis only
    };
    return boxes[static_cast<std::size_t>(i) % boxes.size()];
}

double width_of(std::size_t count) { return 3.0 * std::cbrt(static_cast<double>(count)) + 1.0; }

std::vector<Aabb> random_boxes(Random& random, std::size_t count) {
    std::vector<Aabb> boxes;
    for (std::size_t i = 0; i < count; ++i) {
        boxes.push_back(random_box(random, width_of(count)));
        if (i % 7 == 4) boxes.back() = no_box(random.below(5));
        if (i % 5 == 3) boxes.back() = boxes[i / 2];  // ties
    }
    return boxes;
}

bool is_empty(const Aabb& box) {
    return !(box.low.array() <= box.high.array()).all() || !box.low.allFinite() ||
           !box.high.allFinite();
}

/// Slots of the non-empty boxes that satisfy a predicate.
template <class Wanted>
Slots choose(const std::vector<Aabb>& boxes, const Wanted& is_wanted) {
    Slots slots;
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
        if (!is_empty(boxes[i]) && is_wanted(boxes[i])) slots.push_back(i);
    }
    return slots;
}

/// By ternary search: the distance of the sweep's point from the widened box is a convex function of the fraction.
bool touches_up_to(const BoxSweep& sweep, double limit, const Aabb& box) {
    const auto distance_at = [&](double t) {
        const Eigen::Vector3d at = sweep.from + t * sweep.displacement;
        const Eigen::Vector3d below = box.low - (at + sweep.reach.high);
        const Eigen::Vector3d above = (at + sweep.reach.low) - box.high;
        return below.cwiseMax(above).maxCoeff();
    };
    double first = 0.0, last = limit;
    for (int i = 0; i < 90; ++i) {
        const double left = first + (last - first) / 3.0, right = last - (last - first) / 3.0;
        if (distance_at(left) > distance_at(right)) {
            first = left;
        } else {
            last = right;
        }
    }
    return distance_at(first) <= 1e-12;
}

void expect_answers_of_brute_force(const BodyTree& tree, const std::vector<Aabb>& boxes,
                                   Random& random) {
    const double width = width_of(boxes.size());
    Slots found;
    const auto expect_found = [&](const auto& is_wanted) {
        std::ranges::sort(found);
        EXPECT_EQ(found, choose(boxes, is_wanted));
        found.clear();
    };
    for (int i = 0; i < 12; ++i) {
        SCOPED_TRACE(testing::Message() << "query " << i);
        const Aabb box = random_box(random, width);
        tree.visit_overlaps(box, [&](std::uint32_t slot) { found.push_back(slot); });
        expect_found([&](const Aabb& other) {
            return (other.low.array() <= box.high.array()).all() &&
                   (other.high.array() >= box.low.array()).all();
        });

        const double limit = i % 3 == 0 ? kInfinity : random.between(0.0, 0.5 * width);
        tree.visit_near(box, limit, [&](std::uint32_t slot) {
            found.push_back(slot);
            return limit;
        });
        expect_found([&](const Aabb& other) {
            const Eigen::Vector3d gap = (other.low - box.high).cwiseMax(box.low - other.high);
            return gap.cwiseMax(0.0).norm() <= limit;
        });

        BoxSweep sweep{.from = random_box(random, width).low, .reach = {}};
        sweep.displacement = random_box(random, width).low - sweep.from;
        if (i % 5 == 1) sweep.displacement[i % 3] = 0.0;
        if (i % 10 == 2) sweep.displacement.setZero();
        sweep.reach = {-random.between(0.0, 1.0) * random.direction().cwiseAbs(),
                       random.between(0.0, 1.0) * random.direction().cwiseAbs()};
        const double fraction = i % 2 == 0 ? 1.0 : random.between(0.0, 1.0);
        tree.visit_along(sweep, fraction, [&](std::uint32_t slot) {
            found.push_back(slot);
            return fraction;
        });
        expect_found([&](const Aabb& other) { return touches_up_to(sweep, fraction, other); });
    }
}

TEST(BodyTree, FindsTheBoxesThatBruteForceFindsAfterARefitToo) {
    SeededRandom random(kSeed);
    for (const std::size_t count : {0u, 1u, 2u, 3u, 50u, 500u}) {
        SCOPED_TRACE(testing::Message() << count << " boxes");
        std::vector<Aabb> boxes = random_boxes(random, count);
        BodyTree tree;
        tree.build(boxes);
        EXPECT_EQ(tree.slot_count(), count);
        ASSERT_NO_FATAL_FAILURE(expect_answers_of_brute_force(tree, boxes, random));
        for (int step = 0; step < 4; ++step) {
            for (Aabb& box : boxes) {
                // Boxes are added, removed and moved, by small and large distances.
                const int what = random.below(10);
                if (what == 0) box = no_box(random.below(5));
                if (what == 1) box = random_box(random, width_of(count));
                if (what < 5) continue;
                const Eigen::Vector3d by = random.between(0.0, 0.5) * random.direction();
                box = {box.low + by, box.high + by};
            }
            tree.refit(boxes);
            ASSERT_NO_FATAL_FAILURE(expect_answers_of_brute_force(tree, boxes, random));
        }
    }
}

TEST(BodyTree, FindsNothingAmongBoxesThatAreAllEmpty) {
    std::vector<Aabb> boxes;
    for (int i = 0; i < 20; ++i) boxes.push_back(no_box(i));
    BodyTree tree;
    tree.build(boxes);
    const auto fail = [](std::uint32_t slot) {
        ADD_FAILURE() << "slot " << slot;
        return 1.0;
    };
    const Aabb all{{-1e100, -1e100, -1e100}, {1e100, 1e100, 1e100}};
    tree.visit_overlaps(all, fail);
    tree.visit_near(all, kInfinity, fail);
    tree.visit_along(BoxSweep{.displacement = {1.0, 2.0, 3.0}, .reach = all}, 1.0, fail);
}

TEST(BodyTree, LooksAtFewBoxesOfMany) {
    SeededRandom random(kSeed + 2);
    std::vector<Aabb> boxes;
    const double width = width_of(20'000);
    for (int i = 0; i < 20'000; ++i) boxes.push_back(random_box(random, width));
    BodyTree tree;
    tree.build(boxes);
    int seen = 0;
    for (int i = 0; i < 100; ++i) {
        const WorldPos at = random_box(random, width).low;
        double nearest = kInfinity;
        tree.visit_near({at, at}, kInfinity, [&](std::uint32_t slot) {
            ++seen;
            nearest = std::min(nearest, internal::box_separation(boxes[slot], {at, at}));
            return nearest;
        });
        BoxSweep sweep{.from = at, .displacement = random_box(random, width).low - at, .reach = {}};
        double first = 1.0;
        tree.visit_along(sweep, first, [&](std::uint32_t slot) {
            ++seen;
            first = std::min(
                first, internal::segment_entry(sweep.from, sweep.displacement, boxes[slot], 0.0));
            return first;
        });
    }
    EXPECT_LT(seen, 100 * 2 * 20);
}

TEST(BodyTree, KeepsItsMemory) {
    Random random(kSeed + 3);
    const std::vector<Aabb> boxes = random_boxes(random, 500);
    BodyTree tree;
    tree.build(boxes);
    const AllocationCounter counter;
    tree.refit(boxes);
    tree.build(boxes);
    tree.build(std::span(boxes).first(100));
    tree.build(boxes);
    EXPECT_EQ(counter.count(), 0u);
}

TEST(BoxSeparation, IsMinusInfinityFromTheFirstTouchOn) {
    const Aabb unit{{0, 0, 0}, {1, 1, 1}};
    EXPECT_EQ(internal::box_separation(unit, {{1, 1, 1}, {2, 2, 2}}), -kInfinity);
    EXPECT_EQ(internal::box_separation(unit, {{4, 5, 0}, {5, 6, 2}}), 5.0);
    EXPECT_EQ(internal::box_separation({{-2, 0, 0}, {-1, 0, 0}}, unit), 1.0);
}

}  // namespace terrane::body_tree_test
