// SPDX-License-Identifier: MIT
//
// Chunks that are swapped because their source has changed.
#include "support/heights/wave_heights.h"

#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace terrane {
namespace pager_replace_test {

using namespace test;

std::shared_ptr<const Chunk> copy_of(const Chunk& chunk) {
    auto copy = std::make_shared<Chunk>(chunk);
    copy->change = chunk.change + 1;
    return copy;
}

TEST(PagerReplace, SwapsWhatIsResidentInOneSetAndIgnoresOtherChunks) {
    const auto waves = std::make_shared<const WaveHeights>(small_world(2, 1.0), 10.0, 100.0);
    Pager pager = Pager::create(waves, {.worker_count = 0}).value();
    pager.require({-200.0, -200.0, 200.0, 200.0}, 0.0);
    pager.update({}, {}, 0.0);
    const auto before = pager.resident();
    std::vector<std::shared_ptr<const Chunk>> chunks;
    std::vector<ChunkKey> keys;
    for (const ResidentChunk& chunk : before->chunks()) {
        if (chunk->key.level != 2) continue;
        chunks.push_back(copy_of(*chunk));
        keys.push_back(chunk->key);
    }
    ASSERT_GE(chunks.size(), 4u);
    auto absent = std::make_shared<Chunk>(*chunks.front());
    absent->key = {-8, -8, 2};
    ASSERT_EQ(before->find(absent->key), ResidentSet::kNone);
    const std::size_t resident_count = chunks.size();
    chunks.push_back(absent);
    int switches = 0;
    EXPECT_TRUE(pager.replace(chunks, keys, [&] { ++switches; }));
    EXPECT_EQ(switches, 1);
    EXPECT_EQ(pager.resident(), before) << "the set changes in update()";
    pager.update({}, {}, 1.0);
    const auto after = pager.resident();
    EXPECT_GT(after->epoch(), before->epoch());
    ASSERT_EQ(after->chunks().size(), before->chunks().size());
    for (std::size_t i = 0; i < after->chunks().size(); ++i) {
        const ResidentChunk &now = after->chunks()[i], &then = before->chunks()[i];
        EXPECT_EQ(now->key, then->key);
        EXPECT_EQ(now->change, now->key.level == 2 ? 1u : 0u);
        EXPECT_EQ(now.get() == then.get(), now->key.level != 2);
        EXPECT_EQ(after->fade(i), before->fade(i));
        EXPECT_EQ(after->links(i).parent, before->links(i).parent);
        EXPECT_EQ(after->links(i).child, before->links(i).child);
        EXPECT_EQ(after->links(i).neighbour, before->links(i).neighbour);
    }
    EXPECT_EQ(pager.stats().replaced, resident_count);
}

TEST(PagerReplace, DoesNothingWhereTheBytesDoNotFitUntilOthersAreEvicted) {
    Lattice lattice;
    lattice.finest_level = 1;
    const auto waves = std::make_shared<const WaveHeights>(lattice, 10.0, 100.0);
    const std::size_t ceiling = 3 * Chunk::max_bytes();
    Pager pager = Pager::create(waves, {.memory_bytes = ceiling, .worker_count = 0}).value();
    const Pager::Ticket all = pager.require(whole_extent(lattice), 0.0);
    pager.update({}, {}, 0.0);
    ASSERT_GE(pager.resident()->chunks().size(), 3u) << "as many as fit";
    const std::shared_ptr<const Chunk> root = copy_of(*pager.resident()->find_chunk({0, 0, 0}));
    int switches = 0;
    const auto replace = [&] { return pager.replace({&root, 1}, {}, [&] { ++switches; }); };
    // All of it is touched contact, which nothing evicts.
    EXPECT_FALSE(replace());
    pager.update({}, {}, 1.0);
    EXPECT_FALSE(replace());
    EXPECT_EQ(switches, 0);
    EXPECT_EQ(pager.resident()->find_chunk({0, 0, 0})->change, 0u);
    EXPECT_EQ(pager.stats().postponed_replacements, 2u);
    pager.release(all);
    pager.update({}, {}, 2.0);
    EXPECT_TRUE(replace());
    EXPECT_EQ(switches, 1);
    pager.update({}, {}, 3.0);
    EXPECT_EQ(pager.resident()->find_chunk({0, 0, 0})->change, 1u);
    EXPECT_GT(pager.stats().evicted, 0u);
    EXPECT_LE(pager.stats().peak_bytes, ceiling);
}

}  // namespace pager_replace_test
}  // namespace terrane
