// SPDX-License-Identifier: MIT
#include "selection.h"

#include <algorithm>
#include <array>
#include <bit>

namespace terrane::internal {
namespace {

constexpr int kBinBits = 14;
constexpr std::size_t kBins = std::size_t{1} << kBinBits;

// Positive floats sort as their bits do; the sign bit is always clear.
std::size_t bin_of(float priority) {
    return std::bit_cast<std::uint32_t>(priority) >> (31 - kBinBits);
}

}  // namespace

float select_threshold(std::vector<Candidate>& candidates, std::size_t budget, float least) {
    // which bin does the budget end in
    std::vector<std::size_t> weights(kBins, 0);
    for (const Candidate& candidate : candidates)
        weights[bin_of(candidate.priority)] += candidate.weight;
    std::size_t used = 0;
    std::size_t bin = kBins;
    while (bin > 0 && used + weights[bin - 1] <= budget) used += weights[--bin];
    if (bin == 0) return least;

    // and where in that bin
    const std::size_t last = bin - 1;
    const auto end = std::partition(
        candidates.begin(), candidates.end(),
        [&](const Candidate& candidate) { return bin_of(candidate.priority) == last; });
    std::sort(candidates.begin(), end,
              [](const Candidate& a, const Candidate& b) { return a.priority > b.priority; });
    for (auto group = candidates.begin(); group != end;) {
        const float priority = group->priority;
        for (; group != end && group->priority == priority; ++group) used += group->weight;
        if (used > budget) return priority;
    }
    return least;
}

}  // namespace terrane::internal
