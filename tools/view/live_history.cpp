// SPDX-License-Identifier: MIT
#include "view/live_history.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace terrane::tools {

std::size_t LiveHistory::interval() const {
    constexpr std::size_t kLeastStates = 16;  // that fit
    if (states_.empty()) return kInterval;
    const std::size_t size = states_.rbegin()->second.world.size();
    return kInterval * (1 + kLeastStates * size / std::max<std::size_t>(most_bytes_, 1));
}

void LiveHistory::store(const LiveWorld& world) {
    LiveState state = world.save();
    bytes_ += state.world.size();
    const auto [entry, is_new] = states_.try_emplace(now_);
    bytes_ -= entry->second.world.size();
    entry->second = std::move(state);
    while (bytes_ > most_bytes_ && states_.size() > 1) {
        bytes_ -= states_.begin()->second.world.size();
        states_.erase(states_.begin());
        while (first_input_ < states_.begin()->first) {
            inputs_.pop_front();
            ++first_input_;
        }
    }
}

Result<void> LiveHistory::step(LiveWorld& world, const Ground& ground, bool is_changed) {
    while (step_count() > now_) inputs_.pop_back();
    for (auto later = states_.upper_bound(now_); later != states_.end();) {
        bytes_ -= later->second.world.size();
        later = states_.erase(later);
    }
    const bool is_due = states_.empty() || now_ >= states_.rbegin()->first + interval();
    if (is_changed || is_due) store(world);
    inputs_.push_back(world.input());
    const bool was_waiting = world.is_waiting();
    TERRANE_TRY(world.step(ground));
    ++now_;
    // what a step does without its ground depends on when that arrives
    if (world.last().parked > 0 || was_waiting) store(world);
    return {};
}

Result<void> LiveHistory::seek(std::size_t step, LiveWorld& world,
                               const std::function<Ground()>& ground_of, bool is_changed) {
    step = std::clamp(step, first_step(), step_count());
    auto from = states_.upper_bound(step);
    if (from == states_.begin()) return {};
    from = std::prev(from);
    if (is_changed || now_ > step || from->first > now_) {
        TERRANE_TRY(world.restore(from->second));
        now_ = from->first;
    }
    if (now_ == step) return {};
    const Ground ground = ground_of();
    while (now_ < step) {
        world.set_input(inputs_[now_ - first_input_]);
        TERRANE_TRY(world.step(ground));
        ++now_;
        // in the run the step may have found other ground
        const auto stored = states_.find(now_);
        if (stored != states_.end()) TERRANE_TRY(world.restore(stored->second));
    }
    return {};
}

}  // namespace terrane::tools
