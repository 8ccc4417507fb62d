// SPDX-License-Identifier: MIT
#pragma once

#include "paging/chunk_tree.h"

#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/pager.h>

#include <array>
#include <cstdint>
#include <queue>
#include <span>
#include <utility>
#include <vector>

namespace terrane::internal {

/// Enforces the byte ceiling on resident chunks and loads in flight, and selects chunks to evict.
///
/// Order of eviction: unneeded chunks, smallest error in any view direction first; speculative chunks, smallest ratio
/// first; chunks to be drawn later, latest first; chunks drawn now, smallest error first; contact chunks not touched
/// yet, latest first. Roots are never evicted, touched contact chunks only by keep_ceiling(), and speculative loads
/// evict nothing. A chunk whose removal a camera would see fades out first, unless contact or a root needs its bytes.
///
/// A coarser chunk over ground that only bodies need is replaced by its outline when its turn as an unneeded chunk
/// comes.
class MemoryBudget {
public:
    MemoryBudget(ChunkTree& tree, std::shared_ptr<ByteCount> bytes, const PagerSettings& settings,
                 int contact_level)
        : tree_(&tree),
          bytes_(std::move(bytes)),
          settings_(settings),
          contact_level_(contact_level) {}

    /// Changes the ceiling; the next keep_ceiling() evicts what exceeds it.
    void set_memory_bytes(std::size_t memory_bytes) { settings_.memory_bytes = memory_bytes; }

    /// Starts an update; call before everything else.
    ///
    /// @param skips_fades true: no frame is drawn meanwhile, so chunks are evicted without fading out
    void begin_update(std::span<const FadeObserver> observers, bool skips_fades);
    /// Starts a plan; call after finding needs and before admit().
    ///
    /// @param needed      the nodes with a need
    /// @param has_contact true: reserves the share of contact, because there are bodies or required regions
    void begin_plan(std::span<const PredictedView> predicted_views,
                    std::span<const ChunkTree::Index> needed, bool has_contact, PagerStats& stats);

    /// Whether another load may start.
    enum class Admission {
        granted,
        pending,  ///< evicted or fading chunks will soon release enough bytes
        refused,
    };
    /// Evicts until another chunk with this need fits, and claims its bytes.
    ///
    /// @param bytes   ChunkSource::max_chunk_bytes() of the chunk
    /// @param slack_s see LoadCandidate
    Admission admit(const Need& need, std::size_t bytes, double slack_s, ByteClaim& claim);
    /// Claims bytes for chunks or outlines that replace resident ones, if they fit now.
    bool claim_replacements(std::size_t bytes, ByteClaim& claim);
    /// Replaces the chunk of a node by its outline if the chunk's level allows that and the outline's bytes fit now.
    /// Returns whether it did.
    bool outline(ChunkTree::Index index);
    /// Evicts with the priority of contact until `bytes` fit, counting bytes that will soon be released. Reserves them,
    /// so that loads of this plan cannot claim them. Call after begin_plan().
    void make_room(std::size_t bytes);
    /// Evicts what exceeds a lowered ceiling, counting bytes that will soon be released: ground that bodies touch last,
    /// roots never. Call after begin_plan().
    void keep_ceiling();
    /// Whether an earlier claim may be reused for a chunk with this need.
    bool may_keep_claim(const Need& need) const { return bytes_->load() <= limit(need.why); }

    /// Evicts a chunk and its descendants, even if they are needed. Call between plans: begin_plan() rebuilds the
    /// candidates.
    void evict_tree(ChunkTree::Index index);

    bool has_evicted() const { return !evicted_keys_.empty(); }
    /// Keys evicted since the last call, in order of eviction.
    std::vector<ChunkKey> take_evicted() { return std::exchange(evicted_keys_, {}); }

    /// Visibility of a chunk's fade in this update.
    const FadeVisibility& visibility_of(ChunkTree::Index index);
    /// The nodes that began to fade out since the last plan; some may be free by now.
    std::span<const ChunkTree::Index> fading_out() const { return fading_out_; }
    std::size_t bytes() const { return bytes_->load(); }

private:
    /// Order of eviction.
    enum class Tier : std::uint8_t {
        unneeded,
        speculative,
        drawn_later,
        drawn_now,
        contact_later,
        pinned,  ///< by no load
    };
    struct EvictionCandidate {
        Tier tier = Tier::unneeded;
        double priority = 0.0;  ///< within the tier, the smallest is evicted first
        double value = 0.0;     ///< what a load's need must exceed: see is_outweighed()
        ChunkKey key;
        ChunkTree::Index index = ChunkTree::kNone;
        bool is_for_outline = false;  ///< the chunk is replaced by its outline, not evicted
        // std::priority_queue: the first to evict is the largest
        bool operator<(const EvictionCandidate& other) const;
    };
    // An evicted chunk or outline. Its bytes are released when the last older set that holds it is destroyed.
    struct EvictedChunk {
        std::weak_ptr<const void> chunk;
        std::size_t bytes = 0;
        std::uint64_t update = 0;
    };

    // Bytes that will soon be released, during one sequence of evictions.
    class SoonFree {
    public:
        explicit SoonFree(const MemoryBudget& budget);
        std::size_t bytes();

    private:
        const MemoryBudget* budget_;
        std::size_t counted_ = 0;  // of awaiting_release_
        std::size_t evicted_bytes_ = 0;
    };

    std::size_t limit(NeedClass why) const;
    EvictionCandidate candidate(ChunkTree::Index index) const;
    bool is_outweighed(const EvictionCandidate& held, const Need& wanted) const;
    std::priority_queue<EvictionCandidate>* find_victim(const Need& need);
    void add_candidate(ChunkTree::Index index);
    void list_candidates();
    bool has_outline(const ChunkTree::Node& node) const;
    bool is_coverable(const ChunkTree::Node& node) const;
    bool is_stale(const EvictionCandidate& candidate) const;
    bool is_seen(ChunkTree::Index index);
    void begin_fading_out(ChunkTree::Index index);
    void await_release(const ChunkTree::Node& node);
    void evict(ChunkTree::Index index);
    void evict_at_once(const EvictionCandidate& victim);
    bool evict_for(const Need& need, std::size_t bytes);
    ChunkTree::Index finest_leaf() const;

    ChunkTree* tree_;
    std::shared_ptr<ByteCount> bytes_;
    PagerSettings settings_;
    int contact_level_ = 0;
    std::vector<EvictedChunk> awaiting_release_;
    std::vector<ChunkKey> evicted_keys_;
    std::uint64_t update_ = 0;

    // of the current update or plan
    std::span<const PredictedView> predicted_views_;
    std::span<const FadeObserver> observers_;
    bool skips_fades_ = false;
    std::size_t contact_reserve_ = 0;
    std::size_t pending_bytes_ = 0;                         // of loads with Admission::pending
    std::vector<ChunkTree::Index> fading_out_, faded_out_;  // since the last plan, and before it
    std::vector<ChunkTree::Index> visible_;                 // with a visibility in this update
    std::size_t fading_out_bytes_ = 0;
    bool is_listed_ = false;
    std::array<std::priority_queue<EvictionCandidate>, 5> candidates_;  // by tier
    PagerStats* stats_ = nullptr;
};

}  // namespace terrane::internal
