// SPDX-License-Identifier: MIT
#pragma once

#include "lod/keys/vertex_key.h"

namespace terrane::internal {

/// How far vertices have slid in, by their keys: clamp(full - slope * key, 0, 1). See Morph.
struct SlideShare {
    float full = 1.0f;
    float slope = 0.0f;
};

// Of one vertex, or of a row. Of internal linkage: see vertex_key.h.
namespace {

/// How far a vertex is from being in place: share - 1.
template <typename Number>
inline Number share_less_one(Number key, const SlideShare& share) {
    const Number wanted = larger(share.full - share.slope * key, Number{});
    return (wanted < 1.0f ? wanted : spread<Number>(1.0f)) - 1.0f;
}

/// Offset of a vertex between two ends: displayed = mean of the displayed ends + share * rise, where it
/// rises over the mean of the ends' heights.
template <typename Number>
inline Number slide(Number less_one, Number rise, Number offset_a, Number offset_b) {
    return 0.5f * (offset_a + offset_b) + less_one * rise;
}

}  // namespace

}  // namespace terrane::internal
