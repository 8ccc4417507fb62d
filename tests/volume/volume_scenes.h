// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.h"
#include "volume/joined_mesh.h"

#include <terrane/volume/volume_shapes.h>
#include <terrane/volume/volumes.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace terrane::test {

/// The joined solid by formulas that share nothing with the library: an oracle. Spheres, capsules, boxes and tubes.
class AnalyticSolid {
public:
    enum class State { natural, in_void, in_solid };

    /// @param height of the heightfield's triangles at x, y
    AnalyticSolid(std::vector<VolumeOperation> operations,
                  std::function<double(double, double)> height)
        : operations_(std::move(operations)), height_(std::move(height)) {}

    static double distance(const VolumeOperation& operation, const Eigen::Vector3d& p_world);

    State state(const Eigen::Vector3d& p_world) const;
    bool is_solid(const Eigen::Vector3d& p_world) const {
        const State s = state(p_world);
        return p_world.z() <= height_(p_world.x(), p_world.y()) ? s != State::in_void
                                                                : s == State::in_solid;
    }
    /// Least distance to the surface of any shape.
    double distance_to_shapes(const Eigen::Vector3d& p_world) const;
    /// The ordered composition of distances, negative where void (or solid).
    double to_void(const Eigen::Vector3d& p_world) const {
        return composed(p_world, VolumeOp::remove);
    }
    double to_solid(const Eigen::Vector3d& p_world) const {
        return composed(p_world, VolumeOp::add);
    }
    const std::vector<VolumeOperation>& operations() const { return operations_; }
    double height(double x, double y) const { return height_(x, y); }

private:
    double composed(const Eigen::Vector3d& p_world, VolumeOp op) const;

    std::vector<VolumeOperation> operations_;
    std::function<double(double, double)> height_;
};

/// A world and operations that are likely to find faults: flat ground, slopes up to 10, noise; volumes on borders and
/// corners of tiles and chunks, tangential to the ground, nested, touching, through nodes.
struct RandomScene {
    VolumeWorld world;
    std::vector<VolumeOperation> operations;

    explicit RandomScene(std::uint64_t seed);
};

/// One chunk at 1 m, flat at 40 m.
inline VolumeWorld flat_world() {
    return VolumeWorld::make(1, 1.0, [](int, int) { return 40.0; });
}

/// An operation with voxels of 1 m, at a place.
inline VolumeOperation place(VolumeOp op, VolumeShape shape, const Eigen::Vector3d& at) {
    VolumeOperation operation{
        .op = op, .shape = std::move(shape), .world_from_shape = {.translation = at}, .voxel = 1.0};
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
