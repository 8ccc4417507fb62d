// SPDX-License-Identifier: MIT
#include "lab/ground_trials.h"

#include "flight/flight_options.h"
#include "frames/frame_maker.h"
#include "frames/verification.h"
#include "lab/dial.h"
#include "program/geometry.h"
#include "program/progress.h"
#include "scene/body_placement.h"
#include "scene/scene_bodies.h"

#include <terrane/playback/camera_path.h>
#include <terrane/terrain/pager.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

constexpr double kHalfWidth = 120.0;  // metres
constexpr double kAround = 60.0;      // metres, for bodies that roll out of the area

// Whether the true surface reaches into a sphere: samples on rings below it.
bool reaches_into(const HeightSource& source, const WorldPos& centre, double radius) {
    constexpr int kRings = 6, kSpokes = 12;
    for (int ring = 0; ring <= kRings; ++ring) {
        const double r = radius * ring / kRings;
        for (int spoke = 0; spoke < kSpokes; ++spoke) {
            const double angle = 2.0 * 3.14159265358979323846 * spoke / kSpokes;
            const double x = r * std::cos(angle), y = r * std::sin(angle);
            const double up = source.height(centre.x() + x, centre.y() + y) - centre.z();
            // the ground is solid below its surface
            if (up >= -std::sqrt(std::max(0.0, radius * radius - r * r))) return true;
        }
    }
    return false;
}

}  // namespace

WorldRect trade_area(const Terrain& terrain) {
    const WorldRect& all = terrain.source->extent();
    const double x = 0.5 * (all.west + all.east), y = 0.5 * (all.south + all.north);
    return {std::max(all.west, x - kHalfWidth), std::max(all.south, y - kHalfWidth),
            std::min(all.east, x + kHalfWidth), std::min(all.north, y + kHalfWidth)};
}

CommandResult<Ground> load_contact_ground(const Terrain& terrain, double contact_spacing) {
    Result<Pager> pager = Pager::create(terrain.source, {.memory_bytes = std::size_t{1} << 30U,
                                                         .worker_count = 0,
                                                         .contact_spacing = contact_spacing});
    if (!pager) return pass_on(pager.error());
    pager->update({}, {}, 0.0);
    const WorldRect area = trade_area(terrain);
    RequiredRegion required = pager->require(
        {area.west - kAround, area.south - kAround, area.east + kAround, area.north + kAround},
        0.0);
    pager->update({}, {}, 0.0);
    pager->finish();
    if (!required.is_ready()) return failure("the terrain's heights could not be read");
    return pager->ground();
}

std::vector<ProbePose> probe_poses(const Terrain& terrain, const Sphere& sphere,
                                   std::size_t count) {
    constexpr std::size_t kTries = 4;
    const WorldRect area = trade_area(terrain);
    BodyRandom random(11, 0);
    std::vector<ProbePose> poses;
    for (std::size_t i = 0; i < kTries * count && poses.size() < count; ++i) {
        const double x = random.within(area.west, area.east);
        const double y = random.within(area.south, area.north);
        const double above = random.within(-0.4, 0.4) * sphere.radius;
        const double height = terrain.source->height(x, y);
        if (!std::isfinite(height)) continue;
        ProbePose probe;
        probe.pose.translation = {x, y, height + sphere.radius + above};
        probe.touches = reaches_into(*terrain.source, probe.pose.translation, sphere.radius);
        poses.push_back(probe);
    }
    return poses;
}

double disorder_share(const std::vector<double>& keys, const std::vector<double>& order) {
    std::size_t pairs = 0, unlike = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
        for (std::size_t k = i + 1; k < order.size(); ++k) {
            if (order[i] == order[k]) continue;
            ++pairs;
            const bool is_alike = order[i] < order[k] ? keys[i] < keys[k] : keys[i] > keys[k];
            if (!is_alike) ++unlike;
        }
    }
    return pairs > 0 ? static_cast<double>(unlike) / static_cast<double>(pairs) : 0.0;
}

namespace {

// Potential and kinetic energy of a sphere of radius 0.5 m and 1 kg, joules.
double energy_of(const BodyState& state) {
    constexpr double kGravity = 9.81, kInertia = 0.4 * 0.25;
    return kGravity * state.pose.translation.z() + 0.5 * state.velocity.squaredNorm() +
           0.5 * kInertia * state.angular_velocity.squaredNorm();
}

CommandResult<World> make_trial_world(const DropTrial& trial, const Ground& ground) {
    Result<World> world = World::create(trial.world);
    if (!world) return pass_on(world.error());
    const Result<World> obstacles = World::create({});
    if (!obstacles) return pass_on(obstacles.error());
    std::vector<PlacedBody> bodies =
        lay_out({.shape = DropShape::sphere, .count = trial.count, .speed = trial.speed}, ground,
                *obstacles);
    if (bodies.empty()) return failure("no body finds ground at the terrain's centre");
    for (PlacedBody& body : bodies) body.settings.contact_tolerance = trial.contact_tolerance;
    const Result<std::vector<BodyId>> added = add_bodies(bodies, *world);
    if (!added) return pass_on(added.error());
    return std::move(*world);
}

}  // namespace

CommandResult<DropFigures> run_drop_trial(const DropTrial& trial, const Ground& ground) {
    using Clock = std::chrono::steady_clock;
    CommandResult<World> world = make_trial_world(trial, ground);
    if (!world) return pass_on(world.error());
    const auto steps =
        static_cast<std::size_t>(std::max(1.0, std::round(trial.seconds / trial.dt)));
    DropFigures figures;
    std::vector<double> energies;
    for (const BodyState& state : world->states()) energies.push_back(energy_of(state));
    double gained = 0.0, lost = 0.0, taken_s = 0.0;
    Clock::duration taken{};
    for (std::size_t step = 0; step < steps; ++step) {
        const Clock::time_point start = Clock::now();
        const double start_s = thread_seconds();
        const StepReport report = world->step(ground, trial.dt);
        taken_s += thread_seconds() - start_s;
        taken += Clock::now() - start;
        figures.max_depth_m = std::max(figures.max_depth_m, report.max_depth_m);
        figures.fell_through += static_cast<double>(report.too_deep);
        for (std::size_t i = 0; i < energies.size(); ++i) {
            const double after = energy_of(world->states()[i]);
            (after > energies[i] ? gained : lost) += std::abs(after - energies[i]);
            energies[i] = after;
        }
    }
    const double simulated = static_cast<double>(steps) * trial.dt;
    figures.ms = 1e3 * taken_s / simulated;
    figures.wall_ms = std::chrono::duration<double, std::milli>(taken).count() / simulated;
    figures.drift = lost > 0.0 ? gained / lost : 0.0;
    return figures;
}

namespace {

constexpr double kFlightSeconds = 10.0;
// Closer to the ground the finest spacing determines the error, whatever the settings.
constexpr double kLeastAltitude = 150.0, kAltitudeInSpacings = 40.0;
constexpr double kFrame_s = 1.0 / 30.0;
// Finest settings of any dial, which determine the chunks to load.
constexpr std::size_t kMostBudget = 1'000'000, kMostQuickBudget = 300'000;
constexpr double kLeastError_px = 0.5;

double elapsed_ms(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

}  // namespace

CommandResult<std::shared_ptr<FlightGround>> FlightGround::create(const TradePlace& place) {
    const HeightSource& source = *place.terrain->source;
    const double altitude =
        std::max(kLeastAltitude, kAltitudeInSpacings * source.lattice().spacing);
    const Result<CameraPath> path = CameraPath::create(
        "straight", source, {.speed = 100.0, .altitude = altitude, .seconds = kFlightSeconds});
    if (!path) return pass_on(path.error());
    FrameMakerSettings settings;
    settings.pager.memory_bytes = std::size_t{2} << 30U;
    settings.pager.worker_count = 0;
    settings.triangulator.triangle_budget = place.is_quick ? kMostQuickBudget : kMostBudget;
    settings.triangulator.max_error_px = kLeastError_px;
    Result<FrameMaker> maker = FrameMaker::create(place.terrain->source, settings);
    if (!maker) return pass_on(maker.error());
    std::shared_ptr<FlightGround> ground(new FlightGround(place.terrain->source));
    const View picture = make_view({}, 60.0);
    const int moment_count = place.is_quick ? 2 : 6;
    for (int i = 0; i < moment_count; ++i) {
        if (is_interrupted()) return failure("interrupted before the tables were whole");
        const double time = kFlightSeconds * i / moment_count;
        Moment moment{.view = view_at(picture, path->at(time)),
                      .next = view_at(picture, path->at(time + kFrame_s)),
                      .resident = nullptr};
        maker->load_until_stable(moment.view, {}, time);
        moment.resident = maker->pager().resident();
        ground->moments_.push_back(std::move(moment));
    }
    ground->verified_moments_ = place.is_quick ? 1 : 2;
    ground->open_device(place.is_quick);
    return ground;
}

void FlightGround::open_device(bool is_quick) {
    Result<EglContext> context = EglContext::create();
    // a software rasteriser takes seconds for the largest meshes
    if (!context || (is_quick && context->is_software())) return;
    RendererSettings settings;
    if (context->is_software()) settings.sample_count = 1;
    const View& view = moments_.front().view;
    Result<TerrainRenderer> renderer =
        TerrainRenderer::create(*context, view.width_px, view.height_px, settings);
    if (!renderer) return;
    device_ = std::make_unique<Device>(Device{std::move(*context), std::move(*renderer)});
}

Result<double> FlightGround::draw(const TerrainMesh& mesh, const View& view) {
    if (device_ == nullptr) return std::numeric_limits<double>::quiet_NaN();
    device_->context.make_current();
    const auto start = std::chrono::steady_clock::now();
    const Result<void> drawn = device_->renderer.draw(mesh, view);
    if (!drawn) return tl::unexpected(drawn.error());
    device_->renderer.read();
    return elapsed_ms(start);
}

Result<FlightFigures> FlightGround::fly(const TriangulatorSettings& settings) {
    Result<Triangulator> triangulator = Triangulator::create(*source_, settings);
    if (!triangulator) return tl::unexpected(triangulator.error());
    FlightFigures figures;
    std::vector<double> update_ms;
    for (const Moment& moment : moments_) {
        for (const View& view : {moment.view, moment.next}) {
            const double start = thread_seconds();
            const TerrainMesh mesh = triangulator->update(moment.resident, view);
            update_ms.push_back(1e3 * (thread_seconds() - start));
            figures.error_px = std::max(figures.error_px, mesh.error_px);
            figures.triangles += static_cast<double>(mesh.triangle_count);
            if (update_ms.size() != 1) continue;
            const Result<double> draw_ms = draw(mesh, view);
            if (!draw_ms) return tl::unexpected(draw_ms.error());
            figures.draw_ms = *draw_ms;
        }
    }
    figures.triangles /= static_cast<double>(update_ms.size());
    figures.update_ms = percentile(update_ms, 0.5);
    return figures;
}

Result<FlightTruth> FlightGround::verify(const TriangulatorSettings& settings) const {
    constexpr std::size_t kPoints = 20'000;
    Result<Triangulator> triangulator = Triangulator::create(*source_, settings);
    if (!triangulator) return tl::unexpected(triangulator.error());
    FlightTruth truth;
    for (std::size_t i = 0; i < verified_moments_; ++i) {
        const Moment& moment = moments_[i];
        Verifier verifier(*source_, kPoints);
        for (const View& view : {moment.view, moment.next}) {
            const TerrainMesh mesh = triangulator->update(moment.resident, view);
            const Measurement measured = verifier.measure(mesh, view);
            truth.error_px = std::max(truth.error_px, measured.error_px);
            truth.max_pop_px =
                std::max({truth.max_pop_px, measured.max_pop_px, measured.max_pop_elsewhere_px});
        }
    }
    return truth;
}

}  // namespace terrane::tools
