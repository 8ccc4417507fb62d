// SPDX-License-Identifier: MIT
// Surfaces and solids that mesh files describe: polygons, and the same solid in every format.
#include "scene/mesh_files.h"
#include "support/random.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace terrane::tools {
namespace mesh_shapes_test {

using Points = std::vector<Eigen::Vector3d>;

double area_of(const TriangleMesh& mesh) {
    double area = 0.0;
    for (const auto& [a, b, c] : mesh.triangles) {
        const Eigen::Vector3d& p = mesh.positions[a];
        area += 0.5 * (mesh.positions[b] - p).cross(mesh.positions[c] - p).norm();
    }
    return area;
}

double volume_of(const TriangleMesh& mesh) {
    double volume = 0.0;
    for (const auto& [a, b, c] : mesh.triangles) {
        volume += mesh.positions[a].dot(mesh.positions[b].cross(mesh.positions[c])) / 6.0;
    }
    return volume;
}

FileMesh polygon_mesh(const Points& points) {
    FileMesh mesh;
    mesh.positions = points;
    std::vector<std::int64_t> corners;
    for (std::size_t i = 0; i < points.size(); ++i) corners.push_back(static_cast<std::int64_t>(i));
    std::vector<TriangleMesh::Triangle> triangles;
    EXPECT_TRUE(split_polygon(corners, mesh, triangles));
    mesh.triangles = triangles;
    return mesh;
}

/// The area that a polygon of the plane z = 0 encloses.
double shoelace(const Points& points) {
    double doubled = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i)
        doubled += points[i].cross(points[(i + 1) % points.size()]).z();
    return 0.5 * doubled;
}

/// Each side of the polygon must have one triangle, every other edge two, in opposite directions.
void expect_that_sides_stay(const FileMesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& t : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
    }
    const auto count = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::uint32_t i = 0; i < count; ++i) {
        const auto side = edges.find({i, (i + 1) % count});
        ASSERT_TRUE(side != edges.end()) << i;
        if (--side->second == 0) edges.erase(side);
    }
    for (const auto& [edge, times] : edges) {
        const auto other = edges.find({edge.second, edge.first});
        ASSERT_TRUE(other != edges.end() && other->second == times);
    }
}

TEST(Polygons, ConcaveOnesAreCoveredOnceInAnyPlaneAndFromAnyCorner) {
    const std::vector<Points> polygons = {
        // an L, also with corners on its straight sides
        {{20, 0, 0}, {20, 6, 0}, {6, 6, 0}, {6, 20, 0}, {0, 20, 0}, {0, 0, 0}},
        {{0, 0, 0},
         {10, 0, 0},
         {20, 0, 0},
         {20, 6, 0},
         {6, 6, 0},
         {6, 13, 0},
         {6, 20, 0},
         {0, 20, 0}},
        // a comb
        {{0, 0, 0},
         {7, 0, 0},
         {7, 5, 0},
         {6, 1, 0},
         {5, 5, 0},
         {4, 1, 0},
         {3, 5, 0},
         {2, 1, 0},
         {1, 5, 0}},
        // an arrow whose notch lies on the diagonal
        {{0, 0, 0}, {4, 0, 0}, {2, 2, 0}, {0, 4, 0}},
        {{0, 0, 0}, {4, 0, 0}, {1, 1, 0}, {0, 4, 0}},
        // a square with a square hole, joined by a bridge
        {{0, 0, 0},
         {9, 0, 0},
         {9, 9, 0},
         {0, 9, 0},
         {0, 0, 0},
         {3, 3, 0},
         {3, 6, 0},
         {6, 6, 0},
         {6, 3, 0},
         {3, 3, 0}},
        // two squares that touch at a corner, a corner twice, a spike
        {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {4, 2, 0}, {4, 4, 0}, {2, 4, 0}, {2, 2, 0}, {0, 2, 0}},
        {{0, 0, 0}, {2, 0, 0}, {2, 0, 0}, {1, 1, 0}, {2, 3, 0}, {0, 3, 0}},
        {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {5, 1, 0}, {2, 1, 0}, {1, 2, 0}, {2, 3, 0}, {0, 3, 0}},
    };
    test::Random random(7);
    int compared = 0;
    for (const Points& polygon : polygons) {
        for (std::size_t turn = 0; turn < polygon.size(); ++turn) {
            for (int plane = 0; plane < 5; ++plane) {
                Points points = polygon;
                std::ranges::rotate(points, points.begin() + static_cast<std::ptrdiff_t>(turn));
                const Eigen::Matrix3d rotation =
                    plane == 0 ? Eigen::Matrix3d::Identity() : random.rotation();
                for (Eigen::Vector3d& p : points) p = rotation * p;
                const FileMesh mesh = polygon_mesh(points);
                SCOPED_TRACE(testing::Message() << "polygon " << &polygon - polygons.data()
                                                << ", corner " << turn << ", plane " << plane);
                ASSERT_EQ(mesh.triangles.size(), points.size() - 2);
                EXPECT_NEAR(area_of(mesh), shoelace(polygon), 1e-9);
                // rounding may turn a bridge of no width into a crossing
                if (plane == 0) {
                    EXPECT_EQ(mesh.left_out.crossing_faces, 0u);
                }
                expect_that_sides_stay(mesh);
                ++compared;
            }
        }
    }
    EXPECT_GT(compared, 300);
}

TEST(Polygons, RandomStarsAndCombsHaveTheAreaThatTheyEnclose) {
    for (int seed = 0; seed < 300; ++seed) {
        test::Random random(static_cast<std::uint64_t>(seed));
        Points points;
        const int count = 4 + random.below(60);
        for (int i = 0; i < count; ++i) {
            const double angle = 2.0 * std::numbers::pi * i / count,
                         radius = random.between(0.05, 1.0);
            points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0.0);
        }
        FileMesh mesh = polygon_mesh(points);
        EXPECT_NEAR(area_of(mesh), shoelace(points), 1e-12) << "seed " << seed;
        EXPECT_EQ(mesh.left_out.crossing_faces, 0u) << "seed " << seed;
        // out of its plane: the same triangles
        const auto triangles = mesh.triangles;
        for (Eigen::Vector3d& p : points) p.z() = random.between(-0.01, 0.01);
        EXPECT_EQ(polygon_mesh(points).triangles, triangles) << "seed " << seed;
    }
}

TEST(Polygons, ThoseThatCrossThemselvesAreCounted) {
    Points star;
    for (const int i : {0, 2, 4, 1, 3}) {
        const double angle = 2.0 * std::numbers::pi * i / 5.0;
        star.emplace_back(std::cos(angle), std::sin(angle), 0.0);
    }
    for (const Points& points : {star, Points{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}},
                                 Points{{0, 0, 0}, {3, 3, 0}, {3, 0, 0}, {0, 1, 0}}}) {
        const FileMesh mesh = polygon_mesh(points);
        EXPECT_EQ(mesh.left_out.crossing_faces, 1u);
        EXPECT_EQ(mesh.triangles.size(), points.size() - 2);
    }
    // a line is no crossing, and has no area
    const FileMesh line = polygon_mesh({{0, 0, 0}, {1, 0, 0}, {3, 0, 0}, {2, 0, 0}});
    EXPECT_EQ(line.left_out.crossing_faces, 0u);
    EXPECT_EQ(area_of(line), 0.0);
}

TEST(Polygons, OfManyCornersAreSplitOrRefused) {
    Points circle;
    for (int i = 0; i < 20000; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / 20000.0;
        circle.emplace_back(std::cos(angle), std::sin(angle), 0.0);
    }
    EXPECT_NEAR(area_of(polygon_mesh(circle)), std::numbers::pi, 1e-6);
    circle[7] *= 0.5;
    FileMesh mesh;
    mesh.positions = circle;
    std::vector<std::int64_t> corners(circle.size());
    for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = static_cast<std::int64_t>(i);
    std::vector<TriangleMesh::Triangle> triangles;
    const Result<void> split = split_polygon(corners, mesh, triangles);
    ASSERT_FALSE(split);
    EXPECT_EQ(split.error().message, "a face that is not convex has 20000 corners, more than 8192");
}

/// A prism over an L, with caps of six corners: area 2 x 204 + 80 x 5 = 808, volume 204 x 5 = 1020.
const Points kLShape = {{20, 0, 0}, {20, 6, 0}, {6, 6, 0}, {6, 20, 0}, {0, 20, 0}, {0, 0, 0},
                        {20, 0, 5}, {20, 6, 5}, {6, 6, 5}, {6, 20, 5}, {0, 20, 5}, {0, 0, 5}};
const std::vector<std::vector<int>> kLFaces = {
    {6, 7, 8, 9, 10, 11}, {5, 4, 3, 2, 1, 0}, {0, 1, 7, 6},   {1, 2, 8, 7},
    {2, 3, 9, 8},         {3, 4, 10, 9},      {4, 5, 11, 10}, {5, 0, 6, 11}};

class MeshFormats : public testing::Test {
protected:
    void SetUp() override {
        std::random_device entropy;
        folder_ = std::filesystem::temp_directory_path() /
                  ("terrane_shapes_" + std::to_string(entropy()));
        std::filesystem::create_directory(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    Result<TriangleMesh> read(const std::string& name, const std::string& text) {
        const std::string path = (folder_ / name).string();
        std::ofstream(path, std::ios::binary) << text;
        testing::internal::CaptureStderr();
        Result<TriangleMesh> mesh = read_mesh(path);
        notes_ = testing::internal::GetCapturedStderr();
        return mesh;
    }

    std::filesystem::path folder_;
    std::string notes_;
};

TEST_F(MeshFormats, GiveTheSameAreaAndVolume) {
    std::string obj,
        ply =
            "ply\nformat ascii 1.0\nelement vertex 12\nproperty double x\nproperty double y\n"
            "property double z\nelement face 8\nproperty list uchar int "
            "vertex_indices\nend_header\n";
    for (const Eigen::Vector3d& p : kLShape) {
        obj += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
        ply += fmt::format("{} {} {}\n", p.x(), p.y(), p.z());
    }
    for (const std::vector<int>& face : kLFaces) {
        obj += "f";
        ply += fmt::format("{}", face.size());
        for (std::size_t i = 0; i < face.size(); ++i) {
            if (i == 3) obj += " \\\r\n";  // a face may go on in the next line
            obj += fmt::format(" {}", face[i] - 12);
            ply += fmt::format(" {}", face[i]);
        }
        obj += "\n";
        ply += "\n";
    }
    const Result<TriangleMesh> solid = read("a.obj", obj);
    ASSERT_TRUE(solid) << solid.error().message;
    IndexedMesh written;
    written.vertices_world.assign(kLShape.begin(), kLShape.end());
    written.triangles = solid->triangles;
    const std::string glb = (folder_ / "b.glb").string();
    ASSERT_TRUE(write_mesh(written, MeshFormat::glb, glb));
    std::string stl = "solid L\n";
    for (const auto& triangle : solid->triangles) {
        stl += "facet normal 0 0 0\nouter loop\n";
        for (const std::uint32_t corner : triangle) {
            const Eigen::Vector3d& p = kLShape[corner];
            stl += fmt::format("vertex {} {} {}\n", p.x(), p.y(), p.z());
        }
        stl += "endloop\nendfacet\n";
    }
    for (const Result<TriangleMesh>& mesh :
         {solid, read("a.ply", ply), read_mesh(glb), read("a.stl", stl + "endsolid L\n")}) {
        ASSERT_TRUE(mesh) << mesh.error().message;
        EXPECT_NEAR(area_of(*mesh), 808.0, 808e-6);
        EXPECT_NEAR(volume_of(*mesh), 1020.0, 1020e-6);
        EXPECT_EQ(mesh->triangles.size(), 20u);
    }
    EXPECT_EQ(notes_, "");
}

TEST_F(MeshFormats, CountWhatTheyLeaveOut) {
    const std::string points = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 0\n";
    ASSERT_TRUE(read("a.obj", points + "f 1 2 3\nf 1 2 5\nf 2 3 2\nl 1 2\np 1\nf 1 3 2 4\n"));
    EXPECT_EQ(notes_,
              fmt::format("terrane: mesh '{}': 2 triangles without area dropped; 1 self-crossing "
                          "face split into triangles that overlap; 2 elements left out: points, "
                          "lines or curves\n",
                          (folder_ / "a.obj").string()));
    ASSERT_TRUE(read("a.obj", points + "f 1 2 3\n"));
    EXPECT_EQ(notes_, "");
}

}  // namespace mesh_shapes_test
}  // namespace terrane::tools
