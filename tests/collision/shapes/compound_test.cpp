// SPDX-License-Identifier: MIT
#include "point_clouds.h"

#include <terrane/collision/shapes.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace terrane {
namespace compound_test {

using Parts = std::vector<CompoundPart>;

Pose random_pose(test::Random& random) {
    Pose pose;
    pose.rotation = random.rotation();
    pose.translation = 3.0 * random.direction();
    return pose;
}

ConvexShape random_shape(test::Random& random, int kind) {
    const double size = random.between(0.1, 2.0);
    if (kind == 0) return Sphere{size};
    if (kind == 1) return Capsule{size, random.between(0.0, 2.0)};
    if (kind == 2) return Box{{size, random.between(0.0, 2.0), random.between(0.0, 2.0)}};
    return ConvexHull::create(test::ball(random, 30)).value();
}

// Dense samples of a shape's surface, for brute force.
std::vector<Eigen::Vector3d> sample(const ConvexShape& shape, test::Random& random) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 20'000; ++i) {
        const Eigen::Vector3d n = random.direction();
        if (const Sphere* sphere = std::get_if<Sphere>(&shape)) {
            points.push_back(sphere->radius * n);
        } else if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
            points.emplace_back(capsule->radius * n);
            points.back().z() += n.z() < 0.0 ? -capsule->half_height : capsule->half_height;
        } else if (const Box* box = std::get_if<Box>(&shape)) {
            points.push_back(n.cwiseSign().cwiseProduct(box->half_extents));
        } else {
            const auto vertices = std::get<ConvexHull>(shape).vertices();
            points.push_back(vertices[static_cast<std::size_t>(i) % vertices.size()]);
        }
    }
    return points;
}

TEST(Compound, HasTheBoundsAndReachOfItsPoints) {
    SCOPED_TRACE("seed 21");
    test::Random random(21);
    for (int i = 0; i < 40; ++i) {
        Parts parts;
        for (int k = 0; k < 1 + i % 4; ++k) {
            parts.push_back({random_shape(random, (i + k) % 4), random_pose(random)});
        }
        const Compound compound = Compound::create(parts).value();
        ASSERT_EQ(compound.parts().size(), parts.size());
        double radius = 0.0;
        std::vector<Eigen::Vector3d> all;
        for (std::size_t k = 0; k < parts.size(); ++k) {
            Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9);
            Eigen::Vector3d high = -low;
            for (const Eigen::Vector3d& point : sample(parts[k].shape, random)) {
                all.push_back(parts[k].body_from_part * point);
                low = low.cwiseMin(all.back());
                high = high.cwiseMax(all.back());
                radius = std::max(radius, all.back().norm());
            }
            // Encloses the samples, by at most their spacing more.
            const Aabb& bounds = compound.bounds()[k];
            for (int axis = 0; axis < 3; ++axis) {
                EXPECT_LE(bounds.low[axis], low[axis] + 1e-12);
                EXPECT_GE(bounds.low[axis], low[axis] - 2e-3);
                EXPECT_GE(bounds.high[axis], high[axis] - 1e-12);
                EXPECT_LE(bounds.high[axis], high[axis] + 2e-3);
            }
        }
        EXPECT_GE(bounding_radius(compound), radius - 1e-12);
        EXPECT_LE(bounding_radius(compound), radius + 2e-3);
        for (int k = 0; k < 20; ++k) {
            const Eigen::Vector3d direction = random.direction();
            double reach = -1e9;
            for (const Eigen::Vector3d& p : all) reach = std::max(reach, direction.dot(p));
            EXPECT_GE(support_distance(compound, direction), reach - 1e-12);
            EXPECT_LE(support_distance(compound, direction), reach + 2e-3);
        }
    }
}

TEST(Compound, IsAsThinAsItsThinnestPart) {
    const Compound compound =
        Compound::create(Parts{{Box{{1.0, 0.25, 2.0}}, Pose()}, {Sphere{0.5}, Pose()}}).value();
    EXPECT_EQ(smallest_half_extent(compound), 0.25);
    EXPECT_TRUE(check(compound));
    Compound copy = compound;
    const Compound moved = std::move(copy);
    EXPECT_EQ(copy.parts().size(), moved.parts().size());  // NOLINT(bugprone-use-after-move)
}

std::string message_of(const Parts& parts) {
    const Result<Compound> compound = Compound::create(parts);
    return compound ? std::string() : compound.error().message;
}

TEST(Compound, RefusesPartsThatAreNone) {
    const double nan = std::nan("");
    EXPECT_EQ(message_of({}), "a compound needs 1 to 100000 parts, got 0");
    EXPECT_EQ(message_of({{Sphere{0.0}, Pose()}}), "");
    EXPECT_EQ(message_of({{Sphere{1.0}, Pose()}, {Sphere{-1.0}, Pose()}}),
              "compound part 1: sphere radius must be 0 to 1e5 m, got -1");
    Pose pose;
    pose.translation.y() = nan;
    EXPECT_EQ(message_of({{Sphere{1.0}, pose}}),
              "translation of compound part 0 must be -1e5 to 1e5 m, got y nan");
    pose.translation.y() = -1.0001e5;
    EXPECT_NE(message_of({{Sphere{1.0}, pose}}), "");
    pose = Pose();
    const std::string start =
        "rotation of compound part 0 must be orthonormal to 1e-6 with determinant 1, got ";
    pose.rotation(0, 0) = 1.0 + 1e-5;
    EXPECT_EQ(message_of({{Sphere{1.0}, pose}}), start + "one that is off by 2e-05");
    pose.rotation(0, 0) = 1.0 + 1e-7;
    EXPECT_EQ(message_of({{Sphere{1.0}, pose}}), "");
    pose.rotation(0, 0) = -1.0;
    EXPECT_EQ(message_of({{Sphere{1.0}, pose}}), start + "one that is off by inf");
    for (int entry = 0; entry < 9; ++entry) {
        pose.rotation = Eigen::Matrix3d::Identity();
        pose.rotation(entry / 3, entry % 3) = nan;
        EXPECT_NE(message_of({{Sphere{1.0}, pose}}), "") << entry;
    }
}

TEST(Compound, FromTrianglesIsTheirSurface) {
    SCOPED_TRACE("seed 22");
    test::Random random(22);
    const std::vector<Eigen::Vector3d> vertices = test::ball(random, 50);
    std::vector<std::array<std::uint32_t, 3>> triangles{{3, 3, 3},
                                                        {1, 2, 1}};  // and degenerate ones
    for (std::uint32_t i = 0; i + 2 < vertices.size(); ++i) triangles.push_back({i, i + 2, i + 1});
    const Compound compound = Compound::from_triangles(vertices, triangles).value();
    ASSERT_EQ(compound.parts().size(), triangles.size());
    EXPECT_EQ(smallest_half_extent(compound), 0.0);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const ConvexHull& hull = std::get<ConvexHull>(compound.parts()[i].shape);
        EXPECT_EQ(hull.vertices().size(), i == 0 ? 1u : i == 1 ? 2u : 3u);
        EXPECT_EQ(hull.face_count(), i < 2 ? 0u : 2u);
        for (const std::uint32_t vertex : triangles[i]) {
            EXPECT_TRUE((vertices[vertex] - compound.bounds()[i].low).minCoeff() >= 0.0);
            EXPECT_TRUE((compound.bounds()[i].high - vertices[vertex]).minCoeff() >= 0.0);
        }
    }
}

TEST(Compound, FromTrianglesNamesTheBadOne) {
    const double nan = std::nan("");
    const std::vector<Eigen::Vector3d> vertices{{0, 0, 0}, {1, 0, 0}, {0, nan, 0}};
    using Triangles = std::vector<std::array<std::uint32_t, 3>>;
    const auto message = [&](const Triangles& triangles) {
        const Result<Compound> compound = Compound::from_triangles(vertices, triangles);
        return compound ? std::string() : compound.error().message;
    };
    EXPECT_EQ(message({}), "a compound needs 1 to 100000 triangles, got 0");
    EXPECT_EQ(message({{0, 1, 1}, {0, 3, 1}}), "triangle 1 names vertex 3 of 3");
    EXPECT_EQ(message({{0, 1, 2}}),
              "triangle 0: coordinates of hull point 2 must be -1e5 to 1e5 m, got y nan");
}

}  // namespace compound_test
}  // namespace terrane
