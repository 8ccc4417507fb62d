// SPDX-License-Identifier: MIT
#pragma once

#include "flight/report.h"
#include "lab/study.h"

#include <nlohmann/json.hpp>

#include <span>
#include <string>
#include <vector>

namespace terrane::tools {

/// A published time and the measured one.
struct Comparison {
    std::string what;  ///< "query, sweep-and-prune, 20 bodies"
    double published_ms = 0.0;
    double our_ms = 0.0;
    std::string
        reason;  ///< one sentence with the reason for the difference and the figures of this run
};

/// Every published time of a table with the measured one of the same scheme: sweep-and-prune, and the dense grid for
/// bodies of equal size. Empty for a table without published times.
///
/// The machine of the published study is unknown: its speed is an unknown factor, common to all ratios.
std::vector<Comparison> compare_with_published(const StudyTable& table);

/// Adds findings: whether the hashed grid queries as fast as the published dense one and updates at least 100 times
/// faster, and the share of clearing lists in a dense update.
void judge_grids(const StudyTable& table, std::vector<std::string>& findings);

/// Sentences about a measured table, with its figures: which published claims the measurement confirms, and from which
/// number of bodies, size or aspect on it contradicts them. Depends only on the table.
std::vector<std::string> study_findings(const StudyTable& table);

/// A table in the form of the report's script and of `--json`, with its slopes, findings and comparisons.
nlohmann::ordered_json to_json(const StudyTable& table);

/// All tables in Markdown: fixed parameters, published and measured times with the reason for their difference,
/// findings, and every figure. Ready to be pasted into a document.
std::string study_markdown(std::span<const StudyTable> tables);

/// Writes the report of the study of many bodies: for each table its text, measured and published times, a log-log
/// plot, and the share of positive queries.
///
/// Fails with io, naming the path.
Result<void> write_study_report(const OutputPlace& place, const ReportHeader& header,
                                std::span<const StudyTable> tables);

/// Writes study_markdown(). Fails with io, naming the path.
Result<void> write_study_markdown(const OutputPlace& place, std::span<const StudyTable> tables);

}  // namespace terrane::tools
