// SPDX-License-Identifier: MIT
#include "case_count.h"
#include "pair_cases.h"
#include "pair_oracle.h"

#include <gtest/gtest.h>

namespace terrane {
namespace pair_distance_test {

using test::Case;
using test::KindPair;
using test::PlacedCase;
using test::Random;

constexpr std::uint64_t kSeed = 20261121;
const int kCases = test::case_count(10'000);

class Pairs : public testing::TestWithParam<KindPair> {};

INSTANTIATE_TEST_SUITE_P(All, Pairs, testing::ValuesIn(test::all_pairs()),
                         [](const auto& each) { return each.param.name(); });

TEST_P(Pairs, DistanceIsThatOfAllPairsOfFeatures) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    double worst = 0.0;
    int overlapping = 0;
    for (int i = 0; i < kCases; ++i) {
        const Case c = test::random_case(random, GetParam(), i);
        const PlacedCase placed(c);
        const double expected = test::oracle_distance(c.a, c.pose_a, c.b, c.pose_b);
        overlapping += expected < 0.0;
        worst = std::max(worst, std::abs(placed.gap.distance - expected));
        EXPECT_NEAR(placed.gap.distance, expected, 1e-9) << "case " << i;
        EXPECT_NEAR(placed.gap.normal.norm(), 1.0, 1e-12) << "case " << i;
        if (HasFailure()) return;
    }
    RecordProperty("worst", std::to_string(worst));
    EXPECT_GT(overlapping, kCases / 5);
    EXPECT_LT(overlapping, 9 * kCases / 10);
}

// How far a point is from a shape's surface.
double off_surface(const internal::ConvexView& shape, const Pose& pose, const Eigen::Vector3d& p) {
    Pose at_p;
    at_p.translation = p;
    return std::abs(test::oracle_distance(Sphere{0.0}, at_p, shape, pose));
}

TEST_P(Pairs, NearestPointsLieOnBothShapes) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 1);
    Random random(kSeed + 1);
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const Case c = test::random_case(random, GetParam(), i);
        const PlacedCase placed(c);
        Eigen::Vector3d on_a, on_b;
        find_witnesses(placed.a, placed.b, placed.gap, on_a, on_b);
        EXPECT_NEAR(placed.gap.normal.dot(on_a - on_b), placed.gap.distance, 1e-9);
        EXPECT_NEAR((on_a - on_b).norm(), std::abs(placed.gap.distance), 1e-9);
        EXPECT_LE(off_surface(c.a, c.pose_a, c.pose_a.translation + on_a), 1e-9);
        EXPECT_LE(off_surface(c.b, c.pose_b, c.pose_a.translation + on_b), 1e-9);
    }
}

TEST_P(Pairs, ContactsPartTheShapesAndLieOnBoth) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 2);
    Random random(kSeed + 2);
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        Case c = test::random_case(random, GetParam(), i);
        const PlacedCase placed(c);
        const double margin = i % 2 == 0 ? 0.05 : 0.0;
        std::array<PairContact, 4> contacts;
        const std::size_t count = find_contacts(placed.a, placed.b, placed.gap, margin, contacts);
        if (std::abs(placed.gap.distance - margin) > 1e-9) {
            ASSERT_EQ(count > 0, placed.gap.distance < margin);
        }
        if (count == 0) continue;
        EXPECT_NEAR(contacts[0].depth, -placed.gap.distance, 1e-9);
        for (std::size_t k = 0; k < count; ++k) {
            const PairContact& contact = contacts[k];
            EXPECT_LE(contact.depth, contacts[k == 0 ? 0 : k - 1].depth);
            EXPECT_GE(contact.depth, -margin - 1e-11);
            EXPECT_EQ(contact.normal, contacts[0].normal);
            const Eigen::Vector3d on_a = c.pose_a.translation + contact.point_world;
            const Eigen::Vector3d on_b = on_a + contact.depth * contact.normal;
            // At an end of a capsule that is not the deepest the point is inside the other shape.
            if (k == 0 || GetParam().a != test::Kind::capsule) {
                EXPECT_LE(off_surface(c.a, c.pose_a, on_a), 1e-8) << k;
                EXPECT_LE(off_surface(c.b, c.pose_b, on_b), 1e-8) << k;
            }
        }
        c.pose_a.translation += contacts[0].depth * contacts[0].normal;
        EXPECT_NEAR(test::oracle_distance(c.a, c.pose_a, c.b, c.pose_b), 0.0, 1e-9);
    }
}

TEST_P(Pairs, TestSaysWhatFindAndDistanceSay) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 3);
    Random random(kSeed + 3);
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        Case c = test::random_case(random, GetParam(), i);
        // Some pairs are moved to touch.
        if (i % 3 == 0) {
            const PlacedCase before(c);
            const double rest = i % 2 == 0 ? 0.0 : random.between(-1e-11, 1e-11);
            c.pose_a.translation -= (before.gap.distance + rest) * before.gap.normal;
        }
        const PlacedCase placed(c);
        const double touch =
            internal::kTouchShare * (internal::reach_of(c.a) + internal::reach_of(c.b));
        std::array<PairContact, 4> contacts;
        const bool is_found = find_contacts(placed.a, placed.b, placed.gap, touch, contacts) > 0;
        EXPECT_EQ(is_found, placed.gap.distance <= touch) << placed.gap.distance;
        // Except within rounding of the touching distance.
        if (std::abs(placed.gap.distance - touch) > 1e-14) {
            EXPECT_EQ(is_touching(placed.a, placed.b), is_found) << placed.gap.distance;
        }
    }
}

TEST_P(Pairs, MovedToWhereTheyTouchHaveNoDistance) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 4);
    Random random(kSeed + 4);
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        Case c = test::random_case(random, GetParam(), i);
        const PlacedCase before(c);
        c.pose_a.translation -= before.gap.distance * before.gap.normal;
        EXPECT_NEAR(PlacedCase(c).gap.distance, 0.0, 1e-14) << "case " << i;
    }
}

TEST_P(Pairs, PseudodistanceIsWhatItsDefinitionSays) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 5);
    Random random(kSeed + 5);
    const auto is_round = [](test::Kind kind) {
        return kind == test::Kind::sphere || kind == test::Kind::capsule;
    };
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        Case c = test::random_case(random, GetParam(), i);
        const PlacedCase placed(c);
        const internal::Axis axis = find_pseudodistance(placed.a, placed.b);
        const test::Solid a = test::make_solid(c.a, c.pose_a, c.pose_a.translation);
        const test::Solid b = test::make_solid(c.b, c.pose_b, c.pose_a.translation);
        const double signed_distance = test::oracle_distance(c.a, c.pose_a, c.b, c.pose_b);
        const auto radii = static_cast<double>(a.radius + b.radius);
        const double widest = static_cast<double>(widest_gap(a, b));
        if (is_round(GetParam().a) && is_round(GetParam().b)) {
            const double d = signed_distance + radii;
            const double expected = radii == 0.0 ? d : (d * d - radii * radii) / (2.0 * radii);
            EXPECT_NEAR(axis.gap, expected, 1e-9);
        } else if (is_round(GetParam().a)) {
            EXPECT_NEAR(axis.gap, signed_distance, 1e-9);
        } else if (GetParam().a == test::Kind::box && GetParam().b == test::Kind::box &&
                   std::abs(widest) > 1e-9 && a.vertices.size() == 8 && b.vertices.size() == 8) {
            EXPECT_NEAR(axis.gap, widest, 1e-9);
        } else {
            EXPECT_LE(axis.gap, signed_distance + 1e-9);
            if (signed_distance < 0.0) {
                EXPECT_NEAR(axis.gap, signed_distance, 1e-9);
            }
        }
        if (std::abs(signed_distance) > 1e-9) {
            EXPECT_EQ(axis.gap > 0.0, signed_distance > 0.0);
        }
        double last = axis.gap;
        for (int k = 0; k < 4; ++k) {
            c.pose_a.translation += random.between(0.0, 0.3) * axis.normal;
            const PlacedCase moved(c);
            const double now = find_pseudodistance(moved.a, moved.b).gap;
            EXPECT_GE(now, last - 1e-12);
            last = now;
        }
    }
}

TEST_P(Pairs, GiveTheSameAnswerEitherWayRoundAndInAnyFrame) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 6);
    Random random(kSeed + 6);
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const Case c = test::random_case(random, GetParam(), i);
        const PlacedCase here(c);
        const PlacedCase swapped(Case{c.b, c.a, c.pose_b, c.pose_a});
        EXPECT_NEAR(here.gap.distance, swapped.gap.distance, 1e-13);
        EXPECT_NEAR(find_pseudodistance(here.a, here.b).gap,
                    find_pseudodistance(swapped.a, swapped.b).gap, 1e-13);
        EXPECT_EQ(is_touching(here.a, here.b), is_touching(swapped.a, swapped.b));

        Pose motion;
        motion.rotation = random.rotation();
        motion.translation = 10.0 * random.direction();
        Case other = c;
        for (Pose* pose : {&other.pose_a, &other.pose_b}) {
            pose->translation = motion * pose->translation;
            pose->rotation = motion.rotation * pose->rotation;
        }
        const PlacedCase there(other);
        EXPECT_NEAR(here.gap.distance, there.gap.distance, 1e-13);
        EXPECT_NEAR(find_pseudodistance(here.a, here.b).gap,
                    find_pseudodistance(there.a, there.b).gap, 1e-13);
    }
}

TEST_P(Pairs, DistanceGrowsAsMuchAsTheShapesMoveApart) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 7);
    Random random(kSeed + 7);
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        Case c = test::random_case(random, GetParam(), i);
        const PlacedCase before(c);
        const double moved = random.between(0.0, 2.0);
        c.pose_a.translation += moved * before.gap.normal;
        const PlacedCase after(c);
        EXPECT_GE(after.gap.distance, before.gap.distance - 1e-12) << "case " << i;
        EXPECT_LE(after.gap.distance, before.gap.distance + moved + 1e-12) << "case " << i;
        if (before.gap.distance > -moved) {
            EXPECT_NEAR(after.gap.distance, before.gap.distance + moved, 1e-6) << "case " << i;
        }
    }
}

}  // namespace pair_distance_test
}  // namespace terrane
