// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/scene_graph.h>
#include <terrane/terrain/view.h>

#include <map>
#include <optional>
#include <vector>

namespace terrane::internal {

/// A node and its place in the tree.
struct GraphNode {
    NodeId parent{};
    std::vector<NodeId> children;  ///< in the order in which they were added
    int depth = 0;                 ///< 0: the root
    NodePlace place;
    NodeContent content;
    std::size_t level = 0;       ///< of a switch in the last frame
    bool is_current = false;     ///< whether bounds are; if not, those of no node above are
    std::optional<Aabb> bounds;  ///< of all below it, in its frame
};

/// The nodes of a graph, with bounds that follow.
class NodeStore {
public:
    static constexpr int kMostDepth = 256;

    NodeStore();
    NodeId root() const { return NodeId{1}; }
    std::size_t size() const { return nodes_.size(); }
    /// Null where there is none.
    GraphNode* find(NodeId node);
    const GraphNode& at(NodeId node) const { return nodes_.at(node); }
    GraphNode& at(NodeId node) { return nodes_.at(node); }

    /// Requires a parent that exists, of a depth below kMostDepth.
    NodeId add(NodeId parent, const NodePlace& place, NodeContent content);
    /// Requires a node that exists and is not the root.
    void remove(NodeId node);
    /// Bounds of the node, and of all above it, are not current from now on.
    void invalidate(NodeId node);

    /// Bounds of a node and all below it, in its frame.
    const std::optional<Aabb>& bounds(NodeId node);

private:
    std::map<NodeId, GraphNode> nodes_;
    std::uint64_t last_ = 0;
};

/// Fails: invalid_argument, naming the value, for a place out of range
Result<void> check_place(const NodePlace& place);
/// Fails: invalid_argument, naming the value, for content out of range
Result<void> check_content(const NodeContent& content);

/// Transform from a node's frame to the world frame.
struct WorldPlace {
    Pose world_from_node;
    double scale = 1.0;

    WorldPlace operator*(const NodePlace& place) const {
        const Pose& inner = place.parent_from_node;
        return {{world_from_node.rotation * inner.rotation,
                 world_from_node * Eigen::Vector3d(scale * inner.translation)},
                scale * place.scale};
    }
};

/// The place of a billboard that faces a view.
WorldPlace turned(const BillboardNode& billboard, const WorldPlace& place, const View& view);

}  // namespace terrane::internal
