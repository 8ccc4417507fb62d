// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/crowd.h"

#include <cstddef>
#include <functional>

namespace terrane::tools {

/// What many looks at a crowd found and cost, all together.
struct CrowdTotals {
    std::size_t queries = 0;
    std::size_t positive_queries = 0;  ///< in which any bodies touched
    double query_ms = 0.0;
    double positive_ms = 0.0;  ///< of positive queries
    double update_ms = 0.0;
    std::size_t pairs = 0;
    std::size_t touching = 0;
    std::uint64_t candidates = 0;

    void add(const CrowdQuery& query);
    double mean_query_ms() const { return query_ms / static_cast<double>(queries); }
    double mean_update_ms() const { return update_ms / static_cast<double>(queries); }
    /// 0 where there is none.
    double mean_positive_ms() const {
        return positive_queries > 0 ? positive_ms / static_cast<double>(positive_queries) : 0.0;
    }
};

/// Looks at a crowd and moves it by dt seconds, again and again.
///
/// @param goes_on asked before each look but the first
CrowdTotals run_crowd(Crowd& crowd, double dt,
                      const std::function<bool(const CrowdTotals&)>& goes_on);

}  // namespace terrane::tools
