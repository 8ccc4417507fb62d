// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/solid_surface.h>
#include <terrane/volume/volumes.h>

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
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

/// Name of a vertex, the same in all tiles: the two nodes of the edge on which the vertex lies, smaller node first. The
/// name of a vertex at a node, such as a sample of the heightfield, has that node twice.
struct VolumeVertexKey {
    VolumeNode first, second;  ///< ends of the edge
    friend constexpr auto operator<=>(const VolumeVertexKey&, const VolumeVertexKey&) = default;
    /// Whether the vertex is at a node.
    constexpr bool is_node() const { return first == second; }
};

/// The surface of the joined solid over one tile. Triangles are counter-clockwise seen from outside the solid.
///
/// The contours of all tiles and the triangles of the heightfield that no tile replaces form a 2-manifold whose only
/// boundary is at the world's border: each inner edge, named by its vertices' keys, has one triangle in each direction.
struct VolumeContour {
    VolumeTileKey key;                  ///< the tile
    std::vector<VolumeVertexKey> keys;  ///< of each vertex
    /// [keys] metres, world. A position depends only on its key, on the heights at the key's two lines and on the
    /// operations near them, so that tiles agree bit for bit.
    std::vector<WorldPos> positions_world;
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of vertices
    std::vector<SolidPart> surfaces;                      ///< of each triangle
    /// Triangles of the heightfield that are not part of the surface, ascending: 2 * (row * 32 + column) of the cell in
    /// the tile, + 1 for the cell's northern triangle. Their clipped remainders are in `triangles`.
    std::vector<std::uint16_t> replaced;
    /// For the western, eastern, southern and northern side: triangles in the side's vertical plane that close the
    /// surface as if there were no volumes beyond. Indices of vertices; empty unless requested.
    std::array<std::vector<std::array<std::uint32_t, 3>>, 4> caps;
    /// Error bound, metres: the largest diameter of a tetrahedron that the surface passes through, because each
    /// triangle shares its tetrahedron with a part of the true surface.
    double error_m = 0.0;
    std::uint64_t layer_count = 0;  ///< prisms of one spacing that were visited
};

/// The level sets of one tile: for every node near a surface, the signed distances to the space that operations made
/// void and to the space that they made solid; farther away, only their signs. Later operations are applied in place,
/// at a cost independent of the number of earlier ones.
///
/// The level sets depend only on the operations and the tile's own heights; two tiles have the same values at shared
/// nodes.
///
/// Threads: one; contour() from any number at once, while nothing else is called. Starts no threads.
class VolumeTile {
public:
    VolumeTile() = delete;
    VolumeTile(VolumeTile&&) noexcept;
    VolumeTile& operator=(VolumeTile&&) noexcept;
    ~VolumeTile();

    /// Applies the operations that touch the tile, in order.
    ///
    /// @param heights [33 * 33] samples of the pinned level in Lattice::quantum, row by row from the south-west
    ///
    /// Fails: invalid_argument for a wrong number of heights, heights beyond 2^28 spacings, or a tile outside the world
    /// Cost:  O(nodes inside the operations' shapes or within three spacings of their surfaces)
    static Result<VolumeTile> create(const Volumes& volumes, const VolumeTileKey& key,
                                     std::span<const std::int32_t> heights);

    /// Reads the result of encoded() for the same tile. The bytes must be known to be intact, for example by a
    /// checksum: OpenVDB's reader is not hardened.
    ///
    /// Fails: as create(); bad_data if there are too few or too many bytes
    static Result<VolumeTile> decode(const Volumes& volumes, const VolumeTileKey& key,
                                     std::span<const std::int32_t> heights,
                                     std::span<const std::uint8_t> bytes);

    /// Another tile with the same level sets. Cost: O(bytes())
    VolumeTile copy() const;
    /// The level sets as bytes, which depend only on operations, heights and the version of OpenVDB.
    std::vector<std::uint8_t> encoded() const;

    /// Applies one more operation, placed for the same lattice and level.
    ///
    /// Cost: O(nodes of the tile inside the shape or within three spacings of its surface)
    void apply(const PlacedVolume& volume);

    /// The surface of the joined solid.
    ///
    /// Cost:     O(nodes near the surface); temporary memory of a few times the level sets' size
    /// Accuracy: each vertex lies on an edge that the surface of the joined solid crosses, at most 1.74 spacings long
    ///           except beside steep ground. For one sphere with a radius of 20 spacings, vertices and triangles are
    ///           within 0.02 spacing of the sphere; at the edges of a box, triangles cut the corner by up to 0.6
    ///           spacing (docs/volumes.md)
    ///
    /// @param closes whether to make the western, eastern, southern and northern cap: VolumeContour::caps
    VolumeContour contour(const std::array<bool, 4>& closes = {}) const;

    /// Signed distances at a node, metres, limited to three spacings; negative inside the void, or inside the solid.
    struct NodeDistances {
        float to_void = 0.0f;   ///< negative: void
        float to_solid = 0.0f;  ///< negative: solid
    };
    /// @param column, row of the line in the tile, 0 to 32
    NodeDistances distances(int column, int row, std::int32_t k) const;
    /// World position of a node, with the same bits in all tiles.
    WorldPos position(int column, int row, std::int32_t k) const;
    /// [33 * 33] heights as passed to create().
    std::span<const std::int32_t> heights() const;
    /// World position of a sample of the heightfield.
    WorldPos ground(int column, int row) const;

    /// Index of the tile.
    const VolumeTileKey& key() const;
    /// Distance between neighbouring nodes of a line, metres.
    double spacing() const;

    /// Bytes of the level sets.
    std::size_t bytes() const;
    /// Nodes of the level sets within three spacings of a surface.
    std::uint64_t band_node_count() const;

private:
    struct State;
    explicit VolumeTile(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

/// Contours the volumes over one chunk of the pinned level, for Chunk::solid; null if no volume touches the chunk.
/// Chunks are contoured separately and agree bit for bit at their borders.
///
/// The error is the largest diameter of a tetrahedron that the surface passes through, because each triangle shares its
/// tetrahedron with a part of the true surface. For smooth surfaces this bound is many times the actual error
/// (docs/volumes.md). Features thinner than two spacings may be lost between nodes; the error does not cover that.
///
/// Fails:   invalid_argument for a chunk of another level, or as VolumeTile::create()
/// Threads: any number
/// Cost:    makes its tiles; only a search if no volume touches the chunk
Result<std::shared_ptr<const SolidSurface>> make_chunk_solid(const Volumes& volumes,
                                                             const Chunk& chunk);

}  // namespace terrane
