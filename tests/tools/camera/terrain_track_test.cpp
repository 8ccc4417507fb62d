// SPDX-License-Identifier: MIT
#include "flight/flight_options.h"
#include "support/heights/wave_heights.h"

#include <gtest/gtest.h>

namespace terrane::tools {
namespace terrain_track_test {

TEST(TerrainTrack, LiesWhereTheRasterSays) {
    DemInfo dem;
    dem.geographic = true;
    dem.crs = "WGS 84";
    dem.centre_x = 12.5;
    dem.centre_y = 41.5;
    dem.metres_per_unit_x = 80'000.0;
    dem.metres_per_unit_y = 111'000.0;
    const GeoReference reference = make_geo_reference(dem);
    EXPECT_TRUE(reference.is_geographic);
    EXPECT_EQ(reference.longitude, 12.5);
    EXPECT_EQ(reference.latitude, 41.5);
    EXPECT_EQ(reference.metres_per_degree_x, 80'000.0);
    EXPECT_EQ(reference.metres_per_degree_y, 111'000.0);
}

TEST(TerrainTrack, SaysWhyThereAreNoDegrees) {
    DemInfo dem;
    EXPECT_EQ(make_geo_reference(std::nullopt).why_not, "this terrain has no raster");
    EXPECT_EQ(make_geo_reference(dem).why_not, "this raster has no CRS");
    dem.crs = "WGS 84 / UTM zone 11N";
    const GeoReference reference = make_geo_reference(dem);
    EXPECT_FALSE(reference.is_geographic);
    EXPECT_EQ(reference.why_not, "this raster's CRS is WGS 84 / UTM zone 11N");
}

TEST(TerrainTrack, RefusesAStartBeyondItsEndByTheNameOfTheFlag) {
    Track track;
    track.has_times = true;
    track.points.resize(2);
    track.points[1].time = 5.0;
    track.points[1].position_world = WorldPos(10.0, 0.0, 0.0);
    const test::WaveHeights source(test::small_world(3, 8.0), 300.0, 2000.0);
    const auto path = follow_track(track, source, {.start = 7.0});
    ASSERT_FALSE(path);
    EXPECT_EQ(path.error().message, "--start-s must be before the track's end at 5 s, got 7 s");
}

}  // namespace terrain_track_test
}  // namespace terrane::tools
