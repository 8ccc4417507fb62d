// SPDX-License-Identifier: MIT
#include "flight/flight_options.h"
#include "lab/paging_run.h"
#include "lab/paging_table.h"
#include "program/command.h"
#include "program/output_file.h"
#include "program/progress.h"
#include "program/summary.h"
#include "scene/terrain_options.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <memory>
#include <span>
#include <utility>

namespace terrane::tools {
namespace {

/// All runs. The paths keep their addresses.
struct Plan {
    std::deque<CameraPath> paths;
    std::vector<PagingRow> rows;  ///< play() fills in their runs
    std::vector<PagingJob> jobs;
    std::size_t rows_done = 0;
};

CommandResult<Plan> make_plan(const PageOptions& options, const Terrain& terrain) {
    Plan plan;
    PagingCell last;
    for (const PagingCell& cell : list_cells(options)) {
        const bool is_same_path =
            cell.path == last.path && cell.speed == last.speed && cell.altitude == last.altitude;
        if (!is_same_path) {
            TERRANE_TRY(CameraPath path, open_path(cell.path, terrain,
                                                   {.speed = cell.speed,
                                                    .altitude = cell.altitude,
                                                    .start = options.start,
                                                    .seconds = options.seconds}));
            plan.paths.push_back(std::move(path));
        }
        last = cell;
        const CameraPath& path = plan.paths.back();
        TERRANE_TRY(const std::size_t frames, count_frames(options.fps, path.duration()));
        for (const PagingChoice policy : options.policies) {
            const bool has_jumps = !path.jumps().empty() && options.announce == 0.0;
            const std::vector<double> one_radius{1.0};
            for (const double radius :
                 policy == PagingChoice::distance ? options.radii : one_radius) {
                plan.jobs.push_back(
                    {&path, run_settings(options, cell, policy, radius), plan.rows.size()});
                plan.jobs.back().settings.frame_count = frames;
            }
            plan.rows.push_back(
                {.cell = cell, .policy = policy, .has_unannounced_jumps = has_jumps});
        }
    }
    return plan;
}

void print_row(const PagingRow& row, bool is_only_one, bool as_json) {
    if (as_json || is_only_one) return print_summary(to_json(row), as_json);
    const PagingTotals& totals = row.run.totals;
    const std::string speed = row.cell.speed ? fmt::format("@{}", *row.cell.speed) : "";
    const std::string radius =
        row.policy == PagingChoice::distance ? fmt::format(" {}", row.radius) : "";
    print_text(fmt::format(
        "{:<24} {:>5} ms {:>5} MB/s {:>5} MB  {:<12} {:>6} {:>11.2f} {:>6.1f} % {:>7} {:>8.1f}\n",
        row.cell.path + speed, row.cell.latency_ms, row.cell.bandwidth_mb, row.cell.memory_mb,
        name_of(row.policy) + radius, totals.late_frames, totals.excess_error.late_px_s,
        100.0 * totals.wasted_share(), totals.contact_late,
        static_cast<double>(totals.peak_bytes) / 0x1p20));
}

// Plays all runs and keeps the best of each row; prints rows when they are complete. Fails with cancelled if the
// program was interrupted; the rows before Plan::rows_done are then complete.
Result<void> play(const PageOptions& options, const Terrain& terrain, Plan& plan) {
    Progress progress("paging");
    ChunkCache chunks(terrain.source, static_cast<std::size_t>(options.cache_mb * 0x1p20));
    const bool is_only_one = plan.rows.size() == 1;
    const bool keeps_frames =
        plan.rows.size() <= kMostPlottedCells * options.policies.size() && !options.out.empty();
    if (!is_only_one && !options.json) {
        print_text(fmt::format("{:<24} {:>8} {:>10} {:>8}  {:<12} {:>6} {:>11} {:>8} {:>7} {:>8}\n",
                               "path", "latency", "bandwidth", "memory", "policy", "late",
                               "late excess", "wasted", "contact", "peak MB"));
    }
    const auto take = [&](std::size_t job, PagingRun run) -> Result<void> {
        PagingRow& row = plan.rows[plan.jobs[job].row];
        const bool is_first = row.run.totals.frames == 0;
        if (!keeps_frames) run.frames = {};
        if (is_first || is_better(run.totals, row.run.totals)) {
            row.run = std::move(run);
            row.radius = plan.jobs[job].settings.maker.pager.distance_radius;
        }
        const bool is_last =
            job + 1 == plan.jobs.size() || plan.jobs[job + 1].row != plan.jobs[job].row;
        if (!is_last) return {};
        print_row(row, is_only_one, options.json);
        ++plan.rows_done;
        return {};
    };
    std::atomic<std::size_t> frames_done = 0;
    std::size_t frame_count = 0;
    for (PagingJob& job : plan.jobs) {
        job.settings.frames_done = &frames_done;
        frame_count += job.settings.frame_count;
    }
    const auto show = [&] {
        progress.show(static_cast<double>(frames_done) / static_cast<double>(frame_count));
    };
    return play_all(terrain.source, chunks, plan.jobs, options.threads, take, show);
}

Result<void> write_frames(const OutputPlace& place, const PagingRun& run) {
    TERRANE_TRY(OutputFile file, OutputFile::create(place));
    file.write(
        "time_s,eye_x_m,eye_y_m,eye_z_m,triangles,error_px,late,status,threshold_px,"
        "resident_bytes,in_flight_bytes,chunks_resident,late_chunks,contact_late,bytes_read,"
        "chunks_loaded,chunks_evicted,chunks_cancelled\n");
    for (std::size_t i = 0; i < run.frames.size(); ++i) {
        const FrameRecord& r = run.frames[i];
        file.write(fmt::format(
            "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", r.time, r.eye_world.x(),
            r.eye_world.y(), r.eye_world.z(), r.triangles, r.error_px, r.is_late() ? 1 : 0,
            name_of(r.status), r.threshold_px, r.paging.resident_bytes, r.paging.in_flight_bytes,
            r.paging.resident_chunks, r.paging.late_chunks, run.contact_late[i],
            r.paging.bytes_read, r.paging.loaded, r.paging.evicted, r.paging.cancelled));
    }
    return file.commit();
}

Result<void> write_files(const PageOptions& options, const Terrain& terrain, const Plan& plan,
                         const std::shared_ptr<OutputFolder>& folder) {
    if (folder == nullptr) return {};
    const std::span<const PagingRow> rows = std::span(plan.rows).first(plan.rows_done);
    TERRANE_TRY(folder->clear());
    if (plan.rows.size() == 1) {
        TERRANE_TRY(write_frames(OutputPlace(folder, kFramesName), rows.front().run));
    }
    nlohmann::ordered_json summary;
    summary["terrain"] = terrain.name;
    describe_http(terrain, summary);
    summary["flights"] = plan.jobs.size();
    if (rows.size() < plan.rows.size()) summary["interrupted"] = true;
    summary["seconds"] = options.seconds;
    summary["fps"] = options.fps;
    summary["max_error_px"] = options.max_error_px;
    summary["bodies"] = options.body_count;
    summary["slots"] = options.slots;
    summary["horizon_s"] = options.horizon;
    return write_paging_report(OutputPlace(folder, kReportName),
                               {.title = "Paging over " + terrain.name, .summary = summary}, rows);
}

CommandResult<void> run_page(const PageOptions& options, const CLI::App& command) {
    TERRANE_TRY(check(options));
    TERRANE_TRY(refuse_idle_page_flags(options, command));
    TERRANE_TRY(const Terrain terrain, open_terrain(options.terrain));
    TERRANE_TRY(check_budget(terrain, options.budget));
    for (const double memory_mb : options.memories_mb) {
        TERRANE_TRY(check_memory(terrain, memory_mb));
    }
    TERRANE_TRY(Plan plan, make_plan(options, terrain));
    const bool has_jumps = std::ranges::any_of(
        plan.paths, [](const CameraPath& path) { return !path.jumps().empty(); });
    TERRANE_TRY(refuse_idle_flags(
        command,
        {{{"--announce-s"}, has_jumps, "goes with a path that jumps, such as teleports"}}));
    TERRANE_TRY(const auto folder, OutputFolder::open(options.out, {kFramesName, kReportName}));
    watch_for_interrupts();
    const Result<void> played = play(options, terrain, plan);
    if (!played && played.error().code != ErrorCode::cancelled) return pass_on(played.error());
    if (plan.rows_done > 0) {
        TERRANE_TRY(write_files(options, terrain, plan, folder));
    }
    if (played) return {};
    return failure(fmt::format("interrupted after {} of {} lines of the table", plan.rows_done,
                               plan.rows.size()));
}

}  // namespace

void add_page_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<PageOptions>();
    CLI::App* page = app.add_subcommand(
        "page",
        "Plays paths against simulated storage on a virtual clock, and counts what is late");
    add_page_options(*page, *options);
    page->footer(
        "Lists, separated by commas, are played in every combination; figures are the same on "
        "every "
        "machine.\n"
        "A frame is late where its error is above the target because a needed chunk is absent.\n"
        "Example: terrane page --seed 7 --path straight@250,turns --policy "
        "deadline,distance,oracle "
        "--radius 0.5,1,2 --bandwidth-mb 10 --out out/page");
    page->callback([&context, options, page] {
        context.run = [options, page] { return run_page(*options, *page); };
    });
}

}  // namespace terrane::tools
