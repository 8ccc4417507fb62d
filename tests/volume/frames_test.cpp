// SPDX-License-Identifier: MIT
//
// Random scenes: the joined mesh is closed, on the right side, and near the surface.
#include "support/grounds.h"
#include "support/mesh_checks.h"
#include "volume/volume_frames.h"
#include "volume/volume_scenes.h"

#include <terrane/terrain/mesh_buffers.h>
#include <terrane/terrain/pager.h>
#include <terrane/volume/volume_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace terrane::scenes_test {

using namespace test;

const auto kScenes = static_cast<std::uint64_t>(few_or_many(40, 1000));
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

}  // namespace terrane::scenes_test

// P1, P2 and P3 of frames with volumes: random operations, resident sets, fades, views, budgets and targets.
// The seed of a failure is printed.

namespace terrane::frames_test {

using namespace test;

bool is_visible(const View& view, const Eigen::Vector3d& p) {
    for (const Eigen::Vector3d& normal : make_frustum(view).normals) {
        if (normal.dot(p - view.eye_world) < 0.0) return false;
    }
    return true;
}

/// The four chunks around the corner at their finest, and how far that is from the true heightfield.
struct FinestSurface {
    FrameMesh mesh;
    std::vector<std::shared_ptr<const Chunk>> chunks;
    double field_error_m = 0.0;

    FinestSurface(Chunks& all, const Lattice& lattice) {
        for (const int y : {3, 4}) {
            for (const int x : {3, 4}) {
                const auto& chunk = chunks.emplace_back(all.get({x, y, kFinest}));
                mesh.add_finest(lattice, *chunk);
                for (const float bound : chunk->cell_bounds)
                    field_error_m = std::max(field_error_m, static_cast<double>(bound));
            }
        }
    }
};

/// Screen error of the joined surface near the corner by brute force: from points of the finest surface of volumes to
/// what is displayed, and from points of what is displayed to the finest surface.
double measure_joined(const FinestSurface& finest, const FrameMesh& shown, const View& view,
                      Random& random) {
    constexpr int kPoints = 40;
    constexpr double kInside = 120.0;  // of the four chunks' 128 m to each side of the corner
    double most = 0.0;
    const auto measure = [&](double error_m, double eye_distance) {
        most = std::max(
            most, error_m * view.pixels_per_radian() / std::max(view.near_distance, eye_distance));
    };
    const auto middle_of = [](const auto& positions, const std::array<std::uint32_t, 3>& t) {
        return Eigen::Vector3d((positions[t[0]] + positions[t[1]] + positions[t[2]]) / 3.0);
    };
    for (const auto& chunk : finest.chunks) {
        if (!chunk->solid || chunk->solid->triangles().triangles.empty()) continue;
        const SolidTriangles& solid = chunk->solid->triangles();
        for (int i = 0; i < kPoints; ++i) {
            const auto t =
                static_cast<std::size_t>(random.below(static_cast<int>(solid.triangles.size())));
            const Eigen::Vector3d p = middle_of(solid.vertices_world, solid.triangles[t]);
            if (is_visible(view, p))
                measure(shown.nearest(p).distance, (p - view.eye_world).norm());
        }
    }
    std::vector<std::uint32_t> near;
    for (std::uint32_t t = 0; t < shown.triangles.size(); ++t) {
        const Eigen::Vector3d p = middle_of(shown.positions, shown.triangles[t]);
        if ((p - Eigen::Vector3d(512.0, 512.0, p.z())).cwiseAbs().maxCoeff() < kInside)
            near.push_back(t);
    }
    for (int i = 0; i < kPoints && !near.empty(); ++i) {
        const auto t = near[static_cast<std::size_t>(random.below(static_cast<int>(near.size())))];
        const Eigen::Vector3d p = middle_of(shown.positions, shown.triangles[t]);
        const FrameMesh::Nearest found = finest.mesh.nearest(p);
        // the true heightfield may be that much nearer
        const double error_m = found.distance - finest.field_error_m;
        if (!(error_m > 0.0)) continue;
        // the true point is in the nearest triangle: that must be in view, and is at most so far from the eye
        bool is_true_visible = true;
        for (const std::uint32_t corner : finest.mesh.triangles[found.triangle]) {
            is_true_visible = is_true_visible && is_visible(view, finest.mesh.positions[corner]);
        }
        if (is_true_visible) measure(error_m, (p - view.eye_world).norm() + found.distance);
    }
    return most;
}

int scene_count() { return test::few_or_many(8, 1000); }

TEST(Frames, WithVolumesKeepBudgetAndCertificateAndAreWatertight) {
    int drawn = 0, with_caps = 0, replaced = 0, met = 0, frames = 0;
    double tightest = 0.0;
    for (int seed = 1; seed <= scene_count(); ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(static_cast<std::uint64_t>(seed));
        const auto ground = random_hills(random);
        const auto volumes = Volumes::create(ground->lattice(), random_operations(random, *ground),
                                             {.level = kFinest});
        ASSERT_TRUE(volumes) << volumes.error().message;
        const auto source = VolumeHeights::create(ground, *volumes).value();
        Chunks chunks(*source);
        const FinestSurface finest(chunks, source->lattice());
        for (int set = 0; set < 3; ++set) {
            const auto resident = random_residents(random, chunks, *source);
            for (const double distance : {random.between(5.0, 60.0), random.between(60.0, 400.0),
                                          random.between(400.0, 20000.0)}) {
                const View view = random_view(random, distance);
                TriangulatorSettings settings;
                const int most = random.below(3) == 0 ? 20'000 : 300'000;
                settings.triangle_budget = static_cast<std::size_t>(2 + random.below(most));
                settings.max_error_px = std::exp(random.between(-3.0, 3.0));
                settings.morph_ratio = random.below(4) == 0 ? 1.0 : random.between(1.0, 2.0);
                Triangulator triangulator = Triangulator::create(*source, settings).value();
                const TerrainMesh mesh = triangulator.update(resident, view);
                ASSERT_LE(mesh.triangle_count, settings.triangle_budget);
                const FrameMesh shown(mesh);
                ASSERT_EQ(shown.find_flaw(mesh), "");
                ASSERT_EQ(mesh.status == MeshStatus::error_met,
                          mesh.error_px <= settings.max_error_px);
                const double measured = measure_joined(finest, shown, view, random);
                ASSERT_LE(measured, mesh.error_px);
                const double of_heights =
                    test::measure_error_px(test::make_soup(mesh), *ground, view, 1);
                ASSERT_LE(of_heights, mesh.error_px);
                ++frames;
                drawn += mesh.solids.empty() ? 0 : 1;
                met += mesh.status == MeshStatus::error_met ? 1 : 0;
                for (const MeshSolid& solid : mesh.solids) {
                    replaced += solid.chunk->solid->triangles().replaced.empty() ? 0 : 1;
                    for (const auto& cap : solid.caps) with_caps += cap.empty() ? 0 : 1;
                }
                tightest = std::max(tightest, measured / mesh.error_px);
            }
        }
    }
    std::printf(
        "%d frames, %d with volumes, %d replaced chunks, %d caps, %d within the target; "
        "measured over certified at most %.3f\n",
        frames, drawn, replaced, with_caps, met, tightest);
    EXPECT_GT(drawn, frames / 10);
    EXPECT_GT(replaced, 0);
    EXPECT_GT(with_caps, 0);
    EXPECT_GT(met, 0);
}

// Four caps would share the line at the corner; the two chunks between are absent.
TEST(Frames, WithVolumesOfTwoChunksThatShareOnlyACornerAreWatertight) {
    const Lattice lattice{.finest_level = kFinest};
    const auto ground = std::make_shared<const WaveHeights>(lattice, 0.01, 300.0);
    VolumeOperation hollow{.op = VolumeOp::remove, .shape = VolumeSphere{8.0}};
    hollow.world_from_shape.translation = {512.0, 512.0, -20.0};
    const auto volumes = Volumes::create(lattice, {{hollow}}, {.level = kFinest}).value();
    const auto source = VolumeHeights::create(ground, volumes).value();
    std::vector<std::shared_ptr<const Chunk>> resident;
    for (const ChunkKey& key :
         {ChunkKey{0, 0, 0}, ChunkKey{0, 0, 1}, ChunkKey{1, 1, 1}, ChunkKey{1, 1, 2},
          ChunkKey{2, 2, 2}, ChunkKey{3, 3, 3}, ChunkKey{4, 4, 3}}) {
        resident.push_back(make_chunk(*source, key).value());
    }
    const auto set = std::make_shared<const ResidentSet>(lattice, source->extent(), resident, 1);
    const View view = look_at({512.0, 480.0, 10.0}, {512.0, 512.0, -20.0}, 1.0, 640, 480).value();
    Triangulator triangulator = Triangulator::create(*source, {.triangle_budget = 300'000}).value();
    const TerrainMesh mesh = triangulator.update(set, view);
    EXPECT_EQ(mesh.solids.size(), 1u);
    EXPECT_EQ(FrameMesh(mesh).find_flaw(mesh), "");
}

}  // namespace terrane::frames_test

namespace terrane::volume_buffers_test {

using Place = std::array<float, 3>;
using Corners = std::array<Place, 3>;

Place place_of(const WorldPos& p_world, const WorldPos& origin_world) {
    const LocalVec p = to_local(p_world, origin_world);
    return {p.x(), p.y(), p.z()};
}

std::vector<Corners> sorted(std::vector<Corners> triangles) {
    for (Corners& corners : triangles) {
        std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()),
                    corners.end());
    }
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

TEST(MeshBuffers, HoldTheTrianglesOfVolumesWithNormalsOutOfTheSolid) {
    Lattice lattice{.finest_level = 3};
    const auto ground = std::make_shared<const test::WaveHeights>(lattice, 8.0, 300.0);
    std::vector<VolumeOperation> operations(2);
    operations[0].shape = VolumeSphere{9.0};
    operations[0].world_from_shape.translation = {512.0, 512.0, ground->height(512.0, 512.0) - 4.0};
    operations[1].op = VolumeOp::add;
    operations[1].shape = VolumeBox{{4.0, 4.0, 6.0}};
    operations[1].world_from_shape.translation = {540.0, 512.0, ground->height(540.0, 512.0) + 3.0};
    for (VolumeOperation& operation : operations) operation.voxel = 1.0;
    const auto volumes = Volumes::create(lattice, operations, {.level = 3});
    ASSERT_TRUE(volumes) << volumes.error().message;
    const auto source = VolumeHeights::create(ground, *volumes).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const WorldPos eye(512.0, 480.0, 30.0);
    CameraNeed camera{.view = look_at(eye, {515.0, 512.0, 0.0}, 1.0, 640, 480).value()};
    pager.update({&camera, 1}, {}, 0.0);
    Triangulator triangulator = Triangulator::create(*source, {.triangle_budget = 200'000}).value();
    const TerrainMesh mesh = triangulator.update(pager.resident(), camera.view);
    ASSERT_FALSE(mesh.solids.empty());

    MeshBuffers buffers = MeshBuffers::create().value();
    buffers.update(mesh, eye);
    const test::FrameMesh shown(mesh);
    std::vector<Corners> expected, found;
    for (const auto& [a, b, c] : shown.triangles) {
        expected.push_back({place_of(shown.positions[a], eye), place_of(shown.positions[b], eye),
                            place_of(shown.positions[c], eye)});
    }
    double against = 0.0, with = 0.0;
    for (const MeshPart& part : buffers.parts()) {
        for (std::size_t i = 0; i < part.indices.size(); i += 3) {
            Corners corners;
            std::array<Eigen::Vector3d, 3> p, n;
            for (std::size_t k = 0; k < 3; ++k) {
                const MeshVertex& vertex = part.vertices[part.indices[i + k]];
                corners[k] = vertex.position;
                p[k] = {vertex.position[0], vertex.position[1], vertex.position[2]};
                n[k] = {vertex.normal[0], vertex.normal[1], vertex.normal[2]};
                EXPECT_NEAR(n[k].norm(), 1.0, 1e-6);
            }
            found.push_back(corners);
            const Eigen::Vector3d twice_area = (p[1] - p[0]).cross(p[2] - p[0]);
            for (const Eigen::Vector3d& normal : n) {
                (normal.dot(twice_area) > 0.0 ? with : against) += twice_area.norm();
            }
        }
    }
    EXPECT_EQ(sorted(found), sorted(expected));
    EXPECT_LT(against, 0.001 * with);

    const TriangleMesh expanded = expand_mesh(mesh);
    EXPECT_EQ(expanded.triangles.size(), mesh.triangle_count);
    EXPECT_EQ(expanded.positions.size(), shown.positions.size());
    buffers.update(mesh, eye);
    for (const MeshPart& part : buffers.parts()) EXPECT_EQ(part.change, PartChange::same);
}

}  // namespace terrane::volume_buffers_test
