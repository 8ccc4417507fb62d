// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/store/sealed_file.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace terrane::internal {

/// SHA-256 of bytes, as 64 hexadecimal digits.
std::string sha256(std::span<const std::uint8_t> bytes);

/// Encodes the fields of a chunk that complete_chunk() does not compute, as bytes that compress well: heights and cell
/// bounds become differences from a prediction by their neighbours, and numbers are split into planes of their first,
/// second ... bytes. Gives the same bytes on every machine.
std::vector<std::uint8_t> encode_chunk(const Chunk& chunk);

/// Upper limit of the size of an encoded chunk.
std::size_t max_encoded_bytes();

/// Decodes a chunk.
///
/// Fails: bad_data if the bytes are not an encoded chunk
Result<std::shared_ptr<const Chunk>> decode_chunk(std::span<const std::uint8_t> bytes,
                                                  const Lattice& lattice, const ChunkKey& key);

inline constexpr SealedKind kStoreKind{{'C', 'H', 'N', 'K'}, 1};
inline constexpr std::int64_t kMostChunks = std::int64_t{1} << 26;
inline constexpr std::size_t kLongestNote = std::size_t{1} << 20;

/// Location of a chunk in the file, hash of its content, and its interval of heights.
struct ChunkRecord {
    std::uint64_t offset = 0;
    std::uint32_t bytes = 0;
    ContentHash hash;  ///< of the encoded chunk
    HeightInterval heights;
};

/// The content of a store except the chunks.
struct StoreDirectory {
    Lattice lattice;
    WorldRect extent;
    double max_error_m = 0.0;
    std::vector<double> rises;        ///< HeightSource::rise_bound() at rise_distances()
    std::vector<ChunkRecord> chunks;  ///< level by level; row by row from the south-west
    std::string note;

    std::size_t index_of(const ChunkKey& key) const;
};

/// Number of chunks on all levels of a lattice; kMostChunks + 1 if it exceeds kMostChunks.
std::int64_t count_chunks(const Lattice& lattice);
/// The key of a chunk by its index in StoreDirectory::chunks.
ChunkKey key_at(const Lattice& lattice, std::int64_t index);
/// The distances for which rise bounds are stored, in increasing order. A triangulator uses no others.
std::vector<double> rise_distances(const Lattice& lattice);

std::vector<std::uint8_t> encode(const StoreDirectory& directory);
/// Fails: bad_data if the bytes are not a valid directory
Result<StoreDirectory> decode_directory(std::span<const std::uint8_t> bytes);

/// SHA-256 of the content of a store, excluding offsets in the file and compressed sizes.
std::string sha_of(const StoreDirectory& directory);

}  // namespace terrane::internal
