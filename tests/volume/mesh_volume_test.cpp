// SPDX-License-Identifier: MIT
#include "support/random.h"
#include "volume/flat_world.h"
#include "volume/joined_mesh.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <map>

namespace terrane {
namespace mesh_volume_test {

using namespace test;

/// A sphere of radius 1: an octahedron, divided.
VolumeMesh ball(int divisions, double radius) {
    VolumeMesh mesh;
    mesh.points_shape = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int i = 0; i < divisions; ++i) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [found, is_new] = middles.try_emplace(
                std::minmax(a, b), static_cast<std::uint32_t>(mesh.points_shape.size()));
            if (is_new)
                mesh.points_shape.push_back(
                    (mesh.points_shape[a] + mesh.points_shape[b]).normalized());
            return found->second;
        };
        std::vector<std::array<std::uint32_t, 3>> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        mesh.triangles = finer;
    }
    for (Eigen::Vector3d& p : mesh.points_shape) p *= radius;
    return mesh;
}

TEST(MeshVolume, IsWatertightAndNearItsMeshWhereverItIsTurned) {
    const VolumeWorld world = flat_world();
    Random random(5);
    for (const double z : {20.0, 38.0}) {
        auto operation = place(ball(5, 15.0), {63.3, 64.4, z});
        operation.world_from_shape.rotation = random.rotation();
        const std::vector<VolumeOperation> list = {operation};
        const Volumes volumes = Volumes::create(world.lattice, list).value();
        const auto contours = contour_all(world, volumes);
        const JoinedMesh mesh = join(world, volumes, contours);
        EXPECT_EQ(find_leak(world, mesh), "");
        double worst = 0.0;
        for (const VolumeContour& contour : contours) {
            for (std::size_t i = 0; i < contour.keys.size(); ++i) {
                if (contour.keys[i].is_node()) continue;
                const Eigen::Vector3d p =
                    contour.positions_world[i] - operation.world_from_shape.translation;
                worst = std::max(worst, std::abs(p.norm() - 15.0));
            }
        }
        EXPECT_GT(worst, 0.0);
        EXPECT_LT(worst, 0.06);
    }
}

TEST(MeshVolume, HasTheSameBitsWithAnyNumberOfOpenVdbsThreads) {
    std::vector<double> first;
    for (const std::size_t threads : {1u, 3u, 8u}) {
        const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
        const auto placed =
            PlacedVolume::create(flat_world().lattice, 0, place(ball(4, 20.0), {63.3, 64.4, 30.0}))
                .value();
        std::vector<double> values;
        Random random(9);
        for (int i = 0; i < 20000; ++i) {
            values.push_back(
                placed.signed_distance(Eigen::Vector3d(63.3, 64.4, 30.0) +
                                       random.direction() * random.between(14.0, 26.0)));
        }
        if (first.empty()) first = values;
        EXPECT_EQ(values, first) << threads;
    }
}

TEST(MeshVolume, RefusesMeshesThatBoundNoSolid) {
    const Eigen::Vector3d at(64.0, 64.0, 30.0);
    EXPECT_EQ(refusal(place(ball(3, 10.0), at)), "");
    VolumeMesh open = ball(2, 10.0);
    open.triangles.pop_back();
    EXPECT_NE(refusal(place(open, at)).find("the mesh is not closed: its edge from point"),
              std::string::npos);
    VolumeMesh inside_out = ball(2, 10.0);
    for (auto& t : inside_out.triangles) std::swap(t[0], t[1]);
    EXPECT_NE(refusal(place(inside_out, at)).find("the mesh is inside out"), std::string::npos);
    VolumeMesh crossing = ball(2, 10.0);
    const VolumeMesh other = ball(2, 10.0);
    const auto offset = static_cast<std::uint32_t>(crossing.points_shape.size());
    for (const Eigen::Vector3d& p : other.points_shape)
        crossing.points_shape.push_back(p + Eigen::Vector3d(7.1, 1.3, 0.4));
    for (const auto& t : other.triangles)
        crossing.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
    EXPECT_NE(refusal(place(crossing, at)).find("the mesh crosses itself"), std::string::npos);
    EXPECT_EQ(refusal(place(VolumeMesh{}, at)), "a mesh must have 1 to 4194304 triangles, got 0");
    VolumeMesh missing = ball(0, 10.0);
    missing.triangles[3][1] = 6;
    EXPECT_EQ(refusal(place(missing, at)), "triangle 3 of a mesh names point 6 of 6");
    EXPECT_NE(refusal(place(ball(3, 0.4), at)).find("less than its voxel"), std::string::npos);
    EXPECT_NE(
        refusal(place(ball(3, 30.0), at), {.memory_bytes = 10'000}).find("more than memory_bytes"),
        std::string::npos);
    // A needle has little area, and its level set is around its edges.
    const VolumeMesh needle{{{-50, 0, 0}, {50, 0, 0}, {0, 1.2, 0}, {0, 0, 1.2}},
                            {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
    EXPECT_EQ(refusal(place(needle, at)), "");
    EXPECT_NE(refusal(place(needle, at), {.memory_bytes = 100'000}).find("more than memory_bytes"),
              std::string::npos);
}

}  // namespace mesh_volume_test
}  // namespace terrane
