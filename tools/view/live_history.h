// SPDX-License-Identifier: MIT
#pragma once

#include "record/ground_log.h"
#include "record/run_record.h"
#include "view/live_world.h"

#include <terrane/playback/camera_path.h>

#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <span>
#include <vector>

namespace terrane::tools {

/// The past of a LiveWorld, to which it can return: what the user steered in each step, the whole state at intervals,
/// the edits of the ground, and the camera of each step.
///
/// A state that was reached by seek() has the bits of the run. A state is stored after each step that the controls do
/// not explain: a body that was added or parked, or ground that was changed.
///
/// A recorder receives what can no longer change: steps that are forgotten, and all others at the end.
class LiveHistory {
public:
    /// @param most_bytes of stored states and steps; beyond it the earliest are forgotten
    /// @param recorder   null: the run is not recorded
    explicit LiveHistory(std::size_t most_bytes, RunRecorder* recorder = nullptr)
        : most_bytes_(most_bytes), recorder_(recorder) {}

    /// The user has changed the world, by anything but steering. If it is in the past, what followed is forgotten.
    void change(const LiveWorld& world);
    /// The same for the ground, which now has these edits.
    void change_ground(const LiveWorld& world, std::span<const GroundEdit> edits);

    /// Makes a step of the world, and remembers it. If the world is in the past, what followed is forgotten.
    ///
    /// Fails: as LiveWorld::step()
    Result<void> step(LiveWorld& world, const Ground& ground);

    /// The camera that shows the present state, and all states before it that have none yet.
    void show(const CameraPose& camera);

    /// The ground of a step with these edits, under the bodies of the world as it is.
    using GroundOf = std::function<Result<Ground>(std::span<const GroundEdit> edits)>;
    /// Brings the world to the state after a number of steps, first_step() to step_count().
    ///
    /// @param ground_of called once, after the world has returned to a stored state
    ///
    /// Fails: as LiveWorld::restore(), LiveWorld::step() and ground_of()
    /// Cost:  the steps since the stored state before, of at most kInterval steps
    Result<void> seek(std::size_t step, LiveWorld& world, const GroundOf& ground_of);

    /// Passes the run, as far as it is not forgotten, to the recorder.
    ///
    /// @param world in its last state
    void finish(const LiveWorld& world);

    /// Whether the world is in the past, so that seek() can go on.
    bool is_in_past() const { return now_ < step_count(); }
    /// Steps of the world before its present state.
    std::size_t step_now() const { return now_; }
    /// Earliest step that seek() reaches.
    std::size_t first_step() const { return states_.empty() ? now_ : states_.begin()->first; }
    /// Steps of the run, those after the present state included.
    std::size_t step_count() const { return first_ + steps_.size(); }
    /// Bytes of the stored states and steps.
    std::size_t bytes() const { return state_bytes_ + steps_.size() * sizeof(Step); }

    /// Steps between stored states; more if few states of their size fit.
    static constexpr std::size_t kInterval = 60;

private:
    struct Step {
        LiveInput input;
        CameraPose camera;  // of the state after it
    };
    struct Stored {
        LiveState state;
        bool is_explained = false;  // by the steps before it
    };

    std::size_t interval() const;
    void forget_future();
    void store(const LiveWorld& world, bool is_explained);
    void forget_first();
    CameraPose& camera_of(std::size_t step);
    void record_frame(std::size_t step);
    void record_steps(const Stored& from, std::size_t first, std::size_t end);

    std::size_t most_bytes_;
    RunRecorder* recorder_;
    std::size_t state_bytes_ = 0;
    std::size_t now_ = 0;
    std::size_t first_ = 0;                 // of steps_
    std::deque<Step> steps_;                // of the run
    CameraPose first_camera_;               // of the state before steps_
    std::size_t shown_ = 0;                 // states that have their camera
    std::map<std::size_t, Stored> states_;  // before the step of that number
    GroundLog ground_;
};

}  // namespace terrane::tools
