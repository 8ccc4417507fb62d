// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/volume/placed_volume.h>

#include <array>
#include <cstddef>
#include <memory>
#include <span>

namespace terrane {

/// The volumes of a scene: an ordered list of operations on the solid under a heightfield, indexed by tile.
///
/// The *state* of a point is that of the last operation whose shape contains it: void after `remove`, solid after
/// `add`, natural where there is none. The *joined solid* is every point on or below the heightfield that is not
/// void, and every point above it that is solid.
///
/// Volumes are contoured at one level of the terrain, the *pinned level*: the one whose spacing is nearest to the
/// finest wanted voxel, on a scale of ratios, unless VolumeSettings::level says otherwise. Its samples are the heights
/// of the heightfield.
///
/// Immutable, cheap to copy. Threads: any number.
class Volumes {
public:
    Volumes() = delete;

    /// An empty list needs VolumeSettings::level: ground that is only dug at run time (VolumeEditor).
    ///
    /// Fails: as PlacedVolume::create(), naming the operation by its index; invalid_argument for an empty list without
    ///        a level or a lattice out of range
    /// Cost:  that of its placed volumes, and O(tiles that they touch)
    static Result<Volumes> create(const Lattice& lattice,
                                  std::span<const VolumeOperation> operations,
                                  const VolumeSettings& settings = {});

    /// Lattice of the terrain.
    const Lattice& lattice() const;
    /// The pinned level.
    int level() const;
    /// Its spacing, metres.
    double spacing() const;
    /// The operations in their order.
    std::span<const PlacedVolume> operations() const;

    /// A hash of lattice, level and operations, 128 bits: what files of digs are bound to. Of a VolumeFile path, grid
    /// and size of its level set count, not all of its voxels.
    std::array<std::uint64_t, 2> fingerprint() const;

    /// The tiles that volumes may touch, sorted; other tiles are the heightfield alone.
    std::span<const VolumeTileKey> tiles() const;
    /// Indices of the operations that may touch a tile, ascending; empty for other tiles. Cost: O(log tiles)
    std::span<const std::uint32_t> operations_at(const VolumeTileKey& key) const;
    /// The parts of these operations over the tile, in the same order.
    std::span<const VolumeTilePart> parts_at(const VolumeTileKey& key) const;

private:
    struct State;
    explicit Volumes(std::shared_ptr<const State> state) : state_(std::move(state)) {}
    std::shared_ptr<const State> state_;
};

/// The level of a lattice whose spacing is nearest to a wanted voxel, on a scale of ratios. Requires voxel > 0.
int pinned_level(const Lattice& lattice, double voxel);

}  // namespace terrane
