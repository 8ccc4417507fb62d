// SPDX-License-Identifier: MIT
#include "graph/graph_ray.h"

#include "base/aabb_tree.h"
#include "graph/world_place.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Of the coordinates: added to boxes, above the rounding of transforms down the deepest tree.
constexpr double kNodeMargin = 0x1p-40;

/// A segment, and the first node on it so far.
class GraphRay {
public:
    GraphRay(NodeStore& nodes, const View* view, const WorldPos& from_world,
             const Eigen::Vector3d& displacement)
        : nodes_(nodes), view_(view), from_world_(from_world), displacement_(displacement) {}

    void visit(NodeId id, const WorldPlace& place) {
        const std::optional<Aabb>& bounds = nodes_.bounds(id);
        if (!bounds) return;
        // the inverse, not the transpose: rotations are orthonormal to 1e-6 only
        const Eigen::Matrix3d node_from_world =
            place.world_from_node.rotation.inverse() / place.scale;
        const Eigen::Vector3d start =
            node_from_world * Eigen::Vector3d(from_world_ - place.world_from_node.translation);
        const Eigen::Vector3d displacement = node_from_world * displacement_;
        const double largest = std::max(from_world_.cwiseAbs().maxCoeff(),
                                        place.world_from_node.translation.cwiseAbs().maxCoeff());
        const double margin =
            kNodeMargin * (largest / place.scale + bounds->low.cwiseAbs().maxCoeff() +
                           bounds->high.cwiseAbs().maxCoeff());
        const double limit = first ? first->fraction : 1.0;
        if (!(segment_entry(start, displacement, *bounds, margin) <= limit)) return;
        const GraphNode& node = nodes_.at(id);
        if (const auto* geometry = std::get_if<GeometryNode>(&node.content))
            meet(id, *geometry, place, start, displacement);
        if (const auto* billboard = std::get_if<BillboardNode>(&node.content)) {
            if (view_ != nullptr)
                visit_children(node, turned(*billboard, place, *view_), node.children.size());
            return;
        }
        const bool is_switch = std::holds_alternative<SwitchNode>(node.content);
        visit_children(node, place, is_switch ? 1 : node.children.size());
    }

    std::optional<NodeHit> first;

private:
    void visit_children(const GraphNode& node, const WorldPlace& place, std::size_t count) {
        for (std::size_t i = 0; i < std::min(count, node.children.size()); ++i)
            visit(node.children[i], place * nodes_.at(node.children[i]).place);
    }

    void meet(NodeId id, const GeometryNode& geometry, const WorldPlace& place,
              const Eigen::Vector3d& start, const Eigen::Vector3d& displacement) {
        if (!geometry.rays) return;
        const std::optional<MeshHit> hit = geometry.rays->ray(start, start + displacement);
        if (!hit) return;
        if (first && !(hit->fraction < first->fraction ||
                       (hit->fraction == first->fraction && id < first->node)))
            return;
        first = NodeHit{.node = id,
                        .fraction = hit->fraction,
                        .point_world = from_world_ + hit->fraction * displacement_,
                        .normal = place.world_from_node.rotation * hit->normal,
                        .triangle = hit->triangle};
    }

    NodeStore& nodes_;
    const View* view_;
    WorldPos from_world_;
    Eigen::Vector3d displacement_;
};

}  // namespace

std::optional<NodeHit> find_hit(NodeStore& nodes, const View* view, const WorldPos& from_world,
                                const WorldPos& to_world) {
    const Eigen::Vector3d displacement = to_world - from_world;
    if (!displacement.allFinite()) return std::nullopt;
    GraphRay ray(nodes, view, from_world, displacement);
    ray.visit(nodes.root(), WorldPlace() * nodes.at(nodes.root()).place);
    return ray.first;
}

}  // namespace terrane::internal
