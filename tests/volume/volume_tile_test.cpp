// SPDX-License-Identifier: MIT
#include "support/hash.h"
#include "volume/flat_world.h"
#include "volume/random_scene.h"

#include <terrane/volume/volume_tile.h>

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

namespace terrane {
namespace volume_tile_test {

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

TEST(VolumeTile, HasTheValuesOfItsNeighboursAtSharedNodes) {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        const RandomScene scene(seed);
        const Volumes volumes = Volumes::create(scene.world.lattice, scene.operations).value();
        const auto west =
            VolumeTile::create(volumes, {3, 1}, scene.world.tile_heights({3, 1})).value();
        const auto east =
            VolumeTile::create(volumes, {4, 1}, scene.world.tile_heights({4, 1})).value();
        const int middle = static_cast<int>(scene.operations[0].world_from_shape.translation.z() /
                                            volumes.spacing());
        for (int row = 0; row < kVolumeTileSamples; ++row) {
            for (int k = middle - 40; k < middle + 40; ++k) {
                const auto a = west.distances(32, row, k), b = east.distances(0, row, k);
                ASSERT_EQ(a.to_void, b.to_void) << "seed " << seed;
                ASSERT_EQ(a.to_solid, b.to_solid) << "seed " << seed;
                ASSERT_EQ(west.position(32, row, k), east.position(0, row, k));
            }
        }
    }
}

TEST(VolumeTile, AppliesADigAsIfItHadBeenInTheList) {
    const VolumeWorld world = flat_world();
    const std::vector<VolumeOperation> both = {
        place(VolumeOp::remove, VolumeSphere{9.0}, {60, 60, 40}),
        place(VolumeOp::add, VolumeBox{{4, 4, 9}}, {63, 62, 37})};
    const Volumes all = Volumes::create(world.lattice, both).value();
    const Volumes first = Volumes::create(world.lattice, {both.data(), 1}).value();
    const auto whole = VolumeTile::create(all, {1, 1}, world.tile_heights({1, 1})).value();
    auto dug = VolumeTile::create(first, {1, 1}, world.tile_heights({1, 1})).value();
    dug.apply(PlacedVolume::create(world.lattice, 0, both[1]).value());
    EXPECT_EQ(whole.contour().positions_world, dug.contour().positions_world);
    EXPECT_EQ(whole.contour().triangles, dug.contour().triangles);
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

}  // namespace volume_tile_test
}  // namespace terrane
