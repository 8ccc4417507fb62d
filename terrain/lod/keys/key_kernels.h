// SPDX-License-Identifier: MIT
#pragma once

#include "base/simd_level.h"
#include "lod/keys/vertex_key.h"
#include "lod/keys/vertex_morph.h"

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
    float half_width = 0.0f;                               ///< of the reaches
};

/// Keys of the midpoints in and around a quarter of an area: the parents of the centres of the finer area that covers
/// the quarter.
struct ParentSides {
    const float* along_x = nullptr;  ///< [64] of the area
    const float* along_y = nullptr;  ///< [64]
    const float* north = nullptr;    ///< [8] midpoints on the area's northern side
    const float* east = nullptr;     ///< [64] first column: midpoints on its eastern side
    int column = 0;                  ///< 0 or 4: the quarter's first square
    int row = 0;
};

/// Collects the keys in [low, high).
struct KeyWindow {
    float low = 0.0f, high = 0.0f;
    float* keys = nullptr;  ///< large enough for every key counted
    std::uint32_t count = 0;
};

/// Inputs and output of the offsets of an area's vertices.
struct AreaMorph {
    const float* centre = nullptr;       ///< [64] keys
    const float* along_x = nullptr;      ///< [64]
    const float* along_y = nullptr;      ///< [64]
    const std::int16_t* rise = nullptr;  ///< [3][64] in rise_unit: see AreaVertices
    float rise_unit = 1.0f;
    const float* coarse = nullptr;  ///< [9 rows of 9] offsets of the area's even samples
    std::size_t coarse_stride = 0;  ///< from row to row of `coarse`
    float* offsets = nullptr;       ///< of its south-western sample, in rows of kChunkSamples
    MorphShare share;
};

/// The loops over the vertices of an area, compiled once for each vector width; all give the same bits.
struct KeyKernels {
    /// Keys from bounds and distances, before they are raised to the parents'.
    void (*own)(const VertexGroup& group, const EyeHeights& eye, float* keys_out);
    /// Raises the keys of vertices outside the view.
    void (*weigh)(const VertexGroup& group, const EyeHeights& eye, const KeyPlanes& planes,
                  float* keys);
    /// Raises the keys of centres to their parents': the midpoints of those two sides of the coarser square that
    /// bound the centre's quarter of it.
    /// @return whether any key below `floor` was raised by more than kNestMargin
    bool (*trim_centres)(const ParentSides& parents, float floor, float* keys);
    /// Raises the keys of midpoints to those of the two adjacent centres.
    /// @param south [8] the last row of centres in the area to the south
    bool (*trim_along_x)(const float* centres, const float* south, float floor, float* keys);
    /// @param west [64] the centres of the area to the west
    bool (*trim_along_y)(const float* centres, const float* west, float floor, float* keys);
    /// Returns the number of keys below a window, and appends those inside it.
    std::uint32_t (*count)(const float* keys, int count, KeyWindow& window);
    /// Bits of those of 64 keys that are below a threshold.
    std::uint64_t (*mask)(const float* keys, float threshold);
    /// Offsets of an area's samples, including the even samples on its eastern and northern side.
    void (*morph)(const AreaMorph& area);
};

/// The kernels of a level; of the next lower one where that level is not built.
const KeyKernels& key_kernels(SimdLevel level);

}  // namespace terrane::internal
