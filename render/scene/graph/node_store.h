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
    bool is_current = false;     ///< whether `bounds` is valid; if not, no ancestor is current
    std::optional<Aabb> bounds;  ///< of its subtree, in its frame
};

/// The nodes of a graph, with lazily updated bounds.
class NodeStore {
public:
    static constexpr int kMostDepth = 256;

    NodeStore();
    NodeId root() const { return NodeId{1}; }
    std::size_t size() const { return nodes_.size(); }
    /// Null for an unknown id.
    GraphNode* find(NodeId node);
    const GraphNode& at(NodeId node) const { return nodes_.at(node); }
    GraphNode& at(NodeId node) { return nodes_.at(node); }

    /// Requires an existing parent of a depth below kMostDepth.
    NodeId add(NodeId parent, const NodePlace& place, NodeContent content);
    /// Requires an existing node other than the root.
    void remove(NodeId node);
    /// Marks the bounds of the node and of its ancestors as out of date.
    void invalidate(NodeId node);

    /// Bounds of a node's subtree, in its frame; updates them if necessary.
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

/// The place of a billboard, turned to face a view.
WorldPlace turned(const BillboardNode& billboard, const WorldPlace& place, const View& view);

}  // namespace terrane::internal
