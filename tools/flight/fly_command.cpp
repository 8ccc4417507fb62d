// SPDX-License-Identifier: MIT
#include "command.h"
#include "flight/flight_options.h"
#include "flight/flight_output.h"
#include "flight/frame_maker.h"
#include "output/progress.h"
#include "output/summary.h"
#include "track/camera_path.h"
#include "track/track.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <thread>
#include <utility>

namespace terrane::tools {
namespace {

struct FlyOptions : FlightOptions {
    double start = 0.0;
};

std::optional<double> given(double value) {
    return std::isnan(value) ? std::nullopt : std::optional<double>(value);
}

Result<CameraPath> open_path(const FlyOptions& options, const Terrain& terrain) {
    const CameraPathSettings settings{.speed = given(options.speed),
                                      .altitude = given(options.altitude),
                                      .start = options.start,
                                      .seconds = given(options.seconds)};
    if (!names_track_file(options.path)) {
        return CameraPath::create(options.path, *terrain.source, settings);
    }
    Result<Track> track = read_track(options.path, terrain.dem ? &*terrain.dem : nullptr);
    if (!track) return tl::unexpected(track.error());
    return CameraPath::create(std::move(*track), *terrain.source, settings);
}

View view_at(const FlyOptions& options, const CameraPose& pose) {
    View view = make_view(options);
    view.eye_world = pose.eye_world;
    view.forward = pose.forward;
    view.up = pose.up;
    return view;
}

// Frame i is the moment i / fps. Loaders run beside it in real time.
Result<void> fly(const FlyOptions& options, const CameraPath& path, std::size_t frame_count,
                 FrameMaker& maker, FlightOutput& output) {
    Progress progress("flying");
    maker.settle(view_at(options, path.at(0.0)), {});
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < frame_count; ++i) {
        progress.show(static_cast<double>(i) / static_cast<double>(frame_count));
        const double time = static_cast<double>(i) / options.fps;
        if (options.waits_for_clock()) {
            std::this_thread::sleep_until(start + std::chrono::duration<double>(time));
        }
        const CameraPose pose = path.at(time);
        const View view = view_at(options, pose);
        const Result<void> added = output.add(maker.make(view, pose.velocity, {}, time), view);
        if (!added) return added;
        if (output.is_closed()) break;
    }
    return {};
}

CommandResult<void> run_fly(const FlyOptions& options) {
    if (const CommandResult<void> good = check(options); !good) return good;
    const CommandResult<Terrain> terrain = open_terrain(options.terrain);
    if (!terrain) return pass_on(terrain.error());
    const Result<CameraPath> path = open_path(options, *terrain);
    if (!path) return pass_on(path.error());
    const CommandResult<std::size_t> frame_count = count_frames(options, path->duration());
    if (!frame_count) return pass_on(frame_count.error());
    Result<FrameMaker> maker = FrameMaker::create(terrain->source, options);
    if (!maker) return pass_on(maker.error());
    Result<FlightOutput> output = FlightOutput::create(options, *terrain->source);
    if (!output) return pass_on(output.error());

    if (const Result<void> flown = fly(options, *path, *frame_count, *maker, *output); !flown) {
        return pass_on(flown.error());
    }
    nlohmann::ordered_json summary = summarize(output->frames(), options.memory_bytes());
    summary["seconds"] = static_cast<double>(output->frames().size()) / options.fps;
    summary["path"] = options.path;
    summary["terrain"] = terrain->name;
    const Result<void> ended = output->finish("Flight over " + terrain->name, summary);
    if (!ended) return pass_on(ended.error());
    print_summary(summary, options.json);
    return {};
}

}  // namespace

void add_fly_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<FlyOptions>();
    options->path = "straight";
    CLI::App* fly = app.add_subcommand(
        "fly", "Flies a camera along a path, and measures, draws and reports every frame");
    fly->add_option("--path", options->path,
                    "straight, orbit, canyon, or a track: .csv (columns x_m, y_m and, where known, "
                    "time_s, z_m), .gpx, .igc, .tum")
        ->type_name("PATH")
        ->capture_default_str();
    add_positive(*fly, "--speed", options->speed,
                 "Metres a second; 100 without it, or a track's own times");
    add_positive(*fly, "--altitude", options->altitude,
                 "Metres above the smoothed ground; 200 without it, or a track's own heights");
    add_positive(*fly, "--seconds", options->seconds, "How long; 20 without it, or all of a track");
    add_not_negative(*fly, "--start-s", options->start, "Seconds of a track to leave out");
    add_flight_options(*fly, *options);
    fly->add_flag("--verify", options->verify,
                  "Measure each frame's error and movement by brute force: slow");
    fly->footer(
        "Before the first frame it waits for what that frame needs; after that never.\n"
        "Example: terrane fly --dem tools/data/jacksboro.tif --seed 7 --path canyon --video --out "
        "out/flight");
    fly->callback([&context, options] { context.run = [options] { return run_fly(*options); }; });
}

}  // namespace terrane::tools
