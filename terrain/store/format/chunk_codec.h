// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// The fields of a chunk that complete_chunk() does not compute, as bytes that compress well: heights as differences
/// from their prediction by neighbours, numbers split into planes of their first, second ... bytes. The same bytes on
/// every machine.
std::vector<std::uint8_t> encode_chunk(const Chunk& chunk);

/// The largest size of encode_chunk()'s result.
std::size_t max_encoded_bytes();

/// Decodes a chunk.
///
/// Fails: bad_data if the bytes are not of a chunk
Result<std::shared_ptr<const Chunk>> decode_chunk(std::span<const std::uint8_t> bytes,
                                                  const Lattice& lattice, const ChunkKey& key);

}  // namespace terrane::internal
