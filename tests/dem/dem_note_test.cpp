// SPDX-License-Identifier: MIT
#include <terrane/dem/dem_note.h>

#include <gtest/gtest.h>

namespace terrane {
namespace {

DemInfo example() {
    DemInfo dem;
    dem.columns = 3601;
    dem.rows = 2401;
    dem.cell_x = 73.9187654321;
    dem.cell_y = 92.66;
    dem.min_m = -1.0 / 3.0;
    dem.max_m = 4e3;
    dem.nodata_share = 0.125;
    dem.filled_share = 1e-7;
    dem.crs = "WGS 84 / \xC3\x9C";
    dem.crs_wkt = "GEOGCRS[\"WGS 84\"]";
    dem.geographic = true;
    dem.centre_x = -118.5;
    dem.centre_y = 37.25;
    dem.metres_per_unit_x = 88000.0;
    dem.metres_per_unit_y = 111000.0;
    dem.scale_error = 0.01;
    return dem;
}

void expect_same(const DemInfo& a, const DemInfo& b) {
    EXPECT_EQ(a.columns, b.columns);
    EXPECT_EQ(a.rows, b.rows);
    EXPECT_EQ(a.cell_x, b.cell_x);
    EXPECT_EQ(a.cell_y, b.cell_y);
    EXPECT_EQ(a.min_m, b.min_m);
    EXPECT_EQ(a.max_m, b.max_m);
    EXPECT_EQ(a.nodata_share, b.nodata_share);
    EXPECT_EQ(a.filled_share, b.filled_share);
    EXPECT_EQ(a.crs, b.crs);
    EXPECT_EQ(a.crs_wkt, b.crs_wkt);
    EXPECT_EQ(a.geographic, b.geographic);
    EXPECT_EQ(a.centre_x, b.centre_x);
    EXPECT_EQ(a.centre_y, b.centre_y);
    EXPECT_EQ(a.metres_per_unit_x, b.metres_per_unit_x);
    EXPECT_EQ(a.metres_per_unit_y, b.metres_per_unit_y);
    EXPECT_EQ(a.scale_error, b.scale_error);
    EXPECT_EQ(a.resampling_error, b.resampling_error);
    EXPECT_EQ(a.projection, b.projection);
    EXPECT_EQ(a.middle_longitude, b.middle_longitude);
    EXPECT_EQ(a.middle_latitude, b.middle_latitude);
}

TEST(DemNote, GivesThePropertiesOfTheRasterBack) {
    DemInfo dem = example();
    std::optional<DemInfo> read = dem_of_note(note_of(dem));
    ASSERT_TRUE(read.has_value());
    expect_same(*read, dem);
    dem.projection = DemProjection::local;
    dem.middle_longitude = 8.1;
    dem.middle_latitude = -46.7;
    dem.resampling_error = 0.3;
    read = dem_of_note(note_of(dem));
    ASSERT_TRUE(read.has_value());
    expect_same(*read, dem);
}

TEST(DemNote, IsAbsentFromOtherTexts) {
    for (const char* text :
         {"", "a note", "{}", "[1, 2]", "{\"samples\": \"many\"}", "{\"samples\": [1]}"}) {
        EXPECT_FALSE(dem_of_note(text).has_value()) << text;
    }
}

}  // namespace
}  // namespace terrane
