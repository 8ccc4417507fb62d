// SPDX-License-Identifier: MIT
#pragma once

#include "levels/log_scale.h"

#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Upper bound of the triangles of many objects as a function of the threshold.
///
/// An object that draws n triangles while the threshold is in [a, b) pixels adds n at b and removes n at a. Additions
/// are moved up to the end of a bin and removals down to the end of one, so that the sum is never too small.
class DemandHistogram {
public:
    void clear() { changes_.fill(0); }
    /// Triangles are drawn below a threshold.
    void add(float log2_px, std::uint32_t triangles) {
        changes_[static_cast<std::size_t>(ErrorBins::bin_above(log2_px))] += triangles;
    }
    /// They are not drawn below a smaller threshold.
    void remove(float log2_px, std::uint32_t triangles) {
        const int bin = ErrorBins::bin_below(log2_px);
        if (bin >= 0) changes_[static_cast<std::size_t>(bin)] -= triangles;
    }

    /// Appends steps of the smallest bound that does not increase with the threshold.
    void append_to(std::vector<TriangleDemand>& demands_out) const;

private:
    std::array<std::int64_t, ErrorBins::kCount> changes_{};
};

}  // namespace terrane::internal
