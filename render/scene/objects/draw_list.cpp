// SPDX-License-Identifier: MIT
#include "objects/draw_list.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Takes the meshes out of what is drawn of an object, and returns the coverage of what is drawn in their place: 0 where
// there is none among them.
float take_meshes(const ObjectModel& model, ChosenLevels& levels) {
    const auto is_mesh = [&](std::uint32_t level) {
        return level != ChosenLevels::kNone && !model.levels[level].is_impostor;
    };
    if (!is_mesh(levels.finer)) return 0.0f;
    levels.finer = ChosenLevels::kNone;
    if (!is_mesh(levels.coarser)) return std::min(levels.share, 1.0f);
    levels.coarser = ChosenLevels::kNone;
    return 1.0f;
}

}  // namespace

void DrawList::add_model(const ObjectModel& model) {
    const auto index = static_cast<std::uint32_t>(first_bucket_.size());
    first_bucket_.push_back(static_cast<std::uint32_t>(buckets_.size()));
    for (std::uint32_t level = 0; level < model.levels.size(); ++level)
        buckets_.push_back({index, level, 0, 0});
}

void DrawList::make(const FrameObjects& objects, std::span<const ObjectModel> models,
                    std::span<const LevelChoice> choices, float log2_threshold,
                    std::span<const NearObject> near, std::vector<ObjectInstance>& instances_out) {
    choose(objects, models, choices, log2_threshold, near);
    lay_out(models, instances_out);
    fill(objects, instances_out);
}

void DrawList::choose(const FrameObjects& objects, std::span<const ObjectModel> models,
                      std::span<const LevelChoice> choices, float log2_threshold,
                      std::span<const NearObject> near) {
    for (Bucket& bucket : buckets_) bucket.count = 0;
    object_count_ = 0;
    near_.clear();
    near_places_.clear();
    chosen_.resize(objects.size());
    std::size_t i = 0, next_near = 0;
    objects.visit(
        [&](const ObjectCluster& cluster, const Eigen::Vector3f&, std::size_t, float log2_factor) {
            ChosenLevels levels = choices[cluster.model].choose(log2_factor, log2_threshold);
            object_count_ += levels.finer != ChosenLevels::kNone ? 1 : 0;
            if (next_near < near.size() && near[next_near].place == i) {
                const float coverage = take_meshes(models[cluster.model], levels);
                if (coverage > 0.0f) {
                    near_.push_back({.object = next_near});
                    near_places_.push_back({i, coverage});
                }
                ++next_near;
            }
            const std::uint32_t first = first_bucket_[cluster.model];
            if (levels.finer != ChosenLevels::kNone) ++buckets_[first + levels.finer].count;
            if (levels.coarser != ChosenLevels::kNone) ++buckets_[first + levels.coarser].count;
            chosen_[i++] = levels;
        });
}

void DrawList::lay_out(std::span<const ObjectModel> models,
                       std::vector<ObjectInstance>& instances_out) {
    meshes_.clear();
    impostors_.clear();
    triangle_count_ = 0;
    auto first = static_cast<std::uint32_t>(instances_out.size());
    for (Bucket& bucket : buckets_) {
        bucket.first = first;
        first += bucket.count;
        if (bucket.count == 0) continue;
        const ObjectModel& model = models[bucket.model];
        const ObjectLevel& level = model.levels[bucket.level];
        triangle_count_ += std::size_t{bucket.count} * level.triangles;
        if (level.is_impostor) {
            impostors_.push_back({*model.impostor, bucket.first, bucket.count});
        } else {
            meshes_.push_back({model.mesh, level.mesh_level, bucket.first, bucket.count});
        }
    }
    for (NearDraw& draw : near_) draw.instance = first++;
    instances_out.resize(first);
}

void DrawList::fill(const FrameObjects& objects, std::span<ObjectInstance> instances) {
    std::size_t i = 0, next_near = 0;
    objects.visit([&](const ObjectCluster& cluster, const Eigen::Vector3f& origin_eye,
                      std::size_t object, float) {
        const ChosenLevels& levels = chosen_[i];
        const auto set = [&](ObjectInstance& instance, float coverage) {
            instance = cluster.instances[object];
            for (std::size_t axis = 0; axis < 3; ++axis)
                instance.offset_eye[axis] += origin_eye[static_cast<int>(axis)];
            instance.coverage = coverage;
        };
        const auto place = [&](std::uint32_t level, float coverage) {
            if (level == ChosenLevels::kNone) return;
            set(instances[buckets_[first_bucket_[cluster.model] + level].first++], coverage);
        };
        place(levels.finer, levels.share);
        place(levels.coarser, levels.share - 1.0f);
        if (next_near < near_.size() && near_places_[next_near].place == i) {
            set(instances[near_[next_near].instance], near_places_[next_near].coverage);
            ++next_near;
        }
        ++i;
    });
}

}  // namespace terrane::internal
