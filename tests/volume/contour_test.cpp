// SPDX-License-Identifier: MIT
#include "level_set/tile_level_set.h"
#include "volume/volume_scenes.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

namespace terrane::level_set_test {

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

TEST(TileLevelSet, IsNoLargerAfterManyDigsInOnePlace) {
    const VolumeWorld world = VolumeWorld::make(1, 1.0, [](int, int) { return 0.0; });
    VolumeOperation dig{.op = VolumeOp::remove,
                        .shape = VolumeSphere{3.0},
                        .world_from_shape = {.translation = {16.0, 16.0, 0.0}},
                        .voxel = 1.0};
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

}  // namespace terrane::level_set_test

namespace terrane::contour_test {

using namespace test;

constexpr double kPi = 3.14159265358979323846;

struct Joined {
    Volumes volumes;
    std::vector<VolumeContour> contours;
    JoinedMesh mesh;
    Joined(const VolumeWorld& world, const std::vector<VolumeOperation>& operations)
        : volumes(Volumes::create(world.lattice, operations).value()),
          contours(contour_all(world, volumes)),
          mesh(join(world, volumes, contours)) {}
    std::size_t count(SolidPart surface) const {
        std::size_t count = 0;
        for (const VolumeContour& contour : contours) {
            count += static_cast<std::size_t>(std::ranges::count(contour.surfaces, surface));
        }
        return count;
    }
    std::size_t replaced() const {
        std::size_t count = 0;
        for (const VolumeContour& contour : contours) count += contour.replaced.size();
        return count;
    }
};

TEST(Contour, EnclosesTheVolumeOfSpheresBelowAboveAndInTheGround) {
    const VolumeWorld world = flat_world();
    const double ground = 40.0 * 128.0 * 128.0, ball = 4.0 / 3.0 * kPi * std::pow(12.0, 3);
    for (const double z : {20.0, 40.0, 60.0}) {
        for (const VolumeOp op : {VolumeOp::remove, VolumeOp::add}) {
            const Joined joined(world, {place(op, VolumeSphere{12.0}, {63.7, 64.2, z})});
            EXPECT_EQ(find_leak(world, joined.mesh), "");
            // The part of the ball where the operation changes something.
            const bool below = z<30.0, above = z> 50.0, removes = op == VolumeOp::remove;
            const double share = below   ? (removes ? 1.0 : 0.0)
                                 : above ? (removes ? 0.0 : 1.0)
                                         : 0.5;
            EXPECT_NEAR(signed_volume(joined.mesh) - ground, (removes ? -1.0 : 1.0) * share * ball,
                        0.01 * ball);
            EXPECT_EQ(joined.count(SolidPart::cavity) > 0, removes && !above);
            EXPECT_EQ(joined.count(SolidPart::overhang) > 0, !removes && !below);
            EXPECT_EQ(joined.replaced() > 0, !below && !above);
        }
    }
}

TEST(Contour, IsClosedForAllStatesOfATrianglesSamples) {
    // A small sphere at every sample of a part of the ground: void, solid or none.
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        Random random(seed);
        const VolumeWorld world =
            VolumeWorld::make(1, 1.0, [&](int, int) { return 40.0 + random.between(0.0, 1.5); });
        std::vector<VolumeOperation> operations;
        for (int row = 24; row < 40; ++row) {
            for (int column = 24; column < 40; ++column) {
                const int state = random.below(3);
                if (state == 0) continue;
                operations.push_back(
                    place(state == 1 ? VolumeOp::remove : VolumeOp::add, VolumeSphere{0.55},
                          {double(column), double(row), world.sample(column, row)}));
            }
        }
        const Joined joined(world, operations);
        EXPECT_EQ(find_leak(world, joined.mesh), "") << "seed " << seed;
        EXPECT_GT(joined.count(SolidPart::ground), 100u);
        EXPECT_GT(joined.count(SolidPart::overhang), 100u);
    }
}

TEST(Contour, IsClosedWhereFacesPassThroughNodes) {
    const VolumeWorld world = flat_world();
    for (const double z : {30.0, 35.0, 40.0, 45.0}) {
        for (const VolumeOp op : {VolumeOp::remove, VolumeOp::add}) {
            const Joined joined(
                world, {place(op, VolumeBox{{4.0, 6.0, 5.0}}, {64.0, 64.0, z}),
                        place(VolumeOp::remove, VolumeBox{{4.0, 6.0, 5.0}}, {72.0, 64.0, z}),
                        place(VolumeOp::add, VolumeBox{{4.0, 6.0, 5.0}}, {68.0, 76.0, z})});
            EXPECT_EQ(find_leak(world, joined.mesh), "");
        }
    }
}

TEST(Contour, IsOpenOnlyAtTheWorldsBorder) {
    const VolumeWorld world = flat_world();
    const Joined joined(world, {place(VolumeOp::remove, VolumeSphere{9.0}, {0.0, 0.0, 38.0}),
                                place(VolumeOp::add, VolumeTube{{{0, 0, 0}, {90, 0, 0}}, 6.0},
                                      {60.0, 90.0, 42.0})});
    EXPECT_EQ(find_leak(world, joined.mesh), "");
    EXPECT_GT(joined.replaced(), 0u);
}

TEST(Contour, LeavesAloneWhatItDoesNotReach) {
    const VolumeWorld world = flat_world();
    const Joined joined(world, {place(VolumeOp::remove, VolumeSphere{5.0}, {64.0, 64.0, 80.0}),
                                place(VolumeOp::add, VolumeSphere{5.0}, {64.0, 64.0, 10.0})});
    for (const VolumeContour& contour : joined.contours) {
        EXPECT_TRUE(contour.triangles.empty() && contour.keys.empty() && contour.replaced.empty());
    }
    EXPECT_TRUE(Volumes::create(world.lattice, std::vector{place(VolumeOp::remove,
                                                                 VolumeSphere{5.0}, {20, 20, 0})})
                    ->operations_at({3, 3})
                    .empty());
}

TEST(Contour, IsAsAccurateTenThousandKilometresOut) {
    VolumeWorld world = flat_world();
    world.lattice.origin_x = 1e7;
    const auto cave = place(VolumeOp::remove, VolumeSphere{20.0}, {1e7 + 63.7, 64.2, 15.0});
    const Volumes volumes = Volumes::create(world.lattice, std::vector{cave}).value();
    double worst = 0.0;
    for (const VolumeContour& contour : contour_all(world, volumes)) {
        for (const WorldPos& p : contour.positions_world) {
            worst = std::max(worst, std::abs(AnalyticSolid::distance(cave, p)));
        }
    }
    EXPECT_GT(worst, 0.0);
    EXPECT_LT(worst, 0.02);
}

TEST(JoinedMeshChecks, FindWhatIsBroken) {
    const VolumeWorld world = flat_world();
    const Joined joined(world, {place(VolumeOp::remove, VolumeSphere{9.0}, {64.0, 64.0, 38.0})});
    ASSERT_EQ(find_leak(world, joined.mesh), "");
    JoinedMesh missing = joined.mesh;
    missing.triangles.erase(missing.triangles.begin() + 100);
    EXPECT_NE(find_leak(world, missing).find("one triangle"), std::string::npos);
    JoinedMesh turned = joined.mesh;
    std::swap(turned.triangles[100][0], turned.triangles[100][1]);
    EXPECT_NE(find_leak(world, turned), "");
    JoinedMesh twice = joined.mesh;
    twice.triangles.push_back(twice.triangles[100]);
    EXPECT_NE(find_leak(world, twice).find("two triangles"), std::string::npos);
    JoinedMesh flat = joined.mesh;
    flat.triangles[100][0] = flat.triangles[100][1];
    EXPECT_NE(find_leak(world, flat), "");
    std::vector<VolumeContour> kept = joined.contours;
    for (VolumeContour& contour : kept) {
        if (!contour.replaced.empty()) contour.replaced.pop_back();
    }
    EXPECT_NE(find_leak(world, join(world, joined.volumes, kept)), "");
    for (VolumeContour& contour : kept) {
        if (!contour.positions_world.empty()) contour.positions_world.front().x() += 1e-9;
    }
    EXPECT_NE(find_leak(world, join(world, joined.volumes, kept)), "");
}

}  // namespace terrane::contour_test

namespace terrane::volume_tile_test {

using namespace test;

TEST(VolumeTile, RefusesWhatIsNotItsTile) {
    const VolumeWorld world = flat_world();
    const Volumes volumes =
        Volumes::create(world.lattice,
                        std::vector{place(VolumeOp::remove, VolumeSphere{5.0}, {64, 64, 40})})
            .value();
    const auto heights = world.tile_heights({0, 0});
    EXPECT_EQ(VolumeTile::create(volumes, {4, 0}, heights).error().message,
              "tile (4, 0) is not of the world");
    EXPECT_EQ(VolumeTile::create(volumes, {0, -1}, heights).error().message,
              "tile (0, -1) is not of the world");
    EXPECT_EQ(VolumeTile::create(volumes, {0, 0}, {heights.data(), 5}).error().message,
              "tile (0, 0) has 33 * 33 heights, got 5");
}

std::uint64_t hash_of(const VolumeContour& contour) {
    Hash hash;
    for (const WorldPos& p : contour.positions_world) {
        for (int axis = 0; axis < 3; ++axis) hash.add(p[axis]);
    }
    for (const VolumeVertexKey& key : contour.keys) {
        for (const VolumeNode& node : {key.first, key.second})
            hash.add(node.column), hash.add(node.row), hash.add(node.k);
    }
    for (const auto& t : contour.triangles) hash.add(t);
    for (const std::uint16_t name : contour.replaced) hash.add(name);
    return hash.value();
}

TEST(VolumeThreads, GiveTheSameBits) {
    // The hash changes only where contours are meant to.
    std::vector<RandomScene> scenes;
    for (std::uint64_t seed = 1; seed <= 30; ++seed) scenes.emplace_back(seed);
    for (const int thread_count : {1, 2, 8}) {
        std::vector<std::uint64_t> hashes(scenes.size());
        std::atomic<std::size_t> next = 0;
        {
            std::vector<std::jthread> threads;
            for (int i = 0; i < thread_count; ++i) {
                threads.emplace_back([&] {
                    for (std::size_t s = next++; s < scenes.size(); s = next++) {
                        const Volumes volumes =
                            Volumes::create(scenes[s].world.lattice, scenes[s].operations).value();
                        Hash hash;
                        for (const VolumeContour& contour : contour_all(scenes[s].world, volumes)) {
                            hash.add(hash_of(contour));
                        }
                        hashes[s] = hash.value();
                    }
                });
            }
        }
        Hash all;
        for (const std::uint64_t hash : hashes) all.add(hash);
        EXPECT_EQ(all.value(), 3402551277005506589u) << thread_count << " threads";
    }
}

}  // namespace terrane::volume_tile_test
