// SPDX-License-Identifier: MIT
#include "view/viewer.h"

#include "flight/flight_output.h"
#include "flight/pictures.h"
#include "program/output_file.h"
#include "program/progress.h"
#include "program/summary.h"

#include <terrane/render/sun_position.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <numbers>
#include <thread>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kLongestFrame = 0.25;      // seconds of real time that a frame may advance
constexpr double kSimulationShare = 0.1;    // seconds of a frame after which steps are left out
constexpr double kStartAltitude = 30.0;     // metres above the ground
constexpr double kStartElevation = -8.0;    // degrees
constexpr double kContentDistance = 120.0;  // metres from what a scene has
constexpr double kEyeRadius = 0.5;  // metres, of the ball that keeps the eye out of the ground

constexpr std::size_t kShareOfPast =
    4;  // the simulation's past has this part of the chunks' ceiling

double median(std::vector<double> values) {
    if (values.empty()) return 0.0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// Makes storage fast for a scope in which the user waits for ground.
class FastStorage {
public:
    explicit FastStorage(SlowHeights& storage) : storage_(storage), before_(storage.speed()) {
        storage_.set_speed({});
    }
    FastStorage(const FastStorage&) = delete;
    FastStorage& operator=(const FastStorage&) = delete;
    ~FastStorage() { storage_.set_speed(before_); }

private:
    SlowHeights& storage_;
    StorageSpeed before_;
};

// The place of the first thing of a scene that has one; none without such a thing.
std::optional<WorldPos> place_of_content(const Terrain& terrain) {
    const auto on_ground = [&](const WorldPos& p) {
        return WorldPos(p.x(), p.y(), terrain.source->height(p.x(), p.y()));
    };
    if (terrain.nodes != nullptr && !terrain.nodes->nodes.empty())
        return on_ground(terrain.nodes->nodes[0].place.parent_from_node.translation);
    if (!terrain.bodies.empty()) return on_ground(terrain.bodies[0].state.pose.translation);
    if (terrain.objects != nullptr && !terrain.objects->objects.empty())
        return on_ground(terrain.objects->objects[0].world_from_object.translation);
    return std::nullopt;
}

CameraPose pose_at(const CameraPlace& place) {
    const double azimuth = place.azimuth_deg * kDegree, elevation = place.elevation_deg * kDegree;
    CameraPose pose;
    pose.eye_world = place.eye_world;
    pose.forward = {std::cos(elevation) * std::sin(azimuth),
                    std::cos(elevation) * std::cos(azimuth), std::sin(elevation)};
    return pose;
}

}  // namespace

std::array<double, 2> degrees_of(const Eigen::Vector3d& direction) {
    return {std::atan2(direction.x(), direction.y()) / kDegree,
            std::asin(std::clamp(direction.normalized().z(), -1.0, 1.0)) / kDegree};
}

std::array<double, 2> sun_dials(const Eigen::Vector3d& direction) {
    const std::array<double, 2> angles = degrees_of(direction);
    return {angles[0] < 0.0 ? angles[0] + 360.0 : angles[0], angles[1]};
}

Eigen::Vector3d sun_direction(const std::array<double, 2>& sun_deg) {
    return direction_to_sun({sun_deg[0] * kDegree, sun_deg[1] * kDegree});
}

Viewer::Viewer(const FlightOptions& options, const Terrain& terrain,
               std::unique_ptr<GroundEditor> brush, ViewerSettings settings, Window window,
               GlContext context, TerrainRenderer renderer, FrameMaker maker, LiveWorld live)
    : options_(options),
      terrain_(terrain),
      brush_(std::move(brush)),
      settings_(std::move(settings)),
      window_(std::move(window)),
      context_(std::move(context)),
      renderer_(std::move(renderer)),
      maker_(std::move(maker)),
      live_(std::move(live)),
      history_(options.memory_bytes() / kShareOfPast, settings_.recorder),
      picture_(make_view(options.size, options.fov_deg)),
      timeline_(std::numeric_limits<double>::infinity()) {}

Viewer::~Viewer() {
    settings_.storage->set_speed({});  // loader threads end with their request
    if (log_ != nullptr) std::fclose(log_);
}

CommandResult<std::unique_ptr<Viewer>> Viewer::create(const FlightOptions& options,
                                                      const Terrain& terrain,
                                                      std::unique_ptr<GroundEditor> brush,
                                                      ViewerSettings settings) {
    TERRANE_TRY(Window window,
                Window::create("terrane: loading " + terrain.name, options.size.width_px,
                               options.size.height_px, settings.waits_for_display));
    TERRANE_TRY(GlContext context, GlContext::adopt_current());
    TERRANE_TRY(const RendererSettings of_renderer,
                picture_settings(options, terrain, context.is_software()));
    TERRANE_TRY(TerrainRenderer renderer,
                TerrainRenderer::create(context, options.size.width_px, options.size.height_px,
                                        of_renderer));
    TERRANE_TRY(FrameMaker maker,
                FrameMaker::create(terrain.source, frame_maker_settings(options)));
    // the bodies of the scene are those of the run
    const bool is_replay = settings.record && settings.record->settings().kind != RunKind::flight;
    TERRANE_TRY(LiveWorld live, LiveWorld::create(terrain, !is_replay));
    std::unique_ptr<Viewer> made(
        new Viewer(options, terrain, std::move(brush), std::move(settings), std::move(window),
                   std::move(context), std::move(renderer), std::move(maker), std::move(live)));
    Viewer& viewer = *made;
    TERRANE_TRY(std::unique_ptr<ObjectField> objects,
                make_object_field(viewer.options_, terrain, &viewer.renderer_));
    const auto make_nodes = [&] {
        BodyNodes nodes(*objects, &viewer.renderer_, viewer.options_.shows_proxies);
        nodes.set_meshes(terrain.bodies);
        return nodes;
    };
    viewer.nodes_.emplace(make_nodes());
    TERRANE_TRY(viewer.open_playback());
    if (viewer.replay_) viewer.replay_bodies_.emplace(*viewer.replay_, terrain, make_nodes());
    for (std::size_t i = 0; i < terrain.bodies.size(); ++i)
        viewer.nodes_->set_node(i, terrain.bodies[i]);
    viewer.maker_.set_objects(std::move(objects));
    TERRANE_TRY(viewer.triangulator_,
                make_device_triangulator(options, viewer.context_, *terrain.source));
    if (viewer.triangulator_) {
        viewer.maker_.set_device(&*viewer.triangulator_);
        TERRANE_TRY(set_instance_device(viewer.renderer_, viewer.maker_.objects()->scene()));
    }
    if (terrain.objects != nullptr) {
        TERRANE_TRY(ObjectPicker picker, ObjectPicker::create(terrain.source, *terrain.objects));
        viewer.picker_.emplace(std::move(picker));
    }
    if (const Result<Georeference> georeference = georeference_of(terrain); georeference)
        viewer.georeference_ = *georeference;
    if (!viewer.settings_.state_log.empty()) {
        viewer.log_ = std::fopen(viewer.settings_.state_log.c_str(), "w");
        if (viewer.log_ == nullptr)
            return pass_on(cannot_write(viewer.settings_.state_log, errno).value());
    }
    viewer.dials_ = {
        .budget = static_cast<double>(options.budget),
        .max_error_px = options.max_error_px,
        .morph_ratio = options.morph_ratio,
        .memory_mb = options.memory_mb,
        .sun_deg = sun_dials(of_renderer.sun_direction),
        .vehicle = viewer.settings_.vehicle,
        .latency_ms = given(options.latency_ms).value_or(0.0),
        .bandwidth_mb =
            given(options.bandwidth_mb).value_or(std::numeric_limits<double>::infinity())};
    TERRANE_TRY(viewer.dials_.lights, placed_lights(options, *terrain.source));
    TERRANE_TRY(set_lights(viewer.renderer_, viewer.dials_.lights));
    if (viewer.brush_ != nullptr) {
        viewer.dials_.brush_radius =
            std::max(viewer.dials_.brush_radius, viewer.brush_->least_radius());
    }
    if (viewer.georeference_) {
        // noon UTC of the day of --sun-time, or of a day in June
        constexpr double kDay = 86400.0;
        const double time = parse_time(options.sun_time).value_or(*parse_time("2026-06-21T12:00Z"));
        viewer.day_ = kDay * std::floor(time / kDay);
        viewer.dials_.sun_hour = (time - viewer.day_) / 3600.0;
    }
    viewer.applied_ = viewer.dials_;
    viewer.overlay_ = std::make_unique<Overlay>(viewer.window_);
    if (!viewer.settings_.shows_help) viewer.overlay_->help = Overlay::Help::none;
    viewer.overlay_->shows_panel = viewer.settings_.shows_help;
    TERRANE_TRY(viewer.begin());
    viewer.window_.set_title("terrane: " + terrain.name);
    return made;
}

// Opens the path or the record of the timeline.
CommandResult<void> Viewer::open_playback() {
    if (settings_.path) {
        timeline_ = Timeline(settings_.path->duration());
        for (const PathMoment& moment : path_moments(*settings_.path))
            path_points_.push_back(moment.pose.eye_world);
    }
    if (!settings_.record) return {};
    frame_rate_ = settings_.record->settings().fps;
    timeline_ = Timeline(static_cast<double>(settings_.record->frame_count() - 1) / frame_rate_);
    if (settings_.record->settings().kind == RunKind::flight) {
        TERRANE_TRY(poses_, settings_.record->read_poses());
        for (const CameraPose& pose : poses_) path_points_.push_back(pose.eye_world);
        return {};
    }
    TERRANE_TRY(Replay replay, Replay::create(*std::exchange(settings_.record, std::nullopt),
                                              settings_.recorded, options_.memory_bytes()));
    replay_.emplace(std::move(replay));
    return {};
}

// Brings the recorded bodies to the time of the playback.
Result<void> Viewer::play() {
    if (!replay_) return {};
    const std::size_t frame = replay_->record().frame_at(timeline_.time());
    if (frame != replay_->frame()) TERRANE_TRY(replay_->seek(frame));
    return brush_ != nullptr ? brush_->set_edits(replay_->ground_edits()) : Result<void>{};
}

// The camera of the path or record at the time of the playback.
CameraPose Viewer::played_pose() const {
    if (settings_.path) return settings_.path->at(timeline_.time());
    if (replay_) {
        const View view = replay_->view(picture_);
        return {view.eye_world, view.forward, view.up, replay_->camera_velocity()};
    }
    return poses_[settings_.record->frame_at(timeline_.time())];
}

// The needs of live and of recorded bodies, and of the free camera, which the ground stops.
std::span<const BodyNeed> Viewer::needs() {
    const std::span<const BodyNeed> of_live = live_.needs();
    needs_.assign(of_live.begin(), of_live.end());
    if (replay_) {
        const std::span<const BodyNeed> of_replay = replay_->world().needs();
        needs_.insert(needs_.end(), of_replay.begin(), of_replay.end());
    }
    const CameraPose pose = camera_.pose();
    needs_.push_back(
        {.centre_world = pose.eye_world, .velocity = pose.velocity, .radius = 2.0 * kEyeRadius});
    return needs_;
}

// Puts the camera at its start, and loads what the first frame needs.
CommandResult<void> Viewer::begin() {
    const WorldVec2 start = start_of(terrain_);
    CameraPlace place{.eye_world = {start.x(), start.y(),
                                    terrain_.source->height(start.x(), start.y()) + kStartAltitude},
                      .elevation_deg = kStartElevation};
    if (const std::optional<WorldPos> content = place_of_content(terrain_);
        content && !terrain_.start)
        place.eye_world = *content + WorldPos(0.0, -kContentDistance, kStartAltitude);
    if (settings_.place) place = *settings_.place;
    home_ = has_playback() && !settings_.place ? played_pose() : pose_at(place);
    camera_.jump_to(home_);
    follows_path_ = has_playback() && !settings_.place && settings_.being == Being::camera;
    if (!has_playback() || settings_.being != Being::camera) timeline_.play();
    if (settings_.is_full_screen) window_.set_full_screen(true);
    const WorldVec2 ahead = camera_.pose().forward.head<2>();
    if (settings_.being == Being::driver)
        live_.drive(settings_.vehicle, home_.eye_world.head<2>(), home_.eye_world.z(), ahead);
    if (settings_.being == Being::walker)
        live_.walk(home_.eye_world.head<2>(), home_.eye_world.z(), ahead);
    TERRANE_TRY(follow_window_size());
    maker_.load_until_stable(view_now(), needs(), clock_);
    settings_.storage->set_speed(storage_speed(dials_.latency_ms, dials_.bandwidth_mb));
    return {};
}

bool Viewer::follows_body() const { return live_.being() != Being::camera && !live_.is_waiting(); }

CameraPose Viewer::pose_now() const {
    if (!follows_body()) return follows_path_ ? played_pose() : camera_.pose();
    const View view = live_.view(picture_);
    return {view.eye_world, view.forward, view.up, live_.velocity()};
}

View Viewer::view_now() const { return view_at(picture_, pose_now()); }

// Lifts the camera out of ground that was filled around it.
void Viewer::lift_eye() {
    if (follows_path_ || live_.being() != Being::camera) return;
    CameraPose pose = camera_.pose();
    const std::optional<double> height = altitude(pose.eye_world);
    if (!height || *height >= 0.0) return;
    const WorldPos& eye = pose.eye_world;
    const HeightAnswer top = maker_.pager().ground(terrain_.surface).height(eye.x(), eye.y());
    const double floor = top.status == QueryStatus::ok ? top.height : eye.z() - *height;
    pose.eye_world.z() = floor + FreeCamera::kClearance;
    camera_.jump_to(pose);
}

CameraPlace Viewer::place_now() const {
    const View view = view_now();
    const std::array<double, 2> angles = degrees_of(view.forward);
    return {view.eye_world, angles[0], angles[1]};
}

std::optional<double> Viewer::altitude(const WorldPos& eye_world) const {
    const Ground ground = maker_.pager().ground(terrain_.surface);
    const HeightAnswer below = ground.height_below(eye_world.x(), eye_world.y(), eye_world.z());
    if (below.status == QueryStatus::ok) return eye_world.z() - below.height;
    const double height = terrain_.source->height(eye_world.x(), eye_world.y());
    if (!std::isfinite(height)) return std::nullopt;
    const bool may_be_in_cave = below.status == QueryStatus::not_resident && eye_world.z() < height;
    if (may_be_in_cave && (terrain_.volumes != nullptr || ground.has_solids())) return std::nullopt;
    return eye_world.z() - height;
}

// Where a motion of the eye ends: before the ground, or along it.
WorldPos Viewer::stopped(const WorldPos& from_world, const WorldPos& to_world) const {
    const Ground ground = maker_.pager().ground(terrain_.surface);
    const QueryFilter ground_alone{.layers = 0};
    WorldPos at = from_world;
    Eigen::Vector3d left = to_world - from_world;
    bool is_known = true;
    // two slides are enough to stop in an edge between two slopes
    for (int slide = 0; slide < 3 && left.norm() > 0.0; ++slide) {
        Motion motion;
        motion.start.translation = at;
        motion.translation = left;
        const CastQueryAnswer met =
            live_.world().cast(ground, Sphere{kEyeRadius}, motion, ground_alone);
        is_known = is_known && met.status == QueryStatus::ok;
        if (!met.hit) {
            at += left;
            break;
        }
        at += met.fraction * left;
        left *= 1.0 - met.fraction;
        left -= std::min(0.0, left.dot(met.normal)) * met.normal;
    }
    if (is_known && ground.has_solids()) return at;
    const double floor = terrain_.source->height(at.x(), at.y());
    // in a cave whose ground has not arrived
    if (terrain_.volumes != nullptr &&
        from_world.z() < terrain_.source->height(from_world.x(), from_world.y()))
        return from_world;
    if (std::isfinite(floor)) at.z() = std::max(at.z(), floor + FreeCamera::kClearance);
    return at;
}

Result<void> Viewer::follow_window_size() {
    const int width = window_.width_px(), height = window_.height_px();
    if (width < 1 || height < 1) return {};
    if (width == picture_.width_px && height == picture_.height_px) return {};
    if (film_) end_film();  // a film has one size
    TERRANE_TRY(renderer_.resize(width, height));
    picture_.width_px = width;
    picture_.height_px = height;
    return {};
}

Result<void> Viewer::follow_dials() {
    const ViewDials& now = dials_;
    ViewDials& before = applied_;
    if (now.budget != before.budget || now.max_error_px != before.max_error_px ||
        now.morph_ratio != before.morph_ratio) {
        TriangulatorSettings settings = frame_maker_settings(options_).triangulator;
        settings.triangle_budget = static_cast<std::size_t>(std::max(now.budget, 1.0));
        settings.max_error_px = now.max_error_px;
        settings.morph_ratio = now.morph_ratio;
        if (const Result<void> changed = maker_.set_triangulator(settings); !changed) {
            say(changed.error().message);
            dials_.budget = before.budget;
            dials_.max_error_px = before.max_error_px;
            dials_.morph_ratio = before.morph_ratio;
        }
    }
    if (now.sun_hour != before.sun_hour) {
        if (const std::optional<std::array<double, 2>> sun = sun_at(*now.sun_hour))
            dials_.sun_deg = *sun;
    }
    if (now.sun_deg != before.sun_deg) {
        TERRANE_TRY(renderer_.set_sun(sun_direction(now.sun_deg)));
        maker_.objects()->set_shadows(renderer_.shadows());
    }
    if (now.lights != before.lights) TERRANE_TRY(set_lights(renderer_, now.lights));
    if (now.memory_mb != before.memory_mb) {
        const auto bytes = static_cast<std::size_t>(now.memory_mb * 0x1p20);
        if (const Result<void> changed = maker_.pager().set_memory_bytes(bytes); !changed) {
            say(changed.error().message);
            dials_.memory_mb = before.memory_mb;
        }
    }
    if (now.live != before.live) {
        if (const Result<void> changed = live_.set(now.live); !changed)
            say(changed.error().message);
        history_.change(live_);
    }
    if (now.latency_ms != before.latency_ms || now.bandwidth_mb != before.bandwidth_mb)
        settings_.storage->set_speed(storage_speed(now.latency_ms, now.bandwidth_mb));
    renderer_.set_wireframe(now.wireframe);
    if (now.colours == GroundColours::materials && !options_.has_materials()) {
        say("the ground has tints: --look full or --ground gives it materials");
        dials_.colours = before.colours;
    }
    renderer_.set_flat_materials(now.colours == GroundColours::materials);
    before = now;
    return {};
}

// Returns to the past of the simulation if the timeline was moved there.
Result<void> Viewer::follow_timeline() {
    if (has_playback()) return {};
    const double before =
        LiveWorld::kStep * static_cast<double>(history_.step_now()) + unsimulated_;
    if (std::abs(timeline_.time() - before) < 0.5 * LiveWorld::kStep) return {};
    unsimulated_ = 0.0;
    return seek(static_cast<std::size_t>(timeline_.time() / LiveWorld::kStep + 0.5));
}

// Brings the simulation to a step of its past or future, and loads the ground there.
Result<void> Viewer::seek(std::size_t step) {
    return history_.seek(step, live_, [this](std::span<const GroundEdit> edits) -> Result<Ground> {
        TERRANE_TRY(ground_with(edits));
        return load_ground();
    });
}

// The resident ground, changed at once to one with these edits.
Result<Ground> Viewer::ground_with(std::span<const GroundEdit> edits) {
    if (brush_ == nullptr) return maker_.pager().ground(terrain_.surface);
    const bool is_same = std::ranges::equal(brush_->edits_in_force(), edits);
    if (brush_->waiting() > 0 || !is_same) {
        const FastStorage fast(*settings_.storage);
        TERRANE_TRY(brush_->set_edits(edits));
        // goes on with the ground that there is: the changes come into force when they fit
        if (const auto finished = brush_->finish(maker_.pager()); !finished)
            say(finished.error().message);
        return load_ground();
    }
    return maker_.pager().ground(terrain_.surface);
}

// The ground under all bodies, loaded at once.
Ground Viewer::load_ground() {
    const FastStorage fast(*settings_.storage);
    maker_.pager().update({}, needs(), clock_);
    maker_.pager().finish();
    return maker_.pager().ground(terrain_.surface);
}

// The sun's place at an hour UTC of the day, degrees; none where the longitude is unknown.
std::optional<std::array<double, 2>> Viewer::sun_at(double hour) const {
    if (!georeference_) return std::nullopt;
    const WorldPos eye = view_now().eye_world;
    const Eigen::Vector3d lonlat = georeference_->lonlat_from_world(eye);
    const double convergence = georeference_->scale_at(eye.x(), eye.y()).convergence;
    if (!lonlat.allFinite() || !std::isfinite(convergence)) return std::nullopt;
    return sun_dials(
        direction_to_sun(sun_position(day_ + 3600.0 * hour, lonlat.x(), lonlat.y()), convergence));
}

// Simulates a duration in whole steps, those of the past as they were unless the user steers; leaves out what takes too
// long.
Result<void> Viewer::simulate(double seconds) {
    unsimulated_ += seconds;
    const Clock::time_point start = Clock::now();
    for (; unsimulated_ >= LiveWorld::kStep; unsimulated_ -= LiveWorld::kStep) {
        if (history_.is_in_past() && !is_steering_) {
            TERRANE_TRY(history_.seek(
                history_.step_now() + 1, live_,
                [this](std::span<const GroundEdit> edits) { return ground_with(edits); }));
        } else {
            TERRANE_TRY(history_.step(live_, maker_.pager().ground(terrain_.surface)));
            if (follows_body()) history_.show(pose_now());
        }
        if (std::chrono::duration<double>(Clock::now() - start).count() < kSimulationShare)
            continue;
        unsimulated_ = 0.0;
        break;
    }
    return {};
}

// The mesh of the last frame with its triangles in memory.
const TerrainMesh& Viewer::host_mesh() {
    if (mesh_.device == nullptr) return mesh_;
    // a mesh that cannot be read has no triangles to pick
    if (const Result<TerrainMesh> read = maker_.host_mesh()) mesh_ = *read;
    return mesh_;
}

CommandResult<void> Viewer::make_frame(double dt) {
    TERRANE_TRY(follow_window_size());
    TERRANE_TRY(follow_dials());
    clock_ += dt;
    TERRANE_TRY(follow_timeline());
    const double advanced = timeline_.advance(dt);
    // in force from the pager's update in make() on
    const std::optional<Aabb> changed =
        brush_ != nullptr ? std::optional(brush_->update(maker_.pager())) : std::nullopt;
    TERRANE_TRY(play());
    TERRANE_TRY(simulate(advanced));
    // a return to the past is one to its settings
    dials_.live = applied_.live = live_.settings();
    if (!has_playback()) {
        timeline_.set_past(
            LiveWorld::kStep * static_cast<double>(history_.first_step()),
            LiveWorld::kStep * static_cast<double>(history_.step_count()) + LiveWorld::kStep);
        timeline_.seek(LiveWorld::kStep * static_cast<double>(history_.step_now()) + unsimulated_);
    }
    shown_time_ = timeline_.time();
    lift_eye();
    const View view = view_now();
    TERRANE_TRY(live_.show(*nodes_));
    if (replay_bodies_) TERRANE_TRY(replay_bodies_->show(*replay_));
    history_.show(pose_now());
    const CameraNeed camera{.view = view, .velocity = pose_now().velocity};
    MadeFrame frame = maker_.make(camera, needs(), clock_, has_playback() ? shown_time_ : clock_);
    if (changed && changed->low.x() <= changed->high.x()) {
        live_.change_ground(*changed);
        history_.change_ground(live_, brush_->edits_in_force());
    }
    mesh_ = frame.mesh;
    renderer_.set_ground_marks(
        ground_marks(dials_.colours, dials_.colours == GroundColours::none ? mesh_ : host_mesh(),
                     view, dials_.max_error_px, dials_.morph_ratio));
    const Clock::time_point start = Clock::now();
    TERRANE_TRY(renderer_.set_time(has_playback() ? shown_time_ : clock_));
    TERRANE_TRY(renderer_.draw(frame.mesh, view, frame.draws));
    TERRANE_TRY(window_.draw(renderer_));
    draw_ms_ = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    frame.record.draw_ms = draw_ms_;
    frame.record.add_gpu_ms(renderer_.counts().gpu_ms);
    TERRANE_TRY(present(frame, view));
    return {};
}

// Draws marks and panels, shows the window, and records.
Result<void> Viewer::present(const MadeFrame& frame, const View& view) {
    std::vector<PictureLine> lines;
    const LineProjector projector(view);
    if (dials_.bodies != BodyMarks())
        add_body_marks(shown_world(), needs(), dials_.bodies, projector, lines);
    if (live_.grabbed().is_valid())
        projector.add(live_.grip_world(), live_.hand_world(), {1.0f, 1.0f, 1.0f}, lines);
    ViewFacts facts;
    facts.frame = &frame.record;
    facts.draw_ms = draw_ms_;
    facts.wait_ms = wait_ms_;
    facts.memory_bytes = static_cast<std::size_t>(dials_.memory_mb * 0x1p20);
    facts.view = view;
    facts.altitude = altitude(view.eye_world).value_or(std::numeric_limits<double>::quiet_NaN());

    facts.lonlat = lonlat_text(view.eye_world);
    facts.picked = picked_;
    if (clock_ < note_until_) facts.note = note_;
    facts.live = &live_;
    facts.world = &shown_world();
    facts.resident = maker_.pager().resident();
    facts.path = path_points_;
    facts.lines = lines;
    overlay_ms_ = overlay_->draw(facts, dials_, timeline_);
    if (film_) {
        const Image image = renderer_.read();
        for (; film_ && film_time_ <= film_clock_; film_time_ += 1.0 / kFilmRate) {
            if (const Result<void> added = film_->add(image); !added) {
                film_.reset();
                say(added.error().message);
            }
        }
    }
    const Clock::time_point start = Clock::now();
    TERRANE_TRY(window_.show());
    wait_ms_ = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    draw_times_.push_back(draw_ms_);
    overlay_times_.push_back(overlay_ms_);
    ++totals_.frames;
    // a margin for the rounding of the height
    if (facts.altitude < -1e-3) ++totals_.below_ground;
    log_state(frame, view);
    return {};
}

void Viewer::log_state(const MadeFrame& frame, const View& view) {
    if (log_ == nullptr) return;
    const auto array = [](const Eigen::Vector3d& v) {
        return nlohmann::ordered_json::array({v.x(), v.y(), v.z()});
    };
    const FrameRecord& record = frame.record;
    constexpr std::array<const char*, 3> kBeings{"camera", "walker", "driver"};
    nlohmann::ordered_json state;
    state["frame"] = totals_.frames;
    state["clock"] = clock_;
    state["time"] = shown_time_;
    state["playing"] = timeline_.is_playing();
    state["rate"] = timeline_.rate();
    state["being"] = kBeings[static_cast<std::size_t>(live_.being())];
    state["waiting"] = live_.is_waiting();
    state["on_path"] = follows_path_;
    state["size"] = {view.width_px, view.height_px};
    state["eye"] = array(view.eye_world);
    state["forward"] = array(view.forward);
    const std::optional<double> height = altitude(view.eye_world);
    state["altitude"] = height ? nlohmann::ordered_json(*height) : nlohmann::ordered_json();
    if (live_.body().is_valid()) {
        const BodyState& body = live_.world().state(live_.body());
        state["body"] = {{"position", array(body.pose.translation)},
                         {"speed", body.velocity.norm()}};
    }
    state["bodies"] = shown_world().states().size();
    state["state_hash"] = fmt::format("{:016x}", shown_world().state_hash());
    state["step"] = history_.step_now();
    state["steps"] = history_.step_count();
    state["fell_through"] = live_.totals().fell_through;
    state["triangles"] = record.triangles;
    state["budget"] = record.budget;
    state["error_px"] = std::isfinite(record.error_px) ? nlohmann::ordered_json(record.error_px)
                                                       : nlohmann::ordered_json();
    state["late"] = record.paging.late_chunks;
    state["resident_bytes"] = record.paging.resident_bytes;
    state["ceiling_bytes"] = static_cast<std::size_t>(applied_.memory_mb * 0x1p20);
    state["substeps"] = live_.settings().substeps;
    state["contact_tolerance"] = live_.settings().contact_tolerance;
    state["latency_ms"] = applied_.latency_ms;
    state["bandwidth_mb"] = std::isfinite(applied_.bandwidth_mb)
                                ? nlohmann::ordered_json(applied_.bandwidth_mb)
                                : nlohmann::ordered_json();
    state["sun_deg"] = applied_.sun_deg;
    state["lights"] = nlohmann::ordered_json::array();
    for (const PlacedLight& light : applied_.lights) {
        const WorldPos& p = light.position_world;
        state["lights"].push_back({p.x(), p.y(), p.z(), light.strength});
    }
    state["colours"] = kGroundColourNames[static_cast<std::size_t>(applied_.colours)];
    state["waiting_digs"] = brush_ != nullptr ? brush_->waiting() : 0;
    state["update_ms"] = record.update_ms;
    state["draw_ms"] = draw_ms_;
    state["overlay_ms"] = overlay_ms_;
    state["gpu_ms"] = record.gpu_ms.value_or(0.0);
    state["covered"] = overlay_->covered_share();
    state["help"] = overlay_->help != Overlay::Help::none;
    state["clicks"] = click_count_;
    state["picked"] = picked_;
    state["note"] = note_;
    const std::string line = state.dump() + "\n";
    std::fwrite(line.data(), 1, line.size(), log_);
    std::fflush(log_);
}

CommandResult<void> Viewer::show_frames() {
    Clock::time_point last = Clock::now();
    while (!window_.is_closed() && !is_interrupted() && clock_ < settings_.seconds) {
        const Clock::time_point now = Clock::now();
        const double dt =
            std::min(std::chrono::duration<double>(now - last).count(), kLongestFrame);
        last = now;
        film_clock_ += dt;
        TERRANE_TRY(react(window_.take_input(), dt));
        TERRANE_TRY(make_frame(dt));
    }
    return {};
}

CommandResult<ViewTotals> Viewer::run() {
    watch_for_interrupts();
    const CommandResult<void> shown = show_frames();
    end_film();
    history_.finish(live_);
    TERRANE_TRY(shown);
    if (settings_.recorder != nullptr) TERRANE_TRY(seek(history_.step_count()));
    totals_.state_hash = live_.world().state_hash();
    totals_.bodies = live_.totals();
    totals_.draw_ms_median = median(draw_times_);
    totals_.overlay_ms_median = median(overlay_times_);
    return totals_;
}

}  // namespace terrane::tools
