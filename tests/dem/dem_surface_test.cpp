// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace terrane::test {
namespace surface_test {

/// GDAL's bilinear value of a band without nodata at pixel coordinates: a resampled window of one pixel around the
/// point is not exact enough, so the four samples are read through GDAL and weighed here.
double bilinear_of_band(GDALRasterBand& band, double u, double v) {
    const int column = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(v));
    std::array<double, 4> z{};
    EXPECT_EQ(band.RasterIO(GF_Read, column, row, 2, 2, z.data(), 2, 2, GDT_Float64, 0, 0, nullptr),
              CE_None);
    const double fu = u - column, fv = v - row;
    const double raw =
        (z[0] * (1 - fu) + z[1] * fu) * (1 - fv) + (z[2] * (1 - fu) + z[3] * fu) * fv;
    return raw * band.GetScale() + band.GetOffset();
}

class DemSurface : public testing::TestWithParam<const char*> {};

TEST_P(DemSurface, HeightsAreTheBilinearOnesOfGdal) {
    const std::string path = real_data(GetParam());
    if (path.empty()) GTEST_SKIP() << GetParam() << " is not here";
    const OpenedDem dem = open_dem(path);
    GDALDataset* file = GDALDataset::Open(path.c_str(), GDAL_OF_RASTER);
    ASSERT_NE(file, nullptr);
    GDALRasterBand& band = *file->GetRasterBand(1);
    const unsigned seed = 17;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::vector<std::array<double, 2>> places(2000);  // rows and columns
    for (auto& [v, u] : places) {
        u = random_unit(random) * (dem.info.columns - 1.001);
        v = random_unit(random) * (dem.info.rows - 1.001);
    }
    std::ranges::sort(places);  // a compressed picture is read again for every row further north
    for (const auto& [v, u] : places) {
        const double x = (u + 0.5 - 0.5 * dem.info.columns) * dem.info.cell_x;
        const double y = (0.5 * dem.info.rows - v - 0.5) * dem.info.cell_y;
        ASSERT_NEAR(dem.source->height(x, y), bilinear_of_band(band, u, v), 1e-3) << u << ", " << v;
    }
    GDALClose(GDALDataset::ToHandle(file));
}

INSTANTIATE_TEST_SUITE_P(RealRasters, DemSurface,
                         testing::Values("sthelens_10m.vrt", "gabilan_lidar_1m.tif",
                                         "srtm3_N41E012_rome_1201.tif", "usgs3dep_maroon_38m.tif"));

TEST(DemFormats, ACompressedFileIsReadThroughGdalsFileSystems) {
    const std::string path = real_data("usgs_sthelens_30m.dem.gz");
    if (path.empty()) GTEST_SKIP() << "usgs_sthelens_30m.dem.gz is not here";
    const DemInfo info = open_dem("/vsigzip/" + path).info;
    EXPECT_EQ(info.columns, 327);
    EXPECT_EQ(info.rows, 468);
    EXPECT_EQ(info.min_m, 682.0);
    EXPECT_EQ(info.max_m, 2543.0);
}

TEST(DemFormats, TheRasterOfTheRepositoryOpens) {
    const DemInfo info = open_dem(TERRANE_SOURCE_DIR "/tools/data/jacksboro.tif").info;
    EXPECT_EQ(info.columns, 403);
    EXPECT_EQ(info.rows, 344);
    EXPECT_TRUE(info.geographic);
    EXPECT_EQ(info.nodata_share, 0.0);
}

}  // namespace surface_test

namespace place_test {

RasterSpec slope(int columns, int rows) {
    RasterSpec spec{.columns = columns, .rows = rows, .value = [](int column, int row) {
                        return 100.0 + column + 2.0 * row;
                    }};
    return spec;
}

TEST(DemPlace, RootsCoverTheOuterEdgesWithAtMostFourAlongAnAxis) {
    // The axes are independent: each number of columns with one of rows, each number of rows with several of columns.
    const std::pair<int, int> sizes[] = {{2, 2},   {3, 600}, {100, 128}, {127, 5}, {128, 600},
                                         {129, 2}, {511, 5}, {512, 128}, {513, 2}, {700, 600}};
    for (const auto& [columns, rows] : sizes) {
        for (const double cell_y : {10.0, 7.0}) {
            const double spacing = (columns % 2 == 0) == (cell_y == 10.0) ? 0.0 : 0.7;
            RasterSpec spec = slope(columns, rows);
            spec.transform[5] = -cell_y;
            const OpenedDem opened =
                open_dem(spec, DemSettings{.finest_spacing = spacing, .detail_seed = {}});
            const Lattice& l = opened.source->lattice();
            const WorldRect& e = opened.source->extent();
            ASSERT_TRUE(l.validate().has_value()) << columns << " x " << rows;
            EXPECT_LE(l.root_count_x, 4);
            EXPECT_LE(l.root_count_y, 4);
            EXPECT_LE(l.x(l.west()), e.west + 1e-9);
            EXPECT_GE(l.x(l.east()), e.east - 1e-9);
            EXPECT_LE(l.y(l.south()), e.south + 1e-9);
            EXPECT_GE(l.y(l.north()), e.north - 1e-9);
            EXPECT_NEAR(e.east - e.west, columns * 10.0, 1e-9);
            EXPECT_NEAR(e.north, rows * cell_y / 2.0, 1e-9);
            if (spacing > 0.0) {
                EXPECT_LE(l.spacing, spacing);
            }
            EXPECT_LE(l.spacing, std::min(10.0, cell_y));
        }
    }
}

TEST(DemPlace, ADegreeIsThatOfTheEllipsoidAtTheCentre) {
    RasterSpec spec = slope(120, 240);
    spec.crs = "EPSG:4326";
    spec.transform = {10.0, 1.0 / 1200, 0.0, 45.1, 0.0, -1.0 / 1200};
    const OpenedDem opened = open_dem(spec);
    const DemInfo& info = opened.info;
    EXPECT_TRUE(info.geographic);
    EXPECT_NEAR(info.centre_x, 10.05, 1e-9);
    EXPECT_NEAR(info.centre_y, 45.0, 1e-9);
    // A degree at 45 degrees on WGS 84: tables give 78,846.8 m east and 111,131.8 m north.
    EXPECT_NEAR(info.metres_per_unit_x, 78846.8, 0.1);
    EXPECT_NEAR(info.metres_per_unit_y, 111131.8, 0.1);
    EXPECT_EQ(info.metres_per_unit_x * 1024.0, std::floor(info.metres_per_unit_x * 1024.0));
    EXPECT_DOUBLE_EQ(info.cell_x, info.metres_per_unit_x * spec.transform[1]);
    // cos(45) / cos(45.1) - 1
    EXPECT_NEAR(info.scale_error, 0.00175, 2e-5);
}

TEST(DemPlace, FeetOfTheCrsBecomeMetres) {
    RasterSpec spec = slope(50, 50);
    spec.crs = "EPSG:2225";  // NAD83 / California zone 1, US survey feet
    const OpenedDem opened = open_dem(spec);
    EXPECT_NEAR(opened.info.cell_x, 10.0 * 1200.0 / 3937.0, 1e-9);
    EXPECT_NEAR(opened.info.metres_per_unit_x, 1200.0 / 3937.0, 1e-12);
}

TEST(DemPlace, BeyondTheOutermostSamplesTheEdgeGoesOn) {
    const OpenedDem opened = open_dem(slope(50, 40));
    const double edge = opened.source->height(sample_x(opened.info, 49), 0.0);
    for (const double beyond : {1.0, 4.9, 100.0, 1e5, 1e12}) {
        EXPECT_EQ(opened.source->height(sample_x(opened.info, 49) + beyond, 0.0), edge);
    }
    EXPECT_TRUE(std::isnan(opened.source->height(std::nan(""), 0.0)));
}

TEST(DemPlace, CellsBeyondTheOuterEdgesAreOutsideAndNoOthers) {
    const OpenedDem opened = open_dem(slope(50, 40));
    const Lattice& l = opened.source->lattice();
    const WorldRect& e = opened.source->extent();
    const SampleGrid grid{{l.west(), l.south()}, 1, 100, 100};
    std::vector<std::uint8_t> flags(99 * 99);
    ASSERT_TRUE(opened.source->cell_flags(grid, flags).has_value());
    for (int row = 0; row < 99; ++row) {
        for (int column = 0; column < 99; ++column) {
            const double west = l.x(grid.corner.x + column), south = l.y(grid.corner.y + row);
            const bool beyond = west >= e.east || west + l.spacing <= e.west || south >= e.north ||
                                south + l.spacing <= e.south;
            ASSERT_EQ(flags[static_cast<std::size_t>(row * 99 + column)],
                      beyond ? cell_outside : cell_ground);
        }
    }
}

}  // namespace place_test

namespace detail_test {

RasterSpec hills() {
    RasterSpec spec{.columns = 96, .rows = 64};
    // Rough in the west, a plane in the east.
    spec.value = [](int column, int row) {
        const double plane = 200.0 + 2.0 * column;
        return column < 48 ? plane + (column * 37 + row * 91) % 13 : plane;
    };
    return spec;
}

struct Pair {
    std::shared_ptr<const HeightSource> bare, detailed;
    DemInfo info;
};

Pair open_pair(const RasterSpec& spec, double roughness) {
    DemSettings settings{.finest_spacing = 0.5, .detail_seed = {}};
    const OpenedDem bare = open_dem(spec, settings);
    settings.detail_seed = 5;
    settings.detail_roughness = roughness;
    return {bare.source, open_dem(spec, settings).source, bare.info};
}

TEST(DemDetail, SamplesKeepTheirHeights) {
    const Pair pair = open_pair(hills(), 1.0);
    for (int row = 0; row < 64; ++row) {
        for (int column = 0; column < 96; ++column) {
            const double x = sample_x(pair.info, column), y = sample_y(pair.info, row);
            ASSERT_NEAR(pair.detailed->height(x, y), pair.bare->height(x, y), 1e-3);
        }
    }
}

/// Mean distance between the two surfaces over a range of columns.
double mean_detail(const Pair& pair, int west, int east) {
    double sum = 0.0;
    int count = 0;
    for (int row = 8; row < 56; ++row) {
        for (int column = west; column < east; ++column) {
            const double x = sample_x(pair.info, column) + 3.1, y = sample_y(pair.info, row) + 4.3;
            sum += std::fabs(pair.detailed->height(x, y) - pair.bare->height(x, y));
            ++count;
        }
    }
    return sum / count;
}

TEST(DemDetail, FollowsTheRoughnessAround) {
    const Pair pair = open_pair(hills(), 1.0);
    EXPECT_GT(mean_detail(pair, 8, 40), 0.1);
    EXPECT_LT(mean_detail(pair, 70, 90), 1e-6);
}

TEST(DemDetail, GrowsWithTheRoughnessThatIsSet) {
    const Pair one = open_pair(hills(), 1.0), two = open_pair(hills(), 2.0);
    EXPECT_NEAR(mean_detail(two, 8, 40), 2.0 * mean_detail(one, 8, 40), 1e-3);
    const Pair none = open_pair(hills(), 0.0);
    EXPECT_EQ(mean_detail(none, 8, 40), 0.0);
}

}  // namespace detail_test
}  // namespace terrane::test
