// SPDX-License-Identifier: MIT
#include "flight/flight_options.h"

#include "track/camera_path.h"
#include "track/track.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace terrane::tools {

void add_flight_options(CLI::App& app, FlightOptions& options) {
    add_terrain_options(app, options.terrain);
    add_in_range(app, "--fps", options.fps, 0.1, 1000.0, "Frames a second of the flight");
    add_size(app, "--size", options.size, "Size of the picture, pixels");
    add_in_range(app, "--fov-deg", options.fov_deg, 1.0, 170.0, "Vertical field of view, degrees");
    add_count(app, "--budget", options.budget, 1, "Most triangles a frame");
    add_positive(app, "--max-error-px", options.max_error_px,
                 "Refinement stops below this screen error, pixels");
    add_in_range(
        app, "--morph-ratio", options.morph_ratio, 1.0, 16.0,
        "Vertices slide in while their priority grows by this factor; larger is smoother and "
        "takes more triangles, 1 pops");
    add_in_range(app, "--memory-mb", options.memory_mb, 0.001, 0x1p32,
                 "Ceiling of the memory that chunks take, MB of 2^20 bytes");
    add_count(app, "--threads", options.threads, 0,
              "Loader threads; 0 loads inside the update, so that a flight gives the same bits");
    app.add_option("--out", options.out,
                   "Folder for frames.csv, report.html, and pictures or film where asked for; what "
                   "an earlier flight left there is replaced")
        ->type_name("DIR");
    app.add_flag("--png", options.png, "Write every frame as frame_000000.png and so on");
    app.add_flag("--video", options.video, "Write flight.mp4, with ffmpeg");
    app.add_flag(
        "--realtime", options.realtime,
        "Wait for the clock at every frame, so that loaders get the time of a real flight");
    app.add_flag("--window", options.window, "Show the flight in a window, as long as it is open");
    app.add_flag("--json", options.json, "Print the summary as one JSON object, the last line");
}

CommandResult<void> check(const FlightOptions& options) {
    constexpr std::size_t kMostThreads = 256;
    if (!names_track_file(options.path) && !CameraPath::is_built_in(options.path)) {
        return usage_error(
            "--path must be straight, orbit, canyon or a track file (.csv, .gpx, .igc, "
            ".tum), got '" +
            options.path + "'");
    }
    if ((options.png || options.video) && options.out.empty()) {
        return usage_error(fmt::format("{} needs --out DIR", options.png ? "--png" : "--video"));
    }
    if (options.threads > kMostThreads) {
        return usage_error(
            fmt::format("--threads must be 0 to {}, got {}", kMostThreads, options.threads));
    }
    if (options.video && (options.size.width_px % 2 != 0 || options.size.height_px % 2 != 0)) {
        return usage_error(fmt::format("--size of a film must be even, got {}x{}",
                                       options.size.width_px, options.size.height_px));
    }
    return {};
}

CommandResult<std::size_t> count_frames(const FlightOptions& options, double seconds) {
    constexpr double kMostFrames = 1e7;
    const double count = std::floor(seconds * options.fps + 0.5);
    if (!(count <= kMostFrames)) {
        return usage_error(fmt::format("{} s at --fps {} are more than {} frames", seconds,
                                       options.fps, kMostFrames));
    }
    return static_cast<std::size_t>(std::max(1.0, count));
}

View make_view(const FlightOptions& options) {
    View view;
    view.vertical_fov = options.fov_deg * std::numbers::pi / 180.0;
    view.width_px = options.size.width_px;
    view.height_px = options.size.height_px;
    return view;
}

}  // namespace terrane::tools
