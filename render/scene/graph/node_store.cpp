// SPDX-License-Identifier: MIT
#include "graph/node_store.h"

#include "base/aabb_tree.h"
#include "base/settings_check.h"
#include "base/vector_math.h"
#include "graph/emitters.h"

#include <terrane/base/text.h>
#include <terrane/scene/culling.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace terrane::internal {
namespace {

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

void unite(const Aabb& box, std::optional<Aabb>& bounds) {
    if (!bounds) {
        bounds = box;
        return;
    }
    bounds->low = bounds->low.cwiseMin(box.low);
    bounds->high = bounds->high.cwiseMax(box.high);
}

NodeStore::NodeStore() {
    last_ = 1;
    nodes_[root()].content = GroupNode{};
}

GraphNode* NodeStore::find(NodeId node) {
    const auto found = nodes_.find(node);
    return found == nodes_.end() ? nullptr : &found->second;
}

NodeId NodeStore::add(NodeId parent, const NodePlace& place, NodeContent content,
                      const std::optional<Aabb>& own_bounds) {
    const NodeId id{++last_};
    GraphNode& above = nodes_.at(parent);
    above.children.push_back(id);
    const int depth = above.depth + 1;
    GraphNode& node = nodes_[id];
    node.parent = parent;
    node.depth = depth;
    node.place = place;
    node.content = std::move(content);
    node.own_bounds = own_bounds;
    invalidate(parent);
    return id;
}

void NodeStore::set_content(NodeId node, NodeContent content,
                            const std::optional<Aabb>& own_bounds) {
    GraphNode& changed = nodes_.at(node);
    changed.content = std::move(content);
    changed.own_bounds = own_bounds;
    changed.level = 0;
    invalidate(node);
}

void NodeStore::set_place(NodeId node, const NodePlace& place) {
    GraphNode& changed = nodes_.at(node);
    changed.place = place;
    if (node != root()) invalidate(changed.parent);
}

void NodeStore::remove(NodeId node) {
    invalidate(node);
    std::erase(nodes_.at(nodes_.at(node).parent).children, node);
    for (const NodeId each : subtree(node)) nodes_.erase(each);
}

std::vector<NodeId> NodeStore::subtree(NodeId node) const {
    std::vector<NodeId> nodes = {node};
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const std::vector<NodeId>& children = nodes_.at(nodes[i]).children;
        nodes.insert(nodes.end(), children.begin(), children.end());
    }
    return nodes;
}

// Marks the bounds of the node and of its ancestors as out of date.
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
    std::optional<Aabb> bounds = current.own_bounds;
    for (const NodeId child : current.children) {
        const std::optional<Aabb>& of_child = this->bounds(child);
        if (!of_child) continue;
        const NodePlace& place = nodes_.at(child).place;
        unite(bounding_box(transform(place.parent_from_node, place.scale, *of_child)), bounds);
    }
    const auto* billboard = std::get_if<BillboardNode>(&current.content);
    if (billboard != nullptr && bounds) bounds = turned_bounds(*bounds, billboard->axis);
    current.bounds = bounds;
    current.is_current = true;
    return current.bounds;
}

WorldPlace NodeStore::place_world(NodeId node) const {
    std::vector<NodeId> above;
    for (NodeId id = node; id != NodeId{}; id = nodes_.at(id).parent) above.push_back(id);
    WorldPlace place;
    for (auto id = above.rbegin(); id != above.rend(); ++id) place = place * nodes_.at(*id).place;
    return place;
}

namespace {

constexpr double kMostPlace = 2e9;  // metres
constexpr double kMostRatio = 2.0;

Result<void> refuse(std::string message) {
    return fail(ErrorCode::invalid_argument, std::move(message));
}

Result<void> check_model(ModelId model, std::span<const ObjectModel> models) {
    const auto index = static_cast<std::uint32_t>(model);
    if (index < models.size()) return {};
    return refuse("there is no model " + number_text(index) + " of " + number_text(models.size()));
}

Result<void> check_tint(const std::array<float, 3>& tint, const std::string& of) {
    for (const float value : tint) {
        if (!std::isfinite(value)) return refuse("the tint" + of + " must be finite");
    }
    return {};
}

Result<void> check_object(const PlacedObject& object, std::size_t index) {
    const std::string of = " of object " + number_text(index);
    for (int axis = 0; axis < 3; ++axis) {
        const double value = object.position[axis];
        if (!(std::abs(value) <= kMostPlace))
            return refuse("coordinates must be within 2e9 m, got " + number_text(value) + of);
    }
    if (!(object.scale >= 1e-6f && object.scale <= 1e6f)) {
        return refuse("scale must be 1e-6 to 1e6, got " +
                      number_text(static_cast<double>(object.scale)) + of);
    }
    double squared = 0.0;
    for (const float q : object.rotation)
        squared += static_cast<double>(q) * static_cast<double>(q);
    if (!(std::abs(squared - 1.0) <= 2e-3))
        return refuse("the quaternion must have unit length, got " +
                      number_text(std::sqrt(squared)) + of);
    return check_tint(object.tint, of);
}

Result<void> check_instances(const InstancesNode& node, std::span<const ObjectModel> models) {
    TERRANE_TRY(check_model(node.model, models));
    for (std::size_t i = 0; i < node.objects.size(); ++i) {
        TERRANE_TRY(check_object(node.objects[i], i));
    }
    return {};
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

Result<void> check_content(const NodeContent& content, std::span<const ObjectModel> models) {
    if (const auto* model = std::get_if<ModelNode>(&content)) {
        TERRANE_TRY(check_model(model->model, models));
        return check_tint(model->tint, "");
    }
    if (const auto* instances = std::get_if<InstancesNode>(&content))
        return check_instances(*instances, models);
    if (const auto* levels = std::get_if<SwitchNode>(&content)) return check_switch(*levels);
    if (const auto* particles = std::get_if<ParticlesNode>(&content))
        return check_particles(*particles);
    if (const auto* emitter = std::get_if<EmitterNode>(&content)) return check_emitter(*emitter);
    return {};
}

std::optional<Aabb> bounds_of(const NodeContent& content, std::span<const ObjectModel> models) {
    if (const auto* node = std::get_if<ModelNode>(&content))
        return models[static_cast<std::uint32_t>(node->model)].bounds;
    const auto* particles = std::get_if<ParticlesNode>(&content);
    if (particles == nullptr || particles->discs.empty()) return {};
    Aabb box = empty_box();
    for (const ParticlesNode::Disc& disc : particles->discs) include(disc.centre, disc.radius, box);
    return box;
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
