// SPDX-License-Identifier: MIT
#include "support/wave_heights.h"

#include <terrane/terrain/resident_set.h>

#include <gtest/gtest.h>

namespace terrane {
namespace {

using Chunks = std::vector<std::shared_ptr<const Chunk>>;

// The four roots and two children of the first, not in the order of a set.
Chunks some_chunks(const HeightSource& source) {
    Chunks chunks;
    const ChunkKey first{-1, -1, 0};
    for (const ChunkKey& key : {first.child(3), ChunkKey{0, 0, 0}, first, first.child(0),
                                ChunkKey{0, -1, 0}, ChunkKey{-1, 0, 0}}) {
        chunks.push_back(make_chunk(source, key).value());
    }
    return chunks;
}

TEST(ResidentSet, PutsTheFadesWhereItPutsTheChunks) {
    const test::WaveHeights source(test::small_world(2, 1.0), 20.0, 70.0);
    const Chunks chunks = some_chunks(source);
    const std::vector<float> fades{0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.0f};
    const ResidentSet set(source.lattice(), source.extent(), chunks, fades, 1);
    ASSERT_EQ(set.fades().size(), chunks.size());
    for (std::size_t i = 0; i < chunks.size(); ++i) {
        const std::int32_t at = set.find(chunks[i]->key);
        ASSERT_NE(at, ResidentSet::kNone);
        EXPECT_EQ(set.chunks()[static_cast<std::size_t>(at)], chunks[i]);
        EXPECT_EQ(set.fade(static_cast<std::size_t>(at)), fades[i]);
    }
}

TEST(ResidentSet, IsFadedInWhereNothingElseIsSaid) {
    const test::WaveHeights source(test::small_world(2, 1.0), 20.0, 70.0);
    const ResidentSet set(source.lattice(), source.extent(), some_chunks(source), 1);
    for (std::size_t i = 0; i < set.chunks().size(); ++i) EXPECT_EQ(set.fade(i), 1.0f);
}

TEST(ResidentSet, SharesItsChunksWithASetOfOtherFades) {
    const test::WaveHeights source(test::small_world(2, 1.0), 20.0, 70.0);
    const Chunks chunks = some_chunks(source);
    auto first = std::make_shared<const ResidentSet>(source.lattice(), source.extent(), chunks, 1);
    std::vector<float> fades(chunks.size(), 0.5f);
    fades[4] = 0.25f;
    const ResidentSet second(*first, fades, 2);
    EXPECT_TRUE(second.has_same_chunks(*first));
    EXPECT_EQ(second.chunks().data(), first->chunks().data());
    EXPECT_EQ(second.epoch(), 2u);
    EXPECT_EQ(second.fade(4), 0.25f);
    EXPECT_EQ(second.fade(0), 0.5f);
    EXPECT_EQ(first->fade(4), 1.0f);
    const ResidentSet apart(source.lattice(), source.extent(), chunks, 1);
    EXPECT_FALSE(apart.has_same_chunks(*first));

    first.reset();  // the shared part outlives the set that it came from
    EXPECT_TRUE(second.has_roots());
    EXPECT_EQ(second.links(static_cast<std::size_t>(second.find({-2, -2, 1}))).parent,
              second.find({-1, -1, 0}));
}

}  // namespace
}  // namespace terrane
