// SPDX-License-Identifier: MIT
#include "compound_cases.h"

#include <terrane/collision/shape_pairs.h>

#include <gtest/gtest.h>

namespace terrane::shape_pairs_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261203;

Pose at(const Eigen::Vector3d& translation) { return Pose{.translation = translation}; }

TEST(ShapePairs, TouchingIsZeroAndTouches) {
    // Sums of halves and quarters: exact.
    const Shape ball = Sphere{0.5}, rod = Capsule{0.25, 0.5}, box = Box{{1.0, 0.5, 0.25}};
    const struct {
        Shape a, b;
        Eigen::Vector3d offset;
    } cases[] = {
        {ball, ball, {1.0, 0, 0}},   {ball, rod, {0.75, 0, 0.25}}, {ball, rod, {0, 0, 1.25}},
        {ball, box, {1.5, 0.25, 0}}, {ball, box, {0, 0, 0.75}},    {rod, rod, {0, 0.5, 0.125}},
        {rod, rod, {0, 0, 1.5}},     {rod, box, {1.25, 0, 0}},     {rod, box, {0, 0, 1.0}},
        {box, box, {2.0, 0, 0}},     {box, box, {2.0, 1.0, 0.5}},  {box, box, {0, 0, -0.5}}};
    for (const auto& c : cases) {
        EXPECT_EQ(signed_distance(c.a, at(c.offset), c.b, Pose{}).distance, 0.0);
        EXPECT_TRUE(test_contact(c.a, at(c.offset), c.b, Pose{}).is_touching);
        std::array<PairContact, 4> contacts;
        EXPECT_GT(find_contacts(c.a, at(c.offset), c.b, Pose{}, 0.0, contacts).count, 0u);
        EXPECT_FALSE(test_contact(c.a, at(1.0001 * c.offset), c.b, Pose{}).is_touching);
        EXPECT_EQ(find_contacts(c.a, at(1.0001 * c.offset), c.b, Pose{}, 0.0, contacts).count, 0u);
    }
}

TEST(ShapePairs, RestingManifoldsHaveTheCornersThatMatter) {
    std::array<PairContact, 4> contacts;
    const PairContactAnswer box = find_contacts(Box{{0.5, 0.5, 0.5}}, at({0.1, 0.2, 0.99}),
                                                Box{{2, 2, 0.5}}, Pose{}, 0.0, contacts);
    ASSERT_EQ(box.count, 4u);
    for (const PairContact& contact : contacts) {
        EXPECT_EQ(contact.normal, Eigen::Vector3d(0, 0, 1));
        EXPECT_NEAR(contact.depth, 0.01, 1e-15);
        EXPECT_NEAR(std::abs(contact.point_world.x() - 0.1), 0.5, 1e-15);
        EXPECT_NEAR(std::abs(contact.point_world.y() - 0.2), 0.5, 1e-15);
        EXPECT_EQ(contact.feature_b, (ShapeFeature{5, ShapeFeature::kFace}));
        EXPECT_EQ(contact.feature_a.first, contact.feature_a.second);
    }
    Pose lying = at({0, 0, 0.74});
    lying.rotation << 0, 0, 1, 0, 1, 0, -1, 0, 0;
    const PairContactAnswer rod =
        find_contacts(Capsule{0.25, 1.0}, lying, Box{{2, 2, 0.5}}, Pose{}, 0.0, contacts);
    ASSERT_EQ(rod.count, 2u);
    EXPECT_NEAR(std::abs(contacts[0].point_world.x() - contacts[1].point_world.x()), 2.0, 1e-15);
    // Two parallel rods that overlap over half their length.
    Pose beside = at({0.0, 0.4, 1.0});
    const PairContactAnswer rods =
        find_contacts(Capsule{0.25, 1.0}, beside, Capsule{0.25, 1.0}, Pose{}, 0.0, contacts);
    ASSERT_EQ(rods.count, 2u);
    EXPECT_NEAR(contacts[0].depth, 0.1, 1e-15);
    EXPECT_NEAR(contacts[0].point_world.z() + contacts[1].point_world.z(), 1.0, 1e-15);
    // With a smaller buffer the deepest contacts are kept and the truncation is reported.
    EXPECT_EQ(
        find_contacts(Box{}, at({0, 0, 0.9}), Box{}, Pose{}, 0.0, std::span(contacts.data(), 1))
            .status,
        QueryStatus::truncated);
}

TEST(ShapePairs, SpheresAndCapsulesTouchUpToAShareOfTheirSizes) {
    const struct {
        Shape a, b;
        double reach, size;  // centres along x at which they touch; sum of the sizes
    } cases[] = {{Sphere{0.5}, Sphere{0.25}, 0.75, 0.75},
                 {Sphere{1e-3}, Sphere{1e4}, 10'000.001, 10'000.001},
                 {Sphere{0.5}, Capsule{0.25, 3.0}, 0.75, 3.75},
                 {Sphere{0.0}, Capsule{0.0, 3.0}, 0.0, 3.0},
                 {Capsule{0.5, 1e3}, Capsule{0.25, 3.0}, 0.75, 1003.75},
                 {Capsule{0.0, 2.0}, Capsule{0.0, 4.0}, 0.0, 6.0}};
    for (const auto& c : cases) {
        // centres off the origin's axes
        Pose turned;
        turned.rotation = test::Random(kSeed).rotation();
        const auto is_touching = [&](double gap) {
            Pose pose = turned;
            pose.translation = (c.reach + gap) * turned.rotation.col(0);
            return test_contact(c.a, pose, c.b, turned).is_touching;
        };
        EXPECT_TRUE(is_touching(0.8e-12 * c.size)) << c.reach << ' ' << c.size;
        EXPECT_FALSE(is_touching(1.2e-12 * c.size)) << c.reach << ' ' << c.size;
    }
}

TEST(ShapePairs, HoldFromAMillimetreToTenKilometres) {
    SeededRandom random(kSeed);
    for (const double small : {1e-3, 1.0, 1e4}) {
        for (const double large : {1e-3, 1e4, 1e5}) {
            for (int i = 0; i < 200; ++i) {
                Pose pose{.rotation = random.rotation()};
                const Shape a = i % 3 == 0   ? Shape(Sphere{small})
                                : i % 3 == 1 ? Shape(Capsule{small, small})
                                             : Shape(Box{{small, small, small}});
                const Box floor{{large, large, large}};
                // A point on its top face or edge.
                const double gap = random.between(-1.0, 3.0) * std::min(small, large);
                pose.translation = {random.between(-1.0, 1.0) * large + gap, large + gap,
                                    large + gap};
                const PairDistanceAnswer answer = signed_distance(a, pose, floor, Pose{});
                const double expected = oracle_least(a, pose, floor, Pose{});
                EXPECT_NEAR(answer.distance, expected, 1e-12 * (small + large))
                    << "kind " << i % 3 << " sizes " << small << " and " << large;
                EXPECT_EQ(test_contact(a, pose, floor, Pose{}).is_touching, answer.distance <= 0.0);
            }
        }
    }
}

TEST(ShapePairs, RefuseWhatIsNotFiniteOrNotARotation) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Pose skewed;
    skewed.rotation(0, 1) = 1e-3;
    Pose mirrored;
    mirrored.rotation(2, 2) = -1.0;
    std::array<PairContact, 4> contacts;
    const std::vector<CompoundPart> parts{{Sphere{0.5}, {}}, {Box{}, at({0, 0, 1})}};
    for (const Shape& shape : {Shape(Box{}), Shape(Compound::create(parts).value())}) {
        for (const Pose& bad : {skewed, mirrored, at({nan, 0, 0}), at({0, HUGE_VAL, 0})}) {
            for (const bool is_first : {true, false}) {
                const Pose& a = is_first ? bad : Pose{};
                const Pose& b = is_first ? Pose{} : bad;
                EXPECT_EQ(test_contact(shape, a, shape, b).status, QueryStatus::invalid);
                EXPECT_EQ(find_contacts(shape, a, shape, b, 0.0, contacts).status,
                          QueryStatus::invalid);
                EXPECT_EQ(signed_distance(shape, a, shape, b).status, QueryStatus::invalid);
                EXPECT_EQ(pseudodistance(shape, a, shape, b).status, QueryStatus::invalid);
                EXPECT_EQ(cast(shape, {a}, shape, {b}).status, QueryStatus::invalid);
            }
            EXPECT_EQ(cast_ray(shape, bad, {0, 0, 0}, {1, 0, 0}).status, QueryStatus::invalid);
        }
    }
    EXPECT_EQ(signed_distance(Sphere{nan}, Pose{}, Box{}, Pose{}).status, QueryStatus::invalid);
    EXPECT_EQ(signed_distance(Box{}, Pose{}, Sphere{-1.0}, Pose{}).status, QueryStatus::invalid);
    EXPECT_EQ(find_contacts(Box{}, Pose{}, Box{}, Pose{}, nan, contacts).status,
              QueryStatus::invalid);
    EXPECT_EQ(cast_ray(Box{}, Pose{}, {nan, 0, 0}, {1, 0, 0}).status, QueryStatus::invalid);
    Motion spinning{.start = {}, .rotation_vector = {nan, 0, 0}};
    EXPECT_EQ(cast(Box{}, Motion{}, Box{}, spinning).status, QueryStatus::invalid);
    CastSettings settings{.tolerance = 0.0};
    EXPECT_EQ(cast(Box{}, Motion{}, Box{}, Motion{}, settings).status, QueryStatus::invalid);
}

}  // namespace terrane::shape_pairs_test

namespace terrane::pair_distance_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261121;
const int kCases = case_count(10'000);

class Pairs : public testing::TestWithParam<KindPair> {};

INSTANTIATE_TEST_SUITE_P(All, Pairs, testing::ValuesIn(all_pairs()),
                         [](const auto& each) { return each.param.name(); });

TEST_P(Pairs, DistanceIsThatOfAllPairsOfFeatures) {
    SeededRandom random(kSeed);
    double worst = 0.0;
    int overlapping = 0;
    for (int i = 0; i < kCases; ++i) {
        const Case c = random_case(random, GetParam(), i);
        const PlacedCase placed(c);
        const double expected = oracle_distance(c.a, c.pose_a, c.b, c.pose_b);
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

// Distance of a point from a shape's surface.
double off_surface(const internal::ConvexView& shape, const Pose& pose, const Eigen::Vector3d& p) {
    return std::abs(oracle_distance(Sphere{0.0}, Pose{.translation = p}, shape, pose));
}

TEST_P(Pairs, NearestPointsLieOnBothShapes) {
    SeededRandom random(kSeed + 1);
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const Case c = random_case(random, GetParam(), i);
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
    SeededRandom random(kSeed + 2);
    long touching = 0;
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        Case c = random_case(random, GetParam(), i);
        const PlacedCase placed(c);
        const double margin = i % 2 == 0 ? 0.05 : 0.0;
        std::array<PairContact, 4> contacts;
        const std::size_t count = find_contacts(placed.a, placed.b, placed.gap, margin, contacts);
        if (std::abs(placed.gap.distance - margin) > 1e-9) {
            ASSERT_EQ(count > 0, placed.gap.distance < margin);
        }
        if (count == 0) continue;
        ++touching;
        EXPECT_NEAR(contacts[0].depth, -placed.gap.distance, 1e-9);
        for (std::size_t k = 0; k < count; ++k) {
            const PairContact& contact = contacts[k];
            EXPECT_LE(contact.depth, contacts[k == 0 ? 0 : k - 1].depth);
            EXPECT_GE(contact.depth, -margin - 1e-11);
            EXPECT_EQ(contact.normal, contacts[0].normal);
            const Eigen::Vector3d on_a = c.pose_a.translation + contact.point_world;
            const Eigen::Vector3d on_b = on_a + contact.depth * contact.normal;
            // At the end of a capsule that is not the deepest one, the point is inside the other shape.
            if (k == 0 || GetParam().a != Kind::capsule) {
                EXPECT_LE(off_surface(c.a, c.pose_a, on_a), 1e-8) << k;
                EXPECT_LE(off_surface(c.b, c.pose_b, on_b), 1e-8) << k;
            }
        }
        c.pose_a.translation += contacts[0].depth * contacts[0].normal;
        EXPECT_NEAR(oracle_distance(c.a, c.pose_a, c.b, c.pose_b), 0.0, 1e-9);
    }
    EXPECT_GT(touching, kCases / 20);
}

TEST_P(Pairs, TestSaysWhatFindAndDistanceSay) {
    SeededRandom random(kSeed + 3);
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        Case c = random_case(random, GetParam(), i);
        // Some pairs are moved into touch.
        if (i % 3 == 0) {
            const PlacedCase before(c);
            const double rest = i % 2 == 0 ? 0.0 : random.between(-1e-11, 1e-11);
            c.pose_a.translation -= (before.gap.distance + rest) * before.gap.normal;
        }
        const PlacedCase placed(c);
        if (i % 6 == 0) {
            EXPECT_NEAR(placed.gap.distance, 0.0, 1e-14);
        }
        const double touch =
            internal::kTouchShare * (internal::reach_of(c.a) + internal::reach_of(c.b));
        std::array<PairContact, 4> contacts;
        const bool is_found = find_contacts(placed.a, placed.b, placed.gap, touch, contacts) > 0;
        EXPECT_EQ(is_found, placed.gap.distance <= touch) << placed.gap.distance;
        // Undecided within rounding of the touching distance.
        if (std::abs(placed.gap.distance - touch) > 1e-14) {
            EXPECT_EQ(is_touching(placed.a, placed.b), is_found) << placed.gap.distance;
        }
    }
}

TEST_P(Pairs, PseudodistanceIsWhatItsDefinitionSays) {
    SeededRandom random(kSeed + 5);
    const auto is_round = [](Kind kind) { return kind == Kind::sphere || kind == Kind::capsule; };
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        Case c = random_case(random, GetParam(), i);
        const PlacedCase placed(c);
        const internal::Axis axis = find_pseudodistance(placed.a, placed.b);
        const Solid a = make_solid(c.a, c.pose_a, c.pose_a.translation);
        const Solid b = make_solid(c.b, c.pose_b, c.pose_a.translation);
        const double signed_distance = oracle_distance(c.a, c.pose_a, c.b, c.pose_b);
        const auto radii = static_cast<double>(a.radius + b.radius);
        const double widest = static_cast<double>(widest_gap(a, b));
        if (is_round(GetParam().a) && is_round(GetParam().b)) {
            const double d = signed_distance + radii;
            const double expected = radii == 0.0 ? d : (d * d - radii * radii) / (2.0 * radii);
            EXPECT_NEAR(axis.gap, expected, 1e-9);
        } else if (is_round(GetParam().a)) {
            EXPECT_NEAR(axis.gap, signed_distance, 1e-9);
        } else if (GetParam().a == Kind::box && GetParam().b == Kind::box &&
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

TEST_P(Pairs, DistanceGrowsAsMuchAsTheShapesMoveApart) {
    SeededRandom random(kSeed + 7);
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        Case c = random_case(random, GetParam(), i);
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

TEST_P(Pairs, GiveTheSameAnswerEitherWayRoundAndInAnyFrame) {
    SeededRandom random(kSeed + 6);
    for (int i = 0; i < kCases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const Case c = random_case(random, GetParam(), i);
        const PlacedCase here(c);
        const PlacedCase swapped(Case{c.b, c.a, c.pose_b, c.pose_a});
        EXPECT_NEAR(here.gap.distance, swapped.gap.distance, 1e-13);
        EXPECT_NEAR(find_pseudodistance(here.a, here.b).gap,
                    find_pseudodistance(swapped.a, swapped.b).gap, 1e-13);
        EXPECT_EQ(is_touching(here.a, here.b), is_touching(swapped.a, swapped.b));

        Pose motion{random.rotation(), 10.0 * random.direction()};
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

}  // namespace terrane::pair_distance_test
