// SPDX-License-Identifier: MIT
#pragma once

#include "base/simd_level.h"
#include "lod/keys/vertex_key.h"
#include "lod/keys/vertex_slide.h"

#include <cstddef>
#include <cstdint>

namespace terrane::internal {

/// Vertices of one kind in an area, 8 rows of 8 from the south-west.
struct VertexGroup {
    const std::uint16_t* inverse_square_bounds = nullptr;  ///< [64] upper halves of floats
    const std::int16_t* low = nullptr;                     ///< [64] of the reaches, see EyeHeights
    const std::int16_t* high = nullptr;                    ///< [64]
    const float* x = nullptr;                              ///< [8] metres from the eye, by column
    const float* y = nullptr;                              ///< [8] by row
    float across = 0.0f;                                   ///< half the width of the reaches
};

/// Keys of the midpoints around a quarter of an area, which are the parents of the centres of the
/// finer area over it.
struct ParentSides {
    const float* along_x = nullptr;  ///< [64] of the area
    const float* along_y = nullptr;  ///< [64]
    const float* north = nullptr;    ///< [8] midpoints on the area's northern side
    const float* east = nullptr;     ///< [64] first column: midpoints on its eastern side
    int column = 0;                  ///< 0 or 4: the quarter's first square
    int row = 0;
};

/// Keys between two thresholds, collected.
struct KeyWindow {
    float low = 0.0f, high = 0.0f;
    float* keys = nullptr;  ///< room for all that may come
    std::uint32_t count = 0;
};

/// What an area's morphing vertices are made of.
struct AreaSlide {
    const float* centre = nullptr;       ///< [64] keys
    const float* along_x = nullptr;      ///< [64]
    const float* along_y = nullptr;      ///< [64]
    const std::int16_t* rise = nullptr;  ///< [3][64] in rise_unit: see AreaVertices
    float rise_unit = 1.0f;
    const float* coarse = nullptr;  ///< [9 rows of 9] offsets of the area's even samples
    std::size_t coarse_stride = 0;  ///< from row to row of them
    float* offsets = nullptr;       ///< of its south-western sample, in rows of kChunkSamples
    SlideShare share;
};

/// The loops over the vertices of an area, once for each width of vectors; the same bits from all of
/// them.
struct KeyKernels {
    /// Keys from bounds and distances alone.
    void (*own)(const VertexGroup& group, const EyeHeights& eye, float* keys_out);
    /// Raises keys beside the view.
    void (*weigh)(const VertexGroup& group, const EyeHeights& eye, const KeyPlanes& planes,
                  float* keys);
    /// Raises the keys of centres to their parents': of a square's sides in the next coarser area,
    /// those two that are also sides of the coarser centre's quarter.
    /// @return whether any key below `floor` was raised by more than kNestMargin
    bool (*trim_centres)(const ParentSides& parents, float floor, float* keys);
    /// Raises the keys of midpoints to those of the centres on both sides.
    /// @param south [8] the last row of centres in the area to the south
    bool (*trim_along_x)(const float* centres, const float* south, float floor, float* keys);
    /// @param west [64] the centres of the area to the west
    bool (*trim_along_y)(const float* centres, const float* west, float floor, float* keys);
    /// Counts keys below a window, and appends those inside it.
    std::uint32_t (*count)(const float* keys, int count, KeyWindow& window);
    /// Which of 64 keys are below a threshold.
    std::uint64_t (*mask)(const float* keys, float threshold);
    /// Offsets of an area's samples, those of its even samples on its east and north included.
    void (*slide)(const AreaSlide& area);
};

/// The kernels for a machine. Levels that were not built give the next lower one.
const KeyKernels& key_kernels(SimdLevel level);

}  // namespace terrane::internal
