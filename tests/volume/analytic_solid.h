// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/volume/volume_shapes.h>

#include <functional>
#include <limits>
#include <span>
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

}  // namespace terrane::test
