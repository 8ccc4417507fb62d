// SPDX-License-Identifier: MIT
#pragma once

#include "commands/travellers.h"
#include "flight/cameras.h"
#include "flight/flight_options.h"
#include "flight/flight_output.h"
#include "program/command.h"
#include "program/geometry.h"
#include "record/run_bodies.h"
#include "record/run_record.h"
#include "scene/body_placement.h"
#include "scene/scene_bodies.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace terrane::tools {

/// Path, speed and duration of a drive or walk.
struct DrivePlan {
    Polyline path;       ///< points at least 1 m apart
    double speed = 0.0;  ///< to keep, m/s
    std::size_t frame_count = 0;
};

/// The plan for a camera path or track, projected onto the horizontal plane. Fails with exit_usage for too many frames;
/// with exit_failed for paths that jump, have no two points 1 m apart, start or lead where no ground is, or cannot
/// be read.
///
/// @param usual_speed speed if neither the options nor a track's times give one, m/s
/// @param limits      max_slope, max_bump and bump_reach: of the ground under built-in paths
CommandResult<DrivePlan> make_drive_plan(const FlightOptions& options, const Terrain& terrain,
                                         double usual_speed, const CameraPathSettings& limits);

/// Columns of frames.csv that all journeys have, and their values.
std::vector<std::string> journey_columns();
std::vector<double> journey_figures(const BodyState& traveller, const StepFigures& last);

/// Sums and maxima over the steps of a journey.
struct JourneyTotals {
    double distance_m = 0.0;   // excluding free fall outside the world
    double max_depth_m = 0.0;  // of any body
    std::uint64_t fell_through =
        0;  // body steps that ended deeper in the ground than the tolerance
    std::uint64_t steps = 0;
    std::uint64_t airborne = 0;  // steps in which the traveller stands on nothing
    std::uint64_t parked = 0;    // body steps without resident ground
    std::uint64_t left_world = 0;
    double simulated_time = 0.0, lost_time = 0.0;
    std::size_t crates_touched = 0;  // each crate counts once
};

/// A traveller, crates and the bodies of a scene in one world, with a camera behind the traveller.
class Journey {
public:
    /// All arguments except the camera's settings must outlive the journey.
    ///
    /// @param crate_count crates on and beside the path
    static CommandResult<Journey> create(const FlightOptions& options, const Terrain& terrain,
                                         const DrivePlan& plan, std::size_t crate_count,
                                         const ChaseCameraSettings& camera, Traveller& traveller);

    /// Columns of frames.csv.
    static std::vector<std::string> columns(const Traveller& traveller);

    /// Loads the first ground, places the traveller and the crates on it, simulates 1.5 s until they rest, adds the
    /// bodies of the scene, and plays the frames.
    ///
    /// @param recorder null: the journey is not recorded
    CommandResult<void> play(FrameMaker& maker, FlightOutput& output, BodyNodes& nodes,
                             RunRecorder* recorder);

    /// What a record of the journey says about its bodies, steps and camera.
    RunSettings run_settings(RunKind kind) const;
    /// World::state_hash() after the last step.
    std::uint64_t state_hash() const { return world_.state_hash(); }

    const JourneyTotals& totals() const { return totals_; }

private:
    Journey(const FlightOptions& options, const Terrain& terrain, const DrivePlan& plan,
            std::size_t crate_count, const ChaseCameraSettings& camera, Traveller& traveller,
            ObjectBodies scene_objects, World world, World obstacles);

    CommandResult<void> put_down(const Ground& ground);
    Ground ground_of(const FrameMaker& maker) const;
    double frame_time() const { return 1.0 / options_.fps; }
    int steps_in_frame() const;
    CommandResult<void> advance(const Ground& ground, RunRecorder* recorder);
    void step(const Ground& ground, double dt);
    StepFigures figures() const { return figures_of(last_); }
    void count_touched();
    Result<void> show(BodyNodes& nodes) const;

    const FlightOptions& options_;
    const Terrain& terrain_;
    const DrivePlan& plan_;
    Traveller& traveller_;
    ChaseCameraSettings camera_settings_;
    CrateLayout crates_;
    World world_;
    ObjectBodies scene_objects_;
    World obstacles_;  // only the bodies of the scene and its static objects
    std::optional<ChaseCamera> camera_;
    BodyId body_{};
    std::vector<std::uint8_t>
        touched_;  // by body index: 0 not a crate, 1 a crate, 2 a touched crate
    JourneyTotals totals_;
    StepReport last_;
    std::vector<BodyId> supports_;
};

/// The summary's keys common to drives and walks.
nlohmann::ordered_json summarize(const PathProgress& progress);
nlohmann::ordered_json summarize(const JourneyTotals& totals);

}  // namespace terrane::tools
