// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/schemes/crowd_run.h"

#include <nlohmann/json.hpp>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace terrane::tools {

/// One point of a table, measured with each of its series.
struct StudyPoint {
    double x = 0.0;
    std::optional<double> published_query_ms;
    std::vector<CrowdTotals>
        measured;  ///< by series; without queries where they would take too long
};

/// Cost of a query as a function of one parameter.
struct StudyTable {
    std::string key;
    std::string title;
    std::string x_name;
    std::string text;                 ///< what was held fixed
    std::vector<std::string> series;  ///< names of schemes, or of kinds of bodies
    std::vector<StudyPoint> points;
};

struct StudySettings {
    /// Least time of queries. Up to 1000 bodies it is split into five rounds over all points; the median round is
    /// reported.
    double seconds_a_point = 0.3;
    std::size_t most_bodies = 1'000'000;
    std::uint64_t seed = 1;
};

/// Repeats the published study of many bodies (SWIFT++) with our broadphases and its own: against count, detail,
/// radius, for bodies of equal size, and where its conclusion ("bodies of similar size and aspect") ends.
///
/// @param show called with the completed share, 0 to 1
/// @return incomplete tables where is_interrupted()
std::vector<StudyTable> run_study(const StudySettings& settings,
                                  const std::function<void(double)>& show);

/// The smallest ratio of published to our time, with the fastest series of each point; absent without published times.
std::optional<double> least_speedup(const StudyTable& table);

/// A table in the form of the report's script and of `--json`, with its slopes and findings.
nlohmann::ordered_json to_json(const StudyTable& table);

}  // namespace terrane::tools
