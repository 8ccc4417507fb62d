// SPDX-License-Identifier: MIT
#pragma once

#include "flight/flight_options.h"
#include "options/command.h"
#include "world/polyline.h"

#include <cstddef>

namespace terrane::tools {

/// Path, speed and duration of a drive or walk.
struct DrivePlan {
    Polyline path;       ///< points at least 1 m apart
    double speed = 0.0;  ///< to keep, m/s
    std::size_t frame_count = 0;
};

/// The plan for a camera path or track projected to the plane. Fails with exit_usage for too many frames; with
/// exit_failed for paths that jump, are shorter than 2 m, or cannot be read.
///
/// @param usual_speed m/s, where neither the options nor a track's times give one
CommandResult<DrivePlan> make_drive_plan(const FlightOptions& options, const Terrain& terrain,
                                         double usual_speed);

}  // namespace terrane::tools
