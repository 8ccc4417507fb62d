// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace terrane::test {
namespace surface_test {

/// GDAL's bilinear value of a band without nodata at pixel coordinates: a resampled window of one
/// pixel around the point, as gdallocationinfo -r bilinear asks for it, is not exact enough, so the
/// four samples are read through GDAL and weighed here.
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

class DemSurface : public testing::TestWithParam<const char*> {
protected:
    void SetUp() override {
        path_ = real_data(GetParam());
        if (path_.empty()) GTEST_SKIP() << GetParam() << " is not here";
        const auto opened = DemHeights::open(path_, {}, &info_);
        ASSERT_TRUE(opened.has_value()) << opened.error().message;
        source_ = *opened;
    }
    std::string path_;
    DemInfo info_;
    std::shared_ptr<const HeightSource> source_;
};

TEST_P(DemSurface, HeightsAreTheBilinearOnesOfGdal) {
    GDALDataset* file = GDALDataset::Open(path_.c_str(), GDAL_OF_RASTER);
    ASSERT_NE(file, nullptr);
    GDALRasterBand& band = *file->GetRasterBand(1);
    const unsigned seed = 17;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    for (int i = 0; i < 2000; ++i) {
        const double u = random_unit(random) * (info_.columns - 1.001);
        const double v = random_unit(random) * (info_.rows - 1.001);
        const double x = (u + 0.5 - 0.5 * info_.columns) * info_.cell_x;
        const double y = (0.5 * info_.rows - v - 0.5) * info_.cell_y;
        ASSERT_NEAR(source_->height(x, y), bilinear_of_band(band, u, v), 1e-3) << u << ", " << v;
    }
    GDALClose(GDALDataset::ToHandle(file));
}

TEST_P(DemSurface, IntervalsContainEveryHeight) {
    std::mt19937 random(3);
    const WorldRect& e = source_->extent();
    for (int i = 0; i < 300; ++i) {
        const double size = std::ldexp(info_.cell_x, static_cast<int>(random() % 12u) - 2);
        WorldRect rect;
        rect.west = e.west + random_unit(random) * (e.east - e.west) - 0.5 * size;
        rect.south = e.south + random_unit(random) * (e.north - e.south) - 0.5 * size;
        rect.east = rect.west + size;
        rect.north = rect.south + size * 0.7;
        const HeightInterval range = source_->interval(rect);
        for (int k = 0; k <= 100; ++k) {
            const double z =
                source_->height(rect.west + (k % 11) / 10.0 * (rect.east - rect.west),
                                rect.south + (k / 10) / 10.0 * (rect.north - rect.south));
            ASSERT_GE(z, range.low);
            ASSERT_LE(z, range.high);
        }
    }
}

TEST_P(DemSurface, NoTwoPointsDifferMoreThanTheRiseBound) {
    std::mt19937 random(5);
    const WorldRect& e = source_->extent();
    double before = 0.0;
    for (double distance = 0.01; distance < 1e5; distance *= 1.7) {
        const double rise = source_->rise_bound(distance);
        ASSERT_GE(rise, before) << "not monotone at " << distance;
        before = rise;
        for (int i = 0; i < 300; ++i) {
            const double x = e.west + random_unit(random) * (e.east - e.west);
            const double y = e.south + random_unit(random) * (e.north - e.south);
            const double angle = 6.283 * random_unit(random);
            ASSERT_LE(std::fabs(source_->height(x + distance * std::cos(angle),
                                                y + distance * std::sin(angle)) -
                                source_->height(x, y)),
                      rise);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(RealRasters, DemSurface,
                         testing::Values("sthelens_10m.vrt", "gabilan_lidar_1m.tif",
                                         "srtm3_N41E012_rome_1201.tif", "usgs3dep_maroon_38m.tif"));

TEST(DemFormats, ACompressedFileIsReadThroughGdalsFileSystems) {
    const std::string path = real_data("usgs_sthelens_30m.dem.gz");
    if (path.empty()) GTEST_SKIP() << "usgs_sthelens_30m.dem.gz is not here";
    DemInfo info;
    const auto source = DemHeights::open("/vsigzip/" + path, {}, &info);
    ASSERT_TRUE(source.has_value()) << source.error().message;
    EXPECT_EQ(info.columns, 327);
    EXPECT_EQ(info.rows, 468);
    EXPECT_EQ(info.min_m, 682.0);
    EXPECT_EQ(info.max_m, 2543.0);
}

TEST(DemFormats, TheRasterOfTheRepositoryOpens) {
    DemInfo info;
    const auto source =
        DemHeights::open(std::string(TERRANE_SOURCE_DIR) + "/tools/data/jacksboro.tif", {}, &info);
    ASSERT_TRUE(source.has_value()) << source.error().message;
    EXPECT_EQ(info.columns, 403);
    EXPECT_EQ(info.rows, 344);
    EXPECT_TRUE(info.geographic);
    EXPECT_EQ(info.nodata_share, 0.0);
}

}  // namespace surface_test
}  // namespace terrane::test
