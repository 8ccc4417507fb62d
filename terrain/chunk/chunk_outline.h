// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace terrane::internal {

/// What remains of a chunk coarser than contact while only bodies need it: bounds of the contact surface over absent
/// ground, with the bits that the chunk would give. Immutable.
struct ChunkOutline {
    ChunkKey key;
    std::uint8_t level = 0;                       ///< contact level, finer than that of the chunk
    std::array<float, 4> quadrant_bound{};        ///< as Chunk::quadrant_bound
    std::array<SampleRange, 4> quadrant_range{};  ///< of the samples of each quadrant
    /// [4^(level - key.level)] bounds over the chunks of this level, quanta, row by row from the south-west.
    std::vector<SampleRange> ranges;

    std::size_t bytes() const { return sizeof *this + ranges.size() * sizeof(SampleRange); }
};

/// Levels between a chunk and contact for which an outline is much smaller than the chunk.
inline constexpr int kMostOutlineDepth = 6;

/// ChunkOutline::bytes() for a chunk so many levels above contact.
constexpr std::size_t outline_bytes(int levels) {
    return sizeof(ChunkOutline) + (std::size_t{1} << (2 * levels)) * sizeof(SampleRange);
}

/// Bounds of the contact surface over the square of a finer chunk, quanta: the range of the samples there, widened by
/// their bound to the true surface and by one quantum for the rounding of the finer samples.
///
/// @param descendant of the chunk's square, of a finer level
/// @param quantum    Lattice::quantum, metres
SampleRange range_over(const Chunk& chunk, const ChunkKey& descendant, double quantum);

/// As above, from the outline of the chunk: the same for a descendant of the outline's level, wider for others.
SampleRange range_over(const ChunkOutline& outline, const ChunkKey& descendant);

/// Lowest and highest sample of a quadrant of a chunk.
SampleRange range_of_quadrant(const Chunk& chunk, int quadrant);

/// @param level contact level, finer than the chunk's
ChunkOutline make_outline(const Chunk& chunk, int level, double quantum);

}  // namespace terrane::internal
