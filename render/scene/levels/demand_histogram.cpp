// SPDX-License-Identifier: MIT
#include "levels/demand_histogram.h"

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
        // A demand has 32 bits: more triangles than that fit into no budget.
        for (; drawn > most;) {
            const std::int64_t step =
                std::min<std::int64_t>(drawn - most, std::numeric_limits<std::uint32_t>::max());
            demands_out.push_back({ErrorBins::upper_px(bin), static_cast<std::uint32_t>(step)});
            most += step;
        }
    }
}

}  // namespace terrane::internal
