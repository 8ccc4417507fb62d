// SPDX-License-Identifier: MIT
#pragma once

#include "view/live_world.h"

#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <vector>

namespace terrane::tools {

/// The past of a LiveWorld, to which it can return: what the user steered in each step, and the whole state at
/// intervals.
///
/// A state that was reached by seek() has the bits of the run. A stored state follows each step that the controls do
/// not explain: a body that was added or parked. Digs are not undone.
class LiveHistory {
public:
    /// @param most_bytes of stored states; beyond it the earliest are forgotten
    explicit LiveHistory(std::size_t most_bytes) : most_bytes_(most_bytes) {}

    /// Makes a step of the world, and remembers it. If the world is in the past, what followed is forgotten.
    ///
    /// @param is_changed whether anything but steering has changed the world since the last step
    ///
    /// Fails: as LiveWorld::step()
    Result<void> step(LiveWorld& world, const Ground& ground, bool is_changed);

    /// Brings the world to the state after a number of steps, first_step() to step_count().
    ///
    /// @param ground_of  called once, after the world has returned to a stored state: its bodies' ground
    /// @param is_changed as for step(); the change is undone then
    ///
    /// Fails: as LiveWorld::restore() and LiveWorld::step()
    /// Cost:  the steps since the stored state before, of at most kInterval steps
    Result<void> seek(std::size_t step, LiveWorld& world, const std::function<Ground()>& ground_of,
                      bool is_changed = false);

    /// Whether the world is in the past, so that seek() can go on.
    bool is_in_past() const { return now_ < step_count(); }
    /// Steps of the world before its present state.
    std::size_t step_now() const { return now_; }
    /// Earliest step that seek() reaches.
    std::size_t first_step() const { return states_.empty() ? now_ : states_.begin()->first; }
    /// Steps of the run, those after the present state included.
    std::size_t step_count() const { return first_input_ + inputs_.size(); }
    /// Bytes of the stored states.
    std::size_t bytes() const { return bytes_; }

    /// Steps between stored states; more if few states of their size fit.
    static constexpr std::size_t kInterval = 60;

private:
    std::size_t interval() const;
    void store(const LiveWorld& world);

    std::size_t most_bytes_;
    std::size_t bytes_ = 0;
    std::size_t now_ = 0;
    std::size_t first_input_ = 0;              // step of the first of inputs_
    std::deque<LiveInput> inputs_;             // of each step
    std::map<std::size_t, LiveState> states_;  // before the step of that number
};

}  // namespace terrane::tools
