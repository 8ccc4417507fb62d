// SPDX-License-Identifier: MIT
#include "objects/device_objects.h"

#include <cmath>

namespace terrane::internal {

void DeviceObjects::set_device(InstanceDevice* device, std::span<const ObjectModel> models,
                               std::span<const LevelChoice> choices) {
    clear();
    firsts_.clear();
    if (device_ != nullptr) device_->clear();
    device_ = device;
    if (device_ == nullptr) return;
    device_->clear();
    for (std::size_t i = 0; i < models.size(); ++i)
        device_->add_model(choices[i].on_device(models[i]));
}

void DeviceObjects::add_model(const ObjectModel& model, const LevelChoice& choice) {
    takes_.push_back(model.continuous == nullptr &&
                     model.levels.size() <= InstanceDevice::kMostLevels);
    of_model_.emplace_back();
    if (device_ != nullptr) device_->add_model(choice.on_device(model));
}

void DeviceObjects::remove(const ObjectCluster& cluster) {
    const auto found = firsts_.find(&cluster);
    if (found == firsts_.end()) return;
    device_->remove(found->second, cluster.size());
    firsts_.erase(found);
}

void DeviceObjects::clear() {
    for (Groups& groups : of_model_) {
        groups.clusters.clear();
        groups.groups.clear();
    }
    groups_.clear();
    culled_ = {};
    instances_ = nullptr;
    meshes_.clear();
    impostors_.clear();
    object_count_ = triangle_count_ = 0;
}

Result<std::uint32_t> DeviceObjects::first_object(const ObjectCluster& cluster) {
    if (const auto found = firsts_.find(&cluster); found != firsts_.end()) return found->second;
    staging_.clear();
    for (std::size_t i = 0; i < cluster.size(); ++i) {
        const ObjectInstance& instance = cluster.instances[i];
        staging_.push_back({.centre = {cluster.x[i], cluster.y[i], cluster.z[i]},
                            .radius = cluster.radius[i],
                            .offset = instance.offset_eye,
                            .scale = instance.scale,
                            .rotation = instance.rotation,
                            .log_scale = cluster.log_scale[i],
                            .tint = instance.tint});
    }
    TERRANE_TRY(const std::uint32_t first, device_->add(staging_));
    firsts_.emplace(&cluster, first);
    return first;
}

Result<void> DeviceObjects::add(const ObjectCluster& cluster, const LevelChoice& choice,
                                const ViewVolume& volume, const HorizonMap* horizon_map,
                                FrameObjects& objects) {
    Groups& of_model = of_model_[cluster.model];
    const auto number = static_cast<std::uint32_t>(of_model.clusters.size());
    const std::size_t group_count = of_model.groups.size();
    objects.visit_groups(
        cluster, choice, volume, horizon_map,
        [&](std::size_t first, std::size_t end, std::uint8_t planes, std::uint32_t hidden) {
            of_model.groups.push_back({.first_object = static_cast<std::uint32_t>(first),
                                       .cluster = number,
                                       .count_and_planes = static_cast<std::uint32_t>(end - first) |
                                                           std::uint32_t{planes} << 8,
                                       .hidden = hidden});
        });
    if (of_model.groups.size() == group_count) return {};
    TERRANE_TRY(const std::uint32_t first_of_cluster, first_object(cluster));
    for (std::size_t i = group_count; i < of_model.groups.size(); ++i)
        of_model.groups[i].first_object += first_of_cluster;
    const WorldPos& origin = cluster.origin_world;
    const Eigen::Vector3f origin_eye = to_local(origin, volume.eye_world());
    of_model.clusters.push_back({.origin_world = {origin.x(), origin.y(), origin.z()},
                                 .origin_eye = {origin_eye.x(), origin_eye.y(), origin_eye.z()},
                                 .model = cluster.model});
    return {};
}

Result<void> DeviceObjects::cull(const View& view, const ViewVolume& volume, double far_distance,
                                 const FrameObjects& objects) {
    clusters_.clear();
    groups_.clear();
    group_of_model_.assign(1, 0);
    for (const Groups& of_model : of_model_) {
        const auto first_cluster = static_cast<std::uint32_t>(clusters_.size());
        clusters_.insert(clusters_.end(), of_model.clusters.begin(), of_model.clusters.end());
        for (DeviceGroup group : of_model.groups) {
            group.cluster += first_cluster;
            groups_.push_back(group);
        }
        group_of_model_.push_back(static_cast<std::uint32_t>(groups_.size()));
    }
    if (groups_.empty()) return {};
    DeviceFrame frame;
    frame.view = view;
    frame.normals = volume.normals();
    frame.far_distance = std::isfinite(far_distance) ? far_distance : 0.0;
    frame.near_distance = objects.near_distance();
    frame.log2_pixels = objects.log2_pixels();
    frame.log2_least = objects.log2_least();
    frame.clusters = clusters_;
    frame.groups = groups_;
    frame.group_of_model = group_of_model_;
    TERRANE_TRY(culled_, device_->cull(frame));
    return {};
}

void DeviceObjects::count_factors(std::span<FactorCounts> counts) {
    if (culled_.taken == 0) return;
    for (std::uint32_t model = 0; model < counts.size(); ++model) {
        if (group_of_model_[model] < group_of_model_[model + 1])
            counts[model].add(device_->factor_counts(model));
    }
}

void DeviceObjects::make(std::span<const ObjectModel> models, float log2_threshold) {
    instances_ = nullptr;
    meshes_.clear();
    impostors_.clear();
    object_count_ = triangle_count_ = 0;
    // nothing is drawn at an infinite threshold
    if (culled_.taken == 0 || log2_threshold == std::numeric_limits<float>::infinity()) return;
    const InstanceDevice::Chosen chosen = device_->choose(log2_threshold);
    instances_ = chosen.instances;
    object_count_ = chosen.objects;
    std::uint32_t first = 0;
    for (std::size_t i = 0; i < models.size(); ++i) {
        for (std::size_t level = 0; takes_[i] && level < models[i].levels.size(); ++level) {
            const std::uint32_t count = chosen.counts[InstanceDevice::kMostLevels * i + level];
            if (count == 0) continue;
            const ObjectLevel& of_level = models[i].levels[level];
            triangle_count_ += std::size_t{count} * of_level.triangles;
            if (of_level.is_impostor) {
                impostors_.push_back({*models[i].impostor, first, count});
            } else {
                meshes_.push_back({models[i].mesh, of_level.mesh_level, first, count});
            }
            first += count;
        }
    }
}

}  // namespace terrane::internal
