// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"
#include "dem_source.h"
#include "raster/voids.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <thread>

namespace terrane::test {
namespace samples_test {

/// Uneven whole numbers that fit in a byte.
double bumps(int column, int row) { return (column * 37 + row * 91 + column * row * 5) % 251; }

RasterSpec bumpy(GDALDataType type, int columns = 37, int rows = 23) {
    RasterSpec spec{.columns = columns, .rows = rows, .type = type, .value = bumps};
    return spec;
}

/// Every sample, by height() and by sample(), is value * scale + offset.
void expect_samples(const RasterSpec& spec, double scale = 1.0, double offset = 0.0,
                    double finest_spacing = 0.0) {
    const OpenedDem dem = open_dem(spec, {.finest_spacing = finest_spacing, .detail_seed = {}});
    const DemInfo& info = dem.info;
    ASSERT_EQ(info.columns, spec.columns);
    ASSERT_EQ(info.rows, spec.rows);
    const Lattice& lattice = dem.source->lattice();
    EXPECT_TRUE(lattice.validate().has_value());
    for (int row = 0; row < spec.rows; ++row) {
        for (int column = 0; column < spec.columns; ++column) {
            const double wanted = spec.value(column, row) * scale + offset;
            ASSERT_NEAR(dem.at(column, row), wanted, 1e-3) << column << ", " << row;
            if (info.cell_x != info.cell_y) continue;
            // Square cells: the sample is a point of the lattice.
            const double ix = (sample_x(info, column) - lattice.origin_x) / lattice.spacing;
            const double iy = (sample_y(info, row) - lattice.origin_y) / lattice.spacing;
            ASSERT_NEAR(ix, std::round(ix), 1e-6);
            ASSERT_NEAR(iy, std::round(iy), 1e-6);
            const SampleGrid one{{std::llround(ix), std::llround(iy)}, 1, 1, 1};
            double z = 0.0;
            ASSERT_TRUE(dem.source->sample(one, {&z, 1}).has_value());
            ASSERT_NEAR(z, wanted, 1e-3);
            ASSERT_NEAR(z, dem.source->height(lattice.x(one.corner.x), lattice.y(one.corner.y)),
                        1e-9);
        }
    }
}

TEST(DemSamples, EveryBandTypeGivesItsValues) {
    for (const GDALDataType type :
         {GDT_Byte, GDT_Int16, GDT_UInt16, GDT_Int32, GDT_UInt32, GDT_Float32, GDT_Float64}) {
        SCOPED_TRACE(GDALGetDataTypeName(type));
        expect_samples(bumpy(type));
    }
}

TEST(DemSamples, HaveScaleOffsetAndUnitOnAnyLattice) {
    RasterSpec spec = bumpy(GDT_Int16);
    spec.scale = 0.25;
    spec.offset = -30.0;
    expect_samples(spec, 0.25, -30.0);
    spec.unit = "ft";
    expect_samples(spec, 0.25 * 0.3048, -30.0 * 0.3048);
    for (const double spacing : {4.0, 1.0, 0.3})
        expect_samples(bumpy(GDT_Float32), 1.0, 0.0, spacing);
    RasterSpec oblong = bumpy(GDT_Float32);
    oblong.transform[5] = -17.0;
    expect_samples(oblong);
    RasterSpec placeless = bumpy(GDT_Byte);  // cells of a metre
    placeless.has_place = false;
    placeless.crs.clear();
    expect_samples(placeless);
}

TEST(DemSamples, ARasterWhoseRowsGoNorthIsNotMirrored) {
    RasterSpec spec = bumpy(GDT_Float32);
    const int last = spec.rows - 1;
    spec.transform = {1000.0, 10.0, 0.0, 5000.0, 0.0, 10.0};
    const OpenedDem dem = open_dem(spec);
    for (int row = 0; row <= last; ++row) {
        for (int column = 0; column < spec.columns; ++column) {
            // The file's row 0 is the southern one.
            ASSERT_NEAR(dem.at(column, last - row), bumps(column, row), 1e-3);
        }
    }
    EXPECT_NEAR(dem.info.centre_y, 5000.0 + 10.0 * spec.rows / 2.0, 1e-9);
}

TEST(DemSamples, ARotatedRasterIsStraightened) {
    RasterSpec spec = bumpy(GDT_Float32, 60, 60);
    // A plane over the map, rotated by 30 degrees: 3 up a metre east, 2 down a metre north.
    const double c = 10.0 * 0.8660254037844386, s = 10.0 * 0.5;
    spec.transform = {1000.0, c, s, 5000.0, s, -c};
    const auto map = [&](double column, double row) {
        return std::array<double, 2>{spec.transform[0] + column * c + row * s,
                                     spec.transform[3] + column * s - row * c};
    };
    spec.value = [&](int column, int row) {
        const auto p = map(column + 0.5, row + 0.5);
        return 3.0 * (p[0] - 1000.0) - 2.0 * (p[1] - 5000.0);
    };
    const auto [source, info] = open_dem(spec);
    const auto centre = map(30.0, 30.0);
    for (const double dx : {-80.0, 0.0, 55.0}) {
        for (const double dy : {-60.0, 0.0, 90.0}) {
            const double X = centre[0] + dx, Y = centre[1] + dy;
            const double wanted = 3.0 * (X - 1000.0) - 2.0 * (Y - 5000.0);
            EXPECT_NEAR(source->height((X - info.centre_x) * info.metres_per_unit_x,
                                       (Y - info.centre_y) * info.metres_per_unit_y),
                        wanted, 0.5);
        }
    }
    EXPECT_GT(info.nodata_share, 0.1);
}

}  // namespace samples_test

namespace window_read_test {

using internal::DemSource;
using internal::StoreSettings;

/// Nothing in memory, and a cache of four squares.
constexpr StoreSettings kByWindow{0, 0};

TEST(DemWindowRead, AnswersAreThoseOfTheRasterInMemory) {
    RasterSpec spec{.columns = 700, .rows = 530};
    // Rough ground with a frame, voids, and a large one.
    spec.value = [](int column, int row) {
        if (column + row < 90 || (column * 7 + row * 13) % 1009 == 0) return std::nan("");
        if (std::abs(column - 400) < 60 && std::abs(row - 300) < 70) return std::nan("");
        return 300.0 + 40.0 * std::sin(column * 0.05) * std::cos(row * 0.07) +
               (column * 31 + row * 57) % 17;
    };
    for (const double cell_y : {10.0, 13.0}) {
        spec.transform[5] = -cell_y;
        // Floats are held as they are, doubles are packed: fills too.
        spec.type = cell_y == 10.0 ? GDT_Float32 : GDT_Float64;
        const TemporaryFolder folder;
        const std::string path = folder.file("window.tif");
        write_raster(path, spec);
        const auto in_memory = DemSource::create(path, 2.0, {});
        const auto by_window = DemSource::create(path, 2.0, kByWindow);
        ASSERT_TRUE(in_memory.has_value() && by_window.has_value());
        ASSERT_TRUE((*in_memory)->store().in_memory());
        ASSERT_FALSE((*by_window)->store().in_memory());
        expect_same_answers(**in_memory, **by_window);
    }
}

TEST(DemWindowRead, ThreadsReadTheSameHeights) {
    RasterSpec spec{.columns = 900, .rows = 900, .value = [](int column, int row) {
                        return (column * 37 + row * 91) % 251;
                    }};
    const TemporaryFolder folder;
    const std::string path = folder.file("threads.tif");
    write_raster(path, spec);
    const auto opened = DemSource::create(path, 0.0, kByWindow);
    ASSERT_TRUE(opened.has_value());
    const DemSource& source = **opened;
    std::array<int, 4> wrong{};
    {
        std::vector<std::jthread> threads;
        for (std::size_t t = 0; t < wrong.size(); ++t) {
            threads.emplace_back([&, t] {
                std::mt19937 random(static_cast<unsigned>(t));
                for (int i = 0; i < 2000; ++i) {
                    const int column = static_cast<int>(random() % 900u);
                    const int row = static_cast<int>(random() % 900u);
                    const double z = source.height(sample_x(source.info(), column),
                                                   sample_y(source.info(), row));
                    if (std::fabs(z - (column * 37 + row * 91) % 251) > 1e-6) ++wrong[t];
                }
            });
        }
    }
    for (const int count : wrong) EXPECT_EQ(count, 0);
}

}  // namespace window_read_test

namespace voids_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Flags of the finest cells that touch a sample.
std::uint8_t flags_at(const OpenedDem& dem, int column, int row) {
    const Lattice& l = dem.source->lattice();
    const SampleGrid grid{{std::llround((sample_x(dem.info, column) - l.origin_x) / l.spacing) - 1,
                           std::llround((sample_y(dem.info, row) - l.origin_y) / l.spacing) - 1},
                          1,
                          3,
                          3};
    std::array<std::uint8_t, 4> flags{};
    EXPECT_TRUE(dem.source->cell_flags(grid, flags).has_value());
    for (const std::uint8_t other : flags) EXPECT_EQ(other, flags[0]);
    return flags[0];
}

/// A plane with a hole of 12 x 9 samples in the middle.
RasterSpec plane_with_hole(double hole) {
    RasterSpec spec{.columns = 60, .rows = 50, .value = [hole](int column, int row) {
                        const bool inside = column >= 20 && column < 32 && row >= 20 && row < 29;
                        return inside ? hole : 500.0 + 3.0 * column - 2.0 * row;
                    }};
    return spec;
}

void expect_filled_plane(const RasterSpec& spec) {
    const OpenedDem opened = open_dem(spec);
    EXPECT_NEAR(opened.info.filled_share, 108.0 / 3000.0, 1e-12);
    EXPECT_NEAR(opened.info.nodata_share, 108.0 / 3000.0, 1e-12);
    // A harmonic fill of a plane's hole is the plane.
    for (int row = 20; row < 29; ++row) {
        for (int column = 20; column < 32; ++column) {
            EXPECT_NEAR(opened.at(column, row), 500.0 + 3.0 * column - 2.0 * row, 0.05);
            EXPECT_EQ(flags_at(opened, column, row), cell_filled);
        }
    }
    EXPECT_EQ(flags_at(opened, 18, 24), cell_ground);
    EXPECT_EQ(flags_at(opened, 40, 24), cell_ground);
}

TEST(DemVoids, AHoleInAPlaneIsFilledWithThePlaneHoweverItIsMarked) {
    RasterSpec spec = plane_with_hole(-9999.0);
    spec.nodata = -9999.0;
    expect_filled_plane(spec);
    expect_filled_plane(plane_with_hole(kNaN));
    expect_filled_plane(plane_with_hole(std::numeric_limits<double>::infinity()));
    RasterSpec masked = plane_with_hole(12345.0);
    for (int row = 0; row < masked.rows; ++row) {
        for (int column = 0; column < masked.columns; ++column)
            masked.mask.push_back(masked.value(column, row) == 12345.0 ? 0 : 255);
    }
    expect_filled_plane(masked);
}

TEST(DemVoids, NodataThatReachesTheBorderOverACornerIsOutside) {
    RasterSpec spec;
    spec.columns = spec.rows = 12;
    // A diagonal of single samples from the raster's corner to its middle.
    spec.value = [](int column, int row) { return column == row && row < 6 ? kNaN : 10.0; };
    const OpenedDem opened = open_dem(spec);
    EXPECT_EQ(opened.info.filled_share, 0.0);
    EXPECT_NEAR(opened.info.nodata_share, 6.0 / 144.0, 1e-12);
    EXPECT_EQ(flags_at(opened, 5, 5), cell_outside);
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
    const OpenedDem opened = open_dem(spec);
    EXPECT_NEAR(opened.info.filled_share, 169.0 / 1600.0, 1e-12);
    EXPECT_EQ(flags_at(opened, 20, 20), cell_filled);
    EXPECT_EQ(flags_at(opened, 2, 2), cell_outside);
    EXPECT_EQ(flags_at(opened, 10, 20), cell_ground);
    EXPECT_NEAR(opened.at(20, 20), 120.0, 1.0);
}

TEST(DemVoids, FlagsOfCoarseCellsAreThoseOfAllTheirSamples) {
    const std::string path = real_data("tyrol_avaWog_5m_nodata.tif");
    if (path.empty()) GTEST_SKIP() << "tyrol_avaWog_5m_nodata.tif is not here";
    const OpenedDem dem = open_dem(path);
    const HeightSource& source = *dem.source;
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
    const auto [source, info] = open_dem(path);
    EXPECT_GT(info.filled_share, 0.004);
    EXPECT_LE(info.filled_share, info.nodata_share);
    const HeightInterval range = source->interval(source->extent());
    EXPECT_GT(range.low, info.min_m - 1.0);
    EXPECT_LT(range.high, info.max_m + 1.0);
}

TEST(DemVoids, AnIrregularFrameIsOutsideAndSmooth) {
    const std::string path = real_data("tyrol_avaWog_5m_nodata.tif");
    if (path.empty()) GTEST_SKIP() << "tyrol_avaWog_5m_nodata.tif is not here";
    const auto [source, info] = open_dem(path);
    EXPECT_NEAR(info.nodata_share, 0.346, 0.001);
    EXPECT_EQ(info.filled_share, 0.0);
    // The steepest surveyed slope is the steepest of all: the frame adds no cliffs.
    EXPECT_LT(source->rise_bound(1.0), 6.0);
}

}  // namespace voids_test
}  // namespace terrane::test
