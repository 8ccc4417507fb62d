// SPDX-License-Identifier: MIT
#pragma once

#include "page/paging_run.h"
#include "source/paging_choice.h"

#include <nlohmann/json.hpp>

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane::tools {

/// One combination of path and storage.
struct PagingCell {
    std::string path;
    std::optional<double> speed;     ///< m/s; absent: as CameraPathSettings
    std::optional<double> altitude;  ///< metres; absent: likewise
    double latency_ms = 0.0;
    double bandwidth_mb = 0.0;  ///< MB of 10^6 bytes a second
    double memory_mb = 0.0;     ///< MB of 2^20 bytes

    friend bool operator==(const PagingCell&, const PagingCell&) = default;
};

/// Result of one policy in one cell.
struct PagingRow {
    PagingCell cell;
    PagingChoice policy = PagingChoice::deadline;
    double radius = 1.0;  ///< best radius of PagingChoice::distance
    PagingRun run;        ///< frames may be empty
    bool has_unannounced_jumps = false;
};

/// Whether a run is better than another: fewer late frames, then less excess error.
bool is_better(const PagingTotals& totals, const PagingTotals& other);

/// A row as scripts read it.
nlohmann::ordered_json to_json(const PagingRow& row);

/// The runs of all policies in one cell, and whether PagingChoice::deadline meets its targets.
struct PagingVerdict {
    PagingCell cell;
    const PagingRow* deadline = nullptr;  ///< null: not played, as for the next two
    const PagingRow* distance = nullptr;
    const PagingRow* oracle = nullptr;

    /// Late frames of deadline over those of distance; target kMostLate, where the oracle has none (0 / 0 is 0). Absent
    /// where a run is missing or the oracle has late frames.
    std::optional<double> late_ratio;
    /// Excess error of deadline over that of the oracle; target kMostExcess, where the oracle has late frames. Absent
    /// otherwise.
    std::optional<double> excess_ratio;
    std::vector<std::string> missed;  ///< missed targets, by their key in to_json()

    static constexpr double kMostLate = 0.05;
    static constexpr double kMostExcess = 1.2;
    static constexpr double kMostWasted = 0.25;  ///< not where jumps are unannounced
};

/// One verdict for each cell, in order of its first row. The rows must outlive it.
std::vector<PagingVerdict> judge(std::span<const PagingRow> rows);

}  // namespace terrane::tools
