// SPDX-License-Identifier: MIT
//
// The half of the pager that acts: what is loaded next, what is given up, and what arrives.
#include "paging/pager_state.h"

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

using internal::ChunkTree;
using internal::NeedClass;
using internal::Orphan;
using internal::Room;
using internal::Wish;

// Loads are handed out for so long, and at least so many for each slot: enough to keep them busy
// between two updates, few enough to change the order.
constexpr double kQueued_s = 0.1;
constexpr std::size_t kLeastQueued = 2;
constexpr std::size_t kMostQueued = 32;
// What is drawn is loaded so long before it must be.
constexpr double kDrawnAhead_s = 0.8;
// Of what is read so much may be for nothing.
constexpr double kSpeculationShare = 0.14;
// A load under way that nobody needs any more is given up after so long, and an orphan dropped.
constexpr double kPatience_s = 0.2;

}  // namespace

// False where its parent is not there.
bool Pager::State::insert(std::shared_ptr<const Chunk> chunk, std::size_t bytes_read) {
    const ChunkKey key = chunk->key;
    if (key.level > 0) {
        const ChunkTree::Index parent = tree.find(key.parent());
        if (parent == ChunkTree::kNone) return false;
        needs.learn(*chunk, tree[parent].bounds[static_cast<std::size_t>(key.quadrant())]);
    }
    come.push_back(chunk);
    tree[tree.insert(std::move(chunk))].bytes_read = bytes_read;
    ++stats.loaded;
    return true;
}

void Pager::State::take_in(FinishedLoad& load) {
    if (may_jump) load.bytes_read = 0;
    stats.bytes_read += load.bytes_read;
    begun.erase(load.key);
    if (!load.chunk) {
        switch (load.chunk.error().code) {
            case ErrorCode::cancelled:
                break;
            case ErrorCode::timed_out:
                ++stats.timed_out;
                [[fallthrough]];
            default:
                ++stats.failed;
                last_failure = load.chunk.error().message;
                retries.failed(load.key, time_s);
        }
        return;
    }
    retries.succeeded(load.key);
    times.take(load.key.level, load.seconds);
    if (!insert(*load.chunk, load.bytes_read)) {
        orphans[load.key] = {std::move(*load.chunk), load.bytes_read, time_s};
    }
}

bool Pager::State::take_finished() {
    std::vector<FinishedLoad> finished = loader->take_finished();
    std::stable_sort(
        finished.begin(), finished.end(),
        [](const FinishedLoad& a, const FinishedLoad& b) { return a.key.level < b.key.level; });
    for (FinishedLoad& load : finished) take_in(load);
    adopt_orphans();
    return !finished.empty();
}

// Coarse ones first: one may be another's parent.
void Pager::State::adopt_orphans() {
    if (orphans.empty()) return;
    std::vector<ChunkKey> keys;
    for (const auto& [key, orphan] : orphans) keys.push_back(key);
    std::stable_sort(keys.begin(), keys.end(),
                     [](const ChunkKey& a, const ChunkKey& b) { return a.level < b.level; });
    for (const ChunkKey& key : keys) {
        const Orphan& orphan = orphans[key];
        const bool has_parent = begun.contains(key.parent()) || orphans.contains(key.parent());
        if (insert(orphan.chunk, orphan.bytes_read) ||
            (!has_parent && time_s - orphan.arrived_s > kPatience_s)) {
            orphans.erase(key);
        }
    }
}

// Gives up loads that nobody has needed for a while.
void Pager::State::give_up() {
    for (auto& [key, load] : begun) load.is_needed = false;
    for (const Wish& wish : needs.wishes()) {
        if (const auto found = begun.find(wish.key); found != begun.end()) {
            found->second.is_needed = true;
            found->second.is_speculation = wish.need.why == NeedClass::speculation;
        }
    }
    for (auto& [key, load] : begun) {
        if (load.is_needed) {
            load.unneeded_since_s = time_s;
        } else if (!load.is_cancelled && time_s - load.unneeded_since_s > kPatience_s) {
            load.is_cancelled = true;
            ++stats.cancelled;
            loader->cancel(key);
        }
    }
}

bool Pager::State::may_begin(const Wish& wish, double arrival_s) const {
    const ChunkKey& key = wish.key;
    if (begun.contains(key) || orphans.contains(key) || gone_in_finish.contains(key)) return false;
    if (retries.must_wait(key, time_s)) return false;
    if (settings.policy == PagingPolicy::distance || waits_for_all() || clock_stands) return true;
    return wish.need.end_s >= arrival_s;
}

// What is drawn later need not be loaded now, unless all that is to come could not be loaded in time
// then: the less of what is foreseen is loaded, the less comes to nothing.
void Pager::State::postpone() {
    if (settings.policy == PagingPolicy::distance) return;
    double least_s = std::numeric_limits<double>::infinity();
    std::vector<Wish>& wishes = needs.wishes();
    for (auto wish = wishes.rbegin(); wish != wishes.rend(); ++wish) {
        if (wish->need.why != NeedClass::drawn) continue;
        const double each_s = times.expected_s(wish->key.level) / loader->slots();
        least_s = std::min(wish->slack_s, least_s - each_s);
        wish->can_wait = least_s > kDrawnAhead_s;
    }
}

// Whether another chunk may be read that may come to nothing.
bool Pager::State::may_speculate(std::size_t under_way) const {
    const std::uint64_t idle = stats.bytes_read - stats.bytes_used -
                               std::min(stats.bytes_awaited, stats.bytes_read - stats.bytes_used);
    const auto may_be_idle = static_cast<double>(idle + (under_way + 1) * Chunk::max_bytes());
    return may_be_idle <= kSpeculationShare * static_cast<double>(stats.bytes_read);
}

// False where nothing is under way any more, and nothing more can be.
bool Pager::State::queue_loads() {
    // nothing begins between here and the new queue: what is admitted below stays within the ceiling
    std::vector<LoadRequest> old = loader->take_queue();
    std::vector<ChunkKey> old_keys;
    for (const LoadRequest& request : old) {
        old_keys.push_back(request.key);
        begun.erase(request.key);
    }
    give_up();

    const auto slots = static_cast<std::size_t>(loader->slots());
    const double load_s = times.expected_s(contact_level);
    const auto for_slot = static_cast<std::size_t>(std::clamp(kQueued_s / std::max(load_s, 1e-6),
                                                              static_cast<double>(kLeastQueued),
                                                              static_cast<double>(kMostQueued)));
    const std::size_t most = std::max<std::size_t>(slots * for_slot, 1);
    std::size_t speculation_count = 0;
    for (const auto& [key, load] : begun) speculation_count += load.is_speculation ? 1u : 0u;
    std::size_t needed_count = begun.size() - speculation_count;

    postpone();
    std::vector<LoadRequest> requests;
    std::map<ChunkKey, bool> queued;
    std::size_t later_count = 0;
    for (const Wish& wish : needs.wishes()) {
        if (requests.size() + later_count >= most) break;
        const bool is_speculation = wish.need.why == NeedClass::speculation;
        // with what is left only
        if (is_speculation && !waits_for_all() &&
            (2 * needed_count >= slots || !may_speculate(speculation_count))) {
            break;
        }
        if (wish.can_wait && !waits_for_all()) continue;
        // so many are done before it, and then its own
        const std::size_t ahead = requests.size() + begun.size() + 1;
        const double turns =
            static_cast<double>(std::max(ahead, slots)) / static_cast<double>(slots);
        if (!may_begin(wish, turns * times.expected_s(wish.key.level))) continue;
        if (wish.key.level > 0) {
            const ChunkKey parent = wish.key.parent();
            if (tree.find(parent) == ChunkTree::kNone && !begun.contains(parent) &&
                !orphans.contains(parent) && !queued.contains(parent)) {
                continue;
            }
        }
        ByteClaim claim;
        Room::Answer answer = Room::Answer::free;
        if (!old.empty() && room.may_keep_claim(wish.need)) {
            claim = std::move(old.back().claim);
            old.pop_back();
        } else {
            answer = room.make(wish.need, wish.slack_s, claim);
        }
        if (answer == Room::Answer::none) break;
        if (answer == Room::Answer::later) {
            ++later_count;
            continue;
        }
        ++(is_speculation ? speculation_count : needed_count);
        queued.emplace(wish.key, is_speculation);
        requests.push_back({wish.key, std::move(claim)});
    }
    for (const auto& [key, is_speculation] : queued) {
        begun[key] = {.unneeded_since_s = time_s, .is_speculation = is_speculation};
        const auto gone = evicted_s.find(key);
        if (gone != evicted_s.end() && time_s - gone->second < settings.horizon) ++stats.reloaded;
        if (gone != evicted_s.end()) evicted_s.erase(gone);
    }
    for (const ChunkKey& key : old_keys) stats.cancelled += queued.contains(key) ? 0u : 1u;
    old.clear();
    stats.peak_bytes = std::max(stats.peak_bytes, room.bytes());
    const bool is_busy = !begun.empty();
    loader->queue(std::move(requests));
    return is_busy;
}

}  // namespace terrane
