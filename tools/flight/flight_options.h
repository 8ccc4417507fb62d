// SPDX-License-Identifier: MIT
#pragma once

#include "command.h"
#include "options/option_values.h"
#include "options/terrain_options.h"

#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/view.h>

#include <cstddef>
#include <limits>
#include <string>

namespace terrane::tools {

/// What `fly` and `drive` have in common: the terrain, the picture, the limits, and where it all
/// goes.
struct FlightOptions {
    TerrainOptions terrain;
    std::string path;                                         ///< a track file or a built-in
    double speed = std::numeric_limits<double>::quiet_NaN();  ///< NaN: not given; the same below
    double altitude = std::numeric_limits<double>::quiet_NaN();
    double seconds = std::numeric_limits<double>::quiet_NaN();
    double fps = 30.0;
    ImageSize size;
    double fov_deg = 60.0;
    std::size_t budget = 100'000;
    double max_error_px = 1.0;
    double morph_ratio = kDefaultMorphRatio;
    double memory_mb = 512.0;
    std::size_t threads = 1;
    std::string out;  ///< a folder; "" for none
    bool png = false;
    bool video = false;
    bool verify = false;
    bool realtime = false;
    bool window = false;
    bool json = false;

    std::size_t memory_bytes() const { return static_cast<std::size_t>(memory_mb * 0x1p20); }
    bool has_pictures() const { return png || video || window; }
    /// Whether frames wait for the clock: somebody watches, or asked for it.
    bool waits_for_clock() const { return realtime || window; }
};

/// Adds all of them but --path, --speed, --altitude and --seconds, whose meanings differ.
void add_flight_options(CLI::App& app, FlightOptions& options);

/// Refuses what no single option shows to be wrong. Fails with exit_usage.
CommandResult<void> check(const FlightOptions& options);

/// Frames that a length of time has; at least one. Fails with exit_usage where they are too many.
CommandResult<std::size_t> count_frames(const FlightOptions& options, double seconds);

/// A view of the picture that the options ask for, from no place yet.
View make_view(const FlightOptions& options);

}  // namespace terrane::tools
