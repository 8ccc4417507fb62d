// SPDX-License-Identifier: MIT
#include "objects/level_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

// 2^(i / 32) by products of square roots of 2, correct to a few roundings.
std::array<double, ErrorBins::kBinsPerOctave> make_fractions() {
    const double half = std::sqrt(2.0), quarter = std::sqrt(half), eighth = std::sqrt(quarter);
    const double sixteenth = std::sqrt(eighth), step = std::sqrt(sixteenth);
    std::array<double, ErrorBins::kBinsPerOctave> fractions;
    for (std::size_t i = 0; i < fractions.size(); ++i) {
        fractions[i] = ((i & 16) != 0 ? half : 1.0) * ((i & 8) != 0 ? quarter : 1.0) *
                       ((i & 4) != 0 ? eighth : 1.0) * ((i & 2) != 0 ? sixteenth : 1.0) *
                       ((i & 1) != 0 ? step : 1.0);
    }
    return fractions;
}

}  // namespace

double ErrorBins::upper_px(int bin) {
    static const std::array<double, kBinsPerOctave> fractions = make_fractions();
    if (bin == kCount - 1) return std::numeric_limits<double>::infinity();
    return std::ldexp(fractions[static_cast<std::size_t>(bin % kBinsPerOctave)],
                      kFirstOctave + bin / kBinsPerOctave);
}

void DemandHistogram::append_to(std::vector<TriangleDemand>& demands_out) const {
    std::int64_t drawn = 0, most = 0;
    for (int bin = ErrorBins::kCount - 1; bin >= 0; --bin) {
        drawn += changes_[static_cast<std::size_t>(bin)];
        // A demand has 32 bits; larger numbers of triangles are split.
        for (; drawn > most;) {
            const std::int64_t step =
                std::min<std::int64_t>(drawn - most, std::numeric_limits<std::uint32_t>::max());
            demands_out.push_back({ErrorBins::upper_px(bin), static_cast<std::uint32_t>(step)});
            most += step;
        }
    }
}

// Sources: D. Luebke et al. Level of Detail for 3D Graphics. 2003, sections 4.3 (screen-space error) and 5.3 (fades).
//          T. Funkhouser, C. Sequin. Adaptive Display Algorithm for Interactive Frame Rates During Visualization of
//          Complex Virtual Environments. SIGGRAPH 1993 (a budget over the objects of a frame).
// Deviation: objects share one screen-error threshold with the ground instead of a ratio of benefit to cost, so that a
//            frame has a largest error.

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

DeviceModel LevelChoice::on_device(const ObjectModel& model) const {
    DeviceModel made;
    made.log2_ratio = log2_ratio_;
    for (std::size_t i = 0; i < steps_.size(); ++i) {
        const bool is_impostor = i < model.levels.size() && model.levels[i].is_impostor;
        made.steps.push_back({.log2_error = steps_[i].log2_error,
                              .morphs = steps_[i].morphs,
                              .impostor = is_impostor ? model.impostor : std::nullopt});
    }
    return made;
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
    // A share of 0 or 1 would draw one of the two levels without pixels.
    const float share = std::clamp(over / log2_ratio_, 0x1p-10f, 1.0f - 0x1p-10f);
    if (steps_[i - 1].morphs) return {index(i - 1), ChosenLevels::kNone, 2.0f - share};
    return {index(i - 1), index(i), share};
}

// Source: H. Hoppe. Smooth View-dependent Level-of-Detail Control. IEEE Visualization 1998, section 5 (a tolerance in
//         pixels chooses the contractions).
// Deviation: a level is a position in the sequence of contractions, not a front in their tree: the whole object has one
//            error. The level is found at no cost, and its certified error holds.

namespace {

// Contractions with nearly equal errors are merged into one demand.
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

    // Each contraction is a demand for the triangles that it removes; the coarsest mesh is a separate demand.
    std::size_t i = 0;
    for (; i + 1 < triangles_.size() && log2_errors_[i + 1] < most_log2_error_; ++i) {
        const std::int64_t gone = std::int64_t{triangles_[i]} - triangles_[i + 1];
        const float end = end_of_step(log2_errors_[i + 1]);
        if (!std::isfinite(end)) continue;  // no error: these triangles are never drawn
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
