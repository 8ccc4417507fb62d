// SPDX-License-Identifier: MIT
#pragma once

#include "flight/cameras.h"
#include "record/run_record.h"
#include "scene/body_placement.h"
#include "scene/ground_editor.h"
#include "scene/terrain_options.h"

#include <terrane/collision/world.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/view.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane::tools {

/// Plays a recorded run with bodies: the world, the camera and the gait of a frame have the bits of the run, whether
/// the frames before were played or sought over. It loads the ground that bodies and camera need before each step.
///
/// Threads: one at a time
class Replay {
public:
    /// Opens the first frame, and loads the ground under all bodies.
    ///
    /// @param terrain      the record's, see RunRecord::check_terrain(). Digs of the run change the replay's own
    ///                     copy, but not this one
    /// @param memory_bytes ceiling of the chunks under bodies
    ///
    /// Fails: as seek(), GroundEditor::create(), Pager::create() and ObjectBodies::create()
    static Result<Replay> create(RunRecord record, const Terrain& terrain,
                                 std::size_t memory_bytes);

    /// Goes to a frame, 0 to frame_count() - 1.
    ///
    /// Fails: as advance()
    /// Cost:  the steps since the stored state before the frame, of at most five seconds, unless the current frame is
    ///        between them; and the digs that are done or undone
    Result<void> seek(std::size_t frame);
    /// Goes to the next frame; requires that there is one.
    ///
    /// Fails: bad_data if the replay differs from the run, or a block of the record is invalid; io if the record cannot
    ///        be read; as GroundEditor::set_edits() and GroundEditor::finish()
    Result<void> advance();
    /// From the last frame, makes the steps of the run after it. Then world() is that at the end of the run. Call
    /// seek() before the next advance().
    ///
    /// Fails: as advance()
    Result<void> finish();

    const RunRecord& record() const { return record_; }
    std::size_t frame() const { return frame_; }
    /// Seconds from the start of the run to the current frame.
    double time() const { return static_cast<double>(frame_) / record_.settings().fps; }
    /// Number of steps before the current frame.
    std::size_t step_count() const { return step_count_; }

    /// The world of the current frame. Only queries and World::needs() may be called.
    World& world() { return world_; }
    const World& world() const { return world_; }
    /// Figures of the last step before the current frame.
    const StepFigures& figures() const { return figures_; }
    /// The gait of the character.
    const CharacterGait& gait() const { return gait_; }
    /// The edits of the ground in the current frame.
    std::span<const GroundEdit> ground_edits() const { return ground_edits_; }
    /// `view` with the position and orientation of the run's camera.
    View view(const View& view) const;
    /// Mean velocity of the eye during the last step, m/s.
    const Eigen::Vector3d& camera_velocity() const;

private:
    Replay(RunRecord record, Terrain terrain, std::unique_ptr<GroundEditor> editor, Pager pager,
           ObjectBodies objects, World world);

    bool is_drop() const { return record_.settings().kind == RunKind::drop; }
    bool is_view() const { return record_.settings().kind == RunKind::view; }
    Pose target_pose() const;
    Result<void> enter(std::size_t block);
    Result<void> load(std::span<const std::byte> world);
    Result<void> set_camera(std::span<const double> state);
    std::vector<double> camera_state() const;
    Result<void> check_start(std::size_t block) const;
    Result<Aabb> change_ground();
    Ground load_ground();
    Result<void> step(const RunStep& step);

    RunRecord record_;
    Terrain terrain_;
    std::unique_ptr<GroundEditor> editor_;  // null: no digs
    std::vector<GroundEdit> ground_edits_;
    std::uint64_t next_change_ = GroundLog::kNever;  // step
    Pager pager_;
    ObjectBodies objects_;
    World world_;
    std::optional<ChaseCamera> chase_camera_;  // of drives and walks
    std::optional<DropCamera> drop_camera_;
    CameraPose pose_;  // of the camera of a view
    CharacterGait gait_;
    StepFigures figures_;
    RunBlock block_;
    std::size_t block_index_ = 0;
    std::size_t frame_ = 0;
    std::size_t steps_in_block_ = 0;     // made
    std::uint32_t frames_of_state_ = 0;  // that were shown since the last step
    std::size_t step_count_ = 0;
    bool is_finished_ = false;  // by finish()
    double clock_ = 0.0;        // of the pager, seconds; never goes back
    std::vector<BodyNeed> needs_;
};

}  // namespace terrane::tools
