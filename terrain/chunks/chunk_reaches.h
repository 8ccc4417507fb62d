// SPDX-License-Identifier: MIT
#pragma once

#include "chunks/chunk_vertices.h"

#include <terrane/terrain/chunk.h>

#include <span>

namespace terrane::internal {

/// Margin around a chunk, in cells of its spacing, that the reaches of its vertices cover. The reach of a vertex is the
/// box that encloses the true surface over its diamond and the reaches of its descendants: see screen_error.h.
inline constexpr int kReachCells = 2;
inline constexpr int kWideCells = kChunkCells + 2 * kReachCells;
inline constexpr int kWideSamples = kWideCells + 1;

/// Upper bound of half the height of a vertex's reach, metres, from the source's rise bound. A centre's includes
/// those of its midpoints, a midpoint's those of the centres of half the spacing.
struct ReachHeights {
    double of_centre = 0.0;
    double of_midpoint = 0.0;
};
ReachHeights reach_heights(const HeightSource& source, double spacing);

/// Sets the lows and highs of the reaches of a chunk's vertices, reach_base and reach_unit.
///
/// @param heights [kWideSamples^2] metres, of the chunk and kReachCells around it
/// @param bounds  [kWideCells^2] certified bounds of the cells, metres
void fill_reaches(std::span<const double> heights, std::span<const float> bounds,
                  const HeightSource& source, const Chunk& chunk, ChunkVertices& vertices_out);

/// Sets the reaches of areas and of the chunk from those of the vertices, and the rises of the vertices.
void derive_reaches(double quantum, ChunkVertices& vertices, Chunk& chunk);

}  // namespace terrane::internal
