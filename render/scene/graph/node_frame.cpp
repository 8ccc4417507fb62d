// SPDX-License-Identifier: MIT
//
// Source: D. Luebke et al. Level of Detail for 3D Graphics. 2003, sections 4.1 to 4.4 (switches by distance and by
//         error, hysteresis, fades).
#include "graph/node_frame.h"

#include "base/aabb_tree.h"
#include "objects/log_scale.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrane::internal {
namespace {

// Nodes whose scale in the world is beyond these limits are not drawn: they have no size as a float.
constexpr double kLeastScale = 1e-12, kMostScale = 1e12;

/// The level or levels that a switch selects in a frame.
struct SwitchChoice {
    std::size_t level = 0;   ///< index of a child; nothing is drawn if there is no such child
    bool is_fading = false;  ///< whether level + 1 is drawn too
    float share = 1.0f;      ///< coverage of the level; that of level + 1 is share - 1
};

// Chooses between the levels of a switch.
//
// @param distance     quantity of SwitchNode::By, metres, > 0
// @param factor       pixels per metre of error at the bounding sphere
// @param threshold_px largest screen error, pixels
// @param before       level of the previous frame, for hysteresis
SwitchChoice choose_level(const SwitchNode& levels, double distance, double factor,
                          double threshold_px, std::size_t before) {
    SwitchChoice choice;
    for (std::size_t i = 0; i < levels.limits.size(); ++i) {
        // Ratio by which the limit is passed; it does not increase with i.
        const double limit = levels.limits[i];
        const double passed =
            levels.by == SwitchNode::By::error ? threshold_px / (limit * factor) : distance / limit;
        const double wanted = before > i ? 1.0 / levels.hysteresis : levels.hysteresis;
        if (!(passed >= wanted)) break;
        if (levels.fade_ratio > 1.0 && passed < levels.fade_ratio) {
            const float share = 1.0f - log2_of(static_cast<float>(passed)) /
                                           log2_of(static_cast<float>(levels.fade_ratio));
            // A share of 0 or 1 would draw one of the two levels without pixels.
            return {i, true, std::clamp(share, 0x1p-10f, 1.0f - 0x1p-10f)};
        }
        choice.level = i + 1;
    }
    return choice;
}

}  // namespace

class NodeFrame::Visit {
public:
    Visit(NodeFrame& frame, NodeStore& nodes, std::span<const ObjectModel> models, const View& view,
          double threshold_px, const ViewVolume& volume, const CasterVolume* casters)
        : frame_(frame),
          nodes_(nodes),
          models_(models),
          view_(view),
          threshold_px_(threshold_px),
          volume_(volume),
          casters_(casters) {}

    // State inherited from ancestors.
    struct Above {
        PlaneState planes = {};
        float coverage = 1.0f;
        bool is_caster = false;  // out of view
    };

    void visit(NodeId id, const WorldPlace& place, Above above) {
        const std::optional<Aabb>& bounds = nodes_.bounds(id);
        if (!bounds || !(place.scale >= kLeastScale && place.scale <= kMostScale)) return;
        const OrientedBox box = transform(place.world_from_node, place.scale, *bounds);
        const bool was_in_view = !above.is_caster;
        const bool is_needed = is_wanted(box, above);
        if (was_in_view && above.is_caster) ++frame_.culled_;
        if (!is_needed) return;
        GraphNode& node = nodes_.at(id);
        if (const auto* levels = std::get_if<SwitchNode>(&node.content)) {
            visit_switch(node, *levels, bounding_sphere(box), place, above);
        } else if (const auto* billboard = std::get_if<BillboardNode>(&node.content)) {
            visit_children(node, turned(*billboard, place, view_), above);
        } else {
            if (const auto* model = std::get_if<ModelNode>(&node.content)) {
                Above of_model = above;
                if (node.children.empty() ||
                    is_wanted(transform(place.world_from_node, place.scale, *node.own_bounds),
                              of_model))
                    add(id, *model, place, of_model);
            }
            const auto* discs = std::get_if<ParticlesNode>(&node.content);
            if (discs != nullptr && !above.is_caster) add(*discs, place);
            visit_children(node, place, above);
        }
    }

private:
    // Whether a box is in view, or can cast a shadow into the view. Sets Above::is_caster if it is out of view.
    bool is_wanted(const OrientedBox& box, Above& above) {
        if (!above.is_caster) {
            if (volume_.test_planes(box, above.planes) != Containment::outside) {
                above.planes.first = 0;
                return true;
            }
            above.is_caster = true;
        }
        return casters_ != nullptr && casters_->meets(box);
    }

    void visit_children(const GraphNode& node, const WorldPlace& place, const Above& above) {
        for (const NodeId child : node.children)
            visit(child, place * nodes_.at(child).place, above);
    }

    void visit_switch(GraphNode& node, const SwitchNode& levels, const BoundingSphere& sphere,
                      const WorldPlace& place, const Above& above) {
        const double to_centre = (sphere.centre - view_.eye_world).norm();
        const double to_sphere = std::max(to_centre - sphere.radius, view_.near_distance);
        const double distance = levels.by == SwitchNode::By::centre
                                    ? std::max(to_centre, view_.near_distance)
                                    : to_sphere;
        const SwitchChoice choice =
            choose_level(levels, distance, place.scale * view_.pixels_per_radian() / to_sphere,
                         threshold_px_, node.level);
        node.level = choice.level;
        // Fades do not nest: below a fading node, an inner switch draws its finer level with the outer coverage.
        const bool is_outermost = above.coverage == 1.0f;
        const auto show = [&](std::size_t level, float share) {
            if (level >= node.children.size()) return;
            const NodeId child = node.children[level];
            Above of_child = above;
            if (is_outermost) of_child.coverage = share;
            visit(child, place * nodes_.at(child).place, of_child);
        };
        show(choice.level, choice.share);
        if (choice.is_fading && is_outermost) show(choice.level + 1, choice.share - 1.0f);
    }

    void add(NodeId id, const ModelNode& node, const WorldPlace& place, const Above& above) {
        if (frame_.cluster_count_ == frame_.clusters_.size()) frame_.clusters_.emplace_back();
        ObjectCluster& cluster = frame_.clusters_[frame_.cluster_count_++];
        const auto model = static_cast<std::uint32_t>(node.model);
        set_single(model, models_[model].bounds, place.world_from_node, place.scale, node.tint,
                   cluster);
        cluster.order = kOrder + static_cast<std::uint64_t>(id);
        cluster.coverage = above.coverage;
        (above.is_caster ? frame_.casters_ : frame_.models_).push_back(&cluster);
    }

    void add(const ParticlesNode& of_node, const WorldPlace& place) {
        for (const ParticlesNode::Disc& disc : of_node.discs) {
            const WorldPos centre =
                place.world_from_node * Eigen::Vector3d(place.scale * disc.centre);
            const LocalVec offset = to_local(centre, view_.eye_world);
            frame_.particles_.push_back({.offset_eye = {offset.x(), offset.y(), offset.z()},
                                         .radius = static_cast<float>(place.scale * disc.radius),
                                         .colour = disc.colour});
        }
    }

    NodeFrame& frame_;
    NodeStore& nodes_;
    std::span<const ObjectModel> models_;
    const View& view_;
    double threshold_px_;
    const ViewVolume& volume_;
    const CasterVolume* casters_;
};

void NodeFrame::clear() {
    cluster_count_ = 0;
    models_.clear();
    casters_.clear();
    particles_.clear();
    culled_ = 0;
}

void NodeFrame::collect(NodeStore& nodes, const Emitters& emitters,
                        std::span<const ObjectModel> models, const View& view, double threshold_px,
                        const ViewVolume& volume, const CasterVolume* casters) {
    clear();
    Visit(*this, nodes, models, view, threshold_px, volume, casters)
        .visit(nodes.root(), WorldPlace() * nodes.at(nodes.root()).place, {});
    emitters.append(nodes, view, volume, threshold_px, particles_);
    const auto before = [](const ObjectCluster* a, const ObjectCluster* b) {
        return a->order < b->order;
    };
    std::sort(models_.begin(), models_.end(), before);
    std::sort(casters_.begin(), casters_.end(), before);
    const auto squared = [](const Particle& p) {
        const auto& [x, y, z] = p.offset_eye;
        return x * x + y * y + z * z;
    };
    std::stable_sort(particles_.begin(), particles_.end(),
                     [&](const Particle& a, const Particle& b) { return squared(a) > squared(b); });
}

namespace {

// Margin of boxes, relative to the coordinates: more than the rounding of the transforms on the longest path of a tree.
constexpr double kNodeMargin = 0x1p-40;

class NodeRay {
public:
    NodeRay(NodeStore& nodes, std::span<const ObjectModel> models, const View* view,
            const WorldPos& from_world, const Eigen::Vector3d& displacement)
        : nodes_(nodes),
          models_(models),
          view_(view),
          from_world_(from_world),
          displacement_(displacement) {}

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
        const double limit = first ? first->mesh.fraction : 1.0;
        if (!(segment_entry(start, displacement, *bounds, margin) <= limit)) return;
        const GraphNode& node = nodes_.at(id);
        if (const auto* model = std::get_if<ModelNode>(&node.content))
            meet(id, *model, place, start, displacement);
        if (const auto* billboard = std::get_if<BillboardNode>(&node.content)) {
            if (view_ != nullptr)
                visit_children(node, turned(*billboard, place, *view_), node.children.size());
            return;
        }
        const bool is_switch = std::holds_alternative<SwitchNode>(node.content);
        visit_children(node, place, is_switch ? 1 : node.children.size());
    }

    std::optional<NodeRayHit> first;

private:
    void visit_children(const GraphNode& node, const WorldPlace& place, std::size_t count) {
        for (std::size_t i = 0; i < std::min(count, node.children.size()); ++i)
            visit(node.children[i], place * nodes_.at(node.children[i]).place);
    }

    void meet(NodeId id, const ModelNode& node, const WorldPlace& place,
              const Eigen::Vector3d& start, const Eigen::Vector3d& displacement) {
        const std::optional<MeshRays>& rays = models_[static_cast<std::uint32_t>(node.model)].rays;
        if (!rays) return;
        const std::optional<MeshHit> hit = rays->ray(start, start + displacement);
        if (!hit) return;
        if (first && !(hit->fraction < first->mesh.fraction ||
                       (hit->fraction == first->mesh.fraction && id < first->node)))
            return;
        first = NodeRayHit{
            .node = id, .mesh = *hit, .normal_world = place.world_from_node.rotation * hit->normal};
    }

    NodeStore& nodes_;
    std::span<const ObjectModel> models_;
    const View* view_;
    WorldPos from_world_;
    Eigen::Vector3d displacement_;
};

}  // namespace

std::optional<NodeRayHit> find_node_hit(NodeStore& nodes, std::span<const ObjectModel> models,
                                        const View* view, const WorldPos& from_world,
                                        const WorldPos& to_world) {
    const Eigen::Vector3d displacement = to_world - from_world;
    if (!displacement.allFinite()) return std::nullopt;
    NodeRay ray(nodes, models, view, from_world, displacement);
    ray.visit(nodes.root(), WorldPlace() * nodes.at(nodes.root()).place);
    return ray.first;
}

}  // namespace terrane::internal
