// SPDX-License-Identifier: MIT
#include "objects/draw_list.h"

namespace terrane::internal {

void DrawList::add_model(const ObjectModel& model) {
    const auto index = static_cast<std::uint32_t>(first_bucket_.size());
    first_bucket_.push_back(static_cast<std::uint32_t>(buckets_.size()));
    for (std::uint32_t level = 0; level < model.levels.size(); ++level)
        buckets_.push_back({index, level, 0, 0});
}

void DrawList::make(const FrameObjects& objects, std::span<const ObjectModel> models,
                    std::span<const LevelChoice> choices, float log2_threshold,
                    std::vector<ObjectInstance>& instances_out) {
    choose(objects, choices, log2_threshold);
    lay_out(models, instances_out);
    fill(objects, instances_out);
}

void DrawList::choose(const FrameObjects& objects, std::span<const LevelChoice> choices,
                      float log2_threshold) {
    for (Bucket& bucket : buckets_) bucket.count = 0;
    object_count_ = 0;
    chosen_.resize(objects.size());
    std::size_t i = 0;
    objects.visit(
        [&](const ObjectCluster& cluster, const Eigen::Vector3f&, std::size_t, float log2_factor) {
            const ChosenLevels levels = choices[cluster.model].choose(log2_factor, log2_threshold);
            const std::uint32_t first = first_bucket_[cluster.model];
            const bool has_finer = levels.finer != ChosenLevels::kNone;
            if (has_finer) ++buckets_[first + levels.finer].count;
            if (levels.coarser != ChosenLevels::kNone) ++buckets_[first + levels.coarser].count;
            object_count_ += has_finer ? 1 : 0;
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
    instances_out.resize(first);
}

void DrawList::fill(const FrameObjects& objects, std::span<ObjectInstance> instances) {
    std::size_t i = 0;
    objects.visit([&](const ObjectCluster& cluster, const Eigen::Vector3f& origin_eye,
                      std::size_t object, float) {
        const ChosenLevels& levels = chosen_[i++];
        const auto place = [&](std::uint32_t level, float coverage) {
            if (level == ChosenLevels::kNone) return;
            ObjectInstance& instance =
                instances[buckets_[first_bucket_[cluster.model] + level].first++];
            instance = cluster.instances[object];
            for (std::size_t axis = 0; axis < 3; ++axis)
                instance.offset_eye[axis] += origin_eye[static_cast<int>(axis)];
            instance.coverage = coverage;
        };
        place(levels.finer, levels.share);
        place(levels.coarser, levels.share - 1.0f);
    });
}

}  // namespace terrane::internal
