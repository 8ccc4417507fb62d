// SPDX-License-Identifier: MIT
#pragma once

#include "volume/joined_mesh.h"

#include <terrane/volume/volumes.h>

#include <string>
#include <utility>

namespace terrane::test {

/// One chunk at 1 m, flat at 40 m.
inline VolumeWorld flat_world() {
    return VolumeWorld::make(1, 1.0, [](int, int) { return 40.0; });
}

/// An operation with voxels of 1 m, at a place.
inline VolumeOperation place(VolumeOp op, VolumeShape shape, const Eigen::Vector3d& at) {
    VolumeOperation operation{.op = op, .shape = std::move(shape), .voxel = 1.0};
    operation.world_from_shape.translation = at;
    return operation;
}
inline VolumeOperation place(VolumeShape shape, const Eigen::Vector3d& at) {
    return place(VolumeOp::remove, std::move(shape), at);
}

/// Why the flat world refuses an operation; empty if it does not.
inline std::string refusal(const VolumeOperation& operation, const VolumeSettings& settings = {}) {
    const auto placed = PlacedVolume::create(flat_world().lattice, 0, operation, settings);
    return placed ? "" : placed.error().message;
}

}  // namespace terrane::test
