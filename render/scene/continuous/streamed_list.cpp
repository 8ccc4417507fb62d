// SPDX-License-Identifier: MIT
#include "continuous/streamed_list.h"

namespace terrane::internal {

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
