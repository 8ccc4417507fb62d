// SPDX-License-Identifier: MIT
#pragma once

#include "page/paging_table.h"
#include "report/report.h"

#include <span>
#include <string>

namespace terrane::tools {

/// With more cells than this the report has the table only, without plots of the error over time.
inline constexpr std::size_t kMostPlottedCells = 6;

/// Writes the report of flights over simulated storage: one row for each cell with the policies side by side, missed
/// targets marked; for few cells with frames also their errors over time.
///
/// Fails with io, naming the path.
Result<void> write_paging_report(const OutputPlace& place, const ReportHeader& header,
                                 std::span<const PagingRow> rows);

}  // namespace terrane::tools
