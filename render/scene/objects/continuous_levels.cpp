// SPDX-License-Identifier: MIT
#include "objects/continuous_levels.h"

#include <algorithm>
#include <utility>

namespace terrane::internal {
namespace {

// log2(9 / 8): an object must be nearer by this ratio to replace another one.
constexpr float kNearer = 0.169925f;

}  // namespace

void NearObjects::select() {
    if (objects_.size() > most_) {
        ranked_.clear();
        auto was_near = were_near_.begin();
        for (std::size_t i = 0; i < objects_.size(); ++i) {
            // both lists are in the order of keys
            while (was_near != were_near_.end() && *was_near < objects_[i].key) ++was_near;
            const bool stays = was_near != were_near_.end() && *was_near == objects_[i].key;
            ranked_.push_back({objects_[i].log2_factor + (stays ? kNearer : 0.0f),
                               static_cast<std::uint32_t>(i)});
        }
        const auto most = static_cast<std::ptrdiff_t>(most_);
        std::nth_element(ranked_.begin(), ranked_.begin() + most, ranked_.end(),
                         [](const Ranked& a, const Ranked& b) {
                             return a.nearness != b.nearness ? a.nearness > b.nearness
                                                             : a.candidate < b.candidate;
                         });
        ranked_.resize(most_);
        std::sort(ranked_.begin(), ranked_.end(),
                  [](const Ranked& a, const Ranked& b) { return a.candidate < b.candidate; });
        // candidates only move to lower indices
        for (std::size_t i = 0; i < most_; ++i) objects_[i] = objects_[ranked_[i].candidate];
        objects_.resize(most_);
    }
    were_near_.clear();
    for (const NearObject& object : objects_) were_near_.push_back(object.key);
}

namespace {

// Levels kept per model for objects that become near later; 12 bytes per triangle of the finest level each.
constexpr std::size_t kMostKept = 4;

}  // namespace

void ContinuousLevels::follow(std::span<const NearObject> objects) {
    std::swap(levels_, former_);
    levels_.clear();
    const auto leave = [&](Level& level) {
        std::vector<ProgressiveMesh>& kept = models_[level.model].kept;
        if (level.mesh && kept.size() < kMostKept) kept.push_back(*std::move(level.mesh));
    };
    auto former = former_.begin();
    for (const NearObject& object : objects) {
        for (; former != former_.end() && former->key < object.key; ++former) leave(*former);
        if (former != former_.end() && former->key == object.key) {
            levels_.push_back(std::move(*former++));
        } else {
            levels_.push_back({object.key, object.model, std::nullopt});
        }
    }
    for (; former != former_.end(); ++former) leave(*former);
    former_.clear();
}

// Removes and returns the kept level that is the fewest contractions from `count`; a new copy if none is kept.
ProgressiveMesh ContinuousLevels::take(std::uint32_t model, std::uint32_t count) {
    std::vector<ProgressiveMesh>& kept = models_[model].kept;
    if (kept.empty()) return models_[model].mesh->share();
    const auto distance = [&](const ProgressiveMesh& mesh) {
        const std::size_t has = mesh.triangles().size();
        return has > count ? has - count : count - has;
    };
    const auto nearest = std::min_element(kept.begin(), kept.end(),
                                          [&](const ProgressiveMesh& a, const ProgressiveMesh& b) {
                                              return distance(a) < distance(b);
                                          });
    ProgressiveMesh mesh = std::move(*nearest);
    kept.erase(nearest);
    return mesh;
}

std::span<const TriangleMesh::Triangle> ContinuousLevels::triangles(std::size_t object,
                                                                    std::uint32_t count) {
    Level& level = levels_[object];
    if (!level.mesh) level.mesh = take(level.model, count);
    level.mesh->set_triangle_count(count);
    return level.mesh->triangles();
}

void StreamedList::add_model(const ObjectModel& model, double fade_ratio) {
    models_.emplace_back();
    if (model.continuous != nullptr) {
        models_.back().emplace(model, fade_ratio);
        is_needed_ = most_ > 0;
    }
    levels_.add_model(model);
}

void StreamedList::clear() {
    near_.clear();
    draws_.clear();
    triangle_count_ = 0;
}

void StreamedList::begin(float log2_least) {
    clear();
    log2_least_ = log2_least;
}

void StreamedList::select(DemandHistogram& histogram) {
    near_.select();
    levels_.follow(near_.objects());
    for (const NearObject& object : near_.objects())
        models_[object.model]->add_to(object.log2_factor, histogram);
}

void StreamedList::make(std::span<const NearDraw> near, std::span<const ObjectModel> models,
                        float log2_threshold) {
    draws_.clear();
    triangle_count_ = 0;
    for (const NearDraw& draw : near) {
        const NearObject& object = near_.objects()[draw.object];
        const std::uint32_t count =
            models_[object.model]->triangle_count(object.log2_factor, log2_threshold);
        draws_.push_back({.mesh = models[object.model].mesh,
                          .positions = {},
                          .triangles = levels_.triangles(draw.object, count),
                          .instance = draw.instance});
        triangle_count_ += draws_.back().triangles.size();
    }
}

}  // namespace terrane::internal
