// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/crowd_run.h"

#include <nlohmann/json.hpp>

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane::tools {

/// One place of a table, measured with each of its series.
struct StudyPoint {
    double x = 0.0;
    std::optional<double> published_query_ms;
    std::vector<CrowdTotals>
        measured;  ///< series by series; without queries where they would take too long
};

/// What a query costs against one thing that changes.
struct StudyTable {
    std::string key;
    std::string title;
    std::string x_name;
    std::string text;                 ///< what is seen, and why it differs from what was published
    std::vector<std::string> series;  ///< names of broadphases
    std::vector<StudyPoint> points;
};

struct StudySettings {
    /// Of queries, at least. Up to 1000 bodies in five rounds through all points, of which the median counts.
    double seconds_a_point = 0.3;
    std::size_t most_bodies = 1'000'000;
    std::uint64_t seed = 1;
};

/// Runs the published study of many bodies (SWIFT++; sphere-like meshes of radius 1, detail 3 with deviation
/// 1) beside the broadphases: against count, detail, radius, and for bodies of equal size.
///
/// @param show called with the share that is done
/// @return tables that are not whole where is_interrupted()
std::vector<StudyTable> run_study(const StudySettings& settings,
                                  const std::function<void(double)>& show);

/// Slope of a line through the logarithms of points, by least squares; nothing for fewer than two places.
std::optional<double> log_log_slope(std::span<const double> x, std::span<const double> y);

/// Least of published over ours, the best series of each published place; nothing where none was published.
std::optional<double> least_speedup(const StudyTable& table);

/// Tables as the report's script and `--json` read them.
nlohmann::ordered_json to_json(const StudyTable& table);

}  // namespace terrane::tools
