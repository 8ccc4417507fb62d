// SPDX-License-Identifier: MIT
#include "graph/node_store.h"

#include "base/boxes.h"

#include <terrane/scene/bounds.h>

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

void unite(const Aabb& box, std::optional<Aabb>& bounds) {
    if (!bounds) {
        bounds = box;
        return;
    }
    bounds->low = bounds->low.cwiseMin(box.low);
    bounds->high = bounds->high.cwiseMax(box.high);
}

std::optional<Aabb> content_bounds(const NodeContent& content) {
    if (const auto* geometry = std::get_if<GeometryNode>(&content)) return geometry->bounds;
    const auto* particles = std::get_if<ParticlesNode>(&content);
    if (particles == nullptr || particles->discs.empty()) return {};
    Aabb box = empty_box();
    for (const ParticlesNode::Disc& disc : particles->discs) include(disc.centre, disc.radius, box);
    return box;
}

// Bounds of what may turn: about the origin, or about the z axis.
Aabb turned_bounds(const Aabb& box, BillboardNode::Axis axis) {
    constexpr double kOutward = 1.0 + 0x1p-48;
    const Eigen::Vector3d most = box.low.cwiseAbs().cwiseMax(box.high.cwiseAbs());
    if (axis == BillboardNode::Axis::screen) {
        const Eigen::Vector3d reach = Eigen::Vector3d::Constant(most.norm() * kOutward);
        return {-reach, reach};
    }
    const double around = std::hypot(most.x(), most.y()) * kOutward;
    return {{-around, -around, box.low.z()}, {around, around, box.high.z()}};
}

}  // namespace

NodeStore::NodeStore() {
    last_ = 1;
    nodes_[root()].content = GroupNode{};
}

GraphNode* NodeStore::find(NodeId node) {
    const auto found = nodes_.find(node);
    return found == nodes_.end() ? nullptr : &found->second;
}

NodeId NodeStore::add(NodeId parent, const NodePlace& place, NodeContent content) {
    const NodeId id{++last_};
    GraphNode& above = nodes_.at(parent);
    above.children.push_back(id);
    const int depth = above.depth + 1;
    GraphNode& node = nodes_[id];
    node.parent = parent;
    node.depth = depth;
    node.place = place;
    node.content = std::move(content);
    invalidate(parent);
    return id;
}

void NodeStore::remove(NodeId node) {
    invalidate(node);
    std::erase(nodes_.at(nodes_.at(node).parent).children, node);
    std::vector<NodeId> doomed = {node};
    while (!doomed.empty()) {
        const auto found = nodes_.find(doomed.back());
        doomed.pop_back();
        doomed.insert(doomed.end(), found->second.children.begin(), found->second.children.end());
        nodes_.erase(found);
    }
}

void NodeStore::invalidate(NodeId node) {
    for (;;) {
        GraphNode& current = nodes_.at(node);
        current.is_current = false;
        if (node == root()) return;
        node = current.parent;
    }
}

const std::optional<Aabb>& NodeStore::bounds(NodeId node) {
    GraphNode& current = nodes_.at(node);
    if (current.is_current) return current.bounds;
    std::optional<Aabb> all = content_bounds(current.content);
    for (const NodeId child : current.children) {
        const std::optional<Aabb>& of_child = bounds(child);
        if (!of_child) continue;
        const NodePlace& place = nodes_.at(child).place;
        unite(bounding_box(transform(place.parent_from_node, place.scale, *of_child)), all);
    }
    const auto* billboard = std::get_if<BillboardNode>(&current.content);
    if (billboard != nullptr && all) all = turned_bounds(*all, billboard->axis);
    current.bounds = all;
    current.is_current = true;
    return current.bounds;
}

}  // namespace terrane::internal
