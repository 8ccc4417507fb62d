// SPDX-License-Identifier: MIT
#pragma once

#include "lod/keys/screen_error.h"
#include "lod/mesh/morph.h"
#include "lod/selection/vertex_keys.h"

namespace terrane::internal {

/// The largest screen errors in view, pixels, that remain because vertices are missing.
struct ResidualError {
    double absent = 0.0;  ///< vertices of absent chunks, and vertices with absent parents
    double finest = 0.0;  ///< detail finer than the lattice, and vertices held by inactive parents
    /// Of the displayed surface, in thresholds: vertices that morph late because of their parents' keys.
    double morphing = 0.0;

    void merge(const ResidualError& other) {
        absent = absent > other.absent ? absent : other.absent;
        finest = finest > other.finest ? finest : other.finest;
        morphing = morphing > other.morphing ? morphing : other.morphing;
    }
};

/// Merges the residual errors of what is drawn with one chunk. Requires mark_active() of the chunk and its children.
///
/// @param residual in and out: errors below it are skipped early
void find_residual_error(const OpenChunk& chunk, const VertexKeys& keys, const ScreenError& screen,
                         float threshold, const Morph& morph, ResidualError& residual);

}  // namespace terrane::internal
