// SPDX-License-Identifier: MIT
#pragma once

#include "flight/report.h"
#include "lab/dial.h"
#include "program/command.h"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace terrane::tools {

/// A trade.json without tables: the command line, the machine, and the flags of the presets.
nlohmann::ordered_json start_trade_document(bool is_quick);

/// Reads a trade.json.
///
/// Fails: exit_failed, naming the file and what is wrong: it cannot be read, is not JSON, or does not have the form of
///        start_trade_document() with tables of to_json()
CommandResult<nlohmann::ordered_json> read_trade_document(const std::string& path);

/// Figures of two documents side by side, paired by dial, terrain, label and column, in the order of the first
/// document. `times_b_over_a` is the median ratio of the times of b to the times of a. `ratios_b_over_a` is the same
/// for times relative to the reference loop: about 1 if the machines differ only in speed. Both are null without times.
///
/// @param a, b as read_trade_document() returns them
nlohmann::ordered_json compare_documents(const nlohmann::ordered_json& a,
                                         const nlohmann::ordered_json& b);

/// Writes the report of one trade.json, or of two side by side: for each dial its front, and its figures with spread,
/// ratio and command.
///
/// @param documents in the form of trade.json
///
/// Fails with io, naming the path.
Result<void> write_trade_report(const OutputPlace& place, const ReportHeader& header,
                                const std::vector<nlohmann::ordered_json>& documents);

/// Prints the figures of two trade.json side by side: as one JSON object, or as a line per time and a summary.
///
/// @param files two trade.json
/// @param out   a folder for the report; "" for none
///
/// Fails: as read_trade_document() and write_trade_report(); exit_failed if the files have no figure in common
CommandResult<void> run_comparison(const std::vector<std::string>& files, const std::string& out,
                                   bool as_json);

}  // namespace terrane::tools
