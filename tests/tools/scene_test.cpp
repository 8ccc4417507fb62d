// SPDX-License-Identifier: MIT
#include "scene/scene_bodies.h"
#include "scene/scene_objects.h"
#include "scene/scene_volumes.h"
#include "scene/terrain_options.h"

#include <CLI/CLI.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <variant>

namespace terrane::tools {
namespace terrain_options_test {

TEST(ParseScene, CountsTheRastersPathFromTheSceneFilesFolder) {
    const CommandResult<TerrainOptions> scene =
        parse_scene(R"({"dem":"a/b.tif","seed":7,"detail_m":0.5})", "scenes/one.json");
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(scene->dem, "scenes/a/b.tif");
    EXPECT_EQ(scene->seed, 7u);
    EXPECT_EQ(scene->detail_m, 0.5);
    const CommandResult<TerrainOptions> absolute =
        parse_scene(R"({"dem":"/a/b.tif"})", "s/one.json");
    ASSERT_TRUE(absolute) << absolute.error().message;
    EXPECT_EQ(absolute->dem, "/a/b.tif");
    EXPECT_EQ(absolute->seed, std::nullopt);
}

TEST(ParseScene, RefusesUnknownKeysAndWrongValuesByName) {
    const auto message = [](const char* text) {
        const CommandResult<TerrainOptions> scene = parse_scene(text, "one.json");
        return scene ? std::string() : scene.error().message;
    };
    EXPECT_NE(message(R"({"seed":1,"cave":2})").find("'cave'"), std::string::npos);
    EXPECT_NE(message(R"({"seed":-1})").find("-1"), std::string::npos);
    EXPECT_NE(message(R"({"seed":1,"detail_m":0})").find("detail_m"), std::string::npos);
    EXPECT_NE(message(R"({"dem":5})").find("dem"), std::string::npos);
    EXPECT_NE(message(R"({"seed":1,"fractal":"rigid"})").find("\"rigid\""), std::string::npos);
    EXPECT_NE(message(R"({"seed":1,"fractal":2})").find("fbm, ridged"), std::string::npos);
    EXPECT_NE(message(R"({"seed":1,"imagery":7})").find("imagery must be a path"),
              std::string::npos);
    EXPECT_NE(message(R"({"seed":1,"imagery":{"file":"a.tif","band":1}})").find("'imagery.band'"),
              std::string::npos);
    EXPECT_NE(message(R"({"seed":1,"imagery":{"file":"a.tif","bands":[1,2]}})").find("[1,2]"),
              std::string::npos);
    EXPECT_NE(message(R"({"seed":1,"water_m":"deep"})").find("water_m must be a number"),
              std::string::npos);
    EXPECT_NE(message("{}").find("names no terrain"), std::string::npos);
    EXPECT_NE(message("[]").find("one.json"), std::string::npos);
    EXPECT_NE(message("{\"seed\":").find("one.json"), std::string::npos);
}

TEST(OpenTerrain, TakesTheLargestPowerOfTwoForAFractal) {
    const auto spacing = [](double detail_m) {
        TerrainOptions options;
        options.seed = 1;
        options.detail_m = detail_m;
        const CommandResult<Terrain> terrain = open_terrain(options);
        return terrain ? terrain->source->lattice().spacing : -1.0;
    };
    EXPECT_EQ(spacing(1.0), 1.0);
    EXPECT_EQ(spacing(1.999), 1.0);
    EXPECT_EQ(spacing(0.999), 0.5);
    EXPECT_EQ(spacing(30.0), 16.0);
}

TEST(ParseScene, TakesTheKindOfAFractal) {
    const CommandResult<TerrainOptions> scene =
        parse_scene(R"({"seed":7,"fractal":"warped"})", "one.json");
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(scene->fractal, FractalKind::warped);
}

TEST(ParseScene, TakesImageryAsAFileOrWithBands) {
    const auto plain = parse_scene(R"({"seed":7,"imagery":"i.tif"})", "s/one.json");
    ASSERT_TRUE(plain) << plain.error().message;
    EXPECT_EQ(plain->imagery->raster, "s/i.tif");
    EXPECT_TRUE(plain->imagery->bands.empty());
    const auto banded =
        parse_scene(R"({"seed":7,"imagery":{"file":"/i.tif","bands":[3,2,1]}})", "s/one.json");
    ASSERT_TRUE(banded) << banded.error().message;
    EXPECT_EQ(banded->imagery->raster, "/i.tif");
    EXPECT_EQ(banded->imagery->bands, (std::vector<int>{3, 2, 1}));
}

TEST(ParseScene, TakesALevelOfWater) {
    const CommandResult<TerrainOptions> scene =
        parse_scene(R"({"seed":7,"water_m":-2.5})", "one.json");
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(scene->water_m, -2.5);
    EXPECT_EQ(parse_scene(R"({"seed":7})", "one.json")->water_m, std::nullopt);
}

/// Parses a command line and opens its terrain.
CommandResult<Terrain> open_line(const std::string& line) {
    CLI::App app;
    TerrainOptions options;
    add_terrain_options(app, options);
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

TEST(OpenTerrain, TheWorldOfASeedIsEndlessOrOfTheGivenSide) {
    struct Case {
        const char* flags;
        double spacing, root_size, origin_x, origin_y;
        std::int32_t root_window;
    };
    for (const Case& wanted :
         {Case{"", 1.0, 0x1p16, 0.0, 0.0, 4},
          {"--start-m 1e9,-2e9", 1.0, 0x1p16, 15259 * 0x1p16, -30518 * 0x1p16, 4},
          {"--detail-m 300", 256.0, 0x1p16, 0.0, 0.0, 4},
          {"--detail-m 0.25 --start-m 1e9,-1e8", 0.25, 0x1p16, 15259 * 0x1p16, -1526 * 0x1p16, 4},
          {"--detail-m 0.001 --start-m -1073741824,1073741824", 0x1p-10, 0x1p16, 0x1p16 - 0x1p30,
           0x1p30 - 0x1p16, 4},
          {"--world-m 131072", 1.0, 0x1p16, 0.0, 0.0, 0},
          {"--world-m 131071 --detail-m 0.001", 0x1p-10, 0x1p16, 0.0, 0.0, 0},
          {"--world-m 256", 1.0, 128.0, 0.0, 0.0, 0}}) {
        SCOPED_TRACE(wanted.flags);
        const CommandResult<Terrain> terrain = open_line(std::string("--seed 3 ") + wanted.flags);
        ASSERT_TRUE(terrain) << terrain.error().message;
        const Lattice& lattice = terrain->source->lattice();
        EXPECT_EQ(lattice.spacing, wanted.spacing);
        EXPECT_EQ(lattice.root_size(), wanted.root_size);
        EXPECT_EQ(lattice.origin_x, wanted.origin_x);
        EXPECT_EQ(lattice.origin_y, wanted.origin_y);
        EXPECT_EQ(lattice.root_window, wanted.root_window);
        EXPECT_EQ(lattice.resident_root_count(), wanted.root_window == 0 ? 4 : 16);
    }
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

TEST(OpenTerrain, RefusesKindsThatAreNoneAndKindsWithoutAFractal) {
    try {
        static_cast<void>(open_line("--seed 3 --fractal rigid"));
        FAIL() << "accepted";
    } catch (const CLI::ParseError& error) {
        EXPECT_NE(std::string(error.what()).find("fbm, ridged, hybrid or warped, got 'rigid'"),
                  std::string::npos)
            << error.what();
    }
    for (const char* line : {"--fractal ridged", "--seed 3 --dem x.tif --fractal ridged"}) {
        const CommandResult<Terrain> terrain = open_line(line);
        ASSERT_FALSE(terrain) << line;
        EXPECT_EQ(terrain.error().exit_code, exit_usage);
        EXPECT_NE(terrain.error().message.find("--fractal goes with --seed"), std::string::npos);
    }
}

TEST(OpenTerrain, IsAUsageErrorWithoutATerrainOrWithAnImpossibleSpacing) {
    TerrainOptions options;
    EXPECT_EQ(open_terrain(options).error().exit_code, exit_usage);
    options.seed = 1;
    for (const double detail_m :
         {0.0, -1.0, 1e-9, 1e9, std::nan(""), std::numeric_limits<double>::infinity()}) {
        options.detail_m = detail_m;
        const CommandResult<Terrain> terrain = open_terrain(options);
        ASSERT_FALSE(terrain) << detail_m;
        EXPECT_EQ(terrain.error().exit_code, exit_usage) << detail_m;
        EXPECT_NE(terrain.error().message.find("--detail-m"), std::string::npos);
    }
}

TEST(OpenTerrain, FailsForASceneThatCannotBeRead) {
    TerrainOptions options;
    for (const char* path : {"no/such/scene.json", "/"}) {
        options.scene = path;
        const CommandResult<Terrain> terrain = open_terrain(options);
        ASSERT_FALSE(terrain) << path;
        EXPECT_EQ(terrain.error().exit_code, exit_failed);
        EXPECT_NE(terrain.error().message.find(path), std::string::npos);
    }
}

}  // namespace terrain_options_test

namespace scene_test {

std::string message_of(const std::string& rest) {
    const CommandResult<TerrainOptions> scene =
        parse_scene(R"({"seed":1,)" + rest + "}", "s/one.json");
    return scene ? "" : scene.error().message;
}

/// The message for one body.
std::string of_body(const std::string& rest) {
    return message_of(R"("bodies":[{"shape":{"sphere":{"radius":1}},"position":[0,0,0]},{)" + rest +
                      "}]");
}

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

TEST(SceneBodies, AreRefusedByThePathOfTheKeyAndTheValue) {
    const std::string ball = R"("shape":{"sphere":{"radius":1}},"position":[0,0,0])";
    EXPECT_EQ(of_body(ball + R"(,"mass":-1)"),
              "scene 's/one.json': bodies[1].mass must be 1e-09 to 1e+12, got -1");
    EXPECT_EQ(of_body(ball + R"(,"mass":"heavy")"),
              R"(scene 's/one.json': bodies[1].mass must be a number, got "heavy")");
    EXPECT_EQ(of_body(ball + R"(,"friction":-0.5)"),
              "scene 's/one.json': bodies[1].friction must be 0 to 1e+06, got -0.5");
    EXPECT_EQ(of_body(ball + R"(,"restitution":2)"),
              "scene 's/one.json': bodies[1].restitution must be 0 to 1, got 2");
    EXPECT_EQ(of_body(ball + R"(,"colour":"red")"),
              "scene 's/one.json': unknown key 'bodies[1].colour'");
    EXPECT_EQ(of_body(ball + R"(,"positoin":1)"),
              "scene 's/one.json': unknown key 'bodies[1].positoin'; did you mean position?");
    EXPECT_EQ(
        of_body(ball + R"(,"type":"fixed")"),
        "scene 's/one.json': bodies[1].type must be dynamic, static or kinematic, got \"fixed\"");
    EXPECT_EQ(
        of_body(ball + R"(,"type":"static","mass":5)"),
        "scene 's/one.json': bodies[1].mass is of dynamic bodies only, got 5 and type \"static\"");
    EXPECT_EQ(of_body(ball + R"(,"type":"static","velocity":[0,0,1])"),
              "scene 's/one.json': bodies[1].velocity must be 0 of a static body, got [0,0,1]");
    EXPECT_EQ(of_body(ball + R"(,"spin":[1e9,0,0])"),
              "scene 's/one.json': bodies[1].spin must be -1e6 to 1e6 along each axis, got "
              "[1000000000.0,0,0]");
    EXPECT_EQ(of_body(ball + R"(,"rotation":[2,0,0,0])"),
              "scene 's/one.json': bodies[1].rotation must be [w, x, y, z] of length 1 to 1e-6, "
              "got length 2");
    EXPECT_EQ(of_body(R"("shape":{"sphere":{"radius":1}})"),
              "scene 's/one.json': bodies[1].position is missing");
    EXPECT_EQ(of_body(R"("shape":{"sphere":{"radius":1}},"position":[0,0])"),
              "scene 's/one.json': bodies[1].position must be 3 numbers, got [0,0]");
    EXPECT_EQ(of_body(R"("position":[0,0,0])"), "scene 's/one.json': bodies[1].shape is missing");
    EXPECT_EQ(of_body(R"("shape":{"cube":{}},"position":[0,0,0])"),
              "scene 's/one.json': bodies[1].shape must be sphere, capsule, box, hull or compound, "
              "got \"cube\"");
    EXPECT_EQ(of_body(R"("shape":{"sphere":{}},"position":[0,0,0])"),
              "scene 's/one.json': bodies[1].shape: radius is missing");
    EXPECT_EQ(of_body(R"("shape":{"sphere":{"radius":0}},"position":[0,0,0])"),
              "scene 's/one.json': bodies[1].shape must have a thickness, got "
              "{\"sphere\":{\"radius\":0}}");
    EXPECT_EQ(of_body(R"("shape":{"sphere":{"radius":1,"r":2}},"position":[0,0,0])"),
              "scene 's/one.json': unknown key 'bodies[1].shape.sphere.r'");
    EXPECT_EQ(
        of_body(
            R"("shape":{"compound":[{"shape":{"box":{"half_extents":[1,1,1],"x":2}}}]},"position":[0,0,0])"),
        "scene 's/one.json': unknown key 'bodies[1].shape.compound[0].shape.box.x'");
    EXPECT_EQ(message_of(R"("bodies":[7])"),
              "scene 's/one.json': bodies[0] must be an object, got 7");
    EXPECT_EQ(message_of(R"("bodies":{})"), "scene 's/one.json': bodies must be a list, got {}");
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

TEST(SceneSurface, IsRefusedByThePathOfTheKeyAndTheValue) {
    const auto of = [](const std::string& surface) {
        return message_of(R"("surface":)" + surface);
    };
    EXPECT_EQ(of("5"), "scene 's/one.json': surface must be a path or a list of rectangles, got 5");
    EXPECT_EQ(of(R"([{"rect":[0,0,1,1],"friction":-1}])"),
              "scene 's/one.json': surface[0].friction must be 0 to 1e+06, got -1");
    EXPECT_EQ(of(R"([{"rect":[0,0,1,1]}])"), "scene 's/one.json': surface[0].friction is missing");
    EXPECT_EQ(of(R"([{"rect":[0,0,1],"friction":1}])"),
              "scene 's/one.json': surface[0].rect must be 4 numbers, got [0,0,1]");
    EXPECT_EQ(of(R"([{"rect":[2,0,1,1],"friction":1}])"),
              "scene 's/one.json': surface[0].rect must be [west, south, east, north] with west <= "
              "east and "
              "south <= north, got [2,0,1,1]");
    EXPECT_EQ(of(R"([{"rect":[0,0,1,1],"friction":1,"ice":1}])"),
              "scene 's/one.json': unknown key 'surface[0].ice'");
}

TEST(ParseScene, RefusesDeepBrackets) {
    const std::string deep(100'000, '[');
    EXPECT_NE(message_of("\"seed\":" + deep).find("deeper than 64"), std::string::npos);
    EXPECT_NE(message_of("\"bodeis\":[]").find("did you mean bodies?"), std::string::npos);
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
