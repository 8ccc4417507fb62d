// SPDX-License-Identifier: MIT
#pragma once

#include "simd_level.h"

#include <cstdint>

namespace terrane::internal {

// Beside the view a vertex counts for less, so that a turning camera does not find bare roots: down to
// this share of its priority,
inline constexpr float kLeastWeight = 1.0f / 16.0f;
// over a margin of about a quarter of the distance.
inline constexpr float kWeightSlope = 6.0f;

/// Part of a row of samples of a chunk, for the kernels below; arrays begin at its first sample.
struct KeyRow {
    int count = 0;
    const float* x = nullptr;  ///< [count] metres from the eye
    float y = 0.0f;
    const std::int32_t* heights = nullptr;         ///< [count] quanta
    const float* inverse_square_bounds = nullptr;  ///< [count]
    const float* across = nullptr;                 ///< [count] of the vertices' reaches
    const float* up = nullptr;                     ///< [count]
    std::int32_t height_base = 0;
    float quantum = 1.0f;
    float height_rest = 0.0f;
    float near_squared = 1.0f;
};

/// Side planes of a view, for rows that are not wholly inside it.
struct KeyPlanes {
    int count = 0;
    float x[4] = {}, y[4] = {}, z[4] = {};
    float near_distance = 1.0f;
};

/// Keys between two thresholds, collected.
struct KeyWindow {
    float low = 0.0f, high = 0.0f;
    float* keys = nullptr;  ///< room for all that may come
    std::uint32_t count = 0;
};

/// What a row of morphing vertices is made of.
struct OffsetRow {
    int count = 0;
    const float* keys = nullptr;  ///< [count]
    const std::int32_t* heights =
        nullptr;  ///< [count]; odd rows: those beside it are kChunkSamples away
    /// [count / 2 + 1] offsets of the even samples of this row, or of the row before an odd one
    const float* coarse = nullptr;
    const float* coarse_high = nullptr;  ///< the same of the row after an odd one
    float* offsets = nullptr;            ///< [count]
    float quantum = 1.0f;
    float full = 1.0f;  ///< share = clamp(full - slope * key, 0, 1)
    float slope = 0.0f;
    bool first_is_even_square = false;  ///< odd rows: of the square around sample 1
};

/// The loops over rows of samples, once for each width of vectors; the same bits from all of them.
/// Rows begin at an even sample and have an odd count.
struct KeyKernels {
    /// Keys from bounds and distances alone.
    void (*own)(const KeyRow& row, float* keys_out);
    /// Raises keys beside the view.
    void (*weigh)(const KeyRow& row, const KeyPlanes& planes, float* keys);
    /// Raises the keys of the centres (odd samples) of an odd row to their parents'. The parents are
    /// samples of the next coarser level: those of the squares' southern and northern sides.
    /// @param south, north [count / 2 + 1] keys of the parents' rows
    /// @param even_first   whether the square around sample 1 has an even index sum
    /// @return whether any key below `floor` was raised
    bool (*trim_centres)(float* keys, int count, const float* south, const float* north,
                         bool even_first, float floor);
    /// Raises the keys of the midpoints (even samples but the first and the last) of an odd row to
    /// those of the centres on both sides.
    bool (*trim_between)(float* keys, int count, float floor);
    /// Raises the keys of the midpoints (odd samples) of an even row to those of the centres in the
    /// rows before and after.
    bool (*trim_across)(float* keys, int count, const float* south, const float* north,
                        float floor);
    /// Counts keys below a window, and appends those inside it.
    std::uint32_t (*count)(const float* keys, int count, KeyWindow& window);
    /// Which of 128 keys are below a threshold: even and odd samples apart, bit i for sample 2 i or
    /// 2 i + 1.
    void (*mask)(const float* keys, float threshold, std::uint64_t& even_out,
                 std::uint64_t& odd_out);
    /// Offsets of an even row, from its even samples'.
    void (*slide_even)(const OffsetRow& row);
    /// Offsets of an odd row, from the even samples' of both rows beside it.
    void (*slide_odd)(const OffsetRow& row);
};

/// The kernels for a machine. Levels that were not built give the next lower one.
const KeyKernels& key_kernels(SimdLevel level);

}  // namespace terrane::internal
