// SPDX-License-Identifier: MIT
#include "compound_cases.h"

#include <gtest/gtest.h>

namespace terrane::pair_cast_test {

using internal::ConvexCast;
using namespace test;

constexpr std::uint64_t kSeed = 20261201;
const int kCases = case_count(10'000);

class PairCasts : public testing::TestWithParam<KindPair> {};

INSTANTIATE_TEST_SUITE_P(All, PairCasts, testing::ValuesIn(all_pairs()),
                         [](const auto& each) { return each.param.name(); });

ConvexCast cast_convex(const internal::ConvexView& a, const Motion& motion_a,
                       const internal::ConvexView& b, const Motion& motion_b,
                       const CastSettings& settings) {
    return internal::cast_convex({a, nullptr, motion_a}, {b, nullptr, motion_b}, 0.0, 1.0,
                                 settings);
}

double distance_at(const Case& c, const Motion& a, const Motion& b, double t) {
    return PlacedCase(Case{c.a, c.b, a.at(t), b.at(t)}).gap.distance;
}

TEST_P(PairCasts, StopWhereDenseStepsSayTheyMeet) {
    SeededRandom random(kSeed);
    constexpr int kSteps = 60;
    const CastSettings settings;
    int hits = 0;
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const Case c = random_case(random, GetParam(), i);
        const Thrown thrown = throw_together(random, c.pose_a, c.pose_b, i);
        const auto distance = [&](double t) { return distance_at(c, thrown.a, thrown.b, t); };
        if (distance(0.0) <= 1e-3) continue;
        const ConvexCast answer = cast_convex(c.a, thrown.a, c.b, thrown.b, settings);
        hits += answer.hit;
        expect_stops_where_they_meet(answer, distance, kSteps, settings, 0.0);
    }
    EXPECT_GT(hits, kCases / 5);
}

TEST_P(PairCasts, StartedInContactAreHitAtOnceUnlessTheyPartAndMayPass) {
    SeededRandom random(kSeed + 1);
    CastSettings passing{.skip_separating = true};
    long touching = 0;
    for (int i = 0; i < kCases / 10 && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        Case c = random_case(random, GetParam(), i);
        if (i % 2 == 0) {  // moved to touch
            const PlacedCase before(c);
            c.pose_a.translation -= before.gap.distance * before.gap.normal;
        }
        const PlacedCase placed(c);
        if (placed.gap.distance > 1e-13) continue;
        ++touching;
        const Motion still = motion_of(c.pose_b, Eigen::Vector3d::Zero());
        const Motion parting = motion_of(c.pose_a, 5.0 * placed.gap.normal);
        const Motion closing = motion_of(c.pose_a, -0.5 * placed.gap.normal);
        for (const Motion& motion : {parting, closing}) {
            const ConvexCast answer = cast_convex(c.a, motion, c.b, still, {});
            EXPECT_TRUE(answer.hit);
            EXPECT_TRUE(answer.started_in_contact);
            EXPECT_EQ(answer.fraction, 0.0);
            ASSERT_GT(answer.count, 0u);
            EXPECT_NEAR(answer.contacts[0].depth, -placed.gap.distance, 1e-9);
        }
        EXPECT_FALSE(cast_convex(c.a, parting, c.b, still, passing).hit);
        // Equal motions do not hit either.
        const Motion along = motion_of(c.pose_b, {3.0, -2.0, 1.0});
        EXPECT_FALSE(
            cast_convex(c.a, motion_of(c.pose_a, {3.0, -2.0, 1.0}), c.b, along, passing).hit);
        const ConvexCast met = cast_convex(c.a, closing, c.b, still, passing);
        EXPECT_TRUE(met.hit);
        EXPECT_EQ(met.fraction, 0.0);
    }
    EXPECT_GT(touching, kCases / 200);
}

TEST(PairCast, ReportsAContactThatOpensAndClosesAgain) {
    CastSettings passing{.skip_separating = true};
    // A rod tips over an edge of a table and hits the table with its other end.
    Motion rod = motion_of({}, {0.0, 0.0, 0.5}, {0.0, 3.1, 0.0});
    rod.start.translation = {0.0, 0.0, 0.1};
    const Motion table = motion_of({}, Eigen::Vector3d::Zero());
    const ConvexCast away =
        cast_convex(Box{{1.0, 0.1, 0.1}}, rod, Box{{5.0, 5.0, 0.0}}, table, passing);
    EXPECT_TRUE(away.started_in_contact);
    EXPECT_TRUE(away.hit);
    rod.translation = {0.0, 0.0, 3.0};
    rod.rotation_vector = {0.0, 0.3, 0.0};
    EXPECT_FALSE(cast_convex(Box{{1.0, 0.1, 0.1}}, rod, Box{{5.0, 5.0, 0.0}}, table, passing).hit);
    // A lever rotates a full turn: up, over and down again.
    Motion lever = motion_of({}, Eigen::Vector3d::Zero(), {0.0, -6.0, 0.0});
    lever.start.translation = {-2.0, 0.0, 0.2};
    Pose wall{.translation = {-0.5, 0.0, -0.3}};
    const ConvexCast back = cast_convex(Box{{2.0, 0.1, 0.2}}, lever, Box{{0.4, 1.0, 0.3}},
                                        motion_of(wall, Eigen::Vector3d::Zero()), passing);
    EXPECT_TRUE(back.started_in_contact);
    EXPECT_TRUE(back.hit);
    EXPECT_GT(back.fraction, 0.3);
    EXPECT_LT(back.fraction, 0.6);
}

TEST(PairCast, HoldsFromNoLengthToAThousandKilometres) {
    for (const double distance : {1e-3, 1.0, 1e3, 1e6}) {
        Pose far{.translation = {0.5 * distance + 1.0, 0.0, 0.0}};
        for (const double spin : {0.0, 10.0}) {
            const Motion thrown = motion_of({}, {distance, 0.0, 0.0}, {spin, 0.0, 0.0});
            const Motion still = motion_of(far, Eigen::Vector3d::Zero());
            const ConvexCast ball = cast_convex(Sphere{0.5}, thrown, Sphere{0.5}, still, {});
            ASSERT_TRUE(ball.hit);
            EXPECT_NEAR(ball.fraction * distance, 0.5 * distance, 1e-4);
            const ConvexCast box = cast_convex(Box{}, thrown, Box{}, still, {});
            ASSERT_TRUE(box.hit);
            EXPECT_NEAR(box.fraction * distance, 0.5 * distance, 1e-4);
        }
    }
    Pose beside{.translation = {2.0, 0.0, 0.0}};
    const Motion none = motion_of({}, Eigen::Vector3d::Zero());
    EXPECT_FALSE(
        cast_convex(Box{}, none, Box{}, motion_of(beside, Eigen::Vector3d::Zero()), {}).hit);
    EXPECT_TRUE(cast_convex(Box{}, none, Box{}, none, {}).hit);
}

}  // namespace terrane::pair_cast_test

namespace terrane::compound_cast_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261211;

class CompoundCasts : public testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(All, CompoundCasts, testing::Range(0, 6), [](const auto& each) {
    return std::string("compound_") + kOtherNames[static_cast<std::size_t>(each.param)];
});

double distance_at(const CompoundCase& c, const Motion& a, const Motion& b, double t) {
    return least_distance(c.a, a.at(t), c.b, b.at(t));
}

TEST_P(CompoundCasts, StopWhereDenseStepsSayTheyMeet) {
    SeededRandom random(kSeed);
    constexpr int kSteps = 20;
    const int cases = case_count(1'000);
    const CastSettings settings;
    int hits = 0;
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const CompoundCase c = random_compound_case(random, GetParam(), i);
        const Thrown thrown = throw_together(random, c.pose_a, c.pose_b, i);
        const auto distance = [&](double t) { return distance_at(c, thrown.a, thrown.b, t); };
        if (distance(0.0) <= 1e-3) continue;
        const PairCastAnswer answer = cast(c.a, thrown.a, c.b, thrown.b, settings);
        ASSERT_EQ(answer.status, QueryStatus::ok);
        hits += answer.hit;
        expect_stops_where_they_meet(answer, distance, kSteps, settings, 1e-12);
    }
    EXPECT_GT(hits, cases / 5);
}

TEST_P(CompoundCasts, AreTheEarliestOfTheirParts) {
    SeededRandom random(kSeed + 1);
    const int cases = case_count(10'000);
    CastSettings settings{.tolerance = 1e-9};
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const CompoundCase c = random_compound_case(random, GetParam(), i);
        settings.skip_separating = i % 3 == 0;
        // Without rotation a part has the motion of its body.
        const Motion a = motion_of(c.pose_a, 5.0 * random.direction());
        const Motion b = motion_of(c.pose_b, random.direction());
        const PairCastAnswer answer = cast(c.a, a, c.b, b, settings);
        PairCastAnswer expected;
        for (const Piece& p : pieces_of(c.a, c.pose_a)) {
            for (const Piece& q : pieces_of(c.b, c.pose_b)) {
                const PairCastAnswer one =
                    cast(as_shape(p.shape), motion_of(p.world_from_piece, a.translation),
                         as_shape(q.shape), motion_of(q.world_from_piece, b.translation), settings);
                if (one.started_in_contact) expected.started_in_contact = true;
                if (one.hit && one.fraction < expected.fraction) expected = one;
            }
        }
        // A grazing motion may hit or miss.
        if (answer.hit == expected.hit) {
            EXPECT_NEAR(answer.fraction, expected.fraction, 1e-6);
        } else {
            const double t = std::min(answer.fraction, expected.fraction);
            EXPECT_NEAR(distance_at(c, a, b, t), 0.0, 2e-9);
        }
        if (expected.started_in_contact && expected.hit) {
            EXPECT_TRUE(answer.started_in_contact);
        }
    }
}

TEST(CompoundCast, TurnsPartsAboutTheBodysOrigin) {
    // A ball on a 2 m arm swings a quarter turn onto a plate. About its own centre the ball would not hit.
    CompoundPart ball{Sphere{0.25}, {.translation = {2.0, 0.0, 0.0}}};
    const std::vector<CompoundPart> parts{CompoundPart{Sphere{0.1}, {}}, ball};
    const Compound arm = Compound::create(parts).value();
    const double quarter = 1.5707963267948966;
    const Motion still = motion_of(Pose{.translation = {-0.5, 2.0, 0.0}}, Eigen::Vector3d::Zero());
    CastSettings settings{.tolerance = 1e-9};
    for (const double turns : {1.0, 3.9, 40.0}) {
        const Motion turning = motion_of({}, Eigen::Vector3d::Zero(), {0.0, 0.0, turns * quarter});
        const PairCastAnswer met = cast(arm, turning, Box{{0.5, 1.0, 1.0}}, still, settings);
        ASSERT_TRUE(met.hit) << turns;
        EXPECT_EQ(met.contacts[0].part_a, 1u);
        // The ball touches x = 0 when its centre is at x = 0.25.
        EXPECT_NEAR(std::cos(met.fraction * turns * quarter), 0.125, 1e-8) << turns;
        const PairCastAnswer alone =
            cast(Sphere{0.25},
                 motion_of(ball.body_from_part, Eigen::Vector3d::Zero(), turning.rotation_vector),
                 Box{{0.5, 1.0, 1.0}}, still, settings);
        EXPECT_FALSE(alone.hit);
    }
    const Motion short_of_it = motion_of({}, Eigen::Vector3d::Zero(), {0.0, 0.0, 1.4});
    EXPECT_FALSE(cast(arm, short_of_it, Box{{0.5, 1.0, 1.0}}, still, settings).hit);
}

TEST_P(CompoundCasts, StartedInContactAreHitAtOnceUnlessTheyPartAndMayPass) {
    SeededRandom random(kSeed + 2);
    CastSettings passing{.skip_separating = true};
    const int cases = case_count(1'000);
    long overlapping = 0;
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const CompoundCase c = random_compound_case(random, GetParam(), i);
        const double least = least_distance(c.a, c.pose_a, c.b, c.pose_b);
        if (least > -1e-9) continue;
        ++overlapping;
        const Motion still = motion_of(c.pose_b, Eigen::Vector3d::Zero());
        const Motion any = motion_of(c.pose_a, random.direction(), random.direction());
        const PairCastAnswer at_once = cast(c.a, any, c.b, still, {});
        EXPECT_TRUE(at_once.hit);
        EXPECT_TRUE(at_once.started_in_contact);
        EXPECT_EQ(at_once.fraction, 0.0);
        EXPECT_GT(at_once.count, 0u);
        // Equal motions: no approach.
        const Eigen::Vector3d translation(3.0, -2.0, 1.0);
        EXPECT_FALSE(cast(c.a, motion_of(c.pose_a, translation), c.b,
                          motion_of(c.pose_b, translation), passing)
                         .hit);
    }
    EXPECT_GT(overlapping, cases / 20);
}

class CompoundRays : public testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(All, CompoundRays, testing::Values(4, 5), [](const auto& each) {
    return std::string(kOtherNames[static_cast<std::size_t>(each.param)]);
});

TEST_P(CompoundRays, MeetTheFirstOfAllParts) {
    SeededRandom random(kSeed + 3);
    const int cases = case_count(10'000);
    int hits = 0;
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const CompoundCase c = random_compound_case(random, GetParam(), 2 * i + 1);
        const Eigen::Vector3d from = c.pose_a.translation + 3.0 * random.direction();
        const Eigen::Vector3d to = c.pose_a.translation + 1.5 * random.direction();
        const ShapeRayAnswer answer = cast_ray(c.a, c.pose_a, from, to);
        ShapeRayAnswer expected;
        const std::vector<Piece> pieces = pieces_of(c.a, c.pose_a);
        for (std::size_t k = 0; k < pieces.size(); ++k) {
            const ShapeRayAnswer one =
                cast_ray(as_shape(pieces[k].shape), pieces[k].world_from_piece, from, to);
            if (one.hit && (!expected.hit || one.fraction < expected.fraction)) expected = one;
        }
        ASSERT_EQ(answer.hit, expected.hit);
        EXPECT_NEAR(answer.fraction, expected.fraction, 1e-9);
        hits += answer.hit;
        if (!answer.hit) continue;
        EXPECT_NEAR((answer.point_world - (from + answer.fraction * (to - from))).norm(), 0.0,
                    1e-12);
        EXPECT_NEAR(cast_ray(as_shape(pieces[answer.part].shape),
                             pieces[answer.part].world_from_piece, from, to)
                        .fraction,
                    answer.fraction, 1e-9);
    }
    EXPECT_GT(hits, cases / 20);
}

}  // namespace terrane::compound_cast_test

namespace terrane::shape_ray_test {

using namespace test;
using internal::ConvexRay;

constexpr std::uint64_t kSeed = 20261202;

class ShapeRays : public testing::TestWithParam<Kind> {};

INSTANTIATE_TEST_SUITE_P(All, ShapeRays,
                         testing::Values(Kind::sphere, Kind::capsule, Kind::box, Kind::hull),
                         [](const auto& each) { return name_of(each.param); });

// A ray is a hull of two points.
TEST_P(ShapeRays, MeetWhatASegmentMeetsAndWhereItFirstDoes) {
    SeededRandom random(kSeed);
    int hits = 0;
    for (int i = 0; i < case_count(10'000) && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const internal::ConvexView shape = random_shape(random, GetParam(), i % 5 == 3);
        Pose pose{.rotation = random.rotation()};
        const double reach = internal::reach_of(shape) + 0.1;
        const Eigen::Vector3d from = random.between(0.0, 2.0) * reach * random.direction();
        const Eigen::Vector3d to =
            i % 7 == 0 ? from : Eigen::Vector3d(1.3 * reach * random.direction());
        const ConvexRay ray = cast_ray(
            internal::place(shape, orthonormalized(pose.rotation), Eigen::Vector3d::Zero()), from,
            to - from);
        const auto distance_up_to = [&](double share) {
            const ConvexHull up_to = make_hull({from, from + std::max(share, 1e-9) * (to - from)});
            return oracle_distance(view_of(up_to), Pose{}, shape, pose);
        };
        const double distance = distance_up_to(1.0);
        if (std::abs(distance) > 1e-9) {
            EXPECT_EQ(ray.hit, distance < 0.0);
        }
        if (!ray.hit) continue;
        ++hits;
        EXPECT_NEAR(ray.normal.norm(), i % 7 == 0 ? ray.normal.norm() : 1.0, 1e-9);
        EXPECT_LE(ray.normal.dot(to - from), 1e-9);
        Pose at{.translation = from + ray.fraction * (to - from)};
        const double there = oracle_distance(Sphere{0.0}, at, shape, pose);
        if (ray.fraction > 0.0) {
            EXPECT_NEAR(there, 0.0, 1e-9);
            if (ray.fraction > 1e-6) {
                EXPECT_GE(distance_up_to(ray.fraction - 1e-7), -1e-9);
            }
        } else {
            EXPECT_LE(there, 1e-9);
        }
    }
    EXPECT_GT(hits, 1000);
}

TEST(ShapeRay, MeetsPeersFacts) {
    // A ball of radius 0.2 in the middle of a 30 m ray: the fraction is (15 - 0.2) / 30.
    Pose pose{.translation = {15.0, 0.0, 0.0}};
    const ShapeRayAnswer ball = cast_ray(Sphere{0.2}, pose, {0, 0, 0}, {30, 0, 0});
    ASSERT_TRUE(ball.hit);
    EXPECT_NEAR(ball.fraction, (15.0 - 0.2) / 30.0, 1e-15);
    EXPECT_NEAR(ball.normal.x(), -1.0, 1e-15);
    // A ray in the plane of a face touches; a ray beside it misses.
    EXPECT_TRUE(cast_ray(Box{}, Pose{}, {-2, 0.5, 0}, {2, 0.5, 0}).hit);
    EXPECT_FALSE(cast_ray(Box{}, Pose{}, {-2, 0.5000001, 0}, {2, 0.5000001, 0}).hit);
    EXPECT_TRUE(cast_ray(Capsule{0.5, 1.0}, Pose{}, {-2, 0, 1.5}, {2, 0, 1.5}).hit);
    const ShapeRayAnswer far = cast_ray(Sphere{0.5}, Pose{}, {-1e6, 0.3, 0}, {1e6, 0.3, 0});
    ASSERT_TRUE(far.hit);
    EXPECT_NEAR(far.point_world.x(), -0.4, 1e-9);
    const ShapeRayAnswer within = cast_ray(Box{}, Pose{}, {0.1, 0.1, 0.1}, {2, 0.1, 0.1});
    EXPECT_TRUE(within.hit);
    EXPECT_EQ(within.fraction, 0.0);
    EXPECT_EQ(within.normal, Eigen::Vector3d(-1, 0, 0));
}

}  // namespace terrane::shape_ray_test
