// SPDX-License-Identifier: MIT
#include "paging/memory_budget.h"

#include <algorithm>
#include <tuple>

namespace terrane::internal {
namespace {

// A load must be needed this much more than what it evicts, or sooner by so much, or the two would
// take turns.
constexpr double kGain = 1.25;
constexpr double kSooner_s = 1.0;
// What is needed within this time counts as needed now.
constexpr double kNow_s = 0.5;
// Nothing goes for what can wait for longer: what is there may be of use meanwhile.
constexpr double kEvictAhead_s = 1.0;
// Chunks that fade out at the same time, to make room.
constexpr std::size_t kMostLeaving = 16;
// One that fades out already goes before its equals.
constexpr double kLeavingWorth = 0.8;
// An evicted chunk that somebody holds longer, in updates, is not waited for.
constexpr std::uint64_t kHeldUpdates = 4;

}  // namespace

bool Room::Candidate::operator<(const Candidate& other) const {
    return std::tie(keep, key) > std::tie(other.keep, other.key);
}

void Room::look(std::span<const Watcher> watchers, bool may_jump) {
    watchers_ = watchers;
    may_jump_ = may_jump;
    for (ChunkTree::Index i = 0; i < tree_->capacity(); ++i) (*tree_)[i].watch.reset();
}

void Room::begin(std::span<const Outlook> outlooks, bool has_contact, PagerStats& stats) {
    outlooks_ = outlooks;
    stats_ = &stats;
    ++update_;
    waiting_count_ = leaving_count_ = leaving_bytes_ = 0;
    is_listed_ = false;
    for (auto& tier : candidates_) tier = {};
    std::erase_if(evicted_, [this](const Evicted& gone) {
        return gone.chunk.expired() || update_ > gone.update + kHeldUpdates;
    });
    std::size_t contact_bytes = 0;
    for (ChunkTree::Index i = 0; i < tree_->capacity(); ++i) {
        ChunkTree::Node& node = (*tree_)[i];
        node.was_leaving = std::exchange(node.is_leaving, false);
        if (node.chunk && node.need.why == NeedClass::contact) contact_bytes += node.chunk->bytes();
    }
    const auto share = static_cast<std::size_t>(settings_.contact_share *
                                                static_cast<double>(settings_.memory_bytes));
    contact_reserve_ = has_contact && share > contact_bytes ? share - contact_bytes : 0;
}

std::size_t Room::limit(NeedClass why) const {
    return why <= NeedClass::contact ? settings_.memory_bytes
                                     : settings_.memory_bytes - contact_reserve_;
}

std::size_t Room::soon_free_bytes() {
    std::size_t sum = leaving_bytes_;
    for (const Evicted& gone : evicted_) {
        if (!gone.chunk.expired()) sum += gone.bytes;
    }
    return sum;
}

const Watch& Room::watch_of(ChunkTree::Node& node) {
    if (!node.watch) {
        node.watch = watch(tree_->lattice(), *node.chunk, watchers_, node.inverse_fade);
    }
    return *node.watch;
}

Room::Candidate Room::candidate(ChunkTree::Index index) const {
    const ChunkTree::Node& node = (*tree_)[index];
    Candidate made{.key = node.chunk->key, .index = index};
    switch (node.need.why) {
        case NeedClass::none:
            if (node.parent != ChunkTree::kNone) {
                const ChunkTree::Node& parent = (*tree_)[node.parent];
                const auto quadrant = static_cast<std::size_t>(node.chunk->key.quadrant());
                for (const Outlook& outlook : outlooks_) {
                    made.keep = std::max(made.keep, outlook.ratio_around(parent.boxes[quadrant],
                                                                         parent.bounds[quadrant]));
                }
            }
            break;
        case NeedClass::speculation:
            made.tier = Tier::speculative;
            made.keep = node.need.ratio;
            break;
        case NeedClass::drawn:
            made.tier = node.need.begin_s > kNow_s ? Tier::drawn_later : Tier::drawn_now;
            made.keep = node.need.begin_s > kNow_s ? -node.need.begin_s : node.need.ratio;
            break;
        case NeedClass::contact:
            made.tier = node.need.is_needed_now() ? Tier::pinned : Tier::contact_later;
            made.keep = -node.need.begin_s;
            break;
        case NeedClass::root:
            made.tier = Tier::pinned;
            break;
    }
    made.worth = made.keep;
    if (node.was_leaving && made.keep > 0.0) made.keep *= kLeavingWorth;
    return made;
}

bool Room::is_outweighed(const Candidate& held, const Need& wanted) const {
    const bool is_sooner = wanted.begin_s + kSooner_s < -held.worth;
    switch (wanted.why) {
        case NeedClass::root:
            return true;
        case NeedClass::contact:
            return held.tier != Tier::contact_later || is_sooner;
        case NeedClass::drawn:
            if (held.tier == Tier::drawn_later) return is_sooner;
            if (held.tier == Tier::drawn_now) {
                return wanted.begin_s <= kNow_s && wanted.ratio > kGain * held.worth;
            }
            return held.tier < Tier::drawn_later;
        case NeedClass::speculation:
        case NeedClass::none:
            break;
    }
    return false;
}

// The first of the lowest tier that may go for what is wanted; null where there is none.
std::priority_queue<Room::Candidate>* Room::find_victim(const Need& need) {
    if (!is_listed_) list_candidates();
    for (auto& tier : candidates_) {
        if (!tier.empty() && is_outweighed(tier.top(), need)) return &tier;
    }
    return nullptr;
}

void Room::add_candidate(ChunkTree::Index index) {
    const Candidate made = candidate(index);
    if (made.tier != Tier::pinned) candidates_[static_cast<std::size_t>(made.tier)].push(made);
}

void Room::list_candidates() {
    is_listed_ = true;
    for (ChunkTree::Index i = 0; i < tree_->capacity(); ++i) {
        const ChunkTree::Node& node = (*tree_)[i];
        if (node.chunk && node.child_count == 0 && node.parent != ChunkTree::kNone) {
            add_candidate(i);
        }
    }
}

void Room::evict(ChunkTree::Index index) {
    const ChunkTree::Node& node = (*tree_)[index];
    const ChunkTree::Index parent = node.parent;
    evicted_.push_back({node.chunk, node.chunk->bytes(), update_});
    gone_.push_back(node.chunk->key);
    ++stats_->evicted;
    tree_->erase(index);
    const ChunkTree::Node& above = (*tree_)[parent];
    if (above.child_count == 0 && above.parent != ChunkTree::kNone) {
        add_candidate(parent);
    }
}

Room::Answer Room::make(const Need& need, double slack_s, ByteClaim& claim) {
    const bool is_urgent = need.why <= NeedClass::contact;
    const bool may_evict = may_jump_ || is_urgent || settings_.policy == PagingPolicy::distance ||
                           (need.why == NeedClass::drawn && slack_s <= kEvictAhead_s);
    for (;;) {
        const std::size_t most = limit(need.why);
        const std::size_t wanted = bytes_->load() + (waiting_count_ + 1) * Chunk::max_bytes();
        if (wanted <= most) {
            claim = ByteClaim(bytes_, Chunk::max_bytes());
            return Answer::free;
        }
        if (wanted <= most + soon_free_bytes()) {
            ++waiting_count_;
            ++stats_->over_ceiling;
            return Answer::later;
        }
        std::priority_queue<Candidate>* const tier = may_evict ? find_victim(need) : nullptr;
        if (tier == nullptr) {
            ++stats_->over_ceiling;
            return Answer::none;
        }
        const ChunkTree::Index index = tier->top().index;
        ChunkTree::Node& node = (*tree_)[index];
        const bool is_seen = !may_jump_ && !node.is_new && watch_of(node).ratio > node.inverse_fade;
        if (is_seen && !is_urgent) {
            if (leaving_count_ == kMostLeaving) {
                ++stats_->over_ceiling;
                return Answer::none;
            }
            tier->pop();
            node.is_leaving = true;
            ++leaving_count_;
            leaving_bytes_ += node.chunk->bytes();
        } else {
            tier->pop();
            stats_->hard_evictions += is_seen ? 1u : 0u;
            evict(index);
        }
    }
}

}  // namespace terrane::internal
