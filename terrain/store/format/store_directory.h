// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/store/sealed_file.h>
#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace terrane::internal {

inline constexpr SealedKind kStoreKind{{'C', 'H', 'N', 'K'}, 1};
inline constexpr std::int64_t kMostChunks = std::int64_t{1} << 26;
inline constexpr std::size_t kLongestNote = std::size_t{1} << 20;

/// Where a chunk is, what its content must hash to, and what heights there are over it.
struct ChunkRecord {
    std::uint64_t offset = 0;
    std::uint32_t bytes = 0;
    ContentHash hash;  ///< of what encode_chunk() gave
    HeightInterval heights;
};

/// What a store knows of its world, besides chunks.
struct StoreDirectory {
    Lattice lattice;
    WorldRect extent;
    double max_error_m = 0.0;
    std::vector<double> rises;        ///< HeightSource::rise_bound() at rise_distances()
    std::vector<ChunkRecord> chunks;  ///< level by level; row by row from the south-west
    std::string note;

    std::size_t index_of(const ChunkKey& key) const;
};

/// Chunks of all levels of a lattice; kMostChunks + 1 for more than kMostChunks.
std::int64_t count_chunks(const Lattice& lattice);
/// The key of a chunk by its index in StoreDirectory::chunks.
ChunkKey key_at(const Lattice& lattice, std::int64_t index);
/// Distances at which a store keeps how much the surface rises, in rising order: those that a triangulator
/// asks for.
std::vector<double> rise_distances(const Lattice& lattice);

std::vector<std::uint8_t> encode(const StoreDirectory& directory);
/// Fails: bad_data where the bytes are no directory that makes sense
Result<StoreDirectory> decode_directory(std::span<const std::uint8_t> bytes);

/// SHA-256 of all that a store says, without places in the file and compressed sizes.
std::string sha_of(const StoreDirectory& directory);

}  // namespace terrane::internal
