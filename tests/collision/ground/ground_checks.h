// SPDX-License-Identifier: MIT
#pragma once

#include "ground_cases.h"

#include <gtest/gtest.h>

// Checks of queries for any kind of shape.
namespace terrane::test {

/// Contacts are sorted by depth, and the shortest translation that resolves all of them separates the shape. Counts the
/// calls with an overlap.
inline void expect_separated_by_contacts(const Shape& shape, const Pose& pose, const Ground& ground,
                                         long& overlapping) {
    std::array<Contact, 256> contacts;
    const ContactAnswer answer = find_contacts(shape, pose, ground, 0.0, contacts);
    ASSERT_EQ(answer.status, QueryStatus::ok);
    if (answer.lift <= 0.0) return;
    ++overlapping;
    EXPECT_NEAR(answer.lift, compute_lift(shape, pose, ground).lift, 1e-12);
    ASSERT_GT(answer.count, 0u);
    const Eigen::Vector3d d = resolve({contacts.data(), answer.count});
    EXPECT_LE(compute_lift(shape, moved(pose, d), ground).lift, 2e-9);
    for (std::size_t k = 0; k < answer.count; ++k) {
        EXPECT_NEAR(contacts[k].normal.norm(), 1.0, 1e-12);
        EXPECT_GT(contacts[k].normal.z(), 0.0);
        if (!std::holds_alternative<Compound>(shape)) {
            EXPECT_EQ(contacts[k].part, 0u);
        }
        if (k > 0) {
            EXPECT_GE(contacts[k - 1].depth, contacts[k].depth);
        }
    }
}

/// The translation that signed_distance() returns separates the shape.
inline void expect_separated_by_distance(const Shape& shape, const Pose& pose,
                                         const Ground& ground) {
    const DistanceAnswer answer = signed_distance(shape, pose, ground, 1.0);
    EXPECT_LE(compute_lift(shape, moved(pose, -answer.distance * answer.normal), ground).lift,
              1e-9);
}

/// One kilometre below the ground there is a contact, and the minimum translation separates.
inline void expect_pushed_up_from_a_kilometre_below(const Shape& shape) {
    const Ground ground = make_test_ground(hash_height, 1.0, 1);
    const Pose pose = pose_at(64.3, 64.4, -1000.0);
    std::array<Contact, 64> contacts;
    const ContactAnswer answer = find_contacts(shape, pose, ground, 0.0, contacts);
    ASSERT_EQ(answer.status, QueryStatus::ok);
    EXPECT_GE(answer.lift, 1000.0 + support_distance(shape, -Eigen::Vector3d::UnitZ()) - 1e-9);
    ASSERT_GE(answer.count, 1u);
    EXPECT_LT(signed_distance(shape, pose, ground, 1.0).distance, 0.0);
    expect_separated_by_distance(shape, pose, ground);
}

/// For a shape that is a single point: at, below and above a slope.
inline void expect_answers_of_a_point(const Shape& shape) {
    const Ground ground =
        make_test_ground([](double x, double y) { return 0.25 * x + 0.5 * y; }, 1.0, 1);
    const double surface = 0.25 * 64.3 + 0.5 * 64.4;
    const double upright = 1.0 / std::sqrt(1.0 + 0.25 * 0.25 + 0.5 * 0.5);
    for (const double below : {0.0, 0.01, 30.0}) {
        const Pose pose = pose_at(64.3, 64.4, surface - below);
        EXPECT_NEAR(compute_lift(shape, pose, ground).lift, below, 1e-12);
        EXPECT_NEAR(signed_distance(shape, pose, ground, 1.0).distance, -below * upright, 1e-9);
        EXPECT_TRUE(test_contact(shape, pose, ground).is_touching);
    }
    EXPECT_NEAR(signed_distance(shape, pose_at(64.3, 64.4, surface + 0.5), ground, 1.0).distance,
                0.5 * upright, 1e-9);
}

/// For a box, or a hull equal to it, of half extents 3 x 3 x 0.5 m above a spike.
inline void expect_spike_under_the_middle(const Shape& box, Contact& contact_out) {
    const Ground ground = make_test_ground(
        [](double x, double y) { return x == 64.0 && y == 64.0 ? 1.0 : 0.0; }, 1.0, 1);
    std::array<Contact, 8> contacts;
    const ContactAnswer answer =
        find_contacts(box, pose_at(64.0, 64.0, 1.49), ground, 0.0, contacts);
    ASSERT_EQ(answer.count, 1u);
    contact_out = contacts[0];
    EXPECT_NEAR(contact_out.depth, 0.01, 1e-9);
    EXPECT_NEAR(contact_out.normal.z(), 1.0, 1e-9);
    EXPECT_NEAR((contact_out.point_world - Eigen::Vector3d(64.0, 64.0, 0.99)).norm(), 0.0, 1e-9);
}

}  // namespace terrane::test
