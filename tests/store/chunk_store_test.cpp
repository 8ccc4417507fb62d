// SPDX-License-Identifier: MIT
#include "raster_ground.h"
#include "store_files.h"
#include "store_format.h"
#include "support/grounds.h"
#include "terrain/source/bound_checks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <thread>

namespace terrane::bake_test {

using namespace test;

StoreInfo bake(const HeightSource& source, const std::string& path, BakeSettings settings = {}) {
    const auto info = ChunkStore::bake(source, path, settings);
    EXPECT_TRUE(info.has_value()) << (info ? "" : info.error().message);
    return info.value_or(StoreInfo{});
}

TEST(Bake, HoldsEveryChunkOfTheSourceBitForBit) {
    const TemporaryFolder folder;
    const auto source = small_fractal();
    const StoreInfo info = bake(*source, folder.file("a.terrane"));
    const auto store = open_store(folder.file("a.terrane"));
    ASSERT_EQ(store->lattice(), source->lattice());
    const std::vector<ChunkKey> keys = all_keys(source->lattice());
    EXPECT_EQ(info.chunk_count, static_cast<std::int64_t>(keys.size()));
    EXPECT_EQ(info.bytes, std::filesystem::file_size(folder.file("a.terrane")));
    for (const ChunkKey& key : keys) {
        const auto stored = make_chunk(*store, key);
        ASSERT_TRUE(stored.has_value()) << stored.error().message;
        EXPECT_TRUE(same_chunk(**make_chunk(*source, key), **stored))
            << key.x << ", " << key.y << ", level " << int{key.level};
    }
}

TEST(Bake, WritesTheSameFileOnAnyNumberOfThreads) {
    const TemporaryFolder folder;
    const auto source = small_fractal();
    std::string sha;
    std::vector<char> bytes;
    for (const int worker_count : {1, 3, 16}) {
        const std::string path = folder.file(std::to_string(worker_count));
        const StoreInfo info =
            bake(*source, path, {.level_count = 2, .worker_count = worker_count, .note = "n"});
        EXPECT_EQ(info.sha.size(), 64u);
        if (sha.empty()) {
            sha = info.sha;
            bytes = read_file(path);
        }
        EXPECT_EQ(info.sha, sha);
        EXPECT_EQ(read_file(path), bytes);
        StoreInfo opened;
        ASSERT_TRUE(ChunkStore::open(path, &opened).has_value());
        EXPECT_EQ(opened.sha, sha);
        EXPECT_EQ(opened.note, "n");
        EXPECT_EQ(opened.chunk_count, info.chunk_count);
        EXPECT_EQ(opened.max_error_m, info.max_error_m);
    }
    EXPECT_NE(bake(*source, folder.file("other"), {.level_count = 2, .note = "m"}).sha, sha);
    EXPECT_NE(bake(*source, folder.file("other"), {.level_count = 1, .note = "n"}).sha, sha);
}

TEST(Bake, TheShaIsThatOfTheseHeights) {
    // Changes only where heights, bounds or the format are meant to.
    const TemporaryFolder folder;
    const WaveHeights waves(small_world(0, 2.0), 30.0, 100.0);
    EXPECT_EQ(bake(waves, folder.file("a")).sha,
              "6c72fb94de2f15652dd1b43d8fdd8f7c01dfce4646495a513c4afc44e65e071d");
    const auto raster = RasterGround::create(200, 150, 1.25, [](int column, int row) {
        return 0.25f * static_cast<float>((column * 7919 + row * 104729) % 101);
    });
    EXPECT_EQ(bake(*raster, folder.file("a")).sha,
              "b26e0e670ec572a82abfb62ca016aadfb8f4864e1255a8144aef85813ec668bf");
}

TEST(Bake, CoarserLevelsHaveTheHeightsAndBoundsOfTheSource) {
    const TemporaryFolder folder;
    const auto source = small_fractal();
    bake(*source, folder.file("a"), {.level_count = 2});
    const auto store = open_store(folder.file("a"));
    EXPECT_EQ(store->lattice().finest_level, 1);
    EXPECT_EQ(store->lattice().spacing, source->lattice().level_spacing(1));
    for (const ChunkKey& key : all_keys(store->lattice())) {
        const Chunk live = **make_chunk(*source, key), stored = **make_chunk(*store, key);
        EXPECT_EQ(live.heights, stored.heights);
        EXPECT_EQ(live.cell_bounds, stored.cell_bounds);
        EXPECT_EQ(live.vertices->coarse_bounds, stored.vertices->coarse_bounds);
        for (std::size_t i = 0; i < live.vertices->areas.size(); ++i) {
            EXPECT_EQ(live.vertices->areas[i].inverse_square_bounds,
                      stored.vertices->areas[i].inverse_square_bounds);
        }
        EXPECT_EQ(store->lattice().x(stored.corner.x), source->lattice().x(live.corner.x));
        EXPECT_EQ(store->lattice().y(stored.corner.y), source->lattice().y(live.corner.y));
    }
}

/// Every chunk of a store has the bits of that of the source.
void expect_same_chunks(const HeightSource& source, const HeightSource& store) {
    for (const ChunkKey& key : all_keys(store.lattice())) {
        const auto live = make_chunk(source, key), stored = make_chunk(store, key);
        ASSERT_TRUE(stored.has_value()) << stored.error().message;
        EXPECT_TRUE(same_chunk(**live, **stored)) << int{key.level};
        EXPECT_LE((*stored)->bytes(), Chunk::max_bytes());
    }
}

TEST(Bake, ARasterIsStoredAsSamplesAndGivesTheSameChunks) {
    const TemporaryFolder folder;
    for (const double cell_y : {1.0, 1.25}) {
        const auto source = small_raster(cell_y);
        const std::string path = folder.file("a");
        bake(*source, path);
        const auto directory =
            internal::decode_directory(
                SealedReader::open(path, internal::kStoreKind).value().directory())
                .value();
        ASSERT_TRUE(directory.raster.has_value());
        EXPECT_EQ(directory.squares.size(), 6u) << "3 x 2 squares of 128";
        std::size_t of_finest = 0;
        for (const ChunkKey& key : all_keys(source->lattice())) {
            if (key.level == 1) of_finest += directory.chunks[directory.index_of(key)].bytes;
        }
        EXPECT_LT(of_finest, 500u) << "records of flags alone";
        expect_same_chunks(*source, *open_store(path));
    }
}

TEST(Bake, ARegionOfARasterHoldsTheSamplesThatItNeeds) {
    const TemporaryFolder folder;
    const auto source = small_raster(1.0);
    const std::string path = folder.file("a");
    // One root square; the raster extends 44 samples beyond its east.
    bake(*source, path, {.region = WorldRect{100.0, 50.0, 250.0, 150.0}});
    const auto store = open_store(path);
    EXPECT_EQ(store->lattice().root_count_x, 1);
    expect_same_chunks(*source, *store);
}

TEST(Bake, ARegionIsAWorldOfItsOwn) {
    const TemporaryFolder folder;
    const auto source = small_fractal();
    const WorldRect region{100.0, -1500.0, 900.0, -900.0};
    const StoreInfo info = bake(*source, folder.file("a"), {.region = region});
    const auto store = open_store(folder.file("a"));
    const Lattice& lattice = store->lattice();
    EXPECT_EQ(lattice.root_size(), 1024.0);
    EXPECT_EQ(info.chunk_count, lattice.root_count_x * lattice.root_count_y);
    EXPECT_LE(lattice.x(lattice.west()), region.west);
    EXPECT_GE(lattice.x(lattice.east()), region.east);
    EXPECT_LE(lattice.y(lattice.south()), region.south);
    EXPECT_GE(lattice.y(lattice.north()), region.north);
    EXPECT_LT(info.chunk_count, 6);
    const SampleGrid grid{{lattice.west(), lattice.south()}, 1, 40, 30};
    std::vector<double> live(grid.size()), stored(grid.size());
    ASSERT_TRUE(source->sample(grid, live).has_value());
    ASSERT_TRUE(store->sample(grid, stored).has_value());
    for (std::size_t i = 0; i < live.size(); ++i) {
        EXPECT_NEAR(stored[i], live[i], 0.5 * lattice.quantum);
    }
}

TEST(Bake, RefusesWhatMakesNoSense) {
    const TemporaryFolder folder;
    const auto source = small_fractal();
    const std::string path = folder.file("a");
    const auto code = [&](const BakeSettings& settings) {
        const auto info = ChunkStore::bake(*source, path, settings);
        return info ? ErrorCode::io : info.error().code;
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(code({.level_count = -1}), ErrorCode::invalid_argument);
    EXPECT_EQ(code({.level_count = 4}), ErrorCode::invalid_argument);
    EXPECT_EQ(code({.worker_count = -1}), ErrorCode::invalid_argument);
    EXPECT_EQ(code({.note = std::string((1u << 20) + 1, 'x')}), ErrorCode::invalid_argument);
    EXPECT_EQ(code({.region = WorldRect{0, 0, 0, 10}}), ErrorCode::invalid_argument);
    EXPECT_EQ(code({.region = WorldRect{0, 0, nan, 10}}), ErrorCode::invalid_argument);
    EXPECT_EQ(code({.region = WorldRect{9000, 0, 9100, 10}}), ErrorCode::invalid_argument);
    const auto huge = FractalHeights::create({.seed = 1, .finest_spacing_log2 = -8}).value();
    EXPECT_EQ(ChunkStore::bake(*huge, path, {}).error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(folder.file_count(), 0u);
    EXPECT_EQ(ChunkStore::bake(*source, folder.file("no/such/folder"), {}).error().code,
              ErrorCode::io);
}

TEST(Bake, LeavesNothingWhereItIsGivenUpOrTheSourceFails) {
    const TemporaryFolder folder;
    const auto source = small_fractal();
    const auto given_up =
        ChunkStore::bake(*source, folder.file("a"),
                         {.worker_count = 1, .progress = [](double share) { return share < 0.1; }});
    ASSERT_FALSE(given_up.has_value());
    EXPECT_EQ(given_up.error().code, ErrorCode::cancelled);
    WaveHeights waves(small_world(1, 2.0), 30.0, 100.0);
    waves.is_broken = true;
    EXPECT_FALSE(ChunkStore::bake(waves, folder.file("a"), {}).has_value());
    EXPECT_EQ(folder.file_count(), 0u);
}

TEST(Bake, LeavesTheOldFileWhereTheDiskIsFull) {
    const TemporaryFolder folder;
    const auto source = small_fractal();
    const std::string path = folder.file("a");
    bake(*source, path, {.level_count = 1});
    const std::vector<char> before = read_file(path);
    const auto baked = [&] {
        const FullDisk full(300'000);
        return ChunkStore::bake(*source, path, {});
    }();
    ASSERT_FALSE(baked.has_value());
    EXPECT_EQ(baked.error().code, ErrorCode::io);
    EXPECT_NE(baked.error().message.find(path), std::string::npos) << baked.error().message;
    EXPECT_EQ(read_file(path), before);
    EXPECT_EQ(folder.file_count(), 1u);
}

TEST(Bake, TwoThatWriteTheSameFileAtOnceLeaveAWholeOne) {
    const TemporaryFolder folder;
    const WaveHeights waves(small_world(1, 2.0), 30.0, 100.0);
    const std::string path = folder.file("a");
    {
        std::vector<std::jthread> writers;
        for (int i = 0; i < 4; ++i) {
            writers.emplace_back([&] { bake(waves, path, {.worker_count = 1}); });
        }
        // Whoever reads meanwhile finds no file, or a whole one.
        for (int i = 0; i < 200; ++i) {
            const auto store = ChunkStore::open(path);
            if (store) {
                EXPECT_TRUE(make_chunk(**store, {0, 0, 0}).has_value());
            } else {
                EXPECT_EQ(store.error().code, ErrorCode::io) << store.error().message;
            }
        }
    }
    EXPECT_EQ(folder.file_count(), 1u);
    EXPECT_NE(open_store(path), nullptr);
}

}  // namespace terrane::bake_test

namespace terrane::stored_heights_test {

using namespace test;

class StoredHeights : public testing::Test {
protected:
    // One store for all tests.
    static void SetUpTestSuite() {
        folder = std::make_unique<TemporaryFolder>();
        source = small_fractal();
        const auto baked = ChunkStore::bake(*source, folder->file("a.terrane"), {});
        ASSERT_TRUE(baked.has_value());
        info = *baked;
        store = open_store(folder->file("a.terrane"));
    }
    static void TearDownTestSuite() {
        store = source = nullptr;
        folder = nullptr;
    }

    static inline std::unique_ptr<TemporaryFolder> folder;
    static inline std::shared_ptr<const HeightSource> source, store;
    static inline StoreInfo info;
};

TEST_F(StoredHeights, SamplesAreThoseOfTheSourceAtEveryLevelAndOffset) {
    const Lattice& lattice = store->lattice();
    Random random(5);
    long compared = 0;
    for (int i = 0; i < 200; ++i) {
        SampleGrid grid{{0, 0}, std::int64_t{1} << random.below(9), 9, 7};
        for (std::int64_t* at : {&grid.corner.x, &grid.corner.y}) *at = random.below(600) - 512;
        if (random.below(2) == 0) {
            grid.corner = {grid.corner.x & -grid.step, grid.corner.y & -grid.step};
        }
        std::vector<double> live(grid.size()), stored(grid.size());
        ASSERT_TRUE(source->sample(grid, live).has_value());
        ASSERT_TRUE(store->sample(grid, stored).has_value());
        for (std::size_t k = 0; k < live.size(); ++k) {
            const std::int64_t x = grid.corner.x + static_cast<std::int64_t>(k % 9) * grid.step;
            const std::int64_t y = grid.corner.y + static_cast<std::int64_t>(k / 9) * grid.step;
            if (x < lattice.west() || x > lattice.east()) continue;
            if (y < lattice.south() || y > lattice.north()) continue;
            ++compared;
            ASSERT_NEAR(stored[k], live[k], 0.5 * lattice.quantum);
            ASSERT_NEAR(store->height(lattice.x(x), lattice.y(y)), stored[k], 1e-9);
        }
    }
    EXPECT_GT(compared, 500);
}

TEST_F(StoredHeights, KeepWhatHeightSourcesPromise) {
    const SourceReport report = check_source(*store).value();
    EXPECT_TRUE(report.is_clean()) << to_text(report);
}

TEST_F(StoredHeights, TheTrueSurfaceOfTheSourceIsWithinMaxError) {
    Random random(6);
    const WorldRect& extent = source->extent();
    double most = 0.0;
    for (int i = 0; i < few_or_many(6'000, 20'000); ++i) {
        const double x = random.between(extent.west, extent.east);
        const double y = random.between(extent.south, extent.north);
        most = std::max(most, std::abs(store->height(x, y) - source->height(x, y)));
    }
    EXPECT_GT(info.max_error_m, 0.0);
    EXPECT_LE(most, info.max_error_m);
    EXPECT_GT(most, 0.05 * info.max_error_m) << "the bound says something";
}

TEST_F(StoredHeights, BoundsOfMidpointsAreNotBelowThoseOfCellsBesideThem) {
    const Lattice& lattice = store->lattice();
    for (std::int64_t step = 1; step <= lattice.step(0); step *= 2)
        check_nesting_of_spacing(*store, {{0, 0}, step, 21, 21});
}

TEST_F(StoredHeights, IntervalsOfImpossibleRectanglesAreIntervals) {
    const double inf = std::numeric_limits<double>::infinity(), nan = std::nan("");
    for (const WorldRect& rect : {WorldRect{-inf, -inf, inf, inf}, WorldRect{nan, nan, nan, nan},
                                  WorldRect{1, 1, -1, -1}}) {
        const HeightInterval found = store->interval(rect);
        EXPECT_LE(found.low, found.high);
    }
}

TEST_F(StoredHeights, RisesAreThoseOfTheSourceWhereATriangulatorAsks) {
    const Lattice& lattice = store->lattice();
    for (double spacing = lattice.spacing * 0x1p-24; spacing <= 2 * lattice.root_size();
         spacing *= 2) {
        for (const double distance : {spacing, 0.70710678118654757 * spacing}) {
            EXPECT_EQ(store->rise_bound(distance), source->rise_bound(distance)) << distance;
        }
    }
    EXPECT_GE(store->rise_bound(1e12), store->rise_bound(4096.0));
    EXPECT_GE(store->rise_bound(0.0), 0.0);
}

TEST_F(StoredHeights, AnswersBeyondTheWorldRepeatItsBorder) {
    EXPECT_EQ(store->height(1e9, 17.0), store->height(4096.0, 17.0));
    EXPECT_EQ(store->height(-1e300, -1e300), store->height(-4096.0, -4096.0));
    EXPECT_TRUE(std::isnan(store->height(std::nan(""), 0.0)));
    std::vector<std::uint8_t> flags(4);
    ASSERT_TRUE(store->cell_flags({{store->lattice().east() - 1, 0}, 1, 3, 3}, flags).has_value());
    EXPECT_EQ(flags,
              (std::vector<std::uint8_t>{cell_ground, cell_outside, cell_ground, cell_outside}));
}

TEST_F(StoredHeights, AnyThreadMayAskAtAnyTime) {
    const std::vector<ChunkKey> keys = all_keys(store->lattice());
    std::atomic<int> wrong{0};
    std::vector<std::shared_ptr<const Chunk>> expected;
    for (const ChunkKey& key : keys) expected.push_back(*make_chunk(*store, key));
    {
        std::vector<std::jthread> threads;
        for (int t = 0; t < 4; ++t) {
            threads.emplace_back([&, t] {
                Random random(static_cast<std::uint64_t>(t));
                for (int i = 0; i < 60; ++i) {
                    const auto k =
                        static_cast<std::size_t>(random.below(static_cast<int>(keys.size())));
                    const auto chunk = make_chunk(*store, keys[k]);
                    if (!chunk || !same_chunk(**chunk, *expected[k])) ++wrong;
                    const double x = random.between(-4000, 4000), y = random.between(-4000, 4000);
                    if (store->height(x, y) != store->height(x, y)) ++wrong;
                }
            });
        }
    }
    EXPECT_EQ(wrong, 0);
}

TEST_F(StoredHeights, ALoadMayBeGivenUp) {
    std::stop_source stop;
    stop.request_stop();
    const auto chunk = make_chunk(*store, {0, 0, 0}, stop.get_token());
    ASSERT_FALSE(chunk.has_value());
    EXPECT_EQ(chunk.error().code, ErrorCode::cancelled);
}

}  // namespace terrane::stored_heights_test
