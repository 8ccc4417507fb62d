// SPDX-License-Identifier: MIT
#pragma once

#include "flight.h"

#include <cstdint>
#include <string>

namespace terrane::bench {

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
