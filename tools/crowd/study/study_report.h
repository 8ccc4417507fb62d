// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/study/study.h"
#include "report/report.h"

#include <span>
#include <string>

namespace terrane::tools {

/// Writes the report of the study of many bodies: for each table its text, our times beside the published ones, and a
/// log-log plot with fitted slopes.
///
/// Fails with io, naming the path.
Result<void> write_study_report(const OutputPlace& place, const ReportHeader& header,
                                std::span<const StudyTable> tables);

}  // namespace terrane::tools
