// SPDX-License-Identifier: MIT
#include "commands/journey.h"
#include "commands/run_files.h"
#include "commands/travellers.h"
#include "flight/flight_options.h"
#include "flight/flight_output.h"
#include "flight/path_ground.h"
#include "frames/frame_maker.h"
#include "frames/paging_storage.h"
#include "program/command.h"
#include "program/progress.h"
#include "program/summary.h"
#include "record/replay.h"
#include "record/run_bodies.h"
#include "record/run_record.h"

#include <terrane/playback/camera_path.h>
#include <terrane/playback/track.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

struct FlyOptions : FlightOptions {
    double start = 0.0;
    double frame_ms = std::numeric_limits<double>::quiet_NaN();  // NaN: the budget is fixed
    std::string record, replay;                                  ///< files; "" for none
};

// The simulated storage of a flight; null if neither --latency-ms nor --bandwidth-mb is given.
std::shared_ptr<SlowHeights> open_slow_storage(const FlyOptions& options, const Terrain& terrain) {
    if (!options.has_slow_storage()) return nullptr;
    return std::make_shared<SlowHeights>(heightfield_of(terrain));
}

// Shows the objects of a terrain's scene, and its bodies at their start.
Result<void> add_scene(const Terrain& terrain, FrameMaker& maker, FlightOutput& output) {
    if (terrain.bodies.empty()) return output.add_objects(terrain, maker);
    TERRANE_TRY(BodyNodes nodes, output.add_bodies(terrain, maker));
    for (std::size_t i = 0; i < terrain.bodies.size(); ++i) {
        const PlacedBody& body = terrain.bodies[i];
        BodyState state = body.state;
        if (body.settings.type == BodyType::static_body) state.condition = BodyCondition::fixed;
        nodes.set_node(i, body);
        TERRANE_TRY(nodes.show(i, body.settings.shape, state));
    }
    return {};
}

/// Where the camera of a flight is, frame by frame: frame i shows time i / fps.
struct FlightPlan {
    std::function<CameraPose(std::size_t frame)> pose_at;
    std::size_t first_frame = 0, frame_count = 1;
    std::vector<CameraMoment> future = {};  ///< that the pager is told; empty: none
};

// Plays a flight. Loaders run in real time.
//
// @param storage  null without simulated storage
// @param recorder null: the flight is not recorded
Result<void> fly(const FlyOptions& options, const FlightPlan& plan, SlowHeights* storage,
                 RunRecorder* recorder, FrameMaker& maker, FlightOutput& output) {
    Progress progress("flying");
    const double horizon = frame_maker_settings(options).pager.horizon;
    const View picture = make_view(options.size, options.fov_deg);
    const double first_time = static_cast<double>(plan.first_frame) / options.fps;
    maker.load_until_stable(view_at(picture, plan.pose_at(plan.first_frame)), {}, first_time);
    if (output.is_closed()) return {};
    if (storage != nullptr) storage->set_speed(storage_speed(options));
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < plan.frame_count; ++i) {
        progress.show(static_cast<double>(i) / static_cast<double>(plan.frame_count));
        const double time = static_cast<double>(plan.first_frame + i) / options.fps;
        if (options.waits_for_clock()) {
            std::this_thread::sleep_until(start + std::chrono::duration<double>(time - first_time));
        }
        const CameraPose pose = plan.pose_at(plan.first_frame + i);
        const View view = view_at(picture, pose);
        const CameraNeed camera{.view = view,
                                .velocity = pose.velocity,
                                .trajectory = trajectory_ahead(
                                    std::span<const CameraMoment>(plan.future), time, horizon)};
        TERRANE_TRY(output.add(maker.make(camera, {}, time), view));
        if (recorder != nullptr) recorder->add_pose(pose);
        const FrameRecord& record = output.frames().back();
        maker.add_frame_time(record);
        if (output.is_closed()) break;
    }
    return {};
}

// Prints a note if parts of a path are not over ground.
Result<void> note_lack_of_ground(const FlyOptions& options, const CameraPath& path,
                                 const Terrain& terrain) {
    TERRANE_TRY(const PathGround ground, find_ground_under(lines_of(path), terrain));
    if (ground.is_complete()) return {};
    print_note(fmt::format("the path '{}' {}; {:.6g} of its {:.6g} m have no ground", options.path,
                           describe_lack(ground, terrain), ground.off_ground, ground.length));
    return {};
}

// The maker of the frames of a flight or replay, with the governor of --frame-ms.
CommandResult<FrameMaker> make_frame_maker(const FlyOptions& options, const Terrain& terrain,
                                           const std::shared_ptr<SlowHeights>& storage) {
    TERRANE_TRY(const auto source,
                storage ? with_volumes(terrain, storage)
                        : CommandResult<std::shared_ptr<const HeightSource>>(terrain.source));
    TERRANE_TRY(FrameMaker maker, FrameMaker::create(source, frame_maker_settings(options)));
    if (std::isnan(options.frame_ms)) return maker;
    TERRANE_TRY(const FrameGovernor governor,
                FrameGovernor::create({.frame_ms = options.frame_ms,
                                       .least_budget = std::min<std::size_t>(options.budget, 2000),
                                       .most_budget = options.budget},
                                      options.budget / 4));
    maker.set_governor(governor);
    return maker;
}

nlohmann::ordered_json summarize(const FlyOptions& options, const Terrain& terrain,
                                 const FlightOutput& output) {
    nlohmann::ordered_json summary =
        summarize(output.frames(), options.memory_bytes(), options.fps);
    summary["seconds"] = static_cast<double>(output.frames().size()) / options.fps;
    if (options.replay.empty()) summary["path"] = options.path;
    summary["terrain"] = terrain.name;
    describe_http(terrain, summary);
    return summary;
}

// ---- Replays ----

// The columns that drive, walk or drop added to its frames.csv; a replay adds the same.
std::vector<std::string> columns_of(RunKind kind) {
    if (kind == RunKind::drop || kind == RunKind::view) return drop_columns();
    std::vector<std::string> names = journey_columns();
    const std::vector<std::string> of_traveller =
        kind == RunKind::drive ? vehicle_columns() : character_columns();
    names.insert(names.end(), of_traveller.begin(), of_traveller.end());
    return names;
}

std::vector<double> figures_of(const Replay& replay) {
    const RunSettings& settings = replay.record().settings();
    if (settings.kind == RunKind::drop || settings.kind == RunKind::view)
        return drop_figures(replay.figures());
    const World& world = replay.world();
    std::vector<double> figures =
        journey_figures(world.state(settings.traveller), replay.figures());
    const std::vector<double> of_traveller =
        settings.kind == RunKind::drive ? vehicle_figures(*world.vehicle(settings.traveller))
                                        : character_figures(*world.character(settings.traveller));
    figures.insert(figures.end(), of_traveller.begin(), of_traveller.end());
    return figures;
}

/// The frames of a record that are shown.
struct FrameRange {
    std::size_t first = 0, count = 1;
};

CommandResult<FrameRange> frames_to_show(const FlyOptions& options, const RunRecord& record) {
    const double end = static_cast<double>(record.frame_count() - 1) / options.fps;
    if (options.start > end) {
        return failure(fmt::format("--start-s {:.6g} is after the end of the record '{}', {:.6g} s",
                                   options.start, record.path(), end));
    }
    FrameRange range{.first = record.frame_at(options.start)};
    range.count = record.frame_count() - range.first;
    if (std::isnan(options.seconds)) return range;
    TERRANE_TRY(const std::size_t wanted, count_frames(options.fps, options.seconds));
    range.count = std::min(range.count, wanted);
    return range;
}

// Plays the replay of a run with bodies, from its current frame.
//
// @param editor of the maker's ground; null: the ground does not change
Result<void> show_replay(const FlyOptions& options, std::size_t frame_count, SlowHeights* storage,
                         Replay& replay, ReplayBodies& bodies, GroundEditor* editor,
                         FrameMaker& maker, FlightOutput& output) {
    Progress progress("replaying");
    const View picture = make_view(options.size, options.fov_deg);
    const bool is_drop = replay.record().settings().kind == RunKind::drop;
    std::vector<BodyNeed> needs;
    // the bodies of a drop have no ground of their own in its frames
    const auto find_needs = [&] {
        if (is_drop) return;
        const std::span<const BodyNeed> of_world = replay.world().needs();
        needs.assign(of_world.begin(), of_world.end());
    };
    const auto change_ground = [&]() -> Result<void> {
        if (editor == nullptr) return {};
        TERRANE_TRY(editor->set_edits(replay.ground_edits()));
        editor->update(maker.pager());
        return {};
    };
    find_needs();
    TERRANE_TRY(change_ground());
    const double first_time = replay.time();
    maker.load_until_stable(replay.view(picture), needs, first_time);
    if (output.is_closed()) return {};
    if (storage != nullptr) storage->set_speed(storage_speed(options));
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < frame_count; ++i) {
        progress.show(static_cast<double>(i) / static_cast<double>(frame_count));
        if (i > 0) TERRANE_TRY(replay.advance());
        const double time = replay.time();
        if (options.waits_for_clock()) {
            std::this_thread::sleep_until(start + std::chrono::duration<double>(time - first_time));
        }
        const View view = replay.view(picture);
        TERRANE_TRY(bodies.show(replay));
        TERRANE_TRY(change_ground());
        find_needs();
        MadeFrame frame =
            maker.make({.view = view, .velocity = replay.camera_velocity()}, needs, time);
        frame.record.extra = figures_of(replay);
        TERRANE_TRY(output.add(std::move(frame), view));
        maker.add_frame_time(output.frames().back());
        if (output.is_closed()) break;
    }
    return {};
}

CommandResult<void> refuse_flags_of_a_record(const FlyOptions& options, const CLI::App& command) {
    TERRANE_TRY(refuse_idle_flags(
        command, {{{"--path", "--speed", "--altitude", "--fps"},
                   false,
                   "is in the record that --replay reads"},
                  {{"--record"}, false, "does not go with --replay"},
                  {terrain_detail_flags(command), chooses_terrain(command),
                   "is in the record that --replay reads, unless --dem, --seed or --scene names "
                   "its terrain"}}));
    if (options.policy == PagingChoice::oracle)
        return usage_error("--policy oracle does not go with --replay");
    return {};
}

CommandResult<void> run_replay(FlyOptions options, const CLI::App& command) {
    TERRANE_TRY(refuse_flags_of_a_record(options, command));
    TERRANE_TRY(RunRecord record, RunRecord::open(options.replay));
    const RunKind kind = record.settings().kind;
    options.fps = record.settings().fps;
    TERRANE_TRY(const FrameRange range, frames_to_show(options, record));
    TerrainOptions wanted = options.terrain;
    if (!chooses_terrain(command)) {
        TERRANE_TRY(wanted, terrain_options_of(record, options.terrain));
    }
    wanted.dig_spacing = dig_spacing_of(record);
    TERRANE_TRY(Terrain terrain, open_terrain(wanted));
    TERRANE_TRY(record.check_terrain(terrain));
    std::unique_ptr<GroundEditor> editor;
    if (!record.ground().is_empty()) {
        if (options.has_slow_storage()) {
            return failure(
                fmt::format("--latency-ms and --bandwidth-mb do not go with the digs of "
                            "the record '{}'",
                            record.path()));
        }
        TERRANE_TRY(editor, GroundEditor::create(terrain, 0));
    }
    TERRANE_TRY(check_limits(options, terrain));
    const std::shared_ptr<SlowHeights> storage = open_slow_storage(options, terrain);
    TERRANE_TRY(FrameMaker maker, make_frame_maker(options, terrain, storage));
    std::optional<std::uint64_t> state_hash;
    const auto play = [&]() -> CommandResult<FlightOutput> {
        if (kind == RunKind::flight) {
            TERRANE_TRY(const std::vector<CameraPose> poses, record.read_poses());
            TERRANE_TRY(FlightOutput output, FlightOutput::create(options, terrain));
            TERRANE_TRY(add_scene(terrain, maker, output));
            const FlightPlan plan{.pose_at = [&](std::size_t frame) { return poses[frame]; },
                                  .first_frame = range.first,
                                  .frame_count = range.count};
            TERRANE_TRY(fly(options, plan, storage.get(), nullptr, maker, output));
            return output;
        }
        TERRANE_TRY(Replay replay,
                    Replay::create(std::move(record), terrain, options.memory_bytes()));
        TERRANE_TRY(replay.seek(range.first));
        TERRANE_TRY(FlightOutput output, FlightOutput::create(options, terrain, columns_of(kind)));
        TERRANE_TRY(BodyNodes nodes, output.add_bodies(terrain, maker));
        ReplayBodies bodies(replay, terrain, std::move(nodes));
        TERRANE_TRY(show_replay(options, range.count, storage.get(), replay, bodies, editor.get(),
                                maker, output));
        if (replay.frame() + 1 == replay.record().frame_count()) TERRANE_TRY(replay.finish());
        state_hash = replay.world().state_hash();
        return output;
    };
    TERRANE_TRY(FlightOutput output, play());
    nlohmann::ordered_json summary = summarize(options, terrain, output);
    summary["replay"] = options.replay;
    summary["run"] = name_of(kind);
    if (state_hash) summary["state_hash"] = hash_text(*state_hash);
    TERRANE_TRY(output.finish("Replay over " + terrain.name, summary));
    print_summary(summary, options.json);
    return output.verdict(range.count);
}

CommandResult<void> run_fly(const FlyOptions& options, const CLI::App& command) {
    TERRANE_TRY(check(options));
    const bool is_replay = !options.replay.empty();
    TERRANE_TRY(refuse_idle_flags(
        command,
        {{{"--radius"}, options.policy == PagingChoice::distance, "goes with --policy distance"},
         {{"--start-s"},
          is_replay || names_track_file(options.path),
          "goes with a track file as --path, or with --replay"},
         {{"--frame-ms"}, options.has_pictures(), "goes with --png, --video or --window"}}));
    if (is_replay) return run_replay(options, command);
    TERRANE_TRY(const Terrain terrain, open_terrain(options.terrain));
    TERRANE_TRY(check_limits(options, terrain));
    TERRANE_TRY(const CameraPath path, open_path(options.path, terrain,
                                                 {.speed = given(options.speed),
                                                  .altitude = given(options.altitude),
                                                  .start = options.start,
                                                  .seconds = given(options.seconds)}));
    FlightPlan plan{.pose_at = [&](std::size_t frame) {
        return path.at(static_cast<double>(frame) / options.fps);
    }};
    TERRANE_TRY(plan.frame_count, count_frames(options.fps, path.duration()));
    if (options.policy == PagingChoice::oracle)
        plan.future = camera_trajectory(path_moments(path), 0.0);
    TERRANE_TRY(note_lack_of_ground(options, path, terrain));
    const std::shared_ptr<SlowHeights> storage = open_slow_storage(options, terrain);
    TERRANE_TRY(FrameMaker maker, make_frame_maker(options, terrain, storage));
    TERRANE_TRY(FlightOutput output, FlightOutput::create(options, terrain));
    TERRANE_TRY(add_scene(terrain, maker, output));
    TERRANE_TRY(std::optional<RunRecorder> recorder,
                begin_record(options.record, command, terrain, {.fps = options.fps}));

    TERRANE_TRY(fly(options, plan, storage.get(), recorder ? &*recorder : nullptr, maker, output));
    nlohmann::ordered_json summary = summarize(options, terrain, output);
    TERRANE_TRY(output.finish("Flight over " + terrain.name, summary));
    TERRANE_TRY(end_record(recorder, std::nullopt, summary));
    print_summary(summary, options.json);
    return output.verdict(plan.frame_count);
}

}  // namespace

void add_fly_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<FlyOptions>();
    options->path = "straight";
    CLI::App* fly = app.add_subcommand(
        "fly", "Flies a camera along a path, and measures, draws and reports every frame");
    fly->add_option("--path", options->path,
                    CameraPath::built_in_list() +
                        ", or a track: .csv (columns x_m, y_m and, where known, time_s, z_m), "
                        ".gpx, .igc, .tum")
        ->type_name("PATH")
        ->capture_default_str();
    add_positive(*fly, "--speed", options->speed,
                 "Metres a second; without it 100 (spins: 20), or a track's own times");
    add_positive(*fly, "--altitude", options->altitude,
                 "Metres above the smoothed ground; 200 without it, or a track's own heights");
    add_positive(*fly, "--seconds", options->seconds, "How long; 20 without it, or all of a track");
    add_not_negative(*fly, "--start-s", options->start,
                     "Seconds of a track, or of a replay, to leave out");
    fly->add_option(
           "--replay", options->replay,
           "Show a run again that view, fly, drive, walk or drop recorded: the same bodies and "
           "cameras, "
           "bit for bit, in frames as the flags of pictures say. It opens the terrain of the run; "
           "--dem, --seed or --scene, with the other flags of the terrain, say where that is now")
        ->type_name("FILE");
    add_record_option(*fly, options->record);
    add_flight_options(
        *fly, *options,
        {"bodies", "volumes", "objects", "nodes", "imagery", "materials", "water", "water_m"});
    add_paging_choice(*fly, options->policy, options->radius);
    add_storage_options(*fly, *options);
    add_in_range(
        *fly, "--frame-ms", options->frame_ms, 0.1, 1e5,
        "Let the triangles follow the times of frames, update and drawing together, so that "
        "they take this long, milliseconds; --budget is the most then. Frames depend on the "
        "machine");
    fly->add_flag("--verify", options->verify,
                  "Measure each frame's error and movement by brute force: slow");
    fly->footer(
        "Before the first frame it waits for what that frame needs; after that never. A note says\n"
        "where the path has no ground under it, and what was filled in a track.\n"
        "Example: terrane fly --dem tools/data/jacksboro.tif --seed 7 --path canyon --video --out "
        "out/flight");
    fly->callback([&context, options, fly] {
        context.run = [options, fly] { return run_fly(*options, *fly); };
    });
}

}  // namespace terrane::tools
