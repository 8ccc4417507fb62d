// SPDX-License-Identifier: MIT
#pragma once

#include "lod/mesh/morph.h"
#include "lod/keys/screen_error.h"
#include "lod/selection/vertex_keys.h"

namespace terrane::internal {

/// The largest screen errors, pixels, in view, that are left because something is not there.
struct ErrorLeft {
    double absent = 0.0;  ///< vertices of chunks that are not resident, or wait for such
    double finest = 0.0;  ///< detail finer than the lattice, or behind vertices that come first
    /// Of the surface displayed, thresholds: of vertices that slide in a little late.
    double sliding = 0.0;

    void take(const ErrorLeft& other) {
        absent = absent > other.absent ? absent : other.absent;
        finest = finest > other.finest ? finest : other.finest;
        sliding = sliding > other.sliding ? sliding : other.sliding;
    }
};

/// Looks for them in what is drawn with one chunk. Needs the bits of its active vertices and of its
/// children's.
///
/// @param left  of the chunks looked at before: smaller ones are passed over
void find_error_left(const OpenChunk& chunk, const VertexKeys& keys, const ScreenError& screen,
                     float threshold, const Morph& morph, ErrorLeft& left);

}  // namespace terrane::internal
