// SPDX-License-Identifier: MIT
// Sources: D. Luebke et al. Level of Detail for 3D Graphics. 2003, sections 4.3 (screen-space error) and 5.3 (fades).
//          T. Funkhouser, C. Sequin. Adaptive Display Algorithm for Interactive Frame Rates During Visualization of
//          Complex Virtual Environments. SIGGRAPH 1993 (a budget over the objects of a frame).
// Deviation: objects share one threshold of screen error with the ground in place of a ratio of benefit and cost, so
//            that a frame has a largest error.
#include "objects/level_choice.h"

#include <algorithm>

namespace terrane::internal {
LevelChoice::LevelChoice(const ObjectModel& model, double fade_ratio)
    : log2_ratio_(fade_ratio > 1.0 ? log2_of(static_cast<float>(fade_ratio)) : 0.0f) {
    for (const ObjectLevel& level : model.levels)
        steps_.push_back({log2_of_error(level.error_m), level.triangles, level.morphs});
    steps_.push_back({log2_of_error(model.absence_error_m), 0, false});
}

void LevelChoice::add_to(const FactorCounts& factors, DemandHistogram& histogram) const {
    factors.visit([&](std::uint32_t count, float low, float high) {
        for (std::size_t i = 0; i + 1 < steps_.size(); ++i) {
            const Step& coarser = steps_[i + 1];
            histogram.add(coarser.log2_error + high + log2_ratio_ + kDemandMargin,
                          std::int64_t{count} * steps_[i].triangles);
            // a morph draws the finer level alone
            const float both = steps_[i].morphs ? log2_ratio_ : 0.0f;
            histogram.remove(coarser.log2_error + low + both - kDemandMargin,
                             std::int64_t{count} * coarser.triangles);
        }
    });
}

ChosenLevels LevelChoice::choose(float log2_factor, float log2_threshold) const {
    std::size_t i = steps_.size() - 1;
    const float most = log2_threshold - log2_factor;
    while (i > 0 && steps_[i].log2_error > most) --i;
    const std::size_t last = steps_.size() - 1;
    const auto index = [&](std::size_t level) {
        return level == last ? ChosenLevels::kNone : static_cast<std::uint32_t>(level);
    };
    const float over = steps_[i].log2_error + log2_ratio_ - most;
    if (i == 0 || !(over > 0.0f)) return {index(i), ChosenLevels::kNone, 1.0f};
    // A share of 0 and of 1 would draw one of the two without pixels.
    const float share = std::clamp(over / log2_ratio_, 0x1p-10f, 1.0f - 0x1p-10f);
    if (steps_[i - 1].morphs) return {index(i - 1), ChosenLevels::kNone, 2.0f - share};
    return {index(i - 1), index(i), share};
}

}  // namespace terrane::internal
