// SPDX-License-Identifier: MIT
//
// Materials and images of mesh files. Images are written here byte by byte, so that they can be wrong in any way.
#include "scene/mesh_files.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace terrane::tools {
namespace texture_files_test {

using Json = nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

std::string big(std::uint32_t value) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xffu);
    return bytes;
}

std::uint32_t crc_of(const std::string& bytes) {
    std::uint32_t crc = ~0u;
    for (const char byte : bytes) {
        crc ^= static_cast<unsigned char>(byte);
        for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1u) != 0 ? 0xedb88320u : 0u);
    }
    return ~crc;
}

std::string chunk(const std::string& type, const std::string& data) {
    return big(static_cast<std::uint32_t>(data.size())) + type + data + big(crc_of(type + data));
}

// Type of a PNG's colours.
constexpr char kGrey = 0, kRgb = 2, kPalette = 3, kRgba = 6;

/// A PNG whose rows are stored without compression, each after its filter type 0.
std::string png_of(std::uint32_t width, std::uint32_t height, char type, const std::string& rows,
                   const std::string& before_rows = "", char depth = 8) {
    std::uint32_t a = 1, b = 0;
    for (const char byte : rows) {
        a = (a + static_cast<unsigned char>(byte)) % 65521u;
        b = (b + a) % 65521u;
    }
    const auto size = static_cast<std::uint16_t>(rows.size());
    std::string stored = {'\x78', '\x01', '\x01'};
    for (const std::uint32_t part : {std::uint32_t{size}, ~std::uint32_t{size}}) {
        stored += static_cast<char>(part & 0xffu);
        stored += static_cast<char>(part >> 8 & 0xffu);
    }
    stored += rows + big(b << 16 | a);
    const std::string header = big(width) + big(height) + depth + type + std::string(3, '\0');
    return "\x89PNG\r\n\x1a\n" + chunk("IHDR", header) + before_rows + chunk("IDAT", stored) +
           chunk("IEND", "");
}

std::string text_of(std::initializer_list<int> bytes) {
    std::string text;
    for (const int byte : bytes) text += static_cast<char>(byte);
    return text;
}

std::vector<int> rgba_of(const Result<std::shared_ptr<const TextureImage>>& image) {
    EXPECT_TRUE(image) << (image ? "" : image.error().message);
    if (!image) return {};
    return {(*image)->rgba.begin(), (*image)->rgba.end()};
}

// Two pixels: red, and a transparent blue.
std::string red_and_blue() {
    return png_of(2, 1, kRgba, text_of({0, 255, 0, 0, 255, 0, 0, 255, 10}));
}

// 8 x 8 pixels of (200, 100, 50), quality 30.
std::string jpeg() {
    const std::string digits =
        "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDABsSFBcUERsXFhceHBsgKEIrKCUlKFE6PTBCYFVlZF9VXVtqeJmBanGQ"
        "c1tdhbWGkJ6jq62rZ4C8ybqmx5moq6T/2wBDARweHigjKE4rK06kbl1upKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSk"
        "pKSkpKSkpKSkpKSkpKSkpKSkpKSkpKSkpKT/wAARCAAIAAgDASIAAhEBAxEB/8QAFQABAQAAAAAAAAAAAAAAAAAA"
        "AAH/xAAUEAEAAAAAAAAAAAAAAAAAAAAA/8QAFAEBAAAAAAAAAAAAAAAAAAAABP/EABQRAQAAAAAAAAAAAAAAAAAA"
        "AAD/2gAMAwEAAhEDEQA/AIAGe//Z";
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string bytes;
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < digits.size(); ++i) {
        bits = bits << 6 | static_cast<std::uint32_t>(kDigits.find(digits[i]));
        if (i % 4 == 3) bytes += big(bits).substr(1);
        if (i % 4 == 3) bits = 0;
    }
    return bytes;
}

TEST(Images, OfEachKindOfPngAreExpandedToRedGreenBlueAndOpacity) {
    EXPECT_THAT(rgba_of(decode_image(red_and_blue())), ElementsAre(255, 0, 0, 255, 0, 0, 255, 10));
    EXPECT_THAT(rgba_of(decode_image(png_of(1, 2, kRgb, text_of({0, 1, 2, 3, 0, 4, 5, 6})))),
                ElementsAre(1, 2, 3, 255, 4, 5, 6, 255));
    EXPECT_THAT(rgba_of(decode_image(png_of(2, 1, kGrey, text_of({0, 7, 200})))),
                ElementsAre(7, 7, 7, 255, 200, 200, 200, 255));
    const std::string palette =
        chunk("PLTE", text_of({9, 8, 7, 60, 50, 40})) + chunk("tRNS", text_of({255, 128}));
    EXPECT_THAT(rgba_of(decode_image(png_of(2, 1, kPalette, text_of({0, 1, 0}), palette))),
                ElementsAre(60, 50, 40, 128, 9, 8, 7, 255));
    // a colour that means transparent
    EXPECT_THAT(rgba_of(decode_image(png_of(2, 1, kRgb, text_of({0, 1, 2, 3, 9, 9, 9}),
                                            chunk("tRNS", text_of({0, 9, 0, 9, 0, 9}))))),
                ElementsAre(1, 2, 3, 255, 9, 9, 9, 0));
}

TEST(Images, OfJpegAreDecodedWithinTheirQuality) {
    const Result<std::shared_ptr<const TextureImage>> image = decode_image(jpeg());
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ((*image)->width, 8);
    EXPECT_EQ((*image)->height, 8);
    for (std::size_t i = 0; i < (*image)->rgba.size(); ++i) {
        const int expected = std::array{200, 100, 50, 255}[i % 4];
        ASSERT_NEAR((*image)->rgba[i], expected, 6) << i;
    }
}

TEST(Images, ThatAreWrongAreRefusedWithTheReason) {
    const auto reason = [](const std::string& bytes) {
        const Result<std::shared_ptr<const TextureImage>> image = decode_image(bytes);
        return image ? "" : image.error().message;
    };
    EXPECT_EQ(reason(""), "it is no PNG or JPEG image");
    EXPECT_EQ(reason("GIF89a"), "it is no PNG or JPEG image");
    // 10^9 pixels in 70 bytes: no memory is taken for them
    EXPECT_EQ(reason(png_of(40000, 25000, kGrey, text_of({0}))),
              "it has 40000 x 25000 pixels, more than 16384 a side or 67108864 in all");
    EXPECT_THAT(reason(png_of(16384, 16384, kGrey, text_of({0}))), HasSubstr("16384 x 16384"));
    EXPECT_THAT(reason(png_of(0, 5, kGrey, "")), HasSubstr("libpng: "));
    std::string huge = jpeg();
    const std::size_t frame = huge.find("\xff\xc0");
    for (const std::size_t at : {frame + 5, frame + 7}) huge.replace(at, 2, "\xfd\xe8");  // 65000
    EXPECT_THAT(reason(huge), HasSubstr("65000 x 65000 pixels"));
    for (const std::string& whole : {red_and_blue(), jpeg()}) {
        // the last bytes mark only the end
        for (std::size_t size = 0; size + 14 < whole.size(); size += 3)
            EXPECT_NE(reason(whole.substr(0, size)), "") << size << " of " << whole.size();
        std::mt19937 generator(5);
        for (int i = 0; i < 300; ++i) {
            std::string changed = whole;
            for (int k = 0; k < 3; ++k)
                changed[generator() % changed.size()] = static_cast<char>(generator());
            const Result<std::shared_ptr<const TextureImage>> image = decode_image(changed);
            if (!image) continue;
            ASSERT_EQ((*image)->rgba.size(), 4u * static_cast<std::size_t>((*image)->width) *
                                                 static_cast<std::size_t>((*image)->height));
        }
    }
}

class ModelFiles : public testing::Test {
protected:
    void SetUp() override {
        std::random_device entropy;
        folder_ =
            std::filesystem::temp_directory_path() / ("terrane_model_" + std::to_string(entropy()));
        std::filesystem::create_directories(folder_ / "maps");
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    std::string write(const std::string& name, const std::string& bytes) {
        std::ofstream(folder_ / name, std::ios::binary) << bytes;
        return (folder_ / name).string();
    }

    MeshModel read(const std::string& name) {
        testing::internal::CaptureStderr();
        Result<MeshModel> model = read_model((folder_ / name).string());
        note_ = testing::internal::GetCapturedStderr();
        EXPECT_TRUE(model) << model.error().message;
        return model ? *std::move(model) : MeshModel{};
    }

    std::filesystem::path folder_;
    std::string note_;
};

constexpr const char* kTwoTriangles =
    "mtllib house.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0.25\nvt 0.5 1\n"
    "usemtl Wall of brick\nf 1/1 2/2 3/3\nusemtl roof\nf 1/1 3/3 4/2\n";

TEST_F(ModelFiles, ObjectsHaveTheMaterialsOfTheirLibraries) {
    write("maps/brick wall.png", red_and_blue());
    write("house.mtl",
          "# a wall\nnewmtl Wall of brick\nKd 1 0.5 0\r\nmap_Kd -s 2 2 1 -clamp on maps\\brick "
          "wall.png\r\n"
          "newmtl roof\n  Kd 0.2 0.4 0.6\nnorm -bm 1 maps/brick wall.png\nmap_d maps/brick "
          "wall.png\n");
    write("house.obj", kTwoTriangles);
    const MeshModel model = read("house.obj");
    EXPECT_EQ(note_, "");
    ASSERT_EQ(model.materials.size(), 3u);
    EXPECT_THAT(model.mesh.materials, ElementsAre(1, 1, 1, 2, 2, 2));
    const MeshMaterial &wall = model.materials[1], &roof = model.materials[2];
    ASSERT_NE(wall.colour_texture.image, nullptr);
    EXPECT_EQ(wall.colour_texture.image->width, 2);
    EXPECT_EQ(wall.colour_texture.wrap_right, TextureWrap::clamp);
    EXPECT_FALSE(wall.alpha_cutoff);
    // one file is one image
    EXPECT_EQ(roof.normal_texture.image, wall.colour_texture.image);
    EXPECT_EQ(roof.colour_texture.image, nullptr);
    EXPECT_EQ(roof.alpha_cutoff, 0.5f);
    EXPECT_EQ(model.mesh.texture_coordinates[1], Eigen::Vector2f(1.0f, 0.25f));
    EXPECT_EQ(model.mesh.colours[0], (std::array<std::uint8_t, 4>{255, 128, 0, 255}));
    EXPECT_EQ(model.mesh.colours[3], (std::array<std::uint8_t, 4>{51, 102, 153, 255}));
    // without materials the file is as before
    const TriangleMesh plain = read_mesh_with_attributes((folder_ / "house.obj").string()).value();
    EXPECT_TRUE(plain.materials.empty());
    EXPECT_TRUE(plain.colours.empty());
    EXPECT_EQ(plain.positions.size(), 4u);
}

TEST_F(ModelFiles, PlainMaterialsBecomeColoursOfVertices) {
    write("house.mtl", "newmtl Wall of brick\nKd 1 0.5 0\nnewmtl roof\nKd 0.2 0.4 0.6\n");
    write("house.obj", kTwoTriangles);
    const MeshModel model = read("house.obj");
    EXPECT_TRUE(model.materials.empty());
    EXPECT_TRUE(model.mesh.materials.empty());
    EXPECT_TRUE(model.mesh.texture_coordinates.empty());
    EXPECT_EQ(model.mesh.colours[0], (std::array<std::uint8_t, 4>{255, 128, 0, 255}));
}

TEST_F(ModelFiles, ImagesThatCannotBeReadAreNotedByNameAndLeaveThePlainColour) {
    write("cut.png", red_and_blue().substr(0, 60));
    write("huge.png", png_of(40000, 25000, kGrey, text_of({0})));
    write("notes.png", "buy paint\n");
    const auto note_of = [&](const std::string& image) {
        write("house.mtl", "newmtl Wall of brick\nKd 1 0.5 0\nmap_Kd " + image + "\n");
        write("house.obj", kTwoTriangles);
        const MeshModel model = read("house.obj");
        EXPECT_TRUE(model.materials.empty()) << image;
        EXPECT_EQ(model.mesh.colours[0], (std::array<std::uint8_t, 4>{255, 128, 0, 255}));
        EXPECT_EQ(std::ranges::count(note_, '\n'), 1) << note_;
        return note_;
    };
    EXPECT_THAT(note_of("absent.png"), HasSubstr("texture 'absent.png': No such file"));
    EXPECT_THAT(note_of("cut.png"), HasSubstr("texture 'cut.png': libpng: "));
    EXPECT_THAT(note_of("huge.png"), HasSubstr("texture 'huge.png': it has 40000 x 25000 pixels"));
    EXPECT_THAT(
        note_of("notes.png"),
        HasSubstr("texture 'notes.png': it is no PNG or JPEG image: drawn in plain colour"));
    EXPECT_THAT(note_of("../house.obj"), HasSubstr("must be in the file's folder or below it"));
    EXPECT_THAT(note_of("/etc/hostname"), HasSubstr("must be in the file's folder or below it"));
    EXPECT_THAT(note_of("maps"), HasSubstr("texture 'maps': it is not a file"));
    EXPECT_THAT(note_of(""), HasSubstr("texture ''"));
    write("house.obj", "mtllib other.mtl\n" + std::string(kTwoTriangles).substr(17));
    EXPECT_TRUE(read("house.obj").materials.empty());
    EXPECT_THAT(note_, HasSubstr("materials 'other.mtl': No such file"));
}

/// A document of glTF with a square of 2 m in the plane z = 0, and material 0.
struct Document {
    Json json;
    std::string bytes;

    explicit Document(const Json& material) {
        json = {{"asset", {{"version", "2.0"}}},
                {"nodes", {{{"mesh", 0}}}},
                {"scenes", {{{"nodes", {0}}}}},
                {"scene", 0}};
        json["materials"] = {material};
        json["textures"] = {{{"source", 0}}};
        const int positions = add({-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0}, "VEC3");
        const int places = add({0, 1, 1, 1, 1, 0.25, 0, 0}, "VEC2");
        const int others = add({0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5}, "VEC2");
        const int indices = add({0, 1, 2, 0, 2, 3}, "SCALAR");
        json["meshes"] = {
            {{"primitives",
              {{{"attributes",
                 {{"POSITION", positions}, {"TEXCOORD_0", places}, {"TEXCOORD_1", others}}},
                {"indices", indices},
                {"material", 0}}}}}};
    }

    int add_view(const std::string& data) {
        json["bufferViews"].push_back(
            {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", data.size()}});
        bytes += data;
        bytes.resize((bytes.size() + 3) / 4 * 4);
        return static_cast<int>(json["bufferViews"].size()) - 1;
    }

    int add(const std::vector<float>& values, const std::string& type) {
        std::string data(sizeof(float) * values.size(), '\0');
        std::memcpy(data.data(), values.data(), data.size());
        const std::size_t width = type == "SCALAR" ? 1 : type == "VEC2" ? 2 : 3;
        json["accessors"].push_back({{"bufferView", add_view(data)},
                                     {"componentType", 5126},
                                     {"type", type},
                                     {"count", values.size() / width}});
        return static_cast<int>(json["accessors"].size()) - 1;
    }

    /// A .glb file; all tests run on little-endian machines.
    std::string glb() const {
        Json whole = json;
        whole["buffers"] = {{{"byteLength", bytes.size()}}};
        std::string text = whole.dump();
        text.resize((text.size() + 3) / 4 * 4, ' ');
        const auto little = [](std::size_t value) {
            std::string made = big(static_cast<std::uint32_t>(value));
            std::ranges::reverse(made);
            return made;
        };
        return "glTF" + little(2) + little(12 + 8 + text.size() + 8 + bytes.size()) +
               little(text.size()) + "JSON" + text + little(bytes.size()) +
               std::string("BIN\0", 4) + bytes;
    }
};

Json textured(const Json& more = Json::object()) {
    Json material = {{"pbrMetallicRoughness",
                      {{"baseColorTexture", {{"index", 0}}},
                       {"baseColorFactor", {1.0, 0.5, 0.25, 0.8}},
                       {"metallicFactor", 0.25}}}};
    material.update(more, true);
    return material;
}

TEST_F(ModelFiles, GltfHasItsMaterialWithAnImageOfTheBuffer) {
    Document document(textured({{"doubleSided", true},
                                {"alphaMode", "MASK"},
                                {"alphaCutoff", 0.3},
                                {"emissiveFactor", {0.0, 1.0, 0.5}}}));
    document.json["images"] = {
        {{"bufferView", document.add_view(red_and_blue())}, {"mimeType", "image/png"}}};
    document.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}}};
    document.json["textures"][0]["sampler"] = 0;
    write("square.glb", document.glb());
    const MeshModel model = read("square.glb");
    EXPECT_EQ(note_, "");
    ASSERT_EQ(model.materials.size(), 1u);
    const MeshMaterial& material = model.materials[0];
    ASSERT_NE(material.colour_texture.image, nullptr);
    EXPECT_EQ(material.colour_texture.image->rgba.size(), 8u);
    EXPECT_EQ(material.colour_texture.wrap_right, TextureWrap::clamp);
    EXPECT_EQ(material.colour_texture.wrap_up, TextureWrap::mirror);
    EXPECT_TRUE(material.is_two_sided);
    EXPECT_EQ(material.alpha_cutoff, 0.3f);
    EXPECT_EQ(material.metal, 0.25f);
    EXPECT_EQ(material.roughness, 1.0f);
    EXPECT_THAT(material.emission, ElementsAre(0.0f, 2.0f, 1.0f));
    // glTF counts v from the top
    ASSERT_EQ(model.mesh.texture_coordinates.size(), 4u);
    EXPECT_EQ(model.mesh.texture_coordinates[0], Eigen::Vector2f(0.0f, 0.0f));
    EXPECT_EQ(model.mesh.texture_coordinates[2], Eigen::Vector2f(1.0f, 0.75f));
    EXPECT_EQ(model.mesh.colours[0], (std::array<std::uint8_t, 4>{255, 186, 136, 204}));
    const TriangleMesh plain = read_mesh_with_attributes((folder_ / "square.glb").string()).value();
    EXPECT_TRUE(plain.texture_coordinates.empty());
    EXPECT_TRUE(plain.materials.empty());
}

TEST_F(ModelFiles, TransformsOfTexturesAndTheirSetsMoveTheCoordinates) {
    Json info = {
        {"index", 0},
        {"extensions",
         {{"KHR_texture_transform",
           {{"offset", {0.5, 0.25}}, {"rotation", std::numbers::pi / 2}, {"scale", {2.0, 4.0}}}}}}};
    const auto coordinates = [&] {
        Document document(Json{{"pbrMetallicRoughness", {{"baseColorTexture", info}}}});
        document.json["extensionsRequired"] = {"KHR_texture_transform"};
        document.json["images"] = {{{"uri", "maps/a%20b.png"}}};
        write("maps/a b.png", red_and_blue());
        write("square.glb", document.glb());
        return read("square.glb").mesh.texture_coordinates;
    };
    // a quarter turn maps (u, v) to (v, -u); corner 2 is (1, 0.25)
    const auto turned = coordinates();
    ASSERT_EQ(turned.size(), 4u);
    EXPECT_NEAR(turned[2].x(), 4.0 * 0.25 + 0.5, 1e-6);
    EXPECT_NEAR(turned[2].y(), 1.0 - (-2.0 * 1.0 + 0.25), 1e-6);
    info = {{"index", 0}, {"texCoord", 1}};
    EXPECT_EQ(coordinates()[0], Eigen::Vector2f(0.5f, 0.5f));
    // a second texture cannot have other coordinates
    Document document(textured({{"normalTexture", {{"index", 0}, {"texCoord", 1}}}}));
    document.json["images"] = {{{"bufferView", document.add_view(red_and_blue())}}};
    write("square.glb", document.glb());
    EXPECT_EQ(read("square.glb").materials[0].normal_texture.image, nullptr);
    EXPECT_THAT(note_, HasSubstr("materials[0].normalTexture: its coordinates differ"));
}

TEST_F(ModelFiles, TexturesOfGltfThatAreWrongAreNotedByName) {
    write("huge.png", png_of(40000, 25000, kGrey, text_of({0})));
    write("half.jpg", jpeg().substr(0, 200));
    const auto note_of = [&](const Json& images) {
        Document document(textured());
        document.json["images"] = images;
        write("square.glb", document.glb());
        const MeshModel model = read("square.glb");
        EXPECT_TRUE(model.materials.empty());
        EXPECT_TRUE(model.mesh.texture_coordinates.empty());
        EXPECT_EQ(std::ranges::count(note_, '\n'), 1) << note_;
        return note_;
    };
    const std::string texture = "materials[0].pbrMetallicRoughness.baseColorTexture: ";
    EXPECT_THAT(note_of({{{"uri", "huge.png"}}}),
                HasSubstr(texture + "'huge.png': it has 40000 x 25000 pixels"));
    EXPECT_THAT(note_of({{{"uri", "half.jpg"}}}), HasSubstr("'half.jpg': "));
    EXPECT_THAT(note_of({{{"uri", "absent.png"}}}), HasSubstr("'absent.png': "));
    EXPECT_THAT(note_of({{{"uri", "../secret.png"}}}), HasSubstr("must be in the file's folder"));
    EXPECT_THAT(note_of({{{"uri", "data:image/png;base64,AAAA"}}}),
                HasSubstr("'images[0]': it is no PNG or JPEG image"));
    EXPECT_THAT(note_of({{{"bufferView", 99}}}), HasSubstr("it names bufferViews[99] of 4"));
    EXPECT_THAT(note_of(Json::array()), HasSubstr("it names images[0] of 0"));
    // a material that blends is cut at half the texture's opacity
    Document document(textured({{"alphaMode", "BLEND"}}));
    document.json["images"] = {{{"bufferView", document.add_view(jpeg())}}};
    write("square.glb", document.glb());
    EXPECT_EQ(read("square.glb").materials[0].alpha_cutoff, 0.4f);
    EXPECT_THAT(note_, HasSubstr("1 material cut where its opacity is half, instead of blended"));
}

}  // namespace texture_files_test
}  // namespace terrane::tools
