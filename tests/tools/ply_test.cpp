// SPDX-License-Identifier: MIT
#include "output/ply.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <utility>

namespace terrane::tools {
namespace {

/// A frame over a fractal, of chunks of several levels.
struct Frame {
    std::shared_ptr<const HeightSource> source;
    std::optional<Triangulator> triangulator;
    TerrainMesh mesh;
};

Frame make_frame(std::size_t budget) {
    Frame frame;
    frame.source = FractalHeights::create({.seed = 3}).value();
    Pager pager = Pager::create(frame.source, {.worker_count = 0}).value();
    const View view =
        look_at(WorldPos(0.0, 0.0, 900.0), WorldPos(4000.0, 3000.0, 0.0), 1.0, 640, 480).value();
    const std::array cameras{CameraNeed{.view = view, .threshold_px = 8.0}};
    pager.update(cameras, {}, 0.0);
    frame.triangulator.emplace(
        Triangulator::create(*frame.source, {.triangle_budget = budget, .max_error_px = 1.0})
            .value());
    frame.mesh = frame.triangulator->update(pager.resident(), view);
    return frame;
}

TEST(Weld, MakesOneMeshOfAllChunksWithoutACrack) {
    const Frame frame = make_frame(20'000);
    ASSERT_GT(frame.mesh.chunks.size(), 4u);
    const IndexedMesh mesh = weld(frame.mesh);
    EXPECT_EQ(mesh.triangles.size(), frame.mesh.triangle_count);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    std::set<std::pair<double, double>> places;
    for (const WorldPos& p_world : mesh.vertices_world) {
        EXPECT_TRUE(places.emplace(p_world.x(), p_world.y()).second) << "a vertex came twice";
    }
    double area = 0.0;
    for (const std::array<std::uint32_t, 3>& triangle : mesh.triangles) {
        const WorldPos& a = mesh.vertices_world[triangle[0]];
        const Eigen::Vector3d b = mesh.vertices_world[triangle[1]] - a;
        const Eigen::Vector3d c = mesh.vertices_world[triangle[2]] - a;
        const double twice = b.x() * c.y() - b.y() * c.x();
        EXPECT_GT(twice, 0.0) << "clockwise from above";
        area += 0.5 * twice;
        for (std::size_t i = 0; i < 3; ++i) ++edges[{triangle[i], triangle[(i + 1) % 3]}];
    }
    const double side = 2.0 * frame.source->lattice().root_size();
    EXPECT_EQ(area, side * side);
    std::size_t border = 0;
    for (const auto& [edge, count] : edges) {
        EXPECT_EQ(count, 1);
        if (!edges.contains({edge.second, edge.first})) ++border;
    }
    // V - E + F = 1 for a disc
    const std::size_t edge_count = (edges.size() + border) / 2;
    EXPECT_EQ(mesh.vertices_world.size() + mesh.triangles.size(), edge_count + 1);
}

TEST(Weld, PutsVerticesOnTheSurface) {
    const Frame frame = make_frame(2'000);
    const IndexedMesh mesh = weld(frame.mesh);
    for (const WorldPos& p_world : mesh.vertices_world) {
        EXPECT_NEAR(p_world.z(), frame.source->height(p_world.x(), p_world.y()),
                    frame.source->lattice().quantum);
    }
}

TEST(Weld, GivesNothingForAFrameWithoutTriangles) {
    EXPECT_TRUE(weld(TerrainMesh{}).vertices_world.empty());
}

TEST(WritePly, WritesTheBytesThatTheHeaderPromises) {
    IndexedMesh mesh;
    mesh.vertices_world = {WorldPos(0.0, 0.0, 0.5), WorldPos(1.0, 0.0, 0.0),
                           WorldPos(0.0, 1e7, 0.1)};
    mesh.triangles = {{0, 1, 2}};
    const std::string path = testing::TempDir() + "terrane_ply_test.ply";
    ASSERT_TRUE(write_ply(mesh, path));
    std::ifstream file(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    const std::string end = "end_header\n";
    ASSERT_NE(bytes.find(end), std::string::npos);
    const std::string header = bytes.substr(0, bytes.find(end) + end.size());
    EXPECT_TRUE(header.starts_with("ply\nformat binary_little_endian 1.0\n"));
    EXPECT_NE(
        header.find("element vertex 3\nproperty double x\nproperty double y\nproperty double z\n"),
        std::string::npos);
    EXPECT_NE(header.find("element face 1\nproperty list uchar uint vertex_indices\n"),
              std::string::npos);
    ASSERT_EQ(bytes.size(), header.size() + 3 * 24 + 1 + 12);
    double last_z = 0.0;
    std::memcpy(&last_z, bytes.data() + header.size() + 64, sizeof last_z);
    EXPECT_EQ(last_z, 0.1);
    EXPECT_EQ(bytes[header.size() + 72], 3);
    EXPECT_EQ(bytes.substr(header.size() + 73), std::string("\0\0\0\0\1\0\0\0\2\0\0\0", 12));
}

TEST(WritePly, NamesThePathThatCannotBeWritten) {
    const Result<void> written = write_ply({}, "/no/such/folder/a.ply");
    ASSERT_FALSE(written);
    EXPECT_NE(written.error().message.find("/no/such/folder/a.ply"), std::string::npos);
}

}  // namespace
}  // namespace terrane::tools
