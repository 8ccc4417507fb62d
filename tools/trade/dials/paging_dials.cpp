// SPDX-License-Identifier: MIT
#include "flight/flight_options.h"
#include "page/page_options.h"
#include "page/paging_run.h"
#include "trade/dials/dial_list.h"

#include <fmt/format.h>

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

/// The chunks of each terrain, which all dials of paging share.
using ChunkCaches = std::map<const Terrain*, std::shared_ptr<ChunkCache>>;

/// A flight over one terrain.
struct PagingFlight {
    std::shared_ptr<const HeightSource> source;
    std::shared_ptr<ChunkCache> chunks;
    CameraPath path;
    PageOptions options;
};

PageOptions usual_flight(bool is_quick) {
    PageOptions options;
    options.speeds = {1000.0};
    options.seconds = is_quick ? 2.0 : 6.0;
    options.fps = 10.0;
    // The target is met wherever the chunks are there: the budget has no part in late frames.
    options.budget = is_quick ? 100'000 : 300'000;
    options.max_error_px = is_quick ? 8.0 : 4.0;
    options.latencies_ms = {20.0};
    options.bandwidths_mb = {10.0};
    options.memories_mb = {64.0};
    return options;
}

// The command line of a flight: what differs from the defaults of `page`.
std::string page_command(const PageOptions& options, const std::string& terrain_flags) {
    return fmt::format(
        "terrane page {} --path {} --speed {} --seconds {} --fps {} --budget {} "
        "--max-error-px {} --latency-ms {} --bandwidth-mb {} --memory-mb {} --horizon-s {} "
        "--contact-share {}",
        terrain_flags, options.paths[0], options.speeds[0], options.seconds, options.fps,
        options.budget, options.max_error_px, options.latencies_ms[0], options.bandwidths_mb[0],
        options.memories_mb[0], options.horizon, options.contact_share);
}

CommandResult<TradeSample> page_once(const PagingFlight& flight) {
    const std::vector<PagingCell> cells = list_cells(flight.options);
    PagingRunSettings settings =
        run_settings(flight.options, cells.front(), PagingChoice::deadline, 1.0);
    const CommandResult<std::size_t> frames =
        count_frames(flight.options.fps, flight.path.duration());
    if (!frames) return pass_on(frames.error());
    settings.frame_count = *frames;
    const auto start = std::chrono::steady_clock::now();
    const Result<PagingRun> run = run_paging(flight.source, *flight.chunks, flight.path, settings);
    if (!run) return pass_on(run.error());
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    const PagingTotals& totals = run->totals;
    return TradeSample{taken.count() / static_cast<double>(*frames),
                       static_cast<double>(totals.peak_bytes),
                       static_cast<double>(totals.bytes_loaded),
                       totals.wasted_share(),
                       totals.late_share(),
                       totals.excess_error_px_s,
                       static_cast<double>(totals.contact_late),
                       totals.error_px_max};
}

CommandResult<PagingFlight> make_flight(ChunkCaches& caches, const TradePlace& place,
                                        const PageOptions& options) {
    const std::shared_ptr<const HeightSource>& source = place.terrain->source;
    const Result<CameraPath> path = open_path(
        options.paths[0], *place.terrain, {.speed = options.speeds[0], .seconds = options.seconds});
    if (!path) return pass_on(path.error());
    std::shared_ptr<ChunkCache>& chunks = caches[place.terrain];
    if (chunks == nullptr) chunks = std::make_shared<ChunkCache>(source, std::size_t{512} << 20U);
    return PagingFlight{source, chunks, *path, options};
}

std::optional<std::string> idle_reason(const TradePlace& place) {
    if (place.terrain->source->lattice().finest_level > 0) return std::nullopt;
    return "all chunks are root squares, which are always resident";
}

/// A dial of one field of the options of `page`.
Dial paging_dial(const std::shared_ptr<ChunkCaches>& caches, std::vector<double> values,
                 std::vector<double> quick_values,
                 const std::function<void(double, PageOptions&)>& set) {
    Dial dial;
    dial.columns = {{"frame_ms", "a frame with its paging", TradeUnit::ms},
                    {"peak_bytes", "resident and in flight", TradeUnit::bytes},
                    {"bytes_loaded", "read from storage", TradeUnit::bytes},
                    {"wasted_share", "read and not used", TradeUnit::share},
                    {"late_share", "late frames", TradeUnit::share},
                    {"excess_error_px_s", "excess error of late frames", TradeUnit::px_s},
                    {"contact_late", "bodies without ground, over frames", TradeUnit::none},
                    {"error_px_max", "certified screen error", TradeUnit::px}};
    dial.cost = "peak_bytes";
    dial.loss = "error_px_max";
    dial.idle_reason = idle_reason;
    dial.prepare = [caches, values = std::move(values), quick_values = std::move(quick_values),
                    set](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        std::vector<TradeTrial> trials;
        for (const double value : place.is_quick ? quick_values : values) {
            PageOptions options = usual_flight(place.is_quick);
            set(value, options);
            const CommandResult<PagingFlight> flight = make_flight(*caches, place, options);
            if (!flight) return pass_on(flight.error());
            trials.push_back({.label = fmt::format("{:.6g}", value),
                              .value = value,
                              .command = page_command(options, place.flags),
                              .measure = [flight = *flight] { return page_once(flight); }});
        }
        return trials;
    };
    return dial;
}

const std::string kFlight =
    "Flight at 1000 m/s over storage on a virtual clock: latency 20 ms, 10 MB/s, ceiling 64 MB, 8 "
    "bodies on the ground, unless the dial says otherwise.";

}  // namespace

std::vector<Dial> paging_dials() {
    const auto caches = std::make_shared<ChunkCaches>();
    Dial memory = paging_dial(caches, {16, 24, 32, 48, 64, 128, 512}, {16, 32, 64, 128},
                              [](double v, PageOptions& o) { o.memories_mb = {v}; });
    memory.key = "memory";
    memory.title = "Ceiling of memory";
    memory.axis = "MB";
    memory.text = kFlight;
    memory.loss = "excess_error_px_s";
    memory.preset_flag = "--memory-mb";
    Dial latency = paging_dial(caches, {1, 5, 20, 50, 100, 300, 1000}, {5, 50, 300},
                               [](double v, PageOptions& o) { o.latencies_ms = {v}; });
    latency.key = "latency";
    latency.title = "Latency of storage";
    latency.axis = "ms";
    latency.text = kFlight;
    latency.cost = "bytes_loaded";
    latency.loss = "excess_error_px_s";
    Dial bandwidth = paging_dial(caches, {1, 2, 5, 10, 30, 100}, {2, 10, 100},
                                 [](double v, PageOptions& o) { o.bandwidths_mb = {v}; });
    bandwidth.key = "bandwidth";
    bandwidth.title = "Bandwidth of storage";
    bandwidth.axis = "MB/s";
    bandwidth.text = kFlight;
    bandwidth.cost = "bytes_loaded";
    bandwidth.loss = "excess_error_px_s";
    Dial horizon = paging_dial(caches, {0, 0.25, 0.5, 1, 2, 4, 8}, {0, 0.5, 2, 4},
                               [](double v, PageOptions& o) {
                                   o.horizon = v;
                                   o.latencies_ms = {300.0};
                               });
    horizon.key = "horizon";
    horizon.title = "Paging horizon";
    horizon.axis = "s";
    horizon.text = kFlight + " Latency 300 ms here.";
    horizon.cost = "bytes_loaded";
    horizon.loss = "excess_error_px_s";
    Dial share = paging_dial(caches, {0, 0.05, 0.125, 0.25, 0.5, 0.75}, {0, 0.125, 0.5},
                             [](double v, PageOptions& o) {
                                 o.contact_share = v;
                                 o.paths = {"teleports"};
                                 o.speeds = {100.0};
                                 o.seconds = 10.0;
                                 o.memories_mb = {24.0};
                                 o.bandwidths_mb = {100.0};
                             });
    share.key = "contact-share";
    share.title = "Share of the ceiling for contact";
    share.axis = "share";
    share.text =
        "A camera and 8 bodies at 100 m/s, which jump to another place every 5 s; storage with "
        "latency 20 ms and 100 MB/s, ceiling 24 MB.";
    share.cost = "excess_error_px_s";
    share.loss = "contact_late";
    return {memory, latency, bandwidth, horizon, share};
}

}  // namespace terrane::tools
