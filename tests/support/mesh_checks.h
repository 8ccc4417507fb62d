// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace terrane::test {

/// A vertex: lattice point, height and morphing offset.
struct SoupVertex {
    LatticePoint point;
    std::int32_t height = 0;  ///< quanta
    float offset = 0.0f;      ///< metres
};
using SoupTriangle = std::array<SoupVertex, 3>;

/// Displayed position of a vertex, world: the bits of MeshChunk::displayed_height().
WorldPos displayed(const SoupVertex& vertex, const Lattice& lattice);

/// All triangles of a mesh, of all chunks.
std::vector<SoupTriangle> make_soup(const TerrainMesh& mesh);

/// Describes the first defect of a mesh of a whole world in one line; "" if there is none. Checks that each inner edge
/// has exactly two triangles, in opposite directions, and each border edge one; that each lattice point has one height
/// and one offset, bit for bit, and lies in the world; that triangles are counter-clockwise from above; and that their
/// integer areas sum to the world's.
///
/// Cost: O(triangles), less than a second for 1e6 of them
std::string find_flaw(const std::vector<SoupTriangle>& soup, const Lattice& lattice);

/// As above for a frame's mesh, without copying its triangles; also checks the mesh's counts and ranges.
std::string find_flaw(const TerrainMesh& mesh);

/// Largest screen error of the displayed surface, by brute force: `per_triangle` points in the interior of each
/// triangle are compared with source.height(). Only true points inside the view's side planes count.
///
/// @param allowed_m vertical distance that is not counted, metres
double measure_error_px(const std::vector<SoupTriangle>& soup, const HeightSource& source,
                        const View& view, int per_triangle, double allowed_m = 0.0);

/// As above at a grid of per_side x per_side points in each cell of the finest lattice.
double measure_error_px_everywhere(const std::vector<SoupTriangle>& soup,
                                   const HeightSource& source, const View& view, int per_side);

}  // namespace terrane::test
