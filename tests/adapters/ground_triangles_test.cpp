// SPDX-License-Identifier: MIT
#include "adapters/adapter_grounds.h"
#include "support/random.h"

#include <terrane/adapters/ground_triangles.h>
#include <terrane/adapters/sphere_contacts.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>
#include <vector>

namespace terrane::adapters {
namespace ground_triangles_test {

using test::Random;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
using Name = std::tuple<TrianglePart, std::int64_t, std::int64_t, std::uint32_t>;
using Corners = std::array<Eigen::Vector3d, 3>;

Name name_of(const GroundTriangle& t) { return {t.part, t.column, t.row, t.solid_index}; }

std::map<Name, Corners> visit(const Ground& ground, const Aabb& box,
                              TriangleReport* report_out = nullptr,
                              const WorldPos& origin = WorldPos::Zero()) {
    std::map<Name, Corners> found;
    const TriangleReport report =
        visit_triangles(ground, box, origin, kMostVisitedCells, [&](const GroundTriangle& t) {
            EXPECT_TRUE(found.emplace(name_of(t), t.corners).second) << "visited twice";
        });
    EXPECT_EQ(report.triangles, found.size());
    if (report_out) *report_out = report;
    return found;
}

// All triangles, by Ground::cell().
std::map<Name, Corners> all_triangles(const Ground& ground) {
    std::map<Name, Corners> all;
    for (std::int64_t row = -1; row <= 256; ++row) {
        for (std::int64_t column = -1; column <= 256; ++column) {
            const GroundCell c = ground.cell(column, row);
            if (c.status != QueryStatus::ok) continue;
            const auto at = [&](int i, int j, std::int32_t q) {
                return Eigen::Vector3d(ground.cell_x(column + i), ground.cell_y(row + j),
                                       ground.lattice().quantum * q);
            };
            const Eigen::Vector3d sw = at(0, 0, c.south_west), se = at(1, 0, c.south_east),
                                  nw = at(0, 1, c.north_west), ne = at(1, 1, c.north_east);
            all[{TrianglePart::south, column, row, 0}] = {sw, se, c.cut_to_north_east ? ne : nw};
            all[{TrianglePart::north, column, row, 0}] = {c.cut_to_north_east ? sw : se, ne, nw};
        }
    }
    return all;
}

// Whether a point of a fine sampling of the triangle lies in the box.
bool has_point_in(const Corners& t, const Aabb& box) {
    constexpr int kSteps = 6;
    for (int i = 0; i <= kSteps; ++i) {
        for (int j = 0; i + j <= kSteps; ++j) {
            const Eigen::Vector3d p =
                t[0] + (t[1] - t[0]) * i / kSteps + (t[2] - t[0]) * j / kSteps;
            if ((p.array() >= box.low.array()).all() && (p.array() <= box.high.array()).all())
                return true;
        }
    }
    return false;
}

TEST(GroundTriangles, VisitsEachTriangleWithAPointInTheBoxOnce) {
    const Ground ground = test::hilly_ground();
    const auto all = all_triangles(ground);
    ASSERT_EQ(all.size(), 2u * 256u * 256u);
    int in_box = 0;
    Random random(3);
    for (int i = 0; i < 30; ++i) {
        const WorldPos centre(random.between(-5.0, 260.0), random.between(-5.0, 260.0),
                              random.between(-4.0, 4.0));
        const Eigen::Vector3d half(random.between(0.0, 25.0), random.between(0.0, 25.0),
                                   random.between(0.0, 3.0));
        const Aabb box{centre - half, centre + half};
        const auto found = visit(ground, box);
        for (const auto& [name, corners] : all) {
            // cells far from the box have no point in it
            if (corners[0].x() < box.low.x() - 2.0 || corners[0].x() > box.high.x() + 2.0) continue;
            if (has_point_in(corners, box)) {
                ++in_box;
                EXPECT_TRUE(found.contains(name));
            }
        }
        for (const auto& [name, corners] : found) {
            ASSERT_TRUE(all.contains(name));
            for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(corners[k], all.at(name)[k]);
        }
    }
    EXPECT_GT(in_box, 1000);
}

TEST(GroundTriangles, SubtractsAFarOriginInDouble) {
    const Ground ground = test::make_test_ground([](double, double) { return 2.0; },
                                                 {.origin_x = 1e7, .origin_y = -3e6});
    const WorldPos origin(1e7 + 60.0, -3e6 + 60.0, 2.0);
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.75);
    const auto found = visit(ground, {origin - half, origin + half}, nullptr, origin);
    EXPECT_EQ(found.size(), 8u);
    for (const auto& [name, corners] : found) {
        for (const Eigen::Vector3d& c : corners) {
            EXPECT_LE(c.cwiseAbs().maxCoeff(), 1.0);
            EXPECT_EQ(c.z(), 0.0);
        }
    }
}

TEST(GroundTriangles, SkipsTrianglesWhosePlaneIsBelowTheBox) {
    const Ground ground = test::make_test_ground([](double x, double) { return x; }, 1.0, 1);
    // the slope is 1: the box's corner nearest to it is 0.4 m above
    const Aabb above{{50.0, 50.0, 51.3}, {50.9, 50.9, 52.0}};
    EXPECT_TRUE(visit(ground, above).empty());
    EXPECT_FALSE(visit(ground, {{50.0, 50.0, 50.8}, {50.9, 50.9, 52.0}}).empty());
}

TEST(GroundTriangles, ReportsAbsentGroundOnlyUnderTheBox) {
    const Ground ground = test::hilly_ground([](int column, int row) { return column + row != 2; });
    TriangleReport report;
    EXPECT_TRUE(visit(ground, {{130, 130, 0}, {140, 140, 1}}, &report).empty());
    EXPECT_TRUE(report.meets_absent);
    EXPECT_FALSE(visit(ground, {{100, 100, -4}, {120, 120, 4}}, &report).empty());
    EXPECT_FALSE(report.meets_absent);
    visit(ground, {{120, 120, -4}, {130, 130, 4}}, &report);
    EXPECT_TRUE(report.meets_absent);
    visit(ground, {{300, 300, -4}, {310, 310, 4}}, &report);
    EXPECT_FALSE(report.meets_absent) << "outside is not absent";
    EXPECT_TRUE(may_meet_absent(ground, {{110, 110, 0}, {111, 111, 1}}, {20, 20, 0}));
    EXPECT_FALSE(may_meet_absent(ground, {{110, 110, 0}, {111, 111, 1}}, {10, 10, 0}));
}

TEST(GroundTriangles, GivesTheTrianglesOfVolumesOnce) {
    const Ground ground = test::slab_ground();
    const auto found = visit(ground, {{35, 35, 4.5}, {36, 36, 6}});
    ASSERT_FALSE(found.empty());
    for (const auto& [name, corners] : found) EXPECT_EQ(std::get<0>(name), TrianglePart::solid);
    const auto below = visit(ground, {{35, 35, -1}, {36, 36, 1}});
    for (const auto& [name, corners] : below) EXPECT_NE(std::get<0>(name), TrianglePart::solid);
}

TEST(GroundTriangles, RefusesBoxesThatAreNotFiniteOrTooLarge) {
    const Ground ground = test::hilly_ground();
    TriangleReport report;
    EXPECT_TRUE(visit(ground, {{kNan, 0, 0}, {1, 1, 1}}, &report).empty());
    EXPECT_TRUE(report.is_refused);
    EXPECT_TRUE(visit(ground, {{1, 0, 0}, {0, 1, 1}}, &report).empty());
    EXPECT_TRUE(report.is_refused);
    const Aabb everything{Eigen::Vector3d::Constant(-1e9), Eigen::Vector3d::Constant(1e9)};
    EXPECT_EQ(visit(ground, everything, &report).size(), 2u * 256u * 256u);
    EXPECT_FALSE(report.is_refused);
    std::size_t count = 0;
    EXPECT_TRUE(
        visit_triangles(ground, everything, WorldPos::Zero(), 1000, [&](const GroundTriangle&) {
            ++count;
        }).is_refused);
    EXPECT_EQ(count, 0u);
    const WorldPos far = WorldPos::Constant(1e9);
    EXPECT_TRUE(visit(ground, {far, far}, &report).empty());
    EXPECT_FALSE(report.is_refused);
}

}  // namespace ground_triangles_test

namespace sphere_contacts_test {

using test::Random;

bool has(std::span<const Contact> contacts, const Contact& wanted) {
    return std::ranges::any_of(contacts, [&](const Contact& c) {
        return (c.point_world - wanted.point_world).norm() < 1e-6 &&
               (c.normal - wanted.normal).norm() < 1e-6 && std::abs(c.depth - wanted.depth) < 1e-6;
    });
}

TEST(SphereContacts, AreThoseOfFindContacts) {
    const auto rough = [](double x, double y) { return 2.0 * test::hills(2.0 * x, 3.0 * y); };
    const Ground grounds[] = {test::hilly_ground(), test::make_test_ground(rough, 1.0, 2)};
    Random random(21);
    int answered = 0, touching = 0;
    for (int i = 0; i < 6000 && !testing::Test::HasFailure(); ++i) {
        const Ground& ground = grounds[i % 2];
        const double radius = random.between(0.05, 1.5), margin = i % 3 == 0 ? 0.02 : 0.0;
        Pose pose;
        pose.translation = {random.between(5.0, 250.0), random.between(5.0, 250.0), 40.0};
        const double lift = compute_lift(Sphere{radius}, pose, ground).lift;
        pose.translation.z() += lift - random.between(-0.02, 0.4 * radius);
        std::array<Contact, 64> fast, slow;
        const auto answer = find_sphere_contacts(ground, pose.translation, radius, margin, fast);
        if (!answer) continue;
        ++answered;
        const ContactAnswer expected = find_contacts(Sphere{radius}, pose, ground, margin, slow);
        touching += answer->count > 0 ? 1 : 0;
        ASSERT_EQ(answer->count > 0, expected.count > 0) << i;
        if (answer->count == 0) continue;
        EXPECT_NEAR(fast[0].depth, slow[0].depth, 1e-9) << i;
        for (std::size_t k = 0; k < answer->count; ++k)
            EXPECT_TRUE(has({slow.data(), expected.count}, fast[k])) << i << " contact " << k;
        for (std::size_t k = 0; k < expected.count; ++k)
            EXPECT_TRUE(has({fast.data(), answer->count}, slow[k])) << i << " expected " << k;
    }
    EXPECT_GT(answered, 5000);
    EXPECT_GT(touching, 3000);
}

TEST(SphereContacts, LeaveToFindContactsWhatTheyCannotAnswer) {
    const Ground ground = test::hilly_ground([](int column, int row) { return column + row != 2; });
    std::array<Contact, 8> contacts;
    const auto answers = [&](const Ground& on, const WorldPos& p, double radius) {
        return find_sphere_contacts(on, p, radius, 0.0, contacts).has_value();
    };
    EXPECT_TRUE(answers(ground, {60, 60, 9}, 0.5));
    EXPECT_FALSE(answers(ground, {60, 60, -9}, 0.5)) << "under the surface";
    EXPECT_FALSE(answers(ground, {180, 180, 9}, 0.5)) << "absent";
    EXPECT_FALSE(answers(ground, {128, 180, 9}, 0.5)) << "partly absent";
    EXPECT_FALSE(answers(ground, {-20, 60, 9}, 0.5)) << "beyond the extent";
    EXPECT_FALSE(answers(ground, {60, 60, 9}, 1e9));
    EXPECT_FALSE(answers(ground, {60, 60, std::numeric_limits<double>::quiet_NaN()}, 0.5));
    EXPECT_FALSE(answers(ground, {60, 60, 9}, std::numeric_limits<double>::quiet_NaN()));
    EXPECT_FALSE(answers(test::slab_ground(), {60, 60, 9}, 0.5)) << "volumes";
}

}  // namespace sphere_contacts_test
}  // namespace terrane::adapters
