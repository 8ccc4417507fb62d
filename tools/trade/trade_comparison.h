// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"

#include <string>
#include <vector>

namespace terrane::tools {

/// What `terrane trade --compare` was asked.
struct ComparisonOptions {
    std::vector<std::string> files;  ///< two trade.json
    std::string out;                 ///< a folder for the report; "" for none
    bool json = false;
};

/// Prints the figures of two trade.json side by side: with json one object, else a line for each time and a summary.
///
/// Fails: exit_failed, naming the file, as read_trade_document(); where the files have no figure in common; as
///        write_trade_report()
CommandResult<void> run_comparison(const ComparisonOptions& options);

}  // namespace terrane::tools
