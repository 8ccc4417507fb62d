// SPDX-License-Identifier: MIT
#include "objects/cluster_set.h"

#include <terrane/terrain/assert.h>

#include <algorithm>
#include <utility>

namespace terrane::internal {
namespace {

// The hierarchy is built again where more clusters than this, and more than an eighth, have changed.
constexpr std::size_t kLeastChanges = 64;

// The order of insertion does not depend on the hierarchy, so that frames do not depend on earlier changes.
void sort_by_insertion(std::vector<const ObjectCluster*>& clusters) {
    std::sort(clusters.begin(), clusters.end(),
              [](const ObjectCluster* a, const ObjectCluster* b) { return a->order < b->order; });
}

}  // namespace

void ClusterSet::add(GroupId group, std::vector<ObjectCluster> clusters) {
    const auto [place, is_new] = groups_.emplace(group, std::move(clusters));
    TERRANE_ASSERT(is_new, "a group is added once");
    for (ObjectCluster& cluster : place->second) {
        cluster.order = ++last_order_;
        object_count_ += cluster.size();
        beside_.push_back(&cluster);
    }
}

void ClusterSet::remove(GroupId group) {
    const auto found = groups_.find(group);
    if (found == groups_.end()) return;
    for (const ObjectCluster& cluster : found->second) {
        object_count_ -= cluster.size();
        if (std::erase(beside_, &cluster) > 0) continue;
        in_tree_[cluster.tree_index] = nullptr;
        ++gone_;
    }
    groups_.erase(found);
}

void ClusterSet::rebuild() {
    if (gone_ + beside_.size() <= std::max(kLeastChanges, in_tree_.size() / 8)) return;
    in_tree_.clear();
    beside_.clear();
    gone_ = 0;
    std::vector<Aabb> boxes;
    for (auto& [id, clusters] : groups_) {
        for (ObjectCluster& cluster : clusters) {
            cluster.tree_index = in_tree_.size();
            in_tree_.push_back(&cluster);
            boxes.push_back(cluster.bounds_world);
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
        if (volume.test_planes(cluster->bounds_world, all) == Containment::outside) continue;
        if (test == CullTest::planes || volume.meets(cluster->bounds_world))
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
        if (volume.meets(cluster->bounds_world)) casters_out.push_back(cluster);
    }
    sort_by_insertion(casters_out);
}

}  // namespace terrane::internal
