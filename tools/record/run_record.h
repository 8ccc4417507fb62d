// SPDX-License-Identifier: MIT
#pragma once

#include "flight/cameras.h"
#include "program/progress.h"
#include "record/ground_log.h"
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
    /// In which it faces, unit; zero: it turns towards its velocity, see CharacterGait::follow().
    WorldVec2 heading = WorldVec2::Zero();
};

/// Pulls a point of a body to a place by a damped spring, in the next step.
struct PullBody {
    BodyId body;
    WorldPos grip_body = WorldPos::Zero();  ///< in the frame of the body
    WorldPos hand_world = WorldPos::Zero();
};

/// What acts on a world before a step.
using RunAction = std::variant<DriveVehicle, WalkCharacter, PullBody>;

/// Fails: as World::set_controls() and World::add_force(); invalid_argument for a body that is not in the world
Result<void> apply(const RunAction& action, World& world);
/// The gait of a character follows a step of dt seconds in which it walked.
void advance_gait(const WalkCharacter& walk, const CharacterState& state, double dt,
                  CharacterGait& gait);

/// Kinds of recorded runs. A flight has no bodies; the bodies of a view are those of its user.
enum class RunKind { flight, drive, walk, drop, view };

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
    double dig_spacing = 0.0;          ///< TerrainOptions::dig_spacing, metres; 0: none
};

/// Figures of the last step that frames show.
struct StepFigures {
    std::uint64_t awake = 0, touching_pairs = 0;
    double max_depth_m = 0.0;
};
StepFigures figures_of(const StepReport& report);

/// Everything that a run carries from one frame to the next.
struct RunState {
    std::vector<std::byte> world;  ///< World::save()
    std::vector<double> camera;    ///< state() of a ChaseCamera or DropCamera, numbers_of() a pose
    CharacterGait gait;            ///< of the character
    StepFigures last;
};

/// The numbers of a pose: the state of the camera of a view.
inline constexpr std::size_t kPoseNumbers = 12;
CameraState<kPoseNumbers> numbers_of(const CameraPose& pose);
CameraPose pose_of(const CameraState<kPoseNumbers>& numbers);

/// A hash of the states of bodies, camera and gait: equal for the run and its replay.
///
/// @param world_hash World::state_hash()
std::uint64_t hash_of_state(std::uint64_t world_hash, std::span<const double> camera,
                            const CharacterGait& gait);

/// One step of a world, and what followed it.
struct RunStep {
    std::vector<RunAction> actions = {};  ///< applied before the step
    /// World::save() after the step, if something beside the step changed the world or the step depended on ground
    /// that was late; otherwise empty.
    std::vector<std::byte> world = {};
    CharacterGait gait = {};  ///< after the step, if `world` is not empty
    /// The state of the camera after the step, if that does not follow from the world; otherwise empty. All cameras of
    /// a run have as many numbers.
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
/// they apply, and add_frame() for each frame that shows the state after it. For a flight only add_pose(). ground() has
/// the digs of the run.
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
    ///
    /// @param world World::save()
    void amend(std::vector<std::byte> world, const CharacterGait& gait);
    /// Amends the last step: its camera does not follow from the world alone.
    void amend(std::span<const double> camera);
    /// Adds a frame that shows the current state. At intervals it stores that state.
    ///
    /// Cost: nothing, but once in five seconds of the run World::save() and the compression of the last block
    void add_frame(const World& world, std::span<const double> camera, const CharacterGait& gait,
                   const StepFigures& last);
    /// The same where the state may be stored already: add_frame() without a state, unless needs_state().
    ///
    /// @param state_hash hash_of_state() of the state
    void add_frame(RunState state, std::uint64_t state_hash);
    void add_frame();
    /// Whether the next frame should have the state: the first, and one in five seconds of the run.
    bool needs_state() const;
    /// Adds a frame of a flight.
    void add_pose(const CameraPose& pose);

    /// Completes the file. Fails: io, naming the path
    Result<void> commit();

    const std::string& path() const { return path_; }
    std::size_t step_count() const { return step_count_; }
    GroundLog& ground() { return ground_; }

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
    GroundLog ground_;
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
    const GroundLog& ground() const { return ground_; }
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
    GroundLog ground_;
    std::size_t frame_count_ = 0, step_count_ = 0;
};

}  // namespace terrane::tools
