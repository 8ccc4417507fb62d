// SPDX-License-Identifier: MIT
#pragma once

#include "levels/log_scale.h"

#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace terrane::internal {

/// Logarithms of demands are moved by more than the rounding of sums and of log2_of(), so that no level is drawn that
/// was not counted.
inline constexpr float kDemandMargin = 0x1p-12f;

/// Histogram of objects over the factor, pixels per metre of error, on a logarithmic scale.
class FactorCounts {
public:
    void clear() { counts_.fill(0); }
    void add(float log2_factor) { ++counts_[static_cast<std::size_t>(bin_of(log2_factor))]; }
    /// Requires a factor that was added.
    void remove(float log2_factor) { --counts_[static_cast<std::size_t>(bin_of(log2_factor))]; }

    /// Visits the bins that have objects.
    /// @param visit void(std::uint32_t count, float low, float high): log2 of the ends; infinite at the ends of the
    ///              scale
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
/// are moved up to the end of a bin and removals down to the end of one, so that the sum is never too small.
class DemandHistogram {
public:
    void clear() { changes_.fill(0); }
    /// Triangles are drawn below a threshold.
    void add(float log2_px, std::int64_t triangles) {
        changes_[static_cast<std::size_t>(ErrorBins::bin_above(log2_px))] += triangles;
    }
    /// They are not drawn below a smaller threshold.
    void remove(float log2_px, std::int64_t triangles) {
        const int bin = ErrorBins::bin_below(log2_px);
        if (bin >= 0) changes_[static_cast<std::size_t>(bin)] -= triangles;
    }

    /// Appends steps of the smallest bound that does not increase with the threshold.
    void append_to(std::vector<TriangleDemand>& demands_out) const;

private:
    std::array<std::int64_t, ErrorBins::kCount> changes_{};
};

}  // namespace terrane::internal
