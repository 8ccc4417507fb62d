// SPDX-License-Identifier: MIT
#include "paging/memory_budget.h"

#include "chunk/chunk_outline.h"

#include <terrane/base/result.h>

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
    for (const ChunkTree::Index i : visible_) (*tree_)[i].visibility.reset();
    visible_.clear();
}

void MemoryBudget::begin_plan(std::span<const PredictedView> predicted_views,
                              std::span<const ChunkTree::Index> needed, bool has_contact,
                              PagerStats& stats) {
    predicted_views_ = predicted_views;
    stats_ = &stats;
    ++update_;
    pending_bytes_ = fading_out_bytes_ = 0;
    is_listed_ = false;
    for (auto& tier : candidates_) tier = {};
    std::erase_if(awaiting_release_, [this](const EvictedChunk& evicted) {
        return evicted.chunk.expired() || update_ > evicted.update + kHeldUpdates;
    });
    for (const ChunkTree::Index i : faded_out_) (*tree_)[i].was_fading_out = false;
    faded_out_ = std::exchange(fading_out_, {});
    for (const ChunkTree::Index i : faded_out_) {
        (*tree_)[i].was_fading_out = std::exchange((*tree_)[i].is_fading_out, false);
    }
    std::size_t contact_bytes = 0;
    for (const ChunkTree::Index i : needed) {
        if ((*tree_)[i].need.why == NeedClass::contact) contact_bytes += (*tree_)[i].bytes;
    }
    const auto share = static_cast<std::size_t>(settings_.contact_share *
                                                static_cast<double>(settings_.memory_bytes));
    contact_reserve_ = has_contact && share > contact_bytes ? share - contact_bytes : 0;
}

std::size_t MemoryBudget::limit(NeedClass why) const {
    return why <= NeedClass::contact ? settings_.memory_bytes
                                     : settings_.memory_bytes - contact_reserve_;
}

MemoryBudget::SoonFree::SoonFree(const MemoryBudget& budget) : budget_(&budget) {}

// Chunks that have been evicted since the last call are added to the sum; the others are not looked at again.
std::size_t MemoryBudget::SoonFree::bytes() {
    const std::vector<EvictedChunk>& all = budget_->awaiting_release_;
    for (; counted_ < all.size(); ++counted_) {
        if (!all[counted_].chunk.expired()) evicted_bytes_ += all[counted_].bytes;
    }
    return evicted_bytes_ + budget_->fading_out_bytes_;
}

const FadeVisibility& MemoryBudget::visibility_of(ChunkTree::Index index) {
    ChunkTree::Node& node = (*tree_)[index];
    if (!node.visibility) {
        visible_.push_back(index);
        node.visibility =
            find_fade_visibility(tree_->lattice(), *node.chunk, observers_, node.inverse_fade);
    }
    return *node.visibility;
}

MemoryBudget::EvictionCandidate MemoryBudget::candidate(ChunkTree::Index index) const {
    const ChunkTree::Node& node = (*tree_)[index];
    EvictionCandidate made{.key = node.key, .index = index, .is_for_outline = node.child_count > 0};
    switch (made.is_for_outline ? NeedClass::none : node.need.why) {
        case NeedClass::none:
            if (node.parent != ChunkTree::kNone) {
                const ChunkTree::Quadrants& parent = tree_->quadrants(node.parent);
                const auto quadrant = static_cast<std::size_t>(node.key.quadrant());
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
        while (!tier.empty() && is_stale(tier.top())) tier.pop();
        if (!tier.empty() && is_outweighed(tier.top(), need)) return &tier;
    }
    return nullptr;
}

// Whether a chunk can be replaced by its outline.
bool MemoryBudget::has_outline(const ChunkTree::Node& node) const {
    const int below = contact_level_ - node.key.level;
    return node.chunk != nullptr && node.parent != ChunkTree::kNone && below > 0 &&
           below <= kMostOutlineDepth;
}

// Whether an outline would do in place of a chunk: only bodies need it, and nothing below it is drawn but what they
// stand on.
bool MemoryBudget::is_coverable(const ChunkTree::Node& node) const {
    if (!has_outline(node) || node.is_to_be_drawn || node.need.why != NeedClass::contact)
        return false;
    return std::ranges::all_of(node.child, [this](ChunkTree::Index child) {
        if (child == ChunkTree::kNone) return true;
        const ChunkTree::Node& below = (*tree_)[child];
        return !below.is_drawn || (below.child_count == 0 && below.need.why == NeedClass::contact);
    });
}

// Whether a candidate for an outline has been replaced, or does not fit now.
bool MemoryBudget::is_stale(const EvictionCandidate& candidate) const {
    if (!candidate.is_for_outline) return false;
    const ChunkTree::Node& node = (*tree_)[candidate.index];
    return node.key != candidate.key || node.child_count == 0 || !is_coverable(node) ||
           bytes_->load() + outline_bytes(contact_level_ - node.key.level) > settings_.memory_bytes;
}

void MemoryBudget::add_candidate(ChunkTree::Index index) {
    const EvictionCandidate made = candidate(index);
    if (made.tier != Tier::pinned) candidates_[static_cast<std::size_t>(made.tier)].push(made);
}

void MemoryBudget::list_candidates() {
    is_listed_ = true;
    for (ChunkTree::Index i = 0; i < tree_->capacity(); ++i) {
        const ChunkTree::Node& node = (*tree_)[i];
        if (node.is_free() || node.parent == ChunkTree::kNone) continue;
        if (node.child_count == 0 || is_coverable(node)) add_candidate(i);
    }
}

void MemoryBudget::await_release(const ChunkTree::Node& node) {
    std::weak_ptr<const void> chunk;
    if (node.chunk != nullptr) {
        chunk = node.chunk;
    } else {
        chunk = node.outline;
    }
    awaiting_release_.push_back({std::move(chunk), node.bytes, update_});
    evicted_keys_.push_back(node.key);
}

bool MemoryBudget::outline(ChunkTree::Index index) {
    const ChunkTree::Node& node = (*tree_)[index];
    if (!has_outline(node)) return false;
    struct Claimed {
        ChunkOutline outline;
        ByteClaim claim;
    };
    const std::size_t bytes = outline_bytes(contact_level_ - node.key.level);
    ByteClaim claim;
    if (!claim_replacements(bytes, claim)) return false;
    const auto made = std::make_shared<const Claimed>(Claimed{
        make_outline(*node.chunk, contact_level_, tree_->lattice().quantum), std::move(claim)});
    tree_->replace(index, std::shared_ptr<const ChunkOutline>(made, &made->outline));
    return true;
}

void MemoryBudget::evict(ChunkTree::Index index) {
    const ChunkTree::Index parent = (*tree_)[index].parent;
    await_release((*tree_)[index]);
    ++stats_->evicted;
    tree_->erase(index);
    if (parent == ChunkTree::kNone) return;
    const ChunkTree::Node& above = (*tree_)[parent];
    if (above.parent != ChunkTree::kNone && (above.child_count == 0 || is_coverable(above))) {
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

// Whether a camera would see a chunk and its drawn descendants vanish.
bool MemoryBudget::is_seen(ChunkTree::Index index) {
    const ChunkTree::Node& node = (*tree_)[index];
    if (skips_fades_ || !node.is_drawn) return false;
    if (!node.is_new && visibility_of(index).ratio > node.inverse_fade) return true;
    return std::ranges::any_of(node.child, [this](ChunkTree::Index child) {
        return child != ChunkTree::kNone && is_seen(child);
    });
}

void MemoryBudget::begin_fading_out(ChunkTree::Index index) {
    ChunkTree::Node& node = (*tree_)[index];
    if (!node.is_drawn) return;
    node.is_fading_out = true;
    fading_out_.push_back(index);
    for (const ChunkTree::Index child : node.child) {
        if (child != ChunkTree::kNone) begin_fading_out(child);
    }
}

// Evicts, or replaces by an outline, without a fade.
void MemoryBudget::evict_at_once(const EvictionCandidate& victim) {
    const ChunkTree::Index index = victim.index;
    stats_->hard_evictions += is_seen(index) ? 1u : 0u;
    if (!victim.is_for_outline) {
        evict(index);
        return;
    }
    await_release((*tree_)[index]);
    ++stats_->evicted;
    const bool is_outlined = outline(index);
    TERRANE_ASSERT(is_outlined, "an outline must fit: see is_stale()");
    static_cast<void>(is_outlined);
    const ChunkTree::Index parent = (*tree_)[index].parent;
    if (is_coverable((*tree_)[parent])) add_candidate(parent);
}

// Evicts for a need until so many more bytes fit, counting bytes that will soon be released. Returns whether they fit.
bool MemoryBudget::evict_for(const Need& need, std::size_t bytes) {
    SoonFree soon_free(*this);
    while (bytes_->load() + bytes > settings_.memory_bytes + soon_free.bytes()) {
        std::priority_queue<EvictionCandidate>* const tier = find_victim(need);
        if (tier == nullptr) return false;
        const EvictionCandidate victim = tier->top();
        tier->pop();
        evict_at_once(victim);
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
        if (node.is_free() || node.parent == ChunkTree::kNone) continue;
        if (finest == ChunkTree::kNone || node.key.level > (*tree_)[finest].key.level) {
            finest = i;
        }
    }
    return finest;
}

void MemoryBudget::keep_ceiling() {
    while (!evict_for({.why = NeedClass::root}, 0)) {
        const ChunkTree::Index pinned = finest_leaf();
        if (pinned == ChunkTree::kNone) return;
        evict_at_once({.key = (*tree_)[pinned].key, .index = pinned});
    }
}

MemoryBudget::Admission MemoryBudget::admit(const Need& need, std::size_t bytes, double slack_s,
                                            ByteClaim& claim) {
    const bool is_urgent = need.why <= NeedClass::contact;
    const bool may_evict = skips_fades_ || is_urgent ||
                           settings_.policy == PagingPolicy::distance ||
                           (need.why == NeedClass::drawn && slack_s <= kEvictAhead_s);
    SoonFree soon_free(*this);
    for (;;) {
        const std::size_t most = limit(need.why);
        const std::size_t wanted = bytes_->load() + pending_bytes_ + bytes;
        if (wanted <= most) {
            claim = ByteClaim(bytes_, bytes);
            return Admission::granted;
        }
        if (wanted <= most + soon_free.bytes()) {
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
        const EvictionCandidate victim = tier->top();
        if (!is_urgent && is_seen(victim.index)) {
            if (fading_out_.size() >= kMostFadingOut) {
                ++stats_->over_ceiling;
                return Admission::refused;
            }
            tier->pop();
            begin_fading_out(victim.index);
            fading_out_bytes_ += (*tree_)[victim.index].bytes;
        } else {
            tier->pop();
            evict_at_once(victim);
        }
    }
}

}  // namespace terrane::internal
