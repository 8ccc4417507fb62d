// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <array>
#include <cstddef>

// Casts of two shapes that move towards each other.
namespace terrane::test {

/// Orthonormal starts, as bodies have them.
inline Motion motion_of(const Pose& pose, const Eigen::Vector3d& translation,
                        const Eigen::Vector3d& rotation_vector = Eigen::Vector3d::Zero()) {
    Motion motion;
    motion.start = {orthonormalized(pose.rotation), pose.translation};
    motion.translation = translation;
    motion.rotation_vector = rotation_vector;
    return motion;
}

struct Thrown {
    Motion a, b;
};

/// Motions of pair i: usually apart at the start, one aimed near the other, with or without rotation.
inline Thrown throw_together(Random& random, const Pose& pose_a, Pose pose_b, int i) {
    const double distance =
        std::array<double, 3>{3.0, 10.0, 100.0}[static_cast<std::size_t>(i % 3)];
    const double spin = std::array<double, 4>{0.0, 0.3, 3.0, 25.0}[static_cast<std::size_t>(i % 4)];
    const Eigen::Vector3d from = random.direction();
    pose_b.translation = pose_a.translation + random.between(0.3, 0.9) * distance * from;
    const Eigen::Vector3d both = 20.0 * random.direction();
    // Named, so that every compiler draws in the same order.
    const Eigen::Vector3d aside = 0.5 * random.direction();
    const Eigen::Vector3d spin_a = spin * random.direction();
    const Eigen::Vector3d spin_b = spin * random.direction();
    return {motion_of(pose_a, both + distance * from + aside, spin_a),
            motion_of(pose_b, both, spin_b)};
}

/// Before the reported time the distance is never below touching; at a hit it is within the tolerance.
///
/// @param distance_at of a fraction of the motions
/// accuracy of the distances, metres
template <class Answer, class DistanceAt>
void expect_stops_where_they_meet(const Answer& answer, DistanceAt&& distance_at, int steps,
                                  const CastSettings& settings, double slack) {
    EXPECT_FALSE(answer.started_in_contact);
    for (int k = 0; k <= steps; ++k) {
        EXPECT_GE(distance_at(answer.fraction * k / steps), -1e-12) << k;
    }
    if (!answer.hit) {
        EXPECT_EQ(answer.fraction, 1.0);
        EXPECT_EQ(answer.count, 0u);
        return;
    }
    const double there = distance_at(answer.fraction);
    EXPECT_LE(there, settings.tolerance + slack);
    ASSERT_GT(answer.count, 0u);
    EXPECT_NEAR(answer.contacts[0].depth, -there, 1e-9);
}

}  // namespace terrane::test
