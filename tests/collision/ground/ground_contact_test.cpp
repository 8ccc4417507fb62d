// SPDX-License-Identifier: MIT
#include "collision/ground/ground_cases.h"
#include "ground_checks.h"

#include <gtest/gtest.h>

namespace terrane::ground_contact_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260101;

class ShapeContacts : public EveryShape {};
INSTANTIATE_TEST_SUITE_P(All, ShapeContacts, testing::ValuesIn(make_named_shapes()), shape_name);

class ShapeDistances : public EveryShape {};
INSTANTIATE_TEST_SUITE_P(All, ShapeDistances, testing::ValuesIn(make_named_shapes()), shape_name);

TEST_P(ShapeDistances, LiftIsMinusInfinityOverNoGround) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    const LiftAnswer answer = compute_lift(shape(), pose_at(-50.0, 60.0, 0.0), ground);
    EXPECT_EQ(answer.status, QueryStatus::ok);
    EXPECT_EQ(answer.lift, -std::numeric_limits<double>::infinity());
}

TEST_P(ShapeContacts, SeparateTheShapeWhenResolved) {
    SeededRandom random(kSeed);
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        long overlapping = 0;
        for (int i = 0; i < 30; ++i) {
            const Pose pose = random_pose(random, ground, -1.0, 1.5);
            expect_separated_by_contacts(shape(), pose, ground, overlapping);
        }
        EXPECT_GT(overlapping, 1);
    }
}

TEST_P(ShapeContacts, HaveNoDepthWhereTheShapeIsApart) {
    SeededRandom random(kSeed + 1);
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        long apart = 0, compared = 0;
        for (int i = 0; i < 30; ++i) {
            const Pose pose = random_pose(random, ground, 0.0, 3.0);
            if (compute_lift(shape(), pose, ground).lift > -1e-6) continue;
            ++apart;
            std::array<Contact, 64> contacts;
            const ContactAnswer touching = find_contacts(shape(), pose, ground, 0.0, contacts);
            for (std::size_t k = 0; k < touching.count; ++k) EXPECT_LE(contacts[k].depth, 1e-8);
            // With a margin just above the gap there is a contact, and no contact is nearer than the gap.
            const double gap = signed_distance(shape(), pose, ground, 5.0).distance;
            const ContactAnswer near = find_contacts(shape(), pose, ground, gap + 1e-6, contacts);
            if (gap > 4.9) continue;
            ++compared;
            ASSERT_GE(near.count, 1u);
            EXPECT_NEAR(contacts[0].depth, -gap, 1e-6);
        }
        EXPECT_GT(apart, 1);
        EXPECT_GT(compared, 1);
    }
}

TEST_P(ShapeContacts, HaveTheFaceNormalOnFlatSeams) {
    SeededRandom random(kSeed);
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 2);
    for (int i = 0; i < 100; ++i) {
        Pose pose{.rotation = random.rotation()};
        // Over corners, edges and the seam between two root squares.
        pose.translation = {128.0 + random.between(-2.0, 2.0), 128.0, 0.0};
        const double lift = compute_lift(shape(), pose, ground).lift;
        pose.translation.z() = lift - 0.001;
        std::array<Contact, 64> contacts;
        const ContactAnswer answer = find_contacts(shape(), pose, ground, 0.01, contacts);
        ASSERT_GE(answer.count, 1u);
        for (std::size_t k = 0; k < answer.count; ++k) {
            EXPECT_NEAR(contacts[k].normal.z(), 1.0, 1e-9);
        }
        EXPECT_NEAR(contacts[0].depth, 0.001, 1e-9);
    }
}

TEST_P(ShapeContacts, PushUpAShapeAKilometreBelow) {
    expect_pushed_up_from_a_kilometre_below(shape());
}

TEST_P(ShapeDistances, OverlappingAreMinusTheShortestOfManyTranslations) {
    SeededRandom random(kSeed);
    int overlap_count = 0;
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        for (int i = 0; i < 30; ++i) {
            Pose pose = random_pose(random, ground, -0.5, 1.5);
            // Half of them overlap slightly.
            if (i % 2 == 0) {
                pose.translation.z() +=
                    compute_lift(shape(), pose, ground).lift - 0.02 * smallest_half_extent(shape());
            }
            const DistanceAnswer answer = signed_distance(shape(), pose, ground, 5.0);
            if (answer.distance >= 0.0) continue;
            const double depth = -answer.distance;
            EXPECT_LE(compute_lift(shape(), moved(pose, depth * answer.normal), ground).lift, 1e-9);
            ++overlap_count;
            const bool is_shallow = depth <= 0.2 * smallest_half_extent(shape());
            const double shorter = is_shallow ? depth - 1e-9 : 0.8 * depth;
            for (int k = 0; k < 100; ++k) {
                Eigen::Vector3d n = random.direction();
                if (k >= 50) n = (answer.normal + random.between(0.0, 0.3) * n).normalized();
                EXPECT_GT(compute_lift(shape(), moved(pose, shorter * n), ground).lift, 0.0)
                    << "depth " << depth;
            }
        }
    }
    EXPECT_GT(overlap_count, 20);
}

TEST_P(ShapeDistances, ApartAreTheLargestDisplacementWithoutOverlap) {
    SeededRandom random(kSeed);
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        long apart = 0;
        for (int i = 0; i < 20; ++i) {
            const Pose pose = random_pose(random, ground, 0.5, 4.0);
            const DistanceAnswer answer = signed_distance(shape(), pose, ground, 8.0);
            if (answer.distance <= 0.0) continue;
            ++apart;
            ASSERT_TRUE(answer.has_ground);
            const double gap = answer.distance;
            const Pose touching = moved(pose, -gap * answer.normal);
            EXPECT_NEAR(compute_lift(shape(), touching, ground).lift, 0.0, 1e-8);
            for (int k = 0; k < 50; ++k) {
                const Pose there = moved(pose, (gap - 1e-9) * random.direction());
                EXPECT_LE(compute_lift(shape(), there, ground).lift, 0.0);
            }
        }
        EXPECT_GT(apart, 1);
    }
}

TEST(SignedDistance, OfASphereOverASlopeIsTheDistanceToItsPlane) {
    const Ground ground = make_test_ground([](double x, double) { return 0.75 * x; }, 1.0, 1);
    for (const double height : {-20.0, -0.1, 0.3, 0.625, 2.0}) {
        const DistanceAnswer answer =
            signed_distance(Sphere{0.5}, pose_at(64.3, 64.4, 0.75 * 64.3 + height), ground, 10.0);
        EXPECT_NEAR(answer.distance, 0.8 * height - 0.5, 1e-9);
        EXPECT_NEAR((answer.normal - Eigen::Vector3d(-0.6, 0.0, 0.8)).norm(), 0.0, 1e-9);
    }
}

TEST(FindContacts, OfALevelBoxOnLevelGroundAreItsFourCorners) {
    const Ground ground = make_test_ground([](double, double) { return 2.0; }, 1.0, 1);
    std::array<Contact, 8> contacts;
    const ContactAnswer answer =
        find_contacts(Box{{3.2, 2.1, 0.5}}, pose_at(64.3, 64.4, 2.49), ground, 0.0, contacts);
    ASSERT_EQ(answer.count, 4u);
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_NEAR(contacts[i].depth, 0.01, 1e-12);
        EXPECT_EQ(contacts[i].normal, Eigen::Vector3d::UnitZ());
        EXPECT_NEAR(std::abs(contacts[i].point_world.x() - 64.3), 3.2, 1e-12);
        EXPECT_NEAR(std::abs(contacts[i].point_world.y() - 64.4), 2.1, 1e-12);
    }
}

TEST(FindContacts, FindASpikeUnderTheMiddleOfABoxFace) {
    Contact contact;
    expect_spike_under_the_middle(Box{{3.0, 3.0, 0.5}}, contact);
}

// Shapes too large for one window are tested square by square; contacts at the seams must be found too.
TEST(FindContacts, FindASpikeUnderALargeShapeAtEveryCellOfASquare) {
    constexpr double kApart =
        37.0;  // cells; modulo the size of a square the spikes are in all columns and rows
    const auto is_on_line = [](double p) { return p == kApart * std::floor(p / kApart); };
    const Ground ground = make_test_ground(
        [&](double x, double y) { return is_on_line(x) && is_on_line(y) ? 5.0 : 0.0; }, 1.0, 5);
    // over one spike each: a level face, an edge, a round shape
    struct Case {
        Shape shape;
        Pose pose;
        double depth;
    };
    Motion turn{.start = {}, .rotation_vector = 0.78539816339744831 * Eigen::Vector3d::UnitX()};
    const double half_root = std::sqrt(0.5);
    const std::array<Case, 3> cases{{
        {Box{{15.0, 15.0, 1.0}}, pose_at(0.0, 0.0, 5.99), 0.01},
        {Box{{15.0, 15.0, 15.0}},
         {turn.at(1.0).rotation, {0.0, 0.0, 4.99 + 30.0 * half_root}},
         0.01 * half_root},
        {Sphere{60.0}, pose_at(0.0, 0.0, 64.99), 0.01},
    }};
    std::array<Contact, 8> contacts;
    for (const Case& each : cases) {
        for (int i = 1; i <= 16; ++i) {
            const Eigen::Vector3d spike(kApart * i, kApart * (17 - i), 5.0);
            const Pose pose = moved(each.pose, {spike.x(), spike.y(), 0.0});
            const ContactAnswer answer = find_contacts(each.shape, pose, ground, 0.0, contacts);
            ASSERT_GE(answer.count, 1u) << i;
            EXPECT_NEAR(contacts[0].depth, each.depth, 1e-9) << i;
            EXPECT_NEAR((contacts[0].point_world - spike).norm(), each.depth, 1e-6) << i;
        }
    }
}

TEST(FindContacts, FindARidgeUnderTheEdgeOfABox) {
    const Ground ground =
        make_test_ground([](double x, double) { return -std::abs(x - 64.0); }, 1.0, 1);
    Motion turn{.start = {}, .rotation_vector = 0.78539816339744831 * Eigen::Vector3d::UnitX()};
    Pose pose = turn.at(1.0);  // stands on an edge along x
    pose.translation = {64.0, 64.5, std::sqrt(2.0) - 0.01};
    std::array<Contact, 8> contacts;
    const ContactAnswer answer = find_contacts(Box{{3.0, 1.0, 1.0}}, pose, ground, 0.0, contacts);
    ASSERT_GE(answer.count, 1u);
    EXPECT_NEAR(contacts[0].depth, 0.01, 1e-9);
    EXPECT_NEAR(contacts[0].normal.z(), 1.0, 1e-9);
}

TEST(FindContacts, AnswerForShapesWithoutThickness) {
    const Ground ground =
        make_test_ground([](double x, double y) { return 0.25 * x + 0.5 * y; }, 1.0, 1);
    const double surface = 0.25 * 64.3 + 0.5 * 64.4;
    for (const Shape& shape :
         {Shape(Sphere{0.0}), Shape(Capsule{0.0, 0.0}), Shape(Box{{0.0, 0.0, 0.0}}),
          Shape(make_hull({{0, 0, 0}})), Shape(make_hull({{0, 0, 0}, {0, 0, 0}}))}) {
        expect_answers_of_a_point(shape);
    }
    std::array<Contact, 8> contacts;
    for (const Shape& shape : {Shape(Capsule{0.0, 1.0}), Shape(Capsule{0.5, 0.0}),
                               Shape(Box{{1.0, 1.0, 0.0}}), Shape(Box{{1.0, 0.0, 0.0}})}) {
        const ContactAnswer answer =
            find_contacts(shape, pose_at(64.3, 64.4, surface), ground, 0.0, contacts);
        EXPECT_EQ(answer.status, QueryStatus::ok);
        EXPECT_GE(answer.count, 1u);
    }
}

TEST(FindContacts, ReportExactTouchAsAContactOfDepthZero) {
    const Ground ground = make_test_ground([](double, double) { return 1.0; }, 1.0, 1);
    std::array<Contact, 8> contacts;
    for (const Shape& shape :
         {Shape(Sphere{0.5}), Shape(Capsule{0.25, 0.25}), Shape(Box{{1.0, 1.0, 0.5}})}) {
        for (const double x : {64.0, 64.5, 64.3}) {
            const ContactAnswer answer =
                find_contacts(shape, pose_at(x, 64.0, 1.5), ground, 0.0, contacts);
            ASSERT_GE(answer.count, 1u);
            EXPECT_NEAR(contacts[0].depth, 0.0, 1e-12);
            EXPECT_EQ(answer.lift, 0.0);
        }
    }
}

TEST(FindContacts, ReportTruncatedAndKeepTheDeepest) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    Motion turn{.start = {}, .rotation_vector = 0.001 * Eigen::Vector3d(1.0, 0.5, 0.0)};
    Pose pose = turn.at(1.0);
    pose.translation = {64.3, 64.4, 0.49};
    std::array<Contact, 8> all;
    std::array<Contact, 2> few;
    const Box box{{2.0, 1.0, 0.5}};
    const ContactAnswer complete = find_contacts(box, pose, ground, 0.0, all);
    const ContactAnswer truncated = find_contacts(box, pose, ground, 0.0, few);
    ASSERT_EQ(complete.count, 4u);
    EXPECT_EQ(truncated.status, QueryStatus::truncated);
    ASSERT_EQ(truncated.count, 2u);
    EXPECT_EQ(few[0].depth, all[0].depth);
    EXPECT_EQ(few[1].depth, all[1].depth);
}

TEST(FindContacts, ReportNotResidentWhereAChunkIsMissing) {
    TableGroundSettings settings{.roots = 2,
                                 .is_resident = [](int column, int) { return column == 0; }};
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, settings);
    std::array<Contact, 4> contacts;
    EXPECT_EQ(find_contacts(Sphere{0.5}, pose_at(64.0, 64.0, 0.4), ground, 0.0, contacts).status,
              QueryStatus::ok);
    EXPECT_EQ(find_contacts(Sphere{0.5}, pose_at(128.2, 64.0, 0.4), ground, 0.0, contacts).status,
              QueryStatus::not_resident);
    EXPECT_EQ(compute_lift(Sphere{0.5}, pose_at(200.0, 64.0, 0.4), ground).status,
              QueryStatus::not_resident);
}

TEST(FindContacts, FindNoGroundInCellsOutside) {
    TableGroundSettings settings{.is_outside = [](double x, double) { return x > 64.0; }};
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, settings);
    std::array<Contact, 4> contacts;
    EXPECT_EQ(find_contacts(Sphere{0.5}, pose_at(70.0, 64.0, -3.0), ground, 0.0, contacts).count,
              0u);
    const ContactAnswer rim =
        find_contacts(Box{{1.0, 1.0, 0.5}}, pose_at(64.2, 64.0, 0.49), ground, 0.0, contacts);
    ASSERT_GE(rim.count, 1u);
    EXPECT_NEAR(contacts[0].depth, 0.01, 1e-9);
    EXPECT_NEAR(contacts[0].normal.z(), 1.0, 1e-9);
}

TEST(FindContacts, AnswerForABoxOverAHundredThousandCells) {
    TableGroundSettings settings{.spacing = 0.01, .roots = 3};
    const Ground ground = make_test_ground(
        [](double x, double y) { return 0.01 * hash_height(100.0 * x, 100.0 * y); }, settings);
    Pose pose = pose_at(1.92, 1.92, 0.5);
    const Box box{{1.6, 1.6, 0.5}};
    const double lift = compute_lift(box, pose, ground).lift;
    pose.translation.z() += lift - 0.001;
    std::array<Contact, 256> contacts;
    const ContactAnswer answer = find_contacts(box, pose, ground, 0.0, contacts);
    ASSERT_EQ(answer.status, QueryStatus::ok);
    ASSERT_GE(answer.count, 1u);
    EXPECT_NEAR(answer.lift, 0.001, 1e-12);
    const Eigen::Vector3d d = resolve({contacts.data(), answer.count});
    EXPECT_LE(compute_lift(box, moved(pose, d), ground).lift, 2e-9);
}

}  // namespace terrane::ground_contact_test

namespace terrane::hull_contact_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261102;

TEST(HullDistance, IsThatOfTheBoxWhoseCornersItHas) {
    SeededRandom random(kSeed);
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        long compared = 0, touching = 0;
        for (int i = 0; i < 60; ++i) {
            const Box box{
                {random.between(0.3, 2.0), random.between(0.3, 2.0), random.between(0.3, 2.0)}};
            const ConvexHull hull = make_hull(box_corners(box.half_extents));
            Pose pose = random_pose(random, ground, 0.0, 4.0);
            // Separated at first, then with a small overlap.
            for (const bool is_overlapping : {false, true}) {
                if (is_overlapping)
                    pose.translation.z() += compute_lift(box, pose, ground).lift - 0.001;
                const DistanceAnswer of_box = signed_distance(box, pose, ground, 10.0);
                const DistanceAnswer of_hull = signed_distance(hull, pose, ground, 10.0);
                ASSERT_EQ(of_hull.status, of_box.status);
                if (of_box.distance < -0.1 * smallest_half_extent(box)) continue;
                ++compared;
                EXPECT_NEAR(of_hull.distance, of_box.distance, 1e-9);
                std::array<Contact, 64> contacts;
                const bool has_contacts = find_contacts(box, pose, ground, 0.0, contacts).count > 0;
                EXPECT_EQ(find_contacts(hull, pose, ground, 0.0, contacts).count > 0, has_contacts);
                touching += has_contacts;
            }
        }
        EXPECT_GT(compared, 6);
        EXPECT_GT(touching, 3);
        EXPECT_LT(touching, compared);
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
        // Feature indices stay the same while the plank slides along the ridges over many cells.
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
    Motion turn{.start = {}, .rotation_vector = 1.5707963267948966 * Eigen::Vector3d::UnitX()};
    Pose lying = turn.at(1.0);
    lying.translation = {64.3, 64.45, 0.24};
    expect_features(Capsule{0.25, 0.5}, lying, {{0, 0}, {1, 1}});
    expect_features(Box{{0.3, 0.2, 0.5}}, pose_at(64.5, 64.7, 0.49),
                    {{0, 0}, {1, 1}, {2, 2}, {3, 3}});
    lying.translation.z() = 0.19;
    expect_features(Box{{0.3, 0.2, 0.2}}, lying, {{0, 0}, {1, 1}, {4, 4}, {5, 5}});
    // A spike below the middle of each face, and a ridge below an edge.
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
    SeededRandom random(kSeed);
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

}  // namespace terrane::hull_contact_test
