// SPDX-License-Identifier: MIT
#include "level_set/sampled_shape.h"

#include "level_set/sampled_grid.h"

#include <openvdb/tree/ValueAccessor.h>

#include <cmath>

namespace terrane::internal {

void initialize_openvdb() { openvdb::initialize(); }

SampledShape::SampledShape(std::unique_ptr<Grid> grid) : grid_(std::move(grid)) {
    const openvdb::CoordBBox box = grid_->grid->evalActiveVoxelBoundingBox();
    if (box.empty()) return;
    const Eigen::Vector3i first(box.min().x(), box.min().y(), box.min().z());
    const Eigen::Vector3i last(box.max().x(), box.max().y(), box.max().z());
    const Eigen::Matrix3d offset_from_index = grid_->index_from_offset.inverse();
    for (int corner = 0; corner < 8; ++corner) {
        Eigen::Vector3d index;
        for (int axis = 0; axis < 3; ++axis) {
            index[axis] = ((corner >> axis) & 1) != 0 ? last[axis] + 1 : first[axis] - 1;
        }
        include(grid_->origin_world + rotated(offset_from_index, index - grid_->index_of_origin),
                0.0, bounds_);
    }
}

SampledShape::~SampledShape() = default;

std::size_t SampledShape::bytes() const { return grid_->grid->memUsage(); }

struct SampledShape::Reader::Accessor {
    openvdb::FloatGrid::ConstAccessor values;
};

SampledShape::Reader::Reader(const SampledShape& shape)
    : grid_(shape.grid_.get()),
      accessor_(std::make_unique<Accessor>(Accessor{shape.grid_->grid->getConstAccessor()})) {}

SampledShape::Reader::~Reader() = default;

double SampledShape::Reader::band() const { return grid_->band; }
double SampledShape::Reader::voxel() const { return grid_->voxel; }

double SampledShape::Reader::signed_distance(const Eigen::Vector3d& p_world) {
    const Eigen::Vector3d index =
        rotated(grid_->index_from_offset, p_world - grid_->origin_world) + grid_->index_of_origin;
    // Outside the range of coordinates there is only background.
    for (int axis = 0; axis < 3; ++axis) {
        if (!(std::abs(index[axis]) < 0x1p30)) return grid_->band;
    }
    const Eigen::Vector3d floor(std::floor(index[0]), std::floor(index[1]), std::floor(index[2]));
    const openvdb::Coord low(static_cast<int>(floor[0]), static_cast<int>(floor[1]),
                             static_cast<int>(floor[2]));
    const double u = index[0] - floor[0], v = index[1] - floor[1], w = index[2] - floor[2];
    double along_z[2];
    for (int dz = 0; dz < 2; ++dz) {
        double along_y[2];
        for (int dy = 0; dy < 2; ++dy) {
            const double a = double{accessor_->values.getValue(low.offsetBy(0, dy, dz))};
            const double b = double{accessor_->values.getValue(low.offsetBy(1, dy, dz))};
            along_y[dy] = a + (b - a) * u;
        }
        along_z[dz] = along_y[0] + (along_y[1] - along_y[0]) * v;
    }
    return along_z[0] + (along_z[1] - along_z[0]) * w;
}

bool SampledShape::Reader::is_near(const Eigen::Vector3d& centre_world,
                                   const Eigen::Vector3d& half_extents) {
    const Eigen::Matrix3d& m = grid_->index_from_offset;
    const Eigen::Vector3d centre =
        rotated(m, centre_world - grid_->origin_world) + grid_->index_of_origin;
    Eigen::Vector3i low, high;
    for (int axis = 0; axis < 3; ++axis) {
        const double half = std::abs(m(axis, 0)) * half_extents[0] +
                            std::abs(m(axis, 1)) * half_extents[1] +
                            std::abs(m(axis, 2)) * half_extents[2];
        if (!(std::abs(centre[axis]) + half < 0x1p30)) return false;
        low[axis] = static_cast<int>(std::floor(centre[axis] - half)) >> 3;
        high[axis] = static_cast<int>(std::floor(centre[axis] + half) + 1.0) >> 3;
    }
    // Interpolation reads the corners of a cell; leaves are 8 voxels wide.
    for (int x = low[0]; x <= high[0]; ++x) {
        for (int y = low[1]; y <= high[1]; ++y) {
            for (int z = low[2]; z <= high[2]; ++z) {
                if (accessor_->values.probeConstLeaf(openvdb::Coord(8 * x, 8 * y, 8 * z)) !=
                    nullptr)
                    return true;
            }
        }
    }
    return false;
}

}  // namespace terrane::internal
