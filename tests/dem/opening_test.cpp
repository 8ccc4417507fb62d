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

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <thread>
#include <tuple>

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
    auto store = internal::RasterStore::open(std::move(*reader), {}, 0.0, nullptr, progress);
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
    const auto bytes = internal::OpeningBytes::of(*grid, 4e6);
    settings.memory_bytes = static_cast<std::size_t>(bytes.arrays + bytes.others + 1e6);
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

namespace opening_scan_test {

namespace fs = std::filesystem;

class OpeningScan : public testing::Test {
protected:
    static DemSettings settings(const std::string& scan, double finest = 0.0) {
        DemSettings settings;
        settings.finest_spacing = finest;
        settings.scan_file = scan;
        return settings;
    }
    OpenedDem open(const std::string& raster, const std::string& scan, double finest = 0.0) const {
        return open_dem(raster, settings(scan, finest));
    }
    Result<std::shared_ptr<const HeightSource>> try_open(double finest = 0.0) const {
        return DemHeights::open(raster_, settings(scan_, finest));
    }
    const std::string& raster_for(const RasterSpec& spec) const {
        write_raster(raster_, spec);
        return raster_;
    }
    void write(const std::vector<char>& bytes) const {
        std::ofstream(scan_, std::ios::binary)
            .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    }

    TemporaryFolder folder_;
    std::string raster_ = folder_.file("hills.tif"), scan_ = folder_.file("new/hills.scan");
};

/// Nodata in voids of several sizes, across squares of the scan and at the border.
RasterSpec wide(GDALDataType type, double cell_y) {
    return {.columns = 1100,
            .rows = 700,
            .type = type,
            .transform = {1000.0, 10.0, 0.0, 5000.0, 0.0, -cell_y},
            .nodata = -9999.0,
            .value = [](int column, int row) {
                const bool is_void = std::hypot(column - 260, row - 250) < 30 ||
                                     (column > 700 && column < 900 && row % 40 == 7);
                if (is_void || column + row < 60 || column > 1090) return -9999.0;
                const int x = column % 90 - 45, y = row % 70 - 35;
                const int height = 600 - x * x / 8 + x * y / 16 + y * y / 4;
                return static_cast<double>(height);
            }};
}

TEST_F(OpeningScan, ARasterThatIsReopenedAnswersTheSame) {
    struct Case {
        RasterSpec spec;
        double finest = 0.0;
    };
    RasterSpec whole = opening_test::rough(1100, 700);
    whole.type = GDT_Int32;
    const Case cases[] = {{wide(GDT_Float32, 10.0)},      {wide(GDT_Int16, 13.7)},
                          {wide(GDT_Int32, 10.0), 4.0},   {whole},
                          {opening_test::rough(4000, 3)}, {opening_test::rough(2, 2)}};
    for (const Case& one : cases) {
        SCOPED_TRACE(std::to_string(&one - cases));
        write_raster(raster_, one.spec);
        fs::remove(scan_);
        const OpenedDem plain = open_dem(raster_, settings("", one.finest));
        EXPECT_EQ(plain.info.samples_hash, "");
        const OpenedDem first = open(raster_, scan_, one.finest);
        const OpenedDem second = open(raster_, scan_, one.finest);
        EXPECT_EQ(first.info.samples_hash, second.info.samples_hash);
        EXPECT_EQ(first.info.samples_hash.size(), 32u);
        for (const DemInfo* info : {&first.info, &second.info}) {
            EXPECT_EQ(info->min_m, plain.info.min_m);
            EXPECT_EQ(info->max_m, plain.info.max_m);
            EXPECT_EQ(info->nodata_share, plain.info.nodata_share);
            EXPECT_EQ(info->filled_share, plain.info.filled_share);
        }
        expect_same_answers(*plain.source, *first.source);
        expect_same_answers(*plain.source, *second.source);
    }
}

TEST_F(OpeningScan, ArraysOnTheDiskGiveTheSameScan) {
    const auto bytes_of_scan = [this](std::size_t scratch_above) {
        fs::remove(scan_);
        const auto source = internal::DemSource::create(
            raster_, 0.0, {.scan_file = scan_, .scratch_above = scratch_above});
        EXPECT_TRUE(source.has_value());
        std::ifstream file(scan_, std::ios::binary);
        return std::vector<char>((std::istreambuf_iterator<char>(file)), {});
    };
    for (const RasterSpec& spec : {wide(GDT_Float32, 10.0), opening_test::rough(900, 500)}) {
        write_raster(raster_, spec);
        const std::vector<char> in_memory = bytes_of_scan(std::size_t{1} << 40);
        EXPECT_GT(in_memory.size(), 1000u);
        EXPECT_EQ(bytes_of_scan(0), in_memory);
        const fs::path folder = fs::path(scan_).parent_path();
        EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1) << "no other file is left";
    }
}

TEST_F(OpeningScan, SpaceThatTheDiskDoesNotHaveIsRefused) {
    for (const std::string& beside : {scan_, std::string("/proc/none/hills.scan")}) {
        const auto refused = internal::ScratchMemory::create(beside, std::size_t{1} << 60);
        ASSERT_FALSE(refused.has_value());
        EXPECT_EQ(refused.error().code, ErrorCode::io);
        EXPECT_NE(refused.error().message.find(beside), std::string::npos)
            << refused.error().message;
    }
    EXPECT_TRUE(fs::is_empty(fs::path(scan_).parent_path()));
}

TEST_F(OpeningScan, MemoryBesidesTheArraysHardlyGrowsWithTheRaster) {
    DemInfo info = open_dem(raster_for(opening_test::rough(20, 20)), {}).info;
    info.columns = info.rows = 1'000'000;
    const auto grid = internal::make_grid(info, 0.0);
    ASSERT_TRUE(grid.has_value());
    const internal::StoreSettings settings;
    const auto bytes = internal::OpeningBytes::of(*grid, static_cast<double>(settings.cache_bytes));
    EXPECT_LT(bytes.others, 512.0 * 1024 * 1024);
    EXPECT_GT(bytes.arrays, 1e11);
}

TEST_F(OpeningScan, DetailIsTheSame) {
    write_raster(raster_, wide(GDT_Float32, 10.0));
    DemSettings plain = settings("", 5.0), scanned = settings(scan_, 5.0);
    plain.detail_seed = scanned.detail_seed = 3;
    open_dem(raster_, scanned);
    expect_same_answers(*open_dem(raster_, plain).source, *open_dem(raster_, scanned).source);
}

TEST_F(OpeningScan, ASampleThatChangedIsFoundWhenItIsRead) {
    const auto spec = [](double lift) {
        RasterSpec changed = wide(GDT_Float32, 10.0);
        changed.value = [lift, value = changed.value](int column, int row) {
            return value(column, row) + (column == 600 && row == 100 ? lift : 0.0);
        };
        return changed;
    };
    write_raster(raster_, spec(0.0));
    const auto time = fs::last_write_time(raster_);
    const OpenedDem before = open(raster_, scan_);
    write_raster(raster_, spec(0.25));
    // Files that look changed are compared as a whole.
    fs::last_write_time(raster_, time + std::chrono::hours(1));
    const auto changed = try_open();
    ASSERT_FALSE(changed.has_value());
    EXPECT_EQ(changed.error().code, ErrorCode::bad_data);
    EXPECT_NE(changed.error().message.find("rows 512 to 699"), std::string::npos)
        << changed.error().message;
    fs::last_write_time(raster_, time);
    const OpenedDem after = open(raster_, scan_);
    std::vector<double> heights(4);
    const auto sample = [&](int column, int row) {
        const Lattice& lattice = after.source->lattice();
        const auto at = [](double place, double origin, double spacing) {
            return static_cast<std::int64_t>(std::floor((place - origin) / spacing));
        };
        const LatticePoint corner{
            at(sample_x(after.info, column), lattice.origin_x, lattice.spacing),
            at(sample_y(after.info, row), lattice.origin_y, lattice.spacing)};
        return after.source->sample({corner, 1, 2, 2}, heights);
    };
    const auto refused = sample(600, 100);
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, ErrorCode::bad_data);
    for (const char* part : {raster_.c_str(), "columns 512 to 767", "rows 512 to 699"}) {
        EXPECT_NE(refused.error().message.find(part), std::string::npos) << refused.error().message;
    }
    EXPECT_TRUE(sample(100, 100).has_value()) << "its square has not changed";
    fs::remove(scan_);
    EXPECT_NE(open(raster_, scan_).info.samples_hash, before.info.samples_hash);
}

TEST_F(OpeningScan, ACopyOfTheRasterIsReopened) {
    write_raster(raster_, wide(GDT_Float32, 10.0));
    const std::string copy = folder_.file("copy.tif");
    fs::copy(raster_, copy);
    fs::last_write_time(copy, fs::last_write_time(raster_) + std::chrono::hours(1));
    const OpenedDem first = open(raster_, scan_);
    double last = 0.0;
    DemSettings told = settings(scan_);
    told.progress = [&last](double share) {
        last = share;
        return true;
    };
    const OpenedDem second = open_dem(copy, told);
    EXPECT_EQ(last, 1.0);
    told.progress = [](double) { return false; };
    const auto stopped = DemHeights::open(copy, told);
    ASSERT_FALSE(stopped.has_value());
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
    EXPECT_EQ(first.info.samples_hash, second.info.samples_hash);
    expect_same_answers(*first.source, *second.source);
}

TEST_F(OpeningScan, TheHashOfSamplesTellsWhichHaveNoData) {
    const auto hash = [this](double nodata) {
        // The void is filled with the height around it.
        write_raster(raster_,
                     {.columns = 30, .rows = 30, .nodata = nodata, .value = [](int c, int r) {
                          return c == 15 && r == 15 ? 8.0 : 7.0;
                      }});
        fs::remove(scan_);
        return open(raster_, scan_).info.samples_hash;
    };
    const std::string with_nodata = hash(8.0);
    EXPECT_NE(with_nodata, hash(9.0));
    write_raster(raster_,
                 {.columns = 30, .rows = 30, .nodata = 9.0, .value = [](int, int) { return 7.0; }});
    fs::remove(scan_);
    EXPECT_NE(with_nodata, open(raster_, scan_).info.samples_hash);
}

TEST_F(OpeningScan, TheScanOfAnotherRasterIsRefused) {
    write_raster(raster_, wide(GDT_Float32, 10.0));
    open(raster_, scan_);
    EXPECT_FALSE(try_open(2.0).has_value()) << "another lattice";
    write_raster(raster_, opening_test::rough(500, 20));
    const auto refused = try_open();
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
    for (const std::string& part : {raster_, scan_}) {
        EXPECT_NE(refused.error().message.find(part), std::string::npos) << refused.error().message;
    }
}

TEST_F(OpeningScan, ADamagedScanGivesNoWrongAnswer) {
    write_raster(raster_, wide(GDT_Float32, 10.0));
    const OpenedDem whole = open(raster_, scan_);
    std::ifstream file(scan_, std::ios::binary);
    const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
    ASSERT_GT(bytes.size(), 1000u);
    const Lattice& lattice = whole.source->lattice();
    const SampleGrid grid{
        lattice.corner(
            {.x = lattice.first_root_x * 4 + 1, .y = lattice.first_root_y * 4 + 1, .level = 2}),
        lattice.chunk_side(2) / kChunkCells, 129, 129};
    const auto answers = [&grid](const HeightSource& source) {
        std::vector<double> heights(grid.size());
        std::vector<float> bounds(grid.size()), cells(128u * 128u);
        std::vector<std::uint8_t> flags(128u * 128u);
        const bool is_read = source.sample(grid, heights) &&
                             source.mesh_bounds(grid, bounds, cells) &&
                             source.cell_flags(grid, flags);
        const HeightInterval range = source.interval(source.extent());
        const HeightInterval part = source.interval({-500.0, -500.0, 300.0, 200.0});
        return std::tuple(is_read, heights, bounds, cells, flags, range.low, range.high, part.low,
                          part.high);
    };
    const auto expected = answers(*whole.source);
    ASSERT_TRUE(std::get<0>(expected));
    std::mt19937 random(3);
    int refused = 0, told = 0, same = 0;
    for (int i = 0; i < 150; ++i) {
        std::vector<char> damaged = bytes;
        if (i % 10 == 0) {
            damaged.resize(random() % bytes.size());
        } else {
            damaged[random() % bytes.size()] ^= static_cast<char>(1u << (random() % 8));
        }
        write(damaged);
        const auto source = try_open();
        if (!source) {
            ++refused;
            EXPECT_NE(source.error().message.find(scan_), std::string::npos)
                << source.error().message;
            continue;
        }
        auto found = answers(**source);
        if (!std::get<0>(found)) {
            ++told;
            continue;
        }
        if (std::isinf(std::get<7>(found))) {
            ++told;
            std::get<7>(found) = std::get<7>(expected);
            std::get<8>(found) = std::get<8>(expected);
        }
        EXPECT_EQ(found, expected) << "change " << i;
        ++same;
    }
    EXPECT_GT(refused, 10);
    EXPECT_GT(told, 0);
    EXPECT_GT(same, 0);
}

TEST_F(OpeningScan, NothingIsWrittenOfARasterThatIsResampled) {
    RasterSpec turned = opening_test::rough(60, 50);
    turned.transform = {1000.0, 8.0, 6.0, 5000.0, 6.0, -8.0};
    write_raster(raster_, turned);
    const OpenedDem opened = open(raster_, scan_);
    EXPECT_EQ(opened.info.samples_hash, "");
    EXPECT_FALSE(fs::exists(scan_));
}

TEST_F(OpeningScan, AScanThatCannotBeWrittenIsTold) {
    write_raster(raster_, opening_test::rough(50, 50));
    const auto refused = DemHeights::open(raster_, settings("/proc/none/hills.scan"));
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, ErrorCode::io);
}

}  // namespace opening_scan_test
}  // namespace terrane::test
