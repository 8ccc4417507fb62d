// SPDX-License-Identifier: MIT
#pragma once

#include "objects/instance_device.h"
#include "objects/log_scale.h"

#include <terrane/scene/object_model.h>
#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace terrane::internal {

/// Margin on the logarithms of demands, larger than the rounding of sums and of log2_of(), so that every drawn level
/// has been counted.
inline constexpr float kDemandMargin = 0x1p-12f;

/// Histogram of objects by their factor, pixels per metre of error, on a logarithmic scale.
class FactorCounts {
public:
    void clear() { counts_.fill(0); }
    void add(float log2_factor) { ++counts_[static_cast<std::size_t>(bin_of(log2_factor))]; }
    /// Adds counts of bins, as a device has them: see instances_cull.comp.
    void add(std::span<const std::uint32_t> counts) {
        for (std::size_t bin = 0; bin < counts_.size(); ++bin) counts_[bin] += counts[bin];
    }
    /// Requires a factor that was added.
    void remove(float log2_factor) { --counts_[static_cast<std::size_t>(bin_of(log2_factor))]; }

    /// Visits the bins that are not empty.
    /// @param visit void(std::uint32_t count, float low, float high): low and high are log2 of the bin's ends, infinite
    ///              for the outermost bins
    template <class Visit>
    void visit(const Visit& visit) const {
        constexpr float kInfinite = std::numeric_limits<float>::infinity();
        for (int bin = 0; bin < kBins; ++bin) {
            const std::uint32_t count = counts_[static_cast<std::size_t>(bin)];
            if (count == 0) continue;
            const float low = static_cast<float>(bin - 1) / kBinsPerOctave + kFirstOctave;
            visit(count, bin == 0 ? -kInfinite : low,
                  bin == kBins - 1 ? kInfinite : low + 1.0f / kBinsPerOctave);
        }
    }

private:
    static constexpr int kBinsPerOctave = 64, kFirstOctave = -30, kOctaves = 60;
    static constexpr int kBins = kOctaves * kBinsPerOctave + 2;  // one beyond each end

    static int bin_of(float log2_factor) {
        const float at = (log2_factor - kFirstOctave) * kBinsPerOctave;
        if (!(at >= 0.0f)) return 0;
        return at < kOctaves * kBinsPerOctave ? static_cast<int>(at) + 1 : kBins - 1;
    }

    std::array<std::uint32_t, kBins> counts_{};
};

/// Upper bound of the triangles of many objects as a function of the threshold.
///
/// An object that draws n triangles while the threshold is in [a, b) pixels adds n at b and removes n at a. Additions
/// are moved up to a bin boundary and removals down to one, so that the sum is never too small.
class DemandHistogram {
public:
    void clear() { changes_.fill(0); }
    /// Adds triangles that are drawn at every threshold below 2^log2_px pixels.
    void add(float log2_px, std::int64_t triangles) {
        changes_[static_cast<std::size_t>(ErrorBins::bin_above(log2_px))] += triangles;
    }
    /// Removes added triangles at every threshold below 2^log2_px pixels, where a finer level replaces them.
    void remove(float log2_px, std::int64_t triangles) {
        const int bin = ErrorBins::bin_below(log2_px);
        if (bin >= 0) changes_[static_cast<std::size_t>(bin)] -= triangles;
    }

    /// Appends demands whose sum is the smallest upper bound that does not increase with the threshold.
    void append_to(std::vector<TriangleDemand>& demands_out) const;

private:
    std::array<std::int64_t, ErrorBins::kCount> changes_{};
};

/// Levels of one object in a frame: one, or two during a cross-fade.
struct ChosenLevels {
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    std::uint32_t finer =
        kNone;  ///< index in ObjectModel::levels, drawn with coverage `share`; kNone: nothing
    std::uint32_t coarser = kNone;  ///< drawn with coverage share - 1; kNone: nothing
    float share = 1.0f;             ///< ObjectInstance::coverage: above 1 if the finer level morphs
};

/// The levels of a model on a logarithmic scale.
///
/// Level i replaces level i + 1 while the screen error of level i + 1 rises from the threshold divided by the fade
/// ratio to the threshold: both are drawn with complementary coverage, or level i morphs into level i + 1. Errors of
/// consecutive levels differ by more than the ratio, hence at most two levels are drawn. The last step has no
/// triangles: the object is not drawn.
class LevelChoice {
public:
    LevelChoice(const ObjectModel& model, double fade_ratio);

    /// Adds the triangles that many objects draw at each threshold.
    ///
    /// @param factors histogram of log2 of pixels per metre of error: scale times pixels per radian over distance
    void add_to(const FactorCounts& factors, DemandHistogram& histogram) const;

    /// The same for a device. @param model of the constructor
    DeviceModel on_device(const ObjectModel& model) const;

    /// Whether an object is drawn at any level.
    bool is_drawn(float log2_factor, float log2_threshold) const {
        return steps_.back().log2_error + log2_ratio_ + log2_factor > log2_threshold;
    }

    /// @param log2_threshold log2 of the threshold in pixels
    ChosenLevels choose(float log2_factor, float log2_threshold) const;

private:
    struct Step {
        float log2_error;         // of this level, metres at scale 1
        std::uint32_t triangles;  // of this level
        bool morphs;              // into the next one
    };
    std::vector<Step> steps_;  // [levels + 1] finest first; the last means not drawn
    float log2_ratio_;
};

/// The levels of an object with continuous levels of detail, on a logarithmic scale: the levels of
/// ObjectModel::continuous, which differ by one contraction each, replace the meshes of ObjectModel::levels.
/// Transitions to the impostor, and to not being drawn, are those of other objects (LevelChoice).
class ContinuousModel {
public:
    /// @param model with ObjectModel::continuous
    ContinuousModel(const ObjectModel& model, double fade_ratio);

    /// Adds the triangles that one object draws at each threshold.
    ///
    /// @param log2_factor log2 of pixels per metre of error: scale times pixels per radian over distance
    void add_to(float log2_factor, DemandHistogram& histogram) const;

    /// Whether a mesh is drawn at a threshold by the rule of LevelChoice. True if rounding leaves this in doubt.
    bool draws_mesh(float log2_factor, float log2_threshold) const {
        return most_log2_error_ + log2_factor + kDemandMargin > log2_threshold;
    }

    /// Triangles of the coarsest mesh whose screen error is within the threshold.
    std::uint32_t triangle_count(float log2_factor, float log2_threshold) const;

private:
    /// Triangles added to (or removed from) the demand at thresholds below this error times the object's factor.
    struct Change {
        float log2_error;
        std::int64_t triangles;
    };

    std::vector<float> log2_errors_;        // [levels] finest first; they do not decrease
    std::vector<std::uint32_t> triangles_;  // [levels]
    float most_log2_error_ = 0.0f;          // no mesh is drawn at or above it
    std::vector<Change> additions_, removals_;
};

}  // namespace terrane::internal
