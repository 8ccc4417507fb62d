// SPDX-License-Identifier: MIT
#include "compound_cases.h"
#include "pairs/convex_core.h"

#include <gtest/gtest.h>

namespace terrane {
namespace compound_pairs_test {

using test::CompoundCase;
using test::Random;

constexpr std::uint64_t kSeed = 20261210;

// A compound against each kind of shape.
class CompoundPairs : public testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(All, CompoundPairs, testing::Range(0, 6), [](const auto& each) {
    return std::string("compound_") + test::kOtherNames[static_cast<std::size_t>(each.param)];
});

TEST_P(CompoundPairs, ApartAreAsFarAsTheirNearestParts) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const int cases = test::case_count(10'000);
    int apart = 0;
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const CompoundCase c = test::random_compound_case(random, GetParam(), i);
        const double least = test::least_distance(c.a, c.pose_a, c.b, c.pose_b);
        if (i % 50 == 0) {
            EXPECT_NEAR(least, test::oracle_least(c.a, c.pose_a, c.b, c.pose_b), 1e-9);
        }
        if (std::abs(least) > 1e-11) {
            EXPECT_EQ(test_contact(c.a, c.pose_a, c.b, c.pose_b).is_touching, least < 0.0);
        }
        if (least <= 0.0) continue;
        ++apart;
        const PairDistanceAnswer answer = signed_distance(c.a, c.pose_a, c.b, c.pose_b);
        EXPECT_NEAR(answer.distance, least, 1e-12);
        const Eigen::Vector3d between = answer.point_a_world - answer.point_b_world;
        EXPECT_NEAR(between.norm(), least, 1e-9);
        EXPECT_NEAR(answer.normal.dot(between), least, 1e-9);
        const test::Piece p = test::pieces_of(c.a, c.pose_a)[answer.part_a];
        const test::Piece q = test::pieces_of(c.b, c.pose_b)[answer.part_b];
        EXPECT_NEAR(signed_distance(test::as_shape(p.shape), p.world_from_piece,
                                    test::as_shape(q.shape), q.world_from_piece)
                        .distance,
                    least, 1e-12);
    }
    EXPECT_GT(apart, cases / 5);
    EXPECT_LT(apart, 9 * cases / 10);
}

TEST_P(CompoundPairs, OverlappingArePartedByTheirDistanceAndHardlyByLess) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 1);
    Random random(kSeed + 1);
    const int cases = test::case_count(1'000);
    double worst = 1.0;
    int overlapping = 0, longer = 0;  // than 1.25 times the shortest sampled one
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        CompoundCase c = test::random_compound_case(random, GetParam(), i);
        const double least = test::least_distance(c.a, c.pose_a, c.b, c.pose_b);
        if (!(least < -1e-9)) continue;
        ++overlapping;
        double enough = 1.0;
        const PairDistanceAnswer answer = signed_distance(c.a, c.pose_a, c.b, c.pose_b);
        EXPECT_LE(answer.distance, least + 1e-11);
        EXPECT_NEAR(answer.normal.norm(), 1.0, 1e-12);
        EXPECT_NEAR(answer.normal.dot(answer.point_a_world - answer.point_b_world), answer.distance,
                    1e-9);
        const Eigen::Vector3d from = c.pose_a.translation;
        c.pose_a.translation = from - answer.distance * answer.normal;
        EXPECT_GE(test::least_distance(c.a, c.pose_a, c.b, c.pose_b), -1e-11);
        for (int k = 0; k < 40; ++k) {
            // No sampled direction separates with a much shorter translation.
            const double share = random.between(0.3, 1.0);
            c.pose_a.translation = from - share * answer.distance * random.direction();
            if (share < enough && !test_contact(c.a, c.pose_a, c.b, c.pose_b).is_touching) {
                enough = share;
            }
        }
        worst = std::min(worst, enough);
        longer += enough < 0.8 ? 1 : 0;
    }
    RecordProperty("worst", std::to_string(worst));
    RecordProperty("overlapping", overlapping);
    EXPECT_EQ(longer, 0) << "of " << overlapping << ", the worst " << 1.0 / worst
                         << " times as long";
}

TEST_P(CompoundPairs, ContactsAgreeWithTestAndFree) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 2);
    Random random(kSeed + 2);
    const int cases = test::case_count(10'000);
    std::array<PairContact, 96> contacts;
    int separated = 0, overlapping = 0, rounds = 0, truncated = 0;
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        CompoundCase c = test::random_compound_case(random, GetParam(), i);
        const double least = test::least_distance(c.a, c.pose_a, c.b, c.pose_b);
        const double margin = i % 2 == 0 ? 0.05 : 0.0;
        const PairContactAnswer found =
            find_contacts(c.a, c.pose_a, c.b, c.pose_b, margin, contacts);
        EXPECT_NE(found.status, QueryStatus::invalid);
        truncated += found.status == QueryStatus::truncated;
        if (std::abs(least - margin) > 1e-9) {
            EXPECT_EQ(found.count > 0, least < margin);
        }
        for (std::size_t k = 0; k < found.count; ++k) {
            EXPECT_NEAR(contacts[k].normal.norm(), 1.0, 1e-9);
            EXPECT_LE(contacts[k].depth, contacts[k == 0 ? 0 : k - 1].depth);
            EXPECT_GE(contacts[k].depth, -margin - 1e-9);
            // The point lies on the named part of a.
            const test::Piece p = test::pieces_of(c.a, c.pose_a)[contacts[k].part_a];
            Pose at_point;
            at_point.translation = contacts[k].point_world;
            EXPECT_LE(
                signed_distance(Sphere{0.0}, at_point, test::as_shape(p.shape), p.world_from_piece)
                    .distance,
                1e-9);
        }
        if (least > -1e-9) continue;
        ++overlapping;
        // The shortest translation with each contact's depth along its normal separates the shapes.
        bool is_free = false;
        for (int round = 0; round < 8 && !is_free; ++round) {
            const PairContactAnswer now =
                find_contacts(c.a, c.pose_a, c.b, c.pose_b, 0.0, contacts);
            ASSERT_GT(now.count, 0u);
            internal::HalfSpaces wanted;
            for (std::size_t k = 0; k < now.count; ++k) {
                const PairContact& contact = contacts[k];
                bool is_known = false;
                for (std::size_t m = 0; m < wanted.count; ++m) {
                    is_known |= wanted.planes[m].normal.dot(contact.normal) > 1.0 - 1e-12;
                }
                if (!is_known) wanted.add({contact.normal, contact.depth});
            }
            Eigen::Vector3d translation;
            const bool is_solved = internal::find_shortest(wanted, translation);
            if (!is_solved) translation = contacts[0].depth * contacts[0].normal;
            c.pose_a.translation += translation;
            is_free = test::least_distance(c.a, c.pose_a, c.b, c.pose_b) > -1e-9;
            rounds = std::max(rounds, round + 1);
        }
        separated += is_free;
    }
    RecordProperty("rounds", rounds);
    RecordProperty("truncated", truncated);
    EXPECT_LT(truncated, cases / 20);
    EXPECT_EQ(separated, overlapping);
    EXPECT_GT(overlapping, cases / 10);
}

TEST_P(CompoundPairs, PseudodistanceHasTheSignOfTheDistance) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 3);
    Random random(kSeed + 3);
    const int cases = test::case_count(10'000);
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const CompoundCase c = test::random_compound_case(random, GetParam(), i);
        const double least = test::least_distance(c.a, c.pose_a, c.b, c.pose_b);
        const PseudodistanceAnswer answer = pseudodistance(c.a, c.pose_a, c.b, c.pose_b);
        double of_parts = std::numeric_limits<double>::infinity();
        for (const test::Piece& p : test::pieces_of(c.a, c.pose_a)) {
            for (const test::Piece& q : test::pieces_of(c.b, c.pose_b)) {
                of_parts =
                    std::min(of_parts, pseudodistance(test::as_shape(p.shape), p.world_from_piece,
                                                      test::as_shape(q.shape), q.world_from_piece)
                                           .pseudodistance);
            }
        }
        EXPECT_GE(answer.pseudodistance, of_parts - 1e-12);
        if (least < -1e-9) {
            EXPECT_NEAR(answer.pseudodistance, of_parts, 1e-12);
        }
        if (std::abs(least) > 1e-9) {
            EXPECT_EQ(answer.pseudodistance > 0.0, least > 0.0);
        }
    }
}

TEST_P(CompoundPairs, GiveTheSameAnswerEitherWayRoundAndInAnyFrame) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 4);
    Random random(kSeed + 4);
    const int cases = test::case_count(2'000);
    int overlapping = 0, alike = 0, apart = 0;
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const CompoundCase c = test::random_compound_case(random, GetParam(), i);
        Pose frame;
        frame.rotation = random.rotation();
        frame.translation = 10.0 * random.direction();
        const Pose there_a = test::composed(frame, c.pose_a),
                   there_b = test::composed(frame, c.pose_b);
        const double here = signed_distance(c.a, c.pose_a, c.b, c.pose_b).distance;
        const double swapped = signed_distance(c.b, c.pose_b, c.a, c.pose_a).distance;
        const double there = signed_distance(c.a, there_a, c.b, there_b).distance;
        if (here > 0.0) {
            EXPECT_NEAR(here, swapped, 1e-12);
            EXPECT_NEAR(here, there, 1e-12);
        } else {  // the search may find another local minimum
            EXPECT_LT(swapped, 1e-9);
            EXPECT_LT(there, 1e-9);
            const double longest = std::max({-here, -swapped, -there});
            const double shortest = std::min({-here, -swapped, -there});
            ++overlapping;
            alike += longest - shortest < 1e-9;
            apart += shortest < 0.8 * longest - 1e-9;
        }
        const double pseudo = pseudodistance(c.a, c.pose_a, c.b, c.pose_b).pseudodistance;
        EXPECT_NEAR(pseudo, pseudodistance(c.b, c.pose_b, c.a, c.pose_a).pseudodistance, 1e-12);
        EXPECT_NEAR(pseudo, pseudodistance(c.a, there_a, c.b, there_b).pseudodistance, 1e-12);
    }
    RecordProperty("overlapping", overlapping);
    RecordProperty("alike", alike);
    RecordProperty("apart", apart);
    EXPECT_GT(alike, overlapping * 9 / 10);
    EXPECT_LE(apart, overlapping / 200);
}

}  // namespace compound_pairs_test
}  // namespace terrane
