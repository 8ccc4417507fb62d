// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/volume/volume_contour.h>
#include <terrane/volume/volumes.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane {

/// The level sets of one tile: for every node near a surface, signed distances to what operations made void and to what
/// they made solid; farther away, signs only. Later operations are applied in place, at a cost that does not depend on
/// how many came before.
///
/// Made from the operations and the tile's own heights alone; two tiles have the same values at nodes that they share.
///
/// Threads: one; contour() any number at once, while nothing else is called. Starts no threads.
class VolumeTile {
public:
    VolumeTile() = delete;
    VolumeTile(VolumeTile&&) noexcept;
    VolumeTile& operator=(VolumeTile&&) noexcept;
    ~VolumeTile();

    /// Applies the operations that touch the tile, in their order.
    ///
    /// @param heights [33 * 33] samples of the pinned level in Lattice::quantum, row by row from the south-west
    ///
    /// Fails: invalid_argument for another number of heights, heights beyond 2^28 spacings, or a tile that is not
    ///        of the world
    /// Cost:  O(nodes within three spacings of the operations' surfaces + lines * log)
    static Result<VolumeTile> create(const Volumes& volumes, const VolumeTileKey& key,
                                     std::span<const std::int32_t> heights);

    /// Reads what encoded() gave of the same tile. Its bytes must be known to be whole, as by a checksum: OpenVDB's
    /// reader is not hardened.
    ///
    /// Fails: as create(); bad_data where there are too few or too many bytes
    static Result<VolumeTile> decode(const Volumes& volumes, const VolumeTileKey& key,
                                     std::span<const std::int32_t> heights,
                                     std::span<const std::uint8_t> bytes);

    /// Another tile with the same level sets. Cost: O(bytes())
    VolumeTile copy() const;
    /// The level sets as bytes: the same for the same operations and heights with one version of OpenVDB.
    std::vector<std::uint8_t> encoded() const;

    /// Applies one more operation, which was placed for the same lattice and level.
    ///
    /// Cost: O(nodes of the tile within three spacings of its surface)
    void apply(const PlacedVolume& volume);

    /// The surface of the joined solid.
    ///
    /// Cost:     O(nodes near the surface); memory a few times that of the level sets, given back
    /// Accuracy: a vertex lies on an edge through which the surface of the joined solid passes, at most 1.74 spacings
    ///           long unless beside steep ground. For one sphere of 20 spacings it is within 0.02 spacing of it, and so
    ///           are triangles; across the edges of a box triangles cut the corner by up to 0.6 (docs/volumes.md)
    ///
    /// @param closes the western, eastern, southern and northern side: whether VolumeContour::caps has its cap
    VolumeContour contour(const std::array<bool, 4>& closes = {}) const;

    /// Signed distances at a node, metres, at most three spacings; negative where it is void, or solid.
    struct NodeDistances {
        float to_void = 0.0f;   ///< negative: void
        float to_solid = 0.0f;  ///< negative: solid
    };
    /// @param column, row of the line in the tile, 0 to 32
    NodeDistances distances(int column, int row, std::int32_t k) const;
    /// World position of a node. The same bits in all tiles.
    WorldPos position(int column, int row, std::int32_t k) const;
    /// [33 * 33] as given to create().
    std::span<const std::int32_t> heights() const;
    /// World position of a sample of the heightfield.
    WorldPos ground(int column, int row) const;

    /// Which tile.
    const VolumeTileKey& key() const;
    /// Metres between its nodes.
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

}  // namespace terrane
