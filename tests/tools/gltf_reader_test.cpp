// SPDX-License-Identifier: MIT
#include "scene/mesh_files.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace gltf_reader_test {

using Json = nlohmann::json;
using Triangles = std::vector<TriangleMesh::Triangle>;

constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123,
              kUnsignedInt = 5125, kFloat = 5126;

template <class Number>
std::string little(std::initializer_list<Number> values) {
    std::string bytes;
    for (const Number value : values) {
        std::array<char, sizeof(Number)> raw =
            std::bit_cast<std::array<char, sizeof(Number)>>(value);
        if (std::endian::native == std::endian::big) std::ranges::reverse(raw);
        bytes.append(raw.data(), raw.size());
    }
    return bytes;
}

std::string base64(const std::string& bytes) {
    constexpr const char* kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string made;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits =
                bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k)
            made += i + k <= bytes.size() ? kDigits[bits >> (18 - 6 * k) & 63u] : '=';
    }
    return made;
}

/// A document with one buffer, to which accessors are added.
struct Document {
    Json json = {{"asset", {{"version", "2.0"}}}, {"accessors", Json::array()},
                 {"bufferViews", Json::array()},  {"nodes", {{{"mesh", 0}}}},
                 {"scenes", {{{"nodes", {0}}}}},  {"scene", 0}};
    std::string bytes;

    int add_view(const std::string& data, int stride = 0) {
        bytes.resize((bytes.size() + 3) / 4 * 4);
        Json view = {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", data.size()}};
        if (stride > 0) view["byteStride"] = stride;
        json["bufferViews"].push_back(view);
        bytes += data;
        return static_cast<int>(json["bufferViews"].size()) - 1;
    }

    int add(const std::string& data, int component, const char* type, int count, int stride = 0) {
        json["accessors"].push_back({{"bufferView", add_view(data, stride)},
                                     {"componentType", component},
                                     {"type", type},
                                     {"count", count}});
        return static_cast<int>(json["accessors"].size()) - 1;
    }

    /// The tetrahedron (0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3) of glTF's axes as mesh 0.
    Document& add_tetrahedron() {
        const int points =
            add(little<float>({0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3}), kFloat, "VEC3", 4);
        const int indices = add(little<std::uint16_t>({0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}),
                                kUnsignedShort, "SCALAR", 12);
        json["meshes"] = {
            {{"primitives", {{{"attributes", {{"POSITION", points}}}, {"indices", indices}}}}}};
        return *this;
    }

    Json& primitive() { return json["meshes"][0]["primitives"][0]; }

    std::string text() const {
        Json whole = json;
        if (!whole.contains("buffers")) {
            whole["buffers"] = {
                {{"byteLength", bytes.size()},
                 {"uri", fmt::format("data:application/octet-stream;base64,{}", base64(bytes))}}};
        }
        return whole.dump();
    }

    Result<FileMesh> read(const std::string& folder = "") const {
        return parse_gltf(text(), folder);
    }
    std::string refusal() const {
        const Result<FileMesh> mesh = read();
        return mesh ? "" : mesh.error().message;
    }
};

double volume_of(const TriangleMesh& mesh) {
    double volume = 0.0;
    for (const auto& [a, b, c] : mesh.triangles) {
        volume += mesh.positions[a].dot(mesh.positions[b].cross(mesh.positions[c])) / 6.0;
    }
    return volume;
}

void expect_corners(const Result<FileMesh>& mesh, const std::vector<Eigen::Vector3d>& expected) {
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->positions.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i)
        EXPECT_LT((mesh->positions[i] - expected[i]).norm(), 1e-12) << i;
}

TEST(Gltf, PositionsOfAllComponentTypesAreReadNormalisedOrNot) {
    struct Case {
        int component;
        std::string data;
        double one;
    };
    const std::string bytes8 =
        little<std::int8_t>({0, 0, 0, 0, 100, 0, 0, 0, 0, 50, 0, 0, 0, 0, 25, 0});
    const std::string bytes16 =
        little<std::int16_t>({0, 0, 0, 0, 100, 0, 0, 0, 0, 50, 0, 0, 0, 0, 25, 0});
    for (const auto& [component, data, one] :
         {Case{kByte, bytes8, 127.0}, Case{kUnsignedByte, bytes8, 255.0},
          Case{kShort, bytes16, 32767.0}, Case{kUnsignedShort, bytes16, 65535.0}}) {
        for (const bool is_normalised : {false, true}) {
            Document document;
            document.add_tetrahedron();
            const int stride = component < kShort ? 4 : 8;
            const int points = document.add(data, component, "VEC3", 4, stride);
            document.json["accessors"][static_cast<std::size_t>(points)]["normalized"] =
                is_normalised;
            document.primitive()["attributes"]["POSITION"] = points;
            document.json["extensionsRequired"] = {"KHR_mesh_quantization"};
            const double unit = is_normalised ? 1.0 / one : 1.0;
            expect_corners(document.read(),
                           {{0, 0, 0}, {100 * unit, 0, 0}, {0, 0, 50 * unit}, {0, -25 * unit, 0}});
        }
    }
    Document least;
    least.add_tetrahedron();
    least.primitive()["attributes"]["POSITION"] =
        least.add(little<std::int8_t>({-128, 0, 0, 0, 127, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}), kByte,
                  "VEC3", 4, 4);
    least.json["accessors"].back()["normalized"] = true;
    EXPECT_EQ(least.read()->positions[0], Eigen::Vector3d(-1.0, 0.0, 0.0));
}

TEST(Gltf, RequiredExtensionsThatAreNotReadAreNamed) {
    Document document;
    document.add_tetrahedron();
    document.json["extensionsRequired"] = {"KHR_texture_transform", "KHR_materials_unlit"};
    EXPECT_EQ(document.refusal(), "");
    document.json["extensionsRequired"] = {"XYZ_nonsense", "KHR_mesh_quantization",
                                           "KHR_draco_mesh_compression"};
    EXPECT_EQ(document.refusal(),
              "it requires XYZ_nonsense, KHR_draco_mesh_compression, which are not read; known are "
              "KHR_mesh_quantization and EXT_mesh_gpu_instancing");
    document.json.erase("extensionsRequired");
    // used and not required: the data may be there without compression, or not
    document.primitive()["extensions"]["KHR_draco_mesh_compression"]["bufferView"] = 0;
    EXPECT_EQ(document.refusal(), "");
    document.json["accessors"][0].erase("bufferView");
    EXPECT_EQ(
        document.refusal(),
        "meshes[0].primitives[0] is compressed by KHR_draco_mesh_compression, which is not read");
    Document packed;
    packed.add_tetrahedron();
    packed.json["buffers"] = {{{"byteLength", packed.bytes.size()}}};
    packed.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["buffer"] = 1;
    EXPECT_EQ(packed.refusal(),
              "bufferViews[0] is compressed by EXT_meshopt_compression, which is not read");
}

TEST(Gltf, TransformsOfNestedNodesAreApplied) {
    Document document;
    document.add_tetrahedron();
    const double half = std::sqrt(0.5);
    document.json["nodes"] = {
        {{"children", {1}},
         {"translation", {10, 0, 0}},
         {"rotation", {0, 0, half, half}},
         {"scale", {2, 2, 2}}},
        // by columns: x becomes y, y becomes x
        {{"mesh", 0}, {"matrix", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1}}}};
    // y up: (x, y, z) becomes (x, -z, y). The turn by 90 degrees about z takes x to y and y to -x
    const Result<FileMesh> mesh = document.read();
    expect_corners(mesh, {{10, -10, 0}, {8, -10, 0}, {10, -10, 4}, {10, -16, 0}});
    EXPECT_NEAR(volume_of(*mesh), 8.0,
                1e-12);  // the matrix mirrors: corners are in the other order
    document.json["nodes"][1]["matrix"][3] = 0.5;
    EXPECT_EQ(document.refusal(), "nodes[1].matrix must have the last row 0, 0, 0, 1");
}

TEST(Gltf, AMirroringScaleKeepsTheOutsideOutside) {
    for (const double sign : {1.0, -1.0}) {
        Document document;
        document.add_tetrahedron();
        document.json["nodes"][0]["scale"] = {sign, 1, 1};
        EXPECT_NEAR(volume_of(*document.read()), 1.0, 1e-12) << sign;
    }
}

TEST(Gltf, InstancesArePlaced) {
    Document document;
    document.add_tetrahedron();
    Json& instancing =
        document.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
    instancing["TRANSLATION"] = document.add(little<float>({0, 0, 0, 5, 0, 0}), kFloat, "VEC3", 2);
    instancing["SCALE"] = document.add(little<float>({1, 1, 1, 2, 2, 2}), kFloat, "VEC3", 2);
    instancing["ROTATION"] =
        document.add(little<std::int8_t>({0, 0, 0, 127, 0, 0, 127, 0}), kByte, "VEC4", 2);
    document.json["accessors"].back()["normalized"] = true;
    document.json["nodes"][0]["translation"] = {0, 7, 0};
    document.json["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
    // the second is turned by 180 degrees about z
    expect_corners(
        document.read(),
        {{0, 0, 7}, {1, 0, 7}, {0, 0, 9}, {0, -3, 7}, {5, 0, 7}, {3, 0, 7}, {5, 0, 3}, {5, -6, 7}});
    document.json["accessors"][3]["count"] = 1;
    EXPECT_NE(document.refusal().find("differ in their number of instances"), std::string::npos);
}

TEST(Gltf, MorphTargetsHaveTheirDefaultWeights) {
    Document document;
    document.add_tetrahedron();
    const int first =
        document.add(little<float>({0, 0, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0}), kFloat, "VEC3", 4);
    // only sparse: all others are 0
    const int places = document.add_view(little<std::uint8_t>({3}));
    const int values = document.add_view(little<float>({0, 0, 8}));
    document.json["accessors"].push_back(
        {{"componentType", kFloat},
         {"type", "VEC3"},
         {"count", 4},
         {"sparse",
          {{"count", 1},
           {"indices", {{"bufferView", places}, {"componentType", kUnsignedByte}}},
           {"values", {{"bufferView", values}}}}}});
    document.primitive()["targets"] = {{{"POSITION", first}}, {{"POSITION", first + 1}}};
    expect_corners(document.read(), {{0, 0, 0}, {1, 0, 0}, {0, 0, 2}, {0, -3, 0}});
    document.json["meshes"][0]["weights"] = {0.5, 0.25};
    expect_corners(document.read(), {{0, 0, 0}, {3, 0, 0}, {0, 0, 2}, {0, -5, 0}});
    document.json["nodes"][0]["weights"] = {0.0, 1.0};
    expect_corners(document.read(), {{0, 0, 0}, {1, 0, 0}, {0, 0, 2}, {0, -11, 0}});
    document.json["nodes"][0]["weights"] = {1.0};
    EXPECT_EQ(document.refusal(), "meshes[0].primitives[0] has 2 morph targets, and 1 weights");
    document.json["nodes"][0]["weights"] = {1.0, 1.0};
    document.json["accessors"].back()["sparse"]["count"] = 5;
    EXPECT_EQ(document.refusal(), "accessors[3].sparse changes 5 of 4 elements");
}

TEST(Gltf, StripsFansAndListsWithoutIndicesAreRead) {
    const std::string points =
        little<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0, 1, 2, 0});
    for (const auto& [mode, expected] :
         {std::pair(4, Triangles{{0, 1, 2}, {3, 4, 5}}),
          std::pair(5, Triangles{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}, {3, 5, 4}}),
          std::pair(6, Triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}})}) {
        Document document;
        const int accessor = document.add(points, kFloat, "VEC3", 6);
        document.json["meshes"] = {
            {{"primitives", {{{"attributes", {{"POSITION", accessor}}}, {"mode", mode}}}}}};
        const Result<FileMesh> mesh = document.read();
        ASSERT_TRUE(mesh) << mesh.error().message;
        EXPECT_EQ(mesh->triangles, expected) << mode;
        document.json["accessors"][0]["count"] = mode == 4 ? 5 : 2;
        EXPECT_NE(document.refusal().find(mode == 4 ? "5 corners, which is no multiple of 3"
                                                    : "2 corners, fewer than 3"),
                  std::string::npos)
            << document.refusal();
    }
    Document lines;
    lines.add_tetrahedron();
    lines.json["meshes"][0]["primitives"].push_back(
        {{"attributes", {{"POSITION", 0}}}, {"mode", 1}});
    lines.json["nodes"][0]["skin"] = 0;
    const Result<FileMesh> mesh = lines.read();
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->triangles.size(), 4u);
    EXPECT_EQ(mesh->left_out.lines, 1u);
    EXPECT_EQ(mesh->left_out.skins, 1u);
}

TEST(Gltf, TheDefaultSceneIsReadAndWithoutOneAllScenes) {
    Document document;
    document.add_tetrahedron();
    document.json["nodes"] = {{{"mesh", 0}}, {{"mesh", 0}}, {{"children", {0}}}};
    document.json["scenes"] = {{{"nodes", {2}}}, {{"nodes", {1, 2}}}, Json::object()};
    const auto count = [&] { return document.read().value().triangles.size(); };
    EXPECT_EQ(count(), 4u);
    document.json["scene"] = 1;
    EXPECT_EQ(count(), 8u);
    document.json["scene"] = 2;
    EXPECT_EQ(count(), 0u);
    document.json.erase("scene");
    EXPECT_EQ(count(), 8u);
    document.json.erase("scenes");
    EXPECT_EQ(count(), 8u);
    document.json["scene"] = 5;
    EXPECT_EQ(document.refusal(), "it names scenes[5] of 0");
}

TEST(Gltf, NodesThatFormNoTreeAreRefused) {
    Document document;
    document.add_tetrahedron();
    document.json["nodes"] = {{{"children", {1}}}, {{"children", {0}}}};
    EXPECT_EQ(document.refusal(), "nodes[0] has two parents, or is its own ancestor");
    document.json["nodes"] = Json::array();
    for (int i = 0; i < 300; ++i) document.json["nodes"].push_back({{"children", {i + 1}}});
    document.json["nodes"].push_back({{"mesh", 0}});
    EXPECT_EQ(document.refusal(), "its nodes are nested deeper than 256");
}

TEST(Gltf, DeeplyNestedJsonIsLeftOut) {
    Document document;
    document.add_tetrahedron();
    std::string text = document.text();
    const std::string deep = std::string(300'000, '[') + std::string(300'000, ']');
    const std::string extras = fmt::format("{{\"extras\":{},{}", deep, text.substr(1));
    const Result<FileMesh> mesh = parse_gltf(extras, "");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->triangles.size(), 4u);
    EXPECT_FALSE(parse_gltf(fmt::format("{{\"asset\":{{\"version\":{}}}}}", deep), ""));
}

TEST(Gltf, WhatReachesBeyondItsDataIsNamed) {
    const auto refusal = [](const auto& change) {
        Document document;
        document.add_tetrahedron();
        change(document.json);
        return document.refusal();
    };
    EXPECT_EQ(refusal([](Json& json) { json["accessors"][0]["count"] = 5; }),
              "accessors[0] ends at byte 60 of bufferViews[0], which has 48");
    EXPECT_EQ(refusal([](Json& json) { json["accessors"][0]["count"] = 1'000'000'000'000; }),
              "accessors[0] has 1000000000000 elements, more than 4194304");
    EXPECT_EQ(refusal([](Json& json) { json["accessors"][0]["byteOffset"] = 4; }),
              "accessors[0] ends at byte 52 of bufferViews[0], which has 48");
    EXPECT_EQ(refusal([](Json& json) { json["bufferViews"][1]["byteLength"] = 25; }),
              "bufferViews[1] ends at byte 73 of 72");
    EXPECT_EQ(refusal([](Json& json) { json["bufferViews"][1]["byteStride"] = 1; }),
              "bufferViews[1].byteStride must be 2 to 252, got 1");
    EXPECT_EQ(refusal([](Json& json) { json["accessors"][0]["count"] = 3; }),
              "meshes[0].primitives[0] names point 3 of 3");
    EXPECT_EQ(refusal([](Json& json) { json["accessors"][0]["type"] = "VEC2"; }),
              "accessors[0].type must be VEC3, got \"VEC2\"");
    EXPECT_EQ(refusal([](Json& json) { json["accessors"][0]["count"] = -1; }),
              "accessors[0].count must be a whole number from 0 to 2^40, got -1");
    EXPECT_EQ(refusal([](Json& json) { json["nodes"][0]["mesh"] = 1; }), "it names meshes[1] of 1");
    EXPECT_EQ(refusal([](Json& json) { json["asset"]["version"] = "1.0"; }),
              "only glTF 2.0 is read, asset.version is \"1.0\"");
}

TEST(Gltf, AVertexHasItsColourTimesTheBaseColourAndItsNormal) {
    Document document;
    document.add_tetrahedron();
    document.json["materials"] = {
        {{"pbrMetallicRoughness", {{"baseColorFactor", {1.0, 0.5, 0.0, 0.25}}}}}};
    document.primitive()["material"] = 0;
    const std::uint8_t half = static_cast<std::uint8_t>(255.0 * std::pow(0.5, 1.0 / 2.2) + 0.5);
    EXPECT_EQ(document.read()->colours[2], (std::array<std::uint8_t, 4>{255, half, 0, 64}));
    document.primitive()["attributes"]["COLOR_0"] =
        document.add(little<std::uint8_t>(
                         {0, 255, 255, 0, 255, 255, 255, 0, 255, 255, 255, 0, 255, 255, 255, 0}),
                     kUnsignedByte, "VEC3", 4, 4);
    document.json["accessors"].back()["normalized"] = true;
    document.primitive()["attributes"]["NORMAL"] =
        document.add(little<float>({1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0}), kFloat, "VEC3", 4);
    document.json["nodes"][0]["scale"] = {-2, 1, 1};
    const Result<FileMesh> mesh = document.read();
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->colours[0], (std::array<std::uint8_t, 4>{0, half, 0, 64}));
    EXPECT_EQ(mesh->normals,
              (std::vector<Eigen::Vector3f>{{-1, 0, 0}, {0, 0, 1}, {0, -1, 0}, {-1, 0, 0}}));
}

class GltfFiles : public testing::Test {
protected:
    void SetUp() override {
        std::random_device entropy;
        folder_ =
            std::filesystem::temp_directory_path() / ("terrane_gltf_" + std::to_string(entropy()));
        std::filesystem::create_directories(folder_ / "a b");
        document_.add_tetrahedron();
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    std::string refusal_of(const std::string& uri) {
        document_.json["buffers"] = {{{"byteLength", document_.bytes.size()}, {"uri", uri}}};
        const std::string path = (folder_ / "t.gltf").string();
        std::ofstream(path) << document_.text();
        const Result<TriangleMesh> mesh = read_mesh(path);
        if (mesh) return volume_of(*mesh) == 1.0 ? "" : "wrong volume";
        const std::string& message = mesh.error().message;
        const std::string begin = "cannot read mesh '" + path + "': ";
        return message.starts_with(begin) ? message.substr(begin.size()) : message;
    }

    std::filesystem::path folder_;
    Document document_;
};

TEST_F(GltfFiles, BuffersBesideTheFileAreRead) {
    // a buffer may be longer than its byteLength
    std::ofstream(folder_ / "a b" / "d+%.bin", std::ios::binary) << document_.bytes << "more";
    EXPECT_EQ(refusal_of("a%20b/d+%25.bin"), "");
    EXPECT_EQ(refusal_of("a b/./d+%.bin"), "");
    EXPECT_EQ(refusal_of("none.bin"),
              "buffers[0]: 'none.bin' beside it cannot be read: No such file or directory");
    std::ofstream(folder_ / "short.bin", std::ios::binary) << document_.bytes.substr(1);
    EXPECT_EQ(refusal_of("short.bin"), "buffers[0] has 71 bytes, fewer than its byteLength 72");
    for (const std::string uri :
         {"../x.bin", "a/..%2f../x.bin", "/etc/passwd", "http://a/b.bin", "file:a.bin", ""}) {
        EXPECT_NE(refusal_of(uri).find("buffers must be in the file's folder or below it"),
                  std::string::npos)
            << uri << ": " << refusal_of(uri);
    }
    EXPECT_EQ(refusal_of("data:;base64,AA*A"), "buffers[0].uri is no base64");
    EXPECT_EQ(refusal_of("data:,abc%20"), "buffers[0] has 4 bytes, fewer than its byteLength 72");
}

TEST_F(GltfFiles, AGlbFileHasItsFirstBufferInItself) {
    Document document;
    document.add_tetrahedron();
    document.json["buffers"] = {{{"byteLength", document.bytes.size()}}};
    std::string json = document.text();
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const auto chunks = [&](std::uint32_t binary_size) {
        const auto json_size = static_cast<std::uint32_t>(json.size());
        return "glTF" +
               little<std::uint32_t>(
                   {2u, 28u + json_size + static_cast<std::uint32_t>(document.bytes.size()),
                    json_size, 0x4e4f534au}) +
               json + little<std::uint32_t>({binary_size, 0x004e4942u}) + document.bytes;
    };
    const Result<FileMesh> mesh = parse_gltf(chunks(72), "");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(volume_of(*mesh), 1.0);
    EXPECT_EQ(parse_gltf(chunks(73), "").error().message, "its second chunk ends early");
    const std::string whole = chunks(72);
    for (std::size_t size = 4; size < whole.size(); ++size)
        EXPECT_FALSE(parse_gltf(std::string_view(whole).substr(0, size), "")) << size;
}

}  // namespace gltf_reader_test
}  // namespace terrane::tools
