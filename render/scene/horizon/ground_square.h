// SPDX-License-Identifier: MIT
#pragma once

#include "horizon/sectors.h"

#include <terrane/terrain/resident_set.h>

#include <array>

namespace terrane::internal {

/// An aligned square of a resident chunk's cells, and what the chunk certifies of the true surface over it.
struct GroundSquare {
    std::int32_t index = 0;                    ///< of the chunk in ResidentSet::chunks()
    int log2_side = SamplePyramid::kCoarsest;  ///< cells along its side
    int column = 0, row = 0;                   ///< of its south-western cell in the chunk

    /// The finest resident description of its four quarters: squares of children, where they are resident.
    /// Requires can_divide().
    std::array<GroundSquare, 4> quarters(const ResidentSet& resident) const;
    /// False of the smallest squares whose range of heights a chunk has, and no child is resident.
    bool can_divide() const { return log2_side > SamplePyramid::kFinest; }
};

/// World coordinates of a square.
WorldRect rect_of(const Lattice& lattice, const Chunk& chunk, const GroundSquare& square);

/// Certified bounds of the true surface over a square, metres. Requires a certified chunk.
HeightInterval true_heights(const Chunk& chunk, const GroundSquare& square, double quantum);

/// Whether all of its cells are ground.
bool is_all_ground(const Chunk& chunk, const GroundSquare& square);

}  // namespace terrane::internal
