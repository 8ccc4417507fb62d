// SPDX-License-Identifier: MIT
#include "level_set/tile_level_set.h"
#include "support/random.h"
#include "volume/analytic_solid.h"
#include "volume/random_scene.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <algorithm>
#include <cmath>

namespace terrane {
namespace level_set_test {

using namespace test;

TEST(TileLevelSet, HasTheDistancesOfTheOracleAtNodes) {
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        const RandomScene scene(seed);
        const AnalyticSolid solid(scene.operations, {});
        const Volumes volumes = Volumes::create(scene.world.lattice, scene.operations).value();
        const VolumeTileKey key = volumes.tiles()[volumes.tiles().size() / 2];
        const auto tile = VolumeTile::create(volumes, key, scene.world.tile_heights(key)).value();
        const double s = volumes.spacing(), band = 3.0 * s;
        Random random(seed);
        for (int i = 0; i < 3000; ++i) {
            const auto& near = scene.operations[static_cast<std::size_t>(
                random.below(static_cast<int>(scene.operations.size())))];
            const int column = random.below(33), row = random.below(33);
            const int k =
                static_cast<int>(near.world_from_shape.translation.z() / s) + random.below(41) - 20;
            const WorldPos p = tile.position(column, row, k);
            const auto distances = tile.distances(column, row, k);
            ASSERT_NEAR(double{distances.to_void}, std::clamp(solid.to_void(p), -band, band),
                        1e-4 * s);
            ASSERT_NEAR(double{distances.to_solid}, std::clamp(solid.to_solid(p), -band, band),
                        1e-4 * s);
        }
    }
}

TEST(TileLevelSet, HasTheValuesOfOpenVdbsOwnComposition) {
    // Heights of 0: nodes are the points of a regular grid, as OpenVDB's are.
    Random random(1);
    for (int scene = 0; scene < 30; ++scene) {
        const VolumeWorld world = VolumeWorld::make(1, 1.0, [](int, int) { return 0.0; });
        auto to_void = openvdb::createLevelSet<openvdb::FloatGrid>(1.0, 3.0);
        auto to_solid = openvdb::createLevelSet<openvdb::FloatGrid>(1.0, 3.0);
        std::vector<VolumeOperation> operations;
        for (int i = 0; i < 5; ++i) {
            VolumeOperation& operation = operations.emplace_back();
            operation.op = random.below(2) == 0 ? VolumeOp::remove : VolumeOp::add;
            const double radius = random.between(3.0, 12.0);
            operation.shape.emplace<VolumeSphere>(VolumeSphere{radius});
            operation.voxel = 1.0;
            const Eigen::Vector3d at(random.between(5.0, 27.0), random.between(5.0, 27.0),
                                     random.between(-9.0, 9.0));
            operation.world_from_shape.translation = at.cast<float>().cast<double>();
            const auto sphere = [&] {
                return openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
                    static_cast<float>(radius),
                    openvdb::Vec3f(static_cast<float>(at.x()), static_cast<float>(at.y()),
                                   static_cast<float>(at.z())),
                    1.0f, 3.0f);
            };
            const bool removes = operation.op == VolumeOp::remove;
            openvdb::tools::csgUnion(removes ? *to_void : *to_solid, *sphere());
            openvdb::tools::csgDifference(removes ? *to_solid : *to_void, *sphere());
        }
        const Volumes volumes = Volumes::create(world.lattice, operations).value();
        const auto tile = VolumeTile::create(volumes, {0, 0}, world.tile_heights({0, 0})).value();
        for (int i = 0; i < 20000; ++i) {
            const int column = random.below(33), row = random.below(33), k = random.below(49) - 24;
            const auto ours = tile.distances(column, row, k);
            const openvdb::Coord at(column, row, k);
            ASSERT_NEAR(ours.to_void, to_void->tree().getValue(at), 2e-4f) << "scene " << scene;
            ASSERT_NEAR(ours.to_solid, to_solid->tree().getValue(at), 2e-4f) << "scene " << scene;
        }
    }
}

TEST(TileLevelSet, IsEmptyWhereOperationsCancel) {
    const VolumeWorld world = VolumeWorld::make(1, 1.0, [](int, int) { return 0.0; });
    const VolumeOperation cave{.op = VolumeOp::remove, .shape = VolumeSphere{8.0}, .voxel = 1.0};
    std::vector<VolumeOperation> operations = {cave, cave};
    for (VolumeOperation& operation : operations)
        operation.world_from_shape.translation = {16.0, 16.0, 0.0};
    operations[1].op = VolumeOp::add;
    operations[1].shape.emplace<VolumeSphere>(VolumeSphere{14.0});
    const auto tile_of = [&](std::size_t count) {
        const Volumes volumes = Volumes::create(world.lattice, {operations.data(), count}).value();
        return VolumeTile::create(volumes, {0, 0}, world.tile_heights({0, 0})).value();
    };
    // What was filled over holds no cave; what is left is the band of the filling.
    EXPECT_GT(tile_of(2).distances(16, 16, 0).to_void, 2.9f);
    EXPECT_LT(tile_of(2).distances(16, 16, 0).to_solid, -2.9f);
    EXPECT_GT(tile_of(1).band_node_count(), 1000u);
}

TEST(TileLevelSet, IsNoLargerAfterManyDigsInOnePlace) {
    const VolumeWorld world = VolumeWorld::make(1, 1.0, [](int, int) { return 0.0; });
    VolumeOperation dig{.op = VolumeOp::remove, .shape = VolumeSphere{3.0}, .voxel = 1.0};
    dig.world_from_shape.translation = {16.0, 16.0, 0.0};
    const Volumes volumes = Volumes::create(world.lattice, {&dig, 1}).value();
    auto tile = VolumeTile::create(volumes, {0, 0}, world.tile_heights({0, 0})).value();
    Random random(2);
    std::size_t most = 0, bytes_at_half = 0;
    for (int i = 0; i < 10000; ++i) {
        dig.world_from_shape.translation =
            Eigen::Vector3d(16, 16, 0) + random.direction() * random.between(0.0, 9.0);
        tile.apply(PlacedVolume::create(world.lattice, 0, dig).value());
        most = std::max(most, tile.bytes());
        if (i == 5000) bytes_at_half = tile.bytes();
    }
    EXPECT_LE(tile.bytes(), bytes_at_half * 11 / 10);
    EXPECT_LT(most, 2u * tile.bytes());
    EXPECT_LT(tile.contour().triangles.size(), 20000u);
}

}  // namespace level_set_test
}  // namespace terrane
