// SPDX-License-Identifier: MIT
#include "objects/object_clusters.h"

#include "base/aabb_tree.h"
#include "objects/log_scale.h"

#include <terrane/base/result.h>
#include <terrane/scene/culling.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace terrane::internal {
namespace {

// The radius rounded up, to cover the rounding of offsets to float.
float radius_in_float(double radius, double offset) {
    const double margin = radius * 0x1p-20 + offset * 0x1p-22;
    return static_cast<float>(radius + margin);
}

class ClusterMaker {
public:
    ClusterMaker(std::uint32_t model, const Aabb& bounds, std::span<const PlacedObject> objects)
        : model_(model), objects_(objects) {
        for (const PlacedObject& object : objects) {
            const Pose pose = {rotation_of(object.rotation), object.position};
            const OrientedBox box = transform(pose, static_cast<double>(object.scale), bounds);
            spheres_.push_back(bounding_sphere(box));
            boxes_.push_back(bounding_box(box));
        }
    }

    std::vector<ObjectCluster> make() {
        std::vector<std::uint32_t> items(boxes_.size());
        std::iota(items.begin(), items.end(), 0u);
        if (!items.empty()) add_clusters(items);
        return std::move(clusters_);
    }

private:
    void add_clusters(std::span<std::uint32_t> items) {
        if (items.size() > kClusterObjects) {
            const std::size_t middle = split_into_halves(boxes_, items);
            add_clusters(items.first(middle));
            add_clusters(items.subspan(middle));
            return;
        }
        ObjectCluster& cluster = clusters_.emplace_back();
        cluster.model = model_;
        cluster.origin_world = objects_[*std::ranges::min_element(items)].position;
        reserve(items.size(), cluster);
        add_groups(items, cluster);
        cluster.bounds = cluster.groups[0].bounds;
        for (const ObjectCluster::Group& group : cluster.groups) {
            unite(group.bounds, cluster.bounds);
        }
    }

    void add_groups(std::span<std::uint32_t> items, ObjectCluster& cluster) const {
        if (items.size() > kGroupObjects) {
            const std::size_t middle = split_into_halves(boxes_, items);
            add_groups(items.first(middle), cluster);
            add_groups(items.subspan(middle), cluster);
            return;
        }
        std::ranges::sort(items);
        ObjectCluster::Group group;
        for (const std::uint32_t item : items) {
            add_object(item, cluster);
            const ObjectBounds bounds = {boxes_[item], cluster.log_scale.back(),
                                         cluster.radius.back()};
            if (item == items[0]) {
                group.bounds = bounds;
            } else {
                unite(bounds, group.bounds);
            }
        }
        group.end = static_cast<std::uint32_t>(cluster.size());
        cluster.groups.push_back(group);
    }

    static void unite(const ObjectBounds& with, ObjectBounds& bounds) {
        bounds.box_world.low = bounds.box_world.low.cwiseMin(with.box_world.low);
        bounds.box_world.high = bounds.box_world.high.cwiseMax(with.box_world.high);
        bounds.most_log_scale = std::max(bounds.most_log_scale, with.most_log_scale);
        bounds.most_radius = std::max(bounds.most_radius, with.most_radius);
    }

    static void reserve(std::size_t count, ObjectCluster& cluster) {
        for (std::vector<float>* each :
             {&cluster.x, &cluster.y, &cluster.z, &cluster.radius, &cluster.log_scale})
            each->reserve(count);
        cluster.object_index.reserve(count);
        cluster.instances.reserve(count);
    }

    void add_object(std::uint32_t item, ObjectCluster& cluster) const {
        const PlacedObject& object = objects_[item];
        const Eigen::Vector3d centre = spheres_[item].centre - cluster.origin_world;
        cluster.x.push_back(static_cast<float>(centre.x()));
        cluster.y.push_back(static_cast<float>(centre.y()));
        cluster.z.push_back(static_cast<float>(centre.z()));
        cluster.radius.push_back(radius_in_float(spheres_[item].radius, centre.norm()));
        cluster.object_index.push_back(item);
        cluster.log_scale.push_back(log2_of(object.scale));
        const Eigen::Vector3f offset = to_local(object.position, cluster.origin_world);
        cluster.instances.push_back({.offset_eye = {offset.x(), offset.y(), offset.z()},
                                     .scale = object.scale,
                                     .rotation = object.rotation,
                                     .coverage = 1.0f,
                                     .tint = object.tint});
    }

    std::uint32_t model_;
    std::span<const PlacedObject> objects_;
    std::vector<BoundingSphere> spheres_;
    std::vector<Aabb> boxes_;
    std::vector<ObjectCluster> clusters_;
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

void set_single(std::uint32_t model, const Aabb& bounds, const Pose& world_from_object,
                double scale, const std::array<float, 3>& tint, ObjectCluster& cluster_out) {
    const OrientedBox box = transform(world_from_object, scale, bounds);
    const BoundingSphere sphere = bounding_sphere(box);
    const Eigen::Vector3d centre = sphere.centre - world_from_object.translation;
    const Eigen::Quaterniond rotation(world_from_object.rotation);
    ObjectCluster& cluster = cluster_out;
    cluster.model = model;
    cluster.origin_world = world_from_object.translation;
    cluster.x.assign(1, static_cast<float>(centre.x()));
    cluster.y.assign(1, static_cast<float>(centre.y()));
    cluster.z.assign(1, static_cast<float>(centre.z()));
    cluster.radius.assign(1, radius_in_float(sphere.radius, centre.norm()));
    cluster.log_scale.assign(1, log2_of(static_cast<float>(scale)));
    cluster.bounds = {bounding_box(box), cluster.log_scale[0], cluster.radius[0]};
    cluster.groups.assign(1, {1, cluster.bounds});
    cluster.object_index.assign(1, 0);
    cluster.instances.assign(
        1, {.offset_eye = {0.0f, 0.0f, 0.0f},
            .scale = static_cast<float>(scale),
            .rotation = {static_cast<float>(rotation.x()), static_cast<float>(rotation.y()),
                         static_cast<float>(rotation.z()), static_cast<float>(rotation.w())},
            .coverage = 1.0f,
            .tint = tint});
}

std::vector<ObjectCluster> make_clusters(std::uint32_t model, const Aabb& bounds,
                                         std::span<const PlacedObject> objects) {
    return ClusterMaker(model, bounds, objects).make();
}

namespace {

// The hierarchy is rebuilt after more clusters than this, and more than an eighth of them, have changed.
constexpr std::size_t kLeastChanges = 64;

// The order of insertion does not depend on the hierarchy, so that frames do not depend on earlier changes.
void sort_by_insertion(std::vector<const ObjectCluster*>& clusters) {
    std::sort(clusters.begin(), clusters.end(),
              [](const ObjectCluster* a, const ObjectCluster* b) { return a->order < b->order; });
}

}  // namespace

void ClusterSet::add(NodeId node, std::vector<ObjectCluster> clusters) {
    const auto [place, is_new] = nodes_.emplace(node, std::move(clusters));
    TERRANE_ASSERT(is_new, "a node is added once");
    for (ObjectCluster& cluster : place->second) {
        cluster.order = ++last_order_;
        object_count_ += cluster.size();
        beside_.push_back(&cluster);
    }
}

void ClusterSet::remove(NodeId node) {
    const auto found = nodes_.find(node);
    if (found == nodes_.end()) return;
    for (const ObjectCluster& cluster : found->second) {
        object_count_ -= cluster.size();
        if (std::erase(beside_, &cluster) > 0) continue;
        in_tree_[cluster.tree_index] = nullptr;
        ++gone_;
    }
    nodes_.erase(found);
}

void ClusterSet::rebuild() {
    if (gone_ + beside_.size() <= std::max(kLeastChanges, in_tree_.size() / 8)) return;
    in_tree_.clear();
    beside_.clear();
    gone_ = 0;
    std::vector<Aabb> boxes;
    for (auto& [id, clusters] : nodes_) {
        for (ObjectCluster& cluster : clusters) {
            cluster.tree_index = in_tree_.size();
            in_tree_.push_back(&cluster);
            boxes.push_back(cluster.bounds.box_world);
        }
    }
    tree_.emplace(boxes);
}

void ClusterSet::cull(const ViewVolume& volume, CullTest test,
                      std::vector<const ObjectCluster*>& visible_out) {
    rebuild();
    visible_out.clear();
    if (tree_) {
        tree_->cull(volume, test, memory_, visible_);
        for (const std::uint32_t index : visible_) {
            if (in_tree_[index] != nullptr) visible_out.push_back(in_tree_[index]);
        }
    }
    for (const ObjectCluster* cluster : beside_) {
        PlaneState all;
        if (volume.test_planes(cluster->bounds.box_world, all) == Containment::outside) continue;
        if (test == CullTest::planes || volume.meets(cluster->bounds.box_world))
            visible_out.push_back(cluster);
    }
    sort_by_insertion(visible_out);
}

void ClusterSet::find_casters(const CasterVolume& volume,
                              std::vector<const ObjectCluster*>& casters_out) {
    casters_out.clear();
    if (tree_) {
        tree_->find_casters(volume, visible_);
        for (const std::uint32_t index : visible_) {
            if (in_tree_[index] != nullptr) casters_out.push_back(in_tree_[index]);
        }
    }
    for (const ObjectCluster* cluster : beside_) {
        if (volume.meets(cluster->bounds.box_world)) casters_out.push_back(cluster);
    }
    sort_by_insertion(casters_out);
}

}  // namespace terrane::internal
