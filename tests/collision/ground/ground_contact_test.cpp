// SPDX-License-Identifier: MIT
#include "collision/ground/ground_cases.h"

#include <gtest/gtest.h>

#include <utility>

namespace terrane::ground_contact_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260101;

class ShapeContacts : public EveryShape {};
INSTANTIATE_TEST_SUITE_P(All, ShapeContacts, testing::ValuesIn(make_named_shapes()), shape_name);

TEST_P(ShapeContacts, HaveALiftOfMinusInfinityOverNoGround) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    const LiftAnswer answer = compute_lift(shape(), pose_at(-50.0, 60.0, 0.0), ground);
    EXPECT_EQ(answer.status, QueryStatus::ok);
    EXPECT_EQ(answer.lift, -std::numeric_limits<double>::infinity());
}

TEST_P(ShapeContacts, SeparateTheShapeWhenResolved) {
    SeededRandom random(kSeed);
    std::array<Contact, 256> contacts;
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        long overlapping = 0;
        for (int i = 0; i < 30; ++i) {
            const Pose pose = random_pose(random, ground, -1.0, 1.5);
            const ContactAnswer answer = find_contacts(shape(), pose, ground, 0.0, contacts);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            if (answer.lift <= 0.0) continue;
            ++overlapping;
            EXPECT_NEAR(answer.lift, compute_lift(shape(), pose, ground).lift, 1e-12);
            ASSERT_GT(answer.count, 0u);
            const Eigen::Vector3d d = resolve({contacts.data(), answer.count});
            EXPECT_LE(compute_lift(shape(), moved(pose, d), ground).lift, 2e-9);
        }
        EXPECT_GT(overlapping, 1);
    }
}

TEST_P(ShapeContacts, PushUpAShapeAKilometreBelow) {
    const Ground ground = make_test_ground(hash_height, 1.0, 1);
    const Pose pose = pose_at(64.3, 64.4, -1000.0);
    std::array<Contact, 64> contacts;
    const ContactAnswer answer = find_contacts(shape(), pose, ground, 0.0, contacts);
    ASSERT_EQ(answer.status, QueryStatus::ok);
    EXPECT_GE(answer.lift, 1000.0 + support_distance(shape(), -Eigen::Vector3d::UnitZ()) - 1e-9);
    ASSERT_GE(answer.count, 1u);
    const DistanceAnswer deep = signed_distance(shape(), pose, ground, 1.0);
    EXPECT_LT(deep.distance, 0.0);
    const Pose separated = moved(pose, -deep.distance * deep.normal);
    EXPECT_LE(compute_lift(shape(), separated, ground).lift, 1e-9);
}

TEST(FindContacts, OfALevelBoxOnLevelGroundAreItsFourCorners) {
    const Ground ground = make_test_ground([](double, double) { return 2.0; }, 1.0, 1);
    const Eigen::Vector3d half(3.2, 2.1, 0.5), place(64.3, 64.4, 2.49);
    const ConvexHull hull = make_hull(box_corners(half));
    const Points vertices(hull.vertices().begin(), hull.vertices().end());
    std::array<Contact, 8> contacts;
    for (const auto& [shape, corners] : std::initializer_list<std::pair<Shape, Points>>{
             {Box{half}, box_corners(half)}, {hull, vertices}}) {
        const ContactAnswer answer =
            find_contacts(shape, {.translation = place}, ground, 0.0, contacts);
        ASSERT_EQ(answer.count, 4u);
        for (std::size_t i = 0; i < 4; ++i) {
            EXPECT_NEAR(contacts[i].depth, 0.01, 1e-12);
            EXPECT_EQ(contacts[i].normal, Eigen::Vector3d::UnitZ());
            const ShapeFeature& feature = contacts[i].feature;
            ASSERT_EQ(feature.first, feature.second);
            const Eigen::Vector3d corner = place + corners[feature.first];
            EXPECT_NEAR((contacts[i].point_world - corner).norm(), 0.0, 1e-12);
        }
    }
}

TEST(FindContacts, FindASpikeUnderTheMiddleOfAFace) {
    const Eigen::Vector3d half(3.0, 3.0, 0.5), spike(64.0, 64.0, 1.0);
    const Ground ground = make_test_ground(
        [&](double x, double y) { return x == spike.x() && y == spike.y() ? spike.z() : 0.0; }, 1.0,
        1);
    std::array<Contact, 8> contacts;
    for (const Shape& shape : {Shape(Box{half}), Shape(make_hull(box_corners(half)))}) {
        const Pose pose = pose_at(64.0, 64.0, 1.49);
        ASSERT_EQ(find_contacts(shape, pose, ground, 0.0, contacts).count, 1u);
        EXPECT_NEAR(contacts[0].depth, 0.01, 1e-9);
        EXPECT_NEAR(contacts[0].normal.z(), 1.0, 1e-9);
        const Eigen::Vector3d point = spike - Eigen::Vector3d(0.0, 0.0, 0.01);
        EXPECT_NEAR((contacts[0].point_world - point).norm(), 0.0, 1e-9);
        EXPECT_EQ(contacts[0].feature.second, ShapeFeature::kFace);
    }
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

TEST(FindContacts, AnswerForShapesWithoutThickness) {
    const Ground ground =
        make_test_ground([](double x, double y) { return 0.25 * x + 0.5 * y; }, 1.0, 1);
    const Pose pose = pose_at(64.3, 64.4, 0.25 * 64.3 + 0.5 * 64.4);
    std::array<Contact, 8> contacts;
    for (const Shape& shape : {Shape(Capsule{0.0, 1.0}), Shape(Capsule{0.5, 0.0}),
                               Shape(Box{{1.0, 1.0, 0.0}}), Shape(Box{{1.0, 0.0, 0.0}})}) {
        const ContactAnswer answer = find_contacts(shape, pose, ground, 0.0, contacts);
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
    const std::vector<CompoundPart> parts{{Sphere{0.5}, pose_at(-4.0, 0.0, 0.0)},
                                          {Sphere{0.5}, pose_at(4.0, 0.0, 0.0)}};
    std::array<Contact, 4> contacts;
    for (const auto& [shape, beyond] : std::initializer_list<std::pair<Shape, double>>{
             {Sphere{0.5}, 128.2}, {Compound::create(parts).value(), 126.0}}) {
        EXPECT_EQ(find_contacts(shape, pose_at(64.0, 64.0, 0.4), ground, 0.0, contacts).status,
                  QueryStatus::ok);
        EXPECT_EQ(find_contacts(shape, pose_at(beyond, 64.0, 0.4), ground, 0.0, contacts).status,
                  QueryStatus::not_resident);
        EXPECT_EQ(compute_lift(shape, pose_at(200.0, 64.0, 0.4), ground).status,
                  QueryStatus::not_resident);
    }
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

TEST(FindContacts, OfAPlankOverTwoRidgesKeepTheFeaturesOfItsEdges) {
    const Ground ground = make_test_ground(
        [](double x, double) { return x == 62.0 || x == 66.0 ? 0.5 : 0.0; }, 1.0, 1);
    const ConvexHull plank = make_hull(box_corners({3.0, 0.25, 0.1}));
    std::array<ShapeFeature, 4> before;
    // Feature indices stay the same while the plank slides along the ridges over many cells.
    for (int step = 0; step < 40; ++step) {
        const Pose pose = pose_at(64.0, 60.3 + 0.1 * step, 0.599);
        std::array<Contact, 16> contacts;
        const ContactAnswer answer = find_contacts(plank, pose, ground, 0.0, contacts);
        ASSERT_EQ(answer.count, 4u);
        std::ranges::sort(contacts.begin(), contacts.begin() + 4, {}, [](const Contact& contact) {
            return contact.point_world.x() + 2.0 * contact.point_world.y();
        });
        for (std::size_t i = 0; i < 4; ++i) {
            const Contact& contact = contacts[i];
            EXPECT_NEAR(contact.depth, 0.001, 1e-9);
            EXPECT_NEAR(std::abs(contact.point_world.y() - pose.translation.y()), 0.25, 1e-9);
            EXPECT_NE(contact.feature.first, contact.feature.second);
            EXPECT_NE(contact.feature.second, ShapeFeature::kFace);
            if (step > 0) {
                EXPECT_EQ(contact.feature, before[i]);
            }
            before[i] = contact.feature;
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
    EXPECT_NEAR(contacts[0].depth, 0.01, 1e-9);
    EXPECT_NEAR(contacts[0].normal.z(), 1.0, 1e-9);
    turn.rotation_vector = 1.5707963267948966 * Eigen::Vector3d::UnitY();
    Pose lying_across = turn.at(1.0);
    lying_across.translation = {64.1, 64.5, 0.24};
    ASSERT_GE(find_contacts(Capsule{0.25, 0.5}, lying_across, ridge, 0.0, contacts).count, 1u);
    EXPECT_EQ(contacts[0].feature, (ShapeFeature{0, 1}));
}

TEST(HullLift, IsThatOfTheBoxAtAnySizeAndFarFromTheBodysOrigin) {
    SeededRandom random(kSeed);
    const Ground ground = make_test_ground(hash_height, 1.0, 2);
    for (const double size : {1e-3, 1e-1, 10.0, 200.0, 1e4}) {
        for (const double off : {0.0, 9e4}) {
            SCOPED_TRACE(testing::Message() << size << " m, " << off << " m off");
            const Box box{size * Eigen::Vector3d(1.0, 0.6, 0.4)};
            const Eigen::Vector3d offset(off, -off, off);
            const ConvexHull hull = make_hull(transformed(box_corners(box.half_extents), 1.0,
                                                          Eigen::Matrix3d::Identity(), offset));
            for (int i = 0; i < 20; ++i) {
                Pose pose = random_pose(random, ground, 0.0, 0.0);
                pose.translation.z() += compute_lift(box, pose, ground).lift;
                const Pose of_hull = moved(pose, -(pose.rotation * offset));
                // Coordinates of 1e5 m are rounded by 1e-11 m.
                EXPECT_NEAR(compute_lift(hull, of_hull, ground).lift, 0.0, 1e-9);
                const Eigen::Vector3d up(0.0, 0.0, 0.5);
                EXPECT_NEAR(signed_distance(hull, moved(of_hull, up), ground, 1.0).distance,
                            signed_distance(box, moved(pose, up), ground, 1.0).distance, 1e-9);
            }
        }
    }
}

// A hull of ten thousand points of a sphere lies between spheres of radius 1 and 0.997.
TEST(HullOfTenThousandPoints, AnswersLikeItsSphere) {
    SeededRandom random(kSeed);
    const Sphere ball{1.0};
    const ConvexHull hull = make_hull(sphere(random, 10'000));
    const Ground ground = make_test_ground(hash_height, 1.0, 1);
    for (int i = 0; i < 5; ++i) {
        Pose pose = random_pose(random, ground, 1.0, 2.0);
        const double lift = compute_lift(hull, pose, ground).lift;
        EXPECT_LE(lift, compute_lift(ball, pose, ground).lift + 1e-12);
        EXPECT_GE(lift, compute_lift(Sphere{0.997}, pose, ground).lift);
        pose.translation.z() += lift - 0.02;
        std::array<Contact, 64> contacts;
        const ContactAnswer answer = find_contacts(hull, pose, ground, 0.0, contacts);
        ASSERT_GE(answer.count, 1u);
        const Eigen::Vector3d d = resolve({contacts.data(), answer.count});
        EXPECT_LE(compute_lift(hull, moved(pose, d), ground).lift, 2e-9);
        for (int side = 0; side < 2; ++side) {
            EXPECT_NEAR(signed_distance(hull, pose, ground, 1.0).distance,
                        signed_distance(ball, pose, ground, 1.0).distance, 1e-3);
            pose.translation.z() += 0.5;
        }
        const Motion fall{.start = moved(pose, {0.0, 0.0, 2.0}),
                          .translation = {3.0, -2.0, -6.0},
                          .rotation_vector = {0.0, i % 2 == 0 ? 0.0 : 2.0, 0.0}};
        const CastAnswer hit = cast(hull, fall, ground);
        ASSERT_TRUE(hit.hit);
        EXPECT_GE(hit.fraction, cast(ball, fall, ground).fraction - 1e-4 / 7.0);
        const double gap = signed_distance(hull, fall.at(hit.fraction), ground, 1.0).distance;
        EXPECT_GE(gap, -1e-9);
        EXPECT_LE(gap, 1e-4);
    }
}

}  // namespace terrane::ground_contact_test
