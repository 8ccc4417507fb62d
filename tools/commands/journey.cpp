// SPDX-License-Identifier: MIT
#include "commands/journey.h"

#include "flight/flight_options.h"
#include "flight/path_ground.h"
#include "program/progress.h"

#include <terrane/playback/camera_path.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

constexpr double kGreatestMean = 1e3;  // m/s

Result<CameraPath> open_drive_path(const FlightOptions& options, const Terrain& terrain,
                                   CameraPathSettings& settings, double usual_speed) {
    if (!names_track_file(options.path)) {
        if (!settings.speed) settings.speed = usual_speed;
        return CameraPath::create(options.path, *terrain.source, planned_in(terrain, settings));
    }
    TERRANE_TRY(Track track, open_track(options.path, terrain));
    if (!track.has_times && !settings.speed) settings.speed = usual_speed;
    return follow_track(std::move(track), *terrain.source, settings);
}

}  // namespace

CommandResult<DrivePlan> make_drive_plan(const FlightOptions& options, const Terrain& terrain,
                                         double usual_speed, const CameraPathSettings& limits) {
    CameraPathSettings settings = limits;
    if (!std::isnan(options.speed)) settings.speed = options.speed;
    if (!std::isnan(options.seconds)) settings.seconds = options.seconds;
    TERRANE_TRY(const CameraPath path, open_drive_path(options, terrain, settings, usual_speed));
    if (!path.jumps().empty()) {
        return pass_on(
            {ErrorCode::invalid_argument,
             fmt::format("no vehicle or character can jump as the path '{}' does", options.path)});
    }
    TERRANE_TRY(const std::size_t frame_count, count_frames(options.fps, path.duration()));

    constexpr double kSpacing = 1.0;  // least distance of points, metres
    constexpr double kTimeStep = 0.05;
    std::vector<Eigen::Vector2d> points;
    double length = 0.0;
    for (double time = 0.0; time <= path.duration(); time += kTimeStep) {
        const Eigen::Vector2d p = path.at(time).eye_world.head<2>();
        const double step = points.empty() ? 0.0 : (p - points.back()).norm();
        if (!points.empty() && step < kSpacing) continue;
        length += step;
        points.push_back(p);
    }
    if (points.size() < 2) {
        return pass_on(
            {ErrorCode::invalid_argument,
             fmt::format("the path '{}' has no two points {} m apart", options.path, kSpacing)});
    }
    TERRANE_TRY(const PathGround ground, find_ground_under({&points, 1}, terrain));
    if (!ground.is_complete()) {
        return pass_on(
            {ErrorCode::invalid_argument,
             fmt::format("the path '{}' {}{}", options.path, describe_lack(ground, terrain),
                         ground.first_along > 0.0 ? ": end it before with --seconds" : "")});
    }
    const double mean_speed = std::clamp(length / path.duration(), 1.0, kGreatestMean);
    return DrivePlan{.path = Polyline(std::move(points)),
                     .speed = settings.speed.value_or(mean_speed),
                     .frame_count = frame_count};
}

namespace {

constexpr double kLongestStep = 1.0 / 60.0;  // seconds
constexpr int kStepsToRest = 90;
constexpr double kFreeAtStart = 3.0;  // metres between the traveller's start and crates

}  // namespace

Journey::Journey(const FlightOptions& options, const Terrain& terrain, const DrivePlan& plan,
                 std::size_t crate_count, const ChaseCameraSettings& camera, Traveller& traveller,
                 ObjectBodies scene_objects, World world, World obstacles)
    : options_(options),
      terrain_(terrain),
      plan_(plan),
      traveller_(traveller),
      camera_settings_(camera),
      crates_{.path = plan.path,
              .count = crate_count,
              .seed = options.terrain.seed.value_or(1),
              .start_radius = traveller.first_need().radius + kFreeAtStart},
      world_(std::move(world)),
      scene_objects_(std::move(scene_objects)),
      obstacles_(std::move(obstacles)) {
    camera_.emplace(*terrain.source, traveller_.pose(world_), camera_settings_);
}

CommandResult<Journey> Journey::create(const FlightOptions& options, const Terrain& terrain,
                                       const DrivePlan& plan, std::size_t crate_count,
                                       const ChaseCameraSettings& camera, Traveller& traveller) {
    WorldSettings settings;
    settings.report_contacts = true;
    TERRANE_TRY(World world, World::create(settings));
    TERRANE_TRY(World obstacles, World::create({}));
    TERRANE_TRY(ObjectBodies objects, ObjectBodies::create(terrain.source, terrain.objects.get()));
    for (const std::span<const PlacedBody> each : {std::span(terrain.bodies), objects.placed()}) {
        TERRANE_TRY(add_bodies(each, obstacles));
    }
    return Journey(options, terrain, plan, crate_count, camera, traveller, std::move(objects),
                   std::move(world), std::move(obstacles));
}

std::vector<std::string> journey_columns() {
    return {"speed_m_s", "depth_m", "body_x_m", "body_y_m", "body_z_m"};
}

std::vector<double> journey_figures(const BodyState& traveller, const StepFigures& last) {
    const WorldPos& place = traveller.pose.translation;
    return {traveller.velocity.norm(), last.max_depth_m, place.x(), place.y(), place.z()};
}

std::vector<std::string> Journey::columns(const Traveller& traveller) {
    std::vector<std::string> names = journey_columns();
    const std::vector<std::string> more = traveller.columns();
    names.insert(names.end(), more.begin(), more.end());
    return names;
}

Ground Journey::ground_of(const FrameMaker& maker) const {
    return maker.pager().ground(terrain_.surface);
}

// Places the traveller and the crates on the ground, simulates until springs and crates are at rest, and adds the
// bodies of the scene.
CommandResult<void> Journey::put_down(const Ground& ground) {
    TERRANE_TRY(std::vector<PlacedBody> crates, lay_out_crates(crates_, ground, obstacles_));
    TERRANE_TRY(const BodyId entered, traveller_.enter(world_, ground, obstacles_));
    body_ = entered;
    TERRANE_TRY(add_bodies(crates, world_));
    for (int i = 0; i < kStepsToRest; ++i) {
        traveller_.control(world_, false, kLongestStep);
        step(ground, kLongestStep);
    }
    TERRANE_TRY(add_bodies(terrain_.bodies, world_));
    TERRANE_TRY(add_bodies(scene_objects_.placed(), world_));
    touched_.assign(world_.states().size(), 0);
    std::fill_n(touched_.begin() + static_cast<std::ptrdiff_t>(first_crate(body_)), crates_.count,
                std::uint8_t{1});
    camera_.emplace(*terrain_.source, traveller_.pose(world_), camera_settings_);
    return {};
}

void Journey::step(const Ground& ground, double dt) {
    last_ = world_.step(ground, dt);
    totals_.max_depth_m = std::max(totals_.max_depth_m, last_.max_depth_m);
    totals_.fell_through += last_.too_deep;
    totals_.parked += last_.parked;
    totals_.left_world += last_.left_world;
    totals_.simulated_time += last_.simulated_time;
    totals_.lost_time += last_.lost_time;
    ++totals_.steps;
    const bool is_parked = world_.state(body_).condition == BodyCondition::parked;
    if (!is_parked && !traveller_.is_supported(world_)) ++totals_.airborne;
}

// Counts the crates that the traveller touched in the last step.
void Journey::count_touched() {
    supports_.clear();
    traveller_.add_supports(world_, supports_);
    for (const ContactEvent& event : world_.contact_events()) {
        if (event.is_ground()) continue;
        if (event.a == body_) supports_.push_back(event.b);
        if (event.b == body_) supports_.push_back(event.a);
    }
    for (const BodyId touched : supports_) {
        // scattered objects have larger indices
        if (!touched.is_valid() || touched.index >= touched_.size()) continue;
        if (touched_[touched.index] != 1) continue;
        touched_[touched.index] = 2;
        ++totals_.crates_touched;
    }
}

int Journey::steps_in_frame() const {
    return static_cast<int>(std::ceil(frame_time() / kLongestStep - 1e-9));
}

RunSettings Journey::run_settings(RunKind kind) const {
    return {.kind = kind,
            .fps = options_.fps,
            .dt = frame_time() / steps_in_frame(),
            .camera = camera_settings_,
            .crate_count = crates_.count};
}

// Advances the journey by one frame on the resident ground.
CommandResult<void> Journey::advance(const Ground& ground, RunRecorder* recorder) {
    const double dt = frame_time() / steps_in_frame();
    for (int i = 0; i < steps_in_frame() && !traveller_.has_ended(world_); ++i) {
        const WorldPos before = world_.state(body_).pose.translation;
        TERRANE_TRY(scene_objects_.follow(world_, ground));
        const RunAction action = traveller_.control(world_, true, dt);
        step(ground, dt);
        const BodyState& state = world_.state(body_);
        if (state.condition != BodyCondition::left_world) {
            totals_.distance_m += (state.pose.translation - before).norm();
        }
        count_touched();
        const bool has_changed = traveller_.react(world_, ground, dt);
        camera_->follow(traveller_.pose(world_), dt, ground, world_, body_);
        if (recorder == nullptr) continue;
        recorder->add_step({action});
        if (has_changed || last_.parked > 0) recorder->amend(world_.save(), traveller_.gait());
        if (!camera_->is_complete()) recorder->amend(camera_->state());
    }
    return {};
}

Result<void> Journey::show(BodyNodes& nodes) const {
    TERRANE_TRY(traveller_.show(world_, nodes));
    return show_bodies(world_, body_, crates_.count, terrain_.bodies.size(), nodes);
}

CommandResult<void> Journey::play(FrameMaker& maker, FlightOutput& output, BodyNodes& nodes,
                                  RunRecorder* recorder) {
    Progress progress("driving");
    const View picture = make_view(options_.size, options_.fov_deg);
    std::vector<BodyNeed> needs = crate_needs(crates_, *terrain_.source);
    needs.push_back(traveller_.first_need());
    needs.push_back(camera_->need());
    const std::span<const BodyNeed> of_scene = obstacles_.needs();
    needs.insert(needs.end(), of_scene.begin(), of_scene.end());
    maker.load_until_stable(camera_->view(picture), needs, 0.0);
    if (output.is_closed()) return {};
    TERRANE_TRY(put_down(ground_of(maker)));
    if (recorder != nullptr) recorder->set_traveller(body_);
    set_nodes(terrain_.bodies, first_scene_body(body_, crates_.count), nodes);
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < plan_.frame_count; ++i) {
        progress.show(static_cast<double>(i) / static_cast<double>(plan_.frame_count));
        const double time = static_cast<double>(i) / options_.fps;
        if (options_.waits_for_clock()) {
            std::this_thread::sleep_until(start + std::chrono::duration<double>(time));
        }
        const View view = camera_->view(picture);
        if (traveller_.change_ground(world_, maker.pager()) && recorder != nullptr)
            recorder->ground().set(recorder->step_count(), traveller_.ground_edits());
        TERRANE_TRY(show(nodes));
        const std::span<const BodyNeed> of_world = world_.needs();
        needs.assign(of_world.begin(), of_world.end());
        needs.push_back(camera_->need());
        MadeFrame frame = maker.make({.view = view, .velocity = camera_->velocity()}, needs, time);
        frame.record.extra = journey_figures(world_.state(body_), figures());
        const std::vector<double> of_traveller = traveller_.figures(world_);
        frame.record.extra.insert(frame.record.extra.end(), of_traveller.begin(),
                                  of_traveller.end());
        TERRANE_TRY(output.add(std::move(frame), view));
        if (recorder != nullptr)
            recorder->add_frame(world_, camera_->state(), traveller_.gait(), figures());
        if (output.is_closed() || traveller_.has_ended(world_)) break;
        TERRANE_TRY(advance(ground_of(maker), recorder));
    }
    return {};
}

nlohmann::ordered_json summarize(const PathProgress& progress) {
    nlohmann::ordered_json summary;
    summary["arrived"] = progress.has_arrived;
    summary["path_share"] = progress.share;
    summary["stuck_s"] = progress.stuck_s;
    if (progress.stuck_world) {
        summary["stuck_at"] = {progress.stuck_world->x(), progress.stuck_world->y()};
    }
    return summary;
}

nlohmann::ordered_json summarize(const JourneyTotals& totals) {
    const auto share = [](double part, double whole) { return whole > 0.0 ? part / whole : 0.0; };
    nlohmann::ordered_json summary;
    summary["distance_m"] = totals.distance_m;
    summary["max_depth_m"] = totals.max_depth_m;
    summary["airborne_share"] =
        share(static_cast<double>(totals.airborne), static_cast<double>(totals.steps));
    summary["fell_through"] = totals.fell_through;
    summary["crates_touched"] = totals.crates_touched;
    summary["steps"] = totals.steps;
    summary["parked"] = totals.parked;
    summary["left_world"] = totals.left_world;
    summary["lost_time_share"] = share(totals.lost_time, totals.simulated_time);
    return summary;
}

}  // namespace terrane::tools
