// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/schemes/crowd.h"

#include <cstddef>
#include <functional>

namespace terrane::tools {

/// Sums over queries of a crowd.
struct CrowdTotals {
    std::size_t queries = 0;
    std::size_t positive_queries = 0;  ///< with at least one touching pair
    double query_ms = 0.0;
    double positive_ms = 0.0;  ///< time of the positive queries
    double boxes_ms = 0.0;     ///< boxes of all bodies; cubes for two scenes
    double update_ms = 0.0;    ///< of the broadphase, without the boxes
    std::size_t boxes = 0;     ///< exact boxes that were computed
    std::size_t pairs = 0;
    std::size_t touching = 0;
    std::uint64_t candidates = 0;

    void add(const CrowdQuery& query);
    /// Adds the sums of another run.
    void add(const CrowdTotals& other);
    /// Means over the queries; 0 without queries.
    double mean_query_ms() const { return mean(query_ms, queries); }
    double mean_boxes_ms() const { return mean(boxes_ms, queries); }
    /// Of boxes and broadphase.
    double mean_update_ms() const { return mean(boxes_ms + update_ms, queries); }
    /// An update and a query.
    double mean_step_ms() const { return mean_query_ms() + mean_update_ms(); }
    /// Of the broadphase alone.
    double mean_broadphase_ms() const { return mean(update_ms, queries); }
    /// Pairs of overlapping boxes in a query.
    double mean_pairs() const { return mean(static_cast<double>(pairs), queries); }
    /// Exact boxes computed in an update and its query.
    double mean_boxes() const { return mean(static_cast<double>(boxes), queries); }
    /// Share of the queries with at least one touching pair, 0 to 1.
    double positive_share() const { return mean(static_cast<double>(positive_queries), queries); }
    /// 0 without positive queries.
    double mean_positive_ms() const { return mean(positive_ms, positive_queries); }

private:
    static double mean(double sum, std::size_t count) {
        return count > 0 ? sum / static_cast<double>(count) : 0.0;
    }
};

/// Alternates queries of a crowd and moves by dt seconds.
///
/// @param goes_on called before each query but the first; false ends the run
CrowdTotals run_crowd(Crowd& crowd, double dt,
                      const std::function<bool(const CrowdTotals&)>& goes_on);

}  // namespace terrane::tools
