// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "objects/cluster_set.h"
#include "objects/frame_objects.h"
#include "objects/object_cluster.h"
#include "objects/scene_ray.h"

#include <terrane/scene/scene.h>
#include <terrane/terrain/number_text.h>

#include <cmath>
#include <string>
#include <utility>

namespace terrane {
namespace {

using internal::ChosenLevels;
using internal::ClusterSet;
using internal::DemandHistogram;
using internal::FactorCounts;
using internal::FrameObjects;
using internal::LevelChoice;
using internal::ObjectCluster;

constexpr double kMostCoordinate = 1e9;

Result<void> check_object(const PlacedObject& object, std::size_t index) {
    const auto refuse = [&](const std::string& message) {
        return fail(ErrorCode::invalid_argument, message + " of object " + number_text(index));
    };
    for (int axis = 0; axis < 3; ++axis) {
        const double value = object.position_world[axis];
        if (!(std::abs(value) <= kMostCoordinate))
            return refuse("coordinates must be within 1e9 m, got " + number_text(value));
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
    explicit State(const SceneSettings& wanted) : settings(wanted) {}

    // Instances that are drawn with one call.
    struct Bucket {
        std::uint32_t model = 0, level = 0;
        std::uint32_t count = 0, first = 0;
    };

    SceneSettings settings;
    std::vector<ObjectModel> models;
    std::vector<LevelChoice> choices;         // [models]
    std::vector<FactorCounts> factors;        // [models] of the frame
    std::vector<std::uint32_t> first_bucket;  // [models]
    ClusterSet clusters;
    std::uint64_t last_group = 0;

    // Of the frame.
    double least_threshold_px = 0.0;
    SceneCounts counts;
    std::vector<const ObjectCluster*> in_view;
    FrameObjects objects;
    DemandHistogram histogram;
    std::vector<TriangleDemand> demands;
    std::vector<ChosenLevels> chosen;  // [objects in view]
    std::vector<Bucket> buckets;       // [levels of all models]
    std::vector<ObjectInstance> instances;
    std::vector<MeshDraw> mesh_draws;
    std::vector<ImpostorDraw> impostor_draws;

    void choose(float log2_threshold);
    void lay_out();
    void fill();
};

void Scene::State::choose(float log2_threshold) {
    for (Bucket& bucket : buckets) bucket.count = 0;
    chosen.resize(objects.size());
    std::size_t i = 0;
    objects.visit(
        [&](const ObjectCluster& cluster, const Eigen::Vector3f&, std::size_t, float log2_factor) {
            const ChosenLevels levels = choices[cluster.model].choose(log2_factor, log2_threshold);
            const std::uint32_t first = first_bucket[cluster.model];
            const bool has_finer = levels.finer != ChosenLevels::kNone;
            if (has_finer) ++buckets[first + levels.finer].count;
            if (levels.coarser != ChosenLevels::kNone) ++buckets[first + levels.coarser].count;
            counts.drawn += has_finer ? 1 : 0;
            chosen[i++] = levels;
        });
    counts.left_out = counts.in_view - counts.drawn;
}

void Scene::State::lay_out() {
    mesh_draws.clear();
    impostor_draws.clear();
    std::uint32_t first = 0;
    for (Bucket& bucket : buckets) {
        bucket.first = first;
        first += bucket.count;
        if (bucket.count == 0) continue;
        const ObjectModel& model = models[bucket.model];
        const ObjectLevel& level = model.levels[bucket.level];
        counts.triangles += std::size_t{bucket.count} * level.triangles;
        if (level.is_impostor) {
            impostor_draws.push_back({*model.impostor, bucket.first, bucket.count});
        } else {
            mesh_draws.push_back({model.mesh, level.mesh_level, bucket.first, bucket.count});
        }
    }
    instances.resize(first);
}

void Scene::State::fill() {
    std::size_t i = 0;
    objects.visit([&](const ObjectCluster& cluster, const Eigen::Vector3f& origin_eye,
                      std::size_t object, float) {
        const ChosenLevels& levels = chosen[i++];
        const auto place = [&](std::uint32_t level, float coverage) {
            if (level == ChosenLevels::kNone) return;
            ObjectInstance& instance =
                instances[buckets[first_bucket[cluster.model] + level].first++];
            instance = cluster.instances[object];
            for (std::size_t axis = 0; axis < 3; ++axis)
                instance.offset_eye[axis] += origin_eye[static_cast<int>(axis)];
            instance.coverage = coverage;
        };
        place(levels.finer, levels.share);
        place(levels.coarser, levels.share - 1.0f);
    });
}

Result<Scene> Scene::create(const SceneSettings& settings) {
    if (auto ok = check_range("fade_ratio", settings.fade_ratio, 1.0, kLeastLevelRatio); !ok)
        return tl::unexpected(ok.error());
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
    if (auto ok = check(model); !ok) return tl::unexpected(ok.error());
    State& state = *state_;
    const auto index = static_cast<std::uint32_t>(state.models.size());
    state.first_bucket.push_back(static_cast<std::uint32_t>(state.buckets.size()));
    for (std::uint32_t level = 0; level < model.levels.size(); ++level)
        state.buckets.push_back({index, level, 0, 0});
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
        if (auto ok = check_object(objects[i], i); !ok) return tl::unexpected(ok.error());
    }
    const GroupId id{++state.last_group};
    if (!objects.empty()) {
        state.clusters.add(id, internal::make_clusters(index, state.models[index].bounds, objects));
    }
    return id;
}

void Scene::remove_group(GroupId group) {
    state_->objects.clear();  // they refer to clusters
    state_->clusters.remove(group);
}

std::size_t Scene::object_count() const { return state_->clusters.object_count(); }

std::span<const TriangleDemand> Scene::begin_frame(const View& view, double least_threshold_px,
                                                   const HorizonMap* horizon) {
    State& state = *state_;
    state.counts = {};
    state.counts.objects = object_count();
    state.demands.clear();
    if (object_count() == 0 || !check(view)) {
        state.objects.clear();
        return {};
    }
    const ViewVolume volume(view, state.settings.far_distance);
    state.clusters.cull(volume, state.settings.cull_test, state.in_view);
    state.least_threshold_px = std::max(least_threshold_px, 0.0);
    state.objects.begin(view, log2_of_threshold(state.least_threshold_px));
    if (horizon != nullptr && !horizon->is_of(view)) horizon = nullptr;
    for (const ObjectCluster* cluster : state.in_view)
        state.objects.add(*cluster, state.choices[cluster->model], volume, horizon);
    state.histogram.clear();
    state.objects.count_factors(state.factors);
    for (std::size_t model = 0; model < state.choices.size(); ++model)
        state.choices[model].add_to(state.factors[model], state.histogram);
    state.histogram.append_to(state.demands);
    state.counts.in_view = state.objects.size() + state.objects.left_out();
    state.counts.occluded = state.objects.occluded();
    return state.demands;
}

SceneDraws Scene::end_frame(double threshold_px) {
    State& state = *state_;
    state.counts.drawn = state.counts.left_out = state.counts.triangles = 0;
    state.choose(log2_of_threshold(std::max(threshold_px, state.least_threshold_px)));
    state.lay_out();
    state.fill();
    return {.instances = state.instances,
            .meshes = state.mesh_draws,
            .streamed = {},
            .impostors = state.impostor_draws,
            .particles = {}};
}

const SceneCounts& Scene::counts() const { return state_->counts; }

std::optional<SceneHit> Scene::ray(const WorldPos& from_world, const WorldPos& to_world) const {
    return internal::find_hit(state_->clusters, state_->models, from_world, to_world);
}

}  // namespace terrane
