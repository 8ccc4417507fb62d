// SPDX-License-Identifier: MIT
// Source: H. Hoppe. Smooth View-dependent Level-of-Detail Control. IEEE Visualization 1998, section 5 (a tolerance in
//         pixels chooses the contractions).
// Deviation: a level is a place in the sequence of contractions, not a front in their tree: all of an object has one
//            error. It costs nothing to find, and its certified error holds.
#include "continuous/continuous_model.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

// Contractions of nearly the same error are one demand.
constexpr float kStepsPerOctave = 128.0f;

float end_of_step(float log2_error) {
    return std::ceil(log2_error * kStepsPerOctave) / kStepsPerOctave;
}

}  // namespace

ContinuousModel::ContinuousModel(const ObjectModel& model, double fade_ratio) {
    const ProgressiveMesh& mesh = *model.continuous;
    triangles_.assign(mesh.step_triangle_counts().begin(), mesh.step_triangle_counts().end());
    log2_errors_.reserve(triangles_.size());
    for (const double error_m : mesh.step_errors_m()) {
        const float log2_error = log2_of_error(error_m);
        // rounding of the logarithm does not change the order
        log2_errors_.push_back(log2_errors_.empty() ? log2_error
                                                    : std::max(log2_errors_.back(), log2_error));
    }

    const float log2_ratio = fade_ratio > 1.0 ? log2_of(static_cast<float>(fade_ratio)) : 0.0f;
    std::size_t first = 0;  // of the levels that are not meshes
    while (first < model.levels.size() && !model.levels[first].is_impostor) ++first;
    const auto log2_error_of = [&](std::size_t level) {
        return log2_of_error(level < model.levels.size() ? model.levels[level].error_m
                                                         : model.absence_error_m);
    };
    most_log2_error_ = log2_error_of(first) + log2_ratio;
    for (std::size_t level = first; level < model.levels.size(); ++level) {
        removals_.push_back({log2_error_of(level), model.levels[level].triangles});
        additions_.push_back(
            {log2_error_of(level + 1) + log2_ratio, model.levels[level].triangles});
    }

    // Each contraction is a demand of the triangles that it takes away, and the coarsest mesh of its own.
    std::size_t i = 0;
    for (; i + 1 < triangles_.size() && log2_errors_[i + 1] < most_log2_error_; ++i) {
        const std::int64_t gone = std::int64_t{triangles_[i]} - triangles_[i + 1];
        const float end = end_of_step(log2_errors_[i + 1]);
        if (!std::isfinite(end)) continue;  // without an error: never drawn
        if (additions_.empty() || additions_.back().log2_error != end)
            additions_.push_back({end, 0});
        additions_.back().triangles += gone;
    }
    additions_.push_back({most_log2_error_, triangles_[i]});
}

void ContinuousModel::add_to(float log2_factor, DemandHistogram& histogram) const {
    for (const Change& change : additions_)
        histogram.add(change.log2_error + log2_factor + kDemandMargin, change.triangles);
    for (const Change& change : removals_)
        histogram.remove(change.log2_error + log2_factor - kDemandMargin, change.triangles);
}

std::uint32_t ContinuousModel::triangle_count(float log2_factor, float log2_threshold) const {
    const float most = log2_threshold - log2_factor;
    const auto found = std::partition_point(log2_errors_.begin(), log2_errors_.end(),
                                            [&](float log2_error) { return log2_error <= most; });
    const std::ptrdiff_t within = found - log2_errors_.begin();
    return triangles_[static_cast<std::size_t>(std::max<std::ptrdiff_t>(within, 1)) - 1];
}

}  // namespace terrane::internal
