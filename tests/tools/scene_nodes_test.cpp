// SPDX-License-Identifier: MIT
#include "scene/scene_nodes.h"

#include "frames/object_field.h"

#include <terrane/render/offscreen.h>
#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

namespace terrane::tools {
namespace scene_nodes_test {

Parsed<SceneNodes> read(const std::string& text) {
    return read_nodes(nlohmann::ordered_json::parse(text), TERRANE_SOURCE_DIR "/tools/data");
}

std::string error_of(const std::string& text) {
    const Parsed<SceneNodes> nodes = read(text);
    return nodes ? std::string() : nodes.error();
}

constexpr const char* kHouse = R"([
  {"position":[10,20,0], "on_ground":true, "scale":2, "children":[
    {"box":{"half_extents":[3,2,1]}, "position":[0,0,1], "colour":[1,0.5,0]},
    {"position":[0,0,4], "emitter":{"per_s":30, "life_s":[2,3], "wind":[1,0,0], "most":50,
                                    "colour":[[1,1,1,0.5],[1,1,1,0]]}},
    {"switch":{"limits":[80,"always"], "fade_ratio":1.25}, "children":[
      {"mesh":"pine.obj"}, {"billboard":"up", "children":[{"mesh":"pine.obj", "scale":0.5}]}]}]},
  {"position":[0,0,50], "sphere":{"radius":2}}])";

TEST(ReadNodes, ReadsATreeWithItsContents) {
    const Parsed<SceneNodes> nodes = read(kHouse);
    ASSERT_TRUE(nodes) << nodes.error();
    ASSERT_EQ(nodes->nodes.size(), 8u);
    EXPECT_EQ(nodes->meshes.size(), 3u) << "a box, a pine that is read once, a sphere";
    const auto& [root, box, smoke, levels, pine, board, small, sphere] =
        std::tie(nodes->nodes[0], nodes->nodes[1], nodes->nodes[2], nodes->nodes[3],
                 nodes->nodes[4], nodes->nodes[5], nodes->nodes[6], nodes->nodes[7]);
    EXPECT_TRUE(root.is_on_ground);
    EXPECT_EQ(root.place.scale, 2.0);
    EXPECT_EQ(box.parent, 0u);
    EXPECT_EQ(nodes->meshes[0].colours[0], (std::array<std::uint8_t, 4>{255, 128, 0, 255}));
    const auto& emitter = std::get<EmitterNode>(smoke.content);
    EXPECT_EQ(emitter.rate, 30.0);
    EXPECT_EQ(emitter.most_particles, 50u);
    EXPECT_EQ(emitter.colours[1][3], 0.0f);
    const auto& by = std::get<SwitchNode>(levels.content);
    EXPECT_EQ(by.limits, (std::vector<double>{80.0, std::numeric_limits<double>::infinity()}));
    EXPECT_EQ(pine.parent, 3u);
    EXPECT_EQ(std::get<BillboardNode>(board.content).axis, BillboardNode::Axis::up);
    EXPECT_EQ(std::get<MeshOfNode>(small.content).mesh, std::get<MeshOfNode>(pine.content).mesh);
    EXPECT_FALSE(sphere.parent);
    EXPECT_EQ(small.path, "nodes[0].children[2].children[1].children[0]");
}

TEST(ReadNodes, AreShownByTheFieldOnTheGround) {
    const auto source = FractalHeights::create({.seed = 5}).value();
    const SceneNodes nodes = read(kHouse).value();
    View view;
    view.eye_world = {10.0, -20.0, source->height(10.0, 20.0) + 10.0};
    ObjectField field =
        ObjectField::create(source, {}, {.picture = view, .has_thread = false}, nullptr).value();
    ASSERT_TRUE(field.add_nodes(nodes, *source, nullptr));
    field.set_time(5.0);
    field.begin_frame(view);
    const SceneDraws draws = field.end_frame(1.0);
    // box and pine; the switch hides its billboard, and the sphere is out of view
    ASSERT_EQ(draws.instances.size(), 2u);
    EXPECT_EQ(field.counts().drawn, 2u);
    EXPECT_NEAR(static_cast<double>(draws.particles.size()), 50.0, 1.0);
    EXPECT_NEAR(draws.instances[0].offset_eye[1], 40.0f, 1e-3f);
    EXPECT_NEAR(draws.instances[0].offset_eye[2], 2.0f - 10.0f, 1e-3f) << "twice a metre up";
    const std::size_t before = field.buried().size();
    ASSERT_TRUE(field.add_nodes(read(R"([{"position":[0,0,-9000],"sphere":{"radius":2}},
                 {"position":[0,0,-9000],"sphere":{"radius":20000}}])")
                                    .value(),
                                *source, nullptr));
    ASSERT_EQ(field.buried().size(), before + 1) << "the other one is too large";
    EXPECT_EQ(field.buried().back().find("nodes[0] is "), 0u) << field.buried().back();
    const Result<void> nowhere = field.add_nodes(
        read(R"([{"position":[1e9,0,0],"on_ground":true}])").value(), *source, nullptr);
    ASSERT_FALSE(nowhere);
    EXPECT_EQ(nowhere.error().message, "nodes[0]: there is no ground at x 1e+09 m, y 0 m");
}

TEST(ReadNodes, EqualSolidsShareAMesh) {
    const SceneNodes nodes = read(R"([
        {"position": [0,0,0], "sphere": {"radius": 1}, "colour": [1,0,0]},
        {"position": [5,0,0], "scale": 2, "sphere": {"radius": 1}, "colour": [1,0,0]},
        {"position": [9,0,0], "sphere": {"radius": 1}, "colour": [0,1,0]},
        {"position": [9,0,9], "sphere": {"radius": 2}, "colour": [1,0,0]}])")
                                 .value();
    std::vector<std::size_t> meshes;
    for (const SceneNode& node : nodes.nodes)
        meshes.push_back(std::get<MeshOfNode>(node.content).mesh);
    EXPECT_EQ(meshes, (std::vector<std::size_t>{0, 0, 1, 2}));
    EXPECT_EQ(nodes.meshes.size(), 3u);
    EXPECT_EQ(nodes.files.size(), 3u);
}

TEST(ReadNodes, ASpriteIsAPictureBelowABillboard) {
    const std::string name = "sprite_" + std::to_string(getpid()) + ".png";
    const auto path = std::filesystem::temp_directory_path() / name;
    ASSERT_TRUE(write_png({.width = 1, .height = 1, .rgb = {255, 128, 0}}, path.string()));
    const auto read_sprite = [&](const std::string& sprite) {
        return read_nodes(
            nlohmann::ordered_json::parse(R"([{"position":[1,2,3],"sprite":)" + sprite + "}]"),
            path.parent_path().string());
    };
    const std::string image = R"({"image":")" + name + '"';
    for (const char* axis : {"up", "screen"}) {
        const auto nodes =
            read_sprite(image + R"(,"size_m":[2,4],"axis":")" + std::string(axis) + R"("})");
        ASSERT_TRUE(nodes) << nodes.error();
        ASSERT_EQ(nodes->nodes.size(), 2u);
        const auto* board = std::get_if<BillboardNode>(&nodes->nodes[0].content);
        ASSERT_NE(board, nullptr);
        EXPECT_EQ(board->axis == BillboardNode::Axis::up, axis == std::string("up"));
        EXPECT_EQ(nodes->nodes[1].parent, 0u);
        ASSERT_EQ(nodes->materials[0].size(), 1u);
        // the normals of an upright sprite point up: it is lit as level ground is
        EXPECT_EQ(nodes->meshes[0].normals[0].dot(Eigen::Vector3f::UnitZ()),
                  axis == std::string("up") ? 1.0f : 0.0f);
        EXPECT_EQ(nodes->materials[0][0].colour_texture.image->width, 1);
        const Aabb box = bounding_box(nodes->meshes[0].positions);
        const Eigen::Vector3d size = box.high - box.low;
        EXPECT_EQ(size,
                  axis == std::string("up") ? Eigen::Vector3d(0, 2, 4) : Eigen::Vector3d(2, 4, 0));
    }
    EXPECT_EQ(read_sprite(image + R"(,"size_m":[2,0]})").error(),
              "nodes[0].sprite.size_m must be above 0 and at most 1e4 m, got [2,0]");
    EXPECT_EQ(read_sprite(image + "}").error(), "nodes[0].sprite.size_m is missing");
    EXPECT_EQ(read_sprite(R"({"size_m":[1,1]})").error(), "nodes[0].sprite.image must be a file");
    EXPECT_EQ(read_sprite("3").error().find("nodes[0].sprite"), 0u);
    EXPECT_EQ(read_sprite(image + R"(,"size_m":[1,1],"axis":"left"})").error(),
              "nodes[0].sprite.axis must be screen or up, got \"left\"");
    EXPECT_EQ(read_sprite(R"({"image":"../x.png","size_m":[1,1]})")
                  .error()
                  .find("nodes[0].sprite.image '../x.png': "),
              0u);
    std::filesystem::remove(path);
}

constexpr const char* kSmokes = R"([
  {"position":[0,0,60], "emitter":{"image":"smoke.png"}},
  {"position":[3,0,60], "emitter":{"seed":1}},
  {"position":[6,0,60], "emitter":{"image":"smoke.png","seed":2}},
  {"position":[0,9,60], "sprite":{"image":"smoke.png","size_m":[1,1]}}])";

TEST(ReadNodes, EmittersAndSpritesShareTheImagesThatTheyName) {
    const Parsed<SceneNodes> nodes = read(kSmokes);
    ASSERT_TRUE(nodes) << nodes.error();
    ASSERT_EQ(nodes->images.size(), 1u);
    EXPECT_EQ(nodes->images[0]->width, 64);
    EXPECT_EQ(nodes->nodes[0].image, 0u);
    EXPECT_FALSE(nodes->nodes[1].image);
    EXPECT_EQ(nodes->nodes[2].image, 0u);
    EXPECT_EQ(nodes->materials[0][0].colour_texture.image, nodes->images[0]);
    const auto error_with = [](const std::string& image) {
        return error_of(R"([{"position":[0,0,0],"emitter":{"image":)" + image + "}}]");
    };
    EXPECT_EQ(error_with("3"), "nodes[0].emitter.image must be a file");
    EXPECT_EQ(error_with(R"("none.png")").find("nodes[0].emitter.image 'none.png': "), 0u);
    EXPECT_EQ(
        error_with(R"("../data/smoke.png")"),
        "nodes[0].emitter.image '../data/smoke.png': it must be in the file's folder or below "
        "it");
    EXPECT_EQ(error_with(R"("house.obj")"),
              "nodes[0].emitter.image 'house.obj': it is no PNG or JPEG image");
}

TEST(ReadNodes, AreShownWithTheImagesOfTheirEmitters) {
    Result<GlContext> context = GlContext::create();
    if (!context) GTEST_SKIP() << context.error().message;
    TerrainRenderer renderer = TerrainRenderer::create(*context, 64, 64, {}).value();
    const auto source = FractalHeights::create({.seed = 5}).value();
    const View view = look_at({3.0, -20.0, 61.0}, {3.0, 0.0, 61.0}, 1.0, 64, 64).value();
    ObjectField field =
        ObjectField::create(source, {}, {.max_error_px = 0.1, .picture = view, .has_thread = false},
                            &renderer)
            .value();
    ASSERT_TRUE(field.add_nodes(read(kSmokes).value(), *source, &renderer));
    field.set_time(5.0);
    field.begin_frame(view);
    const SceneDraws draws = field.end_frame(0.1);
    std::map<ParticleImageId, std::size_t> counts;
    for (const Particle& particle : draws.particles) ++counts[particle.image];
    ASSERT_EQ(counts.size(), 2u) << "an image, and none";
    EXPECT_NEAR(static_cast<double>(counts[ParticleImageId::soft_disc]),
                static_cast<double>(draws.particles.size()) / 3.0, 5.0);
    EXPECT_TRUE(renderer.draw({}, view, draws));
}

TEST(ReadNodes, TakeTheLevelsOfAnArtist) {
    const auto nodes = read(
        R"([{"position":[0,0,0],"mesh":"linden.obj","levels":["linden_far.obj"]},
            {"position":[9,0,0],"mesh":"linden.obj"}])");
    ASSERT_TRUE(nodes) << nodes.error();
    ASSERT_EQ(nodes->meshes.size(), 2u) << "with levels and without";
    ASSERT_EQ(nodes->coarser[0].size(), 1u);
    EXPECT_TRUE(nodes->coarser[1].empty());
    EXPECT_LT(nodes->coarser[0][0].triangles.size(), nodes->meshes[0].triangles.size());
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"mesh":"linden.obj","levels":"far.obj"}])"),
              "nodes[0].levels must be a list of files, got \"far.obj\"");
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"mesh":"linden.obj","levels":["none.obj"]}])")
                  .find("nodes[0].levels[0]: "),
              0u);
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"sphere":{"radius":1},"levels":[]}])"),
              "nodes[0].levels goes with mesh");
    // levels that are not coarser are refused when their field is made
    const auto source = FractalHeights::create({.seed = 5}).value();
    ObjectField field = ObjectField::create(source, {}, {}, nullptr).value();
    const Result<void> added = field.add_nodes(
        read(R"([{"position":[0,0,0],"mesh":"linden_far.obj","levels":["linden.obj"]}])").value(),
        *source, nullptr);
    ASSERT_FALSE(added);
    EXPECT_NE(added.error().message.find("linden_far.obj: level 1 has "), std::string::npos);
}

TEST(ReadNodes, NameWhatTheyRefuse) {
    EXPECT_EQ(error_of(R"({})"), "nodes must be a list, got {}");
    EXPECT_EQ(error_of(R"([{}])"), "nodes[0].position is missing");
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"texture":1}])"), "unknown key 'nodes[0].texture'");
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"mesh":"pine.obj","sphere":{"radius":1}}])"),
              "nodes[0] has a mesh and a sphere: one of them belongs to a child");
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"sphere":{"radius":-1}}])"),
              "nodes[0].sphere.radius must be above 0 and at most 1e5 m, got -1");
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"box":{"half_extents":[1,2]}}])"),
              "nodes[0].box.half_extents must be 3 numbers, got [1,2]");
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"mesh":"none.obj"}])").find("nodes[0].mesh: "), 0u);
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"switch":{"limits":[1,2]}}])"),
              "nodes[0].switch needs one child for each of its 2 limits, got 0");
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"switch":{"limits":["ever"]}}])"),
              "nodes[0].switch.limits must be numbers, or \"always\", got [\"ever\"]");
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"billboard":"left"}])"),
              "nodes[0].billboard must be screen or up, got \"left\"");
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"colour":[1,1,1]}])"),
              "nodes[0].colour goes with sphere, box, capsule or cylinder");
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"sphere":{"radius":1},"colour":[1,2,1]}])"),
              "nodes[0].colour must be 0 to 1, got [1,2,1]");
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"children":[{"on_ground":true}]}])"),
              "nodes[0].children[0].on_ground goes only with nodes without a parent");
    EXPECT_EQ(error_of(R"([{"position":[0,0,0],"emitter":{"per_s":"many"}}])"),
              "nodes[0].emitter.per_s must be a number, got \"many\"");
    std::string deep = R"([{"position":[0,0,0]}])";
    for (int i = 0; i < 80; ++i) {
        deep.insert(0, R"([{"position":[0,0,0],"children":)");
        deep += "}]";
    }
    EXPECT_NE(error_of(deep).find(" is nested more than 64 deep"), std::string::npos);
}

}  // namespace scene_nodes_test
}  // namespace terrane::tools
