// SPDX-License-Identifier: MIT
#include "dem_source.h"
#include "raster_files.h"

#include <terrane/terrain/chunk.h>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

namespace terrane::test {
namespace opening_cache_test {

namespace fs = std::filesystem;

using Place = DemCache::Place;

/// Large enough to be kept, and with a void and nodata at its border.
RasterSpec hills(double lift = 0.0) {
    RasterSpec spec;
    spec.columns = 300;
    spec.rows = 260;
    spec.nodata = -9999.0;
    spec.value = [lift](int column, int row) {
        const bool is_void = std::hypot(column - 100, row - 90) < 12;
        if (is_void || column + row < 20) return -9999.0;
        const double x = column % 40 - 20, y = row % 32 - 16;
        const double bump = column == 150 && row == 130 ? lift : 0.0;
        return 300.0 + 0.05 * x * x * x * 0.1 - 0.2 * y * y + bump;
    };
    return spec;
}

struct Opened {
    std::shared_ptr<const HeightSource> source;
    DemInfo info;
};

Opened open(const std::string& path, const DemCache& cache, double finest_spacing = 0.0) {
    Opened opened;
    DemSettings settings;
    settings.finest_spacing = finest_spacing;
    settings.cache = cache;
    const auto source = DemHeights::open(path, settings, &opened.info);
    EXPECT_TRUE(source.has_value()) << (source ? "" : source.error().message);
    if (source) opened.source = *source;
    return opened;
}

/// Every answer of two sources over all chunks, with their reaches and intervals.
void expect_same(const HeightSource& a, const HeightSource& b) {
    const Lattice& lattice = a.lattice();
    ASSERT_EQ(lattice, b.lattice());
    for (std::int64_t step = 1; step <= 4 * lattice.chunk_side(0); step *= 2) {
        const SampleGrid grid{{lattice.west() / (2 * step) * 2 * step, 0}, step, 33, 33};
        std::vector<double> za(grid.size()), zb(grid.size());
        std::vector<float> va(grid.size()), vb(grid.size()), ca(32 * 32), cb(32 * 32);
        std::vector<std::uint8_t> fa(32 * 32), fb(32 * 32);
        ASSERT_TRUE(a.sample(grid, za) && b.sample(grid, zb));
        ASSERT_TRUE(a.mesh_bounds(grid, va, ca) && b.mesh_bounds(grid, vb, cb));
        ASSERT_TRUE(a.cell_flags(grid, fa) && b.cell_flags(grid, fb));
        EXPECT_EQ(za, zb);
        EXPECT_EQ(va, vb);
        EXPECT_EQ(ca, cb);
        EXPECT_EQ(fa, fb);
    }
    for (double side = 3.0; side < 5000.0; side *= 1.7) {
        const HeightInterval ia = a.interval({-side, -100.0, side, side});
        const HeightInterval ib = b.interval({-side, -100.0, side, side});
        EXPECT_EQ(ia.low, ib.low);
        EXPECT_EQ(ia.high, ib.high);
        EXPECT_EQ(a.rise_bound(side), b.rise_bound(side));
    }
}

std::vector<fs::path> files_in(const std::string& folder) {
    std::vector<fs::path> files;
    if (!fs::exists(folder)) return files;
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
    return files;
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
    const Opened plain = open(raster_, {});
    EXPECT_TRUE(files_in(cache_).empty());
    const Opened first = open(raster_, in_folder_);
    EXPECT_FALSE(first.info.from_cache);
    EXPECT_EQ(first.info.cache_note, "");
    EXPECT_EQ(files_in(cache_).size(), 1u);
    const Opened second = open(raster_, in_folder_);
    EXPECT_TRUE(second.info.from_cache);
    expect_same(*plain.source, *first.source);
    expect_same(*plain.source, *second.source);
    EXPECT_EQ(files_in(folder_.file("data")).size(), 1u) << "nothing is left beside the raster";
}

TEST_F(OpeningCacheTest, ProgressReachesOneWhereBoundsAreReadToo) {
    open(raster_, in_folder_);
    DemSettings settings;
    settings.cache = in_folder_;
    double last = 0.0;
    settings.progress = [&last](double share) {
        last = share;
        return true;
    };
    DemInfo info;
    ASSERT_TRUE(DemHeights::open(raster_, settings, &info).has_value());
    EXPECT_TRUE(info.from_cache);
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
        const Opened changed = open(raster_, cache);
        EXPECT_FALSE(changed.info.from_cache);
        expect_same(*open(raster_, {}).source, *changed.source);
        EXPECT_TRUE(open(raster_, cache).info.from_cache);
        write_raster(raster_, hills());
    }
}

TEST_F(OpeningCacheTest, AnotherLatticeGetsItsOwn) {
    open(raster_, beside_);
    EXPECT_FALSE(open(raster_, beside_, 2.5).info.from_cache);
    EXPECT_TRUE(open(raster_, beside_).info.from_cache) << "both are kept";
    EXPECT_TRUE(open(raster_, beside_, 2.5).info.from_cache);
    expect_same(*open(raster_, {}, 2.5).source, *open(raster_, beside_, 2.5).source);
}

TEST_F(OpeningCacheTest, ACopyOfTheRasterHasWhatTheRasterHas) {
    open(raster_, in_folder_);
    fs::copy(raster_, folder_.file("copy.tif"));
    EXPECT_TRUE(open(folder_.file("copy.tif"), in_folder_).info.from_cache);
}

TEST_F(OpeningCacheTest, ADamagedFileIsToldAndReplaced) {
    open(raster_, in_folder_);
    const std::string file = files_in(cache_).at(0).string();
    std::ifstream from(file, std::ios::binary);
    const std::vector<char> whole{std::istreambuf_iterator<char>(from), {}};
    const auto expected = open(raster_, {}).source;
    int told = 0;
    for (std::size_t at = 0; at < whole.size(); at += at < 80 ? 3 : whole.size() / 12) {
        for (const bool is_cut : {false, true}) {
            std::vector<char> damaged = whole;
            damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
            if (is_cut) damaged.resize(at);
            std::ofstream(file, std::ios::binary)
                .write(damaged.data(), static_cast<std::streamsize>(damaged.size()));
            const Opened opened = open(raster_, in_folder_);
            EXPECT_FALSE(opened.info.from_cache) << at;
            EXPECT_NE(opened.info.cache_note.find(file), std::string::npos) << at;
            EXPECT_EQ(opened.info.cache_note.find('\n'), std::string::npos);
            ++told;
            ASSERT_TRUE(open(raster_, in_folder_).info.from_cache) << "replaced, " << at;
        }
    }
    EXPECT_GT(told, 20);
    expect_same(*expected, *open(raster_, in_folder_).source);
}

TEST_F(OpeningCacheTest, AFileOfAnotherVersionIsReplaced) {
    open(raster_, in_folder_);
    const std::string file = files_in(cache_).at(0).string();
    auto other = SealedWriter::create(file, {{'B', 'N', 'D', 'S'}, 999});
    ASSERT_TRUE(other && other->commit({}));
    const Opened opened = open(raster_, in_folder_);
    EXPECT_FALSE(opened.info.from_cache);
    EXPECT_NE(opened.info.cache_note.find("version 999"), std::string::npos);
    EXPECT_TRUE(open(raster_, in_folder_).info.from_cache);
}

TEST_F(OpeningCacheTest, WhereNothingCanBeWrittenItOpensAllTheSame) {
    // A file where a folder should be: not even root can write there.
    std::ofstream(folder_.file("taken")) << "x";
    const DemCache nowhere{Place::folder, folder_.file("taken/cache")};
    const Opened opened = open(raster_, nowhere);
    ASSERT_NE(opened.source, nullptr);
    EXPECT_NE(opened.info.cache_note.find("taken/cache"), std::string::npos);
    EXPECT_NE(open(raster_, {Place::folder, ""}).source, nullptr);
}

TEST_F(OpeningCacheTest, AFullDiskLeavesNoPartOfAFile) {
    rlimit limit{};
    getrlimit(RLIMIT_FSIZE, &limit);
    rlimit small = limit;
    small.rlim_cur = 2000;
    const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &small);
    const Opened opened = open(raster_, in_folder_);
    setrlimit(RLIMIT_FSIZE, &limit);
    std::signal(SIGXFSZ, old_handler);
    ASSERT_NE(opened.source, nullptr);
    EXPECT_NE(opened.info.cache_note, "");
    EXPECT_TRUE(files_in(cache_).empty());
}

TEST_F(OpeningCacheTest, ManyThatOpenAtOnceAllAnswerTheSame) {
    const auto expected = open(raster_, {}).source;
    std::vector<Opened> opened(8);
    {
        std::vector<std::jthread> threads;
        for (Opened& into : opened) {
            threads.emplace_back([&] { into = open(raster_, in_folder_); });
        }
    }
    for (const Opened& one : opened) {
        EXPECT_EQ(one.info.cache_note, "");
        expect_same(*expected, *one.source);
    }
    EXPECT_EQ(files_in(cache_).size(), 1u) << "no part of a file is left";
}

TEST_F(OpeningCacheTest, ARasterReadByWindowHasTheSameKey) {
    open(raster_, in_folder_);
    internal::StoreSettings by_window;
    by_window.memory_bytes = 0;
    by_window.bounds_cache = in_folder_;
    const auto source = internal::DemSource::create(raster_, 0.0, by_window);
    ASSERT_TRUE(source.has_value());
    EXPECT_TRUE((*source)->cache_use().is_hit);
    expect_same(*open(raster_, {}).source, **source);
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
