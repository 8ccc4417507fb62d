// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/lattice.h>
#include <terrane/volume/volume_shapes.h>

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane {

namespace internal {
class PlacedShape;
}

/// Cells along the side of a volume tile, and samples: it divides the 128 cells of a chunk.
inline constexpr int kVolumeTileCells = 32;
inline constexpr int kVolumeTileSamples = kVolumeTileCells + 1;  ///< along the side of a tile

/// Names a square of 32 x 32 cells of the pinned level, counted in such squares from lattice point (0, 0).
struct VolumeTileKey {
    std::int64_t column = 0;  ///< grows east
    std::int64_t row = 0;     ///< grows north
    friend constexpr auto operator<=>(const VolumeTileKey&, const VolumeTileKey&) = default;
};

/// A tile that a volume may touch.
struct VolumeTilePart {
    VolumeTileKey key;       ///< the tile
    HeightInterval heights;  ///< encloses the part of the shape over it, world z, metres
    double area = 0.0;       ///< of the surfaces of the boxes around its pieces there, m^2
};

/// Limits of level sets that are sampled.
struct VolumeSettings {
    /// Most bytes of the level set of one mesh or file. What its size says needs more is refused before it is made,
    /// what turns out to need more afterwards.
    std::size_t memory_bytes = std::size_t{1} << 30;
    /// The level whose spacing is the distance between samples; none: see Volumes.
    std::optional<int> level = std::nullopt;
};

/// An operation, checked and prepared for one level of a terrain: exact distances of a sphere, capsule, box or tube, or
/// the level set of a mesh or file. Immutable, cheap to copy.
///
/// Threads: any number
class PlacedVolume {
public:
    PlacedVolume() = delete;

    /// @param lattice of the terrain
    /// @param level   the pinned level, 0 to the finest; its spacing is the distance between samples
    ///
    /// Fails: invalid_argument as check(), and for a shape that is thinner than the spacing, that lies outside the
    ///        world's rectangle or beyond 2^28 spacings from height 0, or whose pieces cover more than 2^22 tiles;
    ///        bad_data for a mesh that is open, crosses itself or is inside out, and for a file that holds no level
    ///        set of floats with cubic voxels, a band of at least two spacings on both sides and true distances;
    ///        io for a file that cannot be read; out_of_memory for a level set of more than
    ///        VolumeSettings::memory_bytes
    /// Cost:  O(tiles); of a mesh also O(triangles log triangles + pairs of triangles whose boxes overlap, which
    ///        are all pairs of a fan), and its level set by OpenVDB's threads
    static Result<PlacedVolume> create(const Lattice& lattice, int level,
                                       const VolumeOperation& operation,
                                       const VolumeSettings& settings = {});

    /// Whether it is removed or added.
    VolumeOp op() const { return op_; }
    /// Box around the shape; of meshes and files, around the band of their level set.
    const Aabb& bounds_world() const;
    /// Tiles of the world that the shape, widened by three spacings, may touch; sorted by key.
    std::vector<VolumeTilePart> tiles() const;
    /// Bytes of its level set or list of capsules.
    std::size_t bytes() const;
    /// Signed distance as the level sets get it, metres, negative inside; of meshes and files interpolated between
    /// their samples, and at most their band. Inside a tube that bends it is a lower bound of the depth.
    double signed_distance(const WorldPos& p_world) const;

    /// For Terrane's own sources.
    const internal::PlacedShape& shape() const { return *shape_; }

private:
    PlacedVolume(VolumeOp op, std::shared_ptr<const internal::PlacedShape> shape,
                 const Lattice& lattice, int level)
        : op_(op), level_(level), lattice_(lattice), shape_(std::move(shape)) {}

    VolumeOp op_;
    int level_;
    Lattice lattice_;
    std::shared_ptr<const internal::PlacedShape> shape_;
};

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
