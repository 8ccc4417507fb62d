// SPDX-License-Identifier: MIT
#include "support/heights/wave_heights.h"
#include "volume/frame_mesh.h"

#include <terrane/terrain/mesh_buffers.h>
#include <terrane/terrain/pager.h>
#include <terrane/volume/volume_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

namespace terrane {
namespace volume_buffers_test {

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
    Lattice lattice;
    lattice.finest_level = 3;
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

}  // namespace volume_buffers_test
}  // namespace terrane
