// SPDX-License-Identifier: MIT
#include "view/live_history.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace terrane::tools {

std::size_t LiveHistory::interval() const {
    constexpr std::size_t kLeastStates = 16;  // that fit
    if (states_.empty()) return kInterval;
    const std::size_t size = states_.rbegin()->second.state.world.size();
    return kInterval * (1 + kLeastStates * size / std::max<std::size_t>(most_bytes_, 1));
}

// The camera of the state before a step.
CameraPose& LiveHistory::camera_of(std::size_t step) {
    return step == first_ ? first_camera_ : steps_[step - first_ - 1].camera;
}

void LiveHistory::forget_future() {
    steps_.resize(now_ - first_);
    shown_ = std::min(shown_, now_ + 1);
    ground_.forget_after(now_);
    for (auto later = states_.upper_bound(now_); later != states_.end();) {
        state_bytes_ -= later->second.state.world.size();
        later = states_.erase(later);
    }
}

// Stores the present state, which no later one follows.
void LiveHistory::store(const LiveWorld& world, bool is_explained) {
    Stored& stored = states_[now_];
    state_bytes_ -= stored.state.world.size();
    stored = {world.save(), is_explained};
    state_bytes_ += stored.state.world.size();
}

// Forgets the first stored state, and the steps up to the next one.
void LiveHistory::forget_first() {
    const auto first = states_.begin();
    const std::size_t end = std::next(first)->first;
    record_steps(first->second, first->first, end);
    first_camera_ = camera_of(end);
    steps_.erase(steps_.begin(), steps_.begin() + static_cast<std::ptrdiff_t>(end - first_));
    first_ = end;
    state_bytes_ -= first->second.state.world.size();
    states_.erase(first);
}

void LiveHistory::change(const LiveWorld& world) {
    forget_future();
    store(world, false);
}

void LiveHistory::change_ground(const LiveWorld& world, std::span<const GroundEdit> edits) {
    change(world);
    ground_.set(now_, edits);
}

Result<void> LiveHistory::step(LiveWorld& world, const Ground& ground) {
    forget_future();
    if (states_.empty() || now_ >= states_.rbegin()->first + interval()) store(world, true);
    steps_.push_back({.input = world.input(), .camera = {}});
    const bool was_waiting = world.is_waiting();
    TERRANE_TRY(world.step(ground));
    ++now_;
    // what a step does without its ground depends on when that arrives
    if (world.last().parked > 0 || was_waiting) store(world, false);
    while (bytes() > most_bytes_ && states_.size() > 1) forget_first();
    return {};
}

void LiveHistory::show(const CameraPose& camera) {
    for (; shown_ <= step_count(); ++shown_) {
        if (shown_ >= first_) camera_of(shown_) = camera;
    }
}

Result<void> LiveHistory::seek(std::size_t step, LiveWorld& world, const GroundOf& ground_of) {
    step = std::clamp(step, first_step(), step_count());
    auto from = states_.upper_bound(step);
    if (from == states_.begin() || now_ == step) return {};
    from = std::prev(from);
    if (now_ > step || from->first > now_) {
        TERRANE_TRY(world.restore(from->second.state));
        now_ = from->first;
    }
    // neither the ground nor the world changes by more than steps before the next stored state
    TERRANE_TRY(const Ground ground, ground_of(ground_.at(now_)));
    for (; now_ < step; ++now_) {
        world.set_input(steps_[now_ - first_].input);
        TERRANE_TRY(world.step(ground));
    }
    return {};
}

// Passes the frame that shows the state before a step.
void LiveHistory::record_frame(std::size_t step) {
    const auto stored = states_.find(step);
    if (stored == states_.end() || !recorder_->needs_state()) {
        recorder_->add_frame();
        return;
    }
    const LiveState& state = stored->second.state;
    const auto camera = numbers_of(camera_of(step));
    recorder_->add_frame({state.world, {camera.begin(), camera.end()}, state.gait, state.last},
                         hash_of_state(state.world_hash, camera, state.gait));
}

// Passes steps, each with the frame before it.
//
// @param from the stored state before the first of them
void LiveHistory::record_steps(const Stored& from, std::size_t first, std::size_t end) {
    if (recorder_ == nullptr) return;
    for (std::size_t step = first; step < end; ++step) {
        record_frame(step);
        recorder_->add_step(
            actions_of(steps_[step - first_].input, from.state.being, from.state.body));
        const auto after = states_.find(step + 1);
        if (after != states_.end() && !after->second.is_explained)
            recorder_->amend(after->second.state.world, after->second.state.gait);
        recorder_->amend(numbers_of(camera_of(step + 1)));
    }
}

void LiveHistory::finish(const LiveWorld& world) {
    if (recorder_ == nullptr) return;
    if (states_.empty()) store(world, true);
    for (auto state = states_.begin(); state != states_.end(); ++state) {
        const auto next = std::next(state);
        record_steps(state->second, state->first,
                     next == states_.end() ? step_count() : next->first);
    }
    record_frame(step_count());
    recorder_->ground() = ground_;
}

}  // namespace terrane::tools
