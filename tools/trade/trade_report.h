// SPDX-License-Identifier: MIT
#pragma once

#include "report/report.h"

#include <vector>

namespace terrane::tools {

/// Writes the report of one trade.json, or of two side by side: for each dial its front, and its figures with spread,
/// ratio and command.
///
/// @param documents in the form of trade.json
///
/// Fails with io, naming the path.
Result<void> write_trade_report(const OutputPlace& place, const ReportHeader& header,
                                const std::vector<nlohmann::ordered_json>& documents);

}  // namespace terrane::tools
