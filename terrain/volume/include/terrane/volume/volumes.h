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

/// Cells along the side of a volume tile; divides the 128 cells of a chunk.
inline constexpr int kVolumeTileCells = 32;
inline constexpr int kVolumeTileSamples = kVolumeTileCells + 1;  ///< samples along a tile's side

/// Index of a tile, 32 x 32 cells of the pinned level, counted in tiles from lattice point (0, 0).
struct VolumeTileKey {
    std::int64_t column = 0;  ///< grows east
    std::int64_t row = 0;     ///< grows north
    friend constexpr auto operator<=>(const VolumeTileKey&, const VolumeTileKey&) = default;
};

/// The part of a volume over one tile that the volume may touch.
struct VolumeTilePart {
    VolumeTileKey key;       ///< the tile
    HeightInterval heights;  ///< interval of world z that encloses the part, metres
    double area = 0.0;       ///< total surface area of the boxes around its pieces, m^2
};

/// Settings of sampled level sets.
struct VolumeSettings {
    /// Memory limit of the level set of one mesh or file, bytes. Checked by an estimate before the level set is made,
    /// and by its size afterwards.
    std::size_t memory_bytes = std::size_t{1} << 30;
    /// The level whose spacing is the distance between samples; absent: chosen from the voxels, see Volumes.
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
    /// Fails: invalid_argument as validate(), for a level out of range, and for a shape that is thinner than the
    ///        spacing, lies outside the world's rectangle or beyond 2^28 spacings from height 0, or whose pieces cover
    ///        more than 2^22 tiles; bad_data for a mesh that is open, intersects itself or is inside out, and for a
    ///        file without a float level set, or with non-cubic voxels, a band narrower than two spacings or values
    ///        that are not signed distances; io for a file that cannot be read; out_of_memory for a level set larger
    ///        than VolumeSettings::memory_bytes
    /// Cost:  O(tiles). For a mesh also O(n log n + p), with n triangles and p pairs of triangles whose boxes overlap
    ///        (all pairs for a fan), and the conversion to a level set on OpenVDB's threads.
    static Result<PlacedVolume> create(const Lattice& lattice, int level,
                                       const VolumeOperation& operation,
                                       const VolumeSettings& settings = {});

    /// Whether the shape is removed or added.
    VolumeOp op() const { return op_; }
    /// Bounding box of the shape; for meshes and files, of the band of their level set.
    const Aabb& bounds_world() const;
    /// Tiles of the world that the shape, widened by three spacings, may touch; sorted by key.
    std::vector<VolumeTilePart> tiles() const;
    /// Bytes of its level set or list of capsules.
    std::size_t bytes() const;
    /// Signed distance as stored in level sets, metres, negative inside. For meshes and files interpolated between
    /// samples and limited to the band. Inside a tube with bends it is a lower bound of the depth.
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
/// The *state* of a point is set by the last operation whose shape contains it: void by `remove`, solid by `add`;
/// natural if there is none. The *joined solid* is every point on or below the heightfield that is not void, and
/// every point above it that is solid.
///
/// Volumes are contoured at one level of the terrain, the *pinned level*: by default the one whose spacing is nearest,
/// as a ratio, to the finest requested voxel; VolumeSettings::level overrides it. The contours use the heightfield's
/// samples of that level.
///
/// Immutable, cheap to copy. Threads: any number.
class Volumes {
public:
    Volumes() = delete;

    /// An empty list needs VolumeSettings::level; it is for ground that is only edited at run time (VolumeEditor).
    ///
    /// Fails: as PlacedVolume::create(), naming the operation by its index; invalid_argument for an empty list without
    ///        a level, or a lattice out of range
    /// Cost:  creates the placed volumes, and O(tiles that they touch)
    static Result<Volumes> create(const Lattice& lattice,
                                  std::span<const VolumeOperation> operations,
                                  const VolumeSettings& settings = {});

    /// Lattice of the terrain.
    const Lattice& lattice() const;
    /// The pinned level.
    int level() const;
    /// Spacing of the pinned level, metres.
    double spacing() const;
    /// The operations in their order.
    std::span<const PlacedVolume> operations() const;

    /// 128-bit hash of lattice, level and operations; saved edits are valid only for volumes with the same hash. A
    /// VolumeFile contributes its path, its grid name and the size of its level set, but not its voxels.
    std::array<std::uint64_t, 2> fingerprint() const;

    /// The tiles that volumes may touch, sorted; over other tiles the ground is the heightfield alone.
    std::span<const VolumeTileKey> tiles() const;
    /// Indices of the operations that may touch a tile, ascending; empty for other tiles. Cost: O(log tiles)
    std::span<const std::uint32_t> operations_at(const VolumeTileKey& key) const;
    /// The parts of the operations in operations_at() over the tile, in the same order.
    std::span<const VolumeTilePart> parts_at(const VolumeTileKey& key) const;

private:
    struct State;
    explicit Volumes(std::shared_ptr<const State> state) : state_(std::move(state)) {}
    std::shared_ptr<const State> state_;
};

/// The level of a lattice whose spacing is nearest, as a ratio, to a requested voxel. Requires voxel > 0.
int pinned_level(const Lattice& lattice, double voxel);

}  // namespace terrane
