// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/culling.h>
#include <terrane/scene/object_model.h>
#include <terrane/scene/scene_nodes.h>
#include <terrane/terrain/view.h>

#include <map>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// A node and its place in the tree.
struct GraphNode {
    NodeId parent{};
    std::vector<NodeId> children;  ///< in the order in which they were added
    int depth = 0;                 ///< 0: the root
    NodePlace place;
    NodeContent content;
    std::optional<Aabb> own_bounds;  ///< of its content, in its frame
    std::size_t level = 0;           ///< of a switch in the last frame
    bool is_current = false;         ///< whether `bounds` is valid; if not, no ancestor is current
    std::optional<Aabb> bounds;      ///< of the subtree, in its frame
};

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

/// The nodes of a scene, with lazily updated bounds.
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
    /// @param own_bounds of the content, in the node's frame
    NodeId add(NodeId parent, const NodePlace& place, NodeContent content,
               const std::optional<Aabb>& own_bounds);
    /// Requires an existing node.
    void set_content(NodeId node, NodeContent content, const std::optional<Aabb>& own_bounds);
    /// Requires an existing node.
    void set_place(NodeId node, const NodePlace& place);
    /// Requires an existing node other than the root.
    void remove(NodeId node);

    /// The nodes of a subtree: a node comes before its children.
    std::vector<NodeId> subtree(NodeId node) const;

    /// Bounds of a subtree, in the frame of its top node, without instances, which are culled by their clusters. None
    /// without other content. Updates the bounds if necessary.
    const std::optional<Aabb>& bounds(NodeId node);

    /// Transform from a node's frame to the world frame.
    WorldPlace place_world(NodeId node) const;

private:
    void invalidate(NodeId node);

    std::map<NodeId, GraphNode> nodes_;
    std::uint64_t last_ = 0;
};

/// Extends bounds, which may be none, to contain a box.
void unite(const Aabb& box, std::optional<Aabb>& bounds);

/// Fails: invalid_argument, naming the value, for a place out of range
Result<void> check_place(const NodePlace& place);
/// Fails: invalid_argument, naming the value, for content out of range, or a model that is not among the models
Result<void> check_content(const NodeContent& content, std::span<const ObjectModel> models);
/// Bounds of content that check_content() accepts, in the node's frame; none if it draws nothing by itself, and for
/// instances: the bounds of their clusters are those in the world frame.
std::optional<Aabb> bounds_of(const NodeContent& content, std::span<const ObjectModel> models);

/// The place of a billboard, turned to face a view.
WorldPlace turned(const BillboardNode& billboard, const WorldPlace& place, const View& view);

}  // namespace terrane::internal
