// SPDX-License-Identifier: MIT
#include "compound_cases.h"
#include "thrown.h"

#include <gtest/gtest.h>

namespace terrane {
namespace compound_cast_test {

using test::CompoundCase;
using test::motion_of;
using test::Random;

constexpr std::uint64_t kSeed = 20261211;

class CompoundCasts : public testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(All, CompoundCasts, testing::Range(0, 6), [](const auto& each) {
    return std::string("compound_") + test::kOtherNames[static_cast<std::size_t>(each.param)];
});

double distance_at(const CompoundCase& c, const Motion& a, const Motion& b, double t) {
    return test::least_distance(c.a, a.at(t), c.b, b.at(t));
}

TEST_P(CompoundCasts, StopWhereDenseStepsSayTheyMeet) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    constexpr int kSteps = 20;
    const int cases = test::case_count(1'000);
    const CastSettings settings;
    int hits = 0;
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const CompoundCase c = test::random_compound_case(random, GetParam(), i);
        const test::Thrown thrown = test::throw_together(random, c.pose_a, c.pose_b, i);
        const auto distance = [&](double t) { return distance_at(c, thrown.a, thrown.b, t); };
        if (distance(0.0) <= 1e-3) continue;
        const PairCastAnswer answer = cast(c.a, thrown.a, c.b, thrown.b, settings);
        ASSERT_EQ(answer.status, QueryStatus::complete);
        hits += answer.hit;
        test::expect_stops_where_they_meet(answer, distance, kSteps, settings, 1e-12);
    }
    EXPECT_GT(hits, cases / 5);
}

TEST_P(CompoundCasts, AreTheEarliestOfTheirParts) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 1);
    Random random(kSeed + 1);
    const int cases = test::case_count(10'000);
    CastSettings settings;
    settings.tolerance = 1e-9;
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const CompoundCase c = test::random_compound_case(random, GetParam(), i);
        settings.skip_separating = i % 3 == 0;
        // Without rotation a part moves as its body does.
        const Motion a = motion_of(c.pose_a, 5.0 * random.direction());
        const Motion b = motion_of(c.pose_b, random.direction());
        const PairCastAnswer answer = cast(c.a, a, c.b, b, settings);
        PairCastAnswer expected;
        for (const test::Piece& p : test::pieces_of(c.a, c.pose_a)) {
            for (const test::Piece& q : test::pieces_of(c.b, c.pose_b)) {
                const PairCastAnswer one =
                    cast(test::as_shape(p.shape), motion_of(p.world_from_piece, a.translation),
                         test::as_shape(q.shape), motion_of(q.world_from_piece, b.translation),
                         settings);
                if (one.started_in_contact) expected.started_in_contact = true;
                if (one.hit && one.fraction < expected.fraction) expected = one;
            }
        }
        // For grazing contacts both results are valid.
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
    // A ball on an arm of 2 m rotates by a quarter turn onto a plate; the ball itself has no rotation axis off its
    // centre.
    CompoundPart ball;
    ball.shape = Sphere{0.25};
    ball.body_from_part.translation = {2.0, 0.0, 0.0};
    CompoundPart hub;
    hub.shape = Sphere{0.1};
    const std::vector<CompoundPart> parts{hub, ball};
    const Compound arm = Compound::create(parts).value();
    const double quarter = 1.5707963267948966;
    Pose plate;
    plate.translation = {-0.5, 2.0, 0.0};
    const Motion still = motion_of(plate, Eigen::Vector3d::Zero());
    CastSettings settings;
    settings.tolerance = 1e-9;
    for (const double turns : {1.0, 3.9, 40.0}) {
        const Motion turning = motion_of({}, Eigen::Vector3d::Zero(), {0.0, 0.0, turns * quarter});
        const PairCastAnswer met = cast(arm, turning, Box{{0.5, 1.0, 1.0}}, still, settings);
        ASSERT_TRUE(met.hit) << turns;
        EXPECT_EQ(met.contacts[0].part_a, 1u);
        // The ball's side is at x = 0 where its centre's x is 0.25.
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
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 2);
    Random random(kSeed + 2);
    CastSettings passing;
    passing.skip_separating = true;
    for (int i = 0; i < test::case_count(1'000) && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const CompoundCase c = test::random_compound_case(random, GetParam(), i);
        const double least = test::least_distance(c.a, c.pose_a, c.b, c.pose_b);
        if (least > -1e-9) continue;
        const Motion still = motion_of(c.pose_b, Eigen::Vector3d::Zero());
        const Motion any = motion_of(c.pose_a, random.direction(), random.direction());
        const PairCastAnswer at_once = cast(c.a, any, c.b, still, {});
        EXPECT_TRUE(at_once.hit);
        EXPECT_TRUE(at_once.started_in_contact);
        EXPECT_EQ(at_once.fraction, 0.0);
        EXPECT_GT(at_once.count, 0u);
        // Equal motions: nothing approaches.
        const Eigen::Vector3d translation(3.0, -2.0, 1.0);
        EXPECT_FALSE(cast(c.a, motion_of(c.pose_a, translation), c.b,
                          motion_of(c.pose_b, translation), passing)
                         .hit);
    }
}

class CompoundRays : public testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(All, CompoundRays, testing::Values(4, 5), [](const auto& each) {
    return std::string(test::kOtherNames[static_cast<std::size_t>(each.param)]);
});

TEST_P(CompoundRays, MeetTheFirstOfAllParts) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 3);
    Random random(kSeed + 3);
    const int cases = test::case_count(10'000);
    int hits = 0;
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const CompoundCase c = test::random_compound_case(random, GetParam(), 2 * i + 1);
        const Eigen::Vector3d from = c.pose_a.translation + 3.0 * random.direction();
        const Eigen::Vector3d to = c.pose_a.translation + 1.5 * random.direction();
        const ShapeRayAnswer answer = cast_ray(c.a, c.pose_a, from, to);
        ShapeRayAnswer expected;
        const std::vector<test::Piece> pieces = test::pieces_of(c.a, c.pose_a);
        for (std::size_t k = 0; k < pieces.size(); ++k) {
            const ShapeRayAnswer one =
                cast_ray(test::as_shape(pieces[k].shape), pieces[k].world_from_piece, from, to);
            if (one.hit && (!expected.hit || one.fraction < expected.fraction)) expected = one;
        }
        ASSERT_EQ(answer.hit, expected.hit);
        EXPECT_NEAR(answer.fraction, expected.fraction, 1e-9);
        hits += answer.hit;
        if (!answer.hit) continue;
        EXPECT_NEAR((answer.point_world - (from + answer.fraction * (to - from))).norm(), 0.0,
                    1e-12);
        EXPECT_NEAR(cast_ray(test::as_shape(pieces[answer.part].shape),
                             pieces[answer.part].world_from_piece, from, to)
                        .fraction,
                    answer.fraction, 1e-9);
    }
    EXPECT_GT(hits, cases / 20);
}

}  // namespace compound_cast_test
}  // namespace terrane
