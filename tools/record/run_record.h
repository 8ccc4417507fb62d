// SPDX-License-Identifier: MIT
#pragma once

#include "flight/cameras.h"
#include "program/progress.h"
#include "scene/body_forms.h"
#include "scene/terrain_options.h"

#include <terrane/collision/vehicle.h>
#include <terrane/collision/world.h>
#include <terrane/playback/camera_path.h>
#include <terrane/store/sealed_file.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace terrane::tools {

/// Sets the controls of a vehicle from the next step on.
struct DriveVehicle {
    BodyId vehicle;
    VehicleControls controls;
};

/// Sets the controls of a character from the next step on.
struct WalkCharacter {
    BodyId character;
    CharacterControls controls;
};

/// What acts on a world before a step.
using RunAction = std::variant<DriveVehicle, WalkCharacter>;

/// Fails: as World::set_controls()
Result<void> apply(const RunAction& action, World& world);

/// Kinds of recorded runs. A flight has no bodies.
enum class RunKind { flight, drive, walk, drop };

/// The subcommand that makes runs of a kind: "drive".
std::string name_of(RunKind kind);

/// Identifies a terrain by samples of its heights.
struct TerrainIdentity {
    std::string name = {};  ///< Terrain::name
    std::string
        hash;  ///< of lattice, extent, heights at 256 points, and numbers of bodies and objects
};
TerrainIdentity identify(const Terrain& terrain);

/// What a run consists of, beside its steps and frames.
struct RunSettings {
    RunKind kind = RunKind::flight;
    std::vector<std::string> terrain_flags =
        {};  ///< of the command line: they open the terrain again
    TerrainIdentity terrain = {};
    double fps = 30.0;                 ///< frames a second
    double dt = 0.0;                   ///< length of a step, seconds; 0 for a flight
    double contact_spacing = 0.0;      ///< PagerSettings::contact_spacing of the bodies, metres
    ChaseCameraSettings camera = {};   ///< of a drive or walk
    BodyId traveller = {};             ///< the vehicle or character of a drive or walk
    std::size_t crate_count = 0;       ///< of a drive or walk; their indices follow the traveller's
    std::size_t first_scene_body = 0;  ///< index in the world, of a drop
    std::string mesh_file = {};        ///< shown for all bodies of the first one's shape; "": none
    double mesh_scale = 1.0;           ///< of the mesh file's points
};

/// Figures of the last step that frames show.
struct StepFigures {
    std::uint64_t awake = 0, touching_pairs = 0;
    double max_depth_m = 0.0;
};

/// Everything that a run carries from one frame to the next.
struct RunState {
    std::vector<std::byte> world;  ///< World::save()
    std::vector<double> camera;    ///< state() of a ChaseCamera or DropCamera
    CharacterGait gait;            ///< of a walk
    StepFigures last;
};

/// A hash of the states of bodies, camera and gait: equal for the run and its replay.
std::uint64_t hash_of_state(const World& world, std::span<const double> camera,
                            const CharacterGait& gait);

/// One step of a world, and what followed it.
struct RunStep {
    std::vector<RunAction> actions = {};  ///< applied before the step
    /// World::save() after the step, if something beside the step changed the world or the step depended on ground
    /// that was late; otherwise empty.
    std::vector<std::byte> world = {};
    /// The state of the camera after the step, if that depended on ground that was late; otherwise empty.
    std::vector<double> camera = {};
    std::uint32_t frame_count = 0;  ///< frames that show the state after the step
};

/// A part of a run, which can be played without the parts before it.
struct RunBlock {
    RunState start;
    std::uint32_t start_frame_count = 1;  ///< frames that show the start
    std::vector<RunStep> steps;
};

/// Records a run in a file, which appears when it is complete (SealedWriter). docs/records.md describes the format.
///
/// For a run with bodies: add_frame() for the start; then for each step add_step(), the functions that amend it where
/// they apply, and add_frame() for each frame that shows the state after it. For a flight only add_pose().
///
/// Errors while writing are kept, and reported by commit().
class RunRecorder {
public:
    /// Fails: io, naming the path
    static Result<RunRecorder> create(const std::string& path, RunSettings settings);

    /// Sets RunSettings::traveller, which a run knows once the body is in its world.
    void set_traveller(BodyId traveller) { settings_.traveller = traveller; }
    /// Adds a step of RunSettings::dt seconds.
    void add_step(std::vector<RunAction> actions);
    /// Amends the last step: its world does not follow from the actions alone.
    void amend(const World& world);
    /// Amends the last step: its camera does not follow from the world alone.
    void amend(std::span<const double> camera);
    /// Adds a frame that shows the current state. At intervals it stores that state.
    ///
    /// Cost: nothing, but once in five seconds of the run World::save() and the compression of the last block
    void add_frame(const World& world, std::span<const double> camera, const CharacterGait& gait,
                   const StepFigures& last);
    /// Adds a frame of a flight.
    void add_pose(const CameraPose& pose);

    /// Completes the file. Fails: io, naming the path
    Result<void> commit();

    const std::string& path() const { return path_; }

private:
    struct StoredBlock {
        std::uint64_t offset = 0, stored_bytes = 0, content_bytes = 0;
        ContentHash hash;  // of the stored bytes
        std::uint64_t first_frame = 0, first_step = 0;
        std::uint64_t state_hash = 0;
    };
    friend class RunRecord;

    RunRecorder(std::string path, SealedWriter writer, RunSettings settings);
    void end_block();

    std::string path_;
    SealedWriter writer_;
    std::unique_ptr<RemovedIfKilled> if_killed_;
    RunSettings settings_;
    Result<void> written_;
    std::vector<StoredBlock> blocks_;
    std::uint64_t frame_count_ = 0, step_count_ = 0;
    std::uint64_t block_frame_ = 0, block_step_ = 0, block_hash_ = 0;  // of the open block's start
    std::optional<RunBlock> block_;                                    // open
    std::vector<CameraPose> poses_;                                    // of the open block
};

/// A recorded run, open for reading.
class RunRecord {
public:
    /// Opens a record and checks all of it.
    ///
    /// Fails: io; bad_data, naming the path, for a file that is no record, is truncated or damaged, or has another
    ///        version
    static Result<RunRecord> open(const std::string& path);

    const std::string& path() const { return file_.path(); }
    const RunSettings& settings() const { return settings_; }
    std::size_t frame_count() const { return frame_count_; }  ///< at least 1
    std::size_t step_count() const { return step_count_; }
    /// The last frame at or before a time, seconds from the start; the first or last one for times outside the run.
    std::size_t frame_at(double time) const;

    std::size_t block_count() const { return blocks_.size(); }
    /// Index of the first frame of a block.
    std::size_t first_frame(std::size_t block) const { return blocks_[block].first_frame; }
    /// Number of steps before a block.
    std::size_t first_step(std::size_t block) const { return blocks_[block].first_step; }
    /// hash_of_state() at the start of a block.
    std::uint64_t state_hash(std::size_t block) const { return blocks_[block].state_hash; }
    /// The block that has a frame.
    std::size_t block_of(std::size_t frame) const;

    /// Reads a block of a run with bodies. Fails: io; bad_data
    Result<RunBlock> read(std::size_t block) const;
    /// Reads the frames of a flight. Fails: io; bad_data
    Result<std::vector<CameraPose>> read_poses() const;

    /// Fails with invalid_argument, naming record and terrain, if the run was over another terrain.
    Result<void> check_terrain(const Terrain& terrain) const;

private:
    explicit RunRecord(SealedReader file) : file_(std::move(file)) {}
    Result<void> read_directory();
    Result<std::vector<std::uint8_t>> content(std::size_t block) const;

    SealedReader file_;
    RunSettings settings_;
    std::vector<RunRecorder::StoredBlock> blocks_;
    std::size_t frame_count_ = 0, step_count_ = 0;
};

}  // namespace terrane::tools
