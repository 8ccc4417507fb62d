// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/solid_surface.h>
#include <terrane/volume/placed_volume.h>

#include <array>
#include <compare>
#include <cstdint>
#include <vector>

namespace terrane {

/// A node of the contour's lattice: on the vertical line through a sample of the pinned level.
///
/// Node k of a line with height h is at z = h + (k - m) spacing, where m = floor(h / spacing + 1/2): the sample itself
/// is node m, and node k lies within half a spacing of z = k spacing.
struct VolumeNode {
    std::int64_t column = 0;  ///< of the sample, in spacings of the pinned level from (0, 0)
    std::int64_t row = 0;     ///< as column
    std::int32_t k = 0;       ///< counted upward
    friend constexpr auto operator<=>(const VolumeNode&, const VolumeNode&) = default;
};

/// Name of a vertex, the same in all tiles: the edge between two nodes that it lies on, the smaller node first. A
/// vertex at a node, such as a sample of the heightfield, has its node twice.
struct VolumeVertexKey {
    VolumeNode first, second;  ///< ends of the edge
    friend constexpr auto operator<=>(const VolumeVertexKey&, const VolumeVertexKey&) = default;
    /// Whether it is a node.
    constexpr bool is_node() const { return first == second; }
};

/// The surface of the joined solid over one tile. Triangles are counter-clockwise seen from outside the solid.
///
/// The contours of all tiles, with the triangles of the heightfield that no tile replaces, form a closed 2-manifold
/// with a boundary at the world's border: each inner edge, named by its vertices' keys, has one triangle in each
/// direction.
struct VolumeContour {
    VolumeTileKey key;                  ///< the tile
    std::vector<VolumeVertexKey> keys;  ///< of each vertex
    /// Of each vertex, metres, world: a function of the key, the heights at its two lines and the operations near
    /// them, so that tiles agree bit for bit.
    std::vector<WorldPos> positions_world;
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of vertices
    std::vector<SolidPart> surfaces;                      ///< of each triangle
    /// Triangles of the heightfield that are not part of the surface, ascending: 2 * (row * 32 + column) of the
    /// cell in the tile, + 1 for the northern triangle of the cell. `triangles` has their clipped parts.
    std::vector<std::uint16_t> replaced;
    /// For the western, eastern, southern and northern side: triangles in the vertical plane of the side that close the
    /// surface there, as if there were no volumes beyond; empty unless asked for. Indices of vertices.
    std::array<std::vector<std::array<std::uint32_t, 3>>, 4> caps;
    /// Largest diameter of a tetrahedron that the surface passes through, metres: each triangle lies in one with a part
    /// of the true surface.
    double error_m = 0.0;
    std::uint64_t layer_count = 0;  ///< prisms of one spacing that were visited
};

}  // namespace terrane
