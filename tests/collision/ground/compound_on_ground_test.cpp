// SPDX-License-Identifier: MIT
#include "collision/ground/ground_cases.h"

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
                const Pose placed{pose.rotation * part.body_from_part.rotation,
                                  pose * part.body_from_part.translation};
                const Shape shape =
                    std::visit([](const auto& each) { return Shape(each); }, part.shape);
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

}  // namespace terrane::compound_test
