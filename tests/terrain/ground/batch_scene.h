// SPDX-License-Identifier: MIT
#pragma once

#include "support/grounds.h"
#include "support/random.h"

#include <terrane/terrain/ground.h>

#include <bit>
#include <cstdint>
#include <vector>

namespace terrane::test {

/// Side of the ground of make_batch_ground(), metres.
inline constexpr double kBatchSide = 3.0 * kChunkCells;

/// 3 x 3 chunks of rough ground with holes. Chunk (1, 2) is absent; chunk (0, 0) has a pit of volumes under a roof.
Ground make_batch_ground(double spacing = 1.0);

/// Coordinates x y z x y z ... in random order and in runs: inside cells, on lattice lines, on the border of the ground
/// and beyond it, in holes, in the pit, NaN and infinite.
std::vector<double> make_batch_points(Random& random, std::size_t count, double spacing = 1.0);

/// Bits of a number: all NaN are equal, 0 and -0 differ.
inline std::uint64_t bits_of(double number) { return std::bit_cast<std::uint64_t>(number); }

}  // namespace terrane::test
