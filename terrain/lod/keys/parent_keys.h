// SPDX-License-Identifier: MIT
#pragma once

#include "lod/keys/key_kernels.h"
#include "lod/keys/open_chunk.h"

#include <array>

namespace terrane::internal {

/// Keys of the centres of the area to the south or west, the parents of midpoints: [AreaVertices::kSquares]. All
/// kNever if that area is not open; all 0 beyond the world's border, where midpoints have one parent.
const float* adjacent_centres(const OpenChunk& chunk, int area, Side side);

/// Keys of the parents of an area's centres: midpoints of the parent chunk, or of a root's own coarser vertices. kNever
/// where not open. Not movable: sides() may point into it.
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
    Keys along_x_, along_y_;  // copies, where keys are not contiguous
};

}  // namespace terrane::internal
