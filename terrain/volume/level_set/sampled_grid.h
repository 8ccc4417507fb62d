// SPDX-License-Identifier: MIT
#pragma once

#include "level_set/sampled_shape.h"

#include <openvdb/Grid.h>
#include <openvdb/openvdb.h>

namespace terrane::internal {

/// A grid and its pose: index = index_from_offset * (p_world - origin_world) + index_of_origin.
struct SampledShape::Grid {
    openvdb::FloatGrid::Ptr grid;
    Eigen::Matrix3d index_from_offset;
    Eigen::Vector3d origin_world, index_of_origin;
    double voxel = 1.0;  // metres
    double band = 3.0;   // metres
};

/// Registers OpenVDB's types, once.
void initialize_openvdb();

}  // namespace terrane::internal
