// SPDX-License-Identifier: MIT
//
// The oracles against slower or simpler ones.
#include "collision/ground_laws/law_cases.h"

#include <gtest/gtest.h>

#include <span>

namespace terrane::oracle_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260301;

// Largest surface height minus z over a grid of directions and of points of the core.
double sampled_lift(const LawScene& scene, const OraclePart& part, const Pose& pose, int steps) {
    double lift = -std::numeric_limits<double>::infinity();
    const auto sample = [&](const Eigen::Vector3d& p) {
        lift = std::max(lift, scene.soup.height(p.x(), p.y()) - p.z());
    };
    const auto sample_sphere = [&](const Eigen::Vector3d& core) {
        for (int i = 0; i <= steps; ++i) {
            for (int j = 0; j < 2 * steps; ++j) {
                const double z = -1.0 + 2.0 * i / steps, angle = 3.141592653589793 * j / steps;
                const double ring = std::sqrt(std::max(0.0, 1.0 - z * z));
                sample(core + part.radius * Eigen::Vector3d(ring * std::cos(angle),
                                                            ring * std::sin(angle), z));
            }
        }
    };
    if (part.radius > 0.0) {
        for (int k = 0; k <= steps; ++k) {
            sample_sphere(pose *
                          (part.points.front() + static_cast<double>(k) / steps *
                                                     (part.points.back() - part.points.front())));
        }
        return lift;
    }
    for (const auto& [a, b, c] : part.triangles) {
        for (int i = 0; i <= steps; ++i) {
            for (int j = 0; i + j <= steps; ++j) {
                const double u = static_cast<double>(i) / steps, v = static_cast<double>(j) / steps;
                sample(pose * (part.points[a] + u * (part.points[b] - part.points[a]) +
                               v * (part.points[c] - part.points[a])));
            }
        }
    }
    return lift;
}

TEST(LawShapes, HullsHaveTheVerticesOfTheirOracles) {
    for (const char* name : {"hull", "flat hull"}) {
        const LawShape& shape = shape_named(name);
        const std::span<const Eigen::Vector3d> vertices =
            std::get<ConvexHull>(shape.shape).vertices();
        const OraclePart& part = shape.oracle.parts[0];
        ASSERT_TRUE(
            std::equal(vertices.begin(), vertices.end(), part.points.begin(), part.points.end()))
            << name;
    }
    // Euler's formula; in the flat hull every pair of vertices lies in its plane.
    const OraclePart& hull = shape_named("hull").oracle.parts[0];
    EXPECT_EQ(hull.points.size() + hull.triangles.size(), hull.edges.size() + 2);
    EXPECT_EQ(shape_named("flat hull").oracle.parts[0].edges.size(), 15u);
}

TEST(BruteLift, IsTheLargestOverManyPointsOfTheShape) {
    SeededRandom random(kSeed);
    for (const LawScene& scene : law_scenes()) {
        if (scene.name == "cliffs") continue;  // samples miss a cliff by its whole height
        for (const LawShape& shape : law_shapes()) {
            for (int i = 0; i < 2; ++i) {
                const Pose pose = random_pose(random, scene, shape, random.between(-0.5, 0.5));
                SCOPED_TRACE(describe(scene, shape, pose));
                const double lift = true_lift(scene, shape, pose);
                double sampled = -std::numeric_limits<double>::infinity();
                for (const OraclePart& part : shape.oracle.parts) {
                    sampled = std::max(sampled, sampled_lift(scene, part, pose, 40));
                }
                EXPECT_GE(lift, sampled - 1e-12);
                const bool is_steep = scene.name == "needles" || scene.name == "spikes" ||
                                      scene.name == "walls" || scene.name == "pits";
                EXPECT_LE(lift, sampled + (is_steep ? 2.5 : 0.15));
                EXPECT_NEAR(brute_lift<double>(scene.soup, shape.oracle, pose), lift, 1e-11);
                EXPECT_TRUE(is_deeper<double>(scene.soup, shape.oracle, pose,
                                              Eigen::Vector3d::Zero(), lift - 1e-9));
                EXPECT_FALSE(is_deeper<double>(scene.soup, shape.oracle, pose,
                                               Eigen::Vector3d::Zero(), lift + 1e-9));
            }
        }
    }
}

TEST(BruteLift, OfASphereIsTheLargestOverATriangleByNestedSearch) {
    SeededRandom random(kSeed);
    for (int i = 0; i < 1000; ++i) {
        SoupTriangle<double> t;
        const double steep = i % 3 == 0 ? 30.0 : 1.0;
        t.v = {Eigen::Vector3d(0.0, 0.0, steep * random.between(-1.0, 1.0)),
               Eigen::Vector3d(1.0, 0.0, steep * random.between(-1.0, 1.0)),
               Eigen::Vector3d(i % 2, 1.0, steep * random.between(-1.0, 1.0))};
        const Eigen::Vector3d centre(random.between(-0.5, 1.5), random.between(-0.5, 1.5), 0.3);
        const double radius = random.between(0.1, 1.0);
        const auto largest = [](double low, double high, const auto& of) {
            double best = std::max(of(low), of(high));
            for (int round = 0; round < 60; ++round) {
                const double a = low + (high - low) / 3.0, b = high - (high - low) / 3.0;
                const double at_a = of(a), at_b = of(b);
                best = std::max({best, at_a, at_b});
                (at_a < at_b ? low : high) = at_a < at_b ? a : b;
            }
            return best;
        };
        // Concave over the sphere; decreases with distance beside it.
        const double searched = largest(0.0, 1.0, [&](double v) {
            return largest(0.0, 1.0, [&](double u) {
                const Eigen::Vector3d p =
                    t.v[0] + (1.0 - v) * u * (t.v[1] - t.v[0]) + v * (t.v[2] - t.v[0]);
                const double rest = radius * radius - (p - centre).head<2>().squaredNorm();
                return rest >= 0.0 ? p.z() - centre.z() + std::sqrt(rest) : -1e6 * (1.0 - rest);
            });
        });
        const double lift = sphere_lift<double>(centre, radius, t);
        if (lift > -1e5) {
            EXPECT_NEAR(searched, lift, 1e-7) << i;
        } else {
            EXPECT_LT(searched, -1e5) << i;
        }
    }
}

TEST(BruteDepth, OfASphereOverPlanesIsTheOverlapAlongTheNormal) {
    const LawScene& plane = scene_named("sloped plane");
    const OracleShape sphere = make_oracle(Sphere{0.5});
    const double slant = std::sqrt(1.0 + 0.25 * 0.25 + 0.5 * 0.5);
    for (const double depth : {0.001, 0.02, 0.1}) {
        Pose pose{.translation = {60.3, 41.7, 0.25 * 60.3 - 0.5 * 41.7 + (0.5 - depth) * slant}};
        EXPECT_NEAR(static_cast<double>(brute_depth(plane.soup, sphere, pose, 0.12L)), depth,
                    1e-12);
    }
}

TEST(BruteGap, IsTheLargestDisplacementWithoutOverlap) {
    SeededRandom random(kSeed);
    for (const LawScene& scene : law_scenes()) {
        for (const LawShape& shape : law_shapes()) {
            for (int i = 0; i < 3; ++i) {
                const Pose pose = random_pose(random, scene, shape, random.between(-2.0, 0.0));
                SCOPED_TRACE(describe(scene, shape, pose));
                const auto gap = static_cast<double>(
                    brute_gap<long double>(scene.soup, shape.oracle, pose, 8.0L));
                EXPECT_GE(gap, 0.0);
                EXPECT_LE(gap, -true_lift(scene, shape, pose) + 1e-12);
                for (int k = 0; k < 100; ++k) {
                    EXPECT_FALSE(is_deeper<double>(scene.soup, shape.oracle, pose,
                                                   (gap - 1e-9) * random.direction(), 1e-12));
                }
            }
        }
    }
}

}  // namespace terrane::oracle_test
