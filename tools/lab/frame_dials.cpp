// SPDX-License-Identifier: MIT
#include "flight/flight_options.h"
#include "lab/dial.h"
#include "lab/ground_trials.h"
#include "lab/paging_run.h"
#include "lab/paging_table.h"
#include "program/options.h"

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

/// The flights over each terrain, shared by all pixel dials.
using FlightGrounds = std::map<const Terrain*, std::shared_ptr<FlightGround>>;

CommandResult<std::shared_ptr<FlightGround>> find_flight_ground(FlightGrounds& grounds,
                                                                const TradePlace& place) {
    std::shared_ptr<FlightGround>& known = grounds[place.terrain];
    if (known != nullptr) return known;
    CommandResult<std::shared_ptr<FlightGround>> made = FlightGround::create(place);
    if (made) known = *made;
    return made;
}

const std::vector<TradeColumn>& pixel_columns() {
    static const std::vector<TradeColumn> columns{
        {"update_ms", "update of the mesh", TradeUnit::ms},
        {"draw_ms", "drawing until the picture can be read", TradeUnit::ms},
        {"error_px", "certified screen error", TradeUnit::px},
        {"measured_error_px", "screen error by brute force", TradeUnit::px},
        {"max_pop_px", "movement between frames", TradeUnit::px},
        {"triangles", "triangles", TradeUnit::none}};
    return columns;
}

TradeTrial flight_trial(std::string label, double value, const TriangulatorSettings& settings,
                        const std::shared_ptr<FlightGround>& ground) {
    const auto truth = std::make_shared<std::optional<FlightTruth>>();  // the same in every run
    return {.label = std::move(label),
            .value = value,
            .command = "",
            .measure = [settings, ground, truth]() -> CommandResult<TradeSample> {
                const Result<FlightFigures> figures = ground->fly(settings);
                if (!figures) return pass_on(figures.error());
                if (!*truth) {
                    const Result<FlightTruth> verified = ground->verify(settings);
                    if (!verified) return pass_on(verified.error());
                    *truth = *verified;
                }
                return TradeSample{figures->update_ms, figures->draw_ms,     figures->error_px,
                                   (*truth)->error_px, (*truth)->max_pop_px, figures->triangles};
            }};
}

/// A dial of one field of the triangulator's settings.
Dial pixel_dial(const std::shared_ptr<FlightGrounds>& grounds, std::vector<double> values,
                std::vector<double> quick_values,
                const std::function<TriangulatorSettings(double)>& settings) {
    Dial dial;
    dial.columns = pixel_columns();
    dial.cost = "update_ms";
    dial.loss = "error_px";
    dial.prepare = [grounds, values = std::move(values), quick_values = std::move(quick_values),
                    settings](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const auto ground = find_flight_ground(*grounds, place);
        if (!ground) return pass_on(ground.error());
        std::vector<TradeTrial> trials;
        for (const double value : place.is_quick ? quick_values : values) {
            trials.push_back(
                flight_trial(fmt::format("{:.6g}", value), value, settings(value), *ground));
        }
        return trials;
    };
    return dial;
}

/// Settings by a preset's flags, of a flight and of a drop.
TriangulatorSettings triangulator_of(const Preset& preset) {
    const auto value = [&preset](const char* flag) { return preset_value(preset, flag).value(); };
    return {.triangle_budget = static_cast<std::size_t>(value("--budget")),
            .max_error_px = value("--max-error-px")};
}

CommandResult<std::vector<TradeTrial>> prepare_presets(FlightGrounds& grounds,
                                                       const TradePlace& place) {
    const auto flight = find_flight_ground(grounds, place);
    if (!flight) return pass_on(flight.error());
    std::vector<TradeTrial> trials;
    const CommandResult<Ground> ground = load_contact_ground(*place.terrain, 0.0);
    if (!ground) return pass_on(ground.error());
    for (const Preset& preset : presets()) {
        const DropTrial drop{.count = place.is_quick ? std::size_t{40} : std::size_t{200},
                             .seconds = 1.0,
                             .dt = preset_value(preset, "--dt").value(),
                             .world = {.max_substep = preset_value(preset, "--substep").value(),
                                       .collide_bodies = false}};
        TradeTrial trial =
            flight_trial(std::string(preset.name), static_cast<double>(trials.size()),
                         triangulator_of(preset), *flight);
        trial.measure = [fly = trial.measure, drop,
                         ground = *ground]() -> CommandResult<TradeSample> {
            CommandResult<TradeSample> sample = fly();
            if (!sample) return sample;
            const CommandResult<DropFigures> dropped = run_drop_trial(drop, ground);
            if (!dropped) return pass_on(dropped.error());
            sample->insert(sample->end(), {dropped->ms, dropped->max_depth_m, dropped->drift});
            return sample;
        };
        trials.push_back(std::move(trial));
    }
    return trials;
}

std::vector<std::string> compare_presets(const TradeTable& table) {
    const auto times = [&table](const char* key) {
        const std::size_t column = column_index(table, key);
        const double fast = table.rows.front().figures[column].median;
        return fast > 0.0 ? table.rows.back().figures[column].median / fast : 0.0;
    };
    return {
        fmt::format("accurate takes {:.3g} times the time of fast in the flight's updates, and "
                    "{:.3g} times in the drop.",
                    times("update_ms"), times("drop_ms"))};
}

Dial preset_dial(const std::shared_ptr<FlightGrounds>& grounds) {
    Dial dial;
    dial.key = "preset";
    dial.title = "Presets";
    dial.text = "The flight, and a drop of spheres of radius 0.5 m, with the flags of each preset.";
    dial.columns = pixel_columns();
    dial.columns.push_back({"drop_ms", "drop, a simulated second", TradeUnit::ms});
    dial.columns.push_back({"max_depth_m", "penetration", TradeUnit::m});
    dial.columns.push_back({"drift", "energy gained over lost", TradeUnit::share});
    dial.cost = "update_ms";
    dial.loss = "error_px";
    dial.prepare = [grounds](const TradePlace& place) { return prepare_presets(*grounds, place); };
    dial.find = compare_presets;
    return dial;
}

}  // namespace

std::vector<Dial> pixel_dials() {
    const auto grounds = std::make_shared<FlightGrounds>();
    Dial budget = pixel_dial(
        grounds, {3000, 10'000, 30'000, 100'000, 200'000, 300'000, 500'000, 1'000'000},
        {10'000, 30'000, 100'000, 300'000}, [](double value) {
            return TriangulatorSettings{.triangle_budget = static_cast<std::size_t>(value),
                                        .max_error_px = 0.01};
        });
    budget.key = "budget";
    budget.title = "Triangle budget";
    budget.axis = "triangles";
    budget.text =
        "Flight at 100 m/s, 150 m or 40 spacings of the data above the ground, whichever is more; "
        "1280 x 720; no target but 0.01 px.";
    budget.preset_flag = "--budget";
    Dial target = pixel_dial(grounds, {16, 8, 4, 2, 1, 0.7, 0.5}, {8, 4, 2, 1}, [](double value) {
        return TriangulatorSettings{.triangle_budget = 1'000'000, .max_error_px = value};
    });
    target.key = "target";
    target.title = "Target of the screen error";
    target.axis = "px";
    target.text = "The same flight; at most 1,000,000 triangles.";
    target.preset_flag = "--max-error-px";
    Dial morph =
        pixel_dial(grounds, {1, 1.1, 1.2, 1.3, 1.5, 2, 3, 4}, {1, 1.1, 1.3, 2}, [](double value) {
            return TriangulatorSettings{
                .triangle_budget = 1'000'000, .max_error_px = 2.0, .morph_ratio = value};
        });
    morph.key = "morph-ratio";
    morph.title = "Morph ratio";
    morph.axis = "morph_ratio";
    morph.text =
        "The same flight; target 2 px. Vertices move between frames instead of jumping, for more "
        "triangles.";
    morph.loss = "max_pop_px";
    return {budget, target, morph, preset_dial(grounds)};
}

namespace {

/// The chunks of each terrain, shared by all paging dials.
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
    // The target is met whenever the chunks are resident: late frames do not depend on the budget.
    options.budget = is_quick ? 100'000 : 300'000;
    options.max_error_px = is_quick ? 8.0 : 4.0;
    options.latencies_ms = {20.0};
    options.bandwidths_mb = {10.0};
    options.memories_mb = {64.0};
    return options;
}

// The command line of a flight: options that differ from the defaults of `page`.
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
