// SPDX-License-Identifier: MIT
#include "collision/ground/ground_cases.h"
#include "ground_checks.h"

#include <gtest/gtest.h>

namespace terrane::compound_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261104;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

ConvexShape random_part(Random& random) {
    switch (static_cast<int>(random.between(0.0, 4.0))) {
        case 0:
            return Sphere{random.between(0.1, 0.5)};
        case 1:
            return Capsule{random.between(0.1, 0.4), random.between(0.1, 0.8)};
        case 2:
            return Box{
                {random.between(0.1, 0.8), random.between(0.1, 0.8), random.between(0.1, 0.8)}};
        default:
            return make_hull(transformed(sphere(random, 12), 0.6, random.rotation()));
    }
}

std::vector<CompoundPart> random_parts(Random& random, int count) {
    std::vector<CompoundPart> parts;
    for (int i = 0; i < count; ++i) {
        Pose pose{random.rotation(), random.between(0.0, 2.0) * random.direction()};
        parts.push_back({random_part(random), pose});
    }
    return parts;
}

Pose world_from_part(const Pose& world_from_body, const CompoundPart& part) {
    Pose pose{world_from_body.rotation * part.body_from_part.rotation,
              world_from_body * part.body_from_part.translation};
    return pose;
}

Shape shape_of(const CompoundPart& part) {
    return std::visit([](const auto& each) { return Shape(each); }, part.shape);
}

TEST(CompoundOnGround, AnswersAreThoseOfItsParts) {
    SeededRandom random(kSeed);
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        for (int i = 0; i < 60; ++i) {
            const std::vector<CompoundPart> parts = random_parts(random, 1 + i % 12);
            const Compound compound = Compound::create(parts).value();
            const Pose pose = random_pose(random, ground, -1.0, 4.0);
            double lift = -kInfinity, distance = kInfinity;
            bool is_touching = false;
            for (const CompoundPart& part : parts) {
                const Pose placed = world_from_part(pose, part);
                const Shape shape = shape_of(part);
                lift = std::max(lift, compute_lift(shape, placed, ground).lift);
                distance =
                    std::min(distance, signed_distance(shape, placed, ground, 20.0).distance);
                is_touching = is_touching || test_contact(shape, placed, ground).is_touching;
            }
            EXPECT_NEAR(compute_lift(compound, pose, ground).lift, lift, 1e-9);
            EXPECT_NEAR(pseudodistance(compound, pose, ground).pseudodistance, -lift, 1e-9);
            EXPECT_EQ(test_contact(compound, pose, ground).is_touching, is_touching);
            const double of_all = signed_distance(compound, pose, ground, 20.0).distance;
            if (lift < 0.0) {
                EXPECT_NEAR(of_all, distance, 1e-9);
            } else {
                // Lifting by the lift of the deepest part separates all parts.
                EXPECT_LE(of_all, 0.0);
                EXPECT_GE(of_all, -lift - 1e-9);
            }
        }
    }
}

TEST(CompoundOnGround, OfOneBoxIsTheBox) {
    SeededRandom random(kSeed + 1);
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        long compared = 0;
        for (int i = 0; i < 40; ++i) {
            const Box box{{0.8, 0.5, 0.3}};
            Pose offset{random.rotation(), 3.0 * random.direction()};
            const std::vector<CompoundPart> parts{{box, offset}};
            const Compound compound = Compound::create(parts).value();
            const Pose pose = random_pose(random, ground, -0.5, 3.0);
            const Pose placed = world_from_part(pose, parts[0]);
            const double of_box_alone = signed_distance(box, placed, ground, 10.0).distance;
            if (of_box_alone < -0.1 * smallest_half_extent(box)) continue;
            ++compared;
            EXPECT_NEAR(signed_distance(compound, pose, ground, 10.0).distance, of_box_alone, 1e-9);
            std::array<Contact, 64> a;
            std::array<Contact, 64> b;
            const ContactAnswer of_compound = find_contacts(compound, pose, ground, 0.01, a);
            const ContactAnswer of_box = find_contacts(box, placed, ground, 0.01, b);
            ASSERT_EQ(of_compound.count, of_box.count);
            for (std::size_t k = 0; k < of_box.count; ++k) {
                EXPECT_NEAR(a[k].depth, b[k].depth, 1e-9);
            }
        }
        EXPECT_GT(compared, 2);
    }
}

TEST(CompoundOnGround, OfABoxInPiecesIsTheBox) {
    SeededRandom random(kSeed + 4);
    const Box box{{1.2, 0.8, 0.4}};
    std::vector<CompoundPart> parts;
    for (const Eigen::Vector3d& corner : box_corners(0.5 * box.half_extents)) {
        const Box piece{0.5 * box.half_extents};
        Pose pose{.translation = corner};
        if (parts.size() % 2 == 0) {
            parts.push_back({piece, pose});
        } else {
            parts.push_back({make_hull(box_corners(piece.half_extents)), pose});
        }
    }
    const Compound compound = Compound::create(parts).value();
    int count = 0;
    int different_count = 0;
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        for (int i = 0; i < 40; ++i) {
            Pose pose = random_pose(random, ground, 0.0, 2.0);
            // Half of them overlap slightly.
            if (i % 2 == 0) pose.translation.z() += compute_lift(box, pose, ground).lift - 0.005;
            EXPECT_NEAR(compute_lift(compound, pose, ground).lift,
                        compute_lift(box, pose, ground).lift, 1e-9);
            const double of_box = signed_distance(box, pose, ground, 10.0).distance;
            if (of_box < -0.005) continue;
            ++count;
            const double of_all = signed_distance(compound, pose, ground, 10.0).distance;
            if (std::abs(of_all - of_box) > 1e-9) ++different_count;
        }
    }
    EXPECT_GT(count, 150);
    EXPECT_EQ(different_count, 0);
}

TEST(CompoundOnGround, ContactsSeparateItAndNameTheirParts) {
    SeededRandom random(kSeed + 2);
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        long overlapping = 0;
        for (int i = 0; i < 100; ++i) {
            const std::vector<CompoundPart> parts = random_parts(random, 1 + i % 12);
            const Compound compound = Compound::create(parts).value();
            Pose pose = random_pose(random, ground, -1.0, 2.0);
            if (i % 2 == 0) {
                pose.translation.z() += compute_lift(compound, pose, ground).lift - 0.02;
            }
            expect_separated_by_contacts(compound, pose, ground, overlapping);
            std::array<Contact, 256> contacts;
            const ContactAnswer answer = find_contacts(compound, pose, ground, 0.0, contacts);
            if (answer.lift <= 0.0) continue;
            expect_separated_by_distance(compound, pose, ground);
            for (std::size_t k = 0; k < answer.count; ++k) {
                ASSERT_LT(contacts[k].part, parts.size());
                // The point lies on the part that the contact names.
                const CompoundPart& part = parts[contacts[k].part];
                const Pose placed = world_from_part(pose, part);
                const Eigen::Vector3d in_part =
                    placed.rotation.transpose() * (contacts[k].point_world - placed.translation);
                EXPECT_LE(in_part.norm(), bounding_radius(shape_of(part)) + 1e-9);
            }
        }
        EXPECT_GT(overlapping, 5);
    }
}

TEST(CompoundOnGround, StandsOnItsFourLegs) {
    const Ground ground = make_test_ground([](double, double) { return 1.0; }, 1.0, 1);
    std::vector<CompoundPart> parts{{Box{{1.0, 1.0, 0.1}}, pose_at(0.0, 0.0, 1.0)}};
    for (const double x : {-0.9, 0.9}) {
        for (const double y : {-0.9, 0.9}) {
            parts.push_back({Box{{0.1, 0.1, 0.5}}, pose_at(x, y, 0.5)});
        }
    }
    std::array<Contact, 16> contacts;
    const ContactAnswer answer = find_contacts(Compound::create(parts).value(),
                                               pose_at(64.3, 64.4, 0.99), ground, 0.0, contacts);
    ASSERT_EQ(answer.count, 4u);
    std::array<int, 5> of_part{};
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_NEAR(contacts[i].depth, 0.01, 1e-12);
        EXPECT_NEAR(std::abs(contacts[i].point_world.x() - 64.3), 1.0, 1e-12);
        EXPECT_NEAR(std::abs(contacts[i].point_world.y() - 64.4), 1.0, 1e-12);
        ++of_part[contacts[i].part];
    }
    EXPECT_EQ(of_part, (std::array<int, 5>{0, 1, 1, 1, 1}));
}

TEST(CompoundOnGround, CastIsThatOfTheEarliestOfItsParts) {
    SeededRandom random(kSeed + 3);
    const double tolerance = CastSettings{}.tolerance;
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        for (int i = 0; i < 30; ++i) {
            const std::vector<CompoundPart> parts = random_parts(random, 1 + i % 6);
            const Compound compound = Compound::create(parts).value();
            Motion motion{.start = random_pose(random, ground, 4.0, 8.0),
                          .translation = 30.0 * random.direction()};
            const CastAnswer answer = cast(compound, motion, ground);
            double earliest = 1.0;
            for (const CompoundPart& part : parts) {
                Motion of_part = motion;
                of_part.start = world_from_part(motion.start, part);
                earliest = std::min(earliest, cast(shape_of(part), of_part, ground).fraction);
            }
            // Both casts stop within the tolerance, even in grazing motion.
            const double first = std::min(earliest, answer.fraction);
            const double gap = signed_distance(compound, motion.at(first), ground, 1.0).distance;
            if (answer.hit) {
                EXPECT_LE(gap, tolerance);
            } else {
                EXPECT_EQ(earliest, 1.0);
            }
        }
    }
}

// A rough sheet of 2 n^2 triangles above the body's origin, with one vertex below the origin.
Compound make_sheet(int n) {
    std::vector<Eigen::Vector3d> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    const double step = 20.0 / n;
    for (int j = 0; j <= n; ++j) {
        for (int i = 0; i <= n; ++i) {
            const bool is_tip = i == n / 3 && j == n / 2;
            vertices.emplace_back(-10.0 + step * i, -10.0 + step * j,
                                  is_tip ? -1.0 : 1.0 + hash_height(i, j));
        }
    }
    const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (n + 1) + i); };
    for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
            triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    }
    return Compound::from_triangles(vertices, triangles).value();
}

TEST(CompoundOnGround, OfAMeshRestsOnItsLowestVertex) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    const Compound sheet = make_sheet(20);
    Motion turn{.start = {}, .rotation_vector = {0.0, 0.0, 0.7}};
    Pose pose = turn.at(1.0);
    pose.translation = {64.3, 64.4, 0.99};
    const Eigen::Vector3d tip = pose * Eigen::Vector3d(-4.0, 0.0, -1.0);
    std::array<Contact, 16> contacts;
    EXPECT_NEAR(compute_lift(sheet, pose, ground).lift, 0.01, 1e-12);
    EXPECT_NEAR(signed_distance(sheet, pose, ground, 1.0).distance, -0.01, 1e-12);
    const ContactAnswer answer = find_contacts(sheet, pose, ground, 0.0, contacts);
    ASSERT_EQ(answer.count, 1u);
    EXPECT_NEAR((contacts[0].point_world - tip).norm(), 0.0, 1e-12);
    pose.translation.z() += 0.51;
    EXPECT_NEAR(signed_distance(sheet, pose, ground, 1.0).distance, 0.5, 1e-12);
    EXPECT_FALSE(test_contact(sheet, pose, ground).is_touching);
    Motion fall{.start = pose, .translation = {0.0, 0.0, -1.0}};
    const CastAnswer hit = cast(sheet, fall, ground);
    EXPECT_TRUE(hit.hit);
    EXPECT_NEAR(hit.fraction, 0.5, 1e-4);
}

TEST(CompoundOnGround, OfAHundredThousandTrianglesTestsThoseNearTheGround) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    const Compound sheet = make_sheet(220);
    ASSERT_GT(sheet.parts().size(), 96'000u);
    const Pose pose = pose_at(64.3, 64.4, 0.99);
    // 4000 queries take less than a second in total; without the tree each would test 10^5 parts in 0.1 s.
    std::array<Contact, 16> contacts;
    for (int i = 0; i < 1000; ++i) {
        EXPECT_NEAR(compute_lift(sheet, pose, ground).lift, 0.01, 1e-12);
        EXPECT_TRUE(test_contact(sheet, pose, ground).is_touching);
        EXPECT_NEAR(signed_distance(sheet, pose, ground, 1.0).distance, -0.01, 1e-12);
        EXPECT_EQ(find_contacts(sheet, pose, ground, 0.0, contacts).count, 1u);
    }
}

TEST(CompoundOnGround, ReportsNotResidentWhereAChunkIsMissing) {
    TableGroundSettings settings{.roots = 2,
                                 .is_resident = [](int column, int) { return column == 0; }};
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, settings);
    const std::vector<CompoundPart> parts{{Sphere{0.5}, pose_at(-4.0, 0.0, 0.0)},
                                          {Sphere{0.5}, pose_at(4.0, 0.0, 0.0)}};
    const Compound compound = Compound::create(parts).value();
    std::array<Contact, 4> contacts;
    const auto status_at = [&](double x) {
        return find_contacts(compound, pose_at(x, 64.0, 0.4), ground, 0.0, contacts).status;
    };
    EXPECT_EQ(status_at(64.0), QueryStatus::ok);
    EXPECT_EQ(status_at(126.0), QueryStatus::not_resident);
    EXPECT_EQ(compute_lift(compound, pose_at(200.0, 64.0, 0.4), ground).status,
              QueryStatus::not_resident);
}

}  // namespace terrane::compound_test
