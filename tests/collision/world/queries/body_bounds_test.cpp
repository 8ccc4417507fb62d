// SPDX-License-Identifier: MIT
#include "world_cases.h"

#include <gtest/gtest.h>

namespace terrane {
namespace body_bounds_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261126;

/// Largest coordinate of a shape along a world axis, by its convex pieces.
double support_along(const Shape& shape, const Pose& pose, const Eigen::Vector3d& axis) {
    double most = -std::numeric_limits<double>::infinity();
    for (const Piece& piece : pieces_of(shape, pose)) {
        const Eigen::Vector3d local = piece.world_from_piece.rotation.transpose() * axis;
        most = std::max(most, axis.dot(piece.world_from_piece.translation) +
                                  support_distance(as_shape(piece.shape), local));
    }
    return most;
}

TEST(ComputeAabb, ContainsTheShapeAndIsTightForConvexShapes) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    for (int i = 0; i < 3000 && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const Shape& shape = TestScene::any_shape(random);
        Pose pose;
        if (i % 3 > 0) pose.rotation = random.rotation();
        const double far = i % 4 == 0 ? 1e7 : 10.0;
        pose.translation = far * random.direction();
        const Aabb box = internal::compute_aabb(shape, pose);
        const Aabb any_rotation = internal::compute_rotating_aabb(shape, pose.translation);
        // The oracle's own rounding.
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
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 1);
    Random random(kSeed + 1);
    int touching = 0;
    for (int i = 0; i < 2000 && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const Shape& a = TestScene::any_shape(random);
        const Shape& b = TestScene::any_shape(random);
        Pose pose_a, pose_b;
        if (i % 3 > 0) pose_a.rotation = random.rotation();
        if (i % 3 > 1) pose_b.rotation = random.rotation();
        pose_a.translation = (i % 2 == 0 ? 1e7 : 1.0) * random.direction();
        // One is moved until they just touch, which their boxes must see.
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
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 2);
    Random random(kSeed + 2);
    for (int i = 0; i < 2000 && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const int axis = i % 3;
        const bool is_far = i % 2 == 0;
        const double radius = random.between(0.1, 1.0);
        const Shape ball = Sphere{radius};
        Pose a, b;
        a.translation[axis] = (is_far ? 1e7 : 1.0) * random.between(-1.0, 1.0);
        // Far away the coordinates have a grid of nanometres, near the origin touching has a tolerance.
        b.translation[axis] = a.translation[axis] + 2.0 * radius + (is_far ? 0.0 : 1e-12 * radius);
        if (b.translation[axis] - a.translation[axis] > 2.0 * radius && is_far) {
            b.translation[axis] = std::nextafter(b.translation[axis], -1e9);
        }
        ASSERT_TRUE(test_contact(ball, a, ball, b).is_touching);
        EXPECT_TRUE(internal::overlap(internal::compute_aabb(ball, a),
                                      internal::compute_aabb(ball, b), 0.0));
    }
}

}  // namespace body_bounds_test
}  // namespace terrane
