// SPDX-License-Identifier: MIT
#pragma once

#include "ground_cases.h"

#include <gtest/gtest.h>

// Expectations about casts that hold for every kind of shape.
namespace terrane::test {

/// Samples the motion up to a fraction and expects no overlap.
inline void expect_no_overlap(const Shape& shape, const Motion& motion, const Ground& ground,
                              double fraction) {
    constexpr int kSteps = 300;
    for (int k = 0; k <= kSteps; ++k) {
        const double t = fraction * k / kSteps;
        const double lift = compute_lift(shape, motion.at(t), ground).lift;
        ASSERT_LE(lift, 1e-9) << "at " << t << " of " << fraction;
    }
}

/// For a shape that starts separated: it stops outside the ground, within the tolerance of it.
inline void expect_stops_at_the_ground(const Shape& shape, const Motion& motion,
                                       const Ground& ground) {
    const CastAnswer answer = cast(shape, motion, ground);
    ASSERT_EQ(answer.status, QueryStatus::complete);
    EXPECT_FALSE(answer.started_in_contact);
    expect_no_overlap(shape, motion, ground, answer.fraction);
    if (!answer.hit) {
        EXPECT_EQ(answer.fraction, 1.0);
        return;
    }
    const double distance =
        signed_distance(shape, motion.at(answer.fraction), ground, 1.0).distance;
    EXPECT_GE(distance, -1e-9);
    EXPECT_LE(distance, 1e-4);
    EXPECT_GT(answer.contact.normal.z(), 0.0);
    EXPECT_NEAR(answer.contact.depth, 0.0, 1e-4 + 1e-9);
}

/// The wall is at x = 64; the shape's origin stops within 5 m before it, or just behind where the shape is off its
/// origin.
inline void expect_hits_a_thin_wall_at_any_speed(const Shape& shape) {
    const Ground ground =
        make_test_ground([](double x, double) { return x == 64.0 ? 50.0 : 0.0; }, 1.0, 1);
    for (const double distance : {100.0, 300.0, 1e6}) {
        for (const double spin : {0.0, 2.0, 40.0}) {
            Motion motion = straight({10.0, 60.3, 20.0}, {distance, 0.0, 0.0});
            motion.rotation_vector = {0.3 * spin, spin, 0.1 * spin};
            const CastAnswer answer = cast(shape, motion, ground);
            ASSERT_TRUE(answer.hit);
            const Pose met = motion.at(answer.fraction);
            EXPECT_GT(met.translation.x(), 59.0);
            EXPECT_LT(met.translation.x(), 64.5);
            EXPECT_LE(compute_lift(shape, met, ground).lift, 1e-9);
        }
    }
}

/// Motions just above a plane, over seams of cells and root squares, hit nothing.
inline void expect_slides_over_flat_seams(Random& random, const Shape& shape, int count) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 2);
    for (int i = 0; i < count; ++i) {
        Motion motion;
        motion.start.rotation =
            i == 0 ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : random.rotation();
        motion.start.translation = {120.0, 120.0 + random.between(0.0, 16.0), 0.0};
        const double lift = compute_lift(shape, motion.start, ground).lift;
        motion.start.translation.z() = lift + 1.01e-4;
        motion.translation = {16.0, random.between(-8.0, 8.0), 0.0};
        const CastAnswer answer = cast(shape, motion, ground);
        EXPECT_FALSE(answer.hit) << answer.fraction;
    }
}

inline void expect_reports_touch_and_overlap_at_the_start(const Shape& shape) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    const double touching_z = compute_lift(shape, pose_at(64.3, 64.4, 0.0), ground).lift;
    for (const double depth : {0.0, 0.01, 2.0, 1000.0}) {
        const CastAnswer answer =
            cast(shape, straight({64.3, 64.4, touching_z - depth}, {1.0, 0.0, 1.0}), ground);
        EXPECT_TRUE(answer.hit);
        EXPECT_TRUE(answer.started_in_contact);
        EXPECT_EQ(answer.fraction, 0.0);
        EXPECT_NEAR(answer.contact.depth, depth, 1e-9);
    }
}

/// For a shape whose half extents are 0.5 m in z and at most 1 m in x and y.
inline void expect_skips_separating_contacts(const Shape& shape) {
    const Ground ground =
        make_test_ground([](double x, double) { return x > 70.0 ? x - 70.0 : 0.0; }, 1.0, 1);
    CastSettings settings;
    settings.skip_separating = true;
    for (const double depth : {0.0, 0.01}) {
        const Eigen::Vector3d from(60.3, 64.4, 0.5 - depth);
        EXPECT_FALSE(cast(shape, straight(from, {0.0, 0.0, 1.0}), ground, settings).hit);
        EXPECT_FALSE(cast(shape, straight(from, {3.0, 2.0, 0.0}), ground, settings).hit);
        const CastAnswer closing = cast(shape, straight(from, {0.0, 0.0, -1.0}), ground, settings);
        EXPECT_TRUE(closing.hit);
        EXPECT_TRUE(closing.started_in_contact);
        EXPECT_EQ(closing.fraction, 0.0);
        const CastAnswer slope = cast(shape, straight(from, {30.0, 0.0, 0.0}), ground, settings);
        EXPECT_TRUE(slope.hit);
        EXPECT_GT(slope.fraction, 0.25);
        EXPECT_LT(slope.fraction, 0.35);
    }
}

}  // namespace terrane::test
