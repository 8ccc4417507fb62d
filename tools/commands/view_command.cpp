// SPDX-License-Identifier: MIT
#include "commands/run_files.h"
#include "flight/flight_options.h"
#include "frames/paging_storage.h"
#include "program/command.h"
#include "program/options.h"
#include "program/summary.h"
#include "scene/ground_editor.h"
#include "view/viewer.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

constexpr std::size_t kShareOfDigs = 4;  // the cache of digs has this part of the chunks' ceiling

struct ViewOptions : FlightOptions {
    std::optional<WorldPos> eye_m = {};
    std::optional<WorldVec2> aim_deg = {};
    double start = 0.0;  // seconds of a track that are left out
    Being being = Being::camera;
    VehicleKind vehicle = VehicleKind::truck;
    bool no_vsync = false;
    bool full_screen = false;
    bool no_help = false;
    bool no_dig = false;
    double close_after = std::numeric_limits<double>::quiet_NaN();
    std::string state_log, record, replay;  // files; "" for none
};

// A word of a shell's command line.
std::string quoted(const std::string& word) {
    constexpr std::string_view kPlain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./,:+=";
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
    std::string text = "'";
    for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

// The command line of this view without the camera's place, the window's size, the lights, and the files that it
// writes.
std::string given_flags(const CLI::App& command) {
    const std::set<std::string> left_out{"--eye-m",     "--aim-deg",       "--size", "--light",
                                         "--state-log", "--close-after-s", "--json", "--out",
                                         "--help",      "--record"};
    std::string text = "terrane view";
    for (const CLI::Option* option : command.get_options()) {
        const std::string name = option->get_name();
        if (option->count() == 0 || left_out.contains(name)) continue;
        text += " " + name;
        if (option->get_expected_min() == 0) continue;
        for (const std::string& value : option->results()) text += " " + quoted(value);
    }
    return text;
}

CommandResult<void> check(const ViewOptions& options) {
    TERRANE_TRY(check_pictures(options));
    if (!options.path.empty()) TERRANE_TRY(check_path(options.path));
    if (options.aim_deg &&
        !(std::abs(options.aim_deg->x()) <= 360.0 && std::abs(options.aim_deg->y()) <= 90.0)) {
        return usage_error(fmt::format(
            "--aim-deg must be an azimuth within 360 and an elevation within 90 degrees, got "
            "{:.10g},{:.10g}",
            options.aim_deg->x(), options.aim_deg->y()));
    }
    if (options.size.width_px > Window::kMostSide || options.size.height_px > Window::kMostSide) {
        return usage_error(fmt::format("--size of a window must be at most {} a side, got {}x{}",
                                       Window::kMostSide, options.size.width_px,
                                       options.size.height_px));
    }
    return {};
}

CommandResult<void> run_view(const ViewOptions& options, const CLI::App& command) {
    TERRANE_TRY(check(options));
    TERRANE_TRY(refuse_idle_flags(
        command,
        {{{"--speed", "--altitude", "--seconds"}, !options.path.empty(), "goes with --path"},
         {{"--start-s"}, names_track_file(options.path), "goes with a track file as --path"},
         {{"--path", "--record"}, options.replay.empty(), "does not go with --replay"},
         {terrain_detail_flags(command), options.replay.empty() || chooses_terrain(command),
          "is in the record that --replay reads, unless --dem, --seed or --scene names its "
          "terrain"},
         {{"--vehicle"}, options.being == Being::driver, "goes with --be driver"},
         {{"--aim-deg"}, options.eye_m.has_value(), "goes with --eye-m"}}));
    ViewerSettings settings;
    TerrainOptions wanted = options.terrain;
    if (!options.replay.empty()) {
        TERRANE_TRY(RunRecord record, RunRecord::open(options.replay));
        settings.record.emplace(std::move(record));
        if (!chooses_terrain(command)) {
            TERRANE_TRY(wanted, terrain_options_of(*settings.record, options.terrain));
        }
        wanted.dig_spacing = dig_spacing_of(*settings.record);
    }
    TERRANE_TRY(Terrain terrain, open_terrain(wanted));
    if (settings.record) {
        TERRANE_TRY(settings.record->check_terrain(terrain));
        settings.recorded = terrain;
    }
    TERRANE_TRY(check_limits(options, terrain));
    settings.storage = std::make_shared<SlowHeights>(heightfield_of(terrain));
    TERRANE_TRY(terrain.source, with_volumes(terrain, settings.storage));
    terrain.heightfield = settings.storage;
    std::unique_ptr<GroundEditor> brush;
    const std::size_t dig_bytes = options.memory_bytes() / kShareOfDigs;
    if (settings.record) {
        settings.why_no_brush = "the ground of a record cannot be dug";
        if (!settings.record->ground().is_empty()) {
            TERRANE_TRY(brush, GroundEditor::create(terrain, 1, dig_bytes));
        }
    } else if (options.no_dig) {
        settings.why_no_brush = "--no-dig was given";
    } else {
        CommandResult<std::unique_ptr<GroundEditor>> made =
            GroundEditor::create(terrain, 1, dig_bytes);
        // a view without digging is still a view
        if (made) {
            brush = *std::move(made);
        } else {
            settings.why_no_brush = made.error().message;
        }
    }
    if (!options.path.empty()) {
        TERRANE_TRY(settings.path, open_path(options.path, terrain,
                                             {.speed = given(options.speed),
                                              .altitude = given(options.altitude),
                                              .start = options.start,
                                              .seconds = given(options.seconds)}));
    }
    if (options.eye_m) {
        const WorldVec2 aim = options.aim_deg.value_or(WorldVec2(0.0, 0.0));
        settings.place = CameraPlace{*options.eye_m, aim.x(), aim.y()};
    }
    settings.being = options.being;
    settings.vehicle = options.vehicle;
    settings.waits_for_display = !options.no_vsync;
    settings.is_full_screen = options.full_screen;
    settings.shows_help = !options.no_help;
    settings.seconds = given(options.close_after).value_or(std::numeric_limits<double>::infinity());
    if (!options.out.empty()) {
        std::error_code trouble;
        std::filesystem::create_directories(options.out, trouble);
        if (trouble)
            return failure(fmt::format("cannot write '{}': {}", options.out, trouble.message()));
        settings.folder = options.out;
    }
    settings.state_log = options.state_log;
    settings.command_of = [flags = given_flags(command), ground = heightfield_of(terrain)](
                              const CameraPlace& place, const ImageSize& size,
                              std::span<const PlacedLight> lights) {
        const WorldPos& eye = place.eye_world;
        std::string text =
            fmt::format("{} --size {}x{} --eye-m {:.3f},{:.3f},{:.3f} --aim-deg {:.3f},{:.3f}",
                        flags, size.width_px, size.height_px, eye.x(), eye.y(), eye.z(),
                        place.azimuth_deg, place.elevation_deg);
        for (const PlacedLight& light : lights) {
            const LightPlace at = light_place(light, *ground);
            text += fmt::format(" --light {:.3f},{:.3f},{:.3f},{:.6g}", at.place.x(), at.place.y(),
                                at.height, at.strength);
        }
        return text;
    };
    TERRANE_TRY(std::optional<RunRecorder> recorder, begin_record(options.record, command, terrain,
                                                                  {.kind = RunKind::view,
                                                                   .fps = 1.0 / LiveWorld::kStep,
                                                                   .dt = LiveWorld::kStep}));
    if (recorder) settings.recorder = &*recorder;
    TERRANE_TRY(const std::unique_ptr<Viewer> viewer,
                Viewer::create(options, terrain, std::move(brush), std::move(settings)));
    const CommandResult<ViewTotals> shown = viewer->run();
    nlohmann::ordered_json summary;
    TERRANE_TRY(
        end_record(recorder, shown ? std::optional(shown->state_hash) : std::nullopt, summary));
    TERRANE_TRY(const ViewTotals totals, shown);
    summary["frames"] = totals.frames;
    summary["draw_ms_median"] = totals.draw_ms_median;
    summary["overlay_ms_median"] = totals.overlay_ms_median;
    summary["steps"] = totals.bodies.steps;
    summary["fell_through"] = totals.bodies.fell_through;
    summary["placed_deep"] = totals.bodies.placed_deep;
    summary["max_depth_m"] = totals.bodies.max_depth_m;
    summary["below_ground"] = totals.below_ground;
    summary["renderer"] = viewer->renderer_name();
    summary["terrain"] = terrain.name;
    print_summary(summary, options.json);
    return {};
}

}  // namespace

void add_view_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<ViewOptions>();
    options->window = true;
    CLI::App* view = app.add_subcommand(
        "view",
        "Opens a window: fly, walk, drive, throw, dig, pick, and play a path; F1 names the "
        "keys");
    add_terrain_options(*view, options->terrain,
                        {"bodies", "surface", "volumes", "objects", "nodes", "imagery", "materials",
                         "water", "water_m"});
    view->add_option("--path", options->path,
                     "A path to play: " + CameraPath::built_in_list() +
                         ", or a track: .csv, .gpx, .igc, .tum; without it the camera is free")
        ->type_name("PATH");
    view->add_option("--replay", options->replay,
                     "A run to play that --record of view, fly, drive, walk or drop wrote")
        ->type_name("FILE");
    add_record_option(*view, options->record);
    add_positive(*view, "--speed", options->speed, "Of the path, as for fly");
    add_positive(*view, "--altitude", options->altitude, "Of the path, as for fly");
    add_positive(*view, "--seconds", options->seconds, "Length of the path, as for fly");
    add_not_negative(*view, "--start-s", options->start, "Seconds of a track to leave out");
    add_point(*view, "--eye-m", options->eye_m, "Where the camera starts, metres")
        ->type_name("X,Y,Z");
    add_place(*view, "--aim-deg", options->aim_deg,
              "Where it looks, degrees: azimuth clockwise from world y, and elevation")
        ->type_name("AZ,EL");
    Being* const being = &options->being;
    add_choice(
        *view, "--be", {"camera", "walker", "driver"}, 0,
        [being](std::size_t number) { *being = static_cast<Being>(number); },
        "What one is at the start; Tab changes it");
    VehicleKind* const vehicle = &options->vehicle;
    add_choice(
        *view, "--vehicle", vehicle_names(), 0,
        [vehicle](std::size_t number) { *vehicle = static_cast<VehicleKind>(number); },
        "Of the driver");
    add_look_options(*view, *options);
    add_frame_options(*view, *options);
    add_storage_options(*view, *options);
    view->add_flag("--no-dig", options->no_dig,
                   "The ground cannot be dug: saves some memory and time");
    view->add_flag("--no-vsync", options->no_vsync, "Frames do not wait for the display");
    view->add_flag("--full-screen", options->full_screen, "Cover the display; F11 changes it");
    view->add_flag("--no-help", options->no_help, "Start without panels; F1 and F2 show them");
    view->add_option("--out", options->out,
                     "Folder of pictures (F12) and films (R); without it the current one. No "
                     "file is written over")
        ->type_name("DIR");
    view->add_option("--state-log", options->state_log,
                     "Write the state of every frame, a line of JSON each. A file of that name "
                     "is replaced")
        ->type_name("FILE");
    add_positive(*view, "--close-after-s", options->close_after,
                 "Close the window after so many seconds, for scripts");
    view->add_flag("--json", options->json, "Print the summary as one JSON object");
    add_preset_option(*view);
    view->footer(
        "Bodies, walkers and vehicles are simulated as in drop, walk and drive; loaders run in\n"
        "real time.\n"
        "Example: terrane view --dem tools/data/jacksboro.tif --seed 7 --detail-m 1");
    view->callback([&context, options, view] {
        context.run = [options, view] { return run_view(*options, *view); };
    });
}

}  // namespace terrane::tools
