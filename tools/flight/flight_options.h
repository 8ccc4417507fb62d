// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"
#include "frames/frame_maker.h"
#include "source/paging_choice.h"
#include "options/option_values.h"
#include "source/terrain_options.h"
#include "camera/camera_path.h"

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
    std::size_t samples = 0;  ///< a pixel; 0: not given
    std::size_t budget = 100'000;
    double max_error_px = 1.0;
    double morph_ratio = kDefaultMorphRatio;
    double memory_mb = 512.0;
    std::size_t threads = 1;
    PagingChoice policy = PagingChoice::deadline;
    double radius = 1.0;  ///< of PagingChoice::distance
    std::string out;      ///< a folder; "" for none
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

/// Adds --fps, --size, --fov-deg, --samples, --out, --png and --video.
///
/// @param what makes the frames: "flight"
void add_picture_options(CLI::App& app, FlightOptions& options, const std::string& what);

/// Adds all of them but --path, --speed, --altitude and --seconds, whose meanings differ.
void add_flight_options(CLI::App& app, FlightOptions& options);

/// Adds --policy and --radius.
void add_paging_choice(CLI::App& app, PagingChoice& policy, double& radius);

/// Refuses what is neither a built-in path nor looks like a track file. Fails with exit_usage.
CommandResult<void> check_path(const std::string& name);

/// A built-in path over a terrain, or that of a track file. Fails as CameraPath and read_track() do.
Result<CameraPath> open_path(const std::string& name, const Terrain& terrain,
                             const CameraPathSettings& settings);

/// Refuses pictures without a folder, films of odd sizes, and samples without pictures or out of range.
/// Fails with exit_usage.
CommandResult<void> check_pictures(const FlightOptions& options);

/// Refuses built-in paths that no vehicle can follow. Fails with exit_usage.
CommandResult<void> check_drivable(const std::string& path);
/// The built-in paths that vehicles can follow: "straight, orbit".
std::string drivable_paths();

/// Refuses a budget and a ceiling that the terrain's root squares do not fit into: see limits.h.
CommandResult<void> check_limits(const FlightOptions& options, const Terrain& terrain);

/// Refuses what no single option shows to be wrong. Fails with exit_usage.
CommandResult<void> check(const FlightOptions& options);

/// Frames that a length of time has; at least one. Fails with exit_usage where they are too many.
CommandResult<std::size_t> count_frames(double fps, double seconds);

FrameMakerSettings frame_maker_settings(const FlightOptions& options);

/// A view of a picture, from no place yet.
View make_view(const ImageSize& size, double fov_deg);
/// The same view from where a camera is.
View view_at(View view, const CameraPose& pose);

}  // namespace terrane::tools
