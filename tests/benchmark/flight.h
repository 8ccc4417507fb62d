// SPDX-License-Identifier: MIT
#pragma once

#include "machine.h"
#include "references/reference_maps.h"

#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace terrane::bench {

/// Ground to fly over.
struct BenchmarkGround {
    std::string name;
    std::shared_ptr<const HeightSource> source;
    std::shared_ptr<const test::TableHeights> table;  ///< the same source, where it is a table
    double start_x = 0.0, start_y = 0.0;              ///< of flights, metres
    double far_m = 0.0;  ///< how far ground is looked at where points are measured
};

/// An fBm map with 1 m between its samples.
BenchmarkGround make_map_ground(int side);

/// A fractal of 2097 km a side, 12.5 cm between its finest samples.
BenchmarkGround make_fractal_ground();

/// 100 m/s at 60 frames a second, about 100 m over smoothed ground, looking 10 degrees down at 1920
/// x 1080 and 60 degrees; `turning` frames at the end of which the heading turns 90 degrees a
/// second.
struct FlightPlan {
    int straight_frames = 300;
    int turning_frames = 180;
    int frames() const { return straight_frames + turning_frames; }
    bool is_turning(int frame) const { return frame >= straight_frames; }
};
View flight_view(const BenchmarkGround& ground, const FlightPlan& plan, int frame);

/// What one frame was asked for, and what came out.
struct FlightFrame {
    View view;
    std::shared_ptr<const ResidentSet> resident;
    double ms = 0.0;  ///< Triangulator::update() alone
    std::size_t triangles = 0;
    double error_px = 0.0;
};

/// Settings of a run that fills its budget.
TriangulatorSettings settings_for(std::size_t triangles, int threads);

/// Plays a flight: loads what each frame wants before it is timed, within `memory_bytes`.
std::vector<FlightFrame> fly(const BenchmarkGround& ground, const FlightPlan& plan,
                             const TriangulatorSettings& settings, std::size_t memory_bytes,
                             Clock clock);

/// Loads for a view until its mesh wants nothing that is absent. Coarse errors first: so a target
/// that is out of reach does not load the world.
TerrainMesh settle(Pager& pager, Triangulator& triangulator, const View& view, double time_s);

}  // namespace terrane::bench
