// SPDX-License-Identifier: MIT
#include "camera/camera_path.h"
#include "camera/chase_camera.h"
#include "flight/drive_setup.h"
#include "flight/flight_output.h"
#include "frames/frame_maker.h"
#include "options/command.h"
#include "output/progress.h"
#include "output/summary.h"

#include <terrane/collision/path_driver.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <thread>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kLongestStep = 1.0 / 60.0;  // seconds
/// Reaction to a rollover.
enum class OnRoll { stop, right };

struct DriveOptions : FlightOptions {
    OnRoll on_roll = OnRoll::stop;
};

const std::vector<std::string> kColumns{"speed_m_s", "depth_m", "wheels_on_ground", "tilt_deg"};

/// Sums and maxima over the steps.
struct DriveTotals {
    double distance_m = 0.0;
    double max_depth_m = 0.0;
    std::uint64_t fell_through = 0;  // steps that ended deeper in the ground than the tolerance
    std::uint64_t steps = 0;
    std::uint64_t airborne = 0;  // steps without a wheel on the ground
    std::uint64_t parked = 0;    // steps without resident ground
    std::uint64_t left_world = 0;
    double simulated_time = 0.0, lost_time = 0.0;
    bool rolled_over = false;  // at any time
    std::uint64_t rights = 0;  // times that it was put upright
};

// A flat bed and a cab, both inside the collision chassis, and four wheels.
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
    totals.simulated_time += report.simulated_time;
    totals.lost_time += report.lost_time;
    ++totals.steps;
    if (report.parked == 0 && wheels_on_ground(truck) == 0) ++totals.airborne;
}

double tilt_deg(const Truck& truck) {
    const double up = std::clamp(truck.chassis().pose.rotation(2, 2), -1.0, 1.0);
    return std::acos(up) * 180.0 / std::numbers::pi;
}

// A truck that drives along a path.
class Drive {
public:
    Drive(const DriveOptions& options, const HeightSource& source, Truck truck, PathDriver driver)
        : options_(options),
          source_(source),
          truck_(std::move(truck)),
          driver_(std::move(driver)),
          camera_(std::in_place, source, truck_.chassis().pose) {}

    Result<void> play(std::size_t frame_count, FrameMaker& maker, FlightOutput& output);
    const DriveTotals& totals() const { return totals_; }
    bool has_arrived() const { return driver_.is_finished(); }

private:
    Result<void> put_down(const Ground& ground);
    void drive_frame(const Ground& ground, double dt);
    void handle_roll(const Ground& ground);
    void step(const Ground& ground, const TruckControls& controls, double dt);
    bool has_ended() const;

    const DriveOptions& options_;
    const HeightSource& source_;
    Truck truck_;
    PathDriver driver_;
    std::optional<ChaseCamera>
        camera_;  // always present; optional because ChaseCamera is not assignable
    DriveTotals totals_;
    StepReport last_;
};

void Drive::step(const Ground& ground, const TruckControls& controls, double dt) {
    last_ = truck_.step(ground, controls, dt);
    add_step(last_, truck_, totals_);
}

// Puts the truck on the ground, and steps it with the brake on until the springs are at rest.
Result<void> Drive::put_down(const Ground& ground) {
    constexpr int kSteps = 90;
    Result<Truck> placed = put_on_ground(truck_.settings(), truck_.chassis().pose, ground);
    if (!placed) return tl::unexpected(placed.error());
    truck_ = std::move(*placed);
    for (int i = 0; i < kSteps; ++i) step(ground, {.brake = 1.0}, kLongestStep);
    camera_.emplace(source_, truck_.chassis().pose);
    return {};
}

// Advances the drive by one frame on the resident ground.
void Drive::drive_frame(const Ground& ground, double dt) {
    const auto steps = static_cast<int>(std::ceil(dt / kLongestStep - 1e-9));
    for (int i = 0; i < steps && !has_ended(); ++i) {
        const WorldPos before = truck_.chassis().pose.translation;
        step(ground, driver_.drive(truck_), dt / steps);
        totals_.distance_m += (truck_.chassis().pose.translation - before).norm();
        camera_->follow(truck_.chassis().pose, dt / steps);
        if (truck_.is_rolled_over()) handle_roll(ground);
    }
}

// Puts the truck upright where it lies, with --on-roll right. Retries in a later step where ground is missing.
void Drive::handle_roll(const Ground& ground) {
    totals_.rolled_over = true;
    if (options_.on_roll == OnRoll::stop) return;
    const Pose& pose = truck_.chassis().pose;
    Eigen::Vector2d along = pose.rotation.col(0).head<2>();
    if (along.norm() < 1e-3) along = Eigen::Vector2d::UnitX();  // nose or tail up
    const Pose upright = slope_pose(source_, pose.translation.head<2>(), along, truck_.settings());
    Result<Truck> placed = put_on_ground(truck_.settings(), upright, ground);
    if (!placed) return;
    truck_ = std::move(*placed);
    ++totals_.rights;
}

bool Drive::has_ended() const {
    return (totals_.rolled_over && options_.on_roll == OnRoll::stop) ||
           (driver_.is_finished() && truck_.chassis().velocity.norm() < 0.1);
}

Result<void> Drive::play(std::size_t frame_count, FrameMaker& maker, FlightOutput& output) {
    Progress progress("driving");
    const View picture = make_view(options_.size, options_.fov_deg);
    const std::array first_need{truck_.need()};
    maker.load_until_stable(camera_->view(picture), first_need, 0.0);
    const Result<void> placed =
        put_down(Ground(maker.pager().resident(), maker.pager().contact_level()));
    if (!placed) return placed;
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < frame_count; ++i) {
        progress.show(static_cast<double>(i) / static_cast<double>(frame_count));
        const double time = static_cast<double>(i) / options_.fps;
        if (options_.waits_for_clock()) {
            std::this_thread::sleep_until(start + std::chrono::duration<double>(time));
        }
        const View view = camera_->view(picture);
        const std::array needs{truck_.need()};
        MadeFrame frame = maker.make({.view = view, .velocity = camera_->velocity()}, needs, time);
        frame.record.extra = {truck_.chassis().velocity.norm(), last_.max_depth_m,
                              static_cast<double>(wheels_on_ground(truck_)), tilt_deg(truck_)};
        const Result<void> added = output.add(std::move(frame), view, draw_truck(truck_));
        if (!added) return added;
        if (output.is_closed() || has_ended()) break;
        drive_frame(Ground(maker.pager().resident(), maker.pager().contact_level()),
                    1.0 / options_.fps);
    }
    return {};
}

nlohmann::ordered_json summarize_drive(const DriveTotals& totals, bool has_arrived) {
    const auto share = [](double part, double whole) { return whole > 0.0 ? part / whole : 0.0; };
    nlohmann::ordered_json summary;
    summary["distance_m"] = totals.distance_m;
    summary["max_depth_m"] = totals.max_depth_m;
    summary["airborne_share"] =
        share(static_cast<double>(totals.airborne), static_cast<double>(totals.steps));
    summary["fell_through"] = totals.fell_through;
    summary["rolled_over"] = totals.rolled_over;
    summary["rights"] = totals.rights;
    summary["steps"] = totals.steps;
    summary["parked"] = totals.parked;
    summary["left_world"] = totals.left_world;
    summary["lost_time_share"] = share(totals.lost_time, totals.simulated_time);
    summary["arrived"] = has_arrived;
    return summary;
}

CommandResult<void> run_drive(const DriveOptions& options) {
    if (const CommandResult<void> good = check(options); !good) return good;
    if (const CommandResult<void> good = check_drivable(options.path); !good) return good;
    const CommandResult<Terrain> terrain = open_terrain(options.terrain);
    if (!terrain) return pass_on(terrain.error());
    if (const CommandResult<void> fit = check_limits(options, *terrain); !fit) return fit;
    CommandResult<DrivePlan> plan = make_drive_plan(options, *terrain);
    if (!plan) return pass_on(plan.error());
    const HeightSource& source = *terrain->source;
    const std::vector<Eigen::Vector2d>& points = plan->points_world;
    const std::size_t ahead = std::min<std::size_t>(points.size() - 1, 4);
    const TruckSettings settings;
    Result<Truck> truck = Truck::create(
        settings, slope_pose(source, points.front(), points[ahead] - points.front(), settings));
    if (!truck) return pass_on(truck.error());
    Result<PathDriver> driver =
        PathDriver::create(std::move(plan->points_world), {.cruise_speed = plan->speed});
    if (!driver) return pass_on(driver.error());
    Result<FrameMaker> maker = FrameMaker::create(terrain->source, frame_maker_settings(options));
    if (!maker) return pass_on(maker.error());
    Result<FlightOutput> output = FlightOutput::create(options, source, kColumns);
    if (!output) return pass_on(output.error());

    Drive drive(options, source, std::move(*truck), std::move(*driver));
    const Result<void> played = drive.play(plan->frame_count, *maker, *output);
    if (!played) return pass_on(played.error());
    nlohmann::ordered_json summary = summarize_drive(drive.totals(), drive.has_arrived());
    summary.update(summarize(output->frames(), options.memory_bytes(), options.fps));
    summary["seconds"] = static_cast<double>(output->frames().size()) / options.fps;
    summary["path"] = options.path;
    summary["terrain"] = terrain->name;
    const Result<void> ended = output->finish("Drive over " + terrain->name, summary);
    if (!ended) return pass_on(ended.error());
    print_summary(summary, options.json);
    return output->verdict(plan->frame_count);
}

void add_on_roll(CLI::App& app, OnRoll& on_roll) {
    app.add_option_function<std::string>(
           "--on-roll",
           [&on_roll](const std::string& text) {
               if (text != "stop" && text != "right") {
                   throw CLI::ValidationError("--on-roll",
                                              "must be stop or right, got '" + text + "'");
               }
               on_roll = text == "stop" ? OnRoll::stop : OnRoll::right;
           },
           "When the truck has lain on its side or roof for a second: stop ends the drive, right "
           "puts it on its wheels")
        ->type_name("NAME")
        ->default_str("stop");
}

}  // namespace

void add_drive_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<DriveOptions>();
    options->path = "straight";
    CLI::App* drive = app.add_subcommand(
        "drive", "Drives a truck along a path on the contact surface, with a camera behind it");
    drive
        ->add_option(
            "--path", options->path,
            drivable_paths() + ", or a track: .csv, .gpx, .igc, .tum; its heights are not used")
        ->type_name("PATH")
        ->capture_default_str();
    add_in_range(*drive, "--speed", options->speed, kLeastDriveSpeed, kGreatestDriveSpeed,
                 "Metres a second to keep where the path is straight enough; 12 without it, or the "
                 "mean of a track");
    add_positive(*drive, "--seconds", options->seconds,
                 "How long at most; 20 without it, or as long as the track");
    add_on_roll(*drive, options->on_roll);
    add_flight_options(*drive, *options);
    drive->footer(
        "Waits for ground before the first frame only: a truck whose ground is late is parked\n"
        "until it is there, and that is counted.\n"
        "Example: terrane drive --dem tools/data/jacksboro.tif --seed 7 --video --out out/drive");
    drive->callback(
        [&context, options] { context.run = [options] { return run_drive(*options); }; });
}

}  // namespace terrane::tools
