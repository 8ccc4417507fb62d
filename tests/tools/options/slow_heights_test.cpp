// SPDX-License-Identifier: MIT
#include "frames/paging_storage.h"
#include "support/heights/wave_heights.h"
#include "support/random.h"

#include <terrane/terrain/chunk.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

namespace terrane::tools {
namespace slow_heights_test {

// Times are arguments: no clock is used.
TEST(FairPipe, OneTransferHasAllOfIt) {
    FairPipe pipe(100.0);
    const double transfer = pipe.begin(5.0, 20.0);
    EXPECT_DOUBLE_EQ(pipe.next_end(), 5.2);
    EXPECT_FALSE(pipe.is_done(5.1999, transfer));
    EXPECT_TRUE(pipe.is_done(5.2001, transfer));
    EXPECT_TRUE(pipe.is_done(9.0, transfer));
    const double later = pipe.begin(10.0, 20.0);
    EXPECT_FALSE(pipe.is_done(10.1999, later));
    EXPECT_TRUE(pipe.is_done(10.2001, later));
}

TEST(FairPipe, SeveralShareItEvenly) {
    FairPipe pipe(100.0);
    const double a = pipe.begin(0.0, 20.0);
    const double b = pipe.begin(0.1, 20.0);  // a has 10 left
    EXPECT_FALSE(pipe.is_done(0.2999, a));
    EXPECT_DOUBLE_EQ(pipe.next_end(), 0.3);
    EXPECT_TRUE(pipe.is_done(0.3001, a));  // b has 10 left, and all of it
    EXPECT_FALSE(pipe.is_done(0.3999, b));
    EXPECT_TRUE(pipe.is_done(0.4001, b));
}

TEST(FairPipe, AgreesWithSharingSimulatedInSteps) {
    constexpr std::uint64_t kSeed = 20240608;
    test::Random random(kSeed);
    struct Transfer {
        double begin = 0.0, left = 0.0;  // simulated in steps
        double end = 1e9;                // the same
        double name = 0.0;
    };
    FairPipe pipe(1000.0);
    std::vector<Transfer> all(40);
    for (Transfer& transfer : all) {
        transfer.begin = random.between(0.0, 1.0);
        transfer.left = random.between(0.0, 60.0);
    }
    std::ranges::sort(all, {}, &Transfer::begin);
    constexpr double kStep = 1e-5, kNearly = 1e-3;
    std::size_t begun = 0;
    for (double now = 0.0; now < 3.0; now += kStep) {
        for (; begun < all.size() && all[begun].begin <= now; ++begun) {
            all[begun].name = pipe.begin(now, all[begun].left);
        }
        const auto under_way = std::count_if(all.begin(), all.begin() + static_cast<int>(begun),
                                             [](const Transfer& t) { return t.left > 0.0; });
        for (std::size_t i = 0; i < begun; ++i) {
            Transfer& transfer = all[i];
            if (now > transfer.end + kNearly) {
                EXPECT_TRUE(pipe.is_done(now, transfer.name)) << "seed " << kSeed << ", " << now;
            } else if (transfer.left > 1000.0 * kNearly) {
                EXPECT_FALSE(pipe.is_done(now, transfer.name)) << "seed " << kSeed << ", " << now;
            }
            if (transfer.left <= 0.0) continue;
            transfer.left -= 1000.0 * kStep / static_cast<double>(under_way);
            if (transfer.left <= 0.0) transfer.end = now;
        }
    }
    for (const Transfer& transfer : all) EXPECT_LT(transfer.end, 3.0);
}

TEST(SlowHeights, GivesTheChunksOfItsSource) {
    const auto source =
        std::make_shared<const test::WaveHeights>(test::small_world(2, 4.0), 100.0, 500.0);
    SlowHeights slow(source, 1e-3, 1e9);
    EXPECT_EQ(slow.lattice(), source->lattice());
    EXPECT_EQ(slow.height(12.0, 34.0), source->height(12.0, 34.0));
    EXPECT_EQ(slow.interval({0, 0, 50, 50}).high, source->interval({0, 0, 50, 50}).high);
    EXPECT_EQ(slow.rise_bound(10.0), source->rise_bound(10.0));
    slow.begin();
    const ChunkKey key{0, 0, 1};
    const auto wanted = make_chunk(*source, key);
    source->sample_count = 0;
    const auto got = make_chunk(slow, key);
    ASSERT_TRUE(wanted);
    ASSERT_TRUE(got);
    EXPECT_EQ((*got)->heights, (*wanted)->heights);
    EXPECT_EQ((*got)->cell_bounds, (*wanted)->cell_bounds);
    EXPECT_EQ((*got)->max_vertex_bound, (*wanted)->max_vertex_bound);
    EXPECT_EQ(source->sample_count, 1) << "a chunk waits once";
}

}  // namespace slow_heights_test
}  // namespace terrane::tools
