// SPDX-License-Identifier: MIT
#include "scene/scene_volumes.h"

#include "scene/terrain_options.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <string>

namespace terrane::tools {
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
