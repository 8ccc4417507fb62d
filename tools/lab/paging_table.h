// SPDX-License-Identifier: MIT
#pragma once

#include "flight/report.h"
#include "frames/paging_storage.h"
#include "lab/paging_run.h"
#include "program/command.h"
#include "program/options.h"
#include "scene/terrain_options.h"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane::tools {

/// One combination of path and storage.
struct PagingCell {
    std::string path;
    std::optional<double> speed;     ///< m/s; absent: default of CameraPathSettings
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
    PagingRun run = {};   ///< frames may be empty
    bool has_unannounced_jumps = false;
};

/// Whether a run is better than another: fewer late frames, then less excess error.
bool is_better(const PagingTotals& totals, const PagingTotals& other);

/// A row in JSON, for scripts.
nlohmann::ordered_json to_json(const PagingRow& row);

/// The runs of all policies in one cell, and whether PagingChoice::deadline meets its targets.
struct PagingVerdict {
    PagingCell cell;
    const PagingRow* deadline = nullptr;  ///< null: not played, as for the next two
    const PagingRow* distance = nullptr;
    const PagingRow* oracle = nullptr;

    /// Late frames of `deadline` divided by those of `distance` (0 / 0 is 0); at most kMostLate to meet the target.
    /// Absent if a run is missing or the oracle has late frames.
    std::optional<double> late_ratio;
    /// Excess error of `deadline` divided by that of the oracle; at most kMostExcess to meet the target. Absent if a
    /// run of the two is missing or the oracle has no late frames.
    std::optional<double> excess_ratio;
    std::vector<std::string> missed;  ///< missed targets, by their key in to_json()

    static constexpr double kMostLate = 0.05;
    static constexpr double kMostExcess = 1.2;
    static constexpr double kMostWasted = 0.25;  ///< not applied to paths with unannounced jumps
};

/// One verdict for each cell, in the order of the cells' first rows. The rows must outlive the verdicts.
std::vector<PagingVerdict> judge(std::span<const PagingRow> rows);

/// Largest number of cells for which a report has plots of the error over time.
inline constexpr std::size_t kMostPlottedCells = 6;

/// Writes the report of flights over simulated storage: one row per cell with the policies side by side and missed
/// targets marked; for few cells with frames also their errors over time.
///
/// Fails with io, naming the path.
Result<void> write_paging_report(const OutputPlace& place, const ReportHeader& header,
                                 std::span<const PagingRow> rows);

/// Options of `page`. Every combination of the lists is played.
struct PageOptions {
    TerrainOptions terrain;
    std::vector<std::string> paths{"straight"};
    std::vector<double> speeds;
    std::vector<double> latencies_ms{20.0};
    std::vector<double> bandwidths_mb{100.0};
    std::vector<double> memories_mb{512.0};
    std::vector<PagingChoice> policies{PagingChoice::deadline};
    std::vector<double> radii{1.0};                              ///< the best result is kept
    double altitude = std::numeric_limits<double>::quiet_NaN();  ///< NaN: not given
    double seconds = CameraPathSettings::kDefaultSeconds;
    double start = 0.0;
    double announce = 0.0;
    double fps = 30.0;
    ImageSize size;
    double fov_deg = 60.0;
    std::size_t budget = 1'000'000;
    double max_error_px = 2.0;
    std::size_t body_count = 8;
    double horizon = PagerSettings{}.horizon;
    double contact_share = PagerSettings{}.contact_share;
    VirtualStorage storage;  ///< except what the lists above and the next two members set
    std::size_t slots = 8;
    std::size_t storage_seed = 1;
    std::size_t threads = 1;
    double cache_mb = 1024.0;
    std::string out;  ///< a folder; "" for none
    bool json = false;
};

void add_page_options(CLI::App& app, PageOptions& options);

/// A path on the command line: NAME, NAME@SPEED or NAME@SPEED:ALTITUDE; NAME may be a file.
struct PathItem {
    std::string name;
    std::optional<double> speed = {};
    std::optional<double> altitude = {};
};
PathItem parse_path_item(const std::string& text);

/// Checks combinations of options. Fails with exit_usage.
CommandResult<void> check(const PageOptions& options);

/// Fails with exit_usage if a given flag, other than --announce-s, has no effect.
CommandResult<void> refuse_idle_page_flags(const PageOptions& options, const CLI::App& command);

/// Every combination of path, speed, latency, bandwidth and memory, in lexicographic order.
std::vector<PagingCell> list_cells(const PageOptions& options);

/// Settings of the run of one cell with one policy and radius.
PagingRunSettings run_settings(const PageOptions& options, const PagingCell& cell,
                               PagingChoice policy, double radius);

}  // namespace terrane::tools
