// SPDX-License-Identifier: MIT
#pragma once

#include "flight/report.h"
#include "lab/dial.h"
#include "program/command.h"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace terrane::tools {

/// A dial that has no table, because no value of it can have an effect over a terrain.
struct IdleDial {
    std::string key, terrain, reason;
};

/// All tables of one run, and where they were measured.
struct TradeDocument {
    std::string command_line;
    bool is_quick = false;
    TradeFigure reference_ms;  ///< of the reference loop, over the run
    double seconds = 0.0;      ///< that the run took
    std::vector<TradeTable> tables;
    std::vector<IdleDial> idle_dials;
};

/// Processor, threads, compiler and version of the library.
nlohmann::ordered_json describe_machine();

/// In the form of trade.json, with the flags of the presets.
nlohmann::ordered_json to_json(const TradeDocument& document);

/// Reads a trade.json.
///
/// Fails: exit_failed, naming the file and what is wrong: it cannot be read, is no JSON, or not what to_json() makes
CommandResult<nlohmann::ordered_json> read_trade_document(const std::string& path);

/// Figures of two documents side by side: those of the same dial, terrain, label and column, in the order of the
/// first document. `times_b_over_a` is the median of times of b over those of a. `ratios_b_over_a` is the same of their
/// ratios to the reference loop: about 1 where the machines differ in speed alone. Both are null without times.
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
