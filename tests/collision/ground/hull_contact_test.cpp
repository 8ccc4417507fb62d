// SPDX-License-Identifier: MIT
#include "ground_checks.h"
#include "hull_cases.h"
#include "support/allocation_counter.h"

#include <terrane/collision/ground_cast.h>

#include <gtest/gtest.h>

namespace terrane {
namespace hull_contact_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261102;

// Each hull, and all of them side by side.
std::vector<Shape> make_hulls_and_their_compound(Random& random) {
    std::vector<Shape> shapes;
    std::vector<CompoundPart> parts;
    for (const NamedHull& named : make_hulls(random)) {
        shapes.emplace_back(make_hull(named.points));
        parts.push_back({make_hull(named.points), pose_at(random.between(-2.0, 2.0), 0.0, 0.0)});
    }
    shapes.emplace_back(Compound::create(parts).value());
    return shapes;
}

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
                expect_freed_by_contacts(hull, pose, ground);
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
    Contact contact;
    expect_spike_under_the_middle(make_hull(box_corners({3.0, 3.0, 0.5})), contact);
    EXPECT_EQ(contact.feature.second, ShapeFeature::kFace);
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
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    for (const NamedHull& named : make_hulls(random)) {
        SCOPED_TRACE(named.name);
        expect_pushed_up_from_a_kilometre_below(make_hull(named.points));
    }
}

TEST(HullContacts, AnswerForAPointOnASlope) {
    for (const Points& points : {Points{{0, 0, 0}}, Points{{0, 0, 0}, {0, 0, 0}}}) {
        expect_answers_of_a_point(make_hull(points));
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
    const FarGround grounds;
    for (const Shape& shape : make_hulls_and_their_compound(random)) {
        for (int i = 0; i < 30; ++i) {
            const Pose pose = FarGround::rounded(random_pose(random, grounds.near, -0.5, 1.5));
            expect_the_same_contacts_far_out(shape, pose, grounds);
            Motion motion;
            motion.start = FarGround::rounded(moved(pose, {0.0, 0.0, 4.0}));
            motion.translation = {5.0, 3.0, -10.0};
            motion.rotation_vector = {0.5, 1.0, 0.0};
            expect_the_same_cast_far_out(shape, motion, grounds);
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
                      QueryStatus::invalid);
            EXPECT_EQ(signed_distance(shape, pose, ground, 1.0).status, QueryStatus::invalid);
            EXPECT_EQ(compute_lift(shape, pose, ground).status, QueryStatus::invalid);
            EXPECT_EQ(test_contact(shape, pose, ground).status, QueryStatus::invalid);
            EXPECT_EQ(pseudodistance(shape, pose, ground).status, QueryStatus::invalid);
            Motion motion;
            motion.start = pose;
            EXPECT_EQ(cast(shape, motion, ground).status, QueryStatus::invalid);
        }
    }
}

TEST(HullContacts, AllocateNothing) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const Ground ground =
        make_test_ground([](double x, double y) { return hash_height(x, y); }, 1.0, 1);
    std::vector<Shape> shapes = make_shapes();
    for (const Shape& shape : make_hulls_and_their_compound(random)) shapes.push_back(shape);
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

}  // namespace hull_contact_test
}  // namespace terrane
