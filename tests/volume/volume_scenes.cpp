// SPDX-License-Identifier: MIT
#include "volume/volume_scenes.h"

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

namespace {

VolumeWorld random_world(Random& random, double spacing) {
    const double slope_x = random.between(-1.0, 1.0), slope_y = random.between(-1.0, 1.0);
    const double steep = random.between(1.0, 10.0), noise = random.between(0.0, 2.0) * spacing;
    const int kind = random.below(6), middle = 128 + random.below(9) - 4;
    Random grain(random.bits());
    return VolumeWorld::make(2, spacing, [&](int column, int row) {
        const double x = column - 128, y = row - 64;
        switch (kind) {
            case 0:
                return 20.0;  // flat, through nodes
            case 1:
                return 20.0 + spacing * (slope_x * x + slope_y * y);
            case 2:
                return spacing * steep * (slope_x * x + slope_y * y) /
                       std::sqrt(slope_x * slope_x + slope_y * slope_y);
            case 3:
                return column < middle ? 20.0 : 20.0 + 8.0 * spacing;  // a cliff
            case 4:
                return 20.0 + grain.between(-1.0, 1.0) * noise;
            default:
                return 20.0 + spacing * (6.0 * slope_x * std::abs(x) + slope_y * y) +
                       grain.between(0.0, 1.0) * noise;
        }
    });
}

}  // namespace

RandomScene::RandomScene(std::uint64_t seed) {
    Random random(seed);
    const double spacing = random.below(2) == 0 ? 1.0 : 0.5 * random.between(0.7, 1.3);
    world = random_world(random, spacing);
    const int count = 1 + random.below(6);
    for (int i = 0; i < count; ++i) {
        const Eigen::Vector3d before =
            i > 0 ? operations.back().world_from_shape.translation : Eigen::Vector3d(0, 0, 0);
        VolumeOperation& operation = operations.emplace_back();
        operation.voxel = spacing;
        operation.op = random.below(3) == 0 ? VolumeOp::add : VolumeOp::remove;
        // Near the middle of the world, where two chunks meet: on a corner of tiles, at a node, or anywhere.
        Eigen::Vector3d at(128.0 * spacing, 64.0 * spacing, 0.0);
        const int where = random.below(4);
        if (where == 1) at.x() += random.below(41) - 20.0, at.y() += random.below(41) - 20.0;
        // Named, so that every compiler draws in the same order.
        const double off_x = random.between(-24.0, 24.0), off_y = random.between(-24.0, 24.0);
        if (where >= 2) at += spacing * Eigen::Vector3d(off_x, off_y, 0.0);
        double radius = spacing * random.between(0.8, 12.0);
        if (random.below(3) == 0) radius = spacing * std::floor(radius / spacing + 1.0);
        at.z() = world.height(at.x(), at.y());
        switch (random.below(5)) {
            case 0:
                break;  // half in the ground
            case 1:
                at.z() += radius;
                break;  // tangential from above
            case 2:
                at.z() -= radius;
                break;  // and from below
            case 3:
                at.z() += spacing * random.between(-30.0, 30.0);
                break;
            default:
                at.z() += spacing * (random.below(13) - 6.0);
                break;
        }
        if (i > 0 && random.below(3) == 0) {  // concentric, or touching
            at = before;
            if (random.below(2) == 0) at.x() += 2.0 * radius;
        }
        operation.world_from_shape.translation = at;
        if (random.below(2) == 0) operation.world_from_shape.rotation = random.rotation();
        switch (random.below(4)) {
            case 0:
                operation.shape.emplace<VolumeSphere>(VolumeSphere{radius});
                break;
            case 1:
                operation.shape.emplace<VolumeCapsule>(
                    VolumeCapsule{radius, spacing * random.between(0.0, 12.0)});
                break;
            case 2: {
                const double width = spacing * random.between(0.6, 12.0);
                const double height = spacing * (1.0 + random.below(9));
                operation.shape.emplace<VolumeBox>(VolumeBox{{radius, width, height}});
            } break;
            default: {
                auto& tube = operation.shape.emplace<VolumeTube>();
                tube.radius = std::max(0.6 * spacing, 0.3 * radius);
                for (int p = 2 + random.below(4); p > 0; --p) {
                    const double length = spacing * random.between(0.0, 25.0);
                    tube.path_shape.push_back(length * random.direction());
                }
            }
        }
    }
}

}  // namespace terrane::test
