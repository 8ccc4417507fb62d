// SPDX-License-Identifier: MIT
//
// The ground over chunks with volumes, against formulas: heights, the next surface down, and rays.
#include "support/heights/table_ground.h"
#include "support/random.h"
#include "volume/analytic_solid.h"

#include <terrane/terrain/ground.h>
#include <terrane/volume/volume_tile.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

namespace terrane {
namespace chunk_solid_test {

using test::AnalyticSolid;
using test::make_test_ground;
using test::Random;
using test::TableGroundSettings;

double hill(double x, double y) { return 30.0 * std::sin(0.02 * x) + 3.0 * std::cos(0.21 * y); }

struct Scene {
    Ground ground;
    Volumes volumes;
};

VolumeOperation remove(const VolumeShape& shape, const WorldPos& place) {
    VolumeOperation operation{.op = VolumeOp::remove, .shape = shape};
    operation.world_from_shape.translation = place;
    operation.voxel = 1.0;
    return operation;
}

/// A tunnel along x through a hill, over the border of two chunks, with a hall, a shaft and an arch on the hill.
std::vector<VolumeOperation> make_operations() {
    std::vector<VolumeOperation> operations;
    operations.push_back(
        remove(VolumeTube{{{20.0, 64.0, 2.0}, {230.0, 70.0, 2.0}}, 5.0}, WorldPos::Zero()));
    operations.push_back(remove(VolumeSphere{14.0}, {128.0, 67.0, 4.0}));
    operations.push_back(remove(VolumeCapsule{4.0, 30.0}, {60.0, 65.0, 30.0}));
    VolumeOperation arch{.op = VolumeOp::add, .shape = VolumeSphere{6.0}};
    arch.world_from_shape.translation = {90.0, 100.0, hill(90.0, 100.0) + 2.0};
    arch.voxel = 1.0;
    operations.push_back(arch);
    return operations;
}

Scene make_scene() {
    std::optional<Volumes> volumes;
    TableGroundSettings settings;
    settings.roots = 2;
    settings.solid = [&](const Chunk& chunk) -> std::shared_ptr<const SolidSurface> {
        if (!volumes) {
            Lattice lattice;
            lattice.quantum = settings.quantum;
            lattice.root_count_x = lattice.root_count_y = settings.roots;
            volumes = Volumes::create(lattice, make_operations()).value();
        }
        return make_chunk_solid(*volumes, chunk).value();
    };
    Ground ground = make_test_ground(hill, settings);
    return {std::move(ground), *volumes};
}

AnalyticSolid make_oracle() {
    const Ground plain = make_test_ground(hill, 1.0, 2);
    return {make_operations(), [plain](double x, double y) { return plain.height(x, y).height; }};
}

TEST(ChunkSolid, SurfacesBelowEachOtherDivideSolidFromAir) {
    const Scene scene = make_scene();
    const AnalyticSolid oracle = make_oracle();
    Random random(5);
    SCOPED_TRACE("seed 5");
    int compared = 0;
    for (int i = 0; i < 3000; ++i) {
        const double x = random.between(10.0, 240.0);
        const double y = i % 2 == 0 ? random.between(55.0, 80.0) : random.between(80.0, 115.0);
        // From the highest surface downwards: below a surface whose normal points up is solid, until the next one.
        double z = 1000.0;
        bool was_solid = false;
        for (int count = 0; count < 20; ++count) {
            const HeightAnswer surface = scene.ground.height_below(x, y, z);
            const double bottom = surface.status == GroundStatus::ok ? surface.height : z - 20.0;
            const Eigen::Vector3d middle(x, y, 0.5 * (std::min(z, 100.0) + bottom));
            const bool is_clear = oracle.distance_to_shapes(middle) > 1.2 &&
                                  std::abs(middle.z() - oracle.height(x, y)) > 1e-6;
            if (is_clear) {
                ASSERT_EQ(oracle.is_solid(middle), was_solid) << middle.transpose();
                ++compared;
            }
            if (surface.status != GroundStatus::ok) break;
            // Ceilings are below solid, floors below air.
            ASSERT_EQ(surface.normal.z() < 0.0, was_solid) << x << ", " << y << ", " << bottom;
            was_solid = !was_solid;
            z = surface.height - 1e-9;  // answers are exact to rounding
        }
        ASSERT_TRUE(was_solid) << "it ends in solid";
    }
    EXPECT_GT(compared, 3000);
}

TEST(ChunkSolid, RaysInATunnelMeetItsWallAtItsRadius) {
    const Scene scene = make_scene();
    Random random(6);
    SCOPED_TRACE("seed 6");
    const Eigen::Vector3d from(20.0, 64.0, 2.0), along(210.0, 6.0, 0.0);
    for (int i = 0; i < 2000; ++i) {
        const double share = random.between(0.25, 0.35);
        const WorldPos middle = from + share * along;
        Eigen::Vector3d n = random.direction();
        n -= along.normalized() * along.normalized().dot(n);
        const RayAnswer answer = scene.ground.ray(middle, middle + 8.0 * n.normalized());
        ASSERT_EQ(answer.status, GroundStatus::ok);
        ASSERT_NEAR((answer.point_world - middle).norm(), 5.0, 0.1);
        ASSERT_LT(answer.normal.dot(n.normalized()), -0.7);
        ASSERT_GE(answer.error_m, std::abs((answer.point_world - middle).norm() - 5.0));
    }
    // Along the axis, over the border of the chunks and out of the mouth in the far side of the hill; and back, to the
    // blind end.
    const WorldPos inside = from + 0.3 * along, outside = from + 1.0 * along;
    EXPECT_EQ(scene.ground.ray(inside, outside).status, GroundStatus::miss);
    const RayAnswer back = scene.ground.ray(outside, from - 0.2 * along);
    ASSERT_EQ(back.status, GroundStatus::ok);
    EXPECT_NEAR((back.point_world - from).norm(), 5.0, 0.1);
}

TEST(ChunkSolid, NothingSlipsThroughTheSeamWithTheHeightfield) {
    // Neither spacing nor origin is a short binary fraction, so that coordinates round.
    TableGroundSettings settings{.spacing = 0.3, .roots = 2, .origin_x = 123456.7};
    Lattice lattice;
    lattice.origin_x = settings.origin_x;
    lattice.spacing = settings.spacing;
    lattice.quantum = settings.quantum;
    lattice.root_count_x = lattice.root_count_y = settings.roots;
    const auto rough = [](double x, double y) { return std::sin(0.7 * x) + std::cos(0.9 * y); };
    // Over the border of two chunks.
    VolumeOperation dig = remove(VolumeSphere{3.0}, {123456.7 + 38.4, 19.2, 0.5});
    dig.voxel = settings.spacing;
    const Volumes volumes = Volumes::create(lattice, std::vector{dig}).value();
    std::vector<std::shared_ptr<const SolidSurface>> solids;
    settings.solid = [&](const Chunk& chunk) {
        std::shared_ptr<const SolidSurface> solid = make_chunk_solid(volumes, chunk).value();
        if (solid != nullptr) solids.push_back(solid);
        return solid;
    };
    const Ground ground = make_test_ground(rough, settings);
    ASSERT_EQ(solids.size(), 2u);
    Random random(7);
    SCOPED_TRACE("seed 7");
    int count = 0;
    for (const auto& solid : solids) {
        const SolidTriangles& own = solid->triangles();
        ASSERT_FALSE(own.kept_neighbours.empty());
        for (const auto& triangle : own.kept_neighbours) {
            for (std::size_t k = 0; k < 3; ++k) {
                const Eigen::Vector3d &a = own.vertices_world[triangle[k]],
                                      &b = own.vertices_world[triangle[(k + 1) % 3]];
                for (int i = 0; i < 8; ++i) {
                    const WorldPos target = a + random.between(0.0, 1.0) * (b - a);
                    Eigen::Vector3d n = random.direction();
                    n.z() = std::abs(n.z()) + 3.0;  // steeper than the ground: it passes through
                    const RayAnswer answer = ground.ray(target + 0.2 * n, target - 0.2 * n);
                    ASSERT_EQ(answer.status, GroundStatus::ok) << target.transpose();
                    const HeightAnswer height = ground.height(target.x(), target.y());
                    ASSERT_EQ(height.status, GroundStatus::ok);
                    ASSERT_NEAR(height.height, target.z(), 1e-6);
                    ++count;
                }
            }
        }
    }
    EXPECT_GT(count, 2000);
}

TEST(ChunkSolid, FindsTheTrianglesWhoseBoxesOverlapABox) {
    const Scene scene = make_scene();
    ASSERT_TRUE(scene.ground.has_solids());
    EXPECT_FALSE(make_test_ground(hill, 1.0, 2).has_solids());
    EXPECT_EQ(scene.ground.solid(50, 200), nullptr);
    const SolidSurface* const solid = scene.ground.solid(50, 60);
    ASSERT_NE(solid, nullptr);
    const std::size_t all =
        solid->triangles().triangles.size() + solid->triangles().kept_neighbours.size();
    Random random(8);
    SCOPED_TRACE("seed 8");
    std::size_t most = 0;
    for (int i = 0; i < 100; ++i) {
        const Eigen::Vector3d low(random.between(20.0, 110.0), random.between(55.0, 75.0),
                                  random.between(-5.0, 8.0));
        const Eigen::Vector3d size(random.between(0.0, 6.0), random.between(0.0, 6.0),
                                   random.between(0.0, 6.0));
        const Aabb box{low, low + size};
        std::vector<std::uint32_t> expected;
        for (std::uint32_t t = 0; t < all; ++t) {
            const auto v = solid->corners_world(t);
            const Eigen::Vector3d from = v[0].cwiseMin(v[1]).cwiseMin(v[2]),
                                  to = v[0].cwiseMax(v[1]).cwiseMax(v[2]);
            if ((from - box.high).maxCoeff() <= 0.0 && (box.low - to).maxCoeff() <= 0.0) {
                expected.push_back(t);
            }
        }
        std::vector<std::uint32_t> found;
        std::array<std::uint32_t, 7> some;
        std::uint32_t cursor = 0;
        for (std::size_t count = some.size(); count == some.size();) {
            count = solid->find_overlaps(box, cursor, some);
            found.insert(found.end(), some.begin(),
                         some.begin() + static_cast<std::ptrdiff_t>(count));
        }
        std::sort(found.begin(), found.end());
        ASSERT_EQ(found, expected);
        most = std::max(most, found.size());
    }
    EXPECT_GT(most, 50u);
}

TEST(ChunkSolid, OfAChunkWithoutVolumesIsNull) {
    const Scene scene = make_scene();
    // The northern chunks have none.
    EXPECT_EQ(scene.ground.height(50.5, 200.5).height,
              make_test_ground(hill, 1.0, 2).height(50.5, 200.5).height);
    Chunk chunk;
    chunk.key = {0, 1, std::uint8_t{0}};
    EXPECT_EQ(make_chunk_solid(scene.volumes, chunk).value(), nullptr);
    chunk.key = {0, 0, std::uint8_t{3}};
    const auto refused = make_chunk_solid(scene.volumes, chunk);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
}

}  // namespace chunk_solid_test
}  // namespace terrane
