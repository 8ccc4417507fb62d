// SPDX-License-Identifier: MIT
#include "base/aabb_tree.h"
#include "graph/node_store.h"
#include "objects/log_scale.h"

#include <terrane/base/text.h>
#include <terrane/scene/culling.h>
#include <terrane/scene/scene_graph.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace terrane::internal {

/// The level or levels that a switch selects in a frame.
struct SwitchChoice {
    std::size_t level = 0;   ///< index of a child; nothing is drawn if there is no such child
    bool is_fading = false;  ///< whether level + 1 is drawn too
    float share = 1.0f;      ///< coverage of the level; that of level + 1 is share - 1
};

/// Chooses between the levels of a switch.
///
/// @param distance     from the eye to the bounding sphere, metres, > 0
/// @param factor       pixels per metre of error at this distance
/// @param threshold_px largest screen error, pixels
/// @param before       level of the previous frame, for hysteresis
SwitchChoice choose_level(const SwitchNode& levels, double distance, double factor,
                          double threshold_px, std::size_t before);

/// The first geometry that a segment meets: see SceneGraph::ray().
///
/// @param nodes the bounds are updated
/// @param view  view that billboards face; null: nodes below billboards are ignored
std::optional<NodeHit> find_hit(NodeStore& nodes, const View* view, const WorldPos& from_world,
                                const WorldPos& to_world);

// Source: D. Luebke et al. Level of Detail for 3D Graphics. 2003, sections 4.1 to 4.4 (switches by distance and by
//         error, hysteresis, fades).

SwitchChoice choose_level(const SwitchNode& levels, double distance, double factor,
                          double threshold_px, std::size_t before) {
    SwitchChoice choice;
    for (std::size_t i = 0; i < levels.limits.size(); ++i) {
        // Ratio by which the limit is passed; it does not increase with i.
        const double limit = levels.limits[i];
        const double passed = levels.by == SwitchNode::By::distance
                                  ? distance / limit
                                  : threshold_px / (limit * factor);
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

namespace {

// Margin of boxes, relative to the coordinates: more than the rounding of the transforms on the longest path of a tree.
constexpr double kNodeMargin = 0x1p-40;

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

namespace terrane {
namespace {

using internal::GraphNode;
using internal::NodeStore;
using internal::SwitchChoice;
using internal::WorldPlace;

tl::unexpected<Error> no_such_node(NodeId node) {
    return fail(ErrorCode::invalid_argument,
                "the graph has no node " + number_text(static_cast<std::uint64_t>(node)));
}

}  // namespace

struct SceneGraph::State {
    // Instances with equal keys share a draw call.
    struct DrawKey {
        bool is_caster = false, is_impostor = false;
        std::uint32_t id = 0, level = 0;
        auto operator<=>(const DrawKey&) const = default;
    };

    // State inherited from ancestors.
    struct Above {
        PlaneState planes = {};
        float coverage = 1.0f;
        bool is_caster = false;  // out of view
    };

    NodeStore nodes;
    GraphCounts counts;

    // State of the current frame.
    View view;
    bool has_view = false;
    double threshold_px = 1.0;
    std::optional<ViewVolume> volume;
    std::optional<CasterVolume> caster_volume;  // none: no casters
    std::map<DrawKey, std::vector<ObjectInstance>> of_draw;
    std::vector<ObjectInstance> instances;
    std::vector<MeshDraw> meshes, caster_meshes;
    std::vector<ImpostorDraw> impostors, caster_impostors;
    std::vector<Particle> particles;

    void visit(NodeId id, const WorldPlace& place, Above above);
    bool is_wanted(const OrientedBox& box, Above& above);
    void visit_children(const GraphNode& node, const WorldPlace& place, const Above& above);
    void visit_switch(GraphNode& node, const SwitchNode& levels, const BoundingSphere& sphere,
                      const WorldPlace& place, const Above& above);
    void draw(const GeometryNode& geometry, const WorldPlace& place, const Above& above);
    void draw(const ParticlesNode& of_node, const WorldPlace& place);
    void collect_draws();
    SceneDraws draws() const;
};

// Whether a node is in view, or can cast a shadow into the view. Sets Above::is_caster if the node is out of view.
bool SceneGraph::State::is_wanted(const OrientedBox& box, Above& above) {
    if (!above.is_caster) {
        if (volume->test_planes(box, above.planes) != Containment::outside) {
            above.planes.first = 0;
            return true;
        }
        ++counts.culled;
        above.is_caster = true;
    }
    return caster_volume && caster_volume->meets(box);
}

void SceneGraph::State::visit(NodeId id, const WorldPlace& place, Above above) {
    const std::optional<Aabb>& bounds = nodes.bounds(id);
    if (!bounds) return;
    const OrientedBox box = transform(place.world_from_node, place.scale, *bounds);
    if (!is_wanted(box, above)) return;
    GraphNode& node = nodes.at(id);
    if (const auto* levels = std::get_if<SwitchNode>(&node.content)) {
        visit_switch(node, *levels, bounding_sphere(box), place, above);
    } else if (const auto* billboard = std::get_if<BillboardNode>(&node.content)) {
        visit_children(node, turned(*billboard, place, view), above);
    } else {
        if (const auto* geometry = std::get_if<GeometryNode>(&node.content))
            draw(*geometry, place, above);
        const auto* discs = std::get_if<ParticlesNode>(&node.content);
        if (discs != nullptr && !above.is_caster) draw(*discs, place);
        visit_children(node, place, above);
    }
}

void SceneGraph::State::visit_children(const GraphNode& node, const WorldPlace& place,
                                       const Above& above) {
    for (const NodeId child : node.children) visit(child, place * nodes.at(child).place, above);
}

void SceneGraph::State::visit_switch(GraphNode& node, const SwitchNode& levels,
                                     const BoundingSphere& sphere, const WorldPlace& place,
                                     const Above& above) {
    const double distance =
        std::max((sphere.centre - view.eye_world).norm() - sphere.radius, view.near_distance);
    const SwitchChoice choice =
        internal::choose_level(levels, distance, place.scale * view.pixels_per_radian() / distance,
                               threshold_px, node.level);
    node.level = choice.level;
    // Fades do not nest: below a fading node, an inner switch draws its finer level with the outer coverage.
    const bool is_outermost = above.coverage == 1.0f;
    const auto show = [&](std::size_t level, float share) {
        if (level >= node.children.size()) return;
        const NodeId child = node.children[level];
        Above of_child = above;
        if (is_outermost) of_child.coverage = share;
        visit(child, place * nodes.at(child).place, of_child);
    };
    show(choice.level, choice.share);
    if (choice.is_fading && is_outermost) show(choice.level + 1, choice.share - 1.0f);
}

void SceneGraph::State::draw(const GeometryNode& geometry, const WorldPlace& place,
                             const Above& above) {
    const DrawKey key =
        geometry.impostor
            ? DrawKey{above.is_caster, true, static_cast<std::uint32_t>(*geometry.impostor), 0}
            : DrawKey{above.is_caster, false, static_cast<std::uint32_t>(geometry.mesh),
                      geometry.level};
    const Eigen::Quaterniond rotation(place.world_from_node.rotation);
    const LocalVec offset = to_local(place.world_from_node.translation, view.eye_world);
    of_draw[key].push_back(
        {.offset_eye = {offset.x(), offset.y(), offset.z()},
         .scale = static_cast<float>(place.scale),
         .rotation = {static_cast<float>(rotation.x()), static_cast<float>(rotation.y()),
                      static_cast<float>(rotation.z()), static_cast<float>(rotation.w())},
         .coverage = above.coverage});
    if (above.is_caster) return;
    ++counts.drawn;
    counts.triangles += geometry.triangles;
}

void SceneGraph::State::draw(const ParticlesNode& of_node, const WorldPlace& place) {
    for (const ParticlesNode::Disc& disc : of_node.discs) {
        const WorldPos centre = place.world_from_node * Eigen::Vector3d(place.scale * disc.centre);
        const LocalVec offset = to_local(centre, view.eye_world);
        particles.push_back({.offset_eye = {offset.x(), offset.y(), offset.z()},
                             .radius = static_cast<float>(place.scale * disc.radius),
                             .colour = disc.colour});
    }
    counts.triangles += 2 * of_node.discs.size();
}

void SceneGraph::State::collect_draws() {
    for (const auto& [key, of_key] : of_draw) {
        const auto first = static_cast<std::uint32_t>(instances.size());
        const auto count = static_cast<std::uint32_t>(of_key.size());
        if (count == 0) continue;
        instances.insert(instances.end(), of_key.begin(), of_key.end());
        if (key.is_impostor) {
            (key.is_caster ? caster_impostors : impostors)
                .push_back({ImpostorId{key.id}, first, count});
        } else {
            (key.is_caster ? caster_meshes : meshes)
                .push_back({MeshId{key.id}, key.level, first, count});
        }
    }
    const auto squared = [](const Particle& p) {
        const auto& [x, y, z] = p.offset_eye;
        return x * x + y * y + z * z;
    };
    std::stable_sort(particles.begin(), particles.end(),
                     [&](const Particle& a, const Particle& b) { return squared(a) > squared(b); });
}

SceneDraws SceneGraph::State::draws() const {
    return {.instances = instances,
            .meshes = meshes,
            .streamed = {},
            .impostors = impostors,
            .particles = particles,
            .caster_meshes = caster_meshes,
            .caster_impostors = caster_impostors};
}

SceneGraph::SceneGraph() : state_(std::make_unique<State>()) {}
SceneGraph::SceneGraph(SceneGraph&&) noexcept = default;
SceneGraph& SceneGraph::operator=(SceneGraph&&) noexcept = default;
SceneGraph::~SceneGraph() = default;

NodeId SceneGraph::root() const { return state_->nodes.root(); }

Result<NodeId> SceneGraph::add(NodeId parent, const NodePlace& place, NodeContent content) {
    const GraphNode* above = state_->nodes.find(parent);
    if (above == nullptr) return no_such_node(parent);
    if (above->depth >= NodeStore::kMostDepth) {
        return fail(ErrorCode::invalid_argument,
                    "nodes must be at most " + number_text(NodeStore::kMostDepth) + " deep");
    }
    TERRANE_TRY(internal::check_place(place));
    TERRANE_TRY(internal::check_content(content));
    return state_->nodes.add(parent, place, std::move(content));
}

void SceneGraph::remove(NodeId node) {
    if (node == root() || state_->nodes.find(node) == nullptr) return;
    state_->nodes.remove(node);
}

Result<void> SceneGraph::set_place(NodeId node, const NodePlace& place) {
    GraphNode* found = state_->nodes.find(node);
    if (found == nullptr) return no_such_node(node);
    TERRANE_TRY(internal::check_place(place));
    found->place = place;
    state_->nodes.invalidate(found->parent == NodeId{} ? node : found->parent);
    return {};
}

Result<void> SceneGraph::set_content(NodeId node, NodeContent content) {
    GraphNode* found = state_->nodes.find(node);
    if (found == nullptr) return no_such_node(node);
    TERRANE_TRY(internal::check_content(content));
    found->content = std::move(content);
    found->level = 0;
    state_->nodes.invalidate(node);
    return {};
}

std::size_t SceneGraph::size() const { return state_->nodes.size(); }

std::optional<Aabb> SceneGraph::bounds_world(NodeId node) const {
    NodeStore& nodes = state_->nodes;
    if (nodes.find(node) == nullptr) return {};
    const std::optional<Aabb>& bounds = nodes.bounds(node);
    if (!bounds) return {};
    std::vector<NodeId> above;
    for (NodeId id = node; id != NodeId{}; id = nodes.at(id).parent) above.push_back(id);
    WorldPlace place;
    for (auto id = above.rbegin(); id != above.rend(); ++id) place = place * nodes.at(*id).place;
    return bounding_box(transform(place.world_from_node, place.scale, *bounds));
}

SceneDraws SceneGraph::collect(const View& view, double threshold_px,
                               const std::optional<SunShadows>& shadows) {
    State& state = *state_;
    state.counts = {};
    for (auto& [key, of_key] : state.of_draw) of_key.clear();
    state.instances.clear();
    state.meshes.clear();
    state.impostors.clear();
    state.particles.clear();
    state.caster_meshes.clear();
    state.caster_impostors.clear();
    if (!view.validate()) return {};
    state.view = view;
    state.has_view = true;
    state.threshold_px = threshold_px;
    state.volume.emplace(view);
    state.caster_volume.reset();
    if (shadows && has_shadows(*shadows)) state.caster_volume.emplace(view, *shadows);
    const WorldPlace world = WorldPlace() * state.nodes.at(root()).place;
    state.visit(root(), world, {});
    state.collect_draws();
    return state.draws();
}

std::optional<NodeHit> SceneGraph::ray(const WorldPos& from_world, const WorldPos& to_world) const {
    return internal::find_hit(state_->nodes, state_->has_view ? &state_->view : nullptr, from_world,
                              to_world);
}

const GraphCounts& SceneGraph::counts() const { return state_->counts; }

}  // namespace terrane
