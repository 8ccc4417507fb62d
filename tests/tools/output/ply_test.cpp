// SPDX-License-Identifier: MIT
#include "scene/mesh_files.h"

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
namespace ply_test {

/// A frame of a fractal with chunks of several levels.
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

TEST(Weld, PutsVerticesWhereTheyAreDisplayed) {
    const Frame frame = make_frame(2'000);
    const Lattice& lattice = frame.source->lattice();
    std::map<std::pair<double, double>, double> shown;
    for (const MeshChunk& part : frame.mesh.chunks) {
        for (std::uint32_t i = 0; i < part.index_count; ++i) {
            const std::uint16_t sample = frame.mesh.indices[part.first_index + i];
            const Chunk& chunk = *part.chunk;
            shown[{lattice.x(chunk.corner.x + chunk.step * (sample % kChunkSamples)),
                   lattice.y(chunk.corner.y + chunk.step * (sample / kChunkSamples))}] =
                part.displayed_height(sample, lattice.quantum);
        }
    }
    const IndexedMesh mesh = weld(frame.mesh);
    ASSERT_EQ(mesh.vertices_world.size(), shown.size());
    for (const WorldPos& p_world : mesh.vertices_world) {
        EXPECT_EQ(p_world.z(), (shown[{p_world.x(), p_world.y()}]));
    }
}

// One chunk drawn in two halves, each with its own copy of the offsets.
struct TwoHalves {
    TwoHalves() {
        const std::shared_ptr<const HeightSource> source =
            FractalHeights::create({.seed = 3, .root_count_x = 1, .root_count_y = 1}).value();
        const ChunkKey root{source->lattice().first_root_x, source->lattice().first_root_y, 0};
        chunk = make_chunk(*source, root).value();
        mesh.resident = std::make_shared<const ResidentSet>(
            source->lattice(), source->extent(), std::vector<std::shared_ptr<const Chunk>>{chunk},
            1);
        const auto last = static_cast<std::uint16_t>(kChunkCells);
        const auto north_west = static_cast<std::uint16_t>(sample_index(0, kChunkCells));
        const auto north_east = static_cast<std::uint16_t>(sample_index(kChunkCells, kChunkCells));
        indices = {0, last, north_east, 0, north_east, north_west};
        offsets.assign(2, std::vector<float>(chunk->heights.size(), 0.0f));
        offsets[0][north_east] = offsets[1][north_east] = -3.25f;
        parts = {{chunk.get(), 0, 3, offsets[0].data()}, {chunk.get(), 3, 3, offsets[1].data()}};
        mesh.chunks = parts;
        mesh.indices = indices;
        mesh.triangle_count = 2;
    }

    std::shared_ptr<const Chunk> chunk;
    std::vector<std::uint16_t> indices;
    std::vector<std::vector<float>> offsets;
    std::vector<MeshChunk> parts;
    TerrainMesh mesh;
};

TEST(Weld, SharesAVertexThatMorphsInSeveralChunks) {
    const TwoHalves halves;
    const IndexedMesh mesh = weld(halves.mesh);
    ASSERT_EQ(mesh.vertices_world.size(), 4u);
    const std::size_t north_east = sample_index(kChunkCells, kChunkCells);
    const double height = halves.mesh.resident->lattice().quantum *
                          static_cast<double>(halves.chunk->heights[north_east]);
    EXPECT_EQ(mesh.vertices_world[2].z(), height - 3.25);
}

TEST(Weld, ShowsACrackWhereChunksDisagreeAboutAnOffset) {
    TwoHalves halves;
    halves.offsets[1][sample_index(kChunkCells, kChunkCells)] = -3.5f;
    const IndexedMesh mesh = weld(halves.mesh);
    ASSERT_EQ(mesh.vertices_world.size(), 5u);
    EXPECT_NE(mesh.triangles[0][2], mesh.triangles[1][1]);
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

}  // namespace ply_test
}  // namespace terrane::tools
