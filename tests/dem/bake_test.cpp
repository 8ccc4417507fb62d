// SPDX-License-Identifier: MIT
//
// Baking rasters: chunks beyond the raster's edges are baked once and written many times.
#include "store/bake.h"

#include "raster_files.h"

#include <terrane/store/chunk_store.h>

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace terrane::test {
namespace {

struct Case {
    RasterSpec spec;
    double finest = 0.0;
};

RasterSpec rough(int columns, int rows, double cell_y, GDALDataType type = GDT_Float32) {
    return {.columns = columns,
            .rows = rows,
            .type = type,
            .transform = {1000.0, 10.0, 0.0, 5000.0, 0.0, -cell_y},
            .nodata = -9999.0,
            .value = [columns](int column, int row) {
                if (column == columns - 1 && row == 1) return -9999.0;
                return 100.0 + static_cast<double>((column * 7919 + row * 104729) % 400);
            }};
}

TEST(BakedRaster, ChunksBeyondAnEdgeEqualTheNearestOne) {
    const Case cases[] = {{rough(1700, 3, 10.0), 2.5},
                          {rough(3, 1300, 13.7), 3.0},
                          {rough(400, 9, 10.0), 0.625},
                          {rough(2500, 2, 10.0, GDT_Int16), 10.0}};
    const TemporaryFolder folder;
    const std::string path = folder.file("raster.tif");
    for (const Case& one : cases) {
        SCOPED_TRACE(std::to_string(&one - cases));
        write_raster(path, one.spec);
        DemSettings settings;
        settings.finest_spacing = one.finest;
        const auto source = open_dem(path, settings).source;
        const auto bakeable = internal::begin_bake(*source, path, {});
        ASSERT_TRUE(bakeable.has_value()) << bakeable.error().message;
        ASSERT_TRUE(bakeable->world.raster.has_value());
        const Lattice& lattice = source->lattice();
        const std::int64_t count = internal::count_chunks(lattice);
        std::int64_t repeated_count = 0;
        for (std::int64_t i = 0; i < count; ++i) {
            const ChunkKey key = internal::key_at(lattice, i);
            const ChunkKey repeated = internal::repeated_chunk(bakeable->world, key);
            if (repeated == key) continue;
            ASSERT_TRUE(lattice.contains(repeated));
            EXPECT_EQ(internal::repeated_chunk(bakeable->world, repeated), repeated);
            // All that are next to the nearest one, and some of the others.
            const bool is_next =
                std::abs(repeated.x - key.x) <= 1 && std::abs(repeated.y - key.y) <= 1;
            if (++repeated_count % 16 != 0 && !is_next) continue;
            const internal::Baked far = internal::bake_chunk(*bakeable, key);
            const internal::Baked near = internal::bake_chunk(*bakeable, repeated);
            ASSERT_FALSE(far.error || near.error);
            SCOPED_TRACE(std::to_string(key.level) + ": " + std::to_string(key.x) + ", " +
                         std::to_string(key.y));
            EXPECT_EQ(far.stored, near.stored);
            EXPECT_EQ(far.record.hash, near.record.hash);
            EXPECT_EQ(far.record.heights.low, near.record.heights.low);
            EXPECT_EQ(far.record.heights.high, near.record.heights.high);
            EXPECT_EQ(far.max_error_m, near.max_error_m);
            EXPECT_EQ(far.steepest, near.steepest);
        }
        EXPECT_GT(repeated_count, 10);
    }
}

}  // namespace
}  // namespace terrane::test
