// SPDX-License-Identifier: MIT
#pragma once

#include "lod/keys/open_chunk.h"

#include <cstddef>
#include <cstdint>

namespace terrane::internal {

/// How many triangles are drawn with a chunk's samples. Needs the bits of its active vertices and of
/// its children's.
std::size_t count_triangles(const OpenChunk& chunk, float threshold);

/// Writes them: three indices each, counter-clockwise from above, in one fixed order.
///
/// @param indices_out [3 * count_triangles()]
void emit_triangles(const OpenChunk& chunk, float threshold, std::uint16_t* indices_out);

}  // namespace terrane::internal
