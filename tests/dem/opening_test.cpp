// SPDX-License-Identifier: MIT
// Cost of opening a raster: work proportional to its samples, counted, not timed; memory below the limit; progress
// reports; timeouts of blocked readers.
#include "bounds/level_bounds.h"
#include "dem_source.h"
#include "raster_files.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

namespace terrane::test {
namespace opening_test {

RasterSpec rough(int columns, int rows) {
    RasterSpec spec;
    spec.columns = columns;
    spec.rows = rows;
    spec.value = [](int column, int row) {
        return 100.0 + static_cast<double>((column * 7919 + row * 104729) % 1000) * 0.05;
    };
    return spec;
}

/// Tiles visited while the bounds of a raster are computed; -1 if it does not open.
std::int64_t tile_visits(const RasterSpec& spec) {
    const TemporaryFolder folder;
    const std::string path = folder.file("raster.tif");
    write_raster(path, spec);
    auto reader = internal::RasterReader::open(path);
    if (!reader) return -1;
    internal::OpeningProgress progress(path, {});
    auto store = internal::RasterStore::open(std::move(*reader), {}, 0.0, progress);
    if (!store) return -1;
    const auto grid = internal::make_grid((*store)->info(), 0.0);
    if (!grid) return -1;
    const auto tiers = internal::BoundTiers::create(
        std::make_shared<const internal::FineSurface>(
            *grid, std::shared_ptr<const internal::RasterStore>(std::move(*store))),
        progress);
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

TEST(DemOpening, ARasterAboveTheLimitOfMemoryIsRefusedBeforeItIsRead) {
    const TemporaryFolder folder;
    const std::string path = folder.file("sparse.tif");
    GDALAllRegister();
    char sparse[] = "SPARSE_OK=TRUE", big[] = "BIGTIFF=YES";
    char* options[] = {sparse, big, nullptr};
    GDALDataset* file = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
        path.c_str(), 100000, 100000, 1, GDT_Float32, options);
    ASSERT_NE(file, nullptr);
    GDALClose(GDALDataset::ToHandle(file));
    int told = 0;
    DemSettings settings;
    settings.progress = [&told](double) {
        ++told;
        return false;
    };
    const auto source = DemHeights::open(path, settings);
    ASSERT_FALSE(source.has_value());
    EXPECT_EQ(source.error().code, ErrorCode::out_of_memory);
    for (const char* part :
         {path.c_str(), "100000 x 100000", "the limit is 2048 MiB", "--dem-memory-mb"}) {
        EXPECT_NE(source.error().message.find(part), std::string::npos) << source.error().message;
    }
    EXPECT_EQ(told, 0);
}

TEST(DemOpening, ScatteredNodataCountsForTheLimit) {
    const TemporaryFolder folder;
    const std::string path = folder.file("raster.tif");
    RasterSpec spec = rough(1000, 1000);
    write_raster(path, spec);
    DemInfo info;
    ASSERT_TRUE(DemHeights::open(path, {}, &info).has_value());
    const auto grid = internal::make_grid(info, 0.0);
    ASSERT_TRUE(grid.has_value());
    DemSettings settings;
    settings.memory_bytes = static_cast<std::size_t>(internal::opening_bytes(*grid, 4e6) + 1e6);
    EXPECT_TRUE(DemHeights::open(path, settings).has_value());
    // 500,000 runs of nodata.
    spec.value = [](int column, int row) { return (column + row) % 2 == 0 ? std::nan("") : 1.0; };
    write_raster(path, spec);
    const auto source = DemHeights::open(path, settings);
    ASSERT_FALSE(source.has_value());
    EXPECT_EQ(source.error().code, ErrorCode::out_of_memory) << source.error().message;
    EXPECT_TRUE(DemHeights::open(path, {}).has_value());
}

TEST(DemOpening, TakesTheHalvingOfACellWithinTheTolerance) {
    const TemporaryFolder folder;
    const std::string path = folder.file("raster.tif");
    write_raster(path, rough(20, 30));
    DemInfo info;
    ASSERT_TRUE(DemHeights::open(path, {}, &info).has_value());
    ASSERT_EQ(info.cell_x, info.cell_y);
    const auto halvings = [&](double ratio, double tolerance) {
        const double finest = ratio * info.cell_x;
        DemSettings settings;
        settings.finest_spacing = finest;
        settings.spacing_tolerance = tolerance;
        const auto source = DemHeights::open(path, settings);
        EXPECT_TRUE(source.has_value());
        return source ? info.cell_x / (*source)->lattice().spacing : 0.0;
    };
    EXPECT_EQ(halvings(0.72, 1.0), 2.0);
    EXPECT_EQ(halvings(0.72, std::sqrt(2.0)), 1.0);
    EXPECT_EQ(halvings(0.70, std::sqrt(2.0)), 2.0);
    EXPECT_EQ(halvings(0.36, std::sqrt(2.0)), 2.0);
    EXPECT_EQ(halvings(0.35, std::sqrt(2.0)), 4.0);
    EXPECT_EQ(halvings(8.0, 1.0), 1.0);
    for (const double tolerance : {0.5, 2.5, std::nan("")}) {
        DemSettings settings;
        settings.spacing_tolerance = tolerance;
        const auto refused = DemHeights::open(path, settings);
        ASSERT_FALSE(refused.has_value());
        EXPECT_NE(refused.error().message.find("spacing_tolerance must be 1 to 2"),
                  std::string::npos);
    }
}

TEST(DemOpening, TellsAShareThatGrowsToOneAndStopsWhereItIsTold) {
    const TemporaryFolder folder;
    const std::string path = folder.file("raster.tif");
    write_raster(path, rough(700, 900));
    std::vector<double> shares;
    DemSettings settings;
    settings.progress = [&shares](double share) {
        shares.push_back(share);
        return true;
    };
    ASSERT_TRUE(DemHeights::open(path, settings).has_value());
    ASSERT_GT(shares.size(), 10u);
    for (std::size_t i = 1; i < shares.size(); ++i) EXPECT_GE(shares[i], shares[i - 1]);
    EXPECT_GT(shares.front(), 0.0);
    EXPECT_DOUBLE_EQ(shares.back(), 1.0);
    for (const std::size_t stop : {std::size_t{1}, shares.size() / 2, shares.size() - 1}) {
        std::size_t told = 0;
        settings.progress = [&](double) { return ++told < stop; };
        const auto source = DemHeights::open(path, settings);
        ASSERT_FALSE(source.has_value());
        EXPECT_EQ(source.error().code, ErrorCode::cancelled);
        EXPECT_NE(source.error().message.find(path), std::string::npos);
        EXPECT_EQ(told, stop);
    }
}

TEST(DemOpening, AReaderThatGivesNoAnswerIsGivenUp) {
    const TemporaryFolder folder;
    const std::string pipe = folder.file("pipe.tif"), path = folder.file("mosaic.vrt");
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    std::ofstream(path)
        << "<VRTDataset rasterXSize=\"20\" rasterYSize=\"20\"><VRTRasterBand dataType=\"Float32\" "
           "band=\"1\"><SimpleSource><SourceFilename relativeToVRT=\"1\">pipe.tif"
           "</SourceFilename></SimpleSource></VRTRasterBand></VRTDataset>\n";
    DemSettings settings;
    settings.read_timeout = 0.3;
    const auto source = DemHeights::open(path, settings);
    ASSERT_FALSE(source.has_value());
    EXPECT_EQ(source.error().code, ErrorCode::timed_out) << source.error().message;
    EXPECT_NE(source.error().message.find(path), std::string::npos) << source.error().message;
    EXPECT_NE(source.error().message.find("0.3 s"), std::string::npos) << source.error().message;
    // Releases the thread that waits for the pipe.
    const int writer = open(pipe.c_str(), O_RDWR | O_NONBLOCK);
    ASSERT_GE(writer, 0);
    close(writer);
}

}  // namespace opening_test
}  // namespace terrane::test
