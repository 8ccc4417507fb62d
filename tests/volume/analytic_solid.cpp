// SPDX-License-Identifier: MIT
#include "volume/analytic_solid.h"

#include <algorithm>
#include <cmath>

namespace terrane::test {
namespace {

double to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    const double square = (b - a).squaredNorm();
    if (square == 0.0) return (p - a).norm();
    const double t = std::min(1.0, std::max(0.0, (p - a).dot(b - a) / square));
    return (p - ((1.0 - t) * a + t * b)).norm();
}

}  // namespace

double AnalyticSolid::distance(const VolumeOperation& operation, const Eigen::Vector3d& p_world) {
    const Pose& pose = operation.world_from_shape;
    const Eigen::Vector3d p = pose.rotation.transpose() * (p_world - pose.translation);
    if (const auto* sphere = std::get_if<VolumeSphere>(&operation.shape))
        return p.norm() - sphere->radius;
    if (const auto* capsule = std::get_if<VolumeCapsule>(&operation.shape)) {
        const Eigen::Vector3d end(0.0, 0.0, capsule->half_height);
        return to_segment(p, -end, end) - capsule->radius;
    }
    if (const auto* tube = std::get_if<VolumeTube>(&operation.shape)) {
        double least = (p - tube->path_shape[0]).norm();
        for (std::size_t i = 1; i < tube->path_shape.size(); ++i) {
            least = std::min(least, to_segment(p, tube->path_shape[i - 1], tube->path_shape[i]));
        }
        return least - tube->radius;
    }
    const Eigen::Array3d over =
        p.array().abs() - std::get<VolumeBox>(operation.shape).half_extents.array();
    if (over.maxCoeff() <= 0.0) return over.maxCoeff();
    return over.max(0.0).matrix().norm();
}

AnalyticSolid::State AnalyticSolid::state(const Eigen::Vector3d& p_world) const {
    for (std::size_t i = operations_.size(); i-- > 0;) {
        if (distance(operations_[i], p_world) > 0.0) continue;
        return operations_[i].op == VolumeOp::remove ? State::in_void : State::in_solid;
    }
    return State::natural;
}

double AnalyticSolid::distance_to_shapes(const Eigen::Vector3d& p_world) const {
    double least = std::numeric_limits<double>::infinity();
    for (const VolumeOperation& operation : operations_) {
        least = std::min(least, std::abs(distance(operation, p_world)));
    }
    return least;
}

double AnalyticSolid::composed(const Eigen::Vector3d& p_world, VolumeOp op) const {
    double value = 1e30;
    for (const VolumeOperation& operation : operations_) {
        const double d = distance(operation, p_world);
        value = operation.op == op ? std::min(value, d) : std::max(value, -d);
    }
    return value;
}

}  // namespace terrane::test
