// SPDX-License-Identifier: MIT
#include "scene/scene_bodies.h"
#include "scene/scene_objects.h"
#include "scene/scene_volumes.h"
#include "scene/terrain_options.h"

#include <CLI/CLI.hpp>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <set>
#include <string>
#include <variant>

namespace terrane::tools {
namespace terrain_options_test {

TEST(ParseScene, CountsPathsFromTheSceneFilesFolder) {
    const auto dem = [](const char* text) { return parse_scene(text, "scenes/one.json")->dem; };
    EXPECT_EQ(dem(R"({"dem":"a/b.tif","seed":7,"detail_m":0.5})"), "scenes/a/b.tif");
    EXPECT_EQ(dem(R"({"dem":"/a/b.tif"})"), "/a/b.tif");
    const auto plain = parse_scene(R"({"seed":7,"imagery":"i.tif"})", "s/one.json");
    ASSERT_TRUE(plain) << plain.error().message;
    EXPECT_EQ(plain->imagery->raster, "s/i.tif");
    EXPECT_TRUE(plain->imagery->settings.bands.empty());
    const auto banded =
        parse_scene(R"({"seed":7,"imagery":{"file":"/i.tif","bands":[3,2,1],"percentiles":[2,98],)"
                    R"("gamma":1.5}})",
                    "s/one.json");
    ASSERT_TRUE(banded) << banded.error().message;
    EXPECT_EQ(banded->imagery->raster, "/i.tif");
    EXPECT_EQ(banded->imagery->settings.bands, (std::vector<int>{3, 2, 1}));
    EXPECT_EQ(banded->imagery->settings.percentiles, (std::array<double, 2>{2.0, 98.0}));
    EXPECT_EQ(banded->imagery->settings.limits, std::nullopt);
    EXPECT_EQ(banded->imagery->settings.gamma, 1.5);
}

TEST(ParseScene, CountsTheFilesOfSubdatasetsFromTheSceneFilesFolder) {
    const std::filesystem::path folder = testing::TempDir();
    const std::string file = (folder / "sea.nc").string();
    std::ofstream(file) << "some bytes";
    for (const auto& [name, wanted] : std::vector<std::pair<std::string, std::string>>{
             {"NETCDF:\"sea.nc\":depth", "NETCDF:\"" + file + "\":depth"},
             {"NETCDF:sea.nc:depth", "NETCDF:" + file + ":depth"},
             {"GTIFF_DIR:2:sea.nc", "GTIFF_DIR:2:" + file},
             {"vrt://sea.nc?bands=2", "vrt://" + file + "?bands=2"},
             {"NETCDF:\"" + file + "\":depth", "NETCDF:\"" + file + "\":depth"},
             {"PG:dbname='ground'", "PG:dbname='ground'"},
             {"sea.nc", file}}) {
        EXPECT_EQ(raster_path(folder, name), wanted);
    }
    std::filesystem::remove(file);
}

TEST(ParseScene, TakesTheSettingsOfATerrain) {
    const CommandResult<TerrainOptions> scene =
        parse_scene(R"({"seed":7,"detail_m":0.5,"fractal":"warped","water_m":-2.5})", "one.json");
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(scene->seed, 7u);
    EXPECT_EQ(scene->detail_m, 0.5);
    EXPECT_EQ(scene->fractal, FractalKind::warped);
    ASSERT_TRUE(scene->water);
    EXPECT_EQ(scene->water->level, -2.5);
    EXPECT_EQ(scene->water->has_waves, std::nullopt);
    const auto other = parse_scene(R"({"dem":"a.tif"})", "one.json");
    ASSERT_TRUE(other) << other.error().message;
    EXPECT_EQ(other->seed, std::nullopt);
    EXPECT_FALSE(other->water);
    EXPECT_FALSE(other->materials);
}

TEST(ParseScene, TakesTheMaterialsOfTheGroundAndWater) {
    const auto scene = parse_scene(
        R"({"seed":1,"materials":{"palette":"desert","snow_line_m":1800,"rock_slope":0.7,
            "occlusion":0.25},"water":{"level_m":3,"waves":false}})",
        "one.json");
    ASSERT_TRUE(scene) << scene.error().message;
    ASSERT_TRUE(scene->materials);
    EXPECT_EQ(scene->materials->palette, GroundPalette::desert);
    EXPECT_EQ(scene->materials->snow_line, 1800.0);
    EXPECT_EQ(scene->materials->rock_slope, 0.7);
    EXPECT_EQ(scene->materials->occlusion, 0.25);
    EXPECT_EQ(scene->water->level, 3.0);
    EXPECT_EQ(scene->water->has_waves, false);
    const auto bare = parse_scene(R"({"seed":1,"materials":{}})", "one.json");
    ASSERT_TRUE(bare) << bare.error().message;
    EXPECT_TRUE(bare->materials);
    EXPECT_EQ(bare->materials->palette, std::nullopt);
}

TEST(ParseScene, RefusesUnknownKeysAndWrongValuesByName) {
    for (const auto& [text, word] : std::vector<std::pair<std::string, const char*>>{
             {R"({"seed":1,"cave":2})", "'cave'"},
             {R"({"seed":-1})", "-1"},
             {R"({"seed":1,"detail_m":0})", "detail_m"},
             {R"({"dem":5})", "dem"},
             {R"({"seed":1,"fractal":"rigid"})", "\"rigid\""},
             {R"({"seed":1,"fractal":2})", "fbm, ridged"},
             {R"({"seed":1,"imagery":7})", "imagery must be a path"},
             {R"({"seed":1,"imagery":{"file":"a.tif","band":1}})", "'imagery.band'"},
             {R"({"seed":1,"imagery":{"file":"a.tif","bands":[1,2]}})", "[1,2]"},
             {R"({"seed":1,"imagery":{"file":"a.tif","limits":[1]}})", "imagery.limits"},
             {R"({"seed":1,"imagery":{"file":"a.tif","percentiles":"2"}})", "imagery.percentiles"},
             {R"({"seed":1,"imagery":{"file":"a.tif","gamma":11}})", "imagery.gamma"},
             {R"({"seed":1,"water_m":"deep"})", "water_m must be a number"},
             {R"({"seed":1,"water_m":1e10})", "water_m must be a number within 1e9"},
             {R"({"seed":1,"water_m":1,"water":{"level_m":1}})", "exclude each other"},
             {R"({"seed":1,"water":{"waves":true}})", "water.level_m is missing"},
             {R"({"seed":1,"water":{"level_m":1,"waves":1}})", "water.waves must be true or false"},
             {R"({"seed":1,"water":{"level":1}})", "'water.level'"},
             {R"({"seed":1,"materials":{"palette":"mars"}})", "temperate, desert, moon"},
             {R"({"seed":1,"materials":{"rock_slope":-1}})", "materials.rock_slope"},
             {R"({"seed":1,"materials":{"snow":1}})", "'materials.snow'"},
             {R"({"dem":"a.tif","height_unit":7})", "height_unit must be a unit, got 7"},
             {R"({"dem":"a.tif","height_scale":0})", "height_scale"},
             {R"({"dem":"a.tif","nodata":["x"]})", "nodata"},
             {R"({"dem":"a.tif","encoding":"rgb"})", "terrarium or mapbox, got \"rgb\""},
             {R"({"dem":"a.tif","cell_m":-1})", "cell_m"},
             {R"({"dem":"a.tif","crop":[1,2,1,3]})", "crop must be west,south,east,north"},
             {R"({"dem":"a.tif","crop":"all"})", "crop must be west,south,east,north"},
             {R"({"seed":)" + std::string(100'000, '['), "deeper than 64"},
             {R"({"seed":)" + std::string(60, '[') + std::string(60, ']') + "}", "[[[..."},
             {R"({"seed":")" + std::string(55, 'a') + "\u00fc\u00fc\u00fc\"}", "a..."},
             {"{}", "names no terrain"},
             {"[1]", "scene 'one.json' must be a JSON object, got [1]"},
             {"", "'one.json': line 1, column 1: "},
             {"{\n  \"seed\": 7,\n}", "'one.json': line 3, column 1: "},
             {"\xef\xbb\xbf{\n\"seed\" 7}", "'one.json': line 2, column 8: "},
             {"{\"seed\": 1e999}", "'one.json': number overflow parsing '1e999'"},
             {"{\"seed\": 7, // note\n}", "'one.json': line 1, column 13: "},
             {"\xff\xfe{\0", "'one.json': UTF-16 text"}}) {
        const CommandResult<TerrainOptions> scene = parse_scene(text, "one.json");
        ASSERT_FALSE(scene) << text;
        EXPECT_NE(scene.error().message.find(word), std::string::npos) << scene.error().message;
    }
}

/// Parses a command line and opens its terrain.
CommandResult<Terrain> open_line(const std::string& line) {
    CLI::App app;
    TerrainOptions options;
    add_terrain_options(app, options, {});
    app.parse(line);
    return open_terrain(options);
}

TEST(OpenTerrain, EveryKindOfFractalIsAnotherGround) {
    std::set<double> heights;
    for (const char* kind : {"fbm", "ridged", "hybrid", "warped"}) {
        const CommandResult<Terrain> terrain = open_line(std::string("--seed 3 --fractal ") + kind);
        ASSERT_TRUE(terrain) << terrain.error().message;
        heights.insert(terrain->source->height(123.0, 456.0));
    }
    EXPECT_EQ(heights.size(), 4u);
    const CommandResult<Terrain> unsaid = open_line("--seed 3");
    const CommandResult<Terrain> fbm = open_line("--seed 3 --fractal fbm");
    ASSERT_TRUE(unsaid && fbm);
    EXPECT_EQ(unsaid->source->height(123.0, 456.0), fbm->source->height(123.0, 456.0));
    EXPECT_EQ(unsaid->name, fbm->name);
}

TEST(OpenTerrain, CommandsWorkAroundTheirStart) {
    const auto region = [](const std::string& flags) {
        const CommandResult<Terrain> terrain = open_line("--seed 3 " + flags);
        EXPECT_TRUE(terrain);
        EXPECT_EQ(start_of(*terrain), terrain->start.value_or(WorldVec2(0.0, 0.0)));
        return work_region(*terrain);
    };
    EXPECT_EQ(region(""), (WorldRect{-65536.0, -65536.0, 65536.0, 65536.0}));
    EXPECT_EQ(region("--start-m 1e9,-5"),
              (WorldRect{1e9 - 65536.0, -65541.0, 1e9 + 65536.0, 65531.0}));
    EXPECT_EQ(region("--start-m 2147483648,0"),
              (WorldRect{0x1p31 - 65536.0, -65536.0, 0x1p31, 65536.0}));
    EXPECT_EQ(region("--world-m 65536"), (WorldRect{-32768.0, -32768.0, 32768.0, 32768.0}));
}

}  // namespace terrain_options_test

namespace scene_test {

TEST(SceneBodies, HaveEveryShapeAndType) {
    const CommandResult<TerrainOptions> scene = parse_scene(R"({"seed":1,"bodies":[
        {"shape":{"sphere":{"radius":0.5}},"position":[1,2,3],"velocity":[4,5,6],"spin":[7,8,9],"mass":20,
         "friction":0.3,"restitution":0.9},
        {"shape":{"capsule":{"radius":0.4,"half_height":1}},"position":[0,0,5],"type":"kinematic","velocity":[0,1,0]},
        {"shape":{"box":{"half_extents":[1,2,3]}},"position":[0,0,0],"rotation":[0,1,0,0],"type":"static"},
        {"shape":{"hull":{"points":[[0,0,0],[1,0,0],[0,1,0],[0,0,1]]}},"position":[0,0,9],"type":"dynamic"},
        {"shape":{"compound":[{"shape":{"sphere":{"radius":1}}},
                              {"shape":{"box":{"half_extents":[1,1,1]}},"position":[2,0,0]}]},"position":[0,9,9]}]})",
                                                            "one.json");
    ASSERT_TRUE(scene) << scene.error().message;
    const std::vector<PlacedBody>& bodies = scene->bodies;
    ASSERT_EQ(bodies.size(), 5u);
    for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(bodies[i].settings.shape.index(), i);
    const PlacedBody& ball = bodies[0];
    EXPECT_EQ(ball.settings.type, BodyType::dynamic_body);
    EXPECT_EQ(ball.settings.mass, 20.0);
    EXPECT_EQ(ball.settings.friction, 0.3);
    EXPECT_EQ(ball.settings.restitution, 0.9);
    EXPECT_EQ(ball.state.pose.translation, WorldPos(1.0, 2.0, 3.0));
    EXPECT_EQ(ball.state.velocity, Eigen::Vector3d(4.0, 5.0, 6.0));
    EXPECT_EQ(ball.state.angular_velocity, Eigen::Vector3d(7.0, 8.0, 9.0));
    EXPECT_EQ(bodies[1].settings.type, BodyType::kinematic_body);
    EXPECT_EQ(bodies[2].settings.type, BodyType::static_body);
    EXPECT_EQ(bodies[2].state.pose.rotation(1, 1), -1.0);
    EXPECT_EQ(bodies[3].settings.mass, BodySettings{}.mass);
    EXPECT_EQ(bodies[3].settings.friction, BodySettings{}.friction);
    EXPECT_EQ(std::get<Compound>(bodies[4].settings.shape).parts().size(), 2u);
}

TEST(SceneSurface, OfRectanglesGivesFrictionByPlace) {
    const CommandResult<TerrainOptions> scene = parse_scene(R"({"seed":1,"surface":[
        {"rect":[-10,-20,30,40],"friction":0.1},{"rect":[0,0,5,5],"friction":0.9,"restitution":0.5}]})",
                                                            "one.json");
    ASSERT_TRUE(scene) << scene.error().message;
    const auto map = open_surface(*scene->surface, nullptr);
    ASSERT_TRUE(map);
    EXPECT_EQ((*map)->at(-5.0, 39.0).friction, 0.1);
    EXPECT_EQ((*map)->at(2.0, 2.0).friction, 0.9);
    EXPECT_EQ((*map)->at(2.0, 2.0).restitution, 0.5);
    EXPECT_EQ((*map)->at(99.0, 0.0).friction, SurfaceProperties{}.friction);
}

TEST(SceneSurface, OfARasterIsFoundFromTheScenesFolder) {
    const CommandResult<TerrainOptions> scene =
        parse_scene(R"({"seed":1,"surface":"a/ice.tif"})", "scenes/one.json");
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(scene->surface->raster, "scenes/a/ice.tif");
    const auto map = open_surface(*scene->surface, nullptr);
    ASSERT_FALSE(map);
    EXPECT_NE(map.error().message.find("scenes/a/ice.tif"), std::string::npos);
}

TEST(SceneContent, IsRefusedByThePathOfTheKeyAndTheValue) {
    struct Fault {
        std::string content, key, value;
    };
    // of the second body, with a shape and a position or without
    const auto of_body = [](const std::string& rest) {
        return R"("bodies":[{"shape":{"sphere":{"radius":1}},"position":[0,0,0]},{)" + rest + "}]";
    };
    const auto of_ball = [&](const std::string& rest) {
        return of_body(R"("shape":{"sphere":{"radius":1}},"position":[0,0,0],)" + rest);
    };
    const auto of_shape = [&](const std::string& shape) {
        return of_body(R"("position":[0,0,0],"shape":)" + shape);
    };
    const std::string box = R"({"shape":{"box":{"half_extents":[1,1,1],"x":2}}})";
    for (const auto& [content, key, value] : {
             Fault{of_ball(R"("mass":-1)"), "bodies[1].mass", "got -1"},
             Fault{of_ball(R"("mass":"heavy")"), "bodies[1].mass", R"(got "heavy")"},
             Fault{of_ball(R"("friction":-0.5)"), "bodies[1].friction", "got -0.5"},
             Fault{of_ball(R"("restitution":2)"), "bodies[1].restitution", "got 2"},
             Fault{of_ball(R"("colour":"red")"), "unknown key 'bodies[1].colour'", ""},
             Fault{of_ball(R"("positoin":1)"), "'bodies[1].positoin'", "did you mean position?"},
             Fault{of_ball(R"("type":"fixed")"), "bodies[1].type", R"(got "fixed")"},
             Fault{of_ball(R"("type":"static","mass":5)"), "bodies[1].mass", "got 5"},
             Fault{of_ball(R"("type":"static","velocity":[0,0,1])"), "bodies[1].velocity",
                   "got [0,0,1]"},
             Fault{of_ball(R"("spin":[1e9,0,0])"), "bodies[1].spin", "got [1000000000.0,0,0]"},
             Fault{of_ball(R"("rotation":[2,0,0,0])"), "bodies[1].rotation", "got length 2"},
             Fault{of_body(R"("shape":{"sphere":{"radius":1}})"), "bodies[1].position is missing",
                   ""},
             Fault{of_body(R"("shape":{"sphere":{"radius":1}},"position":[0,0])"),
                   "bodies[1].position", "got [0,0]"},
             Fault{of_body(R"("position":[0,0,0])"), "bodies[1].shape is missing", ""},
             Fault{of_shape(R"({"cube":{}})"), "bodies[1].shape", R"(got "cube")"},
             Fault{of_shape(R"({"sphere":{}})"), "bodies[1].shape: radius is missing", ""},
             Fault{of_shape(R"({"sphere":{"radius":0}})"), "bodies[1].shape", R"("radius":0)"},
             Fault{of_shape(R"({"sphere":{"radius":1,"r":2}})"), "'bodies[1].shape.sphere.r'", ""},
             Fault{of_shape(R"({"compound":[)" + box + "]}"),
                   "'bodies[1].shape.compound[0].shape.box.x'", ""},
             Fault{of_ball(R"("node":7)"), "bodies[1].node", "got 7"},
             Fault{of_ball(R"("node":{"sphere":{"radius":1},"mas":1})"),
                   "unknown key 'bodies[1].node.mas'", ""},
             Fault{of_ball(R"("node":{"children":[{},{"mesh":"none.obj"}]})"),
                   "bodies[1].node.children[1].mesh: ", "none.obj"},
             Fault{of_ball(R"("node":{"on_ground":true})"),
                   "bodies[1].node.on_ground does not go with the node of a body", ""},
             Fault{R"("bodies":[7])", "bodies[0]", "got 7"},
             Fault{R"("bodies":{})", "bodies must be a list", "got {}"},
             Fault{R"("bodeis":[])", "'bodeis'", "did you mean bodies?"},
             Fault{R"("surface":5)", "surface", "got 5"},
             Fault{R"("surface":[{"rect":[0,0,1,1],"friction":-1}])", "surface[0].friction",
                   "got -1"},
             Fault{R"("surface":[{"rect":[0,0,1,1]}])", "surface[0].friction is missing", ""},
             Fault{R"("surface":[{"rect":[0,0,1],"friction":1}])", "surface[0].rect",
                   "got [0,0,1]"},
             Fault{R"("surface":[{"rect":[2,0,1,1],"friction":1}])", "surface[0].rect",
                   "got [2,0,1,1]"},
             Fault{R"("surface":[{"rect":[0,0,1,1],"friction":1,"ice":1}])", "'surface[0].ice'",
                   ""},
         }) {
        const auto scene = parse_scene(R"({"seed":1,)" + content + "}", "s/one.json");
        ASSERT_FALSE(scene) << content;
        const std::string& said = scene.error().message;
        EXPECT_TRUE(said.starts_with("scene 's/one.json': ")) << said;
        EXPECT_NE(said.find(key), std::string::npos) << said;
        EXPECT_NE(said.find(value), std::string::npos) << said;
    }
}

}  // namespace scene_test

namespace scene_volumes_test {

constexpr const char* kBall =
    R"({"op":"remove","shape":{"sphere":{"radius":5}},"position":[10,20,0],"voxel_m":2})";

/// A scene file over a fractal.
class VolumeScene : public testing::Test {
protected:
    void SetUp() override {
        std::random_device entropy;
        path_ = (std::filesystem::temp_directory_path() /
                 ("terrane_scene_" + std::to_string(entropy()) + ".json"))
                    .string();
    }
    void TearDown() override { std::filesystem::remove(path_); }
    CommandResult<Terrain> open(const std::string& rest) const {
        std::ofstream(path_) << R"({"seed":1,)" << rest << "}";
        TerrainOptions options;
        options.scene = path_;
        return open_terrain(options);
    }
    std::string path_;
};

TEST_F(VolumeScene, IsRefusedOrGivesTheGroundWithVolumes) {
    const CommandResult<Terrain> terrain = open(std::string(R"("volumes":[)") + kBall + "]");
    if (!terrain) {
        // a program without terrane::volume
        EXPECT_EQ(terrain.error().exit_code, exit_failed);
        EXPECT_NE(terrain.error().message.find("TERRANE_VOLUME"), std::string::npos);
        return;
    }
    ASSERT_NE(terrain->volumes, nullptr);
    EXPECT_NE(terrain->heightfield, terrain->source);
    EXPECT_EQ(heightfield_of(*terrain), terrain->heightfield);
    const nlohmann::ordered_json said = describe_volumes(*terrain->volumes);
    ASSERT_EQ(said.size(), 1u);
    EXPECT_EQ(said[0]["op"], "remove");
    EXPECT_EQ(said[0]["shape"], "sphere");
    EXPECT_EQ(said[0]["voxel_m"], 1.0);
    EXPECT_EQ(said[0]["bounds_m"], (nlohmann::ordered_json{{5, 15, -5}, {15, 25, 5}}));
}

TEST_F(VolumeScene, WithoutVolumesIsTheGroundItself) {
    const CommandResult<Terrain> terrain = open(R"("volumes":[])");
    ASSERT_TRUE(terrain) << terrain.error().message;
    EXPECT_EQ(terrain->volumes, nullptr);
    EXPECT_EQ(terrain->heightfield, nullptr);
    EXPECT_EQ(heightfield_of(*terrain), terrain->source);
    const auto same = with_volumes(*terrain, terrain->source);
    ASSERT_TRUE(same);
    EXPECT_EQ(*same, terrain->source);
}

// Volumes are added to a wrapper of the heightfield, such as slow storage, and are still there.
TEST_F(VolumeScene, PutsItsVolumesOnAnotherSource) {
    const CommandResult<Terrain> terrain = open(std::string(R"("volumes":[)") + kBall + "]");
    if (!terrain) GTEST_SKIP() << "built without terrane::volume";
    const auto again = with_volumes(*terrain, heightfield_of(*terrain));
    ASSERT_TRUE(again);
    EXPECT_NE(*again, terrain->heightfield);
    EXPECT_EQ((*again)->interval({9.0, 19.0, 11.0, 21.0}).low,
              terrain->source->interval({9.0, 19.0, 11.0, 21.0}).low);
}

}  // namespace scene_volumes_test
}  // namespace terrane::tools
