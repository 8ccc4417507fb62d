// SPDX-License-Identifier: MIT
#pragma once

#include "lod/keys/key_kernels.h"
#include "lod/keys/open_chunk.h"

#include <cstdint>

namespace terrane::internal {

/// Sets the bits of a chunk's active vertices: those with keys below the threshold.
void mark_active(OpenChunk& chunk, const KeyKernels& kernels, float threshold);

/// Bits of the active midpoints on an area's eastern side, in the first column, or northern side, in the first
/// row. They are the adjacent area's, except at the world's border.
std::uint64_t east_side_bits(const OpenChunk& chunk, int area);
std::uint64_t north_side_bits(const OpenChunk& chunk, int area);

/// The squares of an area, bit i for square i: those with an active centre, those with split sides, and those with
/// quarters that a child's centre divides.
struct AreaBits {
    std::uint64_t centre = 0;
    /// South, east, north, west.
    std::uint64_t split[4] = {};
    /// South-west, south-east, north-east, north-west; divided quarters have both sides split.
    std::uint64_t divided[4] = {};
};
/// Requires mark_active() of the chunk, its neighbours and its open children. All zero if the area has no active
/// centre.
AreaBits area_bits(const OpenChunk& chunk, int area);

}  // namespace terrane::internal
