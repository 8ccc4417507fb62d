// SPDX-License-Identifier: MIT
// The level set of a closed mesh, by openvdb::tools::meshToVolume. That function ignores shells inside of others
// (OpenVDB 10), so that each layer of nested_shells() gets a level set of its own. As the surfaces do not cross, the
// maximum of one distance and the negative of another is the distance to the nearer surface.
#include "level_set/sampled_grid.h"
#include "level_set/shapes.h"

#include <terrane/base/text.h>

#include <openvdb/tools/Composite.h>
#include <openvdb/tools/MeshToVolume.h>

#include <exception>

namespace terrane::internal {
namespace {

constexpr float kBandVoxels = 4.0f;
// Bytes of the level set per voxel of its band: includes half-filled leaves and the temporary memory of the conversion.
constexpr double kBytesOfVoxel = 24.0;

}  // namespace

Result<std::shared_ptr<const SampledShape>> SampledShape::of_mesh(const VolumeMesh& mesh,
                                                                  const Pose& world_from_shape,
                                                                  double voxel,
                                                                  const VolumeSettings& settings) {
    TERRANE_TRY(check_closed(mesh));
    TERRANE_TRY(const auto layers, nested_shells(mesh));
    const auto too_large = [&](double bytes) {
        return fail(ErrorCode::out_of_memory,
                    "the level set of the mesh needs about " + number_text(bytes) +
                        " bytes, more than memory_bytes, " + number_text(settings.memory_bytes));
    };
    const auto most = static_cast<double>(settings.memory_bytes);
    const double band_voxels = surface_area(mesh) / (voxel * voxel) * double{2.0f * kBandVoxels};
    if (band_voxels * kBytesOfVoxel > most) return too_large(band_voxels * kBytesOfVoxel);
    initialize_openvdb();
    std::vector<openvdb::Vec3s> points;
    points.reserve(mesh.points_shape.size());
    for (const Eigen::Vector3d& p_shape : mesh.points_shape) {
        const Eigen::Vector3d offset = rotated(world_from_shape.rotation, p_shape);
        points.emplace_back(static_cast<float>(offset[0] / voxel),
                            static_cast<float>(offset[1] / voxel),
                            static_cast<float>(offset[2] / voxel));
    }
    const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    const auto level_set_of = [&](const std::vector<std::array<std::uint32_t, 3>>& layer) {
        std::vector<openvdb::Vec3I> triangles;
        triangles.reserve(layer.size());
        for (const auto& triangle : layer)
            triangles.emplace_back(triangle[0], triangle[1], triangle[2]);
        const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(
            points, triangles);
        return openvdb::tools::meshToVolume<openvdb::FloatGrid>(adapter, *transform, kBandVoxels,
                                                                kBandVoxels);
    };
    try {
        auto grid = level_set_of(layers.front());
        for (std::size_t depth = 1; depth < layers.size(); ++depth) {
            auto inner = level_set_of(layers[depth]);
            if (depth % 2 == 1) {
                openvdb::tools::csgDifference(*grid, *inner);
            } else {
                openvdb::tools::csgUnion(*grid, *inner);
            }
        }
        // With thin triangles the estimate by area is too low, because the band also surrounds their edges.
        const auto bytes = static_cast<double>(grid->memUsage());
        if (bytes > most) return too_large(bytes);
        const double band = double{grid->background()};
        return std::make_shared<const SampledShape>(std::make_unique<Grid>(
            Grid{std::move(grid), Eigen::Matrix3d::Identity() / voxel, world_from_shape.translation,
                 Eigen::Vector3d::Zero(), voxel, band}));
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        return fail(ErrorCode::bad_data,
                    std::string("OpenVDB cannot convert the mesh: ") + error.what());
    }
}

}  // namespace terrane::internal
