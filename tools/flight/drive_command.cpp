// SPDX-License-Identifier: MIT
#include "command.h"
#include "flight/flight_options.h"
#include "flight/flight_output.h"
#include "flight/frame_maker.h"
#include "output/progress.h"
#include "output/summary.h"
#include "track/camera_path.h"
#include "track/chase_camera.h"
#include "track/track.h"

#include <terrane/collision/truck.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <thread>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kLongestStep = 1.0 / 60.0;  // seconds
constexpr double kDefaultSpeed = 12.0;       // metres a second
const std::vector<std::string> kColumns{"speed_m_s", "depth_m", "wheels_on_ground"};

/// What steps added up to.
struct DriveTotals {
    double distance_m = 0.0;
    double max_depth_m = 0.0;
    std::uint64_t fell_through = 0;  // steps that ended deeper than the tolerance
    std::uint64_t steps = 0;
    std::uint64_t airborne = 0;  // of them without a wheel on the ground
    std::uint64_t parked = 0;    // of them that waited for ground
    std::uint64_t left_world = 0;
    double lived_time = 0.0, lost_time = 0.0;
};

// The way to drive: a camera's path, seen from above.
Result<std::vector<Eigen::Vector2d>> find_way(const FlightOptions& options, const Terrain& terrain,
                                              double& duration_out, double& speed_out) {
    CameraPathSettings settings;
    if (!std::isnan(options.speed)) settings.speed = options.speed;
    if (!std::isnan(options.seconds)) settings.seconds = options.seconds;
    Result<CameraPath> path = fail(ErrorCode::invalid_argument, "");
    if (names_track_file(options.path)) {
        Result<Track> track = read_track(options.path, terrain.dem ? &*terrain.dem : nullptr);
        if (!track) return tl::unexpected(track.error());
        if (!track->has_times && !settings.speed) settings.speed = kDefaultSpeed;
        path = CameraPath::create(std::move(*track), *terrain.source, settings);
    } else {
        if (!settings.speed) settings.speed = kDefaultSpeed;
        path = CameraPath::create(options.path, *terrain.source, settings);
    }
    if (!path) return tl::unexpected(path.error());
    if (!path->jumps().empty()) {
        return fail(ErrorCode::invalid_argument,
                    fmt::format("a truck cannot jump as the path '{}' does", options.path));
    }
    constexpr double kSpacing = 1.0;  // metres, at least
    constexpr double kTimeStep = 0.05;
    duration_out = path->duration();
    std::vector<Eigen::Vector2d> points;
    double length = 0.0;
    for (double time = 0.0; time <= duration_out; time += kTimeStep) {
        const Eigen::Vector2d p = path->at(time).eye_world.head<2>();
        const double way = points.empty() ? 0.0 : (p - points.back()).norm();
        if (!points.empty() && way < kSpacing) continue;
        length += way;
        points.push_back(p);
    }
    if (points.size() < 2) {
        return fail(ErrorCode::invalid_argument, fmt::format("the path '{}' is shorter than {} m",
                                                             options.path, 2.0 * kSpacing));
    }
    speed_out = settings.speed.value_or(std::max(1.0, length / duration_out));
    return points;
}

// On the ground at the way's beginning, along it and along the slope, with the springs hanging free.
Pose start_pose(const HeightSource& source, const std::vector<Eigen::Vector2d>& way,
                const TruckSettings& truck) {
    const Eigen::Vector2d start = way.front();
    const std::size_t ahead = std::min<std::size_t>(way.size() - 1, 4);
    const Eigen::Vector2d along = (way[ahead] - start).normalized();
    const Eigen::Vector2d left(-along.y(), along.x());
    const auto ground = [&](double x, double y) {
        const Eigen::Vector2d p = start + x * along + y * left;
        return source.height(p.x(), p.y());
    };
    const double front = 0.5 * truck.wheelbase, side = 0.5 * truck.track;
    const double climb = (ground(front, 0.0) - ground(-front, 0.0)) / truck.wheelbase;
    const double tilt = (ground(0.0, side) - ground(0.0, -side)) / truck.track;
    Pose pose;
    const Eigen::Vector3d forward = Eigen::Vector3d(along.x(), along.y(), climb).normalized();
    const Eigen::Vector3d left_raw(left.x(), left.y(), tilt);
    const Eigen::Vector3d left_world = (left_raw - left_raw.dot(forward) * forward).normalized();
    pose.rotation.col(0) = forward;
    pose.rotation.col(1) = left_world;
    pose.rotation.col(2) =
        Eigen::Vector3d(forward.y() * left_world.z() - forward.z() * left_world.y(),
                        forward.z() * left_world.x() - forward.x() * left_world.z(),
                        forward.x() * left_world.y() - forward.y() * left_world.x());

    // clear of the highest ground below it, against the plane that it stands along
    const Eigen::Vector3d& half = truck.chassis_half_extents;
    double lift = 0.0;
    const double centre = ground(0.0, 0.0);
    constexpr int kProbes = 8;
    for (int i = -kProbes; i <= kProbes; ++i) {
        for (int j = -kProbes; j <= kProbes; ++j) {
            const double x = half.x() * i / kProbes, y = half.y() * j / kProbes;
            lift = std::max(lift, ground(x, y) - (centre + climb * x + tilt * y));
        }
    }
    pose.translation =
        WorldPos(start.x(), start.y(), centre + lift) +
        pose.rotation.col(2) * (half.z() + truck.wheel_radius + 0.5 * truck.suspension_travel);
    return pose;
}

// A flat bed and a cab, both inside the chassis that collides, and the wheels.
std::array<DrawnObject, 6> draw_truck(const Truck& truck) {
    const Eigen::Vector3d& half = truck.settings().chassis_half_extents;
    const Pose& pose = truck.chassis().pose;
    const auto box = [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& extents,
                         const Colour& colour) {
        return DrawnObject{DrawnObject::Form::box, {pose.rotation, pose * centre}, extents, colour};
    };
    const auto wheel = [&](std::size_t i) {
        const double radius = truck.settings().wheel_radius;
        return DrawnObject{DrawnObject::Form::ball,
                           {pose.rotation, truck.wheels()[i].centre_world},
                           Eigen::Vector3d::Constant(radius),
                           {0.15f, 0.15f, 0.15f}};
    };
    return {box({0.0, 0.0, -0.5 * half.z()}, {half.x(), half.y(), 0.5 * half.z()},
                {0.78f, 0.22f, 0.12f}),
            box({0.35 * half.x(), 0.0, 0.5 * half.z()},
                {0.4 * half.x(), 0.92 * half.y(), 0.5 * half.z()}, {0.85f, 0.80f, 0.72f}),
            wheel(0),
            wheel(1),
            wheel(2),
            wheel(3)};
}

int wheels_on_ground(const Truck& truck) {
    return static_cast<int>(std::count_if(truck.wheels().begin(), truck.wheels().end(),
                                          [](const WheelState& wheel) { return wheel.on_ground; }));
}

void add_step(const StepReport& report, const Truck& truck, DriveTotals& totals) {
    totals.max_depth_m = std::max(totals.max_depth_m, report.max_depth_m);
    totals.fell_through += report.too_deep;
    totals.parked += report.parked;
    totals.left_world += report.left_world;
    totals.lived_time += report.lived_time;
    totals.lost_time += report.lost_time;
    ++totals.steps;
    if (report.parked == 0 && wheels_on_ground(truck) == 0) ++totals.airborne;
}

// Lets the truck down onto its springs, brakes on, before the first frame.
void put_down(Truck& truck, const Ground& ground, DriveTotals& totals) {
    constexpr int kSteps = 90;
    for (int i = 0; i < kSteps; ++i) {
        add_step(truck.step(ground, {.throttle = 0.0, .brake = 1.0, .steer = 0.0}, kLongestStep),
                 truck, totals);
    }
}

// One frame's time of driving on what is resident.
void drive_on(Truck& truck, PathDriver& driver, ChaseCamera& camera, const Ground& ground,
              double dt, DriveTotals& totals, StepReport& last_out) {
    const auto steps = static_cast<int>(std::ceil(dt / kLongestStep - 1e-9));
    for (int i = 0; i < steps; ++i) {
        const WorldPos before = truck.chassis().pose.translation;
        last_out = truck.step(ground, driver.drive(truck), dt / steps);
        totals.distance_m += (truck.chassis().pose.translation - before).norm();
        add_step(last_out, truck, totals);
        camera.follow(truck.chassis().pose, dt / steps);
    }
}

Result<DriveTotals> drive(const FlightOptions& options, const HeightSource& source, Truck& truck,
                          PathDriver& driver, std::size_t frame_count, FrameMaker& maker,
                          FlightOutput& output) {
    Progress progress("driving");
    const View picture = make_view(options.size, options.fov_deg);
    const std::array first_need{truck.need()};
    maker.settle(ChaseCamera(source, truck.chassis().pose).view(picture), first_need, 0.0);
    DriveTotals totals;
    put_down(truck, Ground(maker.pager().resident(), maker.pager().contact_level()), totals);
    ChaseCamera camera(source, truck.chassis().pose);
    StepReport last;
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < frame_count; ++i) {
        progress.show(static_cast<double>(i) / static_cast<double>(frame_count));
        const double time = static_cast<double>(i) / options.fps;
        if (options.waits_for_clock()) {
            std::this_thread::sleep_until(start + std::chrono::duration<double>(time));
        }
        const View view = camera.view(picture);
        const std::array needs{truck.need()};
        MadeFrame frame = maker.make({.view = view, .velocity = camera.velocity()}, needs, time);
        frame.record.extra = {truck.chassis().velocity.norm(), last.max_depth_m,
                              static_cast<double>(wheels_on_ground(truck))};
        const Result<void> added = output.add(std::move(frame), view, draw_truck(truck));
        if (!added) return tl::unexpected(added.error());
        if (output.is_closed()) break;
        if (driver.is_done() && truck.chassis().velocity.norm() < 0.1) break;
        const Ground ground(maker.pager().resident(), maker.pager().contact_level());
        drive_on(truck, driver, camera, ground, 1.0 / options.fps, totals, last);
    }
    return totals;
}

CommandResult<void> run_drive(const FlightOptions& options) {
    if (const CommandResult<void> good = check(options); !good) return good;
    const CommandResult<Terrain> terrain = open_terrain(options.terrain);
    if (!terrain) return pass_on(terrain.error());
    double duration = 0.0, speed = 0.0;
    Result<std::vector<Eigen::Vector2d>> way = find_way(options, *terrain, duration, speed);
    if (!way) return pass_on(way.error());
    const CommandResult<std::size_t> frame_count = count_frames(options.fps, duration);
    if (!frame_count) return pass_on(frame_count.error());
    const TruckSettings settings;
    Result<Truck> truck = Truck::create(settings, start_pose(*terrain->source, *way, settings));
    if (!truck) return pass_on(truck.error());
    PathDriver driver(std::move(*way), speed);
    Result<FrameMaker> maker = FrameMaker::create(terrain->source, frame_maker_settings(options));
    if (!maker) return pass_on(maker.error());
    Result<FlightOutput> output = FlightOutput::create(options, *terrain->source, kColumns);
    if (!output) return pass_on(output.error());

    const Result<DriveTotals> totals =
        drive(options, *terrain->source, *truck, driver, *frame_count, *maker, *output);
    if (!totals) return pass_on(totals.error());
    const auto share = [](double part, double whole) { return whole > 0.0 ? part / whole : 0.0; };
    nlohmann::ordered_json summary;
    summary["distance_m"] = totals->distance_m;
    summary["max_depth_m"] = totals->max_depth_m;
    summary["airborne_share"] =
        share(static_cast<double>(totals->airborne), static_cast<double>(totals->steps));
    summary["fell_through"] = totals->fell_through;
    summary["steps"] = totals->steps;
    summary["parked"] = totals->parked;
    summary["left_world"] = totals->left_world;
    summary["lost_time_share"] = share(totals->lost_time, totals->lived_time);
    summary["arrived"] = driver.is_done();
    summary.update(summarize(output->frames(), options.memory_bytes(), options.fps));
    summary["seconds"] = static_cast<double>(output->frames().size()) / options.fps;
    summary["path"] = options.path;
    summary["terrain"] = terrain->name;
    const Result<void> ended = output->finish("Drive over " + terrain->name, summary);
    if (!ended) return pass_on(ended.error());
    print_summary(summary, options.json);
    return {};
}

}  // namespace

void add_drive_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<FlightOptions>();
    options->path = "straight";
    CLI::App* drive = app.add_subcommand(
        "drive", "Drives a truck along a path on the contact surface, with a camera behind it");
    drive
        ->add_option("--path", options->path,
                     CameraPath::built_in_list() +
                         ", or a track: .csv, .gpx, .igc, .tum; its heights are not used")
        ->type_name("PATH")
        ->capture_default_str();
    add_positive(*drive, "--speed", options->speed,
                 "Metres a second to keep where the way is straight enough; 12 without it, or the "
                 "mean of a track");
    add_positive(*drive, "--seconds", options->seconds,
                 "How long at most; 20 without it, or as long as the track");
    add_flight_options(*drive, *options);
    drive->footer(
        "Before the first frame it waits for what that frame needs; after that never: a truck "
        "whose\n"
        "ground is late is parked until it is there, and that is counted.\n"
        "Example: terrane drive --dem tools/data/jacksboro.tif --seed 7 --video --out out/drive");
    drive->callback(
        [&context, options] { context.run = [options] { return run_drive(*options); }; });
}

}  // namespace terrane::tools
