// SPDX-License-Identifier: MIT
#include "scene/mesh_objects.h"

#include "support/grounds.h"
#include "support/meshes.h"

#include <terrane/scene/culling.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>
#include <vector>

namespace terrane::tools {
namespace mesh_objects_test {

TriangleMesh make_block() {
    TriangleMesh block;
    for (int i = 0; i < 8; ++i)
        block.positions.emplace_back((i & 1) != 0 ? 3 : -1, (i & 2) != 0 ? 2 : 0, (i & 4) != 0);
    block.triangles.assign(test::kBoxTriangles.begin(), test::kBoxTriangles.end());
    block.normals.assign(8, Eigen::Vector3f::UnitZ());
    return block;
}

TriangleMesh with_any_normals(TriangleMesh mesh) {
    mesh.colours.clear();
    mesh.normals.assign(mesh.positions.size(), Eigen::Vector3f::UnitZ());
    return mesh;
}

Pose turned_pose(double angle, const WorldPos& position) {
    return {Eigen::AngleAxisd(angle, Eigen::Vector3d(1.0, 2.0, -1.0).normalized()).matrix(),
            position};
}

SceneObjects placed_objects() {
    SceneObjects objects;
    objects.meshes = {make_block(), with_any_normals(test::make_rock(4, 1))};
    objects.files = objects.names = {"block.obj", "rock.obj"};
    objects.objects = {{0, turned_pose(0.0, {0.0, 60.0, 30.0}), 2.0},
                       {1, turned_pose(0.7, {20.0, 40.0, 35.0}), 1.0},
                       {0, turned_pose(1.9, {0.0, -500.0, 0.0}), 0.25},  // behind the eye
                       {1, turned_pose(3.0, {9000.0, 20000.0, 500.0}), 4.0}};
    return objects;
}

MeshObjects make(const SceneObjects& objects, const View& view, double max_error_px,
                 Normals normals = Normals::without) {
    return MeshObjects::create(test::fractal_hills(), objects, view, max_error_px, normals).value();
}

double volume_of(const std::vector<WorldPos>& vertices,
                 const std::vector<TriangleMesh::Triangle>& triangles) {
    double sum = 0.0;
    for (const auto& [a, b, c] : triangles) {
        const Eigen::Vector3d u = vertices[b] - vertices[a], v = vertices[c] - vertices[a];
        sum += (vertices[a] - vertices[0]).dot(u.cross(v)) / 6.0;
    }
    return sum;
}

TEST(MeshObjects, PlacedOnesAreThereOnceEachWhereverTheyAre) {
    const SceneObjects objects = placed_objects();
    const View view;
    for (const Normals normals : {Normals::without, Normals::with}) {
        // so fine a target that every object has all of its triangles
        const MeshObjects made = make(objects, view, 1e-9, normals);
        IndexedMesh mesh;
        const MeshObjectCounts counts = made.append_to(mesh, 1e-9);
        EXPECT_EQ(counts.objects, 4u);
        EXPECT_EQ(counts.left_out, 0u);
        EXPECT_EQ(counts.triangles, mesh.triangles.size());
        std::size_t first = 0;
        for (const SceneObject& object : objects.objects) {
            const TriangleMesh& wanted = objects.meshes[object.mesh];
            std::vector<WorldPos> corners;
            for (const Eigen::Vector3d& p : wanted.positions)
                corners.push_back(object.world_from_object * Eigen::Vector3d(object.scale * p));
            ASSERT_LE(first + wanted.triangles.size(), mesh.triangles.size());
            const std::vector<TriangleMesh::Triangle> part(
                mesh.triangles.begin() + static_cast<std::ptrdiff_t>(first),
                mesh.triangles.begin() +
                    static_cast<std::ptrdiff_t>(first + wanted.triangles.size()));
            first += wanted.triangles.size();
            std::vector<Eigen::Vector3d> used;
            for (const auto& triangle : part) {
                for (const std::uint32_t vertex : triangle)
                    used.push_back(mesh.vertices_world[vertex]);
            }
            const Aabb box = bounding_box(used), wanted_box = bounding_box(corners);
            EXPECT_LT((box.low - wanted_box.low).norm() + (box.high - wanted_box.high).norm(),
                      1e-9);
            const double volume = volume_of(corners, wanted.triangles);
            EXPECT_NEAR(volume_of(mesh.vertices_world, part), volume, 1e-7 * volume);
            const test::EdgeCounts edges = test::count_edges(part);
            EXPECT_EQ(edges.border + edges.other, 0u);
        }
        EXPECT_EQ(first, mesh.triangles.size());
        ASSERT_EQ(mesh.normals.size(),
                  normals == Normals::with ? mesh.vertices_world.size() : std::size_t{0});
        if (normals == Normals::with) {
            EXPECT_LT((mesh.normals.front() - Eigen::Vector3f::UnitZ()).norm(), 1e-6f);
            const Eigen::Vector3d up = objects.objects[3].world_from_object.rotation.col(2);
            EXPECT_LT((mesh.normals.back().cast<double>() - up).norm(), 1e-6);
        }
    }
}

TEST(MeshObjects, LevelsAreWithinTheThresholdAsMeasured) {
    const TriangleMesh rock = with_any_normals(test::make_rock(4, 1));
    SceneObjects objects;
    objects.meshes = {rock};
    objects.files = objects.names = {"rock.obj"};
    std::size_t last = rock.triangles.size() + 1;
    for (const double distance : {3.0, 30.0, 100.0, 300.0, 3000.0}) {
        objects.objects = {{0, turned_pose(0.0, {0.0, distance, 0.0}), 1.0}};
        const View view;
        const MeshObjects made = make(objects, view, 1.0);
        IndexedMesh mesh;
        made.append_to(mesh, 1.0);
        EXPECT_LE(mesh.triangles.size(), last) << distance;
        last = mesh.triangles.size();
        EXPECT_GE(mesh.triangles.size(), made.least_triangles());
        std::vector<Eigen::Vector3d> vertices = rock.positions;
        test::MeshTriangles level;
        const auto shift = static_cast<std::uint32_t>(vertices.size());
        for (const WorldPos& p : mesh.vertices_world)
            vertices.push_back(p - WorldPos(0.0, distance, 0.0));
        for (const auto& [a, b, c] : mesh.triangles)
            level.push_back({a + shift, b + shift, c + shift});
        const double apart = test::measured_distance(vertices, rock.triangles, level, 1);
        // no point of the rock is much nearer to the eye than its vertices
        double nearest = distance;
        for (const Eigen::Vector3d& p : rock.positions)
            nearest = std::min(nearest, (p + WorldPos(0.0, distance, 0.0)).norm());
        EXPECT_LE(apart * view.pixels_per_radian() / nearest, 1.0) << distance;
    }
    EXPECT_LT(last, rock.triangles.size() / 50);
}

TEST(MeshObjects, HaveExactlyTheTrianglesOfTheGrantedDemands) {
    SceneObjects objects = placed_objects();
    objects.meshes.push_back(with_any_normals(test::make_tree(12)));
    objects.files.emplace_back("tree.obj");
    objects.names.emplace_back("tree.obj");
    objects.scatters = {{2, {.per_km2 = 2000.0, .seed = 1}}};
    View view;
    view.eye_world = {0.0, -300.0, 90.0};
    const MeshObjects made = make(objects, view, 1.0);
    std::size_t last = ~std::size_t{0};
    for (const double threshold_px : {1.0, 1.5, 2.0, 4.0, 9.0, 20.0, 60.0, 1e3, 1e9}) {
        std::size_t granted = 0;
        for (const TriangleDemand& demand : made.demands()) {
            if (demand.threshold_px > threshold_px) granted += demand.triangles;
        }
        IndexedMesh mesh;
        const MeshObjectCounts counts = made.append_to(mesh, threshold_px);
        EXPECT_EQ(counts.triangles, granted) << threshold_px;
        EXPECT_LE(counts.triangles, last);
        EXPECT_GE(counts.objects, 4u);
        last = counts.triangles;
    }
    EXPECT_EQ(last, made.least_triangles()) << "placed objects at their coarsest";
}

TEST(MeshObjects, ScatteredOnesAreThoseInViewOfMoreThanTheError) {
    SceneObjects objects;
    objects.meshes = {with_any_normals(test::make_tree(5))};
    objects.files = objects.names = {"tree.obj"};
    objects.scatters = {{0, {.per_km2 = 3000.0, .seed = 4}}};
    View view;
    view.eye_world = {100.0, -300.0, 90.0};
    view.forward = Eigen::Vector3d(0.3, 0.9, -0.2).normalized();
    view.up = view.right().cross(view.forward);
    const double max_error_px = 8.0;
    IndexedMesh mesh;
    const MeshObjectCounts counts = make(objects, view, max_error_px).append_to(mesh, 1e-3);
    EXPECT_EQ(counts.error_px, max_error_px);

    // all squares of the world, without ranges
    const auto source = test::fractal_hills();
    const Scatter scatter = Scatter::create(source, objects.scatters[0].settings).value();
    const Aabb box = bounding_box(objects.meshes[0].positions);
    const double size = (box.high - box.low).norm();
    const ViewVolume volume(view);
    const WorldRect& extent = source->extent();
    const ScatterSquare first = scatter.square_at(extent.west, extent.south);
    const ScatterSquare last = scatter.square_at(extent.east, extent.north);
    std::size_t wanted = 0, all = 0;
    for (std::int32_t y = first.y; y <= last.y; ++y) {
        for (std::int32_t x = first.x; x <= last.x; ++x) {
            const std::vector<ScatterPoint> points = scatter.objects_in({x, y}).value();
            for (const ScatterPoint& point : points) {
                const double radius = 0.5 * size * point.scale;
                const WorldPos middle =
                    pose_of(point) * Eigen::Vector3d(point.scale * 0.5 * (box.low + box.high));
                const double distance = std::max((middle - view.eye_world).norm() - radius, 1.0);
                const double px = size * point.scale * view.pixels_per_radian() / distance;
                ++all;
                if (px > max_error_px && volume.meets(BoundingSphere{middle, radius})) ++wanted;
            }
        }
    }
    EXPECT_EQ(counts.objects, wanted);
    EXPECT_GT(wanted, 100u);
    EXPECT_LT(wanted, all / 4);
}

TEST(MeshObjects, AreRefusedByTheFileOfTheirMesh) {
    SceneObjects objects = placed_objects();
    objects.scatters = {{1, {.per_km2 = 1e6}}};
    const Result<MeshObjects> many =
        MeshObjects::create(test::fractal_hills(), objects, View(), 1e-3, Normals::without);
    ASSERT_FALSE(many);
    EXPECT_EQ(many.error().message,
              "rock.obj: a scatter may have at most 2^22 objects in sight, got about 1.67772e+07");
}

}  // namespace mesh_objects_test
}  // namespace terrane::tools
