// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"

#include <terrane/dem/imagery_raster.h>

#include <gtest/gtest.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

namespace terrane::test {
namespace imagery_raster_test {

using Imagery = std::shared_ptr<const ImagerySource>;

/// 6 x 4 cells of 10 m with 10 * row + column from the north-west.
RasterSpec numbered() {
    RasterSpec spec{.columns = 6, .rows = 4, .type = GDT_Byte, .value = [](int column, int row) {
                        return row * 10.0 + column;
                    }};
    return spec;
}

class ImageryRasterTest : public testing::Test {
protected:
    std::string written(const RasterSpec& spec, const std::string& name = "imagery.tif") {
        write_raster(folder_.file(name), spec);
        return folder_.file(name);
    }
    static Imagery open(const std::string& path, const ImageryRasterSettings& settings = {},
                        ImageryRasterInfo* info_out = nullptr) {
        auto opened = ImageryRaster::open(path, settings, info_out);
        EXPECT_TRUE(opened) << (opened ? "" : opened.error().message);
        return opened.value_or(nullptr);
    }
    static std::vector<ImageryTexel> read(const ImagerySource& imagery, const WorldRect& square,
                                          int side) {
        std::vector<ImageryTexel> texels(static_cast<std::size_t>(side * side));
        const Result<void> done = imagery.read(square, side, texels);
        EXPECT_TRUE(done) << (done ? "" : done.error().message);
        return texels;
    }
    static std::string refusal(const std::string& path, ErrorCode code,
                               const ImageryRasterSettings& settings = {}) {
        const auto opened = ImageryRaster::open(path, settings);
        EXPECT_FALSE(opened);
        if (opened) return "";
        EXPECT_EQ(opened.error().code, code);
        return opened.error().message;
    }

    TemporaryFolder folder_;
};

TEST_F(ImageryRasterTest, LiesAboutTheOriginAsADemDoes) {
    ImageryRasterInfo info;
    const Imagery imagery = open(written(numbered()), {}, &info);
    EXPECT_EQ(info.columns, 6);
    EXPECT_EQ(info.rows, 4);
    EXPECT_EQ(info.bands, std::vector<int>{1});
    EXPECT_DOUBLE_EQ(imagery->texel_size(), 10.0);
    EXPECT_DOUBLE_EQ(imagery->rect().west, -30.0);
    EXPECT_DOUBLE_EQ(imagery->rect().north, 20.0);
    // its own samples, and a frame of no data around them
    const auto texels = read(*imagery, {-40.0, -40.0, 40.0, 40.0}, 8);
    for (int row = 0; row < 8; ++row) {
        for (int column = 0; column < 8; ++column) {
            const ImageryTexel& texel = texels[static_cast<std::size_t>(row * 8 + column)];
            const int file_column = column - 1, file_row = 5 - row;
            const bool is_in = file_column >= 0 && file_column < 6 && file_row >= 0 && file_row < 4;
            ASSERT_EQ(texel[3], is_in ? 255 : 0) << column << ", " << row;
            if (!is_in) continue;
            const auto wanted = static_cast<std::uint8_t>(10 * file_row + file_column);
            ASSERT_EQ(texel, (ImageryTexel{wanted, wanted, wanted, 255})) << column << row;
        }
    }
}

TEST_F(ImageryRasterTest, AveragesWhereSquaresAreCoarse) {
    const Imagery imagery = open(written(numbered()));
    const auto texels = read(*imagery, {-20.0, -20.0, 20.0, 20.0}, 2);
    // columns 1 and 2, rows 2 and 3
    EXPECT_NEAR(texels[0][0], (21 + 22 + 31 + 32) / 4.0, 1.0);
    EXPECT_NEAR(texels[3][0], (3 + 4 + 13 + 14) / 4.0, 1.0);
}

TEST_F(ImageryRasterTest, NodataIsNoImagery) {
    RasterSpec spec = numbered();
    spec.nodata = 12.0;
    const Imagery imagery = open(written(spec));
    const auto texels = read(*imagery, {-20.0, -20.0, 20.0, 20.0}, 4);
    // row 1 and column 2 of the file
    for (std::size_t i = 0; i < texels.size(); ++i) EXPECT_EQ(texels[i][3], i == 9 ? 0 : 255) << i;
}

TEST_F(ImageryRasterTest, LiesOverADemByItsGeoreferencing) {
    RasterSpec dem = numbered();
    dem.type = GDT_Float32;
    dem.transform = {1000.0, 20.0, 0.0, 5040.0, 0.0, -20.0};
    const DemInfo info = open_dem(dem).info;
    const Imagery imagery = open(written(numbered()), ImageryRasterSettings{.aligned_with = info});
    // the DEM's centre is 1060, 5000; the imagery's west edge 1000, its north edge 5000
    EXPECT_NEAR(imagery->rect().west, -60.0, 1e-9);
    EXPECT_NEAR(imagery->rect().east, 0.0, 1e-9);
    EXPECT_NEAR(imagery->rect().north, 0.0, 1e-9);
}

TEST_F(ImageryRasterTest, IsReprojectedIntoTheCrsOfTheDem) {
    // a DEM in degrees around 15 E, 45 N, where UTM zone 33 has its central meridian
    RasterSpec dem;
    dem.columns = dem.rows = 100;
    dem.crs = "EPSG:4326";
    dem.transform = {14.95, 0.001, 0.0, 45.05, 0.0, -0.001};
    dem.value = [](int column, int) { return 1.0 * column; };
    const DemInfo info = open_dem(dem).info;
    ASSERT_TRUE(info.geographic);
    // one bright cell of 100 m that begins 1000 m east and ends 500 m north of 500000, 4982950.4 (15 E, 45 N)
    RasterSpec spec;
    spec.columns = spec.rows = 60;
    spec.type = GDT_Byte;
    spec.crs = "EPSG:32633";
    spec.transform = {497000.0, 100.0, 0.0, 4985950.4, 0.0, -100.0};
    spec.value = [](int column, int row) { return column == 40 && row == 25 ? 255.0 : 0.0; };
    const Imagery imagery = open(written(spec), ImageryRasterSettings{.aligned_with = info});
    const int side = 200;
    const auto texels = read(*imagery, {-2000.0, -2000.0, 2000.0, 2000.0}, side);
    double sum = 0.0, x = 0.0, y = 0.0;
    for (int row = 0; row < side; ++row) {
        for (int column = 0; column < side; ++column) {
            const double weight = texels[static_cast<std::size_t>(row * side + column)][0];
            sum += weight;
            x += weight * (20.0 * (column + 0.5) - 2000.0);
            y += weight * (20.0 * (row + 0.5) - 2000.0);
        }
    }
    ASSERT_GT(sum, 0.0);
    // a metre of UTM is 0.9996 of one on the ellipsoid; half a cell for the two resamplings
    EXPECT_NEAR(x / sum, 1050.0 / 0.9996, 50.0);
    EXPECT_NEAR(y / sum, 450.0 / 0.9996, 50.0);
}

TEST_F(ImageryRasterTest, ThatMissesTheDemIsRefusedWithBothExtents) {
    RasterSpec dem = numbered();
    dem.type = GDT_Float32;
    const DemInfo info = open_dem(dem).info;
    RasterSpec far = numbered();
    far.transform[0] += 60.0;  // beside the DEM
    const std::string path = written(far);
    const std::string message = refusal(path, ErrorCode::bad_data, {.aligned_with = info});
    EXPECT_EQ(message, "raster \"" + path +
                           "\" covers x 30 to 90 m, y -20 to 20 m of the world, and does not meet "
                           "the ground, x -30 to 30 m, y -20 to 20 m");
    far.transform[0] -= 1.0;
    EXPECT_NE(open(written(far), {.aligned_with = info}), nullptr);
    // Over another zone of UTM: the same numbers, another place.
    far.transform = dem.transform;
    far.crs = "EPSG:32634";
    EXPECT_NE(refusal(written(far), ErrorCode::bad_data, {.aligned_with = info}), "");
}

TEST_F(ImageryRasterTest, LiesOverADemAcrossTheSeamOfGonsAndOfMercatorsMetres) {
    // Imagery of the half east of the middle; longitudes a turn apart, of 400 gon and of 360 degrees
    for (const auto& [crs, turn, cell] :
         {std::tuple{"EPSG:4807", 400.0, 0.01}, std::tuple{"EPSG:4326", 360.0, 0.01},
          std::tuple{"EPSG:3857", 0.0, 100.0}}) {
        SCOPED_TRACE(crs);
        RasterSpec dem = numbered();
        dem.type = GDT_Float32;
        dem.crs = crs;
        dem.transform = {-3.0 * cell, cell, 0.0, 40.0 + 2.0 * cell, 0.0, -cell};
        const DemInfo info = open_dem(dem).info;
        RasterSpec half = numbered();
        half.crs = crs;
        half.columns = 3;
        half.transform = {turn, cell, 0.0, 40.0 + 2.0 * cell, 0.0, -cell};
        ImageryRasterInfo placed;
        open(written(half), {.aligned_with = info}, &placed);
        EXPECT_NEAR(placed.rect.west, 0.0, 1e-4);
        EXPECT_NEAR(placed.rect.east, 3.0 * info.cell_x, 1e-4);
        EXPECT_NEAR(placed.rect.north, 2.0 * info.cell_y, 1e-4);
    }
}

TEST_F(ImageryRasterTest, RefusesWhatIsNoImageryAndNamesIt) {
    RasterSpec spec = numbered();
    spec.type = GDT_Float32;
    const std::string floats = written(spec, "floats.tif");
    EXPECT_NE(refusal(floats, ErrorCode::bad_data).find("Float32"), std::string::npos);
    const std::string path = written(numbered());
    const std::string bands = refusal(path, ErrorCode::invalid_argument, {.bands = {3, 2, 1}});
    EXPECT_NE(bands.find(path), std::string::npos);
    EXPECT_NE(bands.find("got band 3"), std::string::npos);
    EXPECT_NE(refusal(path, ErrorCode::invalid_argument, {.bands = {1, 1}}).find("got 2"),
              std::string::npos);
    EXPECT_NE(refusal(path, ErrorCode::invalid_argument, {.read_timeout = -1.0}).find("-1"),
              std::string::npos);
    const std::string none = folder_.file("none.tif");
    EXPECT_NE(refusal(none, ErrorCode::io).find(none), std::string::npos);
}

TEST_F(ImageryRasterTest, IsStretchedByLimitsAndGamma) {
    for (const GDALDataType type : {GDT_Byte, GDT_UInt16, GDT_Int16, GDT_Float32}) {
        SCOPED_TRACE(GDALGetDataTypeName(type));
        RasterSpec spec = numbered();
        spec.type = type;
        ImageryRasterSettings settings{.limits = std::array{3.0, 23.0}, .gamma = 2.0};
        const auto texels = read(*open(written(spec), settings), {-30.0, -20.0, 30.0, 20.0}, 6);
        for (int row = 0; row < 4; ++row) {
            for (int column = 0; column < 6; ++column) {
                // the square is stretched from 4 rows to 6 texels: only the outer ones are those of the file
                if (row != 0 && row != 3) continue;
                const double value = 10.0 * row + column;
                const double share = std::clamp((value - 3.0) / 20.0, 0.0, 1.0);
                const std::size_t at = static_cast<std::size_t>((row == 0 ? 5 : 0) * 6 + column);
                ASSERT_NEAR(texels[at][0], 255.0 * std::sqrt(share), 1.0) << row << ", " << column;
                ASSERT_EQ(texels[at][3], 255);
            }
        }
    }
}

TEST_F(ImageryRasterTest, IsStretchedByPercentilesOfTheValuesWithData) {
    RasterSpec spec{
        .columns = 11, .rows = 10, .type = GDT_UInt16, .value = [](int column, int row) {
            return column == 10 ? 60'000.0 : 1000.0 + 10.0 * row + column;
        }};
    spec.nodata = 60'000.0;
    ImageryRasterSettings settings{.percentiles = std::array{0.0, 50.0}};
    const auto texels = read(*open(written(spec), settings), {-55.0, -50.0, 55.0, 50.0}, 11);
    // values with data are 1000 to 1099; the sorted list's middle is value 50
    for (int column = 0; column < 10; ++column)
        EXPECT_NEAR(texels[static_cast<std::size_t>(10 * 11 + column)][0], 255.0 * column / 50.0,
                    1.0);
    EXPECT_EQ(texels[10 * 11 + 10][3], 0);
    EXPECT_EQ(texels[0][0], 255);
}

TEST_F(ImageryRasterTest, RefusesAStretchOutOfRange) {
    const std::string path = written(numbered());
    const auto says = [&](const ImageryRasterSettings& settings, const char* words) {
        EXPECT_EQ(refusal(path, ErrorCode::invalid_argument, settings), words);
    };
    says({.limits = std::array{5.0, 5.0}},
         "limits must be two ascending numbers from -1e+30 to 1e+30, got 5 and 5");
    says({.limits = std::array{0.0, std::nan("")}},
         "limits must be two ascending numbers from -1e+30 to 1e+30, got 0 and nan");
    says({.percentiles = std::array{-1.0, 98.0}},
         "percentiles must be two ascending numbers from 0 to 100, got -1 and 98");
    says({.limits = std::array{0.0, 1.0}, .percentiles = std::array{2.0, 98.0}},
         "give limits or percentiles, not both");
    says({.gamma = 0.0}, "gamma must be 0.1 to 10, got 0");
    RasterSpec complex = numbered();
    complex.type = GDT_CFloat32;
    EXPECT_NE(refusal(written(complex, "complex.tif"), ErrorCode::bad_data,
                      {.limits = std::array{0.0, 1.0}})
                  .find("CFloat32"),
              std::string::npos);
}

TEST_F(ImageryRasterTest, TakesTheBandsOfRealImageryAndPlacesThemOverItsDem) {
    const std::string landsat = real_data("../imagery/landsat7_olinda_28m.tif");
    const std::string heights = real_data("../imagery/olinda_dem_utm25s_90m.tif");
    if (landsat.empty() || heights.empty()) GTEST_SKIP() << "no real data";
    const DemInfo dem = open_dem(heights).info;
    ImageryRasterSettings settings{.bands = {3, 2, 1}, .aligned_with = dem};
    ImageryRasterInfo info;
    const Imagery imagery = open(landsat, settings, &info);
    EXPECT_EQ(info.bands, settings.bands);
    // both rasters begin at one corner; the two CRS differ by metres at most
    EXPECT_NEAR(imagery->rect().west, -0.5 * dem.columns * dem.cell_x, 60.0);
    EXPECT_NEAR(imagery->rect().north, 0.5 * dem.rows * dem.cell_y, 60.0);
    // the sea in the east is darker in red than in blue
    const auto sea = read(*imagery, {4000.0, -1000.0, 4500.0, -500.0}, 1);
    EXPECT_EQ(sea[0][3], 255);
    EXPECT_LT(sea[0][0], sea[0][2]);
}

}  // namespace imagery_raster_test
}  // namespace terrane::test
