// SPDX-License-Identifier: MIT
#pragma once

#include "support/grounds.h"

#include <terrane/volume/volume_tile.h>

#include <utility>
#include <vector>

namespace terrane::test {

/// A volume with 1 m voxels at a position.
inline VolumeOperation place_volume(VolumeOp op, VolumeShape shape, const Eigen::Vector3d& at,
                                    const Eigen::Matrix3d& rotation = Eigen::Matrix3d::Identity()) {
    VolumeOperation operation{
        .op = op, .shape = std::move(shape), .world_from_shape = {rotation, at}, .voxel = 1.0};
    return operation;
}

/// Ground with 1 m cells and the solid surfaces of volumes.
inline Ground make_volume_ground(std::function<double(double, double)> height,
                                 std::vector<VolumeOperation> operations, int roots = 1) {
    TableGroundSettings settings{.roots = roots};
    Lattice lattice{.quantum = settings.quantum};
    lattice.root_count_x = lattice.root_count_y = roots;
    const Volumes volumes = Volumes::create(lattice, operations).value();
    settings.solid = [&](const Chunk& chunk) { return make_chunk_solid(volumes, chunk).value(); };
    return make_test_ground(std::move(height), settings);
}

}  // namespace terrane::test
