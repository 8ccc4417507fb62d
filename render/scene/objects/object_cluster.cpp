// SPDX-License-Identifier: MIT
#include "objects/object_cluster.h"

#include "base/aabb_tree.h"
#include "levels/log_scale.h"

#include <terrane/scene/bounds.h>

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

// Rounded up: offsets have been rounded to float.
float radius_in_float(double radius, double offset) {
    const double margin = radius * 0x1p-20 + offset * 0x1p-22;
    return static_cast<float>(radius + margin);
}

class ClusterMaker {
public:
    ClusterMaker(std::uint32_t model, const Aabb& bounds, std::span<const PlacedObject> objects)
        : model_(model), objects_(objects) {
        for (const PlacedObject& object : objects) {
            const Pose pose = {rotation_of(object.rotation), object.position_world};
            const OrientedBox box = transform(pose, static_cast<double>(object.scale), bounds);
            spheres_.push_back(bounding_sphere(box));
            boxes_.push_back(bounding_box(box));
        }
    }

    std::vector<ObjectCluster> make() {
        std::vector<std::uint32_t> order;
        std::vector<AabbNode> nodes;
        build_aabb_tree(boxes_, order, nodes);
        std::vector<ObjectCluster> clusters;
        std::size_t leaf = 0;
        for (std::size_t i = 0; i < nodes.size();) {
            const std::size_t leaves = (nodes[i].end - i + 1) / 2;
            if (leaves > kClusterObjects) {
                ++i;
                continue;
            }
            clusters.push_back(make_cluster(std::span(order).subspan(leaf, leaves)));
            clusters.back().bounds_world = nodes[i].bounds;
            leaf += leaves;
            i = nodes[i].end;
        }
        return clusters;
    }

private:
    ObjectCluster make_cluster(std::span<const std::uint32_t> items) const {
        ObjectCluster cluster;
        cluster.model = model_;
        cluster.origin_world = objects_[items[0]].position_world;
        for (const std::uint32_t item : items) {
            const PlacedObject& object = objects_[item];
            const Eigen::Vector3d centre = spheres_[item].centre - cluster.origin_world;
            cluster.x.push_back(static_cast<float>(centre.x()));
            cluster.y.push_back(static_cast<float>(centre.y()));
            cluster.z.push_back(static_cast<float>(centre.z()));
            cluster.radius.push_back(radius_in_float(spheres_[item].radius, centre.norm()));
            cluster.most_radius = std::max(cluster.most_radius, cluster.radius.back());
            cluster.group_index.push_back(item);
            cluster.log_scale.push_back(log2_of(object.scale));
            cluster.most_log_scale =
                cluster.size() == 1 ? cluster.log_scale.back()
                                    : std::max(cluster.most_log_scale, cluster.log_scale.back());
            const Eigen::Vector3f offset = to_local(object.position_world, cluster.origin_world);
            cluster.instances.push_back({.offset_eye = {offset.x(), offset.y(), offset.z()},
                                         .scale = object.scale,
                                         .rotation = object.rotation,
                                         .coverage = 1.0f,
                                         .tint = object.tint});
        }
        return cluster;
    }

    std::uint32_t model_;
    std::span<const PlacedObject> objects_;
    std::vector<BoundingSphere> spheres_;
    std::vector<Aabb> boxes_;
};

}  // namespace

Eigen::Matrix3d rotation_of(const std::array<float, 4>& quaternion) {
    const auto x = static_cast<double>(quaternion[0]), y = static_cast<double>(quaternion[1]);
    const auto z = static_cast<double>(quaternion[2]), w = static_cast<double>(quaternion[3]);
    const double s = 2.0 / (x * x + y * y + z * z + w * w);
    Eigen::Matrix3d rotation;
    rotation << 1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),
        s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x), s * (x * z - w * y),
        s * (y * z + w * x), 1.0 - s * (x * x + y * y);
    return rotation;
}

std::vector<ObjectCluster> make_clusters(std::uint32_t model, const Aabb& bounds,
                                         std::span<const PlacedObject> objects) {
    return ClusterMaker(model, bounds, objects).make();
}

}  // namespace terrane::internal
