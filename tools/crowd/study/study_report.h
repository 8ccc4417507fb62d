// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/study/study.h"
#include "report/report.h"

#include <nlohmann/json.hpp>

#include <span>
#include <string>

namespace terrane::tools {

/// A table in the form of the report's script and of `--json`, with its slopes, findings and comparisons.
nlohmann::ordered_json to_json(const StudyTable& table);

/// All tables in Markdown: what was held fixed, published and our times with the reason why they differ, what the
/// table says, and every figure. Ready to be pasted into a document.
std::string study_markdown(std::span<const StudyTable> tables);

/// Writes the report of the study of many bodies: for each table its text, our times beside the published ones, a
/// log-log plot, and the share of positive queries.
///
/// Fails with io, naming the path.
Result<void> write_study_report(const OutputPlace& place, const ReportHeader& header,
                                std::span<const StudyTable> tables);

/// Writes study_markdown(). Fails with io, naming the path.
Result<void> write_study_markdown(const OutputPlace& place, std::span<const StudyTable> tables);

}  // namespace terrane::tools
