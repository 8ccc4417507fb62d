// SPDX-License-Identifier: MIT
#include "flight/flight_options.h"
#include "flight/flight_output.h"
#include "flight/path_ground.h"
#include "frames/frame_maker.h"
#include "frames/paging_storage.h"
#include "program/command.h"
#include "program/progress.h"
#include "program/summary.h"

#include <terrane/playback/camera_path.h>
#include <terrane/playback/track.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
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
    // of simulated storage; NaN if not given
    double latency_ms = std::numeric_limits<double>::quiet_NaN();
    double bandwidth_mb = std::numeric_limits<double>::quiet_NaN();

    bool has_slow_storage() const { return !std::isnan(latency_ms) || !std::isnan(bandwidth_mb); }
};

// The simulated storage of a flight; null if neither --latency-ms nor --bandwidth-mb is given.
std::shared_ptr<SlowHeights> open_slow_storage(const FlyOptions& options, const Terrain& terrain) {
    if (!options.has_slow_storage()) return nullptr;
    constexpr double kMegabyte = 1e6;
    const double bandwidth =
        given(options.bandwidth_mb).value_or(std::numeric_limits<double>::infinity());
    return std::make_shared<SlowHeights>(heightfield_of(terrain),
                                         1e-3 * given(options.latency_ms).value_or(0.0),
                                         kMegabyte * bandwidth);
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

// Plays the flight: frame i shows time i / fps. Loaders run in real time.
//
// @param storage null without simulated storage
Result<void> fly(const FlyOptions& options, const CameraPath& path, std::size_t frame_count,
                 SlowHeights* storage, FrameMaker& maker, FlightOutput& output) {
    Progress progress("flying");
    std::vector<CameraMoment> future;
    if (options.policy == PagingChoice::oracle) future = camera_trajectory(path_moments(path), 0.0);
    const double horizon = frame_maker_settings(options).pager.horizon;
    const View picture = make_view(options.size, options.fov_deg);
    maker.load_until_stable(view_at(picture, path.at(0.0)), {}, 0.0);
    if (output.is_closed()) return {};
    if (storage != nullptr) storage->begin();
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < frame_count; ++i) {
        progress.show(static_cast<double>(i) / static_cast<double>(frame_count));
        const double time = static_cast<double>(i) / options.fps;
        if (options.waits_for_clock()) {
            std::this_thread::sleep_until(start + std::chrono::duration<double>(time));
        }
        const CameraPose pose = path.at(time);
        const View view = view_at(picture, pose);
        const CameraNeed camera{
            .view = view,
            .velocity = pose.velocity,
            .trajectory = trajectory_ahead(std::span<const CameraMoment>(future), time, horizon)};
        TERRANE_TRY(output.add(maker.make(camera, {}, time), view));
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

CommandResult<void> run_fly(const FlyOptions& options, const CLI::App& command) {
    TERRANE_TRY(check(options));
    TERRANE_TRY(refuse_idle_flags(
        command,
        {{{"--radius"}, options.policy == PagingChoice::distance, "goes with --policy distance"},
         {{"--start-s"}, names_track_file(options.path), "goes with a track file as --path"},
         {{"--frame-ms"}, options.has_pictures(), "goes with --png, --video or --window"}}));
    TERRANE_TRY(const Terrain terrain, open_terrain(options.terrain));
    TERRANE_TRY(check_limits(options, terrain));
    TERRANE_TRY(const CameraPath path, open_path(options.path, terrain,
                                                 {.speed = given(options.speed),
                                                  .altitude = given(options.altitude),
                                                  .start = options.start,
                                                  .seconds = given(options.seconds)}));
    TERRANE_TRY(const std::size_t frame_count, count_frames(options.fps, path.duration()));
    TERRANE_TRY(note_lack_of_ground(options, path, terrain));
    const std::shared_ptr<SlowHeights> storage = open_slow_storage(options, terrain);
    TERRANE_TRY(const auto source,
                storage ? with_volumes(terrain, storage)
                        : CommandResult<std::shared_ptr<const HeightSource>>(terrain.source));
    TERRANE_TRY(FrameMaker maker, FrameMaker::create(source, frame_maker_settings(options)));
    TERRANE_TRY(FlightOutput output, FlightOutput::create(options, terrain));
    TERRANE_TRY(add_scene(terrain, maker, output));
    if (!std::isnan(options.frame_ms)) {
        TERRANE_TRY(
            const FrameGovernor governor,
            FrameGovernor::create({.frame_ms = options.frame_ms,
                                   .least_budget = std::min<std::size_t>(options.budget, 2000),
                                   .most_budget = options.budget},
                                  options.budget / 4));
        maker.set_governor(governor);
    }

    if (const Result<void> flown = fly(options, path, frame_count, storage.get(), maker, output);
        !flown) {
        return pass_on(flown.error());
    }
    nlohmann::ordered_json summary =
        summarize(output.frames(), options.memory_bytes(), options.fps);
    summary["seconds"] = static_cast<double>(output.frames().size()) / options.fps;
    summary["path"] = options.path;
    summary["terrain"] = terrain.name;
    TERRANE_TRY(output.finish("Flight over " + terrain.name, summary));
    print_summary(summary, options.json);
    return output.verdict(frame_count);
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
    add_not_negative(*fly, "--start-s", options->start, "Seconds of a track to leave out");
    add_flight_options(
        *fly, *options,
        {"bodies", "volumes", "objects", "nodes", "imagery", "materials", "water", "water_m"});
    add_paging_choice(*fly, options->policy, options->radius);
    add_in_range(*fly, "--latency-ms", options->latency_ms, 0.0, 1e6,
                 "Storage that takes so long to begin to answer, in real time: see --realtime");
    add_in_range(*fly, "--bandwidth-mb", options->bandwidth_mb, 0.001, 1e6,
                 "Storage of so many MB of 10^6 bytes a second, shared by the loader threads");
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
