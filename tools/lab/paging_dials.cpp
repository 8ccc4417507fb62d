// SPDX-License-Identifier: MIT
#include "flight/flight_options.h"
#include "lab/dial.h"
#include "lab/paging_run.h"
#include "lab/paging_table.h"

#include <fmt/format.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

/// The chunks of each terrain, shared by all paging dials.
using ChunkCaches = std::map<const Terrain*, std::shared_ptr<ChunkCache>>;

PageOptions usual_flight(bool is_quick) {
    PageOptions options;
    options.speeds = {1000.0};
    options.seconds = is_quick ? 2.0 : 6.0;
    options.fps = 10.0;
    // enough to meet the target whenever the chunks are resident, so that late frames do not depend on the budget
    options.budget = is_quick ? 100'000 : 300'000;
    options.max_error_px = is_quick ? 8.0 : 4.0;
    options.latencies_ms = {20.0};
    options.bandwidths_mb = {10.0};
    options.memories_mb = {64.0};
    return options;
}

// The command line of a flight, with the options that differ from the defaults of `page`.
std::string page_command(const PageOptions& options, const std::string& terrain_flags) {
    return fmt::format(
        "terrane page {} --path {} --speed {} --seconds {} --fps {} --budget {} "
        "--max-error-px {} --latency-ms {} --bandwidth-mb {} --memory-mb {} --horizon-s {} "
        "--contact-share {}",
        terrain_flags, options.paths[0], options.speeds[0], options.seconds, options.fps,
        options.budget, options.max_error_px, options.latencies_ms[0], options.bandwidths_mb[0],
        options.memories_mb[0], options.horizon, options.contact_share);
}

/// Columns with the keys of `page --json`, and the time of a frame.
const std::vector<TradeColumn> kPagingColumns{
    {"frame_ms", "a frame with its paging", "ms"},
    {"peak_bytes", "resident and in flight", "bytes"},
    {"bytes_loaded", "read from storage", "bytes"},
    {"wasted_share", "read and not used", "share"},
    {"late_share", "late frames", "share"},
    {"late_excess_error_px_s", "excess error of late frames", "px s"},
    {"contact_late", "bodies without ground, over frames"},
    {"error_px_max", "certified screen error", "px"}};

CommandResult<TradeTrial> paging_trial(ChunkCaches& caches, const TradePlace& place, double value,
                                       const PageOptions& options) {
    const std::shared_ptr<const HeightSource>& source = place.terrain->source;
    TERRANE_TRY(const CameraPath path,
                open_path(options.paths[0], *place.terrain,
                          {.speed = options.speeds[0], .seconds = options.seconds}));
    std::shared_ptr<ChunkCache>& chunks = caches[place.terrain];
    if (chunks == nullptr) chunks = std::make_shared<ChunkCache>(source, std::size_t{512} << 20U);
    PagingRow row{.cell = list_cells(options).front()};
    PagingRunSettings settings = run_settings(options, row.cell, row.policy, row.radius);
    TERRANE_TRY(const std::size_t frames, count_frames(options.fps, path.duration()));
    settings.frame_count = frames;
    const auto measure = [=, path = path]() mutable -> CommandResult<TradeSample> {
        const Stopwatch watch(Clock::wall);
        TERRANE_TRY(PagingRun run, run_paging(source, *chunks, path, settings));
        TradeSample sample{watch.ms() / static_cast<double>(settings.frame_count)};
        row.run = std::move(run);
        const nlohmann::ordered_json figures = to_json(row);
        for (std::size_t i = 1; i < kPagingColumns.size(); ++i) {
            sample.push_back(figures[kPagingColumns[i].key].get<double>());
        }
        return sample;
    };
    return TradeTrial{fmt::format("{:.6g}", value), measure, value,
                      page_command(options, place.flags)};
}

std::optional<std::string> idle_reason(const TradePlace& place) {
    if (place.terrain->source->lattice().finest_level > 0) return std::nullopt;
    return "all chunks are root squares, which are always resident";
}

Dial paging_dial(const std::shared_ptr<ChunkCaches>& caches, Dial dial,
                 const FieldValues<PageOptions>& values) {
    dial.columns = kPagingColumns;
    dial.idle_reason = idle_reason;
    dial.prepare = [caches, values](const TradePlace& place) -> TradeTrials {
        return make_trials(values, usual_flight(place.is_quick), place.is_quick,
                           [&](double value, const PageOptions& options) {
                               return paging_trial(*caches, place, value, options);
                           });
    };
    return dial;
}

}  // namespace

std::vector<Dial> paging_dials() {
    const auto caches = std::make_shared<ChunkCaches>();
    const std::string flight =
        "Flight at 1000 m/s over storage on a virtual clock: latency 20 ms, 10 MB/s, ceiling 64 "
        "MB, 8 bodies on the ground, unless the dial says otherwise.";
    return {paging_dial(caches,
                        {.key = "memory",
                         .title = "Ceiling of memory",
                         .axis = "MB",
                         .text = flight,
                         .preset_flag = "--memory-mb",
                         .cost = "peak_bytes",
                         .loss = "late_excess_error_px_s"},
                        {.all = {16, 24, 32, 48, 64, 128, 512},
                         .quick = {16, 32, 64, 128},
                         .set = [](double v, PageOptions& o) { o.memories_mb = {v}; }}),
            paging_dial(caches,
                        {.key = "latency",
                         .title = "Latency of storage",
                         .axis = "ms",
                         .text = flight,
                         .cost = "bytes_loaded",
                         .loss = "late_excess_error_px_s"},
                        {.all = {1, 5, 20, 50, 100, 300, 1000},
                         .quick = {5, 50, 300},
                         .set = [](double v, PageOptions& o) { o.latencies_ms = {v}; }}),
            paging_dial(caches,
                        {.key = "bandwidth",
                         .title = "Bandwidth of storage",
                         .axis = "MB/s",
                         .text = flight,
                         .cost = "bytes_loaded",
                         .loss = "late_excess_error_px_s"},
                        {.all = {1, 2, 5, 10, 30, 100},
                         .quick = {2, 10, 100},
                         .set = [](double v, PageOptions& o) { o.bandwidths_mb = {v}; }}),
            paging_dial(caches,
                        {.key = "horizon",
                         .title = "Paging horizon",
                         .axis = "s",
                         .text = flight + " Latency 300 ms here.",
                         .cost = "bytes_loaded",
                         .loss = "late_excess_error_px_s"},
                        {.all = {0, 0.25, 0.5, 1, 2, 4, 8},
                         .quick = {0, 0.5, 2, 4},
                         .set =
                             [](double v, PageOptions& o) {
                                 o.horizon = v;
                                 o.latencies_ms = {300.0};
                             }}),
            paging_dial(caches,
                        {.key = "contact-share",
                         .title = "Share of the ceiling for contact",
                         .axis = "share",
                         .text = "A camera and 8 bodies at 100 m/s, which jump to another place "
                                 "every 5 s; storage with latency 20 ms and 100 MB/s, ceiling 24 "
                                 "MB.",
                         .cost = "late_excess_error_px_s",
                         .loss = "contact_late"},
                        {.all = {0, 0.05, 0.125, 0.25, 0.5, 0.75},
                         .quick = {0, 0.125, 0.5},
                         .set = [](double v, PageOptions& o) {
                             o.contact_share = v;
                             o.paths = {"teleports"};
                             o.speeds = {100.0};
                             o.seconds = 10.0;
                             o.memories_mb = {24.0};
                             o.bandwidths_mb = {100.0};
                         }})};
}

}  // namespace terrane::tools
