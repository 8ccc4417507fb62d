// SPDX-License-Identifier: MIT
#pragma once

#include "base/aabb_tree.h"

#include <terrane/volume/volumes.h>

#include <cstdint>
#include <iosfwd>
#include <memory>
#include <optional>

namespace terrane::internal {

/// A level set of OpenVDB as a shape: signed distances at the points of its own grid, interpolated trilinearly.
/// Immutable.
///
/// Threads: any number
class SampledShape {
public:
    struct Grid;  // of OpenVDB

    /// The level set of a closed mesh with voxels of a given size and a band of four of them on both sides.
    ///
    /// Fails: as PlacedVolume::create() for meshes
    static Result<std::shared_ptr<const SampledShape>> of_mesh(const VolumeMesh& mesh,
                                                               const Pose& world_from_shape,
                                                               double voxel,
                                                               const VolumeSettings& settings);
    /// A level set of a file, for nodes that are `spacing` apart.
    ///
    /// Fails: as PlacedVolume::create() for files
    static Result<std::shared_ptr<const SampledShape>> of_file(const VolumeFile& file,
                                                               const Pose& world_from_shape,
                                                               double spacing,
                                                               const VolumeSettings& settings);

    explicit SampledShape(std::unique_ptr<Grid> grid);
    ~SampledShape();

    /// Of its band, world, metres.
    const Aabb& bounds() const { return bounds_; }
    std::size_t bytes() const;

    /// Reads many distances. The shape outlives it. Threads: one.
    class Reader {
    public:
        explicit Reader(const SampledShape& shape);
        ~Reader();
        Reader(const Reader&) = delete;
        Reader& operator=(const Reader&) = delete;

        /// Metres, at most the band.
        double signed_distance(const Eigen::Vector3d& p_world);
        /// Whether a box along the world's axes may have points within the band.
        bool is_near(const Eigen::Vector3d& centre_world, const Eigen::Vector3d& half_extents);
        /// Half width of the band, metres.
        double band() const;
        /// Side of its voxels, metres.
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

/// Whether a `.vdb` file says where its grids lie: written by openvdb::io::File, not by openvdb::io::Stream.
enum class VdbOffsets { absent, present };

/// Checks the lengths in a `.vdb` file's header and in its grids' descriptors and metadata. OpenVDB allocates and
/// clears as many bytes as each says, up to 4 GB, before it finds that the file is shorter. Not checked: files before
/// format 222 (2013), and all but the first grid where the file does not say where they lie.
///
/// @param in    at the start of the file
/// @param bytes of the file
/// @return      nothing where a length does not fit in the file
std::optional<VdbOffsets> check_vdb_lengths(std::istream& in, std::uint64_t bytes);

}  // namespace terrane::internal
