// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/crowd.h"

#include <cstddef>
#include <functional>

namespace terrane::tools {

/// Sums over queries of a crowd.
struct CrowdTotals {
    std::size_t queries = 0;
    std::size_t positive_queries = 0;  ///< with at least one touching pair
    double query_ms = 0.0;
    double positive_ms = 0.0;  ///< time of the positive queries
    double update_ms = 0.0;
    std::size_t pairs = 0;
    std::size_t touching = 0;
    std::uint64_t candidates = 0;

    void add(const CrowdQuery& query);
    double mean_query_ms() const { return query_ms / static_cast<double>(queries); }
    double mean_update_ms() const { return update_ms / static_cast<double>(queries); }
    /// 0 without positive queries.
    double mean_positive_ms() const {
        return positive_queries > 0 ? positive_ms / static_cast<double>(positive_queries) : 0.0;
    }
};

/// Alternates queries of a crowd and moves by dt seconds.
///
/// @param goes_on called before each query but the first; false ends the run
CrowdTotals run_crowd(Crowd& crowd, double dt,
                      const std::function<bool(const CrowdTotals&)>& goes_on);

}  // namespace terrane::tools
