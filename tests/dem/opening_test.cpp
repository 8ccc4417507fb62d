// SPDX-License-Identifier: MIT
// What opening a raster costs: work in proportion to its samples, counted, not timed.
#include "bound_tiers.h"
#include "raster_files.h"

#include <gtest/gtest.h>

namespace terrane::test {
namespace {

RasterSpec rough(int columns, int rows) {
    RasterSpec spec;
    spec.columns = columns;
    spec.rows = rows;
    spec.value = [](int column, int row) {
        return 100.0 + static_cast<double>((column * 7919 + row * 104729) % 1000) * 0.05;
    };
    return spec;
}

/// Tiles visited while the bounds of a raster were made; -1 where it does not open.
std::int64_t tile_visits(const RasterSpec& spec) {
    const TemporaryFolder folder;
    const std::string path = folder.file("raster.tif");
    write_raster(path, spec);
    auto reader = internal::RasterReader::open(path);
    if (!reader) return -1;
    auto store = internal::RasterStore::open(std::move(*reader), {});
    if (!store) return -1;
    const auto grid = internal::make_grid((*store)->info(), 0.0);
    if (!grid) return -1;
    const auto tiers = internal::BoundTiers::create(std::make_shared<const internal::FineSurface>(
        *grid, std::shared_ptr<const internal::RasterStore>(std::move(*store))));
    return tiers ? (*tiers)->tile_visits() : -1;
}

TEST(DemOpening, TwiceTheLengthOfANarrowRasterIsAboutTwiceTheWork) {
    for (const bool is_tall : {true, false}) {
        std::int64_t before = 0;
        for (const int length : {1250, 2500, 5000, 10000}) {
            const std::int64_t visits = tile_visits(is_tall ? rough(4, length) : rough(length, 4));
            ASSERT_GT(visits, 0);
            // A level more for every doubling.
            if (before > 0) {
                EXPECT_LT(static_cast<double>(visits), 2.5 * static_cast<double>(before));
            }
            EXPECT_LT(visits, std::int64_t{200} * 4 * length) << length;
            before = visits;
        }
    }
}

TEST(DemOpening, ASquareRasterCostsLittleBeyondItsEdges) {
    // 2^16 tiles, in two triangles and a diamond of each of six levels, twice.
    const std::int64_t visits = tile_visits(rough(2048, 2048));
    EXPECT_GT(visits, 0);
    EXPECT_LT(visits, std::int64_t{65536} * 2 * 2 * 6 * 2);
}

}  // namespace
}  // namespace terrane::test
