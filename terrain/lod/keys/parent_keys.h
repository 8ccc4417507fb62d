// SPDX-License-Identifier: MIT
#pragma once

#include "lod/keys/key_kernels.h"
#include "lod/keys/open_chunk.h"

#include <array>

namespace terrane::internal {

/// Keys that the vertices of an area wait for. What is not open is kNever; beyond the world's end nothing
/// is waited for, and keys are 0.
///
/// The centres of the area to the south or west: [AreaVertices::kSquares].
const float* centres_beside(const OpenChunk& chunk, int area, Side side);

/// The parents of an area's centres, midpoints of the next coarser chunk or of the root's own coarser
/// vertices. Does not move: the sides may point into it.
class CentreParents {
public:
    CentreParents(const OpenChunk& chunk, int area);
    CentreParents(const CentreParents&) = delete;
    CentreParents& operator=(const CentreParents&) = delete;

    const ParentSides& sides() const { return sides_; }

private:
    using Keys = std::array<float, AreaVertices::kSquares>;
    void gather(const OpenChunk& root, int area);
    void find(const OpenChunk& chunk, int area);

    ParentSides sides_;
    Keys along_x_, along_y_;  // where they have to be gathered
};

}  // namespace terrane::internal
