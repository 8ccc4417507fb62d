// SPDX-License-Identifier: MIT
#pragma once

#include "graph/emitters.h"
#include "graph/node_store.h"
#include "objects/object_clusters.h"

#include <terrane/scene/culling.h>
#include <terrane/scene/object_model.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/view.h>

#include <cstddef>
#include <deque>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// The single models and particles of the nodes in view: culls subtrees, chooses the levels of switches, and turns
/// billboards. Instances have their own hierarchy: see ClusterSet.
class NodeFrame {
public:
    void clear();

    /// Visits the nodes.
    ///
    /// @param threshold_px threshold of switches by error, and least radius of an emitter's particles, pixels
    /// @param casters      null: no casters
    ///
    /// Allocates: nothing once the buffers are large enough
    void collect(NodeStore& nodes, const Emitters& emitters, std::span<const ObjectModel> models,
                 const View& view, double threshold_px, const ViewVolume& volume,
                 const CasterVolume* casters);

    /// Clusters of one object each, in the order of their nodes: ObjectCluster::order is the node's id plus kOrder.
    std::span<const ObjectCluster* const> models() const { return models_; }
    /// Models out of view that can cast a shadow into it, in the same order.
    std::span<const ObjectCluster* const> casters() const { return casters_; }
    /// Sorted from far to near.
    std::span<const Particle> particles() const { return particles_; }
    /// Nodes out of view, without their descendants.
    std::size_t culled() const { return culled_; }

    /// Added to the ids of nodes, so that the orders of their clusters are above those of a ClusterSet.
    static constexpr std::uint64_t kOrder = std::uint64_t{1} << 63;

private:
    class Visit;

    std::deque<ObjectCluster> clusters_;  // the first cluster_count_ are of this frame
    std::size_t cluster_count_ = 0;
    std::vector<const ObjectCluster*> models_, casters_;
    std::vector<Particle> particles_;
    std::size_t culled_ = 0;
};

/// A model of a node that a segment hits.
struct NodeRayHit {
    NodeId node{};
    MeshHit mesh;
    Eigen::Vector3d normal_world = Eigen::Vector3d::UnitZ();  ///< unit, against the segment
};

/// The first model of a ModelNode that a segment hits; ties go to the smallest id. For a switch its finest level is
/// tested.
///
/// @param nodes the bounds are updated
/// @param view  view that billboards face; null: nodes below billboards are ignored
std::optional<NodeRayHit> find_node_hit(NodeStore& nodes, std::span<const ObjectModel> models,
                                        const View* view, const WorldPos& from_world,
                                        const WorldPos& to_world);

}  // namespace terrane::internal
