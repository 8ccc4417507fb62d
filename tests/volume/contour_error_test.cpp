// SPDX-License-Identifier: MIT
//
// Error bounds of contours are compared with an analytic oracle: from points of the contour to the true surface, and
// back. A failure prints its seed.
#include "support/grounds.h"
#include "volume/volume_scenes.h"

#include <terrane/volume/volume_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace terrane::contour_error_test {

using namespace test;

constexpr int kFinest = 3;  // of 1 m
constexpr ChunkKey kKey{3, 3, kFinest};
constexpr double kTight = 0.5;  // metres: below what creases have
constexpr double kLost = 0.87;  // metres, half a tetrahedron's diameter: vertices are nearer

/// Smooth walls under gentle ground, alone, beside each other and across each other.
std::vector<VolumeOperation> random_operations(Random& random) {
    std::vector<VolumeOperation> operations;
    for (int i = 1 + random.below(3); i > 0; --i) {
        VolumeOperation& made = operations.emplace_back();
        made.voxel = 1.0;
        made.op = random.below(5) == 0 ? VolumeOp::add : VolumeOp::remove;
        const double radius = random.between(3.5, 25.0);
        switch (random.below(4)) {
            case 0:
                made.shape = VolumeSphere{radius};
                break;
            case 1:
                made.shape = VolumeCapsule{radius, random.between(0.0, 30.0)};
                break;
            case 2:
                made.shape =
                    VolumeBox{{radius, random.between(3.5, 25.0), random.between(3.5, 25.0)}};
                break;
            default: {
                VolumeTube tube{{}, std::min(radius, 9.0)};
                Eigen::Vector3d at(-40.0, 0.0, 0.0), along(1.0, 0.0, 0.0);
                const double bend = random.below(2) == 0 ? 0.1 : 0.8;
                for (int k = 3 + random.below(3); k > 0; --k) {
                    tube.path_shape.push_back(at);
                    along = (along + bend * random.direction()).normalized();
                    at += random.between(8.0, 40.0) * along;
                }
                made.shape = tube;
            }
        }
        // The chunk is 384 to 512 m east and north.
        made.world_from_shape.translation = {
            random.between(410.0, 490.0), random.between(410.0, 490.0), random.between(-70.0, 5.0)};
        if (random.below(2) == 0) made.world_from_shape.rotation = random.rotation();
    }
    return operations;
}

/// How far the true surface is from a point at most, up to `most`: the nearest place along rays where solid and air
/// meet. Infinite where no ray finds one.
double distance_to_truth(const AnalyticSolid& truth, const Eigen::Vector3d& p,
                         const Eigen::Vector3d& normal, double most, Random& random) {
    const bool is_solid = truth.is_solid(p);
    double least = std::numeric_limits<double>::infinity();
    for (int ray = 0; ray < 40; ++ray) {
        const Eigen::Vector3d direction =
            ray < 2 ? Eigen::Vector3d((ray == 0 ? 1.0 : -1.0) * normal) : random.direction();
        double inside = 0.0, outside = 0.0;
        constexpr int kSteps = 8;
        for (int i = 1; i <= kSteps; ++i) {
            const double t = std::min(most, least) * i / kSteps;
            if (truth.is_solid(p + t * direction) != is_solid) {
                outside = t;
                break;
            }
            inside = t;
        }
        if (outside == 0.0) continue;
        for (int i = 0; i < 30; ++i) {
            const double middle = 0.5 * (inside + outside);
            (truth.is_solid(p + middle * direction) == is_solid ? inside : outside) = middle;
        }
        least = std::min(least, outside);
    }
    return least;
}

/// A random point of the true surface in the chunk, on a shape's surface below the ground, met by a ray from around a
/// place.
std::optional<Eigen::Vector3d> point_of_truth(const AnalyticSolid& truth,
                                              const Eigen::Vector3d& place, Random& random) {
    const Eigen::Vector3d from = place + random.between(0.0, 8.0) * random.direction();
    const Eigen::Vector3d direction = random.direction();
    const bool is_solid = truth.is_solid(from);
    for (double t = 0.5; t < 20.0; t += 0.5) {
        if (truth.is_solid(from + t * direction) == is_solid) continue;
        double inside = t - 0.5, outside = t;
        for (int i = 0; i < 40; ++i) {
            const double middle = 0.5 * (inside + outside);
            (truth.is_solid(from + middle * direction) == is_solid ? inside : outside) = middle;
        }
        const Eigen::Vector3d q = from + outside * direction;
        const bool is_in_chunk = q.x() > 386.0 && q.x() < 510.0 && q.y() > 386.0 && q.y() < 510.0;
        if (is_in_chunk && q.z() < truth.height(q.x(), q.y()) - 3.0) return q;
        return std::nullopt;
    }
    return std::nullopt;
}

/// Points that were compared, and the largest ratios of a distance to its bound.
struct Comparison {
    std::size_t tight = 0, loose = 0, back = 0, lost = 0;
    double tightest_there = 0.0, tightest_back = 0.0;

    void print() const {
        std::printf(
            "%zu points in boxes below %.1f m, %zu in others; %zu points back, %zu lost; measured "
            "over bound at most %.2f and %.2f\n",
            tight, kTight, loose, back, lost, tightest_there, tightest_back);
    }
};

void compare(const std::vector<VolumeOperation>& operations, Random& random,
             Comparison& comparison) {
    Lattice lattice{.finest_level = kFinest};
    const auto ground = std::make_shared<const WaveHeights>(lattice, 3.0, 200.0);
    const auto volumes = Volumes::create(lattice, operations, {.level = kFinest});
    ASSERT_TRUE(volumes) << volumes.error().message;
    const auto source = VolumeHeights::create(ground, *volumes).value();
    const auto chunk = make_chunk(*source, kKey).value();
    if (!chunk->solid) return;
    const SolidSurface& solid = *chunk->solid;
    const SolidTriangles& triangles = solid.triangles();
    ASSERT_EQ(triangles.error_box_of.size(), triangles.triangles.size());
    const AnalyticSolid truth(operations, [&](double x, double y) { return ground->height(x, y); });
    const auto walls = static_cast<int>(triangles.triangles.size() - triangles.ground_count);
    if (walls == 0) return;
    for (int i = 0; i < 300; ++i) {
        const auto t = static_cast<std::uint32_t>(triangles.ground_count +
                                                  static_cast<std::size_t>(random.below(walls)));
        const auto [a, b, c] = solid.corners_world(t);
        double u = random.between(0.0, 1.0), v = random.between(0.0, 1.0);
        if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
        const Eigen::Vector3d p = a + u * (b - a) + v * (c - a);
        const SolidErrorBox& box = triangles.error_boxes[triangles.error_box_of[t]];
        ASSERT_EQ(box.error_m, solid.error_m(t));
        ASSERT_LE(box.error_m, triangles.error_m);
        ASSERT_TRUE((p.array() >= box.box_world.low.array() - 1e-9).all());
        ASSERT_TRUE((p.array() <= box.box_world.high.array() + 1e-9).all());
        const double error = box.error_m;
        if (error > kTight) {
            ++comparison.loose;
            continue;
        }
        ++comparison.tight;
        const double there = distance_to_truth(truth, p, solid.normal(t), error, random);
        ASSERT_LE(there, error) << p.transpose();
        comparison.tightest_there = std::max(comparison.tightest_there, there / error);
    }
    FrameMesh shown;
    shown.positions = triangles.vertices_world;
    shown.triangles = triangles.triangles;
    for (int i = 0; i < 60; ++i) {
        const auto vertex = static_cast<std::size_t>(
            random.below(static_cast<int>(triangles.vertices_world.size())));
        const auto q = point_of_truth(truth, triangles.vertices_world[vertex], random);
        if (!q) continue;
        const FrameMesh::Nearest found = shown.nearest(*q);
        const double error = solid.error_m(static_cast<std::uint32_t>(found.triangle));
        if (found.distance > kLost) {
            ++comparison.lost;  // a corner or a sheet between nodes: docs/volumes.md
            continue;
        }
        ++comparison.back;
        ASSERT_LE(found.distance, error) << q->transpose();
        if (error < kTight)
            comparison.tightest_back = std::max(comparison.tightest_back, found.distance / error);
    }
}

int scene_count() { return test::few_or_many(10, 1000); }

TEST(ContourError, IsNeverLessThanTheDistanceOfFormulasBothWays) {
    Comparison comparison;
    for (int seed = 1; seed <= scene_count() && !HasFatalFailure(); ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(static_cast<std::uint64_t>(seed));
        compare(random_operations(random), random, comparison);
    }
    comparison.print();
    EXPECT_GT(comparison.tight, comparison.loose / 4);
    EXPECT_GT(comparison.back, 50 * comparison.lost);
    EXPECT_GT(comparison.tightest_there, 0.05);
    EXPECT_GT(comparison.tightest_back, 0.05);
}

/// One shape alone: slabs of a few spacings, and tubes whose segments are short, turn back, or end behind a bend.
VolumeOperation random_thin_shape(Random& random) {
    VolumeOperation made{.voxel = 1.0};
    if (random.below(2) == 0) {
        made.shape = VolumeBox{
            {random.between(0.6, 3.5), random.between(10.0, 25.0), random.between(10.0, 25.0)}};
    } else {
        VolumeTube tube{{}, random.between(3.5, 15.0)};
        Eigen::Vector3d at(-20.0, 0.0, 0.0), along = random.direction();
        for (int k = 2 + random.below(5); k > 0; --k) {
            tube.path_shape.push_back(at);
            along = (along + random.between(0.0, 1.2) * random.direction()).normalized();
            at += (random.below(2) == 0 ? random.between(0.5, 6.0) : random.between(6.0, 40.0)) *
                  along;
        }
        made.shape = tube;
    }
    made.world_from_shape.translation = {448.0, 448.0, random.between(-60.0, -35.0)};
    if (random.below(3) != 0) made.world_from_shape.rotation = random.rotation();
    return made;
}

TEST(ContourError, OfThinSlabsAndShortSegmentsIsNeverTooSmall) {
    Comparison comparison;
    for (int seed = 1; seed <= scene_count() && !HasFatalFailure(); ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(static_cast<std::uint64_t>(seed));
        compare({random_thin_shape(random)}, random, comparison);
    }
    comparison.print();
    EXPECT_GT(comparison.tight, 0u);
    EXPECT_GT(comparison.back, 0u);
}

/// A tunnel of one segment, away from its ends.
TEST(ContourError, OfATunnelIsThatOfItsCurvature) {
    Lattice lattice{.finest_level = kFinest};
    const auto ground = std::make_shared<const WaveHeights>(lattice, 0.01, 200.0);
    const auto solid_of = [&](const std::vector<VolumeOperation>& operations) {
        const auto volumes = Volumes::create(lattice, operations, {.level = kFinest}).value();
        const auto source = VolumeHeights::create(ground, volumes).value();
        return make_chunk(*source, kKey).value()->solid;
    };
    const VolumeOperation tunnel =
        place(VolumeTube{{{300.0, 450.0, -40.0}, {600.0, 450.0, -40.0}}, 10.0}, WorldPos::Zero());
    const auto alone = solid_of({tunnel});
    EXPECT_LT(alone->triangles().error_m, 0.1);
    EXPECT_GT(alone->triangles().error_m, 0.02);
    // The mouth of a shaft has the error of tetrahedra, the tunnel below it what it had.
    const auto with_shaft =
        solid_of({tunnel, place(VolumeCapsule{6.0, 20.0}, {400.0, 450.0, -15.0})});
    double at_shaft = 0.0, beside = 0.0;
    for (const SolidErrorBox& box : with_shaft->triangles().error_boxes) {
        double& most = box.box_world.low.x() < 425.0 ? at_shaft : beside;
        most = std::max(most, box.error_m);
    }
    EXPECT_GT(at_shaft, 1.0);
    EXPECT_EQ(beside, alone->triangles().error_m);
}

}  // namespace terrane::contour_error_test
