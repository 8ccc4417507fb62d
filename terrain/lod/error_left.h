// SPDX-License-Identifier: MIT
#pragma once

#include "screen_error.h"
#include "vertex_keys.h"

namespace terrane::internal {

/// The largest screen errors, pixels, in view, that are left because something is not there.
struct ErrorLeft {
    double absent = 0.0;  ///< vertices of chunks that are not resident, or wait for such
    double finest = 0.0;  ///< detail finer than the lattice

    void take(const ErrorLeft& other) {
        absent = absent > other.absent ? absent : other.absent;
        finest = finest > other.finest ? finest : other.finest;
    }
};

/// Looks for them in what is drawn with one chunk. Needs the bits of its active vertices and of its
/// children's.
///
/// @param in_place  vertices with keys below it are in place
/// @param left      of the chunks looked at before: smaller ones are passed over
void find_error_left(const OpenChunk& chunk, const VertexKeys& keys, const ScreenError& screen,
                     float threshold, float in_place, ErrorLeft& left);

}  // namespace terrane::internal
