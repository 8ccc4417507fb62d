// SPDX-License-Identifier: MIT
#pragma once

#include "page/paging_table.h"
#include "report/report.h"

#include <span>
#include <string>

namespace terrane::tools {

/// Cells whose errors over time are drawn, at most; of more there is only the table.
inline constexpr std::size_t kMostPlottedCells = 6;

/// The report of flights over simulated storage: a row for each cell, the policies side by side, what
/// missed its target marked; of a few cells with frames their errors over time.
///
/// Fails with io, naming the place.
Result<void> write_paging_report(const OutputPlace& place, const ReportHeader& header,
                                 std::span<const PagingRow> rows);

}  // namespace terrane::tools
