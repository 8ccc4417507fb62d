// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/composed_heights.h>
#include <terrane/volume/volumes.h>

#include <cstddef>
#include <memory>
#include <stop_token>

namespace terrane {

namespace internal {
class EditedVolumes;
}  // namespace internal

/// A heightfield with volumes, as the source of a pager. Heights, samples and bounds are those of the heightfield. A
/// chunk of the finest level has a Chunk::solid if volumes touch it.
///
/// Volumes are contoured at the terrain's finest level, which is also the contact level: the surface drawn near the eye
/// is the one that bodies touch. A VolumeEditor may dig and fill while other threads read.
///
/// Threads: any number, as HeightSource, while one VolumeEditor changes it
class VolumeHeights final : public ForwardedHeights {
public:
    /// @param heights the heightfield, on the lattice of the volumes
    ///
    /// Fails: invalid_argument for volumes on another lattice or at another level than the finest, and for heights that
    ///        are not certified (HeightSource::is_certified())
    /// Cost:  O(tiles that volumes touch * levels)
    static Result<std::shared_ptr<VolumeHeights>> create(
        std::shared_ptr<const HeightSource> heights, const Volumes& volumes);
    ~VolumeHeights() override;

    /// The volumes without edits. heights() is the heightfield.
    const Volumes& volumes() const { return volumes_; }

    /// Includes the surfaces of volumes.
    HeightInterval interval(const WorldRect& rect) const override;
    /// Makes the chunks of the finest level that volumes touch; gets others from the heightfield.
    Result<std::shared_ptr<const Chunk>> stored_chunk(const ChunkKey& key,
                                                      const std::stop_token& stop) const override;
    std::optional<SolidExtent> solid_extent(const ChunkKey& key) const override;
    /// Whether a point is inside a volume or within a quarter of the finest spacing of one. Digs and fills at run time
    /// are ignored.
    bool is_in_volume(double x, double y, double z) const override;
    /// The size of the chunk when it was last made, if it has edits. Otherwise an estimate from the area of the
    /// volumes' surfaces, but at least that size.
    std::size_t max_chunk_bytes(const ChunkKey& key) const override;
    /// Whether the chunk was made after the last change in force that touches it.
    bool is_current(const Chunk& chunk) const override;

    /// For Terrane's own sources.
    internal::EditedVolumes& edited() { return *edited_; }

private:
    VolumeHeights(std::shared_ptr<const HeightSource> heights, const Volumes& volumes);

    Volumes volumes_;
    std::unique_ptr<internal::EditedVolumes> edited_;
};

}  // namespace terrane
