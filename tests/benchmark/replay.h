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

/// What a replayed flight was found to be.
struct ReplayReport {
    int frames = 0;   ///< replayed
    int checked = 0;  ///< of them looked at
    std::size_t points = 0;
    int over_budget = 0;
    int flawed = 0;          ///< not watertight, or not the triangles of a bisection
    int not_reproduced = 0;  ///< another mesh than from scratch, or than in the timed flight
    int uncertified = 0;     ///< measured above error_px
    std::size_t pops =
        0;  ///< points that moved by more than 0.5 px where that is promised not to be
    double worst_ratio = 0.0;    ///< largest measured error over the frame's error_px
    double worst_pop_px = 0.0;   ///< where movement is bounded
    int bounded_frames = 0;      ///< frames where it is: error_px at most 1.5, before and after
    double worst_move_px = 0.0;  ///< elsewhere
    std::string first_fault;     ///< in words

    int violations() const {
        return over_budget + flawed + not_reproduced + uncertified + (pops > 0 ? 1 : 0);
    }
};

struct ReplaySettings {
    int check_every = 1;  ///< one frame of so many is looked at, and its predecessor for movement
    int points = 10'000;  ///< of the ground in view, each frame
    std::uint64_t seed = 1;
};

/// Plays the frames of a flight again, untimed, and checks P1 to P4 by other means than those that
/// made them: budget, watertight, certified error, movement, and the same bits from scratch.
ReplayReport replay(const BenchmarkGround& ground, const TriangulatorSettings& settings,
                    const std::vector<FlightFrame>& frames, const ReplaySettings& how);

}  // namespace terrane::bench
