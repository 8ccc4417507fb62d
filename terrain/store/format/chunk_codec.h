// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// The fields of a chunk that complete_chunk() does not fill, as bytes that compress well: heights as
/// differences to what their neighbours foretell, numbers split into planes of their first, second ...
/// bytes. The same chunk gives the same bytes on every machine.
std::vector<std::uint8_t> encode_chunk(const Chunk& chunk);

/// The longest that encode_chunk() gives.
std::size_t max_encoded_bytes();

/// The chunk that was encoded.
///
/// Fails: bad_data where the bytes are not those of a chunk
Result<std::shared_ptr<const Chunk>> decode_chunk(std::span<const std::uint8_t> bytes,
                                                  const Lattice& lattice, const ChunkKey& key);

}  // namespace terrane::internal
