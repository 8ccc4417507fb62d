// SPDX-License-Identifier: MIT
#include "graph/node_store.h"

#include "base/aabb_tree.h"
#include "base/settings_check.h"
#include "base/vector_math.h"

#include <terrane/base/text.h>
#include <terrane/scene/culling.h>

#include <algorithm>
#include <cmath>
#include <string>

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

// Bounds of a box that is turned by any angle about the origin (screen) or about the z axis.
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

namespace {

constexpr double kMostPlace = 2e9;  // metres
constexpr double kMostRatio = 2.0;

Result<void> refuse(std::string message) {
    return fail(ErrorCode::invalid_argument, std::move(message));
}

Result<void> check_geometry(const GeometryNode& geometry) {
    const Aabb& box = geometry.bounds;
    if (is_finite(box.low) && is_finite(box.high) && (box.low.array() <= box.high.array()).all())
        return {};
    return refuse("bounds must be finite, low at most high");
}

Result<void> check_switch(const SwitchNode& levels) {
    TERRANE_TRY(check_range("hysteresis", levels.hysteresis, 1.0, kMostRatio));
    TERRANE_TRY(check_range("fade_ratio", levels.fade_ratio, 1.0, kMostRatio));
    if (levels.hysteresis > 1.0 && levels.fade_ratio > 1.0)
        return refuse("a switch has hysteresis or a fade_ratio, not both");
    if (levels.limits.empty()) return refuse("a switch needs at least one limit, got 0");
    for (std::size_t i = 0; i < levels.limits.size(); ++i) {
        const double limit = levels.limits[i];
        if (!(limit > 0.0))
            return refuse("limits must be above 0, got " + number_text(limit) + " at " +
                          number_text(i));
        if (i == 0 || limit >= levels.limits[i - 1] * levels.fade_ratio) continue;
        return refuse("limits must not decrease, and differ by fade_ratio at least, got " +
                      number_text(limit) + " after " + number_text(levels.limits[i - 1]));
    }
    return {};
}

Result<void> check_particles(const ParticlesNode& particles) {
    for (std::size_t i = 0; i < particles.discs.size(); ++i) {
        const ParticlesNode::Disc& disc = particles.discs[i];
        if (!is_finite(disc.centre))
            return refuse("the centre of disc " + number_text(i) + " must be finite");
        if (!(disc.radius > 0.0) || !std::isfinite(disc.radius)) {
            return refuse("the radius of disc " + number_text(i) + " must be above 0, got " +
                          number_text(disc.radius));
        }
    }
    return {};
}

}  // namespace

Result<void> check_place(const NodePlace& place) {
    TERRANE_TRY(check_range("scale", place.scale, 1e-6, 1e6));
    const Pose& pose = place.parent_from_node;
    if (!(pose.translation.cwiseAbs().maxCoeff() <= kMostPlace) || !is_finite(pose.translation))
        return refuse("the translation must be within 2e9 m along each axis");
    if (!(column_error(pose.rotation) <= 1e-6) || !(determinant(pose.rotation) > 0.0))
        return refuse("the rotation must be orthonormal to 1e-6 with determinant 1");
    return {};
}

Result<void> check_content(const NodeContent& content) {
    if (const auto* geometry = std::get_if<GeometryNode>(&content))
        return check_geometry(*geometry);
    if (const auto* levels = std::get_if<SwitchNode>(&content)) return check_switch(*levels);
    if (const auto* particles = std::get_if<ParticlesNode>(&content))
        return check_particles(*particles);
    return {};
}

WorldPlace turned(const BillboardNode& billboard, const WorldPlace& place, const View& view) {
    WorldPlace turned = place;
    Eigen::Matrix3d& axes = turned.world_from_node.rotation;
    if (billboard.axis == BillboardNode::Axis::screen) {
        axes.col(0) = view.right();
        axes.col(1) = view.up;
        axes.col(2) = -view.forward;
        return turned;
    }
    const Eigen::Vector3d up = axes.col(2);
    const Eigen::Vector3d towards = view.eye_world - place.world_from_node.translation;
    const Eigen::Vector3d level = towards - up * up.dot(towards);
    const double length = level.norm();
    // The eye is on the axis: no rotation about the axis faces the eye, and the node keeps its rotation.
    if (!(length > 1e-9 * towards.norm())) return turned;
    axes.col(0) = level / length;
    axes.col(1) = up.cross(Eigen::Vector3d(axes.col(0)));
    return turned;
}

}  // namespace terrane::internal
