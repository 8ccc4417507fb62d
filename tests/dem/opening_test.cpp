// SPDX-License-Identifier: MIT
//
// Cost of opening a raster: work proportional to its samples, counted, not timed; memory below the limit; progress
// reports; timeouts of blocked readers.
#include "bounds/level_bounds.h"
#include "bounds/raster_lattice.h"
#include "dem_source.h"
#include "raster_files.h"
#include "support/random.h"

#include <terrane/terrain/chunk.h>

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

namespace terrane::test {
namespace opening_test {

RasterSpec rough(int columns, int rows) {
    RasterSpec spec{.columns = columns, .rows = rows, .value = [](int column, int row) {
                        return 100.0 +
                               static_cast<double>((column * 7919 + row * 104729) % 1000) * 0.05;
                    }};
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
    DemSettings settings{.detail_seed = {}, .progress = [&told](double) {
                             ++told;
                             return false;
                         }};
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
    const auto grid = internal::make_grid(open_dem(path).info, 0.0);
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
    const DemInfo info = open_dem(path).info;
    ASSERT_EQ(info.cell_x, info.cell_y);
    const auto halvings = [&](double ratio, double tolerance) {
        DemSettings settings{.finest_spacing = ratio * info.cell_x,
                             .spacing_tolerance = tolerance,
                             .detail_seed = {}};
        return info.cell_x / open_dem(path, settings).source->lattice().spacing;
    };
    EXPECT_EQ(halvings(0.72, 1.0), 2.0);
    EXPECT_EQ(halvings(0.72, std::sqrt(2.0)), 1.0);
    EXPECT_EQ(halvings(0.70, std::sqrt(2.0)), 2.0);
    EXPECT_EQ(halvings(0.36, std::sqrt(2.0)), 2.0);
    EXPECT_EQ(halvings(0.35, std::sqrt(2.0)), 4.0);
    EXPECT_EQ(halvings(8.0, 1.0), 1.0);
    for (const double tolerance : {0.5, 2.5, std::nan("")}) {
        const auto refused =
            DemHeights::open(path, DemSettings{.spacing_tolerance = tolerance, .detail_seed = {}});
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
    DemSettings settings{.detail_seed = {}, .progress = [&shares](double share) {
                             shares.push_back(share);
                             return true;
                         }};
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
    const HungMosaic hung(folder, "Float32");
    const auto source =
        DemHeights::open(hung.path, DemSettings{.detail_seed = {}, .read_timeout = 0.3});
    ASSERT_FALSE(source.has_value());
    EXPECT_EQ(source.error().code, ErrorCode::timed_out) << source.error().message;
    EXPECT_NE(source.error().message.find(hung.path), std::string::npos) << source.error().message;
    EXPECT_NE(source.error().message.find("0.3 s"), std::string::npos) << source.error().message;
}

}  // namespace opening_test

namespace opening_cache_test {

namespace fs = std::filesystem;

using Place = DemCache::Place;

/// Large enough to be kept, and with a void and nodata at its border.
RasterSpec hills(double lift = 0.0) {
    RasterSpec spec{
        .columns = 300, .rows = 260, .nodata = -9999.0, .value = [lift](int column, int row) {
            const bool is_void = std::hypot(column - 100, row - 90) < 12;
            if (is_void || column + row < 20) return -9999.0;
            const double x = column % 40 - 20, y = row % 32 - 16;
            const double bump = column == 150 && row == 130 ? lift : 0.0;
            return 300.0 + 0.05 * x * x * x * 0.1 - 0.2 * y * y + bump;
        }};
    return spec;
}

OpenedDem open(const std::string& path, const DemCache& cache, double finest_spacing = 0.0) {
    return open_dem(path, {.finest_spacing = finest_spacing, .detail_seed = {}, .cache = cache});
}

class OpeningCacheTest : public testing::Test {
protected:
    OpeningCacheTest() {
        fs::create_directories(folder_.file("data"));
        write_raster(raster_, hills());
    }

    TemporaryFolder folder_;
    std::string raster_ = folder_.file("data/hills.tif"), cache_ = folder_.file("cache/bounds");
    const DemCache in_folder_{Place::folder, cache_}, beside_{Place::beside, cache_};
};

TEST_F(OpeningCacheTest, TheSecondOpeningReadsWhatTheFirstMadeAndAnswersTheSame) {
    const OpenedDem plain = open(raster_, {});
    EXPECT_TRUE(files_in(cache_).empty());
    const OpenedDem first = open(raster_, in_folder_);
    EXPECT_FALSE(first.info.from_cache);
    EXPECT_EQ(first.info.cache_note, "");
    EXPECT_EQ(files_in(cache_).size(), 1u);
    const OpenedDem second = open(raster_, in_folder_);
    EXPECT_TRUE(second.info.from_cache);
    expect_same_answers(*plain.source, *first.source);
    expect_same_answers(*plain.source, *second.source);
    EXPECT_EQ(files_in(folder_.file("data")).size(), 1u) << "nothing is left beside the raster";
}

TEST_F(OpeningCacheTest, ProgressReachesOneWhereBoundsAreReadToo) {
    open(raster_, in_folder_);
    double last = 0.0;
    DemSettings settings{.detail_seed = {}, .cache = in_folder_, .progress = [&last](double share) {
                             last = share;
                             return true;
                         }};
    EXPECT_TRUE(open_dem(raster_, settings).info.from_cache);
    EXPECT_EQ(last, 1.0);
    settings.progress = [](double share) { return share < 1.0; };
    const auto stopped = DemHeights::open(raster_, settings);
    ASSERT_FALSE(stopped.has_value());
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
}

TEST_F(OpeningCacheTest, OtherHeightsAtTheSamePathGetTheirOwn) {
    for (const DemCache& cache : {in_folder_, DemCache{Place::beside}}) {
        const auto time = fs::last_write_time(raster_);
        open(raster_, cache);
        write_raster(raster_, hills(25.0));  // one sample is another
        fs::last_write_time(raster_, time);  // by size and time the file is the same
        const OpenedDem changed = open(raster_, cache);
        EXPECT_FALSE(changed.info.from_cache);
        expect_same_answers(*open(raster_, {}).source, *changed.source);
        EXPECT_TRUE(open(raster_, cache).info.from_cache);
        write_raster(raster_, hills());
    }
}

TEST_F(OpeningCacheTest, AnotherLatticeGetsItsOwn) {
    open(raster_, beside_);
    EXPECT_FALSE(open(raster_, beside_, 2.5).info.from_cache);
    EXPECT_TRUE(open(raster_, beside_).info.from_cache) << "both are kept";
    EXPECT_TRUE(open(raster_, beside_, 2.5).info.from_cache);
    expect_same_answers(*open(raster_, {}, 2.5).source, *open(raster_, beside_, 2.5).source);
}

TEST_F(OpeningCacheTest, ACopyOfTheRasterHasWhatTheRasterHas) {
    open(raster_, in_folder_);
    fs::copy(raster_, folder_.file("copy.tif"));
    EXPECT_TRUE(open(folder_.file("copy.tif"), in_folder_).info.from_cache);
}

TEST_F(OpeningCacheTest, ADamagedFileIsToldAndReplaced) {
    open(raster_, in_folder_);
    const std::string file = files_in(cache_).at(0);
    const std::vector<char> whole = read_file(file);
    const auto expected = open(raster_, {}).source;
    const auto step_of_head = static_cast<std::size_t>(few_or_many(12, 3)),
               parts = static_cast<std::size_t>(few_or_many(6, 12));
    int told = 0;
    for (std::size_t at = 0; at < whole.size();
         at += at < 80 ? step_of_head : whole.size() / parts) {
        for (const bool is_cut : {false, true}) {
            std::vector<char> damaged = whole;
            damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
            if (is_cut) damaged.resize(at);
            write_file(file, damaged);
            const OpenedDem opened = open(raster_, in_folder_);
            EXPECT_FALSE(opened.info.from_cache) << at;
            EXPECT_NE(opened.info.cache_note.find(file), std::string::npos) << at;
            EXPECT_EQ(opened.info.cache_note.find('\n'), std::string::npos);
            ++told;
            ASSERT_TRUE(open(raster_, in_folder_).info.from_cache) << "replaced, " << at;
        }
    }
    EXPECT_GT(told, 20);
    expect_same_answers(*expected, *open(raster_, in_folder_).source);
}

TEST_F(OpeningCacheTest, AFileOfAnotherVersionIsReplaced) {
    open(raster_, in_folder_);
    const std::string file = files_in(cache_).at(0);
    auto other = SealedWriter::create(file, {{'B', 'N', 'D', 'S'}, 999});
    ASSERT_TRUE(other && other->commit({}));
    const OpenedDem opened = open(raster_, in_folder_);
    EXPECT_FALSE(opened.info.from_cache);
    EXPECT_NE(opened.info.cache_note.find("version 999"), std::string::npos);
    EXPECT_TRUE(open(raster_, in_folder_).info.from_cache);
}

TEST_F(OpeningCacheTest, WhereNothingCanBeWrittenItOpensAllTheSame) {
    // A file where a folder should be: not even root can write there.
    std::ofstream(folder_.file("taken")) << "x";
    const OpenedDem opened = open(raster_, DemCache{Place::folder, folder_.file("taken/cache")});
    EXPECT_NE(opened.info.cache_note.find("taken/cache"), std::string::npos);
    open(raster_, {Place::folder, ""});
}

TEST_F(OpeningCacheTest, AFullDiskLeavesNoPartOfAFile) {
    const OpenedDem opened = [&] {
        const FullDisk full(2000);
        return open(raster_, in_folder_);
    }();
    EXPECT_NE(opened.info.cache_note, "");
    EXPECT_TRUE(files_in(cache_).empty());
}

TEST_F(OpeningCacheTest, ManyThatOpenAtOnceAllAnswerTheSame) {
    const auto expected = open(raster_, {}).source;
    std::vector<OpenedDem> opened(8);
    {
        std::vector<std::jthread> threads;
        for (OpenedDem& into : opened) {
            threads.emplace_back([&] { into = open(raster_, in_folder_); });
        }
    }
    for (const OpenedDem& one : opened) {
        EXPECT_EQ(one.info.cache_note, "");
        expect_same_answers(*expected, *one.source);
    }
    EXPECT_EQ(files_in(cache_).size(), 1u) << "no part of a file is left";
}

TEST_F(OpeningCacheTest, ARasterReadByWindowHasTheSameKey) {
    open(raster_, in_folder_);
    internal::StoreSettings by_window{.memory_bytes = 0, .bounds_cache = in_folder_};
    const auto source = internal::DemSource::create(raster_, 0.0, by_window);
    ASSERT_TRUE(source.has_value());
    EXPECT_TRUE((*source)->cache_use().is_hit);
    expect_same_answers(*open(raster_, {}).source, **source);
}

TEST_F(OpeningCacheTest, ASmallRasterIsNotKept) {
    RasterSpec spec = hills();
    spec.rows = 200;
    write_raster(raster_, spec);
    EXPECT_FALSE(open(raster_, in_folder_).info.from_cache);
    EXPECT_TRUE(files_in(cache_).empty());
}

}  // namespace opening_cache_test
}  // namespace terrane::test
