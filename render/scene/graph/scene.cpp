// SPDX-License-Identifier: MIT
#include "base/aabb_tree.h"
#include "base/settings_check.h"
#include "base/vector_math.h"
#include "graph/node_frame.h"
#include "graph/node_store.h"
#include "objects/continuous_levels.h"
#include "objects/device_objects.h"
#include "objects/frame_objects.h"
#include "objects/object_clusters.h"

#include <terrane/base/text.h>
#include <terrane/scene/object_model.h>
#include <terrane/scene/scene.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace terrane::internal {

namespace {

Eigen::Vector3d to_double(float x, float y, float z) {
    return {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
}

// Whether a segment comes within a radius of a point.
bool is_near(const Eigen::Vector3d& from, const Eigen::Vector3d& displacement,
             const Eigen::Vector3d& centre, double radius) {
    const Eigen::Vector3d to_centre = centre - from;
    const double along =
        std::clamp(dot(to_centre, displacement) / dot(displacement, displacement), 0.0, 1.0);
    const Eigen::Vector3d gap = to_centre - along * displacement;
    return dot(gap, gap) <= radius * radius;
}

// The first instance that a segment hits; ties go to the first one in the order of nodes and clusters.
//
// @param models indexed by ObjectCluster::model
std::optional<SceneHit> find_instance_hit(const ClusterSet& clusters,
                                          std::span<const ObjectModel> models,
                                          const WorldPos& from_world, const WorldPos& to_world) {
    const Eigen::Vector3d displacement = to_world - from_world;
    if (!displacement.allFinite() || displacement == Eigen::Vector3d::Zero()) return std::nullopt;
    std::optional<SceneHit> first;
    clusters.visit([&](NodeId node, const ObjectCluster& cluster) {
        const std::optional<MeshRays>& rays = models[cluster.model].rays;
        if (!rays) return;
        const double limit = first ? first->fraction : 1.0;
        if (!(segment_entry(from_world, displacement, cluster.bounds.box_world,
                            static_cast<double>(cluster.bounds.most_radius) * 0x1p-20) <= limit))
            return;
        const Eigen::Vector3d from = from_world - cluster.origin_world;
        for (std::size_t i = 0; i < cluster.size(); ++i) {
            if (!is_near(from, displacement, to_double(cluster.x[i], cluster.y[i], cluster.z[i]),
                         static_cast<double>(cluster.radius[i])))
                continue;
            const ObjectInstance& instance = cluster.instances[i];
            const auto& [x, y, z] = instance.offset_eye;
            const Eigen::Matrix3d world_from_object = rotation_of(instance.rotation);
            const Eigen::Matrix3d object_from_world =
                world_from_object.transpose() / static_cast<double>(instance.scale);
            const Eigen::Vector3d start = object_from_world * (from - to_double(x, y, z));
            const std::optional<MeshHit> hit =
                rays->ray(start, start + object_from_world * displacement);
            if (!hit || (first && !(hit->fraction < first->fraction))) continue;
            first = SceneHit{.node = node,
                             .object = cluster.object_index[i],
                             .fraction = hit->fraction,
                             .point_world = from_world + hit->fraction * displacement,
                             .normal = world_from_object * hit->normal,
                             .triangle = hit->triangle};
        }
    });
    return first;
}

// The object in the world frame.
PlacedObject place_in_world(const WorldPlace& place, const PlacedObject& object) {
    const Eigen::Matrix3d rotation = place.world_from_node.rotation * rotation_of(object.rotation);
    const Eigen::Quaterniond q(rotation);
    return {.position = place.world_from_node * Eigen::Vector3d(place.scale * object.position),
            .scale = static_cast<float>(place.scale * static_cast<double>(object.scale)),
            .rotation = {static_cast<float>(q.x()), static_cast<float>(q.y()),
                         static_cast<float>(q.z()), static_cast<float>(q.w())},
            .tint = object.tint};
}

bool is_identity(const WorldPlace& place) {
    return place.scale == 1.0 && place.world_from_node.translation == Eigen::Vector3d::Zero() &&
           place.world_from_node.rotation == Eigen::Matrix3d::Identity();
}

std::vector<ObjectCluster> make_clusters_at(const WorldPlace& place, const InstancesNode& node,
                                            std::span<const ObjectModel> models) {
    const auto model = static_cast<std::uint32_t>(node.model);
    if (is_identity(place)) return make_clusters(model, models[model].bounds, node.objects);
    std::vector<PlacedObject> objects;
    objects.reserve(node.objects.size());
    for (const PlacedObject& object : node.objects)
        objects.push_back(place_in_world(place, object));
    return make_clusters(model, models[model].bounds, objects);
}

// Whether content is culled apart from the tree, and must not be below nodes that change their children.
bool is_apart(const NodeContent& content) {
    return std::holds_alternative<InstancesNode>(content) ||
           std::holds_alternative<EmitterNode>(content);
}

// Whether a node moves or hides its children from frame to frame.
bool changes_children(const NodeContent& content) {
    return std::holds_alternative<SwitchNode>(content) ||
           std::holds_alternative<BillboardNode>(content);
}

}  // namespace
}  // namespace terrane::internal

namespace terrane {
namespace {

using internal::ClusterSet;
using internal::DemandHistogram;
using internal::DeviceObjects;
using internal::DrawList;
using internal::FactorCounts;
using internal::FrameObjects;
using internal::GraphNode;
using internal::InstanceDevice;
using internal::LevelChoice;
using internal::NearObject;
using internal::NodeFrame;
using internal::NodeStore;
using internal::ObjectCluster;
using internal::StreamedList;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

tl::unexpected<Error> no_such_node(NodeId node) {
    return fail(ErrorCode::invalid_argument,
                "the scene has no node " + number_text(static_cast<std::uint64_t>(node)));
}

tl::unexpected<Error> apart_below_change() {
    return fail(ErrorCode::invalid_argument,
                "instances and emitters cannot be below a switch or a billboard");
}

float log2_of_threshold(double threshold_px) {
    if (threshold_px >= 1e30) return std::numeric_limits<float>::infinity();
    if (!(threshold_px > 1e-30)) return -std::numeric_limits<float>::infinity();
    return internal::log2_of(static_cast<float>(threshold_px));
}

}  // namespace

struct Scene::State {
    explicit State(const SceneSettings& wanted)
        : settings(wanted), streamed(wanted.most_continuous) {}

    SceneSettings settings;
    std::vector<ObjectModel> models;
    std::vector<LevelChoice> choices;   // [models]
    std::vector<FactorCounts> factors;  // [models] of the frame
    NodeStore nodes;
    ClusterSet clusters;             // of instances
    std::size_t model_nodes = 0;     // nodes with a model
    std::size_t particle_nodes = 0;  // nodes with particles
    internal::Emitters emitters;
    std::optional<View> last_view;  // the last valid one

    // State of the current frame.
    double least_threshold_px = 0.0;
    SceneCounts counts;
    std::vector<const ObjectCluster*> in_view, casting;  // clusters of instances
    NodeFrame singles;
    FrameObjects objects, casters;
    DeviceObjects on_device;
    StreamedList streamed;  // of the nearest objects
    DemandHistogram histogram;
    std::vector<TriangleDemand> demands;
    DrawList drawn, cast;
    std::vector<ObjectInstance> instances;

    void clear_frame() {
        objects.clear();
        casters.clear();
        on_device.clear();
        streamed.clear();
        singles.clear();
    }
    void count(const NodeContent& content, std::ptrdiff_t change);
    void add_apart(NodeId node);
    void remove_apart(NodeId node);
    bool is_below_change(NodeId node) const;
    bool has_apart_below(NodeId node) const;
    Result<void> find_objects(const View& view, const ViewVolume& volume,
                              const HorizonMap* horizon_map, bool uses_device);
    void find_nearest();
    void find_casters(const View& view, const ViewVolume& volume,
                      const CasterVolume& caster_volume);
};

void Scene::State::count(const NodeContent& content, std::ptrdiff_t change) {
    if (std::holds_alternative<ModelNode>(content)) model_nodes += static_cast<std::size_t>(change);
    if (std::holds_alternative<ParticlesNode>(content))
        particle_nodes += static_cast<std::size_t>(change);
}

// Adds a node's clusters of instances, or its emitter.
void Scene::State::add_apart(NodeId node) {
    const NodeContent& content = nodes.at(node).content;
    if (std::holds_alternative<EmitterNode>(content)) emitters.add(node);
    const auto* of_node = std::get_if<InstancesNode>(&content);
    if (of_node == nullptr || of_node->objects.empty()) return;
    clusters.add(node, internal::make_clusters_at(nodes.place_world(node), *of_node, models));
}

// Removes a node's clusters of instances, to which the objects of the current frame refer, or its emitter.
void Scene::State::remove_apart(NodeId node) {
    emitters.remove(node);
    if (!std::holds_alternative<InstancesNode>(nodes.at(node).content)) return;
    clear_frame();
    for (const ObjectCluster& cluster : clusters.of_node(node)) on_device.remove(cluster);
    clusters.remove(node);
}

// Whether a node is, or is below, a switch or a billboard.
bool Scene::State::is_below_change(NodeId node) const {
    for (; node != NodeId{}; node = nodes.at(node).parent) {
        if (internal::changes_children(nodes.at(node).content)) return true;
    }
    return false;
}

bool Scene::State::has_apart_below(NodeId node) const {
    const std::vector<NodeId> all = nodes.subtree(node);
    return std::any_of(all.begin() + 1, all.end(),
                       [&](NodeId each) { return internal::is_apart(nodes.at(each).content); });
}

// Finds the objects of the clusters in view. Fails with device_unavailable if a device is used, and its memory does not
// suffice.
Result<void> Scene::State::find_objects(const View& view, const ViewVolume& volume,
                                        const HorizonMap* horizon_map, bool uses_device) {
    objects.begin(view, log2_of_threshold(least_threshold_px));
    on_device.clear();
    for (const ObjectCluster* cluster : in_view) {
        const LevelChoice& choice = choices[cluster->model];
        if (uses_device && on_device.takes(cluster->model)) {
            TERRANE_TRY(on_device.add(*cluster, choice, volume, horizon_map, objects));
        } else {
            objects.add(*cluster, choice, volume, horizon_map);
        }
    }
    for (const ObjectCluster* cluster : singles.models())
        objects.add(*cluster, choices[cluster->model], volume, horizon_map);
    return on_device.cull(view, volume, settings.far_distance, objects);
}

// Selects the objects with continuous levels, and removes them from the factor counts of their models.
void Scene::State::find_nearest() {
    if (!streamed.is_needed()) return;
    streamed.begin(log2_of_threshold(least_threshold_px));
    std::size_t place = 0;
    objects.visit([&](const ObjectCluster& cluster, const Eigen::Vector3f&, std::size_t object,
                      float log2_factor) {
        streamed.add({.key = {cluster.order, static_cast<std::uint32_t>(object)},
                      .model = cluster.model,
                      .place = place++,
                      .log2_factor = log2_factor});
    });
    streamed.select(histogram);
    for (const NearObject& object : streamed.near())
        factors[object.model].remove(object.log2_factor);
}

// Finds the objects out of view whose shadows can fall into the view.
void Scene::State::find_casters(const View& view, const ViewVolume& volume,
                                const CasterVolume& caster_volume) {
    clusters.find_casters(caster_volume, casting);
    casters.begin(view, log2_of_threshold(least_threshold_px));
    auto seen = in_view.begin();
    for (const ObjectCluster* cluster : casting) {
        // both lists are in the order of insertion
        while (seen != in_view.end() && (*seen)->order < cluster->order) ++seen;
        const bool is_in_view = seen != in_view.end() && *seen == cluster;
        casters.add_casters(*cluster, choices[cluster->model], volume, caster_volume, is_in_view);
    }
    for (const ObjectCluster* cluster : singles.casters())
        casters.add_casters(*cluster, choices[cluster->model], volume, caster_volume, false);
}

Result<Scene> Scene::create(const SceneSettings& settings) {
    TERRANE_TRY(check_range("fade_ratio", settings.fade_ratio, 1.0, kLeastLevelRatio));
    if (!(settings.far_distance > 0.0)) {
        return fail(ErrorCode::invalid_argument,
                    "far_distance must be above 0, got " + number_text(settings.far_distance));
    }
    return Scene(std::make_unique<State>(settings));
}

Scene::Scene(std::unique_ptr<State> state) : state_(std::move(state)) {}
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;
Scene::~Scene() = default;

Result<ModelId> Scene::add_model(const ObjectModel& model) {
    TERRANE_TRY(model.validate());
    State& state = *state_;
    const auto index = static_cast<std::uint32_t>(state.models.size());
    state.drawn.add_model(model);
    state.cast.add_model(model);
    state.streamed.add_model(model, state.settings.fade_ratio);
    state.choices.emplace_back(model, state.settings.fade_ratio);
    state.on_device.add_model(model, state.choices.back());
    state.factors.emplace_back();
    state.models.push_back(model);
    return ModelId{index};
}

NodeId Scene::root() const { return state_->nodes.root(); }

Result<NodeId> Scene::add(NodeId parent, const NodePlace& place, NodeContent content) {
    State& state = *state_;
    const GraphNode* above = state.nodes.find(parent);
    if (above == nullptr) return no_such_node(parent);
    if (above->depth >= NodeStore::kMostDepth) {
        return fail(ErrorCode::invalid_argument,
                    "nodes must be at most " + number_text(NodeStore::kMostDepth) + " deep");
    }
    TERRANE_TRY(internal::check_place(place));
    TERRANE_TRY(internal::check_content(content, state.models));
    if (internal::is_apart(content) && state.is_below_change(parent)) return apart_below_change();
    state.count(content, 1);
    const std::optional<Aabb> bounds = internal::bounds_of(content, state.models);
    const NodeId id = state.nodes.add(parent, place, std::move(content), bounds);
    state.add_apart(id);
    return id;
}

void Scene::remove(NodeId node) {
    State& state = *state_;
    if (node == root() || state.nodes.find(node) == nullptr) return;
    for (const NodeId each : state.nodes.subtree(node)) {
        state.count(state.nodes.at(each).content, -1);
        state.remove_apart(each);
    }
    state.nodes.remove(node);
}

Result<void> Scene::set_place(NodeId node, const NodePlace& place) {
    State& state = *state_;
    if (state.nodes.find(node) == nullptr) return no_such_node(node);
    TERRANE_TRY(internal::check_place(place));
    state.nodes.set_place(node, place);
    if (state.clusters.object_count() == 0) return {};
    for (const NodeId each : state.nodes.subtree(node)) {
        if (!std::holds_alternative<InstancesNode>(state.nodes.at(each).content)) continue;
        state.remove_apart(each);
        state.add_apart(each);
    }
    return {};
}

Result<void> Scene::set_content(NodeId node, NodeContent content) {
    State& state = *state_;
    GraphNode* found = state.nodes.find(node);
    if (found == nullptr) return no_such_node(node);
    TERRANE_TRY(internal::check_content(content, state.models));
    const bool is_hidden = internal::is_apart(content) && state.is_below_change(found->parent);
    const bool hides = internal::changes_children(content) && state.has_apart_below(node);
    if (is_hidden || hides) return apart_below_change();
    // an emitter that stays one keeps its places
    const bool is_emitter = std::holds_alternative<EmitterNode>(content);
    if (!(is_emitter && std::holds_alternative<EmitterNode>(found->content)))
        state.remove_apart(node);
    state.count(found->content, -1);
    state.count(content, 1);
    const std::optional<Aabb> bounds = internal::bounds_of(content, state.models);
    state.nodes.set_content(node, std::move(content), bounds);
    state.add_apart(node);
    return {};
}

void Scene::set_time(double time_s) { state_->emitters.set_time(time_s, state_->nodes); }

void Scene::set_device(internal::InstanceDevice* device) {
    state_->clear_frame();
    state_->on_device.set_device(device, state_->models, state_->choices);
}

std::size_t Scene::node_count() const { return state_->nodes.size(); }

std::size_t Scene::object_count() const {
    return state_->clusters.object_count() + state_->model_nodes;
}

std::optional<Aabb> Scene::bounds_world(NodeId node) const {
    NodeStore& nodes = state_->nodes;
    if (nodes.find(node) == nullptr) return {};
    std::optional<Aabb> bounds_world;
    if (const std::optional<Aabb>& bounds = nodes.bounds(node); bounds) {
        const internal::WorldPlace place = nodes.place_world(node);
        bounds_world = bounding_box(transform(place.world_from_node, place.scale, *bounds));
    }
    if (state_->clusters.object_count() == 0) return bounds_world;
    for (const NodeId each : nodes.subtree(node)) {
        for (const ObjectCluster& cluster : state_->clusters.of_node(each))
            internal::unite(cluster.bounds.box_world, bounds_world);
    }
    return bounds_world;
}

std::span<const TriangleDemand> Scene::begin_frame(const View& view, double least_threshold_px,
                                                   const std::optional<SunShadows>& shadows,
                                                   const HorizonMap* horizon_map) {
    State& state = *state_;
    state.counts = {};
    state.counts.objects = object_count();
    state.demands.clear();
    state.clear_frame();
    if (!view.validate()) return {};
    state.last_view = view;
    const bool has_singles =
        state.model_nodes + state.particle_nodes > 0 || !state.emitters.empty();
    if (object_count() == 0 && !has_singles) return {};
    const ViewVolume volume(view, state.settings.far_distance);
    std::optional<CasterVolume> caster_volume;
    if (shadows && has_shadows(*shadows)) caster_volume.emplace(view, *shadows);
    state.clusters.cull(volume, state.settings.cull_test, state.in_view);
    if (has_singles) {
        state.singles.collect(state.nodes, state.emitters, state.models, view,
                              std::max(least_threshold_px, 0.0), volume,
                              caster_volume ? &*caster_volume : nullptr);
    }
    state.least_threshold_px = std::max(least_threshold_px, 0.0);
    if (caster_volume || (horizon_map != nullptr && !horizon_map->is_of(view)))
        horizon_map = nullptr;
    if (!state.find_objects(view, volume, horizon_map, state.on_device.has_device()))
        (void)state.find_objects(view, volume, horizon_map, false);
    state.histogram.clear();
    state.objects.count_factors(state.factors);
    state.on_device.count_factors(state.factors);
    state.find_nearest();
    for (std::size_t model = 0; model < state.choices.size(); ++model)
        state.choices[model].add_to(state.factors[model], state.histogram);
    state.histogram.append_to(state.demands);
    const std::size_t particles = state.singles.particles().size();
    if (particles > 0)
        state.demands.push_back({kInfinity, static_cast<std::uint32_t>(2 * particles)});
    state.counts.particles = particles;
    state.counts.culled_nodes = state.singles.culled();
    const InstanceDevice::Culled& on_device = state.on_device.culled();
    const std::size_t found = state.objects.size() + on_device.taken;
    state.counts.in_view = found + state.objects.left_out() + on_device.left_out;
    state.counts.occluded = state.objects.occluded() + on_device.occluded;
    const std::size_t large = found + state.counts.occluded;
    if (large > 0) {
        state.counts.occluded_share =
            static_cast<double>(state.counts.occluded) / static_cast<double>(large);
    }
    if (caster_volume) state.find_casters(view, volume, *caster_volume);
    return state.demands;
}

SceneDraws Scene::end_frame(double threshold_px) {
    State& state = *state_;
    const float log2_threshold =
        log2_of_threshold(std::max(threshold_px, state.least_threshold_px));
    const std::span<const Particle> particles =
        threshold_px < kInfinity ? state.singles.particles() : std::span<const Particle>();
    state.instances.clear();
    state.drawn.make(state.objects, state.models, state.choices, log2_threshold,
                     state.streamed.near(), state.instances);
    state.streamed.make(state.drawn.near(), state.models, log2_threshold);
    state.cast.make(state.casters, state.models, state.choices, log2_threshold, {},
                    state.instances);
    state.on_device.make(state.models, log2_threshold);
    state.counts.drawn = state.drawn.object_count() + state.on_device.object_count();
    state.counts.left_out = state.counts.in_view - state.counts.drawn;
    state.counts.continuous = state.streamed.draws().size();
    state.counts.triangles = state.drawn.triangle_count() + state.on_device.triangle_count() +
                             state.streamed.triangle_count() + 2 * particles.size();
    state.counts.casters = state.cast.object_count();
    return {.instances = state.instances,
            .meshes = state.drawn.meshes(),
            .streamed = state.streamed.draws(),
            .impostors = state.drawn.impostors(),
            .particles = particles,
            .caster_meshes = state.cast.meshes(),
            .caster_impostors = state.cast.impostors(),
            .device = state.on_device.instances(),
            .device_meshes = state.on_device.meshes(),
            .device_impostors = state.on_device.impostors()};
}

const SceneCounts& Scene::counts() const { return state_->counts; }

std::optional<SceneHit> Scene::ray(const WorldPos& from_world, const WorldPos& to_world) const {
    State& state = *state_;
    const std::optional<SceneHit> instance =
        internal::find_instance_hit(state.clusters, state.models, from_world, to_world);
    if (state.model_nodes == 0) return instance;
    const std::optional<internal::NodeRayHit> model = internal::find_node_hit(
        state.nodes, state.models, state.last_view ? &*state.last_view : nullptr, from_world,
        to_world);
    if (!model) return instance;
    const double fraction = model->mesh.fraction;
    if (instance && (instance->fraction < fraction ||
                     (instance->fraction == fraction && instance->node < model->node)))
        return instance;
    return SceneHit{.node = model->node,
                    .object = 0,
                    .fraction = fraction,
                    .point_world = from_world + fraction * (to_world - from_world),
                    .normal = model->normal_world,
                    .triangle = model->mesh.triangle};
}

}  // namespace terrane
