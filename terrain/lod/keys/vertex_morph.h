// SPDX-License-Identifier: MIT
#pragma once

#include "lod/keys/vertex_key.h"

namespace terrane::internal {

/// The share of its rise that a vertex is displayed with, by its key: clamp(full - slope * key, 0, 1). See Morph.
struct MorphShare {
    float full = 1.0f;
    float slope = 0.0f;
};

// For one vertex or a row. Internal linkage: see vertex_key.h.
namespace {

/// share - 1: in [-1, 0], 0 at the vertex's final height.
template <typename Number>
inline Number share_less_one(Number key, const MorphShare& share) {
    const Number wanted = max_of(share.full - share.slope * key, Number{});
    return (wanted < 1.0f ? wanted : broadcast<Number>(1.0f)) - 1.0f;
}

/// Offset of a vertex from its final height, from the offsets of its two ends: it is displayed at the mean of the
/// displayed ends + share * rise, where rise is its height above the mean of the ends' heights.
template <typename Number>
inline Number morph_offset(Number less_one, Number rise, Number offset_a, Number offset_b) {
    return 0.5f * (offset_a + offset_b) + less_one * rise;
}

}  // namespace

}  // namespace terrane::internal
