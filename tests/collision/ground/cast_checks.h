// SPDX-License-Identifier: MIT
#pragma once

#include "ground_cases.h"

#include <gtest/gtest.h>

// What holds of casts for every kind of shape.
namespace terrane::test {

/// Walks the motion up to a fraction and looks for a place in the ground.
inline void expect_free(const Shape& shape, const Motion& motion, const Ground& ground,
                        double fraction) {
    constexpr int kSteps = 300;
    for (int k = 0; k <= kSteps; ++k) {
        const double t = fraction * k / kSteps;
        const double lift = compute_lift(shape, motion.at(t), ground).lift;
        ASSERT_LE(lift, 1e-9) << "at " << t << " of " << fraction;
    }
}

/// Of a shape that starts clear: it stops outside the ground, and within the tolerance of it.
inline void expect_stops_at_the_ground(const Shape& shape, const Motion& motion,
                                       const Ground& ground) {
    const CastAnswer answer = cast(shape, motion, ground);
    ASSERT_EQ(answer.status, QueryStatus::complete);
    EXPECT_FALSE(answer.started_in_contact);
    expect_free(shape, motion, ground, answer.fraction);
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

/// The wall is at x = 64; the shape's origin stops between two places, so the shape reaches there.
inline void expect_meets_a_thin_wall_at_any_speed(const Shape& shape, double first_x,
                                                  double last_x) {
    const Ground ground =
        make_test_ground([](double x, double) { return x == 64.0 ? 50.0 : 0.0; }, 1.0, 1);
    for (const double way : {100.0, 300.0, 1e6}) {
        for (const double spin : {0.0, 2.0, 40.0}) {
            Motion motion = straight({10.0, 60.3, 20.0}, {way, 0.0, 0.0});
            motion.rotation_vector = {0.3 * spin, spin, 0.1 * spin};
            const CastAnswer answer = cast(shape, motion, ground);
            ASSERT_TRUE(answer.hit);
            const Pose met = motion.at(answer.fraction);
            EXPECT_GT(met.translation.x(), first_x);
            EXPECT_LT(met.translation.x(), last_x);
            EXPECT_LE(compute_lift(shape, met, ground).lift, 1e-9);
        }
    }
}

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

/// @param touching_z where the shape's origin is when it touches the ground at z = 0
inline void expect_reports_touch_and_overlap_at_the_start(const Shape& shape, double touching_z) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    for (const double depth : {0.0, 0.01, 2.0, 1000.0}) {
        const CastAnswer answer =
            cast(shape, straight({64.3, 64.4, touching_z - depth}, {1.0, 0.0, 1.0}), ground);
        EXPECT_TRUE(answer.hit);
        EXPECT_TRUE(answer.started_in_contact);
        EXPECT_EQ(answer.fraction, 0.0);
        EXPECT_NEAR(answer.contact.depth, depth, 1e-9);
    }
}

/// Of a shape that is half a metre high and no more than a metre wide on either side.
inline void expect_passes_over_separating_contacts(const Shape& shape) {
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
