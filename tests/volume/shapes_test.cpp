// SPDX-License-Identifier: MIT
#include "support/random.h"
#include "volume/analytic_solid.h"

#include <terrane/volume/volumes.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace terrane {
namespace shapes_test {

using namespace test;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Lattice wide_world() {
    Lattice lattice;
    lattice.first_root_x = lattice.first_root_y = -8;
    lattice.root_count_x = lattice.root_count_y = 16;
    return lattice;
}

std::vector<VolumeShape> random_shapes(Random& random) {
    VolumeTube tube{{}, random.between(1.0, 9.0)};
    for (int i = 1 + random.below(12); i > 0; --i)
        tube.path_shape.push_back(random.direction() * random.between(0.0, 60.0));
    return {VolumeSphere{random.between(1.0, 30.0)},
            VolumeCapsule{random.between(1.0, 9.0), random.between(0.0, 30.0)},
            VolumeBox{
                {random.between(1.0, 20.0), random.between(1.0, 20.0), random.between(1.0, 20.0)}},
            tube};
}

TEST(VolumeShapes, HaveTheDistancesOfTheOracle) {
    Random random(1);
    for (int scene = 0; scene < 200; ++scene) {
        for (const VolumeShape& shape : random_shapes(random)) {
            VolumeOperation operation{.shape = shape, .voxel = 1.0};
            operation.world_from_shape = {random.rotation(),
                                          random.direction() * random.between(0.0, 400.0)};
            const auto placed = PlacedVolume::create(wide_world(), 0, operation);
            ASSERT_TRUE(placed.has_value()) << placed.error().message;
            for (int i = 0; i < 50; ++i) {
                const Eigen::Vector3d p = operation.world_from_shape.translation +
                                          random.direction() * random.between(0.0, 90.0);
                EXPECT_NEAR(placed->signed_distance(p), AnalyticSolid::distance(operation, p),
                            1e-10);
            }
        }
    }
}

TEST(VolumeShapes, ATubeOfOnePointIsASphereAndEqualPointsAreHarmless) {
    VolumeOperation operation{.shape = VolumeTube{{{1, 2, 3}}, 4.0}, .voxel = 1.0};
    const auto sphere = PlacedVolume::create(wide_world(), 0, operation).value();
    operation.shape = VolumeTube{{{1, 2, 3}, {1, 2, 3}, {1, 2, 3}}, 4.0};
    const auto tube = PlacedVolume::create(wide_world(), 0, operation).value();
    for (const Eigen::Vector3d& p :
         {Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(9, 2, 3), Eigen::Vector3d(0, 0, 0)}) {
        EXPECT_NEAR(sphere.signed_distance(p), (p - Eigen::Vector3d(1, 2, 3)).norm() - 4.0, 1e-12);
        EXPECT_EQ(sphere.signed_distance(p), tube.signed_distance(p));
    }
}

std::string refusal(const VolumeOperation& operation) {
    const auto placed = PlacedVolume::create(wide_world(), 0, operation);
    EXPECT_TRUE(placed.has_value() || placed.error().code == ErrorCode::invalid_argument);
    return placed.has_value() ? "" : placed.error().message;
}

TEST(VolumeShapes, LegsOfATubeFarBeyondTheWorldCostNothing) {
    VolumeTube tube{.radius = 1.0};
    for (int i = 0; i < 1'000; ++i) {
        const double side = i % 2 == 0 ? 1e5 : -1e5;
        tube.path_shape.emplace_back(side, side, 0.0);
    }
    const auto placed = PlacedVolume::create(wide_world(), 0, {.shape = tube, .voxel = 1.0});
    ASSERT_TRUE(placed) << placed.error().message;
    EXPECT_LT(placed->tiles().size(), 10'000u);
}

TEST(VolumeShapes, RefusesSizesAndNumbersThatMakeNoSense) {
    EXPECT_EQ(refusal({.shape = VolumeSphere{5.0}, .voxel = 1.0}), "");
    EXPECT_EQ(refusal({.shape = VolumeSphere{0.0}}),
              "radius must be above 0 and at most 1e+05 m, got 0");
    EXPECT_EQ(refusal({.shape = VolumeSphere{-1.0}}),
              "radius must be above 0 and at most 1e+05 m, got -1");
    EXPECT_EQ(refusal({.shape = VolumeSphere{kNan}}),
              "radius must be above 0 and at most 1e+05 m, got nan");
    EXPECT_EQ(refusal({.shape = VolumeSphere{1e6}}),
              "radius must be above 0 and at most 1e+05 m, got 1e+06");
    EXPECT_EQ(refusal({.shape = VolumeCapsule{1.0, -0.1}}),
              "half_height must be 0 to 1e+05 m, got -0.1");
    EXPECT_EQ(refusal({.shape = VolumeBox{{1.0, kNan, 1.0}}}),
              "half_extents must be above 0 and at most 1e+05 m, got nan");
    EXPECT_EQ(refusal({.shape = VolumeTube{{}, 1.0}}), "path must have 1 to 1048576 points, got 0");
    EXPECT_EQ(refusal({.shape = VolumeTube{{{0, 0, 0}, {0, kNan, 0}}, 1.0}}),
              "path[1] must be within 1e+05 m of the origin, got nan");
    EXPECT_EQ(refusal({.shape = VolumeSphere{5.0}, .voxel = 0.0}),
              "voxel must be above 0 and at most 1e+05 m, got 0");
    EXPECT_EQ(refusal({.shape = VolumeSphere{5.0}, .voxel = -1.0}),
              "voxel must be above 0 and at most 1e+05 m, got -1");
    EXPECT_EQ(refusal({.shape = VolumeSphere{5.0}, .voxel = kNan}),
              "voxel must be above 0 and at most 1e+05 m, got nan");
    EXPECT_EQ(refusal({.shape = VolumeSphere{0.001}}),
              "the volume is 0.002 m thick, less than its voxel of 1 m");
    VolumeOperation placed{.shape = VolumeSphere{5.0}};
    placed.world_from_shape.translation.x() = kNan;
    EXPECT_EQ(refusal(placed), "position must be within 2^38 m, got nan");
    placed.world_from_shape.translation = {1e5, 0.0, 0.0};
    EXPECT_EQ(refusal(placed), "the volume at (100000, 0) is outside the world");
    placed.world_from_shape.translation = {0.0, 0.0, 1e9};
    EXPECT_EQ(refusal(placed), "the volume reaches from 1e+09 to 1e+09 m, beyond 2^28 voxels");
    placed.world_from_shape = {2.0 * Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
    EXPECT_EQ(
        refusal(placed),
        "rotation must be orthonormal to 1e-6 with determinant 1, is off by 3 with determinant 8");
    placed.world_from_shape = {-Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
    EXPECT_NE(refusal(placed), "");
}

TEST(Volumes, NameTheOperationThatIsRefused) {
    const std::vector<VolumeOperation> operations = {{.shape = VolumeSphere{5.0}},
                                                     {.shape = VolumeSphere{kNan}}};
    const auto volumes = Volumes::create(wide_world(), operations);
    ASSERT_FALSE(volumes.has_value());
    EXPECT_EQ(volumes.error().message,
              "volume 1: radius must be above 0 and at most 1e+05 m, got nan");
    EXPECT_EQ(Volumes::create(wide_world(), {}).error().message, "the list of volumes is empty");
    Lattice broken = wide_world();
    broken.spacing = kNan;
    EXPECT_FALSE(Volumes::create(broken, {operations.data(), 1}).has_value());
}

TEST(Volumes, ChooseTheLevelWhoseSpacingIsNearest) {
    Lattice lattice = wide_world();
    lattice.spacing = 0.25;
    lattice.finest_level = 4;  // 4, 2, 1, 0.5 and 0.25 m
    EXPECT_EQ(pinned_level(lattice, 1.0), 2);
    EXPECT_EQ(pinned_level(lattice, 0.74), 2);
    EXPECT_EQ(pinned_level(lattice, 0.68), 3);
    EXPECT_EQ(pinned_level(lattice, 0.001), 4);
    EXPECT_EQ(pinned_level(lattice, 1000.0), 0);
    const std::vector<VolumeOperation> operations = {{.shape = VolumeSphere{5.0}, .voxel = 2.0},
                                                     {.shape = VolumeSphere{5.0}, .voxel = 0.5}};
    EXPECT_EQ(Volumes::create(lattice, operations)->spacing(), 0.5);
}

TEST(Volumes, TouchTilesAlongATunnelAndNotItsWholeBox) {
    VolumeOperation tunnel{.shape = VolumeTube{{{-900, -900, -20}, {900, 900, -20}}, 5.0},
                           .voxel = 1.0};
    const std::vector<VolumeOperation> operations = {tunnel,
                                                     {.shape = VolumeSphere{5.0}, .voxel = 1.0}};
    const Volumes volumes = Volumes::create(wide_world(), operations).value();
    EXPECT_GT(volumes.tiles().size(), 100u);  // of 57 * 57 in its box
    EXPECT_LT(volumes.tiles().size(), 260u);
    EXPECT_EQ(volumes.operations_at({20, -20}).size(), 0u);
    ASSERT_EQ(volumes.operations_at({0, 0}).size(), 2u);
    EXPECT_EQ(volumes.operations_at({0, 0})[0], 0u);
    EXPECT_EQ(volumes.operations_at({5, 5}).size(), 1u);
}

}  // namespace shapes_test
}  // namespace terrane
