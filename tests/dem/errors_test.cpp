// SPDX-License-Identifier: MIT
#include "raster_files.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>

namespace terrane::test {
namespace {

RasterSpec slope(int columns, int rows) {
    RasterSpec spec;
    spec.columns = columns;
    spec.rows = rows;
    spec.value = [](int column, int row) { return 100.0 + column + 2.0 * row; };
    return spec;
}

/// The error of opening a file; fails the test where it opens.
Error error_of(const std::string& path, const DemSettings& settings = {}) {
    const auto source = DemHeights::open(path, settings);
    EXPECT_FALSE(source.has_value()) << path << " opened";
    if (source) return {};
    EXPECT_EQ(source.error().message.find('\n'), std::string::npos) << source.error().message;
    return source.error();
}

bool mentions(const Error& error, const std::string& text) {
    return error.message.find(text) != std::string::npos;
}

TEST(DemErrors, AMissingFileIsNamed) {
    const Error error = error_of("no/such/raster.tif");
    EXPECT_EQ(error.code, ErrorCode::io);
    EXPECT_TRUE(mentions(error, "no/such/raster.tif")) << error.message;
}

TEST(DemErrors, ATextFileIsNoRaster) {
    const TemporaryFolder folder;
    const std::string path = folder.file("heights.txt");
    std::ofstream(path) << "these are no heights\n";
    const Error error = error_of(path);
    EXPECT_EQ(error.code, ErrorCode::io);
    EXPECT_TRUE(mentions(error, path)) << error.message;
}

TEST(DemErrors, AnEmptyFileIsNoRaster) {
    const TemporaryFolder folder;
    const std::string path = folder.file("empty.tif");
    std::ofstream(path).close();
    EXPECT_EQ(error_of(path).code, ErrorCode::io);
}

TEST(DemErrors, ATruncatedFileDoesNotOpen) {
    const TemporaryFolder folder;
    const std::string path = folder.file("whole.tif"), cut = folder.file("cut.tif");
    write_raster(path, slope(400, 400));
    std::ifstream from(path, std::ios::binary);
    std::vector<char> bytes(200000);
    from.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    std::ofstream(cut, std::ios::binary).write(bytes.data(), from.gcount());
    EXPECT_EQ(error_of(cut).code, ErrorCode::io);
}

TEST(DemErrors, ARasterWithoutBandsDoesNotOpen) {
    const TemporaryFolder folder;
    const std::string path = folder.file("bands.vrt");
    std::ofstream(path) << "<VRTDataset rasterXSize=\"5\" rasterYSize=\"5\"></VRTDataset>\n";
    EXPECT_TRUE(mentions(error_of(path), path));
}

TEST(DemErrors, ASingleSampleIsTooFew) {
    const TemporaryFolder folder;
    const std::string path = folder.file("single.tif");
    write_raster(path, slope(1, 1));
    const Error error = error_of(path);
    EXPECT_EQ(error.code, ErrorCode::bad_data);
    EXPECT_TRUE(mentions(error, "1 x 1")) << error.message;
}

TEST(DemErrors, TwoByTwoSamplesAreEnough) {
    const TemporaryFolder folder;
    const std::string path = folder.file("four.tif");
    write_raster(path, slope(2, 2));
    const auto source = DemHeights::open(path, {});
    ASSERT_TRUE(source.has_value()) << source.error().message;
    EXPECT_NEAR((*source)->height(0.0, 0.0), 101.5, 1e-6);
}

TEST(DemErrors, ARasterOfNodataAloneIsBadData) {
    const TemporaryFolder folder;
    const std::string path = folder.file("nodata.tif");
    RasterSpec spec = slope(7, 5);
    spec.nodata = -9999.0;
    spec.value = [](int, int) { return -9999.0; };
    write_raster(path, spec);
    const Error error = error_of(path);
    EXPECT_EQ(error.code, ErrorCode::bad_data);
    EXPECT_TRUE(mentions(error, "nodata")) << error.message;
}

TEST(DemErrors, AHeightThatQuantaCannotHoldIsNamedWithItsPlace) {
    const TemporaryFolder folder;
    const std::string path = folder.file("spike.tif");
    for (const double height : {3e11, 1e28, -1e30, 1e33, 3.4e38, -1e300}) {
        RasterSpec spec = slope(30, 20);
        spec.type = GDT_Float64;
        spec.value = [&](int column, int row) { return column >= 7 && row >= 5 ? height : 0.0; };
        write_raster(path, spec);
        const Error error = error_of(path);
        EXPECT_EQ(error.code, ErrorCode::bad_data);
        std::array<char, 40> value{};
        std::snprintf(value.data(), value.size(), "%.6g m", height);
        EXPECT_TRUE(mentions(error, value.data())) << error.message;
        EXPECT_TRUE(mentions(error, "column 7, row 19 ")) << error.message;
        // The same number, declared as nodata, is none.
        spec.nodata = height;
        write_raster(path, spec);
        EXPECT_TRUE(DemHeights::open(path, {}).has_value()) << height;
    }
}

TEST(DemErrors, SettingsOutOfRangeAreNamedWithTheirValue) {
    const TemporaryFolder folder;
    const std::string path = folder.file("slope.tif");
    write_raster(path, slope(20, 20));
    for (const double spacing : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
        DemSettings settings;
        settings.finest_spacing = spacing;
        const Error error = error_of(path, settings);
        EXPECT_EQ(error.code, ErrorCode::invalid_argument);
        EXPECT_TRUE(mentions(error, "finest_spacing")) << error.message;
    }
    DemSettings rough;
    rough.detail_seed = 1;
    rough.detail_roughness = -2.0;
    EXPECT_TRUE(mentions(error_of(path, rough), "detail_roughness"));
}

TEST(DemErrors, ASpacingThatNeedsMoreThan24LevelsIsRefused) {
    const TemporaryFolder folder;
    const std::string path = folder.file("slope.tif");
    write_raster(path, slope(20, 20));
    DemSettings settings;
    settings.finest_spacing = 1e-9;
    const Error error = error_of(path, settings);
    EXPECT_EQ(error.code, ErrorCode::invalid_argument);
    EXPECT_TRUE(mentions(error, "1e-09")) << error.message;
    // The same for cells that are not square.
    RasterSpec oblong = slope(20, 20);
    oblong.transform[5] = -7.0;
    write_raster(path, oblong);
    EXPECT_EQ(error_of(path, settings).code, ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace terrane::test
