// SPDX-License-Identifier: MIT
#include "base/aabb_tree.h"
#include "base/settings_check.h"
#include "base/vector_math.h"
#include "objects/continuous_levels.h"
#include "objects/frame_objects.h"
#include "objects/object_clusters.h"

#include <terrane/base/text.h>
#include <terrane/scene/object_model.h>
#include <terrane/scene/scene.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace terrane::internal {

/// The first object that a segment hits; ties go to the first one in the order of groups and clusters.
///
/// @param models indexed by ObjectCluster::model
std::optional<SceneHit> find_hit(const ClusterSet& clusters, std::span<const ObjectModel> models,
                                 const WorldPos& from_world, const WorldPos& to_world);

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

}  // namespace

std::optional<SceneHit> find_hit(const ClusterSet& clusters, std::span<const ObjectModel> models,
                                 const WorldPos& from_world, const WorldPos& to_world) {
    const Eigen::Vector3d displacement = to_world - from_world;
    if (!displacement.allFinite() || displacement == Eigen::Vector3d::Zero()) return std::nullopt;
    std::optional<SceneHit> first;
    clusters.visit([&](GroupId group, const ObjectCluster& cluster) {
        const std::optional<MeshRays>& rays = models[cluster.model].rays;
        if (!rays) return;
        const double limit = first ? first->fraction : 1.0;
        if (!(segment_entry(from_world, displacement, cluster.bounds_world,
                            static_cast<double>(cluster.most_radius) * 0x1p-20) <= limit))
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
            first = SceneHit{.group = group,
                             .object = cluster.group_index[i],
                             .fraction = hit->fraction,
                             .point_world = from_world + hit->fraction * displacement,
                             .normal = world_from_object * hit->normal,
                             .triangle = hit->triangle};
        }
    });
    return first;
}

}  // namespace terrane::internal

namespace terrane {
namespace {

using internal::ClusterSet;
using internal::DemandHistogram;
using internal::DrawList;
using internal::FactorCounts;
using internal::FrameObjects;
using internal::LevelChoice;
using internal::NearObject;
using internal::ObjectCluster;
using internal::StreamedList;

constexpr double kMostCoordinate = 2e9;

Result<void> check_object(const PlacedObject& object, std::size_t index) {
    const auto refuse = [&](const std::string& message) {
        return fail(ErrorCode::invalid_argument, message + " of object " + number_text(index));
    };
    for (int axis = 0; axis < 3; ++axis) {
        const double value = object.position_world[axis];
        if (!(std::abs(value) <= kMostCoordinate))
            return refuse("coordinates must be within 2e9 m, got " + number_text(value));
    }
    if (!(object.scale >= 1e-6f && object.scale <= 1e6f)) {
        return refuse("scale must be 1e-6 to 1e6, got " +
                      number_text(static_cast<double>(object.scale)));
    }
    double squared = 0.0;
    for (const float q : object.rotation)
        squared += static_cast<double>(q) * static_cast<double>(q);
    if (!(std::abs(squared - 1.0) <= 2e-3))
        return refuse("the quaternion must have unit length, got " +
                      number_text(std::sqrt(squared)));
    for (const float value : object.tint) {
        if (!std::isfinite(value)) return refuse("the tint must be finite");
    }
    return {};
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
    ClusterSet clusters;
    std::uint64_t last_group = 0;

    // State of the current frame.
    double least_threshold_px = 0.0;
    SceneCounts counts;
    std::vector<const ObjectCluster*> in_view, casting;  // clusters
    FrameObjects objects, casters;
    StreamedList streamed;  // of the nearest objects
    DemandHistogram histogram;
    std::vector<TriangleDemand> demands;
    DrawList drawn, cast;
    std::vector<ObjectInstance> instances;

    void clear_objects() {
        objects.clear();
        casters.clear();
        streamed.clear();
    }
    void find_nearest();
    void find_casters(const View& view, const ViewVolume& volume, const SunShadows& shadows);
};

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
                                const SunShadows& shadows) {
    const CasterVolume caster_volume(view, shadows);
    clusters.find_casters(caster_volume, casting);
    casters.begin(view, log2_of_threshold(least_threshold_px));
    auto seen = in_view.begin();
    for (const ObjectCluster* cluster : casting) {
        // both lists are in the order of insertion
        while (seen != in_view.end() && (*seen)->order < cluster->order) ++seen;
        const bool is_in_view = seen != in_view.end() && *seen == cluster;
        casters.add_casters(*cluster, choices[cluster->model], volume, caster_volume, is_in_view);
    }
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
    state.factors.emplace_back();
    state.models.push_back(model);
    return ModelId{index};
}

Result<GroupId> Scene::add_group(ModelId model, std::span<const PlacedObject> objects) {
    State& state = *state_;
    const auto index = static_cast<std::uint32_t>(model);
    if (index >= state.models.size()) {
        return fail(ErrorCode::invalid_argument, "there is no model " + number_text(index) +
                                                     " of " + number_text(state.models.size()));
    }
    for (std::size_t i = 0; i < objects.size(); ++i) {
        TERRANE_TRY(check_object(objects[i], i));
    }
    const GroupId id{++state.last_group};
    if (!objects.empty()) {
        state.clusters.add(id, internal::make_clusters(index, state.models[index].bounds, objects));
    }
    return id;
}

void Scene::remove_group(GroupId group) {
    state_->clear_objects();  // they refer to clusters
    state_->clusters.remove(group);
}

std::size_t Scene::object_count() const { return state_->clusters.object_count(); }

std::span<const TriangleDemand> Scene::begin_frame(const View& view, double least_threshold_px,
                                                   const std::optional<SunShadows>& shadows,
                                                   const HorizonMap* horizon_map) {
    State& state = *state_;
    state.counts = {};
    state.counts.objects = object_count();
    state.demands.clear();
    state.clear_objects();
    if (object_count() == 0 || !view.validate()) return {};
    const ViewVolume volume(view, state.settings.far_distance);
    state.clusters.cull(volume, state.settings.cull_test, state.in_view);
    state.least_threshold_px = std::max(least_threshold_px, 0.0);
    state.objects.begin(view, log2_of_threshold(state.least_threshold_px));
    const bool has_casters = shadows && has_shadows(*shadows);
    if (has_casters || (horizon_map != nullptr && !horizon_map->is_of(view))) horizon_map = nullptr;
    for (const ObjectCluster* cluster : state.in_view)
        state.objects.add(*cluster, state.choices[cluster->model], volume, horizon_map);
    state.histogram.clear();
    state.objects.count_factors(state.factors);
    state.find_nearest();
    for (std::size_t model = 0; model < state.choices.size(); ++model)
        state.choices[model].add_to(state.factors[model], state.histogram);
    state.histogram.append_to(state.demands);
    state.counts.in_view = state.objects.size() + state.objects.left_out();
    state.counts.occluded = state.objects.occluded();
    const std::size_t large = state.objects.size() + state.objects.occluded();
    if (large > 0) {
        state.counts.occluded_share =
            static_cast<double>(state.objects.occluded()) / static_cast<double>(large);
    }
    if (has_casters) state.find_casters(view, volume, *shadows);
    return state.demands;
}

SceneDraws Scene::end_frame(double threshold_px) {
    State& state = *state_;
    const float log2_threshold =
        log2_of_threshold(std::max(threshold_px, state.least_threshold_px));
    state.instances.clear();
    state.drawn.make(state.objects, state.models, state.choices, log2_threshold,
                     state.streamed.near(), state.instances);
    state.streamed.make(state.drawn.near(), state.models, log2_threshold);
    state.cast.make(state.casters, state.models, state.choices, log2_threshold, {},
                    state.instances);
    state.counts.drawn = state.drawn.object_count();
    state.counts.left_out = state.counts.in_view - state.counts.drawn;
    state.counts.continuous = state.streamed.draws().size();
    state.counts.triangles = state.drawn.triangle_count() + state.streamed.triangle_count();
    state.counts.casters = state.cast.object_count();
    return {.instances = state.instances,
            .meshes = state.drawn.meshes(),
            .streamed = state.streamed.draws(),
            .impostors = state.drawn.impostors(),
            .particles = {},
            .caster_meshes = state.cast.meshes(),
            .caster_impostors = state.cast.impostors()};
}

const SceneCounts& Scene::counts() const { return state_->counts; }

std::optional<SceneHit> Scene::ray(const WorldPos& from_world, const WorldPos& to_world) const {
    return internal::find_hit(state_->clusters, state_->models, from_world, to_world);
}

}  // namespace terrane
