// SPDX-License-Identifier: MIT
//
// DemSettings::crop: a cropped raster is the raster of its samples alone.
#include "dem/raster_files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <random>
#include <string>
#include <utility>

namespace terrane::test {
namespace crop_test {

using Rect = std::array<double, 4>;
using Transform = std::array<double, 6>;

double bumps(int column, int row) { return (column * 37 + row * 101 + column * row * 7) % 211; }

std::array<double, 2> place(const Transform& t, double column, double row) {
    return {t[0] + column * t[1] + row * t[2], t[3] + column * t[4] + row * t[5]};
}

/// First and last number of the samples that a crop must open along one axis of the file: those inside, and the nearest
/// ones outside. `centre(i)` is the coordinate of sample i.
template <class Centre>
std::pair<int, int> wanted(int count, double low, double high, const Centre& centre) {
    int first = count, last = -1;
    for (int i = 0; i < count; ++i) {
        if (centre(i) < low || centre(i) > high) continue;
        first = std::min(first, i);
        last = std::max(last, i);
    }
    if (last < 0) {  // between two samples
        for (int i = 0; i + 1 < count; ++i) {
            if (std::min(centre(i), centre(i + 1)) < low &&
                std::max(centre(i), centre(i + 1)) > high)
                return {i, i + 1};
        }
    }
    const auto is_on = [&](int i) { return centre(i) == low || centre(i) == high; };
    if (first > 0 && !is_on(first)) --first;
    if (last + 1 < count && !is_on(last)) ++last;
    return {first, last};
}

/// The raster of a window of the file alone.
RasterSpec cut(const RasterSpec& all, int column, int row, int columns, int rows) {
    RasterSpec part = all;
    part.columns = columns;
    part.rows = rows;
    const auto [x, y] = place(all.transform, column, row);
    part.transform[0] = x;
    part.transform[3] = y;
    part.value = [all, column, row](int c, int r) { return all.value(column + c, row + r); };
    return part;
}

void expect_same_raster(const OpenedDem& a, const OpenedDem& b) {
    EXPECT_EQ(std::pair(a.info.columns, a.info.rows), std::pair(b.info.columns, b.info.rows));
    EXPECT_EQ(a.info.cell_x, b.info.cell_x);
    EXPECT_EQ(a.info.cell_y, b.info.cell_y);
    EXPECT_EQ(a.info.min_m, b.info.min_m);
    EXPECT_EQ(a.info.max_m, b.info.max_m);
    EXPECT_EQ(a.info.nodata_share, b.info.nodata_share);
    EXPECT_EQ(a.info.centre_x, b.info.centre_x);
    EXPECT_EQ(a.info.centre_y, b.info.centre_y);
    EXPECT_EQ(a.info.metres_per_unit_x, b.info.metres_per_unit_x);
    EXPECT_EQ(a.info.crs_wkt, b.info.crs_wkt);
    expect_same_answers(*a.source, *b.source);
}

class DemCrop : public testing::Test {
protected:
    std::string written(const RasterSpec& spec) {
        write_raster(folder_.file("raster.tif"), spec);
        return folder_.file("raster.tif");
    }
    std::string refusal(const RasterSpec& spec, const DemSettings& settings) {
        const auto source = DemHeights::open(written(spec), settings);
        EXPECT_FALSE(source.has_value());
        return source ? "" : source.error().message;
    }

    TemporaryFolder folder_;
};

DemSettings cropped(const Rect& crop) {
    DemSettings settings;
    settings.crop = crop;
    return settings;
}

// Transforms have exact coordinates, so that the wanted samples are not a matter of rounding.
TEST_F(DemCrop, IsTheRasterOfItsSamplesAlone) {
    const std::array<Transform, 5> transforms{{{1000.0, 8.0, 0.0, 5000.0, 0.0, -8.0},
                                               {1000.0, 8.0, 0.0, 5000.0, 0.0, 16.0},
                                               {1000.0, -8.0, 0.0, 5000.0, 0.0, -8.0},
                                               {1000.0, 0.0, 8.0, 5000.0, -8.0, 0.0},
                                               {1000.0, 0.0, -4.0, 5000.0, 8.0, 0.0}}};
    for (const unsigned seed : {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u}) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        std::mt19937 random(seed);
        for (const Transform& transform : transforms) {
            RasterSpec all{
                .columns = 40, .rows = 31, .transform = transform, .nodata = 210.0, .value = bumps};
            const bool is_transposed = transform[1] == 0.0;
            const auto x_of = [&](int i) {
                return is_transposed ? place(transform, 0, i + 0.5)[0]
                                     : place(transform, i + 0.5, 0)[0];
            };
            const auto y_of = [&](int i) {
                return is_transposed ? place(transform, i + 0.5, 0)[1]
                                     : place(transform, 0, i + 0.5)[1];
            };
            const int x_count = is_transposed ? all.rows : all.columns;
            const int y_count = is_transposed ? all.columns : all.rows;
            const auto pick = [&](auto centre, int count) {
                const double a = centre(0), b = centre(count - 1);
                const double low = std::min(a, b), span = std::max(a, b) - low;
                double first = low + (random_unit(random) * 1.2 - 0.1) * span;
                double second = low + (random_unit(random) * 1.2 - 0.1) * span;
                if (random() % 4 == 0) first = centre(static_cast<int>(random() % 20));
                if (first > second) std::swap(first, second);
                return std::pair(std::min(first, low + 0.9 * span),
                                 std::max(second, low + 0.1 * span));
            };
            const auto [west, east] = pick(x_of, x_count);
            const auto [south, north] = pick(y_of, y_count);
            SCOPED_TRACE(testing::Message()
                         << west << ',' << south << ',' << east << ',' << north << " transform "
                         << transform[1] << ' ' << transform[2]);
            const auto along_x = wanted(x_count, west, east, x_of);
            const auto along_y = wanted(y_count, south, north, y_of);
            const auto [columns, rows] =
                is_transposed ? std::pair(along_y, along_x) : std::pair(along_x, along_y);
            if (columns.first == columns.second || rows.first == rows.second) continue;
            const RasterSpec part =
                cut(all, columns.first, rows.first, columns.second - columns.first + 1,
                    rows.second - rows.first + 1);
            const OpenedDem wanted_dem = open_dem(part);
            expect_same_raster(open_dem(all, cropped({west, south, east, north})), wanted_dem);
        }
    }
}

TEST_F(DemCrop, ARasterInDegreesIsScaledAtItsOwnMiddle) {
    const RasterSpec all{.columns = 64,
                         .rows = 48,
                         .transform = {10.0, 0.125, 0.0, 60.0, 0.0, -0.125},
                         .crs = "EPSG:4326",
                         .value = bumps};
    const OpenedDem part = open_dem(all, cropped({11.1875, 55.1875, 13.0625, 56.0625}));
    expect_same_raster(part, open_dem(cut(all, 9, 31, 16, 8)));
    EXPECT_GT(part.info.metres_per_unit_x, open_dem(all).info.metres_per_unit_x * 0.9);
}

TEST_F(DemCrop, OfARasterWithoutPlaceIsInMetresFromItsSouthWestCorner) {
    RasterSpec all{.columns = 20, .rows = 10, .crs = "", .has_place = false, .value = bumps};
    DemSettings settings = cropped({8.0, 4.0, 16.0, 12.0});
    settings.cell = 2.0;
    DemSettings of_part;
    of_part.cell = 2.0;
    // samples at 7, 9, .. 17 m and 3, 5, .. 13 m from the south-west
    expect_same_raster(open_dem(all, settings), open_dem(cut(all, 3, 3, 6, 6), of_part));
}

TEST_F(DemCrop, ARotatedRasterIsCroppedAroundTheRectangle) {
    const RasterSpec all{
        .columns = 60, .rows = 60, .transform = {0.0, 6.0, 8.0, 0.0, 8.0, -6.0}, .value = bumps};
    const OpenedDem whole = open_dem(all),
                    part = open_dem(all, cropped({300.0, -20.0, 400.0, 80.0}));
    EXPECT_LT(part.info.columns, whole.info.columns / 2);
    const auto dx = part.info.centre_x - whole.info.centre_x,
               dy = part.info.centre_y - whole.info.centre_y;
    // both are resampled, to different cells: surfaces differ by the two errors at most
    const double tolerance = part.info.resampling_error + whole.info.resampling_error;
    for (double x = 305.0; x < 400.0; x += 9.7) {
        for (double y = -15.0; y < 80.0; y += 9.7) {
            const double px = x - part.info.centre_x, py = y - part.info.centre_y;
            EXPECT_NEAR(part.source->height(px, py), whole.source->height(px + dx, py + dy),
                        tolerance);
        }
    }
}

TEST_F(DemCrop, SamplesOutsideAreNotRead) {
    RasterSpec all{.columns = 40, .rows = 40, .value = bumps};
    const Rect crop{1100.0, 4700.0, 1200.0, 4800.0};
    const OpenedDem before = open_dem(all, cropped(crop));
    all.value = [](int column, int row) {
        return column < 5 || row < 5 ? std::numeric_limits<double>::max() : bumps(column, row);
    };
    all.type = GDT_Float64;
    EXPECT_TRUE(refusal(all, {}).find("column 0") != std::string::npos);
    expect_same_raster(open_dem(all, cropped(crop)), before);
}

TEST_F(DemCrop, RefusesRectanglesThatAreNoneOrOutside) {
    const RasterSpec all{.columns = 40, .rows = 40, .value = bumps};
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (const Rect& crop :
         {Rect{1100, 4700, 1100, 4800}, Rect{1200, 4700, 1100, 4800}, Rect{1100, 4800, 1200, 4700},
          Rect{kNan, 4700, 1200, 4800}, Rect{1100, 4700, kInfinity, 4800}}) {
        EXPECT_TRUE(refusal(all, cropped(crop)).starts_with("crop must be west,south,east,north"));
    }
    for (const Rect& crop : {Rect{0, 4700, 1000, 4800}, Rect{1400, 4700, 1500, 4800},
                             Rect{1100, 5000, 1200, 6000}, Rect{1100, -1e300, 1200, 4600}}) {
        const std::string message = refusal(all, cropped(crop));
        EXPECT_TRUE(message.find("is outside raster") != std::string::npos &&
                    message.find("extends over 1000,4600,1400,5000") != std::string::npos)
            << message;
    }
    expect_same_raster(open_dem(all, cropped({-1e300, -1e300, 1e300, 1e300})), open_dem(all));
}

TEST_F(DemCrop, AtAnEdgeThereMustBeTwoByTwoSamples) {
    const RasterSpec all{.columns = 40, .rows = 40, .value = bumps};
    EXPECT_TRUE(refusal(all, cropped({990, 4700, 1003, 4800})).find("at least 2 x 2") !=
                std::string::npos);
    EXPECT_EQ(open_dem(all, cropped({990, 4700, 1006, 4800})).info.columns, 2);
}

}  // namespace crop_test
}  // namespace terrane::test
