// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace terrane::test {
namespace samples_test {

/// Uneven whole numbers that fit in a byte.
double bumps(int column, int row) { return (column * 37 + row * 91 + column * row * 5) % 251; }

RasterSpec bumpy(GDALDataType type, int columns = 37, int rows = 23) {
    RasterSpec spec;
    spec.columns = columns;
    spec.rows = rows;
    spec.type = type;
    spec.value = bumps;
    return spec;
}

/// Every sample, by height() and by sample(), is value * scale + offset.
void expect_samples(const RasterSpec& spec, double scale, double offset,
                    const DemSettings& settings = {}) {
    const TemporaryFolder folder;
    const std::string path = folder.file("samples.tif");
    write_raster(path, spec);
    DemInfo info;
    const auto opened = DemHeights::open(path, settings, &info);
    ASSERT_TRUE(opened.has_value()) << opened.error().message;
    const HeightSource& source = **opened;
    ASSERT_EQ(info.columns, spec.columns);
    ASSERT_EQ(info.rows, spec.rows);
    const Lattice& lattice = source.lattice();
    EXPECT_TRUE(check(lattice).has_value());
    for (int row = 0; row < spec.rows; ++row) {
        for (int column = 0; column < spec.columns; ++column) {
            const double wanted = spec.value(column, row) * scale + offset;
            const double x = sample_x(info, column), y = sample_y(info, row);
            ASSERT_NEAR(source.height(x, y), wanted, 1e-3) << column << ", " << row;
            if (info.cell_x != info.cell_y) continue;
            // Square cells: the sample is a point of the lattice.
            const double ix = (x - lattice.origin_x) / lattice.spacing;
            const double iy = (y - lattice.origin_y) / lattice.spacing;
            ASSERT_NEAR(ix, std::round(ix), 1e-6);
            ASSERT_NEAR(iy, std::round(iy), 1e-6);
            const SampleGrid one{{std::llround(ix), std::llround(iy)}, 1, 1, 1};
            double z = 0.0;
            ASSERT_TRUE(source.sample(one, {&z, 1}).has_value());
            ASSERT_NEAR(z, wanted, 1e-3);
            ASSERT_NEAR(z, source.height(lattice.x(one.corner.x), lattice.y(one.corner.y)), 1e-9);
        }
    }
}

TEST(DemSamples, EveryBandTypeGivesItsValues) {
    for (const GDALDataType type :
         {GDT_Byte, GDT_Int16, GDT_UInt16, GDT_Int32, GDT_UInt32, GDT_Float32, GDT_Float64}) {
        SCOPED_TRACE(GDALGetDataTypeName(type));
        expect_samples(bumpy(type), 1.0, 0.0);
    }
}

TEST(DemSamples, ScaleAndOffsetAreApplied) {
    RasterSpec spec = bumpy(GDT_Int16);
    spec.scale = 0.25;
    spec.offset = -30.0;
    expect_samples(spec, 0.25, -30.0);
}

TEST(DemSamples, FeetBecomeMetres) {
    RasterSpec spec = bumpy(GDT_Int16);
    spec.unit = "ft";
    spec.scale = 2.0;
    expect_samples(spec, 2.0 * 0.3048, 0.0);
}

TEST(DemSamples, SamplesStayOnAFinerLattice) {
    for (const double spacing : {4.0, 1.0, 0.3}) {
        DemSettings settings;
        settings.finest_spacing = spacing;
        expect_samples(bumpy(GDT_Float32), 1.0, 0.0, settings);
    }
}

TEST(DemSamples, OblongCellsKeepTheirSamples) {
    RasterSpec spec = bumpy(GDT_Float32);
    spec.transform[5] = -17.0;
    expect_samples(spec, 1.0, 0.0);
}

TEST(DemSamples, ARasterWithoutPlaceHasCellsOfOneMetre) {
    RasterSpec spec = bumpy(GDT_Byte);
    spec.has_place = false;
    spec.crs.clear();
    expect_samples(spec, 1.0, 0.0);
}

TEST(DemSamples, ARasterWhoseRowsGoNorthIsNotMirrored) {
    RasterSpec spec = bumpy(GDT_Float32);
    const int last = spec.rows - 1;
    spec.transform = {1000.0, 10.0, 0.0, 5000.0, 0.0, 10.0};
    const TemporaryFolder folder;
    const std::string path = folder.file("south_up.tif");
    write_raster(path, spec);
    DemInfo info;
    const auto source = DemHeights::open(path, {}, &info);
    ASSERT_TRUE(source.has_value()) << source.error().message;
    for (int row = 0; row <= last; ++row) {
        for (int column = 0; column < spec.columns; ++column) {
            // The file's row 0 is the southern one.
            ASSERT_NEAR((*source)->height(sample_x(info, column), sample_y(info, last - row)),
                        bumps(column, row), 1e-3);
        }
    }
    EXPECT_NEAR(info.centre_y, 5000.0 + 10.0 * spec.rows / 2.0, 1e-9);
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
    const TemporaryFolder folder;
    const std::string path = folder.file("rotated.tif");
    write_raster(path, spec);
    DemInfo info;
    const auto source = DemHeights::open(path, {}, &info);
    ASSERT_TRUE(source.has_value()) << source.error().message;
    const auto centre = map(30.0, 30.0);
    for (const double dx : {-80.0, 0.0, 55.0}) {
        for (const double dy : {-60.0, 0.0, 90.0}) {
            const double X = centre[0] + dx, Y = centre[1] + dy;
            const double wanted = 3.0 * (X - 1000.0) - 2.0 * (Y - 5000.0);
            EXPECT_NEAR((*source)->height((X - info.centre_x) * info.metres_per_unit_x,
                                          (Y - info.centre_y) * info.metres_per_unit_y),
                        wanted, 0.5);
        }
    }
    EXPECT_GT(info.nodata_share, 0.1);
}

}  // namespace samples_test
}  // namespace terrane::test
