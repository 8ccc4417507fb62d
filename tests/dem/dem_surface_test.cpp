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

namespace place_test {

RasterSpec slope(int columns, int rows) {
    RasterSpec spec{.columns = columns, .rows = rows, .value = [](int column, int row) {
                        return 100.0 + column + 2.0 * row;
                    }};
    return spec;
}

struct Opened {
    std::shared_ptr<const HeightSource> source;
    DemInfo info;
};

Opened open_spec(const RasterSpec& spec, const DemSettings& settings = {}) {
    const TemporaryFolder folder;
    const std::string path = folder.file("place.tif");
    write_raster(path, spec);
    Opened opened;
    const auto source = DemHeights::open(path, settings, &opened.info);
    EXPECT_TRUE(source.has_value()) << source.error().message;
    if (source) opened.source = *source;
    return opened;
}

TEST(DemPlace, RootsCoverTheOuterEdgesWithAtMostFourAlongAnAxis) {
    // The axes are independent: each number of columns with one of rows, each number of rows with several of columns.
    for (const auto& [columns, rows] : std::initializer_list<std::pair<int, int>>{{2, 2},
                                                                                  {3, 600},
                                                                                  {100, 128},
                                                                                  {127, 5},
                                                                                  {128, 600},
                                                                                  {129, 2},
                                                                                  {511, 5},
                                                                                  {512, 128},
                                                                                  {513, 2},
                                                                                  {700, 600}}) {
        for (const double cell_y : {10.0, 7.0}) {
            for (const double spacing : {0.0, 0.7}) {
                RasterSpec spec = slope(columns, rows);
                spec.transform[5] = -cell_y;
                const Opened opened =
                    open_spec(spec, DemSettings{.finest_spacing = spacing, .detail_seed = {}});
                ASSERT_NE(opened.source, nullptr);
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
}

TEST(DemPlace, ADegreeIsThatOfTheEllipsoidAtTheCentre) {
    RasterSpec spec = slope(120, 240);
    spec.crs = "EPSG:4326";
    spec.transform = {10.0, 1.0 / 1200, 0.0, 45.1, 0.0, -1.0 / 1200};
    const Opened opened = open_spec(spec);
    ASSERT_NE(opened.source, nullptr);
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
    const Opened opened = open_spec(spec);
    ASSERT_NE(opened.source, nullptr);
    EXPECT_NEAR(opened.info.cell_x, 10.0 * 1200.0 / 3937.0, 1e-9);
    EXPECT_NEAR(opened.info.metres_per_unit_x, 1200.0 / 3937.0, 1e-12);
}

TEST(DemPlace, BeyondTheOutermostSamplesTheEdgeGoesOn) {
    const Opened opened = open_spec(slope(50, 40));
    ASSERT_NE(opened.source, nullptr);
    const double edge = opened.source->height(sample_x(opened.info, 49), 0.0);
    for (const double beyond : {1.0, 4.9, 100.0, 1e5, 1e12}) {
        EXPECT_EQ(opened.source->height(sample_x(opened.info, 49) + beyond, 0.0), edge);
    }
    EXPECT_TRUE(std::isnan(opened.source->height(std::nan(""), 0.0)));
}

TEST(DemPlace, CellsBeyondTheOuterEdgesAreOutsideAndNoOthers) {
    const Opened opened = open_spec(slope(50, 40));
    ASSERT_NE(opened.source, nullptr);
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
    const TemporaryFolder folder;
    const std::string path = folder.file("detail.tif");
    write_raster(path, spec);
    DemSettings settings{.finest_spacing = 0.5, .detail_seed = {}};
    Pair pair;
    pair.bare = DemHeights::open(path, settings, &pair.info).value_or(nullptr);
    settings.detail_seed = 5;
    settings.detail_roughness = roughness;
    pair.detailed = DemHeights::open(path, settings).value_or(nullptr);
    return pair;
}

TEST(DemDetail, SamplesKeepTheirHeights) {
    const Pair pair = open_pair(hills(), 1.0);
    ASSERT_TRUE(pair.bare && pair.detailed);
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
    ASSERT_TRUE(pair.bare && pair.detailed);
    EXPECT_GT(mean_detail(pair, 8, 40), 0.1);
    EXPECT_LT(mean_detail(pair, 70, 90), 1e-6);
}

TEST(DemDetail, GrowsWithTheRoughnessThatIsSet) {
    const Pair one = open_pair(hills(), 1.0), two = open_pair(hills(), 2.0);
    ASSERT_TRUE(one.bare && one.detailed && two.bare && two.detailed);
    EXPECT_NEAR(mean_detail(two, 8, 40), 2.0 * mean_detail(one, 8, 40), 1e-3);
    const Pair none = open_pair(hills(), 0.0);
    ASSERT_TRUE(none.bare && none.detailed);
    EXPECT_EQ(mean_detail(none, 8, 40), 0.0);
}

TEST(DemDetail, BoundsHoldTheDetail) {
    const Pair pair = open_pair(hills(), 1.0);
    ASSERT_TRUE(pair.bare && pair.detailed);
    const HeightSource& source = *pair.detailed;
    const Lattice& l = source.lattice();
    for (std::int64_t step = 1; step <= l.step(0); step *= 2) {
        const SampleGrid grid{
            {(l.east() / 4) & -(2 * step), (l.north() / 2) & -(2 * step)}, step, 9, 9};
        std::vector<float> bounds(64);
        ASSERT_TRUE(source.cell_bounds(grid, bounds).has_value());
        for (int i = 0; i < 64; ++i) {
            const std::int64_t ix = grid.corner.x + (i % 8) * step;
            const std::int64_t iy = grid.corner.y + (i / 8) * step;
            const double side = l.spacing * static_cast<double>(step);
            const double x = l.x(ix), y = l.y(iy);
            const double sw = source.height(x, y), se = source.height(x + side, y);
            const double nw = source.height(x, y + side), ne = source.height(x + side, y + side);
            const bool to_north_east = ((ix / step + iy / step) & 1) == 0;
            for (int k = 0; k < 169; ++k) {
                const double u = (k % 13) / 12.0, v = (k / 13) / 12.0;
                double on_triangle = 0.0;
                if (to_north_east) {
                    on_triangle = u >= v ? sw + u * (se - sw) + v * (ne - se)
                                         : sw + v * (nw - sw) + u * (ne - nw);
                } else {
                    on_triangle = u + v <= 1.0 ? sw + u * (se - sw) + v * (nw - sw)
                                               : ne + (1.0 - u) * (nw - ne) + (1.0 - v) * (se - ne);
                }
                ASSERT_LE(std::fabs(source.height(x + u * side, y + v * side) - on_triangle),
                          static_cast<double>(bounds[static_cast<std::size_t>(i)]) + 1e-8)
                    << "step " << step;
            }
        }
    }
}

}  // namespace detail_test
}  // namespace terrane::test
