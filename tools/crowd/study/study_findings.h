// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/study/power_law.h"
#include "crowd/study/study.h"

namespace terrane::tools {

/// Slope of the logarithm of a series' query times; absent for fewer than two points with candidate pairs: without
/// them the time is overhead only.
std::optional<double> query_slope(const StudyTable& table, std::size_t series,
                                  bool is_published_only);

/// Query times of a series as a power law with the fixed cost apart.
std::optional<PowerLaw> query_law(const StudyTable& table, std::size_t series);

/// The same of a whole step: an update with all boxes, and a query.
std::optional<PowerLaw> step_law(const StudyTable& table, std::size_t series);

/// null where there is none.
nlohmann::ordered_json number_or_null(const std::optional<double>& number);

/// What a measured table says, sentence by sentence, each with its figures, and how that differs from what was
/// published.
std::vector<std::string> study_findings(const StudyTable& table);

}  // namespace terrane::tools
