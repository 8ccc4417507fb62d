// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"

#include <gtest/gtest.h>

#include <cmath>

namespace terrane::test {
namespace place_test {

RasterSpec slope(int columns, int rows) {
    RasterSpec spec;
    spec.columns = columns;
    spec.rows = rows;
    spec.value = [](int column, int row) { return 100.0 + column + 2.0 * row; };
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
    for (const int columns : {2, 3, 100, 127, 128, 129, 511, 512, 513, 700}) {
        for (const int rows : {2, 5, 128, 600}) {
            for (const double cell_y : {10.0, 7.0}) {
                for (const double spacing : {0.0, 0.7}) {
                    RasterSpec spec = slope(columns, rows);
                    spec.transform[5] = -cell_y;
                    DemSettings settings;
                    settings.finest_spacing = spacing;
                    const Opened opened = open_spec(spec, settings);
                    ASSERT_NE(opened.source, nullptr);
                    const Lattice& l = opened.source->lattice();
                    const WorldRect& e = opened.source->extent();
                    ASSERT_TRUE(check(l).has_value()) << columns << " x " << rows;
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
}  // namespace terrane::test
