// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// A vertex that may be active, and how many triangles it adds: 2 inside the world, 1 on its border.
struct Candidate {
    float priority = 0.0f;
    std::uint32_t weight = 0;
};

/// The smallest of the candidates' priorities tau, or `least`, such that the weights of all
/// candidates with a priority above it sum to at most `budget`.
///
/// Exact: an order statistic, not a bin. Candidates of equal priority are in or out together.
///
/// @param candidates all those with a priority above `least`; reordered
/// Cost: O(candidates)
float select_threshold(std::vector<Candidate>& candidates, std::size_t budget, float least);

}  // namespace terrane::internal
