// SPDX-License-Identifier: MIT
#include "options/terrain_options.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace terrane::tools {
namespace {

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

}  // namespace
}  // namespace terrane::tools
