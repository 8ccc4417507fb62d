// SPDX-License-Identifier: MIT
#pragma once

#include "continuous/continuous_levels.h"
#include "continuous/continuous_model.h"
#include "continuous/near_objects.h"

#include <terrane/scene/object_model.h>
#include <terrane/scene/scene_draws.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// A near object of which a mesh is drawn.
struct NearDraw {
    std::size_t object = 0;      ///< among the near objects
    std::uint32_t instance = 0;  ///< in SceneDraws::instances
};

/// Continuous levels of detail of a scene's nearest objects: which they are, what they need at every threshold, and the
/// draws of a frame.
class StreamedList {
public:
    /// @param most objects with continuous levels
    explicit StreamedList(std::size_t most) : most_(most), near_(most) {}

    /// Adds the next model, whose number is how many there were before.
    void add_model(const ObjectModel& model, double fade_ratio);

    /// Whether any object may have a level of its own.
    bool is_needed() const { return is_needed_; }

    /// The frame has no objects until begin() and select().
    void clear();
    /// Begins a frame. @param log2_least of the least threshold in pixels that the frame can have
    void begin(float log2_least);
    /// Adds an object of the frame, if it may have a level of its own; in the order of keys and places.
    void add(const NearObject& object) {
        const std::optional<ContinuousModel>& model = models_[object.model];
        if (model && model->draws_mesh(object.log2_factor, log2_least_)) near_.add(object);
    }
    /// Selects the nearest of them, and adds what they need.
    void select(DemandHistogram& histogram);
    /// The nearest objects, in the order of their places.
    std::span<const NearObject> near() const { return near_.objects(); }

    /// Makes the draws of near objects at a threshold.
    ///
    /// @param models as added
    void make(std::span<const NearDraw> near, std::span<const ObjectModel> models,
              float log2_threshold);
    /// Of the last make().
    std::span<const StreamedDraw> draws() const { return draws_; }
    std::size_t triangle_count() const { return triangle_count_; }

private:
    std::size_t most_;
    bool is_needed_ = false;
    std::vector<std::optional<ContinuousModel>> models_;
    NearObjects near_;
    ContinuousLevels levels_;
    float log2_least_ = 0.0f;
    std::vector<StreamedDraw> draws_;
    std::size_t triangle_count_ = 0;
};

}  // namespace terrane::internal
