// SPDX-License-Identifier: MIT
#include "commands/journey.h"
#include "commands/run_files.h"
#include "commands/travellers.h"
#include "program/command.h"
#include "program/summary.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kUsualSpeed = 12.0;                       // m/s
constexpr double kLeastSpeed = 0.1, kGreatestSpeed = 1e3;  // m/s, range of PathDriver
constexpr double kTruckHalfLength = 2.3;                   // metres; the camera's defaults fit it

/// Flags of the camera that follows a vehicle or character.
struct CameraOptions {
    std::optional<WorldVec2> place_m = {};  ///< behind the target and above its centre
    double bearing_deg = 0.0;

    ChaseCameraSettings settings(ChaseCameraSettings usual) const {
        if (place_m) {
            usual.behind = place_m->x();
            usual.above = place_m->y();
            usual.target_above = std::min(usual.target_above, usual.above);
        }
        usual.bearing = bearing_deg * std::numbers::pi / 180.0;
        return usual;
    }
};

CommandResult<void> check(const CameraOptions& camera) {
    constexpr double kNearest = 0.5, kFarthest = 1e4;  // metres
    const std::optional<WorldVec2>& place = camera.place_m;
    if (!place ||
        (place->x() >= kNearest && place->x() <= kFarthest && std::abs(place->y()) <= kFarthest))
        return {};
    return usage_error(fmt::format(
        "--camera-m must be 0.5 to 1e4 m behind and within 1e4 m above, got {:.10g},{:.10g}",
        place->x(), place->y()));
}

void add_camera_options(CLI::App& app, CameraOptions& camera) {
    add_place(app, "--camera-m", camera.place_m,
              "Place of the camera: metres behind the middle of what it follows, and above it")
        ->type_name("BEHIND,ABOVE");
    add_in_range(app, "--camera-deg", camera.bearing_deg, -360.0, 360.0,
                 "Bearing of the camera, degrees clockwise from behind: 90 is on the left side");
}

struct DriveOptions : FlightOptions {
    CameraOptions camera = {};
    VehicleKind vehicle = VehicleKind::truck;
    std::size_t crates = 0;
    OnRoll on_roll = OnRoll::stop;
    bool ruts = false;
    std::string record;  ///< a file; "" for none
};

CommandResult<void> run_drive(const DriveOptions& options, const CLI::App& command) {
    TERRANE_TRY(check(options));
    TERRANE_TRY(check(options.camera));
    TERRANE_TRY(check_drivable(options.path));
    TerrainOptions wanted = options.terrain;
    if (options.ruts) wanted.dig_spacing = kRutSpacing;
    TERRANE_TRY(Terrain terrain, open_terrain(wanted));
    std::unique_ptr<WheelRuts> ruts;
    if (options.ruts) {
        TERRANE_TRY(auto made, WheelRuts::create(terrain, options.threads > 0 ? 1 : 0));
        ruts = std::move(made);
    }
    TERRANE_TRY(check_limits(options, terrain));
    const VehicleSettings settings = make_vehicle(options.vehicle);
    TERRANE_TRY(const DrivePlan plan,
                make_drive_plan(options, terrain, kUsualSpeed, ground_limits(settings)));
    TERRANE_TRY(PathDriver driver,
                PathDriver::create(plan.path.points(), {.cruise_speed = plan.speed}));
    const std::vector<Eigen::Vector2d>& points = plan.path.points();
    const std::size_t ahead = std::min<std::size_t>(points.size() - 1, 4);
    VehicleTraveller vehicle(settings, std::move(driver), options.on_roll, *terrain.source,
                             points.front(), points[ahead] - points.front());
    if (ruts) vehicle.set_ruts(*ruts);
    ChaseCameraSettings camera;
    camera.behind += 2.0 * (settings.chassis_half_extents.x() - kTruckHalfLength);
    TERRANE_TRY(Journey drive, Journey::create(options, terrain, plan, options.crates,
                                               options.camera.settings(camera), vehicle));
    TERRANE_TRY(FrameMaker maker,
                FrameMaker::create(terrain.source, frame_maker_settings(options)));
    TERRANE_TRY(FlightOutput output,
                FlightOutput::create(options, terrain, Journey::columns(vehicle)));
    TERRANE_TRY(BodyNodes nodes, output.add_bodies(terrain, maker));

    RunSettings run = drive.run_settings(RunKind::drive);
    run.dig_spacing = wanted.dig_spacing.value_or(0.0);
    TERRANE_TRY(std::optional<RunRecorder> recorder,
                begin_record(options.record, command, terrain, std::move(run)));
    TERRANE_TRY(drive.play(maker, output, nodes, recorder ? &*recorder : nullptr));
    nlohmann::ordered_json summary;
    summary["vehicle"] = vehicle_names()[static_cast<std::size_t>(options.vehicle)];
    summary.update(summarize(drive.totals()));
    summary["rolled_over"] = vehicle.has_rolled_over();
    summary["rights"] = vehicle.rights();
    summary.update(summarize(vehicle.progress()));
    if (ruts) summary["digs"] = ruts->digs();
    summary.update(summarize(output.frames(), options.memory_bytes(), options.fps));
    summary["seconds"] = static_cast<double>(output.frames().size()) / options.fps;
    summary["path"] = options.path;
    summary["terrain"] = terrain.name;
    describe_http(terrain, summary);
    TERRANE_TRY(output.finish("Drive over " + terrain.name, summary));
    TERRANE_TRY(end_record(recorder, drive.state_hash(), summary));
    print_summary(summary, options.json);
    return output.verdict(plan.frame_count);
}

void add_vehicle_options(CLI::App& app, DriveOptions& options) {
    VehicleKind* const vehicle = &options.vehicle;
    add_choice(
        app, "--vehicle", vehicle_names(), 0,
        [vehicle](std::size_t number) { *vehicle = static_cast<VehicleKind>(number); },
        "A truck on four wheels, a tracked vehicle that turns by its belts, or a six-wheeler that "
        "steers with four of its wheels");
    OnRoll* const on_roll = &options.on_roll;
    add_choice(
        app, "--on-roll", {"stop", "right"}, 0,
        [on_roll](std::size_t number) { *on_roll = static_cast<OnRoll>(number); },
        "When the vehicle has lain on its side or roof for a second: stop ends the drive, right "
        "puts it on its wheels");
    app.add_flag(
        "--ruts", options.ruts,
        "Wheels dig ruts of 15 cm into open ground, which stay; the finest spacing is 0.25 m "
        "then, unless --detail-m says otherwise");
}

}  // namespace

void add_drive_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<DriveOptions>();
    options->path = "straight";
    CLI::App* drive = app.add_subcommand(
        "drive", "Drives a vehicle along a path on the contact surface, with a camera behind it");
    drive
        ->add_option(
            "--path", options->path,
            drivable_paths() + ", or a track: .csv, .gpx, .igc, .tum; its heights are not used")
        ->type_name("PATH")
        ->capture_default_str();
    add_in_range(*drive, "--speed", options->speed, kLeastSpeed, kGreatestSpeed,
                 "Metres a second to keep where the path is straight enough; 12 without it, or the "
                 "mean of a track");
    add_positive(*drive, "--seconds", options->seconds,
                 "How long at most; 20 without it, or as long as the track");
    add_vehicle_options(*drive, *options);
    add_crates_option(*drive, options->crates);
    add_camera_options(*drive, options->camera);
    add_record_option(*drive, options->record);
    add_flight_options(*drive, *options,
                       {"bodies", "surface", "volumes", "objects", "nodes", "imagery", "materials",
                        "water", "water_m"});
    drive->footer(
        "Waits for ground before the first frame only: a vehicle whose ground is late is parked\n"
        "until it is there, and that is counted. The bodies of a --scene are in its way. A path\n"
        "that starts or leads where there is no ground is refused.\n"
        "Example: terrane drive --dem tools/data/jacksboro.tif --seed 7 --vehicle six-wheeler\n"
        "         --crates 40 --video --out out/drive");
    drive->callback([&context, options, drive] {
        context.run = [options, drive] { return run_drive(*options, *drive); };
    });
}

namespace {

constexpr double kUsualWalk = 1.5;                         // m/s
constexpr double kWalkedSlope = 0.8;                       // of 1.18 that it can climb
constexpr double kLeastWalk = 0.1, kGreatestWalk = 100.0;  // m/s

struct WalkOptions : FlightOptions {
    CameraOptions camera = {};
    std::size_t crates = 0;
    std::string record;  ///< a file; "" for none
};

CommandResult<void> run_walk(const WalkOptions& options, const CLI::App& command) {
    TERRANE_TRY(check(options));
    TERRANE_TRY(check(options.camera));
    TERRANE_TRY(check_drivable(options.path));
    TERRANE_TRY(const Terrain terrain, open_terrain(options.terrain));
    TERRANE_TRY(check_limits(options, terrain));
    TERRANE_TRY(const DrivePlan plan,
                make_drive_plan(options, terrain, kUsualWalk, {.max_slope = kWalkedSlope}));
    CharacterTraveller character({}, plan.path, plan.speed, *terrain.source);
    TERRANE_TRY(
        Journey walk,
        Journey::create(options, terrain, plan, options.crates,
                        options.camera.settings({.behind = 6.0, .above = 1.8, .target_above = 0.5}),
                        character));
    TERRANE_TRY(FrameMaker maker,
                FrameMaker::create(terrain.source, frame_maker_settings(options)));
    TERRANE_TRY(FlightOutput output,
                FlightOutput::create(options, terrain, Journey::columns(character)));
    TERRANE_TRY(BodyNodes nodes, output.add_bodies(terrain, maker));

    TERRANE_TRY(std::optional<RunRecorder> recorder,
                begin_record(options.record, command, terrain, walk.run_settings(RunKind::walk)));
    TERRANE_TRY(walk.play(maker, output, nodes, recorder ? &*recorder : nullptr));
    nlohmann::ordered_json summary = summarize(walk.totals());
    summary.update(summarize(character.progress()));
    summary.update(summarize(output.frames(), options.memory_bytes(), options.fps));
    summary["seconds"] = static_cast<double>(output.frames().size()) / options.fps;
    summary["path"] = options.path;
    summary["terrain"] = terrain.name;
    describe_http(terrain, summary);
    TERRANE_TRY(output.finish("Walk over " + terrain.name, summary));
    TERRANE_TRY(end_record(recorder, walk.state_hash(), summary));
    print_summary(summary, options.json);
    return output.verdict(plan.frame_count);
}

}  // namespace

void add_walk_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<WalkOptions>();
    options->path = "straight";
    CLI::App* walk = app.add_subcommand(
        "walk", "Walks a character along a path on the contact surface, with a camera behind it");
    walk->add_option(
            "--path", options->path,
            drivable_paths() + ", or a track: .csv, .gpx, .igc, .tum; its heights are not used")
        ->type_name("PATH")
        ->capture_default_str();
    add_in_range(*walk, "--speed", options->speed, kLeastWalk, kGreatestWalk,
                 "Metres a second; 1.5 without it, or the mean of a track");
    add_positive(*walk, "--seconds", options->seconds,
                 "How long at most; 20 without it, or as long as the track");
    add_crates_option(*walk, options->crates);
    add_camera_options(*walk, options->camera);
    add_record_option(*walk, options->record);
    add_flight_options(*walk, *options,
                       {"bodies", "surface", "volumes", "objects", "nodes", "imagery", "materials",
                        "water", "water_m"});
    walk->footer(
        "The character pushes crates that it can move, climbs steps, and walks around what stops\n"
        "it. The bodies of a --scene are in its way too. A path that starts or leads where there\n"
        "is no ground is refused.\n"
        "Example: terrane walk --dem tools/data/jacksboro.tif --seed 7 --crates 40 --video --out "
        "out/walk");
    walk->callback([&context, options, walk] {
        context.run = [options, walk] { return run_walk(*options, *walk); };
    });
}

}  // namespace terrane::tools
