// SPDX-License-Identifier: MIT
#include "gl/gl_object.h"
#include "render/gl_test.h"
#include "support/heights/wave_heights.h"
#include "terrain/ground_draws.h"

#include <terrane/render/offscreen.h>

#include <gtest/gtest.h>

#include <set>

namespace terrane::internal {
namespace chunk_pool_test {

// 6 x 6 roots and no finer level.
class ChunkPoolTest : public test::GlTest {
protected:
    void SetUp() override {
        GlTest::SetUp();
        if (IsSkipped()) return;
        lattice_.root_count_x = lattice_.root_count_y = 6;
        const test::WaveHeights source(lattice_, 12.0, 90.0);
        for (std::int32_t y = 0; y < 6; ++y) {
            for (std::int32_t x = 0; x < 6; ++x) {
                Result<std::shared_ptr<const Chunk>> chunk = make_chunk(source, {x, y, 0});
                ASSERT_TRUE(chunk) << chunk.error().message;
                chunks_.push_back(std::move(*chunk));
            }
        }
    }

    ResidentSet first_chunks(std::size_t count) const {
        return {lattice_,
                WorldRect{},
                {chunks_.begin(), chunks_.begin() + static_cast<int>(count)},
                count};
    }

    // Finds every chunk of a set, in its order; pairs of page and slot.
    static std::vector<std::pair<int, int>> find_all(ChunkPool& pool, const ResidentSet& resident) {
        pool.follow(resident);
        std::vector<std::pair<int, int>> places;
        for (const std::shared_ptr<const Chunk>& chunk : resident.chunks()) {
            const ChunkSlot* slot = pool.find(resident, *chunk);
            EXPECT_NE(slot, nullptr);
            if (slot == nullptr) return places;
            places.emplace_back(slot->page, slot->slot);
        }
        return places;
    }

    // Compares the slot of a chunk on the device with the heights of the chunk.
    static void expect_content(ChunkPool& pool, const ResidentSet& resident, const Chunk& chunk) {
        const ChunkSlot* slot = pool.find(resident, chunk);
        ASSERT_NE(slot, nullptr);
        const ChunkPage& page = pool.page(slot->page);
        std::vector<std::int32_t> heights(kSlotSamples);
        const auto bytes = static_cast<GLsizeiptr>(heights.size() * sizeof(std::int32_t));
        glGetNamedBufferSubData(page.heights.name(), slot->slot * bytes, bytes, heights.data());
        EXPECT_EQ(heights, chunk.heights);
    }

    Lattice lattice_;
    std::vector<std::shared_ptr<const Chunk>> chunks_;
};

TEST_F(ChunkPoolTest, APageThatGrowsKeepsWhatItHolds) {
    ChunkPool pool(ChunkPool::largest_page());
    const ResidentSet few = first_chunks(30), all = first_chunks(36);
    find_all(pool, few);
    const int capacity = pool.page(0).capacity;
    ASSERT_LT(capacity, 36);
    const std::vector<std::pair<int, int>> places = find_all(pool, all);
    EXPECT_EQ(pool.page_count(), 1);
    EXPECT_GT(pool.page(0).capacity, capacity);
    EXPECT_EQ(std::set(places.begin(), places.end()).size(), 36u);
    for (const std::size_t i : {0u, 1u, 7u, 29u, 35u}) expect_content(pool, all, *chunks_[i]);
    EXPECT_TRUE(check_gl("grow"));
}

TEST_F(ChunkPoolTest, BeginsAPageWhereTheLastIsFullAndGivesEmptyOnesBack) {
    ChunkPool pool(10);
    const ResidentSet all = first_chunks(36);
    const std::vector<std::pair<int, int>> places = find_all(pool, all);
    EXPECT_EQ(pool.page_count(), 4);
    EXPECT_EQ(std::set(places.begin(), places.end()).size(), 36u);
    for (const auto& [page, slot] : places) {
        EXPECT_TRUE(slot >= 0 && slot < 10) << page << ", " << slot;
    }
    for (const std::size_t i : {0u, 9u, 10u, 35u}) expect_content(pool, all, *chunks_[i]);
    const std::size_t bytes = pool.bytes();

    pool.follow(first_chunks(12));
    EXPECT_EQ(pool.page_count(), 2);
    EXPECT_EQ(pool.bytes(), bytes / 3);
    pool.follow(first_chunks(0));
    EXPECT_EQ(pool.page_count(), 0);
    EXPECT_EQ(pool.bytes(), 0u);
    EXPECT_TRUE(check_gl("follow"));
}

TEST_F(ChunkPoolTest, TakesTheSlotsOfChunksThatLeftBeforeItGrows) {
    ChunkPool pool(16);
    const ResidentSet first = first_chunks(16);
    find_all(pool, first);
    // rows one to three leave, but for four chunks of the last row
    std::vector<std::shared_ptr<const Chunk>> later(chunks_.begin() + 12, chunks_.begin() + 28);
    const ResidentSet second(lattice_, WorldRect{}, later, 2);
    find_all(pool, second);
    EXPECT_EQ(pool.page_count(), 1);
    for (const std::size_t i : {12u, 15u, 16u, 27u}) expect_content(pool, second, *chunks_[i]);
}

TEST_F(ChunkPoolTest, FindsNoChunkOutsideTheSet) {
    ChunkPool pool(16);
    const ResidentSet few = first_chunks(3);
    pool.follow(few);
    EXPECT_EQ(pool.find(few, *chunks_[3]), nullptr);
    // another chunk with the same key
    const Chunk other = *chunks_[0];
    EXPECT_EQ(pool.find(few, other), nullptr);
    EXPECT_NE(pool.find(few, *chunks_[0]), nullptr);
    EXPECT_EQ(pool.find(few, other), nullptr);
}

}  // namespace chunk_pool_test
}  // namespace terrane::internal
