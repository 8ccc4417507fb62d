// SPDX-License-Identifier: MIT
#pragma once

#include "crowd/study.h"
#include "report/report.h"

#include <span>
#include <string>

namespace terrane::tools {

/// The report of the study of many bodies: for each table what is seen, our times beside the published ones,
/// and both axes' logarithms drawn with the slopes that fit them.
///
/// Fails with io, naming the place.
Result<void> write_study_report(const OutputPlace& place, const ReportHeader& header,
                                std::span<const StudyTable> tables);

}  // namespace terrane::tools
