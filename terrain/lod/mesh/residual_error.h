// SPDX-License-Identifier: MIT
#pragma once

#include "lod/keys/screen_error.h"
#include "lod/mesh/morph.h"
#include "lod/selection/vertex_keys.h"

#include <algorithm>

namespace terrane::internal {

/// The largest screen errors in view, pixels, that remain because vertices are missing.
struct ResidualError {
    double absent = 0.0;    ///< vertices of absent chunks, and vertices with absent parents
    double held = 0.0;      ///< vertices held by inactive parents
    double finest = 0.0;    ///< detail finer than the lattice
    double finest_m = 0.0;  ///< the same as a vertical distance, metres
    /// Of the displayed surface, in thresholds: vertices that morph late because of their parents' keys.
    double morphing = 0.0;

    void merge(const ResidualError& other) {
        absent = std::max(absent, other.absent);
        held = std::max(held, other.held);
        finest = std::max(finest, other.finest);
        finest_m = std::max(finest_m, other.finest_m);
        morphing = std::max(morphing, other.morphing);
    }
};

/// Merges the residual errors of what is drawn with one chunk. Requires mark_active() of the chunk and its children.
///
/// @param residual in and out: errors below it are skipped early
void find_residual_error(const OpenChunk& chunk, const VertexKeys& keys, const ScreenError& screen,
                         float threshold, const Morph& morph, ResidualError& residual);

}  // namespace terrane::internal
