// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace terrane::test {

/// A vertex: integer address, height and morphing offset.
struct SoupVertex {
    LatticePoint point;
    std::int32_t height = 0;  ///< quanta
    float offset = 0.0f;      ///< metres
};
using SoupTriangle = std::array<SoupVertex, 3>;

/// Displayed position of a vertex, world: the bits of MeshChunk::displayed_height().
WorldPos displayed(const SoupVertex& vertex, const Lattice& lattice);

/// All triangles of a mesh, whatever chunks they are drawn with.
std::vector<SoupTriangle> make_soup(const TerrainMesh& mesh);

/// The first flaw of a mesh of a whole world, in one line; "" if there is none. Checks: each inner edge
/// in exactly two triangles (in opposite directions), each border edge in one, one height and one
/// offset, bit for bit, for each lattice point, no point outside the world, triangles
/// counter-clockwise from above, and their areas, as integers, sum to the world's.
///
/// Cost: O(triangles); 1e6 of them take less than a second
std::string find_flaw(const std::vector<SoupTriangle>& soup, const Lattice& lattice);

/// The same for a frame, without a copy of its triangles; and its counts and ranges must agree.
std::string find_flaw(const TerrainMesh& mesh);

/// Largest screen error of the displayed surface at points of the true surface inside the view's side planes, by
/// brute force: `per_triangle` points in each triangle (corners apart), against
/// source.height().
///
/// @param allowed_m vertical distance that does not count, metres
double measure_error_px(const std::vector<SoupTriangle>& soup, const HeightSource& source,
                        const View& view, int per_triangle, double allowed_m = 0.0);

/// The same over a net of per_side x per_side points in each cell of the finest lattice.
double measure_error_px_everywhere(const std::vector<SoupTriangle>& soup,
                                   const HeightSource& source, const View& view, int per_side);

}  // namespace terrane::test
