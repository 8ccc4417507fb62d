// SPDX-License-Identifier: MIT
#pragma once

#include "lod/keys/open_chunk.h"

#include <cstddef>
#include <cstdint>

namespace terrane::internal {

/// Number of triangles drawn with a chunk's samples. Requires mark_active() of the chunk and its children.
std::size_t count_triangles(const OpenChunk& chunk, float threshold);

/// Writes the triangles: three sample indices each, counter-clockwise from above, in a fixed order.
///
/// @param indices_out [3 * count_triangles()]
void emit_triangles(const OpenChunk& chunk, float threshold, std::uint16_t* indices_out);

}  // namespace terrane::internal
