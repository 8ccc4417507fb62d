// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace terrane::test {

/// A vertex as the integers that name it.
struct SoupVertex {
    LatticePoint point;
    std::int32_t height = 0;  ///< quanta
    friend constexpr auto operator<=>(const SoupVertex&, const SoupVertex&) = default;
};
using SoupTriangle = std::array<SoupVertex, 3>;

/// All triangles of a mesh, whatever chunks they are drawn with.
std::vector<SoupTriangle> make_soup(const TerrainMesh& mesh);

/// What is wrong with a mesh of a whole world, in one line, or "" where nothing is: each inner edge
/// in exactly two triangles (in opposite directions), each border edge in one, one height for each
/// lattice point, triangles counter-clockwise from above, and their areas sum to the world's.
std::string find_flaw(const std::vector<SoupTriangle>& soup, const Lattice& lattice);

/// Largest screen error over points of the true surface in the view's side planes, by brute force:
/// `per_triangle` points in each triangle (corners apart), against source.height().
double measure_error_px(const std::vector<SoupTriangle>& soup, const HeightSource& source,
                        const View& view, int per_triangle);

}  // namespace terrane::test
