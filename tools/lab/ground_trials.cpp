// SPDX-License-Identifier: MIT
#include "lab/ground_trials.h"

#include "lab/measure.h"
#include "program/geometry.h"
#include "scene/body_placement.h"
#include "scene/scene_bodies.h"

#include <terrane/terrain/pager.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

constexpr double kHalfWidth = 120.0;  // metres
constexpr double kAround = 60.0;      // metres, for bodies that roll out of the area

// Whether the true surface reaches into a sphere, according to samples on rings around its centre.
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

// The square that contains the bodies and queries of the dials, metres.
WorldRect trade_area(const Terrain& terrain) {
    const WorldRect& all = terrain.source->extent();
    const double x = 0.5 * (all.west + all.east), y = 0.5 * (all.south + all.north);
    return {std::max(all.west, x - kHalfWidth), std::max(all.south, y - kHalfWidth),
            std::min(all.east, x + kHalfWidth), std::min(all.north, y + kHalfWidth)};
}

}  // namespace

CommandResult<Ground> load_contact_ground(const Terrain& terrain, double contact_spacing) {
    TERRANE_TRY(Pager pager, Pager::create(terrain.source, {.memory_bytes = std::size_t{1} << 30U,
                                                            .worker_count = 0,
                                                            .contact_spacing = contact_spacing}));
    pager.update({}, {}, 0.0);
    const WorldRect area = trade_area(terrain);
    RequiredRegion required = pager.require(
        {area.west - kAround, area.south - kAround, area.east + kAround, area.north + kAround},
        0.0);
    pager.update({}, {}, 0.0);
    pager.finish();
    if (!required.is_ready()) return failure("the terrain's heights could not be read");
    return pager.ground();
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

namespace {

// Potential and kinetic energy of a sphere of radius 0.5 m and 1 kg, joules.
double energy_of(const BodyState& state) {
    constexpr double kGravity = 9.81, kInertia = 0.4 * 0.25;
    return kGravity * state.pose.translation.z() + 0.5 * state.velocity.squaredNorm() +
           0.5 * kInertia * state.angular_velocity.squaredNorm();
}

CommandResult<World> make_trial_world(const DropTrial& trial, const Ground& ground) {
    TERRANE_TRY(World world, World::create(trial.world));
    TERRANE_TRY(const World obstacles, World::create({}));
    std::vector<PlacedBody> bodies =
        lay_out({.shape = DropShape::sphere, .count = trial.count, .speed = trial.speed}, ground,
                obstacles);
    if (bodies.empty()) return failure("no body finds ground at the terrain's centre");
    for (PlacedBody& body : bodies) body.settings.contact_tolerance = trial.contact_tolerance;
    TERRANE_TRY(add_bodies(bodies, world));
    return world;
}

}  // namespace

CommandResult<DropFigures> run_drop_trial(const DropTrial& trial, const Ground& ground) {
    TERRANE_TRY(World world, make_trial_world(trial, ground));
    const auto steps =
        static_cast<std::size_t>(std::max(1.0, std::round(trial.seconds / trial.dt)));
    DropFigures figures;
    std::vector<double> energies;
    for (const BodyState& state : world.states()) energies.push_back(energy_of(state));
    double gained = 0.0, lost = 0.0;
    for (std::size_t step = 0; step < steps; ++step) {
        const Stopwatch wall(Clock::wall), thread(Clock::thread);
        const StepReport report = world.step(ground, trial.dt);
        figures.ms += thread.ms();
        figures.wall_ms += wall.ms();
        figures.max_depth_m = std::max(figures.max_depth_m, report.max_depth_m);
        figures.fell_through += static_cast<double>(report.too_deep);
        for (std::size_t i = 0; i < energies.size(); ++i) {
            const double after = energy_of(world.states()[i]);
            (after > energies[i] ? gained : lost) += std::abs(after - energies[i]);
            energies[i] = after;
        }
    }
    const double simulated = static_cast<double>(steps) * trial.dt;
    figures.ms /= simulated;
    figures.wall_ms /= simulated;
    figures.drift = ratio_or_zero(gained, lost);
    return figures;
}

}  // namespace terrane::tools
