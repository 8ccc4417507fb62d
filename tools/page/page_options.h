// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"
#include "options/option_values.h"
#include "page/paging_table.h"
#include "source/terrain_options.h"

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace terrane::tools {

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
    VirtualStorage storage;  ///< without what the lists above and the next members set
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
    std::optional<double> speed;
    std::optional<double> altitude;
};
PathItem parse_path_item(const std::string& text);

/// Checks combinations of options. Fails with exit_usage.
CommandResult<void> check(const PageOptions& options);

/// Fails with exit_usage for given flags without effect, except --announce-s.
CommandResult<void> refuse_idle_page_flags(const PageOptions& options, const CLI::App& command);

/// Every combination without policies, in lexicographic order of path, speed, latency, bandwidth, memory.
std::vector<PagingCell> list_cells(const PageOptions& options);

/// Settings of the run of one cell with one policy and radius.
PagingRunSettings run_settings(const PageOptions& options, const PagingCell& cell,
                               PagingChoice policy, double radius);

}  // namespace terrane::tools
