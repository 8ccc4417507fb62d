// SPDX-License-Identifier: MIT
#include "scene/terrain_options.h"

#include <CLI/CLI.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>

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
}  // namespace terrane::tools
