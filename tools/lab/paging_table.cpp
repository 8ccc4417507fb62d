// SPDX-License-Identifier: MIT
#include "lab/paging_table.h"

#include "assets.h"
#include "flight/flight_options.h"
#include "program/command.h"
#include "program/options.h"
#include "program/summary.h"
#include "scene/terrain_options.h"

#include <terrane/playback/track.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kMegabyte = 0x1p20;

double ratio(double value, double of) {
    if (of > 0.0) return value / of;
    return value > 0.0 ? std::numeric_limits<double>::infinity() : 0.0;
}

void judge(PagingVerdict& verdict) {
    const auto misses = [&](const char* key, bool is_missed) {
        if (is_missed) verdict.missed.emplace_back(key);
    };
    const PagingTotals* const ours = verdict.deadline ? &verdict.deadline->run.totals : nullptr;
    const PagingTotals* const nearest = verdict.distance ? &verdict.distance->run.totals : nullptr;
    const PagingTotals* const oracle = verdict.oracle ? &verdict.oracle->run.totals : nullptr;
    if (ours && nearest && oracle && oracle->late_frames == 0) {
        verdict.late_ratio = ratio(static_cast<double>(ours->late_frames),
                                   static_cast<double>(nearest->late_frames));
        misses("late_frames", *verdict.late_ratio > PagingVerdict::kMostLate);
    }
    if (ours && oracle && oracle->late_frames > 0) {
        verdict.excess_ratio = ratio(ours->excess_error.late_px_s, oracle->excess_error.late_px_s);
        misses("late_excess_error_px_s", *verdict.excess_ratio > PagingVerdict::kMostExcess);
    }
    if (ours) {
        misses("wasted_share", ours->wasted_share() > PagingVerdict::kMostWasted &&
                                   !verdict.deadline->has_unannounced_jumps);
    }
    if (ours && oracle) misses("contact_late", ours->contact_late > 0 && oracle->contact_late == 0);
    const double ceiling = verdict.cell.memory_mb * kMegabyte;
    const std::array all{ours, nearest, oracle};
    misses("peak_bytes", std::ranges::any_of(all, [ceiling](const PagingTotals* totals) {
               return totals && static_cast<double>(totals->peak_bytes) > ceiling;
           }));
}

}  // namespace

bool is_better(const PagingTotals& totals, const PagingTotals& other) {
    return std::tie(totals.late_frames, totals.excess_error.late_px_s) <
           std::tie(other.late_frames, other.excess_error.late_px_s);
}

nlohmann::ordered_json to_json(const PagingRow& row) {
    const PagingTotals& totals = row.run.totals;
    const bool has_radius = row.policy == PagingChoice::distance;
    return {{"path", row.cell.path},
            {"speed", number_or_null(row.cell.speed)},
            {"altitude", number_or_null(row.cell.altitude)},
            {"policy", name_of(row.policy)},
            {"radius", number_or_null(has_radius ? std::optional(row.radius) : std::nullopt)},
            {"latency_ms", row.cell.latency_ms},
            {"bandwidth_mb", row.cell.bandwidth_mb},
            {"memory_mb", row.cell.memory_mb},
            {"frames", totals.frames},
            {"late_frames", totals.late_frames},
            {"late_share", totals.late_share()},
            {"excess_error_px_s", totals.excess_error.all_px_s},
            {"late_excess_error_px_s", totals.excess_error.late_px_s},
            {"error_px_max", totals.error_px_max},
            {"bytes_loaded", totals.bytes_loaded},
            {"bytes_wasted", totals.bytes_wasted},
            {"wasted_share", totals.wasted_share()},
            {"peak_bytes", totals.peak_bytes},
            {"contact_late", totals.contact_late},
            {"body_frames", totals.body_frames},
            {"loaded", totals.loaded},
            {"reloads", totals.reloads},
            {"evicted", totals.evicted},
            {"hard_evictions", totals.hard_evictions},
            {"cancelled", totals.cancelled},
            {"failed", totals.failed},
            {"timed_out", totals.timed_out},
            {"over_ceiling", totals.over_ceiling}};
}

std::vector<PagingVerdict> judge(std::span<const PagingRow> rows) {
    std::vector<PagingVerdict> verdicts;
    for (const PagingRow& row : rows) {
        auto verdict = std::ranges::find(verdicts, row.cell, &PagingVerdict::cell);
        if (verdict == verdicts.end()) {
            verdicts.emplace_back().cell = row.cell;
            verdict = verdicts.end() - 1;
        }
        (row.policy == PagingChoice::deadline   ? verdict->deadline
         : row.policy == PagingChoice::distance ? verdict->distance
                                                : verdict->oracle) = &row;
    }
    for (PagingVerdict& verdict : verdicts) judge(verdict);
    return verdicts;
}

namespace {

// JSON has no infinity: shows the ratio as text.
nlohmann::ordered_json ratio(const std::optional<double>& value) {
    if (!value) return nullptr;
    if (std::isinf(*value)) return "inf";
    return *value;
}

nlohmann::ordered_json cell_data(const PagingVerdict& verdict, bool is_plotted) {
    nlohmann::ordered_json cell;
    cell["runs"] = nlohmann::ordered_json::object();
    cell["errors"] = nlohmann::ordered_json::object();
    for (const PagingRow* row : {verdict.deadline, verdict.distance, verdict.oracle}) {
        if (row == nullptr) continue;
        const std::string policy = name_of(row->policy);
        const std::vector<FrameRecord>& frames = row->run.frames;
        cell["runs"][policy] = to_json(*row);
        if (!is_plotted || frames.empty()) continue;
        cell["time"] = thinned(frames, [](const FrameRecord& frame) { return frame.time; });
        cell["target"] = frames.front().max_error_px;
        cell["errors"][policy] =
            thinned(frames, [](const FrameRecord& frame) { return frame.error_px; });
    }
    cell["late_ratio"] = ratio(verdict.late_ratio);
    cell["excess_ratio"] = ratio(verdict.excess_ratio);
    cell["missed"] = verdict.missed;
    return cell;
}

}  // namespace

Result<void> write_paging_report(const OutputPlace& place, const ReportHeader& header,
                                 std::span<const PagingRow> rows) {
    const std::vector<PagingVerdict> verdicts = judge(rows);
    nlohmann::ordered_json data;
    data["cells"] = nlohmann::ordered_json::array();
    for (const PagingVerdict& verdict : verdicts) {
        data["cells"].push_back(cell_data(verdict, verdicts.size() <= kMostPlottedCells));
    }
    data["targets"] = {{"late", PagingVerdict::kMostLate},
                       {"excess", PagingVerdict::kMostExcess},
                       {"wasted", PagingVerdict::kMostWasted}};
    return write_report(place, header, std::move(data), assets::paging_js);
}

namespace {

constexpr double kMostLatency_ms = 1e6;
constexpr double kLeastBandwidth_mb = 0.001, kMostBandwidth_mb = 1e6;
constexpr double kLeastMemory_mb = 0.001, kMostMemory_mb = 0x1p32;

void add_path_list(CLI::App& app, std::vector<std::string>& paths) {
    std::vector<std::string>* const target = &paths;
    app.add_option_function<std::string>(
           "--path", [target](const std::string& text) { *target = read_list("--path", text); },
           CameraPath::built_in_list() +
               ", or a track (.csv, .gpx, .igc, .tum); @SPEED or @SPEED:ALTITUDE behind one is its "
               "own")
        ->type_name("PATH,...")
        ->default_str(paths.front());
}

void add_policy_list(CLI::App& app, std::vector<PagingChoice>& policies) {
    std::vector<PagingChoice>* const target = &policies;
    add_choice_list(
        app, "--policy", paging_choice_names(),
        [target](const std::vector<std::size_t>& numbers) {
            target->clear();
            for (const std::size_t i : numbers) target->push_back(static_cast<PagingChoice>(i));
        },
        "Which chunks are loaded first: deadline follows motion ahead, distance takes the "
        "nearest, oracle knows the path that will be flown")
        ->default_str(name_of(policies.front()));
}

void add_storage_options(CLI::App& app, PageOptions& options) {
    VirtualStorage& storage = options.storage;
    add_in_range_list(app, "--latency-ms", options.latencies_ms, 0.0, kMostLatency_ms,
                      "From a request to its first byte, the median, milliseconds");
    add_in_range_list(app, "--bandwidth-mb", options.bandwidths_mb, kLeastBandwidth_mb,
                      kMostBandwidth_mb, "MB of 10^6 bytes a second that all requests share");
    add_in_range_list(app, "--memory-mb", options.memories_mb, kLeastMemory_mb, kMostMemory_mb,
                      "Ceiling of the memory that chunks take, MB of 2^20 bytes");
    add_count(app, "--slots", options.slots, 1, "Requests at once", 1024);
    add_in_range(app, "--latency-spread", storage.latency_spread, 0.0, 16.0,
                 "Each request takes the latency times 2^(spread * s), s from -1 to 1");
    add_in_range(app, "--failure-share", storage.failure_share, 0.0, 1.0,
                 "Share of requests that fail");
    add_in_range(app, "--hang-share", storage.hang_share, 0.0, 1.0,
                 "Share of requests that never end");
    add_count(app, "--storage-seed", options.storage_seed, 0, "Seed of spread, failures and hangs");
}

bool is_positive(const std::optional<double>& value) { return value && *value > 0.0; }

}  // namespace

void add_page_options(CLI::App& app, PageOptions& options) {
    add_terrain_options(app, options.terrain, {"volumes"});
    add_path_list(app, options.paths);
    add_positive_list(app, "--speed", options.speeds,
                      "Metres a second; without it 100 (spins: 20), or a track's own times");
    add_positive(app, "--altitude", options.altitude,
                 "Metres above the smoothed ground; 200 without it, or a track's own heights");
    add_in_range(app, "--fps", options.fps, 0.1, 1000.0, "Frames a second of the flight");
    add_positive(app, "--seconds", options.seconds, "How long, or less where a track ends");
    add_not_negative(app, "--start-s", options.start, "Seconds of a track to leave out");
    add_not_negative(app, "--announce-s", options.announce,
                     "Seconds ahead that jumps of teleports are announced to the pager");
    add_size(app, "--size", options.size, "Size of the picture, pixels");
    add_in_range(app, "--fov-deg", options.fov_deg, 1.0, 170.0, "Vertical field of view, degrees");
    add_count(app, "--budget", options.budget, 1, "Most triangles a frame", kMostTriangles);
    add_positive(app, "--max-error-px", options.max_error_px,
                 "Screen error that frames should not exceed, pixels");
    add_count(app, "--bodies", options.body_count, 0,
              "Spheres on the ground below the camera and around it, for contact", 100'000);
    add_policy_list(app, options.policies);
    add_in_range_list(app, "--radius", options.radii, 1e-6, 1e6,
                      "With --policy distance: how many times as far as it is needed a chunk is "
                      "loaded; of several the best is kept");
    add_in_range(app, "--horizon-s", options.horizon, 0.0, 3600.0,
                 "How far ahead motion is followed, seconds");
    add_in_range(app, "--contact-share", options.contact_share, 0.0, 1.0,
                 "Share of the ceiling that is reserved for contact");
    add_storage_options(app, options);
    add_count(app, "--threads", options.threads, 1, "Flights that are played at once", 256);
    add_in_range(app, "--cache-mb", options.cache_mb, 0.0, kMostMemory_mb,
                 "Cache of chunks that the flights share, MB of 2^20 bytes; changes no result");
    app.add_option(
           "--out", options.out,
           "Folder for report.html and, of a single flight, frames.csv. What an earlier run "
           "wrote there (terrane-files.txt lists it) is replaced; no other file is removed or "
           "written over")
        ->type_name("DIR");
    app.add_flag("--json", options.json, "Print one JSON object a line for each flight");
    add_preset_option(app);
}

PathItem parse_path_item(const std::string& text) {
    const std::size_t at = text.rfind('@');
    if (at == std::string::npos) return {.name = text};
    const std::string own = text.substr(at + 1);
    const std::size_t colon = own.find(':');
    PathItem item{.name = text.substr(0, at), .speed = parse_number(own.substr(0, colon))};
    bool is_whole = is_positive(item.speed);
    if (colon != std::string::npos) {
        item.altitude = parse_number(own.substr(colon + 1));
        is_whole = is_whole && is_positive(item.altitude);
    }
    // otherwise the @ belongs to the name
    return is_whole ? item : PathItem{.name = text};
}

CommandResult<void> check(const PageOptions& options) {
    for (const std::string& path : options.paths) {
        TERRANE_TRY(check_path(parse_path_item(path).name));
    }
    const VirtualStorage& storage = options.storage;
    if (storage.failure_share + storage.hang_share > 1.0) {
        return usage_error(
            fmt::format("--failure-share and --hang-share must be at most 1 together, got {:.6g}",
                        storage.failure_share + storage.hang_share));
    }
    return {};
}

CommandResult<void> refuse_idle_page_flags(const PageOptions& options, const CLI::App& command) {
    const auto has_policy = [&options](auto... choices) {
        return std::ranges::any_of(options.policies, [choices...](PagingChoice policy) {
            return ((policy == choices) || ...);
        });
    };
    bool has_track = false, takes_speed = false, takes_altitude = false;
    for (const std::string& path : options.paths) {
        const PathItem item = parse_path_item(path);
        has_track = has_track || names_track_file(item.name);
        takes_speed = takes_speed || !item.speed;
        takes_altitude = takes_altitude || !item.altitude;
    }
    const VirtualStorage& storage = options.storage;
    const bool is_random =
        storage.latency_spread > 0.0 || storage.failure_share > 0.0 || storage.hang_share > 0.0;
    const bool has_latency =
        std::ranges::any_of(options.latencies_ms, [](double latency) { return latency > 0.0; });
    return refuse_idle_flags(
        command, {{{"--radius"}, has_policy(PagingChoice::distance), "goes with --policy distance"},
                  {{"--horizon-s"},
                   has_policy(PagingChoice::deadline, PagingChoice::oracle),
                   "goes with --policy deadline or oracle: distance foresees nothing"},
                  {{"--start-s"}, has_track, "goes with a track file as --path"},
                  {{"--speed"}, takes_speed, "goes with a path that has no @SPEED of its own"},
                  {{"--altitude"},
                   takes_altitude,
                   "goes with a path that has no @SPEED:ALTITUDE of its own"},
                  {{"--latency-spread"}, has_latency, "goes with a --latency-ms above 0"},
                  {{"--storage-seed"},
                   is_random,
                   "goes with --latency-spread, --failure-share or --hang-share"}});
}

std::vector<PagingCell> list_cells(const PageOptions& options) {
    std::vector<PagingCell> cells;
    for (const std::string& text : options.paths) {
        const PathItem item = parse_path_item(text);
        std::vector<std::optional<double>> speeds{item.speed};
        if (!item.speed && !options.speeds.empty()) {
            speeds.assign(options.speeds.begin(), options.speeds.end());
        }
        for (const std::optional<double>& speed : speeds) {
            for (const double latency_ms : options.latencies_ms) {
                for (const double bandwidth_mb : options.bandwidths_mb) {
                    for (const double memory_mb : options.memories_mb) {
                        cells.push_back(
                            {.path = item.name,
                             .speed = speed,
                             .altitude = item.altitude ? item.altitude : given(options.altitude),
                             .latency_ms = latency_ms,
                             .bandwidth_mb = bandwidth_mb,
                             .memory_mb = memory_mb});
                    }
                }
            }
        }
    }
    return cells;
}

PagingRunSettings run_settings(const PageOptions& options, const PagingCell& cell,
                               PagingChoice policy, double radius) {
    PagingRunSettings settings;
    settings.policy = policy;
    settings.maker.pager.memory_bytes = static_cast<std::size_t>(cell.memory_mb * 0x1p20);
    settings.maker.pager.horizon = options.horizon;
    settings.maker.pager.contact_share = options.contact_share;
    settings.maker.pager.distance_radius = radius;
    settings.maker.triangulator.triangle_budget = options.budget;
    settings.maker.triangulator.max_error_px = options.max_error_px;
    settings.storage = options.storage;
    settings.storage.latency = 1e-3 * cell.latency_ms;
    settings.storage.bandwidth = 1e6 * cell.bandwidth_mb;
    settings.storage.seed = options.storage_seed;
    settings.storage.slots = static_cast<int>(options.slots);
    settings.view = make_view(options.size, options.fov_deg);
    settings.fps = options.fps;
    settings.body_count = options.body_count;
    settings.announce = options.announce;
    return settings;
}

}  // namespace terrane::tools
