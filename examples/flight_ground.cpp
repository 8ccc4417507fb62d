// SPDX-License-Identifier: MIT
// The ground below an aircraft, found in two ways: by earth-centred position, as JSBSim asks an FGGroundCallback, and
// by a probe in a local frame with y up, as in X-Plane. The aircraft flies a circle around 47 N, 8 E.
#include "motion_trace.h"

#include <terrane/adapters/jsbsim_ground.h>
#include <terrane/adapters/terrain_probe.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/terrain.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

int main(int argc, char** argv) {
    using namespace terrane;
    MotionTrace trace(argc, argv);
    const auto source = FractalHeights::create({.seed = 7, .finest_spacing_log2 = 3}).value();
    Terrain terrain = Terrain::create(source, {.paging = {.worker_count = 0}}).value();
    const double degree = std::numbers::pi / 180.0;
    adapters::JsbsimGroundSettings settings;
    settings.earth = {.latitude = 47.0 * degree,
                      .longitude = 8.0 * degree,
                      .mapping = adapters::EarthMapping::plate_carree};
    adapters::AircraftGround ground = adapters::AircraftGround::create(settings).value();
    adapters::TerrainProbe probe = adapters::TerrainProbe::create({}).value();

    double lowest_ft = 1e9, largest_difference = 0.0;
    for (int step = 0; step < 200; ++step) {
        // Earth-centred and world position of the aircraft; requests the ground around the point below it.
        const double angle = 2.0 * std::numbers::pi * step / 200.0;
        const Eigen::Vector3d p_earth =
            ground.earth().earth_from_geodetic({(47.0 + 0.05 * std::sin(angle)) * degree,
                                                (8.0 + 0.05 * std::cos(angle)) * degree, 2500.0});
        const WorldPos p_world =
            ground.earth().world_from_earth(p_earth).value_or(WorldPos::Zero());
        const WorldPos on_ground(p_world.x(), p_world.y(),
                                 source->height(p_world.x(), p_world.y()));
        const BodyNeed need{.centre_world = on_ground, .radius = 50.0};
        const Ground& now = terrain.update({}, {&need, 1}, step * 0.5).ground;
        ground.set_ground(now);
        probe.set_ground(now);
        probe.set_origin(WorldPos(p_world.x(), p_world.y(), 0.0));

        const adapters::AircraftGround::Answer below = ground.ask(p_earth);
        trace.add("aircraft", step * 0.5, p_world, p_world.z() - below.height_above_ground);
        lowest_ft = std::min(lowest_ft, below.height_above_ground / adapters::kMetresPerFoot);
        const auto hit = probe.probe(Eigen::Vector3d(0.0, p_world.z(), 0.0));
        largest_difference = std::max(largest_difference, std::abs(p_world.z() - hit.location.y() -
                                                                   below.height_above_ground));
    }
    std::printf(
        "lowest %.0f ft above ground; the two ways differ by %.1e m; %llu without ground\n",
        lowest_ft, largest_difference,
        static_cast<unsigned long long>(ground.counts().failed() + probe.counts().failed()));
    return ground.counts().failed() == 0 && largest_difference < 1e-6 ? 0 : 1;
}
