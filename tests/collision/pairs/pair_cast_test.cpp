// SPDX-License-Identifier: MIT
#include "case_count.h"
#include "pair_cases.h"
#include "thrown.h"

#include <gtest/gtest.h>

namespace terrane {
namespace pair_cast_test {

using internal::ConvexCast;
using test::Case;
using test::KindPair;
using test::motion_of;
using test::PlacedCase;
using test::Random;

constexpr std::uint64_t kSeed = 20261201;
const int kCases = test::case_count(10'000);

class PairCasts : public testing::TestWithParam<KindPair> {};

INSTANTIATE_TEST_SUITE_P(All, PairCasts, testing::ValuesIn(test::all_pairs()),
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
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    constexpr int kSteps = 60;
    const CastSettings settings;
    int hits = 0;
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const Case c = test::random_case(random, GetParam(), i);
        const test::Thrown thrown = test::throw_together(random, c.pose_a, c.pose_b, i);
        const auto distance = [&](double t) { return distance_at(c, thrown.a, thrown.b, t); };
        if (distance(0.0) <= 1e-3) continue;
        const ConvexCast answer = cast_convex(c.a, thrown.a, c.b, thrown.b, settings);
        hits += answer.hit;
        test::expect_stops_where_they_meet(answer, distance, kSteps, settings, 0.0);
    }
    EXPECT_GT(hits, kCases / 5);
}

TEST_P(PairCasts, StartedInContactAreHitAtOnceUnlessTheyPartAndMayPass) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 1);
    Random random(kSeed + 1);
    CastSettings passing;
    passing.skip_separating = true;
    for (int i = 0; i < kCases / 10 && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        Case c = test::random_case(random, GetParam(), i);
        if (i % 2 == 0) {  // moved to touch
            const PlacedCase before(c);
            c.pose_a.translation -= before.gap.distance * before.gap.normal;
        }
        const PlacedCase placed(c);
        if (placed.gap.distance > 1e-13) continue;
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
        // Nor with equal motions.
        const Motion along = motion_of(c.pose_b, {3.0, -2.0, 1.0});
        EXPECT_FALSE(
            cast_convex(c.a, motion_of(c.pose_a, {3.0, -2.0, 1.0}), c.b, along, passing).hit);
        const ConvexCast met = cast_convex(c.a, closing, c.b, still, passing);
        EXPECT_TRUE(met.hit);
        EXPECT_EQ(met.fraction, 0.0);
    }
}

TEST(PairCast, ReportsAContactThatOpensAndClosesAgain) {
    CastSettings passing;
    passing.skip_separating = true;
    // A rod tips over one edge of a table and hits it with its other end.
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
    // Up, over, and down again: two half turns of a lever.
    Motion lever = motion_of({}, Eigen::Vector3d::Zero(), {0.0, -6.0, 0.0});
    lever.start.translation = {-2.0, 0.0, 0.2};
    Pose wall;
    wall.translation = {-0.5, 0.0, -0.3};
    const ConvexCast back = cast_convex(Box{{2.0, 0.1, 0.2}}, lever, Box{{0.4, 1.0, 0.3}},
                                        motion_of(wall, Eigen::Vector3d::Zero()), passing);
    EXPECT_TRUE(back.started_in_contact);
    EXPECT_TRUE(back.hit);
    EXPECT_GT(back.fraction, 0.3);
    EXPECT_LT(back.fraction, 0.6);
}

TEST(PairCast, HoldsFromNoLengthToAThousandKilometres) {
    for (const double distance : {1e-3, 1.0, 1e3, 1e6}) {
        Pose far;
        far.translation = {0.5 * distance + 1.0, 0.0, 0.0};
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
    Pose beside;
    beside.translation = {2.0, 0.0, 0.0};
    const Motion none = motion_of({}, Eigen::Vector3d::Zero());
    EXPECT_FALSE(
        cast_convex(Box{}, none, Box{}, motion_of(beside, Eigen::Vector3d::Zero()), {}).hit);
    EXPECT_TRUE(cast_convex(Box{}, none, Box{}, none, {}).hit);
}

}  // namespace pair_cast_test
}  // namespace terrane
