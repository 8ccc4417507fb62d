// SPDX-License-Identifier: MIT
#pragma once

#include "flight/film.h"
#include "flight/flight_options.h"
#include "flight/pictures.h"
#include "flight/window.h"
#include "frames/frame_maker.h"
#include "program/command.h"
#include "query/object_picker.h"
#include "record/replay.h"
#include "record/run_bodies.h"
#include "scene/ground_editor.h"
#include "view/free_camera.h"
#include "view/live_history.h"
#include "view/live_world.h"
#include "view/overlay.h"
#include "view/timeline.h"

#include <terrane/dem/georeference.h>
#include <terrane/playback/camera_path.h>
#include <terrane/render/terrain_renderer.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane::tools {

/// Azimuth, clockwise from world y, -180 to 180, and elevation of a direction, degrees.
std::array<double, 2> degrees_of(const Eigen::Vector3d& direction);
/// ViewDials::sun_deg of a direction towards the sun: the azimuth is 0 to 360.
std::array<double, 2> sun_dials(const Eigen::Vector3d& direction);
/// The direction towards the sun of ViewDials::sun_deg.
Eigen::Vector3d sun_direction(const std::array<double, 2>& sun_deg);

/// Where a camera looks from, as the command line names it.
struct CameraPlace {
    WorldPos eye_world = WorldPos::Zero();
    double azimuth_deg = 0.0;    ///< clockwise from world y
    double elevation_deg = 0.0;  ///< above the horizon
};

/// Settings of a view besides those of its frames.
struct ViewerSettings {
    std::optional<CameraPath> path = {};  ///< that the timeline plays
    /// Of the terrain, that the timeline plays in place of a path; without both, the simulation.
    std::optional<RunRecord> record = {};
    Terrain recorded = {};  ///< the terrain of the record, with fast storage
    std::optional<CameraPlace> place =
        {};                       ///< absent: above the start, or the start of the playback
    Being being = Being::camera;  ///< at the start
    VehicleKind vehicle = VehicleKind::truck;
    bool waits_for_display = true;
    bool is_full_screen = false;
    bool shows_help = true;
    double seconds = std::numeric_limits<double>::infinity();  ///< after which the window closes
    std::string folder = ".";                                  ///< of pictures and films
    std::string state_log = {};  ///< file of a JSON line for each frame; "": none
    /// The command line that makes a view from a place, in a window of a size, with point lights.
    std::function<std::string(const CameraPlace& place, const ImageSize& size,
                              std::span<const PlacedLight> lights)>
        command_of;
    /// Of the terrain's source, still fast; slow as the options say once the view has begun. Not null.
    std::shared_ptr<SlowHeights> storage = {};
    std::string why_no_brush = {};  ///< if the user cannot dig, the message of a dig
    /// Records what the user does; null: none. Not together with `record`. Must outlive the viewer.
    RunRecorder* recorder = nullptr;
};

/// What a view counted.
struct ViewTotals {
    std::size_t frames = 0;
    LiveTotals bodies;
    std::uint64_t state_hash = 0;  ///< World::state_hash() at the end of the run
    std::size_t below_ground = 0;  ///< frames whose eye was below the ground
    double draw_ms_median = 0.0, overlay_ms_median = 0.0;
};

/// A window that flies, walks, drives, digs and plays.
class Viewer {
public:
    /// Opens the window. Fails with device_unavailable if there is no display; as FrameMaker::create(),
    /// TerrainRenderer::create(), make_object_field() and LiveWorld::create().
    ///
    /// @param terrain with the source of `brush`; must outlive the viewer
    /// @param brush   null: the ground does not change
    static CommandResult<std::unique_ptr<Viewer>> create(const FlightOptions& options,
                                                         const Terrain& terrain,
                                                         std::unique_ptr<GroundEditor> brush,
                                                         ViewerSettings settings);
    ~Viewer();

    /// Shows frames until the user closes the window, and passes the run to the recorder, also if it fails. Fails with
    /// device_unavailable if the display goes away; with io for files that cannot be written.
    CommandResult<ViewTotals> run();

    const std::string& renderer_name() const { return context_.renderer_name(); }

private:
    using Clock = std::chrono::steady_clock;
    static constexpr double kFilmRate = 30.0;  // frames a second
    /// What is at a point of the picture.
    struct Pick {
        WorldPos point_world = WorldPos::Zero();
        BodyId body{};
        bool is_ground = false;
        std::vector<std::string> lines;
    };

    /// A shadow that the user moves: what casts it, and the height of the plane on which it falls.
    struct HeldShadow {
        WorldPos caster_world = WorldPos::Zero();
        double height = 0.0;
    };

    Viewer(const FlightOptions& options, const Terrain& terrain,
           std::unique_ptr<GroundEditor> brush, ViewerSettings settings, Window window,
           GlContext context, TerrainRenderer renderer, FrameMaker maker, LiveWorld live);

    // viewer.cpp
    CommandResult<void> open_playback();
    CommandResult<void> begin();
    Result<void> play();
    CameraPose played_pose() const;
    bool has_playback() const { return settings_.path || replay_ || !poses_.empty(); }
    const World& shown_world() const { return replay_ ? replay_->world() : live_.world(); }
    std::span<const BodyNeed> needs();
    CommandResult<void> show_frames();
    CommandResult<void> make_frame(double dt);
    Result<void> simulate(double seconds);
    Result<void> follow_timeline();
    Result<void> seek(std::size_t step);
    Result<Ground> ground_with(std::span<const GroundEdit> edits);
    Ground load_ground();
    Result<void> present(const MadeFrame& frame, const View& view);
    Result<void> follow_window_size();
    Result<void> follow_dials();
    WorldPos stopped(const WorldPos& from_world, const WorldPos& to_world) const;
    void lift_eye();
    std::optional<double> altitude(const WorldPos& eye_world) const;
    std::optional<std::array<double, 2>> sun_at(double hour) const;
    bool follows_body() const;
    CameraPose pose_now() const;
    View view_now() const;
    CameraPlace place_now() const;
    void say(std::string note);
    void log_state(const MadeFrame& frame, const View& view);

    // viewer_input.cpp
    Result<void> react(const WindowInput& input, double dt);
    Result<void> react_to_key(const WindowInput::Press& key);
    void leave_path();
    void leave_body();
    void go(const CameraPose& pose);
    void react_to_button(const WindowInput::Press& button);
    void steer(const WindowInput& input, double dt);
    CameraControls camera_controls(const WindowInput& input, double dt) const;
    void change_being();
    const TerrainMesh& host_mesh();
    std::optional<Pick> pick(double x_px, double y_px);
    std::vector<std::string> chunk_lines(const WorldPos& p_world);
    void place_light();
    void remove_light();
    void hold_shadow();
    void drag_shadow();
    std::string lonlat_text(const WorldPos& p_world) const;
    bool can_dig();
    void dig(bool fills);
    void undo_dig();
    void take_picture();
    void toggle_film();
    void end_film();
    std::string free_name(const std::string& ending) const;

    FlightOptions options_;
    const Terrain& terrain_;
    std::unique_ptr<GroundEditor> brush_;
    ViewerSettings settings_;
    Window window_;  // whose context the renderer draws in
    GlContext context_;
    TerrainRenderer renderer_;
    std::optional<GpuTriangulator> triangulator_;  // none: the maker's own
    FrameMaker maker_;
    LiveWorld live_;
    LiveHistory history_;
    bool is_steering_ = false;  // whether the user steers a walker or vehicle, or pulls a body
    std::optional<BodyNodes> nodes_;
    std::unique_ptr<Overlay> overlay_;
    mutable std::optional<ObjectPicker> picker_;  // absent without objects
    std::optional<Georeference> georeference_;
    double day_ = 0.0;  // of the sun, seconds since 1970-01-01T00:00Z

    View picture_;  // size and field of view
    FreeCamera camera_{CameraPose{}};
    CameraPose home_;
    std::map<int, CameraPose> bookmarks_;
    Timeline timeline_;
    std::optional<Replay> replay_;  // of a run with bodies
    std::optional<ReplayBodies> replay_bodies_;
    std::vector<CameraPose> poses_;  // of a recorded flight
    double frame_rate_ = 30.0;       // of single steps, and of a recorded flight
    std::vector<WorldPos> path_points_;
    bool follows_path_ = false;  // whether the camera is that of the playback
    std::vector<BodyNeed> needs_;
    ViewDials dials_, applied_;
    TerrainMesh mesh_;          // of the last frame, valid until the next; see host_mesh()
    double clock_ = 0.0;        // the pager's, seconds
    double shown_time_ = 0.0;   // of the last frame; panels may have moved the timeline since
    double unsimulated_ = 0.0;  // seconds of playback not simulated yet, less than a step
    WindowInput input_;
    double last_click_ = -1.0;  // clock of the last left click
    std::optional<HeldShadow> held_shadow_;
    double grab_distance_ = 0.0;  // from the eye to a grabbed body, metres
    std::vector<std::string> picked_;
    std::size_t click_count_ = 0;
    std::string note_;
    double note_until_ = 0.0;
    double draw_ms_ = 0.0, wait_ms_ = 0.0, overlay_ms_ = 0.0;
    std::vector<double> draw_times_, overlay_times_;
    ViewTotals totals_;
    std::optional<Film> film_;
    double film_time_ = 0.0;   // of the film's next frame, seconds
    double film_clock_ = 0.0;  // since the film began, seconds
    std::FILE* log_ = nullptr;
};

}  // namespace terrane::tools
