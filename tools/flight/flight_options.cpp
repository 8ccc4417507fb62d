// SPDX-License-Identifier: MIT
#include "flight/flight_options.h"

#include "program/command.h"
#include "program/options.h"
#include "program/summary.h"
#include "scene/terrain_options.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

namespace terrane::tools {

TrackReference track_reference(const Terrain& terrain) {
    TrackReference reference;
    const Result<Georeference> georeference = georeference_of(terrain);
    if (!georeference) {
        reference.why_not = georeference.error().message;
        return reference;
    }
    reference.world_from_lonlat = [made = *georeference](const Eigen::Vector3d& lonlat) {
        WorldPos p_world = made.world_from_lonlat(lonlat);
        // Recorded heights are taken as the raster's, not as ellipsoidal: most receivers give heights above the sea.
        if (made.has_ellipsoidal_heights()) p_world.z() = lonlat.z();
        return p_world;
    };
    return reference;
}

Result<Track> open_track(const std::string& path, const Terrain& terrain) {
    Result<Track> track = read_track(path, track_reference(terrain));
    if (track && !track->note.empty()) print_note(track->note);
    return track;
}

Result<CameraPath> follow_track(Track track, const HeightSource& source,
                                const CameraPathSettings& settings) {
    constexpr std::string_view kStart = "start must ";
    Result<CameraPath> path = CameraPath::create(std::move(track), source, settings);
    if (!path && path.error().message.starts_with(kStart)) {
        Error error = path.error();
        error.message = "--start-s must " + error.message.substr(kStart.size());
        return tl::unexpected(std::move(error));
    }
    return path;
}

namespace {

constexpr double kMostLightHeight = 1e6;  // above the ground, metres
constexpr double kLeastStrength = 1e-3, kMostStrength = 1e6;

bool is_drivable(const std::string& path) { return path != "spins" && path != "teleports"; }

}  // namespace

namespace {

// A value of --light. Throws a CLI::ParseError, as the flags do.
LightPlace read_light(const std::string& text) {
    const std::optional<std::vector<std::string>> items = parse_list(text);
    std::vector<double> numbers;
    for (const std::string& item : items.value_or(std::vector<std::string>())) {
        if (const std::optional<double> number = parse_number(item)) numbers.push_back(*number);
    }
    const bool is_read = items && numbers.size() == items->size() && numbers.size() >= 3 &&
                         numbers.size() <= 4 && std::abs(numbers[2]) <= kMostLightHeight;
    LightPlace light;
    if (is_read && numbers.size() == 4) light.strength = numbers[3];
    if (!is_read || !(light.strength >= kLeastStrength && light.strength <= kMostStrength)) {
        throw CLI::ValidationError(
            "--light", fmt::format("must be a place X,Y, a height within {:g} m and, if wanted, a "
                                   "strength of {:g} to {:g}, got '{}'",
                                   kMostLightHeight, kLeastStrength, kMostStrength, text));
    }
    light.place = {numbers[0], numbers[1]};
    light.height = numbers[2];
    return light;
}

}  // namespace

void add_look_options(CLI::App& app, FlightOptions& options) {
    add_size(app, "--size", options.size, "Size of the picture, pixels");
    add_in_range(app, "--fov-deg", options.fov_deg, 1.0, 170.0, "Vertical field of view, degrees");
    add_count(
        app, "--samples", options.samples, 1,
        "Samples a pixel, 1 to 16, or the next that the device has; without it 4, and 1 where "
        "there is no GPU: that is twice as fast, and steps the edges of hills")
        ->default_str("");
    add_in_range(
        app, "--shadows", options.shadows, 0.0, 1e6,
        "The sun casts shadows of ground and objects up to this distance, metres; 0: none. Without "
        "it 1000 with --look full, and 0 with --look plain");
    Look* const look = &options.look;
    add_choice(
        app, "--look", {"plain", "full"}, static_cast<std::size_t>(options.look),
        [look](std::size_t number) { *look = static_cast<Look>(number); },
        "full: sky, haze and light by scattering in the air, smooth edges, soft shadows, ground in "
        "materials with detail down to millimetres, and moving waves; plain: a sky of fixed "
        "colours, and ground in tints by height and slope");
    add_place(
        app, "--sun-deg", options.sun_deg,
        "Place of the sun, degrees: azimuth clockwise from world y, and elevation; without it "
        "and --sun-time 309,50")
        ->type_name("AZ,EL");
    app.add_option(
           "--sun-time", options.sun_time,
           "Time for the sun's place over a raster with a CRS, as 2026-06-21T14:30Z or with "
           "an offset, as +02:00")
        ->type_name("TIME");
    std::vector<LightPlace>* const lights = &options.lights;
    app.add_option_function<std::vector<std::string>>(
           "--light",
           [lights](const std::vector<std::string>& texts) {
               lights->clear();
               for (const std::string& text : texts) lights->push_back(read_light(text));
           },
           fmt::format("A point light: its place, its height above the ground, metres, and its "
                       "strength, 100 unless said: the light of white at 1 m, where the sun gives "
                       "about 2.75. At most {} times",
                       kMostPointLights))
        ->type_name("X,Y,H[,S]")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    std::optional<GroundPalette>* const ground = &options.ground;
    add_choice(
        app, "--ground", {std::begin(kPaletteNames), std::end(kPaletteNames)}, 0,
        [ground](std::size_t number) { *ground = static_cast<GroundPalette>(number); },
        "Materials of the ground, also with --look plain; unless said those of the scene, and with "
        "--look full imagery where the scene has imagery, and else alpine")
        ->default_str("");
    add_in_range(app, "--snow-line-m", options.snow_line, -1e9, 1e9,
                 "Height of the snow line, metres, with --look full or --ground");
    add_in_range(app, "--water-m", options.water_m, -1e9, 1e9,
                 "Level of water, metres, in place of the scene's; 0 for seas");
    app.add_flag("--show-proxies", options.shows_proxies,
                 "Show bodies, vehicles and characters as the shapes that collide");
}

void add_picture_options(CLI::App& app, FlightOptions& options, const std::string& what) {
    add_in_range(app, "--fps", options.fps, 0.1, 1000.0, "Frames a second of the " + what);
    add_look_options(app, options);
    app.add_option(
           "--out", options.out,
           "Folder for frames.csv, report.html, and pictures or film where asked for. What an "
           "earlier run wrote there (terrane-files.txt lists it) is replaced; no other file "
           "is removed or written over")
        ->type_name("DIR");
    app.add_flag("--png", options.png, "Write every frame as frame_000000.png and so on");
    app.add_flag("--video", options.video, "Write flight.mp4, with ffmpeg");
}

void add_frame_options(CLI::App& app, FlightOptions& options) {
    add_count(app, "--budget", options.budget, 1, "Most triangles a frame", kMostTriangles);
    add_positive(app, "--max-error-px", options.max_error_px,
                 "Refinement stops below this screen error, pixels");
    add_in_range(
        app, "--morph-ratio", options.morph_ratio, 1.0, 16.0,
        "Vertices slide in while their priority grows by this factor; larger is smoother and "
        "takes more triangles, 1 pops");
    TriangulatorChoice* const triangulator = &options.triangulator;
    add_choice(
        app, "--triangulator", {"cpu", "gpu", "auto"}, 0,
        [triangulator](std::size_t number) {
            *triangulator = static_cast<TriangulatorChoice>(number);
        },
        "What selects the triangles of pictures and the levels of scattered objects, with the same "
        "bits; auto: the GPU, unless a software rasteriser draws");
    add_in_range(app, "--memory-mb", options.memory_mb, 0.001, 0x1p32,
                 "Ceiling of the memory that chunks take, MB of 2^20 bytes");
    add_count(app, "--threads", options.threads, 0,
              "Loader threads; 0 loads inside the update, so that a flight gives the same bits",
              256);
}

void add_flight_options(CLI::App& app, FlightOptions& options,
                        std::initializer_list<const char*> scene_parts) {
    add_terrain_options(app, options.terrain, scene_parts);
    add_picture_options(app, options, "flight");
    add_frame_options(app, options);
    app.add_flag(
        "--realtime", options.realtime,
        "Wait for the clock at every frame, so that loaders get the time of a real flight");
    app.add_flag("--window", options.window, "Show the flight in a window, as long as it is open");
    app.add_flag("--json", options.json, "Print the summary as one JSON object, the last line");
    add_preset_option(app);
}

void add_paging_choice(CLI::App& app, PagingChoice& policy, double& radius) {
    PagingChoice* const chosen = &policy;
    add_choice(
        app, "--policy", paging_choice_names(), static_cast<std::size_t>(policy),
        [chosen](std::size_t number) { *chosen = static_cast<PagingChoice>(number); },
        "Which chunks are loaded first: deadline follows motion ahead, distance takes the "
        "nearest, oracle knows the path that will be flown");
    add_in_range(app, "--radius", radius, 1e-6, 1e6,
                 "With --policy distance: how many times as far as it is needed a chunk is loaded");
}

void add_storage_options(CLI::App& app, FlightOptions& options) {
    add_in_range(app, "--latency-ms", options.latency_ms, 0.0, 1e6,
                 "Storage that takes so long to begin to answer, in real time");
    add_in_range(app, "--bandwidth-mb", options.bandwidth_mb, 0.001, 1e6,
                 "Storage of so many MB of 10^6 bytes a second, shared by the loader threads");
}

StorageSpeed storage_speed(double latency_ms, double bandwidth_mb) {
    return {.latency = 1e-3 * latency_ms, .bandwidth = 1e6 * bandwidth_mb};
}

StorageSpeed storage_speed(const FlightOptions& options) {
    return storage_speed(
        given(options.latency_ms).value_or(0.0),
        given(options.bandwidth_mb).value_or(std::numeric_limits<double>::infinity()));
}

CommandResult<void> check_path(const std::string& name) {
    if (names_track_file(name) || CameraPath::is_built_in(name)) return {};
    return usage_error("--path must be " + CameraPath::built_in_list() +
                       " or a track file (.csv, .gpx, .igc, .tum), got '" + name + "'" +
                       did_you_mean(name, CameraPath::built_in_names()));
}

CameraPathSettings planned_in(const Terrain& terrain, CameraPathSettings settings) {
    settings.region = work_region(terrain);
    settings.start_world = terrain.start;
    return settings;
}

Result<CameraPath> open_path(const std::string& name, const Terrain& terrain,
                             const CameraPathSettings& settings) {
    if (!names_track_file(name)) {
        return CameraPath::create(name, *terrain.source, planned_in(terrain, settings));
    }
    TERRANE_TRY(Track track, open_track(name, terrain));
    return follow_track(std::move(track), *terrain.source, settings);
}

namespace {

// Takes a part of a text off its front if it is like a pattern, in which 0 stands for a digit; appends its numbers.
bool take_like(std::string_view pattern, std::string_view& text, std::vector<int>& numbers) {
    if (text.size() < pattern.size()) return false;
    for (std::size_t i = 0; i < pattern.size(); ++i) {
        const bool is_digit = text[i] >= '0' && text[i] <= '9';
        if (pattern[i] == '0' ? !is_digit : text[i] != pattern[i]) return false;
        if (pattern[i] != '0') continue;
        if (i == 0 || pattern[i - 1] != '0') numbers.push_back(0);
        numbers.back() = 10 * numbers.back() + (text[i] - '0');
    }
    text.remove_prefix(pattern.size());
    return true;
}

}  // namespace

std::optional<double> parse_time(std::string_view text) {
    std::vector<int> at, seconds, offset;
    if (!take_like("0000-00-00T00:00", text, at)) return std::nullopt;
    if (!take_like(":00", text, seconds)) seconds = {0};
    const int sign = text.starts_with('-') ? -1 : 1;
    if (text == "Z") {
        offset = {0, 0};
    } else if (!take_like(sign < 0 ? "-00:00" : "+00:00", text, offset) || !text.empty()) {
        return std::nullopt;
    }
    const std::chrono::year_month_day date{std::chrono::year(at[0]),
                                           std::chrono::month(static_cast<unsigned>(at[1])),
                                           std::chrono::day(static_cast<unsigned>(at[2]))};
    if (at[0] < 1900 || at[0] > 2100 || !date.ok() || at[3] > 23 || at[4] > 59 || seconds[0] > 59 ||
        offset[0] > 23 || offset[1] > 59) {
        return std::nullopt;
    }
    const double days = static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count());
    const int minutes = 60 * (at[3] - sign * offset[0]) + at[4] - sign * offset[1];
    return 86400.0 * days + 60.0 * minutes + seconds[0];
}

CommandResult<void> check_pictures(const FlightOptions& options) {
    constexpr std::size_t kMostSamples = 16;
    if (options.samples > kMostSamples) {
        return usage_error(
            fmt::format("--samples must be 1 to {}, got {}", kMostSamples, options.samples));
    }
    if (options.samples > 0 && !options.has_pictures()) {
        return usage_error("--samples is for pictures: it needs --png or --video");
    }
    if (options.shadows > 0.0 && !options.has_pictures()) {
        return usage_error("--shadows is for pictures: it needs --png or --video");
    }
    const std::array<std::pair<bool, const char*>, 9> of_pictures{
        {{options.look != Look::plain, "--look"},
         {options.triangulator != TriangulatorChoice::cpu, "--triangulator"},
         {options.sun_deg.has_value(), "--sun-deg"},
         {!options.sun_time.empty(), "--sun-time"},
         {!options.lights.empty(), "--light"},
         {options.ground.has_value(), "--ground"},
         {!std::isnan(options.snow_line), "--snow-line-m"},
         {!std::isnan(options.water_m), "--water-m"},
         {options.shows_proxies, "--show-proxies"}}};
    for (const auto& [is_given, flag] : of_pictures) {
        if (is_given && !options.has_pictures())
            return usage_error(fmt::format("{} is for pictures: it needs --png or --video", flag));
    }
    if (options.lights.size() > kMostPointLights) {
        return usage_error(fmt::format("--light can be given {} times, got {}", kMostPointLights,
                                       options.lights.size()));
    }
    if (options.sun_deg && !options.sun_time.empty())
        return usage_error("--sun-deg and --sun-time exclude each other");
    if (options.sun_deg &&
        !(std::abs(options.sun_deg->x()) <= 360.0 && std::abs(options.sun_deg->y()) <= 90.0)) {
        return usage_error(
            fmt::format("--sun-deg must be an azimuth within 360 and an elevation within 90 "
                        "degrees, got {:.10g},{:.10g}",
                        options.sun_deg->x(), options.sun_deg->y()));
    }
    if (!options.sun_time.empty() && !parse_time(options.sun_time)) {
        return usage_error(fmt::format(
            "--sun-time must be a time of the years 1900 to 2100, as 2026-06-21T14:30Z, got '{}'",
            options.sun_time));
    }
    if (!std::isnan(options.snow_line) && !options.has_materials())
        return usage_error("--snow-line-m needs --look full or --ground");
    if ((options.png || options.video) && options.out.empty()) {
        return usage_error(fmt::format("{} needs --out DIR", options.png ? "--png" : "--video"));
    }
    if (options.video && (options.size.width_px % 2 != 0 || options.size.height_px % 2 != 0)) {
        return usage_error(fmt::format("--size of a film must be even, got {}x{}",
                                       options.size.width_px, options.size.height_px));
    }
    return {};
}

CommandResult<void> check(const FlightOptions& options) {
    TERRANE_TRY(check_path(options.path));
    TERRANE_TRY(check_pictures(options));
    if (!names_track_file(options.path) && !std::isnan(options.seconds)) {
        // checked before the path is created, because the path's memory grows with its duration
        TERRANE_TRY(count_frames(options.fps, options.seconds));
    }
    return {};
}

CommandResult<void> check_drivable(const std::string& path) {
    if (is_drivable(path)) return {};
    return usage_error(
        fmt::format("--path {} {}, and on the ground that is not possible: give {} or a track "
                    "file",
                    path, path == "spins" ? "turns a camera about" : "jumps", drivable_paths()));
}

std::string drivable_paths() {
    std::vector<std::string> names = CameraPath::built_in_names();
    std::erase_if(names, [](const std::string& name) { return !is_drivable(name); });
    return fmt::format("{}", fmt::join(names, ", "));
}

CommandResult<void> check_limits(const FlightOptions& options, const Terrain& terrain) {
    TERRANE_TRY(check_budget(terrain, options.budget));
    return check_memory(terrain, options.memory_mb);
}

CommandResult<std::size_t> count_frames(double fps, double seconds) {
    constexpr double kMostFrames = 1e7;
    const double count = std::floor(seconds * fps + 0.5);
    if (!(count <= kMostFrames)) {
        return usage_error(fmt::format("{:.6g} s at --fps {:.6g} are more than {} frames", seconds,
                                       fps, static_cast<std::size_t>(kMostFrames)));
    }
    return static_cast<std::size_t>(std::max(1.0, count));
}

FrameMakerSettings frame_maker_settings(const FlightOptions& options) {
    FrameMakerSettings settings;
    settings.pager.memory_bytes = options.memory_bytes();
    settings.pager.worker_count = static_cast<int>(options.threads);
    settings.pager.policy = pager_policy(options.policy);
    settings.pager.distance_radius = options.radius;
    settings.triangulator.triangle_budget = options.budget;
    settings.triangulator.max_error_px = options.max_error_px;
    settings.triangulator.morph_ratio = options.morph_ratio;
    settings.verify = options.verify;
    return settings;
}

View make_view(const ImageSize& size, double fov_deg) {
    View view;
    view.vertical_fov = fov_deg * std::numbers::pi / 180.0;
    view.width_px = size.width_px;
    view.height_px = size.height_px;
    return view;
}

View view_at(View view, const CameraPose& pose) {
    view.eye_world = pose.eye_world;
    view.forward = pose.forward;
    view.up = pose.up;
    return view;
}

}  // namespace terrane::tools
