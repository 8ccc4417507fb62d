// SPDX-License-Identifier: MIT
#include "compound_cases.h"
#include "pairs/convex_core.h"
#include "support/allocation_counter.h"

#include <gtest/gtest.h>

#include <bit>

namespace terrane::compound_pairs_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261210;

// A compound against each kind of shape.
class CompoundPairs : public testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(All, CompoundPairs, testing::Range(0, 6), [](const auto& each) {
    return std::string("compound_") + kOtherNames[static_cast<std::size_t>(each.param)];
});

TEST_P(CompoundPairs, ApartAreAsFarAsTheirNearestParts) {
    SeededRandom random(kSeed);
    const int cases = case_count(10'000);
    int apart = 0;
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const CompoundCase c = random_compound_case(random, GetParam(), i);
        const double least = least_distance(c.a, c.pose_a, c.b, c.pose_b);
        if (i % 50 == 0) {
            EXPECT_NEAR(least, oracle_least(c.a, c.pose_a, c.b, c.pose_b), 1e-9);
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
        const Piece p = pieces_of(c.a, c.pose_a)[answer.part_a];
        const Piece q = pieces_of(c.b, c.pose_b)[answer.part_b];
        EXPECT_NEAR(signed_distance(as_shape(p.shape), p.world_from_piece, as_shape(q.shape),
                                    q.world_from_piece)
                        .distance,
                    least, 1e-12);
    }
    EXPECT_GT(apart, cases / 5);
    EXPECT_LT(apart, 9 * cases / 10);
}

TEST_P(CompoundPairs, OverlappingArePartedByTheirDistanceAndHardlyByLess) {
    SeededRandom random(kSeed + 1);
    const int cases = case_count(1'000);
    double worst = 1.0;
    int overlapping = 0, longer = 0;  // longer: above 1.25 times the shortest sampled translation
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        CompoundCase c = random_compound_case(random, GetParam(), i);
        const double least = least_distance(c.a, c.pose_a, c.b, c.pose_b);
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
        EXPECT_GE(least_distance(c.a, c.pose_a, c.b, c.pose_b), -1e-11);
        for (int k = 0; k < 40; ++k) {
            // No sampled direction gives a much shorter separating translation.
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
    EXPECT_GT(overlapping, cases / 20);
    EXPECT_EQ(longer, 0) << "of " << overlapping << ", the worst " << 1.0 / worst
                         << " times as long";
}

TEST_P(CompoundPairs, ContactsAgreeWithTestAndFree) {
    SeededRandom random(kSeed + 2);
    const int cases = case_count(10'000);
    std::array<PairContact, 96> contacts;
    int separated = 0, overlapping = 0, rounds = 0, truncated = 0;
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        CompoundCase c = random_compound_case(random, GetParam(), i);
        const double least = least_distance(c.a, c.pose_a, c.b, c.pose_b);
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
            // The point lies on the part of a that the contact names.
            const Piece p = pieces_of(c.a, c.pose_a)[contacts[k].part_a];
            Pose at_point{.translation = contacts[k].point_world};
            EXPECT_LE(signed_distance(Sphere{0.0}, at_point, as_shape(p.shape), p.world_from_piece)
                          .distance,
                      1e-9);
        }
        if (least > -1e-9) continue;
        ++overlapping;
        // The shortest translation that resolves every contact along its normal separates the shapes.
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
            is_free = least_distance(c.a, c.pose_a, c.b, c.pose_b) > -1e-9;
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
    SeededRandom random(kSeed + 3);
    const int cases = case_count(10'000);
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const CompoundCase c = random_compound_case(random, GetParam(), i);
        const double least = least_distance(c.a, c.pose_a, c.b, c.pose_b);
        const PseudodistanceAnswer answer = pseudodistance(c.a, c.pose_a, c.b, c.pose_b);
        double of_parts = std::numeric_limits<double>::infinity();
        for (const Piece& p : pieces_of(c.a, c.pose_a)) {
            for (const Piece& q : pieces_of(c.b, c.pose_b)) {
                of_parts = std::min(of_parts, pseudodistance(as_shape(p.shape), p.world_from_piece,
                                                             as_shape(q.shape), q.world_from_piece)
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
    SeededRandom random(kSeed + 4);
    const int cases = case_count(2'000);
    int overlapping = 0, alike = 0, apart = 0;
    for (int i = 0; i < cases && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const CompoundCase c = random_compound_case(random, GetParam(), i);
        Pose frame{random.rotation(), 10.0 * random.direction()};
        const Pose there_a = composed(frame, c.pose_a), there_b = composed(frame, c.pose_b);
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

}  // namespace terrane::compound_pairs_test

namespace terrane::compound_facts_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261212;

Pose at(const Eigen::Vector3d& translation) { return Pose{.translation = translation}; }

CompoundPart box_part(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    CompoundPart part{Box{0.5 * (high - low)}, {.translation = 0.5 * (low + high)}};
    return part;
}

Compound make_compound(const std::vector<CompoundPart>& parts) {
    return Compound::create(parts).value();
}

// Two arms of 3 m by 1 m along +x and +z.
Compound angle() {
    return make_compound({box_part({0, 0, 0}, {3, 1, 1}), box_part({0, 0, 0}, {1, 1, 3})});
}

TEST(CompoundFacts, AnglesInEachOtherAreFreedIntoTheCorner) {
    const Compound both = angle();
    for (const double x : {0.9, 0.95, 0.7}) {
        for (const double z : {0.9, 0.6, 0.99}) {
            const PairDistanceAnswer answer = signed_distance(both, at({x, 0, z}), both, Pose{});
            // Single pairs have minimum translations of 1 - x and 1 - z; the union must satisfy both.
            const double expected = std::sqrt((1 - x) * (1 - x) + (1 - z) * (1 - z));
            EXPECT_NEAR(-answer.distance, expected, 1e-12) << x << " " << z;
            EXPECT_NEAR(answer.normal.x(), (1 - x) / expected, 1e-9);
            EXPECT_NEAR(answer.normal.y(), 0.0, 1e-9);
        }
    }
    // Touching in the corner.
    EXPECT_EQ(signed_distance(both, at({1, 0, 1}), both, Pose{}).distance, 0.0);
    EXPECT_TRUE(test_contact(both, at({1, 0, 1}), both, Pose{}).is_touching);
    EXPECT_FALSE(test_contact(both, at({1.001, 0, 1.001}), both, Pose{}).is_touching);
    EXPECT_NEAR(signed_distance(both, at({1.5, 0, 1.25}), both, Pose{}).distance, 0.25, 1e-15);
    // Touching at the bottom: the minimum translation is horizontal.
    EXPECT_NEAR(signed_distance(both, at({0, 0.25, 0}), both, Pose{}).distance, -0.75, 1e-12);
}

TEST(CompoundFacts, APegInASlotLeavesItAlong) {
    // Walls 4 m high and 1 m apart on a floor; a peg as wide as the slot reaches 0.3 m into the floor.
    const Compound slot =
        make_compound({box_part({-3, -2, -1}, {3, 2, 0}), box_part({-3, -2, 0}, {-0.5, 2, 4}),
                       box_part({0.5, -2, 0}, {3, 2, 4})});
    const Box peg{{0.5, 0.5, 2.0}};
    for (const double depth : {0.01, 0.3, 0.9}) {
        const PairDistanceAnswer answer =
            signed_distance(peg, at({0, 0, 2.0 - depth}), slot, Pose{});
        EXPECT_NEAR(answer.distance, -depth, 1e-12);
        EXPECT_NEAR(answer.normal.z(), 1.0, 1e-12);
    }
    // 0.2 m wider than the slot on each side: the shortest ways out are the open ends (2.5 m) and the top (4 m).
    const Box wide{{0.7, 0.5, 2.0}};
    EXPECT_NEAR(signed_distance(wide, at({0, 0, 2.0}), slot, Pose{}).distance, -2.5, 1e-9);
    EXPECT_NEAR(signed_distance(wide, at({0, 0, 5.0}), slot, Pose{}).distance, -1.0, 1e-9);
}

TEST(CompoundFacts, FloorsOfTilesPushOnlyUp) {
    SeededRandom random(kSeed);
    const Compound floor = tiled_box({5, 5, 0.5}, {20, 20, 1});
    std::array<PairContact, 96> contacts;
    for (int i = 0; i < 500; ++i) {
        Pose pose = at({random.between(-3, 3), random.between(-3, 3), 0.0});
        const double depth = random.between(0.0, 0.05);
        pose.translation.z() = 0.5 + 0.4 - depth;
        if (i % 2 == 1) {
            Motion turn{.start = {}, .rotation_vector = {0, 0, random.between(0.0, 3.0)}};
            pose.rotation = turn.at(1.0).rotation;
        }
        const PairContactAnswer found =
            find_contacts(Box{{0.8, 0.6, 0.4}}, pose, floor, Pose{}, 0.0, contacts);
        ASSERT_EQ(found.count, 4u) << "case " << i;
        for (std::size_t k = 0; k < found.count; ++k) {
            EXPECT_NEAR(contacts[k].normal.z(), 1.0, 1e-12) << "case " << i;
            EXPECT_NEAR(contacts[k].depth, depth, 1e-12) << "case " << i;
        }
    }
}

TEST(CompoundFacts, OnePartIsThePart) {
    SeededRandom random(kSeed + 1);
    long touching = 0, hits = 0, rays = 0;
    for (int i = 0; i < 2000; ++i) {
        const ConvexShape part = random_convex(random, i % 4);
        const Shape alone = as_shape(part);
        const Shape other = as_shape(random_convex(random, (i / 4) % 4));
        Pose pose, place;
        pose.rotation = random.rotation();
        place.rotation = random.rotation();
        place.translation = random.between(0.0, 1.5) * random.direction();
        const Shape whole = make_compound({CompoundPart{part, {}}});
        const PairDistanceAnswer expected = signed_distance(alone, pose, other, place);
        const PairDistanceAnswer answer = signed_distance(whole, pose, other, place);
        EXPECT_EQ(std::bit_cast<std::uint64_t>(answer.distance),
                  std::bit_cast<std::uint64_t>(expected.distance));
        EXPECT_EQ(answer.point_a_world, expected.point_a_world);
        EXPECT_EQ(pseudodistance(whole, pose, other, place).pseudodistance,
                  pseudodistance(alone, pose, other, place).pseudodistance);
        EXPECT_EQ(test_contact(whole, pose, other, place).is_touching,
                  test_contact(alone, pose, other, place).is_touching);
        std::array<PairContact, 4> contacts, of_part;
        const std::size_t count = find_contacts(whole, pose, other, place, 0.1, contacts).count;
        ASSERT_EQ(count, find_contacts(alone, pose, other, place, 0.1, of_part).count);
        touching += count > 0;
        for (std::size_t k = 0; k < count; ++k) {
            EXPECT_EQ(contacts[k].point_world, of_part[k].point_world);
        }
        Motion thrown, still;
        thrown.start = pose;
        thrown.translation = 2.0 * random.direction();
        thrown.rotation_vector = random.direction();
        still.start = place;
        const PairCastAnswer met = cast(alone, thrown, other, still);
        hits += met.hit;
        EXPECT_NEAR(cast(whole, thrown, other, still).fraction, met.fraction, 1e-12);
        const Eigen::Vector3d from = 3.0 * random.direction();
        const ShapeRayAnswer ray = cast_ray(alone, pose, from, -from);
        rays += ray.hit;
        EXPECT_EQ(cast_ray(whole, pose, from, -from).fraction, ray.fraction);
    }
    EXPECT_GT(touching, 100);
    EXPECT_GT(hits, 40);
    EXPECT_GT(rays, 0);
}

TEST(CompoundFacts, TilesAreTheBoxTheyFill) {
    SeededRandom random(kSeed + 2);
    const Eigen::Vector3d half(0.9, 0.6, 0.4);
    const Box box{half};
    const Compound tiles = tiled_box(half, {3, 2, 2});
    CastSettings settings{.tolerance = 1e-9};
    int overlapping = 0, same_depth = 0;
    for (int i = 0; i < 4000 && !HasFailure(); ++i) {
        SCOPED_TRACE(testing::Message() << "case " << i);
        const Shape other = others_of(i % 4)[static_cast<std::size_t>(i / 4 % 200)];
        Pose pose, place;
        pose.rotation = random.rotation();
        if (i % 3 > 0) place.rotation = random.rotation();
        place.translation = random.between(0.3, 2.0) * random.direction();
        const PairDistanceAnswer expected = signed_distance(box, pose, other, place);
        const PairDistanceAnswer answer = signed_distance(tiles, pose, other, place);
        if (std::abs(expected.distance) > 1e-9) {
            EXPECT_EQ(test_contact(tiles, pose, other, place).is_touching,
                      test_contact(box, pose, other, place).is_touching);
            EXPECT_EQ(pseudodistance(tiles, pose, other, place).pseudodistance > 0.0,
                      expected.distance > 0.0);
        }
        if (expected.distance > 0.0) {
            EXPECT_NEAR(answer.distance, expected.distance, 1e-9);
        } else if (smallest_half_extent(other) > 0.0) {
            // A shape without thickness may end in a seam without touching either side.
            ++overlapping;
            EXPECT_LE(answer.distance, expected.distance + 1e-9);
            EXPECT_GE(answer.distance, 1.25 * expected.distance - 1e-9);
            same_depth += std::abs(answer.distance - expected.distance) < 1e-9;
        }
        Motion thrown, still;
        thrown.start = pose;
        thrown.start.translation = place.translation + 4.0 * random.direction();
        thrown.translation = 1.5 * (place.translation - thrown.start.translation);
        if (i % 2 == 0) thrown.rotation_vector = 2.0 * random.direction();
        still.start = place;
        const PairCastAnswer met = cast(box, thrown, other, still, settings);
        const PairCastAnswer met_tiles = cast(tiles, thrown, other, still, settings);
        // A grazing ray may hit or miss.
        if (met.hit == met_tiles.hit) {
            EXPECT_NEAR(met.fraction * 6.0, met_tiles.fraction * 6.0, 1e-6);
        } else {
            const Motion& m = thrown;
            const double t = met.hit ? met.fraction : met_tiles.fraction;
            EXPECT_NEAR(signed_distance(box, m.at(t), other, place).distance, 0.0, 1e-9);
        }
        const Eigen::Vector3d from = 3.0 * random.direction();
        const Eigen::Vector3d to = random.direction();
        const ShapeRayAnswer ray = cast_ray(box, pose, from, to);
        const ShapeRayAnswer ray_tiles = cast_ray(tiles, pose, from, to);
        EXPECT_EQ(ray.hit, ray_tiles.hit);
        EXPECT_NEAR(ray.fraction, ray_tiles.fraction, 1e-9);
    }
    EXPECT_GT(overlapping, 1000);
    EXPECT_GT(same_depth, overlapping * 95 / 100);
}

TEST(CompoundFacts, PartsWithoutThicknessAreAnswered) {
    CompoundPart point{ConvexHull::create(std::vector<Eigen::Vector3d>{{0, 0, 0}}).value(), {}};
    CompoundPart plate = box_part({-1, -1, 0}, {1, 1, 0});
    CompoundPart spot{Sphere{0.0}, {.translation = {0, 0, 3}}};
    const Compound odd = make_compound({point, plate, spot});
    std::array<PairContact, 4> contacts;
    EXPECT_EQ(signed_distance(odd, Pose{}, Sphere{0.5}, at({0, 0, 2})).distance, 0.5);
    EXPECT_EQ(signed_distance(Sphere{0.5}, at({0, 0, 3.75}), odd, Pose{}).distance, 0.25);
    EXPECT_TRUE(test_contact(odd, Pose{}, odd, Pose{}).is_touching);
    EXPECT_LE(signed_distance(odd, Pose{}, odd, Pose{}).distance, 0.0);
    EXPECT_GT(find_contacts(odd, Pose{}, odd, Pose{}, 0.0, contacts).count, 0u);
    EXPECT_EQ(find_contacts(odd, Pose{}, Box{}, Pose{}, 0.0, {}).status, QueryStatus::truncated);
    Motion falling{.start = at({0, 0, 10}), .translation = {0, 0, -20}};
    const PairCastAnswer met = cast(Sphere{0.5}, falling, odd, Motion{});
    EXPECT_TRUE(met.hit);
    EXPECT_NEAR(met.fraction, 6.5 / 20.0, 1e-5);
    EXPECT_EQ(met.contacts[0].part_b, 2u);
    EXPECT_TRUE(cast_ray(odd, Pose{}, {0.5, 0.5, 1}, {0.5, 0.5, -1}).hit);
}

/// Pair i of two shapes of any kind; both are convex in every third.
CompoundCase any_case(Random& random, int i) {
    CompoundCase c = random_compound_case(random, i % 6, i);
    if (i % 3 > 0) return c;
    c.a = others_of(i / 3 % 4)[static_cast<std::size_t>(i % 200)];
    c.b = others_of(i / 12 % 4)[static_cast<std::size_t>(i % 200)];
    return c;
}

TEST(AnyPair, HasTheSameBitsTenThousandKilometresOut) {
    SeededRandom random(kSeed + 3);
    const Eigen::Vector3d shift(1e7, -1e7, 4096.0);
    for (int i = 0; i < 600; ++i) {
        CompoundCase c = any_case(random, i);
        for (Pose* pose : {&c.pose_a, &c.pose_b}) {
            for (double& x : pose->translation) x = std::floor(x * 0x1p20) * 0x1p-20;
        }
        const auto bits_at = [&](const Eigen::Vector3d& offset) {
            const Motion a{.start = moved(c.pose_a, offset),
                           .translation = {1.0, 2.0, -1.0},
                           .rotation_vector = {0.5, -0.25, 0.125}};
            const Motion b{.start = moved(c.pose_b, offset)};
            std::array<PairContact, 8> contacts;
            const PairContactAnswer found =
                find_contacts(c.a, a.start, c.b, b.start, 0.5, contacts);
            return std::array{signed_distance(c.a, a.start, c.b, b.start).distance,
                              pseudodistance(c.a, a.start, c.b, b.start).pseudodistance,
                              cast(c.a, a, c.b, b).fraction, static_cast<double>(found.count),
                              found.count > 0 ? contacts[0].depth : 0.0};
        };
        const auto here = bits_at(Eigen::Vector3d::Zero()), there = bits_at(shift);
        for (std::size_t k = 0; k < here.size(); ++k) {
            EXPECT_EQ(std::bit_cast<std::uint64_t>(here[k]), std::bit_cast<std::uint64_t>(there[k]))
                << "case " << i << ", answer " << k;
        }
    }
}

// A bumpy sphere of some triangles.
Compound ball_of_triangles(std::uint32_t rings, std::uint32_t columns) {
    std::vector<Eigen::Vector3d> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (std::uint32_t i = 0; i <= rings; ++i) {
        for (std::uint32_t j = 0; j < columns; ++j) {
            const double polar = 3.14159265358979 * i / rings;
            const double round = 2.0 * 3.14159265358979 * j / columns;
            const double r = 1.0 + 0.05 * std::cos(9.0 * polar) * std::cos(11.0 * round);
            vertices.emplace_back(r * std::sin(polar) * std::cos(round),
                                  r * std::sin(polar) * std::sin(round), r * std::cos(polar));
        }
    }
    for (std::uint32_t i = 0; i < rings; ++i) {
        for (std::uint32_t j = 0; j < columns; ++j) {
            const std::uint32_t a = i * columns + j, b = i * columns + (j + 1) % columns;
            triangles.push_back({a, b, b + columns});
            triangles.push_back({a, b + columns, a + columns});
        }
    }
    return Compound::from_triangles(vertices, triangles).value();
}

TEST(CompoundFacts, AHundredThousandTrianglesAnswerLikeASoup) {
    SeededRandom random(kSeed + 4);
    const Compound mesh = ball_of_triangles(200, 250);
    ASSERT_EQ(mesh.parts().size(), 100'000u);
    const Shape shape = mesh;
    std::array<PairContact, 96> contacts;
    for (int i = 0; i < 3; ++i) {
        Pose pose{random.rotation(), random.between(1.0, 1.4) * random.direction()};
        const Shape other = i % 2 == 0 ? Shape(Sphere{0.2}) : Shape(Box{{0.2, 0.1, 0.15}});
        const double least = least_distance(other, pose, shape, Pose{});
        const AllocationCounter counter;
        const PairDistanceAnswer answer = signed_distance(other, pose, shape, Pose{});
        const bool is_touching = test_contact(other, pose, shape, Pose{}).is_touching;
        const PairContactAnswer found = find_contacts(other, pose, shape, Pose{}, 0.0, contacts);
        const double pseudo = pseudodistance(other, pose, shape, Pose{}).pseudodistance;
        Motion moving{.start = pose};
        moving.start.translation *= 3.0;
        moving.translation = -2.0 * moving.start.translation;
        moving.rotation_vector = {1.0, 0.0, 0.0};
        const PairCastAnswer met = cast(other, moving, shape, Motion{});
        const ShapeRayAnswer ray =
            cast_ray(shape, Pose{}, 3.0 * pose.translation, -pose.translation);
        EXPECT_EQ(counter.count(), 0u);
        if (least > 0.0) {
            EXPECT_NEAR(answer.distance, least, 1e-12);
        } else {
            EXPECT_LE(answer.distance, least + 1e-12);
            Pose separated = pose;
            separated.translation -= answer.distance * answer.normal;
            EXPECT_GE(least_distance(other, separated, shape, Pose{}), -1e-11);
        }
        EXPECT_EQ(is_touching, least < 0.0);
        EXPECT_EQ(found.count > 0, least < 0.0);
        EXPECT_EQ(pseudo > 0.0, least > 0.0);
        ASSERT_TRUE(met.hit);
        const double there = least_distance(other, moving.at(met.fraction), shape, Pose{});
        EXPECT_GE(there, 0.0);
        EXPECT_LE(there, 1e-4);
        ASSERT_TRUE(ray.hit);
        EXPECT_NEAR(ray.point_world.norm(), 1.0, 0.06);
    }
}

TEST(AnyPair, AllocatesNothing) {
    SeededRandom random(kSeed + 5);
    std::vector<CompoundCase> cases;
    for (int i = 0; i < 300; ++i) cases.push_back(any_case(random, i));
    std::array<PairContact, 16> contacts;
    const AllocationCounter counter;
    double sum = 0.0;
    for (const CompoundCase& c : cases) {
        const Motion a{.start = c.pose_a, .translation = {1.0, -2.0, 0.5}};
        const Motion b{.start = c.pose_b, .rotation_vector = {0.0, 1.0, 0.3}};
        sum += test_contact(c.a, c.pose_a, c.b, c.pose_b).is_touching ? 1.0 : 0.0;
        sum +=
            static_cast<double>(find_contacts(c.a, c.pose_a, c.b, c.pose_b, 0.1, contacts).count);
        sum += signed_distance(c.a, c.pose_a, c.b, c.pose_b).distance;
        sum += pseudodistance(c.a, c.pose_a, c.b, c.pose_b).pseudodistance;
        sum += cast(c.a, a, c.b, b).fraction;
        sum += cast_ray(c.a, c.pose_a, c.pose_b.translation, c.pose_a.translation).fraction;
    }
    EXPECT_EQ(counter.count(), 0u);
    EXPECT_NE(sum, 0.0);
}

}  // namespace terrane::compound_facts_test
