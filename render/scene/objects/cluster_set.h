// SPDX-License-Identifier: MIT
#pragma once

#include "objects/object_cluster.h"

#include <terrane/scene/cull_tree.h>

#include <map>
#include <optional>
#include <vector>

namespace terrane::internal {

/// The clusters of all groups, and a hierarchy over most of them. What comes and goes is kept beside the hierarchy
/// until an eighth has changed, so that a group costs little.
class ClusterSet {
public:
    /// Requires a group that is not in the set.
    void add(GroupId group, std::vector<ObjectCluster> clusters);
    void remove(GroupId group);
    std::size_t object_count() const { return object_count_; }

    /// Visits all clusters: void(GroupId, const ObjectCluster&), in the order of their groups.
    template <class Visit>
    void visit(const Visit& take) const {
        for (const auto& [group, clusters] : groups_) {
            for (const ObjectCluster& cluster : clusters) take(group, cluster);
        }
    }

    /// Replaces visible_out by the clusters in view, in the order in which they were added.
    void cull(const ViewVolume& volume, CullTest test,
              std::vector<const ObjectCluster*>& visible_out);

    /// Replaces casters_out by the clusters that meet the volume, in the same order. After cull() of the same frame.
    void find_casters(const CasterVolume& volume, std::vector<const ObjectCluster*>& casters_out);

private:
    void rebuild();

    std::map<GroupId, std::vector<ObjectCluster>> groups_;
    std::size_t object_count_ = 0;
    std::uint64_t last_order_ = 0;
    std::vector<const ObjectCluster*> in_tree_;  // by their index in the hierarchy; null: gone
    std::size_t gone_ = 0;
    std::vector<const ObjectCluster*> beside_;  // clusters that the hierarchy does not have
    std::optional<CullTree> tree_;
    CullMemory memory_;
    std::vector<std::uint32_t> visible_;  // scratch
};

}  // namespace terrane::internal
