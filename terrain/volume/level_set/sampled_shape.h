// SPDX-License-Identifier: MIT
#pragma once

#include "base/aabb_tree.h"

#include <terrane/volume/volumes.h>

#include <cstdint>
#include <iosfwd>
#include <memory>
#include <optional>

namespace terrane::internal {

/// An OpenVDB level set as a shape: signed distances at the nodes of its own grid, interpolated trilinearly. Immutable.
///
/// Threads: any number
class SampledShape {
public:
    struct Grid;  // of OpenVDB

    /// The level set of a closed mesh for a given voxel, with a band of four voxels on both sides.
    ///
    /// Fails: as PlacedVolume::create() for meshes
    static Result<std::shared_ptr<const SampledShape>> of_mesh(const VolumeMesh& mesh,
                                                               const Pose& world_from_shape,
                                                               double voxel,
                                                               const VolumeSettings& settings);
    /// The level set in a file, for a terrain level whose samples are `spacing` apart.
    ///
    /// Fails: as PlacedVolume::create() for files
    static Result<std::shared_ptr<const SampledShape>> of_file(const VolumeFile& file,
                                                               const Pose& world_from_shape,
                                                               double spacing,
                                                               const VolumeSettings& settings);

    explicit SampledShape(std::unique_ptr<Grid> grid);
    ~SampledShape();

    /// Bounding box of the band, world, metres.
    const Aabb& bounds() const { return bounds_; }
    std::size_t bytes() const;

    /// Cached access for many distances. The shape must outlive it. Threads: one.
    class Reader {
    public:
        explicit Reader(const SampledShape& shape);
        ~Reader();
        Reader(const Reader&) = delete;
        Reader& operator=(const Reader&) = delete;

        /// Metres, limited to the band.
        double signed_distance(const Eigen::Vector3d& p_world);
        /// Whether an axis-aligned box in the world may have points within the band.
        bool is_near(const Eigen::Vector3d& centre_world, const Eigen::Vector3d& half_extents);
        /// Half width of the band, metres.
        double band() const;
        /// Side of a voxel, metres.
        double voxel() const;

    private:
        struct Accessor;
        const Grid* grid_;
        std::unique_ptr<Accessor> accessor_;
    };

private:
    std::unique_ptr<Grid> grid_;
    Aabb bounds_ = empty_box();
};

/// Whether a `.vdb` file stores the offsets of its grids: openvdb::io::File writes them, openvdb::io::Stream does not.
enum class VdbOffsets { absent, present };

/// Checks the lengths in a `.vdb` file's header and in its grids' descriptors and metadata: OpenVDB allocates and
/// clears as many bytes as a length states, up to 4 GB, before it notices that the file is shorter. Files before format
/// 222 (2013) are not checked, nor are the grids after the first in a file without offsets.
///
/// @param in    at the start of the file
/// @param bytes size of the file
/// @return      absent if a length exceeds the file
std::optional<VdbOffsets> check_vdb_lengths(std::istream& in, std::uint64_t bytes);

}  // namespace terrane::internal
