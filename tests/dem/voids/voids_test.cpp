// SPDX-License-Identifier: MIT
#include "raster/voids.h"

#include "dem/raster_files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace terrane::test {
namespace voids_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Opened {
    std::shared_ptr<const HeightSource> source;
    DemInfo info;

    double at(int column, int row) const {
        return source->height(sample_x(info, column), sample_y(info, row));
    }
    /// Flags of the finest cells that touch a sample.
    std::uint8_t flags_at(int column, int row) const {
        const Lattice& l = source->lattice();
        const SampleGrid grid{{std::llround((sample_x(info, column) - l.origin_x) / l.spacing) - 1,
                               std::llround((sample_y(info, row) - l.origin_y) / l.spacing) - 1},
                              1,
                              3,
                              3};
        std::array<std::uint8_t, 4> flags{};
        EXPECT_TRUE(source->cell_flags(grid, flags).has_value());
        EXPECT_EQ(flags[0], flags[1]);
        EXPECT_EQ(flags[0], flags[2]);
        EXPECT_EQ(flags[0], flags[3]);
        return flags[0];
    }
};

Opened open_spec(const RasterSpec& spec) {
    const TemporaryFolder folder;
    const std::string path = folder.file("voids.tif");
    write_raster(path, spec);
    Opened opened;
    const auto source = DemHeights::open(path, {}, &opened.info);
    EXPECT_TRUE(source.has_value()) << source.error().message;
    if (source) opened.source = *source;
    return opened;
}

/// A plane with a hole of 12 x 9 samples in the middle.
RasterSpec plane_with_hole(double hole) {
    RasterSpec spec;
    spec.columns = 60;
    spec.rows = 50;
    spec.value = [hole](int column, int row) {
        const bool inside = column >= 20 && column < 32 && row >= 20 && row < 29;
        return inside ? hole : 500.0 + 3.0 * column - 2.0 * row;
    };
    return spec;
}

void expect_filled_plane(const RasterSpec& spec) {
    const Opened opened = open_spec(spec);
    ASSERT_NE(opened.source, nullptr);
    EXPECT_NEAR(opened.info.filled_share, 108.0 / 3000.0, 1e-12);
    EXPECT_NEAR(opened.info.nodata_share, 108.0 / 3000.0, 1e-12);
    // A harmonic fill of a plane's hole is the plane.
    for (int row = 20; row < 29; ++row) {
        for (int column = 20; column < 32; ++column) {
            EXPECT_NEAR(opened.at(column, row), 500.0 + 3.0 * column - 2.0 * row, 0.05);
            EXPECT_EQ(opened.flags_at(column, row), cell_filled);
        }
    }
    EXPECT_EQ(opened.flags_at(18, 24), cell_ground);
    EXPECT_EQ(opened.flags_at(40, 24), cell_ground);
}

TEST(DemVoids, AHoleInAPlaneIsFilledWithThePlane) {
    RasterSpec spec = plane_with_hole(-9999.0);
    spec.nodata = -9999.0;
    expect_filled_plane(spec);
}

TEST(DemVoids, NotANumberAndInfinityAreNodata) {
    expect_filled_plane(plane_with_hole(kNaN));
    expect_filled_plane(plane_with_hole(std::numeric_limits<double>::infinity()));
}

TEST(DemVoids, AMaskBandIsHonoured) {
    RasterSpec spec = plane_with_hole(12345.0);
    for (int row = 0; row < spec.rows; ++row) {
        for (int column = 0; column < spec.columns; ++column) {
            spec.mask.push_back(spec.value(column, row) == 12345.0 ? 0 : 255);
        }
    }
    expect_filled_plane(spec);
}

TEST(DemVoids, NodataThatReachesTheBorderOverACornerIsOutside) {
    RasterSpec spec;
    spec.columns = spec.rows = 12;
    // A diagonal of single samples from the raster's corner to its middle.
    spec.value = [](int column, int row) { return column == row && row < 6 ? kNaN : 10.0; };
    const Opened opened = open_spec(spec);
    ASSERT_NE(opened.source, nullptr);
    EXPECT_EQ(opened.info.filled_share, 0.0);
    EXPECT_NEAR(opened.info.nodata_share, 6.0 / 144.0, 1e-12);
    EXPECT_EQ(opened.flags_at(5, 5), cell_outside);
    EXPECT_NEAR(opened.at(5, 5), 10.0, 1e-3);
}

TEST(DemVoids, AVoidInARingOfNodataIsToldFromTheOutside) {
    RasterSpec spec;
    spec.columns = spec.rows = 40;
    // Ground in a ring: nodata inside is a void, nodata around it is outside.
    spec.value = [](int column, int row) {
        const int ring = std::max(std::abs(column - 20), std::abs(row - 20));
        return ring > 6 && ring <= 14 ? 100.0 + column : kNaN;
    };
    const Opened opened = open_spec(spec);
    ASSERT_NE(opened.source, nullptr);
    EXPECT_NEAR(opened.info.filled_share, 169.0 / 1600.0, 1e-12);
    EXPECT_EQ(opened.flags_at(20, 20), cell_filled);
    EXPECT_EQ(opened.flags_at(2, 2), cell_outside);
    EXPECT_EQ(opened.flags_at(10, 20), cell_ground);
    EXPECT_NEAR(opened.at(20, 20), 120.0, 1.0);
}

TEST(DemVoids, FlagsOfCoarseCellsAreThoseOfAllTheirSamples) {
    const std::string path = real_data("tyrol_avaWog_5m_nodata.tif");
    if (path.empty()) GTEST_SKIP() << "tyrol_avaWog_5m_nodata.tif is not here";
    const auto opened = DemHeights::open(path, {});
    ASSERT_TRUE(opened.has_value());
    const HeightSource& source = **opened;
    const Lattice& l = source.lattice();
    const int side = 256;
    std::vector<std::uint8_t> fine(side * side), coarse(side * side / 64);
    ASSERT_TRUE(source.cell_flags({{l.west(), l.south()}, 1, side + 1, side + 1}, fine));
    ASSERT_TRUE(source.cell_flags({{l.west(), l.south()}, 8, side / 8 + 1, side / 8 + 1}, coarse));
    const SampleGrid corner{{l.west(), l.south()}, 1, side + 1, side + 1};
    for (int y = 0; y < side / 8; ++y) {
        for (int x = 0; x < side / 8; ++x) {
            // Beyond the outer edges a coarse cell may hold ground as well.
            const WorldRect& e = source.extent();
            if (l.x(corner.corner.x + 8 * x) < e.west + l.spacing ||
                l.y(corner.corner.y + 8 * y) < e.south + l.spacing) {
                continue;
            }
            std::uint8_t all = 0;
            for (int k = 0; k < 64; ++k) {
                all = static_cast<std::uint8_t>(
                    all | fine[static_cast<std::size_t>((8 * y + k / 8) * side + 8 * x + k % 8)]);
            }
            ASSERT_EQ(coarse[static_cast<std::size_t>(y * (side / 8) + x)], all) << x << ", " << y;
        }
    }
}

TEST(DemVoids, RealVoidsAreFilledWithinTheHeightsAround) {
    const std::string path = real_data("srtm3_rainier_1201_voids.tif");
    if (path.empty()) GTEST_SKIP() << "srtm3_rainier_1201_voids.tif is not here";
    DemInfo info;
    const auto source = DemHeights::open(path, {}, &info);
    ASSERT_TRUE(source.has_value()) << source.error().message;
    EXPECT_GT(info.filled_share, 0.004);
    EXPECT_LE(info.filled_share, info.nodata_share);
    const HeightInterval range = (*source)->interval((*source)->extent());
    EXPECT_GT(range.low, info.min_m - 1.0);
    EXPECT_LT(range.high, info.max_m + 1.0);
}

TEST(DemVoids, AnIrregularFrameIsOutsideAndSmooth) {
    const std::string path = real_data("tyrol_avaWog_5m_nodata.tif");
    if (path.empty()) GTEST_SKIP() << "tyrol_avaWog_5m_nodata.tif is not here";
    DemInfo info;
    const auto source = DemHeights::open(path, {}, &info);
    ASSERT_TRUE(source.has_value()) << source.error().message;
    EXPECT_NEAR(info.nodata_share, 0.346, 0.001);
    EXPECT_EQ(info.filled_share, 0.0);
    // The steepest surveyed slope is the steepest of all: the frame adds no cliffs.
    EXPECT_LT((*source)->rise_bound(1.0), 6.0);
}

}  // namespace voids_test
}  // namespace terrane::test
