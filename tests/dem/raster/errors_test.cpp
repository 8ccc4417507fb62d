// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <utility>

namespace terrane::test {
namespace errors_test {

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

TEST(DemErrors, APipeIsRefusedAtOnce) {
    const TemporaryFolder folder;
    const std::string path = folder.file("pipe.tif");
    ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
    const Error error = error_of(path);
    EXPECT_EQ(error.code, ErrorCode::io);
    EXPECT_TRUE(mentions(error, path) && mentions(error, "pipe")) << error.message;
    EXPECT_TRUE(mentions(error_of("/dev/null"), "device"));
}

TEST(DemErrors, ComplexNumbersAreRefusedByTheirType) {
    const TemporaryFolder folder;
    const std::string path = folder.file("complex.tif");
    for (const auto& [type, name] : {std::pair{GDT_CInt16, "CInt16"},
                                     {GDT_CInt32, "CInt32"},
                                     {GDT_CFloat32, "CFloat32"},
                                     {GDT_CFloat64, "CFloat64"}}) {
        RasterSpec spec = slope(20, 20);
        spec.type = type;
        write_raster(path, spec);
        const Error error = error_of(path);
        EXPECT_EQ(error.code, ErrorCode::bad_data);
        EXPECT_TRUE(mentions(error, name) && mentions(error, path)) << error.message;
    }
}

TEST(DemErrors, AScaleThatMakesNoHeightsIsNamed) {
    const TemporaryFolder folder;
    const std::string path = folder.file("scale.tif");
    for (const double scale : {0.0, std::nan("")}) {
        RasterSpec spec = slope(20, 20);
        spec.scale = scale;
        write_raster(path, spec);
        const Error error = error_of(path);
        EXPECT_EQ(error.code, ErrorCode::bad_data);
        EXPECT_TRUE(mentions(error, scale == 0.0 ? "scale of 0" : "scale of nan")) << error.message;
    }
}

TEST(DemErrors, CellsWithoutAreaAreNamedWithTheirGeotransform) {
    const TemporaryFolder folder;
    const std::string tif = folder.file("slope.tif"), path = folder.file("placed.vrt");
    write_raster(tif, slope(20, 20));
    for (const char* transform :
         {"0, 0, 0, 0, 0, 0", "0, 0, 0, 0, 0, -10", "0, nan, 0, 0, 0, -10", "0, 10, 0, nan, 0, -10",
          "0, inf, 0, 0, 0, -10", "0, 1, 1, 0, 1, 1"}) {
        std::ofstream(path)
            << "<VRTDataset rasterXSize=\"20\" rasterYSize=\"20\"><GeoTransform>" << transform
            << "</GeoTransform><VRTRasterBand dataType=\"Float32\" band=\"1\"><SimpleSource>"
               "<SourceFilename relativeToVRT=\"1\">slope.tif</SourceFilename></SimpleSource>"
               "</VRTRasterBand></VRTDataset>\n";
        const Error error = error_of(path);
        EXPECT_EQ(error.code, ErrorCode::bad_data) << transform;
        EXPECT_TRUE(mentions(error, path) && mentions(error, "geotransform")) << error.message;
    }
}

TEST(DemErrors, CellsThatAreTooOblongAreNamed) {
    const TemporaryFolder folder;
    const std::string path = folder.file("oblong.tif");
    RasterSpec spec = slope(20, 20);
    spec.transform[1] = 1.0;
    spec.transform[5] = -1000.0;
    write_raster(path, spec);
    const Error error = error_of(path);
    EXPECT_EQ(error.code, ErrorCode::bad_data);
    EXPECT_TRUE(mentions(error, "1 x 1000 m") && mentions(error, "32")) << error.message;
    spec.transform[5] = -32.0;
    write_raster(path, spec);
    EXPECT_TRUE(DemHeights::open(path, {}).has_value());
}

TEST(DemErrors, DegreesBeyondTheEarthAreRefused) {
    const TemporaryFolder folder;
    const std::string path = folder.file("degrees.tif");
    struct Place {
        double west, north, cell;
        const char* reason;  ///< null: it opens
    };
    for (const Place& place : {Place{10.0, 91.0, 0.01, "latitude 91 degrees"},
                               {10.0, 90.05, 0.01, "latitude 90.05"},
                               {10.0, -89.9, 0.01, "latitude -90.1"},
                               {10.0, 89.99, 0.1, "times too long"},
                               {-180.0, 90.0, 9.0, "times too long"},
                               {10.0, 5e6, 30.0, "latitude"},
                               {5e5, 10.0, 0.01, "longitude 500000"},
                               {0.0, 10.0, 20.0, "latitude -390"},
                               {10.0, 80.0, 0.01, nullptr},
                               {350.0, 60.0, 1.0, nullptr},
                               {-180.0, 60.0, 6.0, nullptr}}) {
        RasterSpec spec = slope(20, 20);
        spec.crs = "EPSG:4326";
        spec.transform = {place.west, place.cell, 0.0, place.north, 0.0, -place.cell};
        write_raster(path, spec);
        DemInfo info;
        const auto source = DemHeights::open(path, {}, &info);
        if (place.reason == nullptr) {
            ASSERT_TRUE(source.has_value()) << source.error().message;
            EXPECT_LE(info.scale_error, 9.0);
            continue;
        }
        ASSERT_FALSE(source.has_value()) << place.north << ", scale error " << info.scale_error;
        EXPECT_EQ(source.error().code, ErrorCode::bad_data);
        EXPECT_TRUE(mentions(source.error(), place.reason)) << source.error().message;
        EXPECT_TRUE(mentions(source.error(), path)) << source.error().message;
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
    for (const double seconds : {0.0, -1.0, std::nan("")}) {
        DemSettings hasty;
        hasty.read_timeout = seconds;
        EXPECT_TRUE(mentions(error_of(path, hasty), "read_timeout"));
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

}  // namespace errors_test
}  // namespace terrane::test
