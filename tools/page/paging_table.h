// SPDX-License-Identifier: MIT
#pragma once

#include "source/paging_choice.h"
#include "page/paging_run.h"

#include <nlohmann/json.hpp>

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane::tools {

/// What is flown, and over which storage.
struct PagingCell {
    std::string path;
    std::optional<double> speed;     ///< metres a second; absent: as CameraPathSettings
    std::optional<double> altitude;  ///< metres; absent: likewise
    double latency_ms = 0.0;
    double bandwidth_mb = 0.0;  ///< MB of 10^6 bytes a second
    double memory_mb = 0.0;     ///< MB of 2^20 bytes

    friend bool operator==(const PagingCell&, const PagingCell&) = default;
};

/// How one policy did in one cell.
struct PagingRow {
    PagingCell cell;
    PagingChoice policy = PagingChoice::deadline;
    double radius = 1.0;  ///< of PagingChoice::distance: the best one that was played
    PagingRun run;        ///< frames may be left out
    bool has_unannounced_jumps = false;
};

/// Whether a distance policy did better with this run than with another: fewer late frames, then less
/// excess error.
bool is_better(const PagingTotals& totals, const PagingTotals& other);

/// What a script reads of a row.
nlohmann::ordered_json to_json(const PagingRow& row);

/// The policies' runs of one cell, and what is asked of Terrane's own.
struct PagingVerdict {
    PagingCell cell;
    const PagingRow* deadline = nullptr;  ///< null: not played; the same below
    const PagingRow* distance = nullptr;
    const PagingRow* oracle = nullptr;

    /// Late frames over those of the nearest-first policy: at most kMostLate where the oracle has none
    /// (0 over 0 is 0). Absent where a run is, or where the oracle has late frames.
    std::optional<double> late_ratio;
    /// Excess error over the oracle's, at most kMostExcess where the oracle has late frames. Absent
    /// likewise.
    std::optional<double> excess_ratio;
    std::vector<std::string> missed;  ///< the targets that are not met, by their key in to_json()

    static constexpr double kMostLate = 0.05;
    static constexpr double kMostExcess = 1.2;
    static constexpr double kMostWasted = 0.25;  ///< but where jumps are not announced
};

/// One verdict for each cell, in order of its first row. The rows outlive it.
std::vector<PagingVerdict> judge(std::span<const PagingRow> rows);

}  // namespace terrane::tools
