// SPDX-License-Identifier: MIT
#include "collision/ground/hull_cases.h"
#include "support/allocation_counter.h"

#include <terrane/collision/ground_cast.h>

#include <gtest/gtest.h>

#include <cstring>

namespace terrane {
namespace {

using namespace test;

constexpr std::uint64_t kSeed = 20261102;

TEST(HullContacts, FreeTheHullWhenResolved) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    for (const Scene& scene : make_scenes()) {
        SCOPED_TRACE(scene.name);
        const Ground ground = make_test_ground(scene.height, 1.0, 1);
        for (const NamedHull& named : make_hulls(random)) {
            SCOPED_TRACE(named.name);
            const ConvexHull hull = make_hull(named.points);
            for (int i = 0; i < 30; ++i) {
                const Pose pose = random_pose(random, ground, -1.0, 1.5);
                std::array<Contact, 256> contacts;
                const ContactAnswer answer = find_contacts(hull, pose, ground, 0.0, contacts);
                ASSERT_EQ(answer.status, ContactStatus::complete);
                if (answer.lift <= 0.0) continue;
                EXPECT_NEAR(answer.lift, compute_lift(hull, pose, ground).lift, 1e-12);
                ASSERT_GT(answer.count, 0u);
                const Eigen::Vector3d d = resolve({contacts.data(), answer.count});
                EXPECT_LE(compute_lift(hull, moved(pose, d), ground).lift, 2e-9);
                for (std::size_t k = 0; k < answer.count; ++k) {
                    const Contact& contact = contacts[k];
                    EXPECT_NEAR(contact.normal.norm(), 1.0, 1e-12);
                    EXPECT_GT(contact.normal.z(), 0.0);
                    EXPECT_EQ(contact.part, 0u);
                    if (k > 0) {
                        EXPECT_GE(contacts[k - 1].depth, contact.depth);
                    }
                }
            }
        }
    }
}

TEST(HullContacts, AreNoneApart) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed + 1);
    for (const Scene& scene : make_scenes()) {
        SCOPED_TRACE(scene.name);
        const Ground ground = make_test_ground(scene.height, 1.0, 1);
        for (const NamedHull& named : make_hulls(random)) {
            SCOPED_TRACE(named.name);
            const ConvexHull hull = make_hull(named.points);
            for (int i = 0; i < 30; ++i) {
                const Pose pose = random_pose(random, ground, 0.0, 3.0);
                if (compute_lift(hull, pose, ground).lift > -1e-6) continue;
                std::array<Contact, 64> contacts;
                const ContactAnswer touching = find_contacts(hull, pose, ground, 0.0, contacts);
                for (std::size_t k = 0; k < touching.count; ++k) EXPECT_LE(contacts[k].depth, 1e-8);
                // The nearest of all is among those within a margin.
                const double gap = signed_distance(hull, pose, ground, 5.0).distance;
                const ContactAnswer near = find_contacts(hull, pose, ground, gap + 1e-6, contacts);
                if (near.count == 0) continue;  // its direction is no normal of the ground
                EXPECT_LE(contacts[0].depth, -gap + 1e-9);
            }
        }
    }
}

TEST(HullDistance, FreesAndIsTheShortestOfManyDirections) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    int shallow_count = 0;
    int shorter_count = 0;
    for (const Scene& scene : make_scenes()) {
        SCOPED_TRACE(scene.name);
        const Ground ground = make_test_ground(scene.height, 1.0, 1);
        for (const NamedHull& named : make_hulls(random)) {
            SCOPED_TRACE(named.name);
            const ConvexHull hull = make_hull(named.points);
            for (int i = 0; i < 30; ++i) {
                Pose pose = random_pose(random, ground, -0.5, 1.5);
                // Half of them a hair in the ground.
                if (i % 2 == 0) {
                    pose.translation.z() +=
                        compute_lift(hull, pose, ground).lift - 0.02 * smallest_half_extent(hull);
                }
                const DistanceAnswer answer = signed_distance(hull, pose, ground, 5.0);
                if (answer.distance >= 0.0) continue;
                const double depth = -answer.distance;
                EXPECT_LE(compute_lift(hull, moved(pose, depth * answer.normal), ground).lift,
                          1e-9);
                if (depth > 0.05 * smallest_half_extent(hull)) continue;
                ++shallow_count;
                bool is_shorter = false;
                for (int k = 0; k < 100; ++k) {
                    Eigen::Vector3d n = random.direction();
                    if (k >= 50) n = (answer.normal + random.between(0.0, 0.3) * n).normalized();
                    const Pose there = moved(pose, (depth - 1e-9) * n);
                    if (!(compute_lift(hull, there, ground).lift > 0.0)) is_shorter = true;
                }
                if (is_shorter) ++shorter_count;
            }
        }
    }
    EXPECT_GT(shallow_count, 300);
    EXPECT_EQ(shorter_count, 0);
}

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
            // Apart at first, then a little in the ground.
            for (const bool is_sunk : {false, true}) {
                if (is_sunk) pose.translation.z() += compute_lift(box, pose, ground).lift - 0.001;
                const DistanceAnswer of_box = signed_distance(box, pose, ground, 10.0);
                const DistanceAnswer of_hull = signed_distance(hull, pose, ground, 10.0);
                ASSERT_EQ(of_hull.status, of_box.status);
                // Deeper, both are the shortest of what was tried.
                if (of_box.distance < -0.1 * smallest_half_extent(box)) continue;
                EXPECT_NEAR(of_hull.distance, of_box.distance, 1e-9);
                std::array<Contact, 64> contacts;
                const bool is_held = find_contacts(box, pose, ground, 0.0, contacts).count > 0;
                EXPECT_EQ(find_contacts(hull, pose, ground, 0.0, contacts).count > 0, is_held);
            }
        }
    }
}

TEST(HullContacts, OfAFlatBoxAreItsFourCornersByName) {
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

TEST(HullContacts, SeeASpikeUnderTheMiddleOfAFace) {
    const Ground ground = make_test_ground(
        [](double x, double y) { return x == 64.0 && y == 64.0 ? 1.0 : 0.0; }, 1.0, 1);
    const ConvexHull hull = make_hull(box_corners({3.0, 3.0, 0.5}));
    std::array<Contact, 8> contacts;
    const ContactAnswer answer =
        find_contacts(hull, pose_at(64.0, 64.0, 1.49), ground, 0.0, contacts);
    ASSERT_EQ(answer.count, 1u);
    EXPECT_NEAR(contacts[0].depth, 0.01, 1e-9);
    EXPECT_NEAR(contacts[0].normal.z(), 1.0, 1e-9);
    EXPECT_NEAR((contacts[0].point_world - Eigen::Vector3d(64.0, 64.0, 0.99)).norm(), 0.0, 1e-9);
    EXPECT_EQ(contacts[0].feature.second, ShapeFeature::kFace);
}

TEST(HullContacts, OfAPlankOverTwoRidgesAreItsEdgesByName) {
    const Ground ground = make_test_ground(
        [](double x, double) { return x == 62.0 || x == 66.0 ? 0.5 : 0.0; }, 1.0, 1);
    {
        const ConvexHull plank = make_hull(box_corners({3.0, 0.25, 0.1}));
        std::array<ShapeFeature, 4> before;
        // Features keep their names while the plank slides along the ridges, over many cells.
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

TEST(ShapeFeatures, NameWhereAShapeTouches) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    std::array<Contact, 8> contacts;
    const auto expect_features = [&](const Shape& shape, const Pose& pose,
                                     std::vector<ShapeFeature> expected) {
        const ContactAnswer answer = find_contacts(shape, pose, ground, 0.0, contacts);
        ASSERT_EQ(answer.count, expected.size());
        for (const ShapeFeature& feature : expected) {
            const auto is_it = [&](const Contact& contact) { return contact.feature == feature; };
            EXPECT_EQ(std::count_if(contacts.begin(), contacts.begin() + answer.count, is_it), 1)
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
    // A spike under the middle of a face, whichever is down, and a ridge under an edge.
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

TEST(HullContacts, PushUpWhatLiesAKilometreBelow) {
    Random random(kSeed);
    const Ground ground =
        make_test_ground([](double x, double y) { return hash_height(x, y); }, 1.0, 1);
    for (const NamedHull& named : make_hulls(random)) {
        SCOPED_TRACE(named.name);
        const ConvexHull hull = make_hull(named.points);
        const Pose pose = pose_at(64.3, 64.4, -1000.0);
        std::array<Contact, 64> contacts;
        const ContactAnswer answer = find_contacts(hull, pose, ground, 0.0, contacts);
        ASSERT_EQ(answer.status, ContactStatus::complete);
        EXPECT_GT(answer.lift, 990.0);
        ASSERT_GE(answer.count, 1u);
        const DistanceAnswer distance = signed_distance(hull, pose, ground, 1.0);
        EXPECT_LT(distance.distance, 0.0);
        EXPECT_LE(
            compute_lift(hull, moved(pose, -distance.distance * distance.normal), ground).lift,
            1e-9);
    }
}

TEST(HullContacts, AnswerForAPointOnASlope) {
    const Ground ground =
        make_test_ground([](double x, double y) { return 0.25 * x + 0.5 * y; }, 1.0, 1);
    const double surface = 0.25 * 64.3 + 0.5 * 64.4;
    const double upright = 1.0 / std::sqrt(1.0 + 0.25 * 0.25 + 0.5 * 0.5);
    for (const Points& points : {Points{{0, 0, 0}}, Points{{0, 0, 0}, {0, 0, 0}}}) {
        const ConvexHull hull = make_hull(points);
        for (const double below : {0.0, 0.01, 30.0}) {
            const Pose pose = pose_at(64.3, 64.4, surface - below);
            EXPECT_NEAR(compute_lift(hull, pose, ground).lift, below, 1e-12);
            EXPECT_NEAR(signed_distance(hull, pose, ground, 1.0).distance, -below * upright, 1e-9);
            EXPECT_TRUE(test_contact(hull, pose, ground).is_touching);
        }
        EXPECT_NEAR(signed_distance(hull, pose_at(64.3, 64.4, surface + 0.5), ground, 1.0).distance,
                    0.5 * upright, 1e-9);
    }
}

TEST(HullContacts, OfTenThousandPointsAreThoseOfTheirBall) {
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
        const double of_ball = signed_distance(Sphere{1.0}, pose, ground, 1.0).distance;
        EXPECT_NEAR(signed_distance(hull, pose, ground, 1.0).distance, of_ball, 1e-3);
        pose.translation.z() += 0.5;
        EXPECT_NEAR(signed_distance(hull, pose, ground, 1.0).distance,
                    signed_distance(Sphere{1.0}, pose, ground, 1.0).distance, 1e-3);
    }
}

TEST(HullContacts, GiveTheSameBitsTenThousandKilometresOut) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    constexpr std::int32_t kFar = 78125;  // roots of 128 m: 1e7 m
    const double shift = 128.0 * kFar;
    const auto height = [](double x, double y) { return hash_height(x, y); };
    TableGroundSettings far_settings;
    far_settings.first_root = kFar;
    const Ground near = make_test_ground(height, 1.0, 1);
    const Ground far = make_test_ground(
        [&](double x, double y) { return height(x - shift, y - shift); }, far_settings);
    std::vector<Shape> shapes;
    std::vector<CompoundPart> parts;
    for (const NamedHull& named : make_hulls(random)) {
        shapes.emplace_back(make_hull(named.points));
        parts.push_back({make_hull(named.points), pose_at(random.between(-2.0, 2.0), 0.0, 0.0)});
    }
    shapes.emplace_back(Compound::create(parts).value());
    for (const Shape& shape : shapes) {
        for (int i = 0; i < 30; ++i) {
            Pose pose = random_pose(random, near, -0.5, 1.5);
            // Coordinates that both places hold exactly.
            for (int k = 0; k < 2; ++k)
                pose.translation[k] = std::floor(pose.translation[k] * 0x1p20) * 0x1p-20;
            const Pose far_pose = moved(pose, {shift, shift, 0.0});
            std::array<Contact, 64> a;
            std::array<Contact, 64> b;
            const ContactAnswer here = find_contacts(shape, pose, near, 0.01, a);
            const ContactAnswer there = find_contacts(shape, far_pose, far, 0.01, b);
            ASSERT_EQ(here.count, there.count);
            EXPECT_EQ(std::memcmp(&here.lift, &there.lift, sizeof(double)), 0);
            for (std::size_t k = 0; k < here.count; ++k) {
                EXPECT_EQ(std::memcmp(&a[k].depth, &b[k].depth, sizeof(double)), 0);
                EXPECT_EQ(std::memcmp(a[k].normal.data(), b[k].normal.data(), 3 * sizeof(double)),
                          0);
                EXPECT_EQ(a[k].feature, b[k].feature);
                EXPECT_EQ(a[k].part, b[k].part);
            }
            Motion motion;
            motion.start = moved(pose, {0.0, 0.0, 4.0});
            for (int k = 0; k < 3; ++k) {
                motion.start.translation[k] =
                    std::floor(motion.start.translation[k] * 0x1p20) * 0x1p-20;
            }
            motion.translation = {5.0, 3.0, -10.0};
            motion.rotation_vector = {0.5, 1.0, 0.0};
            Motion far_motion = motion;
            far_motion.start.translation += Eigen::Vector3d(shift, shift, 0.0);
            EXPECT_EQ(cast(shape, motion, near).fraction, cast(shape, far_motion, far).fraction);
        }
    }
}

TEST(HullContacts, RefuseWhatIsNotFiniteOrNotARotation) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const ConvexHull hull = make_hull(box_corners({1, 1, 1}));
    std::vector<CompoundPart> parts{{hull, Pose{}}};
    Pose skewed;
    skewed.rotation(0, 1) = 1e-3;
    std::array<Contact, 4> contacts;
    for (const Shape& shape : {Shape(hull), Shape(Compound::create(parts).value())}) {
        for (const Pose& pose : {pose_at(nan, 0, 0), pose_at(0, 0, nan), skewed}) {
            EXPECT_EQ(find_contacts(shape, pose, ground, 0.0, contacts).status,
                      ContactStatus::invalid);
            EXPECT_EQ(signed_distance(shape, pose, ground, 1.0).status, ContactStatus::invalid);
            EXPECT_EQ(compute_lift(shape, pose, ground).status, ContactStatus::invalid);
            EXPECT_EQ(test_contact(shape, pose, ground).status, ContactStatus::invalid);
            EXPECT_EQ(pseudodistance(shape, pose, ground).status, ContactStatus::invalid);
            Motion motion;
            motion.start = pose;
            EXPECT_EQ(cast(shape, motion, ground).status, ContactStatus::invalid);
        }
    }
}

TEST(HullContacts, AllocateNothing) {
    Random random(kSeed);
    const Ground ground =
        make_test_ground([](double x, double y) { return hash_height(x, y); }, 1.0, 1);
    std::vector<Shape> shapes = make_shapes();
    std::vector<CompoundPart> parts;
    for (const NamedHull& named : make_hulls(random)) {
        shapes.emplace_back(make_hull(named.points));
        parts.push_back({make_hull(named.points), pose_at(random.between(-2.0, 2.0), 0.0, 0.0)});
    }
    shapes.emplace_back(Compound::create(parts).value());
    std::array<Contact, 64> contacts;
    double sum = 0.0;
    const AllocationCounter counter;
    for (const Shape& shape : shapes) {
        for (int i = 0; i < 20; ++i) {
            Motion motion;
            motion.start = random_pose(random, ground, -0.5, 2.0);
            motion.translation = 5.0 * random.direction();
            motion.rotation_vector = random.direction();
            sum += static_cast<double>(
                find_contacts(shape, motion.start, ground, 0.1, contacts).count);
            sum += signed_distance(shape, motion.start, ground, 1.0).distance;
            sum += compute_lift(shape, motion.start, ground).lift;
            sum += test_contact(shape, motion.start, ground).is_touching ? 1.0 : 0.0;
            sum += pseudodistance(shape, motion.start, ground).pseudodistance;
            sum += cast(shape, motion, ground).fraction;
        }
    }
    EXPECT_EQ(counter.count(), 0u);
    EXPECT_NE(sum, 0.0);
}

}  // namespace
}  // namespace terrane
