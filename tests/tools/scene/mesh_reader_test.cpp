// SPDX-License-Identifier: MIT
#include "scene/mesh_files.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

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
            for (const auto& triangle : mesh->triangles) {
                for (const std::uint32_t corner : triangle) {
                    ASSERT_LT(corner, mesh->positions.size()) << "seed " << seed;
                }
            }
        }
    }
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
    for (int seed = 0; seed < 2000; ++seed) {
        test::Random random(static_cast<std::uint64_t>(seed));
        std::string bytes = text;
        for (int i = 0; i < 3; ++i)
            bytes[static_cast<std::size_t>(random.below(static_cast<int>(bytes.size())))] =
                "0123456789-/ vtnf\n."[random.below(20)];
        const Result<TriangleMesh> changed = parse_obj_with_attributes(bytes);
        if (!changed) continue;
        ASSERT_TRUE(changed->normals.empty() ||
                    changed->normals.size() == changed->positions.size());
        for (const auto& triangle : changed->triangles) {
            for (const std::uint32_t corner : triangle)
                ASSERT_LT(corner, changed->positions.size());
        }
    }
}

TEST(ReadMesh, NamesWhatIsWrong) {
    const auto of_ply = [](const std::string& rest) {
        const Result<TriangleMesh> mesh = parse_ply("ply\nformat ascii 1.0\n" + rest);
        return mesh ? std::string() : mesh.error().message;
    };
    const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
    EXPECT_EQ(of_ply("element vertex 1\nproperty float x\nproperty float y\nend_header\n"),
              "its vertices have no property z");
    EXPECT_EQ(of_ply("element vertex 99999999999\n" + xyz + "end_header\n"),
              "it has 99999999999 elements 'vertex', more than 4194304");
    EXPECT_EQ(of_ply("element vertex -1\nend_header\n"),
              "line 'element vertex -1' of its header is wrong");
    EXPECT_EQ(of_ply("element vertex 1\nproperty half x\nend_header\n"),
              "line 'property half x' of its header is wrong");
    EXPECT_EQ(of_ply("element face 1\nproperty list uchar int vertex_index\nend_header\n"),
              "its faces come before its vertices");
    EXPECT_EQ(of_ply("element vertex 1\n" + xyz +
                     "element face 1\nproperty list uchar int vertex_index\nend_header\n1 2 3\n"
                     "3 0 0 1\n"),
              "a face names point 1 of 1");
    const auto of_obj = [](const std::string& text) {
        const Result<TriangleMesh> mesh = parse_obj(text);
        return mesh ? std::string() : mesh.error().message;
    };
    EXPECT_EQ(of_obj("# a\nv 1 2\n"), "line 2: a point needs 3 numbers");
    EXPECT_EQ(of_obj("v 1 2 3\nf 1 1\n"), "line 2: a face has 2 corners, fewer than 3");
    EXPECT_EQ(of_obj("v 1 2 3\nf 1 1 0\n"), "line 2: '0' is no corner of a face");
    EXPECT_EQ(of_obj("v 1 2 3\nf 1 1 -2\n"), "line 2: a face names point -1 of 1");
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
}  // namespace terrane::tools
