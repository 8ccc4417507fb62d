// SPDX-License-Identifier: MIT
#include "store_files.h"
#include "support/heights/wave_heights.h"
#include "support/random.h"
#include "terrain/source/bound_checks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <thread>

namespace terrane {
namespace stored_heights_test {

using namespace test;

class StoredHeights : public testing::Test {
protected:
    // One store for all tests.
    static void SetUpTestSuite() {
        folder_ = std::make_unique<StoreFolder>();
        source_ = small_fractal();
        const auto baked = ChunkStore::bake(*source_, folder_->file("a.terrane"), {});
        ASSERT_TRUE(baked.has_value());
        info_ = *baked;
        store_ = open_store(folder_->file("a.terrane"));
    }
    static void TearDownTestSuite() {
        store_ = source_ = nullptr;
        folder_ = nullptr;
    }

    static inline std::unique_ptr<StoreFolder> folder_;
    static inline std::shared_ptr<const HeightSource> source_, store_;
    static inline StoreInfo info_;
};

TEST_F(StoredHeights, SamplesAreThoseOfTheSourceAtEveryLevelAndOffset) {
    const Lattice& lattice = store_->lattice();
    Random random(5);
    for (int i = 0; i < 200; ++i) {
        SampleGrid grid{{0, 0}, std::int64_t{1} << random.below(9), 9, 7};
        for (std::int64_t* at : {&grid.corner.x, &grid.corner.y}) *at = random.below(600) - 512;
        if (random.below(2) == 0) {
            grid.corner = {grid.corner.x & -grid.step, grid.corner.y & -grid.step};
        }
        std::vector<double> live(grid.size()), stored(grid.size());
        ASSERT_TRUE(source_->sample(grid, live).has_value());
        ASSERT_TRUE(store_->sample(grid, stored).has_value());
        for (std::size_t k = 0; k < live.size(); ++k) {
            const std::int64_t x = grid.corner.x + static_cast<std::int64_t>(k % 9) * grid.step;
            const std::int64_t y = grid.corner.y + static_cast<std::int64_t>(k / 9) * grid.step;
            if (x < lattice.west() || x > lattice.east()) continue;
            if (y < lattice.south() || y > lattice.north()) continue;
            ASSERT_NEAR(stored[k], live[k], 0.5 * lattice.quantum);
            ASSERT_NEAR(store_->height(lattice.x(x), lattice.y(y)), stored[k], 1e-9);
        }
    }
}

TEST_F(StoredHeights, KeepWhatHeightSourcesPromise) {
    const SourceReport report = check_source(*store_).value();
    EXPECT_TRUE(report.is_clean()) << to_text(report);
}

TEST_F(StoredHeights, TheTrueSurfaceOfTheSourceIsWithinMaxError) {
    Random random(6);
    const WorldRect& extent = source_->extent();
    double most = 0.0;
    for (int i = 0; i < 20'000; ++i) {
        const double x = random.between(extent.west, extent.east);
        const double y = random.between(extent.south, extent.north);
        most = std::max(most, std::abs(store_->height(x, y) - source_->height(x, y)));
    }
    EXPECT_GT(info_.max_error_m, 0.0);
    EXPECT_LE(most, info_.max_error_m);
    EXPECT_GT(most, 0.05 * info_.max_error_m) << "the bound says something";
}

TEST_F(StoredHeights, BoundsHoldForTheSurfaceOfTheStore) {
    Random random(7);
    const Lattice& lattice = store_->lattice();
    for (std::int64_t step = 1; step <= lattice.step(0) * internal::kChunkSquares; step *= 2) {
        const auto across = static_cast<int>(std::min<std::int64_t>(lattice.east() / step, 20));
        const SampleGrid grid{{0, 0}, step, across + 1, across + 1};
        check_bounds(*store_, grid, 20, random);
        check_nesting_of_spacing(*store_, grid);
        check_mesh_bounds(*store_, grid);
    }
    check_same_bits(*store_, {{-64, -32}, 2, 20, 20});
}

TEST_F(StoredHeights, IntervalsContainTheSurface) {
    Random random(8);
    for (int i = 0; i < 300; ++i) {
        WorldRect rect{random.between(-5000, 5000), random.between(-5000, 5000), 0, 0};
        const double side = std::exp2(random.between(-4, 13));
        rect.east = rect.west + side;
        rect.north = rect.south + side * random.between(0.1, 1.0);
        const HeightInterval found = store_->interval(rect);
        for (int k = 0; k < 50; ++k) {
            const double z = store_->height(random.between(rect.west, rect.east),
                                            random.between(rect.south, rect.north));
            ASSERT_GE(z, found.low);
            ASSERT_LE(z, found.high);
        }
    }
    const double inf = std::numeric_limits<double>::infinity(), nan = std::nan("");
    for (const WorldRect& rect : {WorldRect{-inf, -inf, inf, inf}, WorldRect{nan, nan, nan, nan},
                                  WorldRect{1, 1, -1, -1}}) {
        const HeightInterval found = store_->interval(rect);
        EXPECT_LE(found.low, found.high);
    }
}

TEST_F(StoredHeights, RisesAreThoseOfTheSourceWhereATriangulatorAsks) {
    const Lattice& lattice = store_->lattice();
    for (double spacing = lattice.spacing * 0x1p-24; spacing <= 2 * lattice.root_size();
         spacing *= 2) {
        for (const double distance : {spacing, 0.70710678118654757 * spacing}) {
            EXPECT_EQ(store_->rise_bound(distance), source_->rise_bound(distance)) << distance;
        }
    }
    Random random(9);
    for (int i = 0; i < 5000; ++i) {
        const double x = random.between(-4096, 4096), y = random.between(-4096, 4096);
        const double distance = std::exp2(random.between(-4, 12));
        const double angle = random.between(0, 6.28);
        const double to_x = x + distance * std::cos(angle), to_y = y + distance * std::sin(angle);
        ASSERT_LE(std::abs(store_->height(x, y) - store_->height(to_x, to_y)),
                  store_->rise_bound(distance));
    }
    EXPECT_GE(store_->rise_bound(1e12), store_->rise_bound(4096.0));
    EXPECT_GE(store_->rise_bound(0.0), 0.0);
}

TEST_F(StoredHeights, AnswersBeyondTheWorldRepeatItsBorder) {
    EXPECT_EQ(store_->height(1e9, 17.0), store_->height(4096.0, 17.0));
    EXPECT_EQ(store_->height(-1e300, -1e300), store_->height(-4096.0, -4096.0));
    EXPECT_TRUE(std::isnan(store_->height(std::nan(""), 0.0)));
    std::vector<std::uint8_t> flags(4);
    ASSERT_TRUE(
        store_->cell_flags({{store_->lattice().east() - 1, 0}, 1, 3, 3}, flags).has_value());
    EXPECT_EQ(flags,
              (std::vector<std::uint8_t>{cell_ground, cell_outside, cell_ground, cell_outside}));
}

TEST_F(StoredHeights, AnyThreadMayAskAtAnyTime) {
    const std::vector<ChunkKey> keys = all_keys(store_->lattice());
    std::atomic<int> wrong{0};
    std::vector<std::shared_ptr<const Chunk>> expected;
    for (const ChunkKey& key : keys) expected.push_back(*make_chunk(*store_, key));
    {
        std::vector<std::jthread> threads;
        for (int t = 0; t < 4; ++t) {
            threads.emplace_back([&, t] {
                Random random(static_cast<std::uint64_t>(t));
                for (int i = 0; i < 60; ++i) {
                    const auto k =
                        static_cast<std::size_t>(random.below(static_cast<int>(keys.size())));
                    const auto chunk = make_chunk(*store_, keys[k]);
                    if (!chunk || !same_chunk(**chunk, *expected[k])) ++wrong;
                    const double x = random.between(-4000, 4000), y = random.between(-4000, 4000);
                    if (store_->height(x, y) != store_->height(x, y)) ++wrong;
                }
            });
        }
    }
    EXPECT_EQ(wrong, 0);
}

TEST_F(StoredHeights, ALoadMayBeGivenUp) {
    std::stop_source stop;
    stop.request_stop();
    const auto chunk = make_chunk(*store_, {0, 0, 0}, stop.get_token());
    ASSERT_FALSE(chunk.has_value());
    EXPECT_EQ(chunk.error().code, ErrorCode::cancelled);
}

}  // namespace stored_heights_test
}  // namespace terrane
