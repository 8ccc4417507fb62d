// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>

#include <span>

namespace terrane::internal {

/// Cells of a chunk's own spacing that its vertices' reaches take in beyond its sides.
inline constexpr int kReachCells = 2;
inline constexpr int kWideCells = kChunkCells + 2 * kReachCells;
inline constexpr int kWideSamples = kWideCells + 1;

/// How far over and under a vertex of a spacing its reach can go at most, metres: by how the source rises
/// anywhere. Of a centre it holds those of its midpoints, of a midpoint those of centres of half the
/// spacing.
struct ReachHeights {
    double of_centre = 0.0;
    double of_midpoint = 0.0;
};
ReachHeights reach_heights(const HeightSource& source, double spacing);

/// Fills the heights of the reaches of a chunk's vertices.
///
/// @param heights [kWideSamples^2] metres, of the chunk and kReachCells around it
/// @param bounds  [kWideCells^2] certified bounds of the cells, metres
void fill_reaches(std::span<const double> heights, std::span<const float> bounds,
                  const HeightSource& source, Chunk& chunk);

/// Fills what areas and the chunk know of their vertices' reaches, and the rises of the vertices.
void derive_reaches(double quantum, Chunk& chunk);

}  // namespace terrane::internal
