// SPDX-License-Identifier: MIT
#include "scene/mesh_files.h"

#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>

namespace terrane::tools {
namespace mesh_reader_test {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

constexpr const char* kAscii =
    "ply\r\nformat ascii 1.0\r\ncomment a square\r\nelement vertex 4\nproperty float x\nproperty "
    "uchar red\n"
    "property double y\nproperty double z\nelement edge 1\nproperty int a\nproperty list uchar int "
    "b\nelement face 1\nproperty uchar material\nproperty list uchar int vertex_index\nend_header\n"
    "0 9 0 1\n1 9 0 1\n1.5 9 +1 1\n0 9 1 1e0\n7 2 3 4\n5 4 0 1 2 3\n";

TEST(ReadMesh, TakesTextsWithOtherElementsAndPolygons) {
    const Result<TriangleMesh> mesh = parse_ply(kAscii);
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->positions.size(), 4u);
    EXPECT_EQ(mesh->positions[2], Eigen::Vector3d(1.5, 1.0, 1.0));
    EXPECT_EQ(mesh->triangles, (Triangles{{0, 1, 2}, {0, 2, 3}}));
}

/// A number of a binary file.
template <class Number>
void append(std::string& bytes, Number value, bool is_big) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    if (is_big == (std::endian::native == std::endian::little)) std::reverse(raw, raw + sizeof raw);
    bytes.append(raw, sizeof raw);
}

std::string binary_ply(bool is_big) {
    std::string bytes = std::string("ply\nformat binary_") + (is_big ? "big" : "little") +
                        "_endian 1.0\nelement vertex 3\nproperty float x\nproperty double y\n"
                        "property int16 z\nelement face 1\nproperty list uint8 uint16 "
                        "vertex_indices\nend_header\n";
    for (int i = 0; i < 3; ++i) {
        append(bytes, 0.5f + static_cast<float>(i), is_big);
        append(bytes, 0.1 * i * i, is_big);
        append(bytes, static_cast<std::int16_t>(-i), is_big);
    }
    append(bytes, std::uint8_t{3}, is_big);
    for (const std::uint16_t i : {std::uint16_t{2}, std::uint16_t{1}, std::uint16_t{0}})
        append(bytes, i, is_big);
    return bytes;
}

TEST(ReadMesh, TakesBothOrdersOfBytes) {
    for (const bool is_big : {false, true}) {
        const Result<TriangleMesh> mesh = parse_ply(binary_ply(is_big));
        ASSERT_TRUE(mesh) << mesh.error().message;
        ASSERT_EQ(mesh->positions.size(), 3u);
        EXPECT_EQ(mesh->positions[2], Eigen::Vector3d(2.5, 0.1 * 4, -2.0));
        EXPECT_EQ(mesh->triangles, (Triangles{{2, 1, 0}}));
    }
}

TEST(ReadMesh, RefusesEveryTruncatedFile) {
    for (const std::string& whole : {binary_ply(false), std::string(kAscii)}) {
        ASSERT_TRUE(parse_ply(whole));
        // without the end of the last line the text is still whole
        for (std::size_t size = 0; size + 1 < whole.size(); ++size) {
            const Result<TriangleMesh> mesh = parse_ply(std::string_view(whole).substr(0, size));
            ASSERT_FALSE(mesh) << size;
            EXPECT_EQ(mesh.error().code, ErrorCode::bad_data);
        }
    }
}

TEST(ReadMesh, SurvivesRandomBytes) {
    int taken = 0;
    for (int seed = 0; seed < 3000; ++seed) {
        test::Random random(static_cast<std::uint64_t>(seed));
        std::string bytes = seed % 2 == 0 ? binary_ply(false) : std::string(kAscii);
        for (int i = 0; i < 4; ++i) {
            const auto at = static_cast<std::size_t>(
                random.between(0.0, static_cast<double>(bytes.size()) - 0.5));
            bytes[at] = static_cast<char>(random.between(0.0, 255.9));
        }
        for (const auto& mesh : {parse_ply(bytes), parse_obj(bytes)}) {
            if (!mesh) continue;
            ++taken;
            for (const auto& triangle : mesh->triangles) {
                for (const std::uint32_t corner : triangle) {
                    ASSERT_LT(corner, mesh->positions.size()) << "seed " << seed;
                }
            }
        }
    }
    EXPECT_GT(taken, 100);
}

TEST(ReadMesh, KeepsAVertexForEachCombinationOfAttributes) {
    const std::string text =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 9 9 9\nvt 0 0\nvt 0.5 1\nvn 0 0 1\nvn 0 0 -1\n"
        "f 1/1/1 2/1/1 3/2/1 4/2/-2\nf 1/1/2 3/2/2 2/1/2\n";
    const Result<TriangleMesh> mesh = parse_obj_with_attributes(text);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions.size(), 7u);
    EXPECT_EQ(mesh->triangles, (Triangles{{0, 1, 2}, {0, 2, 3}, {4, 5, 6}}));
    EXPECT_EQ(mesh->normals[3], Eigen::Vector3f(0, 0, 1));
    EXPECT_EQ(mesh->normals[6], Eigen::Vector3f(0, 0, -1));
    EXPECT_EQ(mesh->texture_coordinates[2], Eigen::Vector2f(0.5f, 1.0f));
    // One corner without a normal: no vertex has one.
    EXPECT_TRUE(parse_obj_with_attributes(text + "f 1/1 2/1 3/1\n")->normals.empty());
    EXPECT_EQ(
        parse_obj_with_attributes(text + "f 1/3/1 2/1/1 3/1/1\n").error().message,
        "line 12: ' 1/3/1 2/1/1 3/1/1' names a texture coordinate or normal that is not there");
    EXPECT_EQ(parse_obj_with_attributes("vt a\n" + text).error().message,
              "line 1: vt must have 2 numbers");
    EXPECT_EQ(parse_obj_with_attributes("vn 1 0\n" + text).error().message,
              "line 1: vn must have 3 numbers");
    int taken = 0;
    for (int seed = 0; seed < 2000; ++seed) {
        test::Random random(static_cast<std::uint64_t>(seed));
        std::string bytes = text;
        for (int i = 0; i < 3; ++i)
            bytes[static_cast<std::size_t>(random.below(static_cast<int>(bytes.size())))] =
                "0123456789-/ vtnf\n."[random.below(20)];
        const Result<TriangleMesh> changed = parse_obj_with_attributes(bytes);
        if (!changed) continue;
        ++taken;
        ASSERT_TRUE(changed->normals.empty() ||
                    changed->normals.size() == changed->positions.size());
        for (const auto& triangle : changed->triangles) {
            for (const std::uint32_t corner : triangle)
                ASSERT_LT(corner, changed->positions.size());
        }
    }
    EXPECT_GT(taken, 50);
}

TEST(ReadMesh, NamesWhatIsWrong) {
    const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
    const std::string face = "element face 1\nproperty list uchar int vertex_index\nend_header\n";
    for (const auto& [text, words] : std::vector<std::pair<std::string, std::string>>{
             {"element vertex 1\nproperty float x\nproperty float y\nend_header\n", "property z"},
             {"element vertex 99999999999\n" + xyz + "end_header\n",
              "99999999999 elements 'vertex'"},
             {"element vertex -1\nend_header\n", "'element vertex -1'"},
             {"format binary_middle_endian 1.0\n", "'format binary_middle_endian 1.0'"},
             {"element vertex 1\nproperty half x\nend_header\n", "'property half x'"},
             {face, "faces come before its vertices"},
             {std::string("element vertex 1\n").append(xyz).append(face).append("1 2 3\n3 0 0 1\n"),
              "point 1 of 1"}}) {
        const Result<TriangleMesh> mesh = parse_ply("ply\nformat ascii 1.0\n" + text);
        ASSERT_FALSE(mesh) << text;
        EXPECT_NE(mesh.error().message.find(words), std::string::npos) << mesh.error().message;
    }
    for (const auto& [text, words] : std::vector<std::pair<std::string, std::string>>{
             {"# a\nv 1 2\n", "line 2: a point needs 3 numbers"},
             {"v 1 2 3\nf 1 1\n", "line 2: a face has 2 corners"},
             {"v 1 2 3\nf 1 1 0\n", "line 2: '0'"},
             {"v 1 2 3\nf 1 1 -2\n", "line 2: a face names point -1 of 1"},
             {"v 1 \\\n2 3\n# C:\\\nv 1 2\n", "line 4: a point needs 3 numbers"}}) {
        const Result<TriangleMesh> mesh = parse_obj(text);
        ASSERT_FALSE(mesh) << text;
        EXPECT_NE(mesh.error().message.find(words), std::string::npos) << mesh.error().message;
    }
}

class MeshFiles : public testing::Test {
protected:
    void SetUp() override {
        std::random_device entropy;
        folder_ =
            std::filesystem::temp_directory_path() / ("terrane_mesh_" + std::to_string(entropy()));
        std::filesystem::create_directory(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }
    std::string write(const std::string& name, const std::string& text) const {
        std::ofstream((folder_ / name), std::ios::binary) << text;
        return (folder_ / name).string();
    }
    std::filesystem::path folder_;
};

TEST_F(MeshFiles, WeldEqualPointsAndDropWhatIsNoTriangle) {
    const Result<TriangleMesh> mesh =
        read_mesh(write("a.OBJ",
                        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -0 0 0\nv 1 0 0\nvt 1 1\n"
                        "f -2/1/1 5//1 3/1\nf 1 4 2\n"));
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions.size(), 5u);
    EXPECT_EQ(mesh->triangles, (Triangles{{0, 1, 2}}));
    const Result<TriangleMesh> none = read_mesh(write("b.obj", "v 0 0 0\n"));
    ASSERT_FALSE(none);
    EXPECT_NE(none.error().message.find("b.obj' has no triangle"), std::string::npos);
}

TEST_F(MeshFiles, AreReadAsTheyWereWritten) {
    IndexedMesh made;
    made.vertices_world = {{0.1, 0.2, 0.3}, {1.0 / 3.0, 0.0, 0.0}, {0.0, -7.5e-3, 1e5}};
    made.triangles = {{0, 1, 2}, {2, 1, 0}};
    const std::string path = (folder_ / "a.ply").string();
    ASSERT_TRUE(write_ply(made, path));
    const Result<TriangleMesh> mesh = read_mesh(path);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions, made.vertices_world);
    EXPECT_EQ(mesh->triangles, made.triangles);
}

TEST_F(MeshFiles, KeepTheColoursOfVerticesWhereAllHaveOne) {
    IndexedMesh made;
    made.vertices_world = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    made.triangles = {{0, 1, 2}};
    made.colours = {{0, 128, 255, 255}, {1, 2, 3, 255}, {254, 77, 10, 255}};
    for (const auto& [format, name] :
         {std::pair(MeshFormat::ply, "a.ply"), std::pair(MeshFormat::obj, "a.obj")}) {
        const std::string path = (folder_ / name).string();
        ASSERT_TRUE(write_mesh(made, format, path));
        const Result<TriangleMesh> mesh = read_mesh(path);
        ASSERT_TRUE(mesh) << mesh.error().message;
        EXPECT_EQ(mesh->colours, made.colours) << name;
        EXPECT_EQ(mesh->positions, made.vertices_world);
    }
    const Result<TriangleMesh> some =
        read_mesh(write("b.obj", "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 0 1 0\nf 1 2 3\n"));
    ASSERT_TRUE(some) << some.error().message;
    EXPECT_TRUE(some->colours.empty());
}

}  // namespace mesh_reader_test

namespace weld_test {

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

}  // namespace weld_test

namespace {

const std::string kStlText =
    "solid s\n"
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 2 3\nendloop\nendfacet\n"
    "facet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 1 2 3\nvertex 0 2 3\nendloop\nendfacet\n"
    "endsolid s\n";

std::string glb_of(const IndexedMesh& mesh) {
    const std::string path =
        (std::filesystem::path(testing::TempDir()) / "terrane_gltf_reader.glb").string();
    EXPECT_TRUE(write_mesh(mesh, MeshFormat::glb, path));
    std::ifstream file(path, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    std::filesystem::remove(path);
    return bytes;
}

std::string glb_of_two_triangles() {
    IndexedMesh mesh;
    mesh.vertices_world = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 2.0, 3.0}, {1.0, 2.0, 3.0}};
    mesh.triangles = {{0, 1, 2}, {1, 3, 2}};
    return glb_of(mesh);
}

TEST(GltfReader, ReadsAFrameThatWasWrittenAsGlb) {
    const weld_test::Frame shown = weld_test::make_frame(5000);
    const IndexedMesh frame = weld(shown.mesh, Normals::with);
    ASSERT_GT(frame.triangles.size(), 1000u);
    ASSERT_EQ(frame.normals.size(), frame.vertices_world.size());
    const Result<TriangleMesh> mesh = parse_gltf(glb_of(frame), "");
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->triangles, frame.triangles);
    // the world is 131 km wide: rounding of float
    for (std::size_t i = 0; i < frame.vertices_world.size(); ++i) {
        ASSERT_LT((mesh->positions[i] - frame.vertices_world[i]).norm(), 0.008);
        ASSERT_LT((mesh->normals[i] - frame.normals[i]).norm(), 1e-6f);
    }
}

TEST(StlReader, KeepsItsAxes) {
    const Result<TriangleMesh> mesh = parse_stl(kStlText);
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->triangles.size(), 2u);
    EXPECT_EQ(mesh->positions[mesh->triangles[0][2]], Eigen::Vector3d(0.0, 2.0, 3.0));
}

TEST(StlReader, TakesSeveralSolidsAndKeywordsInAnyCase) {
    std::string text = kStlText + "\nSOLID two words\nFacet NORMAL nan nan nan\nOUTER LOOP\n";
    text += "VERTEX 5 0 0\nVERTEX 6 0 0\nVERTEX 5 1e0 +1\nENDLOOP\nENDFACET\nENDSOLID two words";
    const Result<TriangleMesh> mesh = parse_stl(text);
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->triangles.size(), 3u);
    EXPECT_EQ(mesh->positions[mesh->triangles[2][2]], Eigen::Vector3d(5.0, 1.0, 1.0));
}

std::string binary_stl(const std::vector<std::array<float, 12>>& triangles) {
    std::string bytes(80, ' ');
    bytes.replace(0, 5, "solid");  // as many programs write
    mesh_reader_test::append(bytes, static_cast<std::uint32_t>(triangles.size()), false);
    for (const std::array<float, 12>& triangle : triangles) {
        for (const float value : triangle) mesh_reader_test::append(bytes, value, false);
        bytes.append(2, '\0');
    }
    return bytes;
}

TEST(StlReader, TellsABinaryFileFromATextByItsSize) {
    const std::string bytes = binary_stl({{0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.25f}});
    const Result<TriangleMesh> mesh = parse_stl(bytes);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->triangles, (mesh_reader_test::Triangles{{0, 1, 2}}));
    EXPECT_EQ(mesh->positions[2], Eigen::Vector3d(0.0, 1.0, 0.25));
    std::string more = bytes;
    more[80] = 2;
    EXPECT_EQ(parse_stl(more).error().message,
              "it has 134 bytes; a binary STL file of 2 triangles has 184");
}

TEST(StlReader, RefusesEveryTruncatedFile) {
    const std::string binary = binary_stl({{0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.25f}});
    for (const std::string& whole : {binary, kStlText}) {
        ASSERT_TRUE(parse_stl(whole));
        // a text is whole without its name at the end
        const std::size_t name = whole == binary ? 0 : std::string("s\n").size() + 1;
        for (std::size_t size = 1; size + name < whole.size(); ++size) {
            const Result<TriangleMesh> mesh = parse_stl(std::string_view(whole).substr(0, size));
            ASSERT_FALSE(mesh) << size;
            EXPECT_EQ(mesh.error().code, ErrorCode::bad_data);
        }
    }
    EXPECT_EQ(parse_stl(kStlText.substr(0, 150)).error().message,
              "it ends early, or is wrong, in facet 1, counted from 0");
}

TEST(MeshReaders, RefuseForeignAndEmptyBytes) {
    for (const char* bytes : {"", "v 0 0 0\n", "{}", "glTF", "[]", "{\"asset\":{}}"}) {
        EXPECT_FALSE(parse_gltf(bytes, "")) << bytes;
        EXPECT_FALSE(parse_stl(bytes)) << bytes;
    }
}

TEST(MeshReaders, NeverThrowForChangedAndTruncatedFiles) {
    constexpr unsigned kSeed = 20240611;
    std::mt19937 random(kSeed);
    const std::string glb = glb_of_two_triangles();
    for (const std::string& whole : {glb, kStlText}) {
        int taken = 0;
        for (int round = 0; round < 2000; ++round) {
            SCOPED_TRACE(testing::Message() << "round " << round << " seed " << kSeed);
            std::string bytes = whole;
            if (round % 4 == 0) bytes.resize(random() % bytes.size());
            for (unsigned flips = 1 + random() % 4; !bytes.empty() && flips > 0; --flips) {
                bytes[random() % bytes.size()] = static_cast<char>(random() & 0xffu);
            }
            const Result<TriangleMesh> mesh =
                whole == glb ? parse_gltf(bytes, "") : parse_stl(bytes);
            if (!mesh) continue;
            ++taken;
            for (const auto& triangle : mesh->triangles) {
                EXPECT_LT(std::ranges::max(triangle), mesh->positions.size());
            }
        }
        EXPECT_GT(taken, 20);
    }
}

}  // namespace
}  // namespace terrane::tools
