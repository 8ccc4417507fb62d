// SPDX-License-Identifier: MIT
// Random scenes: the joined mesh is closed, on the right side, and near the surface.
#include "volume/analytic_solid.h"
#include "volume/random_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace terrane {
namespace scenes_test {

using namespace test;

#ifndef TERRANE_SCENE_FACTOR
#define TERRANE_SCENE_FACTOR 1
#endif
// A tenth where contracts are checked: such builds are slow.
constexpr std::uint64_t kScenes = (TERRANE_ASSERTS ? 100 : 1000) * TERRANE_SCENE_FACTOR;
constexpr int kPoints = 300;

struct Scene {
    RandomScene random;
    Volumes volumes;
    JoinedMesh mesh;
    AnalyticSolid solid;

    explicit Scene(std::uint64_t seed)
        : random(seed),
          volumes(Volumes::create(random.world.lattice, random.operations).value()),
          mesh(join(random.world, volumes, contour_all(random.world, volumes))),
          solid(random.operations,
                [this](double x, double y) { return random.world.height(x, y); }) {}
};

TEST(JoinedScenes, AreWatertight) {
    for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
        const Scene scene(seed);
        ASSERT_EQ(find_leak(scene.random.world, scene.mesh), "") << "seed " << seed;
    }
}

TEST(JoinedScenes, HaveTheSolidOfTheirOperations) {
    long compared = 0;
    for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
        const Scene scene(seed);
        const VolumeWorld& world = scene.random.world;
        const VerticalCrossings crossings(world, scene.mesh);
        const double s = scene.volumes.spacing();
        Random random(seed);
        for (int i = 0; i < kPoints; ++i) {
            const auto& near = scene.random.operations[static_cast<std::size_t>(
                random.below(static_cast<int>(scene.random.operations.size())))];
            const Eigen::Vector3d p = near.world_from_shape.translation +
                                      s * random.between(0.0, 25.0) * random.direction();
            if (std::min(p.x(), p.y()) <= 0.0 || p.x() >= s * (world.columns - 1) ||
                p.y() >= s * (world.rows - 1)) {
                continue;
            }
            // Beside a steep triangle, features smaller than its edges are lost.
            const auto [low, high] = world.cell_range(p.x(), p.y());
            const double slope = std::sqrt(2.0) * (high - low) / s;
            if (high - low > 2.0 * s && p.z() > low - 2.0 * s && p.z() < high + 2.0 * s) continue;
            if (scene.solid.distance_to_shapes(p) < 1.2 * s) continue;
            if (std::abs(p.z() - world.height(p.x(), p.y())) <
                0.01 * s * std::sqrt(1.0 + slope * slope))
                continue;
            ++compared;
            ASSERT_EQ(crossings.above(p), scene.solid.is_solid(p) ? 1 : 0)
                << "seed " << seed << " at " << p.transpose() << ", spacing " << s;
        }
    }
    EXPECT_GT(compared, static_cast<long>(kScenes) * kPoints / 3);
}

TEST(JoinedScenes, HaveVerticesNearTheSurface) {
    double worst = 0.0, worst_shared = 0.0;
    for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
        const Scene scene(seed);
        const double s = scene.volumes.spacing();
        for (std::size_t i = 0; i < scene.mesh.keys.size(); ++i) {
            const VolumeVertexKey& key = scene.mesh.keys[i];
            if (key.is_node()) continue;
            const double to_void = std::abs(scene.solid.to_void(scene.mesh.positions[i])) / s;
            const double to_solid = std::abs(scene.solid.to_solid(scene.mesh.positions[i])) / s;
            const double off = std::min(to_void, to_solid);
            const double edge = std::abs(key.first.k - key.second.k);
            if (edge <= 1.0) {
                worst = std::max(worst, off);
                ASSERT_LE(off, 0.9) << "seed " << seed;
            } else {
                worst_shared = std::max(worst_shared, off);
                ASSERT_LE(off, 1.0 + 0.5 * edge) << "seed " << seed;
            }
        }
    }
    std::printf("largest distance of a vertex: %.3f spacings; beside steep ground %.3f\n", worst,
                worst_shared);
}

}  // namespace scenes_test
}  // namespace terrane
