// SPDX-License-Identifier: MIT
#include "paging/memory_budget.h"

#include <algorithm>
#include <tuple>

namespace terrane::internal {
namespace {

// Hysteresis: a load's ratio must exceed its victim's by this factor, or the load must be needed sooner by this time.
constexpr double kGain = 1.25;
constexpr double kSooner_s = 1.0;
// A need that starts within this time counts as current.
constexpr double kNow_s = 0.5;
// A load of a chunk to be drawn with more slack than this evicts nothing: the victim may be useful in the meantime.
constexpr double kEvictAhead_s = 1.0;
// Maximum number of chunks that fade out simultaneously.
constexpr std::size_t kMostFadingOut = 16;
// Priority factor of chunks that are already fading out.
constexpr double kFadingOutValue = 0.8;
// Updates after which an evicted chunk that is still held is no longer expected to release its bytes.
constexpr std::uint64_t kHeldUpdates = 4;

}  // namespace

bool MemoryBudget::EvictionCandidate::operator<(const EvictionCandidate& other) const {
    return std::tie(priority, key) > std::tie(other.priority, other.key);
}

void MemoryBudget::begin_update(std::span<const FadeObserver> observers, bool skips_fades) {
    observers_ = observers;
    skips_fades_ = skips_fades;
    for (ChunkTree::Index i = 0; i < tree_->capacity(); ++i) (*tree_)[i].visibility.reset();
}

void MemoryBudget::begin_plan(std::span<const PredictedView> predicted_views, bool has_contact,
                              PagerStats& stats) {
    predicted_views_ = predicted_views;
    stats_ = &stats;
    ++update_;
    pending_bytes_ = fading_out_count_ = fading_out_bytes_ = 0;
    is_listed_ = false;
    for (auto& tier : candidates_) tier = {};
    std::erase_if(awaiting_release_, [this](const EvictedChunk& evicted) {
        return evicted.chunk.expired() || update_ > evicted.update + kHeldUpdates;
    });
    std::size_t contact_bytes = 0;
    for (ChunkTree::Index i = 0; i < tree_->capacity(); ++i) {
        ChunkTree::Node& node = (*tree_)[i];
        node.was_fading_out = std::exchange(node.is_fading_out, false);
        if (node.chunk && node.need.why == NeedClass::contact) contact_bytes += node.chunk->bytes();
    }
    const auto share = static_cast<std::size_t>(settings_.contact_share *
                                                static_cast<double>(settings_.memory_bytes));
    contact_reserve_ = has_contact && share > contact_bytes ? share - contact_bytes : 0;
}

std::size_t MemoryBudget::limit(NeedClass why) const {
    return why <= NeedClass::contact ? settings_.memory_bytes
                                     : settings_.memory_bytes - contact_reserve_;
}

std::size_t MemoryBudget::soon_free_bytes() {
    std::size_t sum = fading_out_bytes_;
    for (const EvictedChunk& evicted : awaiting_release_) {
        if (!evicted.chunk.expired()) sum += evicted.bytes;
    }
    return sum;
}

const FadeVisibility& MemoryBudget::visibility_of(ChunkTree::Node& node) {
    if (!node.visibility) {
        node.visibility =
            find_fade_visibility(tree_->lattice(), *node.chunk, observers_, node.inverse_fade);
    }
    return *node.visibility;
}

MemoryBudget::EvictionCandidate MemoryBudget::candidate(ChunkTree::Index index) const {
    const ChunkTree::Node& node = (*tree_)[index];
    EvictionCandidate made{.key = node.chunk->key, .index = index};
    switch (node.need.why) {
        case NeedClass::none:
            if (node.parent != ChunkTree::kNone) {
                const ChunkTree::Node& parent = (*tree_)[node.parent];
                const auto quadrant = static_cast<std::size_t>(node.chunk->key.quadrant());
                for (const PredictedView& predicted : predicted_views_) {
                    made.priority = std::max(
                        made.priority, predicted.ratio_in_any_direction(parent.boxes[quadrant],
                                                                        parent.bounds[quadrant]));
                }
            }
            break;
        case NeedClass::speculation:
            made.tier = Tier::speculative;
            made.priority = node.need.ratio;
            break;
        case NeedClass::drawn:
            made.tier = node.need.begin_s > kNow_s ? Tier::drawn_later : Tier::drawn_now;
            made.priority = node.need.begin_s > kNow_s ? -node.need.begin_s : node.need.ratio;
            break;
        case NeedClass::contact:
            made.tier = node.need.is_needed_now() ? Tier::pinned : Tier::contact_later;
            made.priority = -node.need.begin_s;
            break;
        case NeedClass::root:
            made.tier = Tier::pinned;
            break;
    }
    made.value = made.priority;
    if (node.was_fading_out && made.priority > 0.0) made.priority *= kFadingOutValue;
    return made;
}

bool MemoryBudget::is_outweighed(const EvictionCandidate& held, const Need& wanted) const {
    const bool is_sooner = wanted.begin_s + kSooner_s < -held.value;
    switch (wanted.why) {
        case NeedClass::root:
            return true;
        case NeedClass::contact:
            return held.tier != Tier::contact_later || is_sooner;
        case NeedClass::drawn:
            if (held.tier == Tier::drawn_later) return is_sooner;
            if (held.tier == Tier::drawn_now) {
                return wanted.begin_s <= kNow_s && wanted.ratio > kGain * held.value;
            }
            return held.tier < Tier::drawn_later;
        case NeedClass::speculation:
        case NeedClass::none:
            break;
    }
    return false;
}

// The queue of the lowest tier whose top chunk may be evicted for this need; null if there is none.
std::priority_queue<MemoryBudget::EvictionCandidate>* MemoryBudget::find_victim(const Need& need) {
    if (!is_listed_) list_candidates();
    for (auto& tier : candidates_) {
        if (!tier.empty() && is_outweighed(tier.top(), need)) return &tier;
    }
    return nullptr;
}

void MemoryBudget::add_candidate(ChunkTree::Index index) {
    const EvictionCandidate made = candidate(index);
    if (made.tier != Tier::pinned) candidates_[static_cast<std::size_t>(made.tier)].push(made);
}

void MemoryBudget::list_candidates() {
    is_listed_ = true;
    for (ChunkTree::Index i = 0; i < tree_->capacity(); ++i) {
        const ChunkTree::Node& node = (*tree_)[i];
        if (node.chunk && node.child_count == 0 && node.parent != ChunkTree::kNone) {
            add_candidate(i);
        }
    }
}

void MemoryBudget::evict(ChunkTree::Index index) {
    const ChunkTree::Node& node = (*tree_)[index];
    const ChunkTree::Index parent = node.parent;
    awaiting_release_.push_back({node.chunk, node.chunk->bytes(), update_});
    evicted_keys_.push_back(node.chunk->key);
    ++stats_->evicted;
    tree_->erase(index);
    if (parent == ChunkTree::kNone) return;
    const ChunkTree::Node& above = (*tree_)[parent];
    if (above.child_count == 0 && above.parent != ChunkTree::kNone) {
        add_candidate(parent);
    }
}

void MemoryBudget::evict_tree(ChunkTree::Index index) {
    for (const ChunkTree::Index child : (*tree_)[index].child) {
        if (child != ChunkTree::kNone) evict_tree(child);
    }
    evict(index);
}

bool MemoryBudget::claim_replacements(std::size_t bytes, ByteClaim& claim) {
    if (bytes_->load() + bytes > settings_.memory_bytes) return false;
    claim = ByteClaim(bytes_, bytes);
    return true;
}

// Whether a camera would see the removal of a chunk.
bool MemoryBudget::is_seen(ChunkTree::Node& node) {
    return !skips_fades_ && !node.is_new && visibility_of(node).ratio > node.inverse_fade;
}

// Evicts without a fade.
void MemoryBudget::evict_at_once(ChunkTree::Index index) {
    stats_->hard_evictions += is_seen((*tree_)[index]) ? 1u : 0u;
    evict(index);
}

// Evicts for a need until so many more bytes fit, counting bytes that will soon be released. Returns whether they fit.
bool MemoryBudget::evict_for(const Need& need, std::size_t bytes) {
    while (bytes_->load() + bytes > settings_.memory_bytes + soon_free_bytes()) {
        std::priority_queue<EvictionCandidate>* const tier = find_victim(need);
        if (tier == nullptr) return false;
        const ChunkTree::Index index = tier->top().index;
        tier->pop();
        evict_at_once(index);
    }
    return true;
}

void MemoryBudget::make_room(std::size_t bytes) {
    evict_for({.why = NeedClass::contact}, bytes);
    pending_bytes_ += bytes;
}

// A chunk of the finest level that is resident; kNone if only roots are.
ChunkTree::Index MemoryBudget::finest_leaf() const {
    ChunkTree::Index finest = ChunkTree::kNone;
    for (ChunkTree::Index i = 0; i < tree_->capacity(); ++i) {
        const ChunkTree::Node& node = (*tree_)[i];
        if (!node.chunk || node.parent == ChunkTree::kNone) continue;
        if (finest == ChunkTree::kNone ||
            node.chunk->key.level > (*tree_)[finest].chunk->key.level) {
            finest = i;
        }
    }
    return finest;
}

void MemoryBudget::keep_ceiling() {
    while (!evict_for({.why = NeedClass::root}, 0)) {
        const ChunkTree::Index pinned = finest_leaf();
        if (pinned == ChunkTree::kNone) return;
        evict_at_once(pinned);
    }
}

MemoryBudget::Admission MemoryBudget::admit(const Need& need, std::size_t bytes, double slack_s,
                                            ByteClaim& claim) {
    const bool is_urgent = need.why <= NeedClass::contact;
    const bool may_evict = skips_fades_ || is_urgent ||
                           settings_.policy == PagingPolicy::distance ||
                           (need.why == NeedClass::drawn && slack_s <= kEvictAhead_s);
    for (;;) {
        const std::size_t most = limit(need.why);
        const std::size_t wanted = bytes_->load() + pending_bytes_ + bytes;
        if (wanted <= most) {
            claim = ByteClaim(bytes_, bytes);
            return Admission::granted;
        }
        if (wanted <= most + soon_free_bytes()) {
            pending_bytes_ += bytes;
            ++stats_->over_ceiling;
            return Admission::pending;
        }
        std::priority_queue<EvictionCandidate>* const tier =
            may_evict ? find_victim(need) : nullptr;
        if (tier == nullptr) {
            ++stats_->over_ceiling;
            return Admission::refused;
        }
        const ChunkTree::Index index = tier->top().index;
        ChunkTree::Node& node = (*tree_)[index];
        if (!is_urgent && is_seen(node)) {
            if (fading_out_count_ == kMostFadingOut) {
                ++stats_->over_ceiling;
                return Admission::refused;
            }
            tier->pop();
            node.is_fading_out = true;
            ++fading_out_count_;
            fading_out_bytes_ += node.chunk->bytes();
        } else {
            tier->pop();
            evict_at_once(index);
        }
    }
}

}  // namespace terrane::internal
