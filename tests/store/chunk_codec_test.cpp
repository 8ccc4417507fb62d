// SPDX-License-Identifier: MIT
#include "store_files.h"
#include "store_format.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <limits>

namespace terrane::internal {
namespace chunk_codec_test {

using namespace test;

TEST(ChunkCodec, GivesBackEveryBitOfAChunk) {
    const auto source = small_fractal();
    for (const ChunkKey& key : {ChunkKey{-1, 0, 0}, ChunkKey{1, -2, 1}, ChunkKey{3, 3, 2}}) {
        const Chunk chunk = **make_chunk(*source, key);
        const auto bytes = encode_chunk(chunk);
        EXPECT_LE(bytes.size(), max_encoded_bytes());
        const auto decoded = decode_chunk(bytes, source->lattice(), key);
        ASSERT_TRUE(decoded.has_value());
        EXPECT_TRUE(same_chunk(chunk, **decoded));
        EXPECT_LE((*decoded)->bytes(), Chunk::max_bytes());
    }
}

TEST(ChunkCodec, KeepsExtremesAndFlags) {
    const auto source = small_fractal();
    const ChunkKey key{0, 0, 0};
    Chunk chunk = **make_chunk(*source, key);
    Random random(3);
    for (auto& height : chunk.heights) {
        height = (random.bits() & 1) != 0 ? 2147483647 : -2147483647;
    }
    chunk.cell_flags.assign(std::size_t{kChunkCells} * kChunkCells, cell_ground);
    for (auto& flags : chunk.cell_flags) flags = static_cast<std::uint8_t>(random.below(4));
    chunk.cell_bounds[7] = std::numeric_limits<float>::infinity();
    complete_chunk(source->lattice().quantum, std::make_shared<ChunkVertices>(*chunk.vertices),
                   chunk);
    const auto bytes = encode_chunk(chunk);
    EXPECT_EQ(bytes.size(), max_encoded_bytes());
    const auto decoded = decode_chunk(bytes, source->lattice(), key);
    ASSERT_TRUE(decoded.has_value());
    EXPECT_EQ((*decoded)->heights, chunk.heights);
    EXPECT_EQ((*decoded)->cell_flags, chunk.cell_flags);
    EXPECT_EQ((*decoded)->cell_bounds, chunk.cell_bounds);
}

TEST(ChunkCodec, RefusesBytesThatAreNoChunk) {
    const auto source = small_fractal();
    const ChunkKey root{0, 0, 0}, below{0, 0, 1};
    std::vector<std::uint8_t> bytes = encode_chunk(**make_chunk(*source, root));
    EXPECT_FALSE(decode_chunk(bytes, source->lattice(), below).has_value());
    bytes.push_back(0);
    EXPECT_FALSE(decode_chunk(bytes, source->lattice(), root).has_value());
    bytes.resize(bytes.size() - 2);
    EXPECT_FALSE(decode_chunk(bytes, source->lattice(), root).has_value());
    EXPECT_FALSE(decode_chunk({}, source->lattice(), root).has_value());
}

}  // namespace chunk_codec_test
}  // namespace terrane::internal
