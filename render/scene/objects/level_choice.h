// SPDX-License-Identifier: MIT
#pragma once

#include "levels/demand_histogram.h"

#include <terrane/scene/object_model.h>

#include <cstdint>
#include <vector>

namespace terrane::internal {

/// Levels of one object in a frame: one, or two that fade into each other.
struct ChosenLevels {
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    std::uint32_t finer =
        kNone;  ///< index in ObjectModel::levels, drawn with coverage `share`; kNone: nothing
    std::uint32_t coarser = kNone;  ///< drawn with coverage share - 1; kNone: nothing
    float share = 1.0f;  ///< ObjectInstance::coverage: above 1 where the finer one morphs
};

/// The levels of a model on a logarithmic scale.
///
/// Level i + 1 gives way to level i while its screen error goes from the threshold over the fade ratio to the
/// threshold: both are drawn with complementary coverage, or level i morphs into level i + 1. Errors of consecutive
/// levels differ by more than the ratio, so that at most two levels are drawn. "Not drawn" is the last level, without
/// triangles.
class LevelChoice {
public:
    LevelChoice(const ObjectModel& model, double fade_ratio);

    /// Adds the triangles of many objects at every threshold.
    ///
    /// @param factors how many objects have which log2 of pixels per metre of error: scale times pixels per radian over
    ///                distance
    void add_to(const FactorCounts& factors, DemandHistogram& histogram) const;

    /// Whether anything of an object is drawn.
    bool is_drawn(float log2_factor, float log2_threshold) const {
        return steps_.back().log2_error + log2_ratio_ + log2_factor > log2_threshold;
    }

    /// @param log2_threshold of the threshold in pixels
    ChosenLevels choose(float log2_factor, float log2_threshold) const;

private:
    struct Step {
        float log2_error;         // of this level, metres at scale 1
        std::uint32_t triangles;  // of this level
        bool morphs;              // into the next one
    };
    std::vector<Step> steps_;  // [levels + 1] finest first; the last one is not drawn
    float log2_ratio_;
};

}  // namespace terrane::internal
