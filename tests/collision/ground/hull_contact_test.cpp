// SPDX-License-Identifier: MIT
#include "ground_checks.h"
#include "hull_cases.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

namespace terrane {
namespace hull_contact_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261102;

TEST(HullDistance, IsThatOfTheBoxWhoseCornersItHas) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    for (const Scene& scene : make_scenes()) {
        SCOPED_TRACE(scene.name);
        const Ground ground = make_test_ground(scene.height, 1.0, 1);
        for (int i = 0; i < 60; ++i) {
            const Box box{
                {random.between(0.3, 2.0), random.between(0.3, 2.0), random.between(0.3, 2.0)}};
            const ConvexHull hull = make_hull(box_corners(box.half_extents));
            Pose pose = random_pose(random, ground, 0.0, 4.0);
            // Apart at first, then with a small overlap.
            for (const bool is_overlapping : {false, true}) {
                if (is_overlapping)
                    pose.translation.z() += compute_lift(box, pose, ground).lift - 0.001;
                const DistanceAnswer of_box = signed_distance(box, pose, ground, 10.0);
                const DistanceAnswer of_hull = signed_distance(hull, pose, ground, 10.0);
                ASSERT_EQ(of_hull.status, of_box.status);
                if (of_box.distance < -0.1 * smallest_half_extent(box)) continue;
                EXPECT_NEAR(of_hull.distance, of_box.distance, 1e-9);
                std::array<Contact, 64> contacts;
                const bool has_contacts = find_contacts(box, pose, ground, 0.0, contacts).count > 0;
                EXPECT_EQ(find_contacts(hull, pose, ground, 0.0, contacts).count > 0, has_contacts);
            }
        }
    }
}

TEST(HullContacts, OfALevelBoxAreItsFourVertices) {
    const Ground ground = make_test_ground([](double, double) { return 2.0; }, 1.0, 1);
    const ConvexHull hull = make_hull(box_corners({3.2, 2.1, 0.5}));
    std::array<Contact, 8> contacts;
    const ContactAnswer answer =
        find_contacts(hull, pose_at(64.3, 64.4, 2.49), ground, 0.0, contacts);
    ASSERT_EQ(answer.count, 4u);
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_NEAR(contacts[i].depth, 0.01, 1e-12);
        EXPECT_EQ(contacts[i].normal, Eigen::Vector3d::UnitZ());
        const ShapeFeature& feature = contacts[i].feature;
        ASSERT_EQ(feature.first, feature.second);
        const Eigen::Vector3d corner =
            hull.vertices()[feature.first] + Eigen::Vector3d(64.3, 64.4, 2.49);
        EXPECT_NEAR((contacts[i].point_world - corner).norm(), 0.0, 1e-12);
    }
}

TEST(HullContacts, FindASpikeUnderTheMiddleOfAFace) {
    Contact contact;
    expect_spike_under_the_middle(make_hull(box_corners({3.0, 3.0, 0.5})), contact);
    EXPECT_EQ(contact.feature.second, ShapeFeature::kFace);
}

TEST(HullContacts, OfAPlankOverTwoRidgesKeepTheFeaturesOfItsEdges) {
    const Ground ground = make_test_ground(
        [](double x, double) { return x == 62.0 || x == 66.0 ? 0.5 : 0.0; }, 1.0, 1);
    {
        const ConvexHull plank = make_hull(box_corners({3.0, 0.25, 0.1}));
        std::array<ShapeFeature, 4> before;
        // Feature indices stay the same while the plank slides along the ridges, over many cells.
        for (int step = 0; step < 40; ++step) {
            const Pose pose = pose_at(64.0, 60.3 + 0.1 * step, 0.599);
            std::array<Contact, 16> contacts;
            const ContactAnswer answer = find_contacts(plank, pose, ground, 0.0, contacts);
            ASSERT_EQ(answer.count, 4u);
            std::sort(contacts.begin(), contacts.begin() + 4,
                      [](const Contact& a, const Contact& b) {
                          return a.point_world.x() + 2.0 * a.point_world.y() <
                                 b.point_world.x() + 2.0 * b.point_world.y();
                      });
            for (std::size_t i = 0; i < 4; ++i) {
                EXPECT_NEAR(contacts[i].depth, 0.001, 1e-9);
                EXPECT_NEAR(std::abs(contacts[i].point_world.y() - pose.translation.y()), 0.25,
                            1e-9);
                EXPECT_NE(contacts[i].feature.first, contacts[i].feature.second);
                EXPECT_NE(contacts[i].feature.second, ShapeFeature::kFace);
                if (step > 0) {
                    EXPECT_EQ(contacts[i].feature, before[i]);
                }
                before[i] = contacts[i].feature;
            }
        }
    }
}

TEST(ShapeFeatures, AreThoseThatTouchTheGround) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    std::array<Contact, 8> contacts;
    const auto expect_features = [&](const Shape& shape, const Pose& pose,
                                     std::vector<ShapeFeature> expected) {
        const ContactAnswer answer = find_contacts(shape, pose, ground, 0.0, contacts);
        ASSERT_EQ(answer.count, expected.size());
        for (const ShapeFeature& feature : expected) {
            const auto is_expected = [&](const Contact& contact) {
                return contact.feature == feature;
            };
            EXPECT_EQ(std::count_if(contacts.begin(), contacts.begin() + answer.count, is_expected),
                      1)
                << feature.first << ' ' << feature.second;
        }
    };
    expect_features(Sphere{0.5}, pose_at(64.3, 64.4, 0.49), {{0, 0}});
    expect_features(Capsule{0.25, 0.5}, pose_at(64.3, 64.4, 0.74), {{0, 0}});
    Motion turn;
    turn.rotation_vector = 1.5707963267948966 * Eigen::Vector3d::UnitX();
    Pose lying = turn.at(1.0);
    lying.translation = {64.3, 64.45, 0.24};
    expect_features(Capsule{0.25, 0.5}, lying, {{0, 0}, {1, 1}});
    expect_features(Box{{0.3, 0.2, 0.5}}, pose_at(64.5, 64.7, 0.49),
                    {{0, 0}, {1, 1}, {2, 2}, {3, 3}});
    lying.translation.z() = 0.19;
    expect_features(Box{{0.3, 0.2, 0.2}}, lying, {{0, 0}, {1, 1}, {4, 4}, {5, 5}});
    // A spike under the middle of each face, and a ridge under an edge.
    const Ground spike = make_test_ground(
        [](double x, double y) { return x == 64.0 && y == 64.0 ? 1.0 : 0.0; }, 1.0, 1);
    const Shape cube = Box{{0.5, 0.5, 0.5}};
    const std::array<Eigen::Vector3d, 6> turns{
        {{0, -1, 0}, {0, 1, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {2, 0, 0}}};
    for (std::uint32_t face = 0; face < 6; ++face) {
        turn.rotation_vector = 1.5707963267948966 * turns[face];
        Pose pose = turn.at(1.0);
        pose.translation = {64.1, 64.2, 1.49};
        ASSERT_EQ(find_contacts(cube, pose, spike, 0.0, contacts).count, 1u);
        EXPECT_NEAR((pose.rotation.transpose() * -Eigen::Vector3d::UnitZ())[face / 2],
                    face % 2 == 0 ? -1.0 : 1.0, 1e-12);
        EXPECT_EQ(contacts[0].feature, (ShapeFeature{face, ShapeFeature::kFace}));
    }
    const Ground ridge =
        make_test_ground([](double x, double) { return -std::abs(x - 64.0); }, 1.0, 1);
    turn.rotation_vector = 0.78539816339744831 * Eigen::Vector3d::UnitX();
    Pose tilted = turn.at(1.0);
    tilted.translation = {64.0, 64.5, 0.5 * std::sqrt(2.0) - 0.01};
    ASSERT_EQ(find_contacts(cube, tilted, ridge, 0.0, contacts).count, 1u);
    EXPECT_EQ(contacts[0].feature, (ShapeFeature{0, 1}));
    Pose lying_across;
    turn.rotation_vector = 1.5707963267948966 * Eigen::Vector3d::UnitY();
    lying_across = turn.at(1.0);
    lying_across.translation = {64.1, 64.5, 0.24};
    ASSERT_GE(find_contacts(Capsule{0.25, 0.5}, lying_across, ridge, 0.0, contacts).count, 1u);
    EXPECT_EQ(contacts[0].feature, (ShapeFeature{0, 1}));
}

TEST(HullContacts, OfTenThousandPointsAreThoseOfTheirSphere) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const ConvexHull hull = make_hull(sphere(random, 10'000));
    const Ground ground =
        make_test_ground([](double x, double y) { return hash_height(x, y); }, 1.0, 1);
    for (int i = 0; i < 5; ++i) {
        Pose pose = random_pose(random, ground, 1.0, 2.0);
        pose.translation.z() += compute_lift(hull, pose, ground).lift - 0.02;
        std::array<Contact, 64> contacts;
        const ContactAnswer answer = find_contacts(hull, pose, ground, 0.0, contacts);
        ASSERT_GE(answer.count, 1u);
        const Eigen::Vector3d d = resolve({contacts.data(), answer.count});
        EXPECT_LE(compute_lift(hull, moved(pose, d), ground).lift, 2e-9);
        const double of_sphere = signed_distance(Sphere{1.0}, pose, ground, 1.0).distance;
        EXPECT_NEAR(signed_distance(hull, pose, ground, 1.0).distance, of_sphere, 1e-3);
        pose.translation.z() += 0.5;
        EXPECT_NEAR(signed_distance(hull, pose, ground, 1.0).distance,
                    signed_distance(Sphere{1.0}, pose, ground, 1.0).distance, 1e-3);
    }
}

}  // namespace hull_contact_test
}  // namespace terrane
