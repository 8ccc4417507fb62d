// SPDX-License-Identifier: MIT
#pragma once

#include "levels/demand_histogram.h"

#include <terrane/scene/object_model.h>

#include <cstdint>
#include <vector>

namespace terrane::internal {

/// The levels of an object with continuous levels of detail, on a logarithmic scale: in place of the meshes of
/// ObjectModel::levels those of ObjectModel::continuous, of which neighbouring ones differ by one contraction. The
/// impostor and the absence fade in as of other objects (LevelChoice).
class ContinuousModel {
public:
    /// @param model with ObjectModel::continuous
    ContinuousModel(const ObjectModel& model, double fade_ratio);

    /// Adds the triangles of one object at every threshold.
    ///
    /// @param log2_factor of pixels per metre of error: scale times pixels per radian over distance
    void add_to(float log2_factor, DemandHistogram& histogram) const;

    /// Whether a mesh is drawn at a threshold, as LevelChoice decides it, or may be by rounding.
    bool draws_mesh(float log2_factor, float log2_threshold) const {
        return most_log2_error_ + log2_factor + kDemandMargin > log2_threshold;
    }

    /// Triangles of the coarsest mesh whose screen error is within the threshold.
    std::uint32_t triangle_count(float log2_factor, float log2_threshold) const;

private:
    /// Triangles that are drawn below an error, and are not drawn below another one.
    struct Change {
        float log2_error;
        std::int64_t triangles;
    };

    std::vector<float> log2_errors_;        // [levels] finest first; they do not decrease
    std::vector<std::uint32_t> triangles_;  // [levels]
    float most_log2_error_ = 0.0f;          // no mesh is drawn from here on
    std::vector<Change> additions_, removals_;
};

}  // namespace terrane::internal
