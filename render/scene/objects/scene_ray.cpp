// SPDX-License-Identifier: MIT
#include "objects/scene_ray.h"

#include "base/aabb_tree.h"
#include "base/vector_math.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

Eigen::Vector3d to_double(float x, float y, float z) {
    return {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
}

// Whether a segment comes within a radius of a point.
bool is_near(const Eigen::Vector3d& from, const Eigen::Vector3d& displacement,
             const Eigen::Vector3d& centre, double radius) {
    const Eigen::Vector3d to_centre = centre - from;
    const double along =
        std::clamp(dot(to_centre, displacement) / dot(displacement, displacement), 0.0, 1.0);
    const Eigen::Vector3d gap = to_centre - along * displacement;
    return dot(gap, gap) <= radius * radius;
}

}  // namespace

std::optional<SceneHit> find_hit(const ClusterSet& clusters, std::span<const ObjectModel> models,
                                 const WorldPos& from_world, const WorldPos& to_world) {
    const Eigen::Vector3d displacement = to_world - from_world;
    if (!displacement.allFinite() || displacement == Eigen::Vector3d::Zero()) return std::nullopt;
    std::optional<SceneHit> first;
    clusters.visit([&](GroupId group, const ObjectCluster& cluster) {
        const std::optional<MeshRays>& rays = models[cluster.model].rays;
        if (!rays) return;
        const double limit = first ? first->fraction : 1.0;
        if (!(segment_entry(from_world, displacement, cluster.bounds_world,
                            static_cast<double>(cluster.most_radius) * 0x1p-20) <= limit))
            return;
        const Eigen::Vector3d from = from_world - cluster.origin_world;
        for (std::size_t i = 0; i < cluster.size(); ++i) {
            if (!is_near(from, displacement, to_double(cluster.x[i], cluster.y[i], cluster.z[i]),
                         static_cast<double>(cluster.radius[i])))
                continue;
            const ObjectInstance& instance = cluster.instances[i];
            const auto& [x, y, z] = instance.offset_eye;
            const Eigen::Matrix3d world_from_object = rotation_of(instance.rotation);
            const Eigen::Matrix3d object_from_world =
                world_from_object.transpose() / static_cast<double>(instance.scale);
            const Eigen::Vector3d start = object_from_world * (from - to_double(x, y, z));
            const std::optional<MeshHit> hit =
                rays->ray(start, start + object_from_world * displacement);
            if (!hit || (first && !(hit->fraction < first->fraction))) continue;
            first = SceneHit{.group = group,
                             .object = cluster.group_index[i],
                             .fraction = hit->fraction,
                             .point_world = from_world + hit->fraction * displacement,
                             .normal = world_from_object * hit->normal,
                             .triangle = hit->triangle};
        }
    });
    return first;
}

}  // namespace terrane::internal
