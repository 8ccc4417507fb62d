// SPDX-License-Identifier: MIT
#pragma once

#include "frames/frame_maker.h"
#include "frames/paging_storage.h"
#include "program/command.h"
#include "program/options.h"
#include "scene/terrain_options.h"

#include <terrane/dem/dem_heights.h>
#include <terrane/playback/camera_path.h>
#include <terrane/playback/track.h>
#include <terrane/render/terrain_renderer.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::tools {

/// The conversion of longitudes and latitudes to the world of a terrain, or the reason why there is none.
TrackReference track_reference(const Terrain& terrain);

/// read_track() over a terrain. Prints the track's note.
Result<Track> open_track(const std::string& path, const Terrain& terrain);

/// CameraPath::create() for a track. An error of the setting `start` names its flag, --start-s.
Result<CameraPath> follow_track(Track track, const HeightSource& source,
                                const CameraPathSettings& settings);

/// What pictures show beside shapes and tints.
enum class Look {
    plain,  ///< ground in tints, still water, a sky and haze of fixed colours
    /// Ground in materials, waves; sky, haze and light by scattering in the air, smooth edges, penumbrae.
    full,
};

/// A value of --light.
struct LightPlace {
    WorldVec2 place = WorldVec2(0.0, 0.0);  ///< world, metres
    double height = 0.0;                    ///< above the ground without volumes and digs, metres
    double strength = 100.0;                ///< see PlacedLight
};

/// What triangulates frames with pictures.
enum class TriangulatorChoice {
    cpu,
    gpu,
    automatic,  ///< the GPU, unless the device is a software rasteriser
};

/// Options shared by `fly` and `drive`: terrain, pictures, limits and output.
struct FlightOptions {
    TerrainOptions terrain;
    std::string path;  ///< a track file, or the name of a built-in path
    double speed =
        std::numeric_limits<double>::quiet_NaN();  ///< m/s; NaN if not given, as the next two
    double altitude = std::numeric_limits<double>::quiet_NaN();
    double seconds = std::numeric_limits<double>::quiet_NaN();
    double fps = 30.0;
    ImageSize size;
    double fov_deg = 60.0;
    std::size_t samples = 0;  ///< per pixel; 0: not given
    /// Shadow distance, metres; 0: none; NaN if not given. See shadow_distance().
    double shadows = std::numeric_limits<double>::quiet_NaN();
    Look look = Look::plain;
    std::optional<WorldVec2> sun_deg =
        {};                ///< azimuth from world y, clockwise, and elevation of the sun, degrees
    std::string sun_time;  ///< for the sun's place; "" if not given
    std::vector<LightPlace> lights = {};
    std::optional<GroundPalette> ground = {};  ///< palette of the materials; absent: as the look
    /// Of the materials, metres; NaN if not given, as the next one.
    double snow_line = std::numeric_limits<double>::quiet_NaN();
    double water_m = std::numeric_limits<double>::quiet_NaN();  ///< level of water, metres
    std::size_t budget = 100'000;
    double max_error_px = 1.0;
    double morph_ratio = kDefaultMorphRatio;
    TriangulatorChoice triangulator = TriangulatorChoice::cpu;
    double memory_mb = 512.0;
    std::size_t threads = 1;
    PagingChoice policy = PagingChoice::deadline;
    double radius = 1.0;                                           ///< of PagingChoice::distance
    double latency_ms = std::numeric_limits<double>::quiet_NaN();  ///< of simulated storage; NaN if
                                                                   ///< not given, as the next one
    double bandwidth_mb = std::numeric_limits<double>::quiet_NaN();
    std::string out;             ///< a folder; "" for none
    bool shows_proxies = false;  ///< see BodyNodes
    bool png = false;
    bool video = false;
    bool verify = false;
    bool realtime = false;
    bool window = false;
    bool json = false;

    std::size_t memory_bytes() const { return static_cast<std::size_t>(memory_mb * 0x1p20); }
    bool has_slow_storage() const { return !std::isnan(latency_ms) || !std::isnan(bandwidth_mb); }
    bool has_pictures() const { return png || video || window; }
    /// `shadows` or, without it, 1 km with Look::full and 0 with Look::plain.
    double shadow_distance() const {
        constexpr double kUsual = 1000.0;
        return given(shadows).value_or(look == Look::full ? kUsual : 0.0);
    }
    bool has_materials() const { return look == Look::full || ground; }
    /// Whether frames are paced in real time.
    bool waits_for_clock() const { return realtime || window; }
};

/// Adds --size, --fov-deg, --samples, --shadows, --look, --sun-deg, --sun-time, --light, --ground, --snow-line-m,
/// --water-m and --show-proxies.
void add_look_options(CLI::App& app, FlightOptions& options);
/// Adds --budget, --max-error-px, --morph-ratio, --memory-mb and --threads.
void add_frame_options(CLI::App& app, FlightOptions& options);

/// Adds the flags of add_look_options(), --fps, --out, --png and --video.
///
/// @param what the kind of run in help texts: "flight"
void add_picture_options(CLI::App& app, FlightOptions& options, const std::string& what);

/// Adds all flags except --path, --speed, --altitude and --seconds, whose meanings differ between commands.
///
/// @param scene_parts see add_terrain_options()
void add_flight_options(CLI::App& app, FlightOptions& options,
                        std::initializer_list<const char*> scene_parts);

/// Adds --policy and --radius.
void add_paging_choice(CLI::App& app, PagingChoice& policy, double& radius);

/// Adds --latency-ms and --bandwidth-mb.
void add_storage_options(CLI::App& app, FlightOptions& options);

/// The speed of storage with a latency in milliseconds and a bandwidth in MB/s of 10^6 bytes.
StorageSpeed storage_speed(double latency_ms, double bandwidth_mb);
/// That of the options; fast where they are not given.
StorageSpeed storage_speed(const FlightOptions& options);

/// Fails with exit_usage for a name that is neither a built-in path nor a track file.
CommandResult<void> check_path(const std::string& name);

/// Sets the region and start of a built-in path from a terrain.
CameraPathSettings planned_in(const Terrain& terrain, CameraPathSettings settings);

/// Opens a built-in path or a track file. Fails as CameraPath and read_track().
Result<CameraPath> open_path(const std::string& name, const Terrain& terrain,
                             const CameraPathSettings& settings);

/// Seconds since 1970-01-01T00:00Z of a time in ISO 8601 with a date, a time to minutes or seconds, and Z or an offset:
/// 2026-06-21T14:30Z, 2026-06-21T16:30:00+02:00. Years 1900 to 2100. None for other text.
std::optional<double> parse_time(std::string_view text);

/// Fails with exit_usage for pictures without --out, films of odd sizes, --samples, --sun-deg or --sun-time out of
/// range, and flags of pictures without pictures.
CommandResult<void> check_pictures(const FlightOptions& options);

/// Fails with exit_usage for built-in paths that no vehicle can follow.
CommandResult<void> check_drivable(const std::string& path);
/// The built-in paths that vehicles can follow: "straight, orbit".
std::string drivable_paths();

/// Fails if --budget or --memory-mb is too small for the terrain's root squares: see terrain_options.h.
CommandResult<void> check_limits(const FlightOptions& options, const Terrain& terrain);

/// Checks combinations of options. Fails with exit_usage.
CommandResult<void> check(const FlightOptions& options);

/// Number of frames in a duration, at least one. Fails with exit_usage for more than 1e7.
CommandResult<std::size_t> count_frames(double fps, double seconds);

FrameMakerSettings frame_maker_settings(const FlightOptions& options);

/// A view with size and field of view set, and the default pose.
View make_view(const ImageSize& size, double fov_deg);
/// The view from the pose of a camera.
View view_at(View view, const CameraPose& pose);

}  // namespace terrane::tools
