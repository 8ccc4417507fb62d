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

/// Keeps what is resident and what is on its way below the ceiling, and chooses what goes.
///
/// Evicted first is what nobody needs, the least useful first; then what is speculation; then what will
/// be drawn, the latest first; then what is drawn, by the error that it saves; then contact that is not
/// touched yet. Contact in use and roots stay. Speculation evicts nothing. What a camera would see go
/// fades out first, unless ground is waiting for its bytes.
class Room {
public:
    Room(ChunkTree& tree, std::shared_ptr<ByteCount> bytes, const PagerSettings& settings)
        : tree_(&tree), bytes_(std::move(bytes)), settings_(settings) {}

    /// Begins an update.
    ///
    /// @param may_jump     nobody looks: nothing has to fade
    void look(std::span<const Watcher> watchers, bool may_jump);
    /// Begins to make room, after needs were found.
    ///
    /// @param has_contact  somebody asks for contact, so that its share is kept free
    void begin(std::span<const Outlook> outlooks, bool has_contact, PagerStats& stats);

    enum class Answer {
        free,
        later,  ///< enough is about to come free
        none,
    };
    /// Evicts until one more chunk fits that is needed so, and claims its bytes.
    ///
    /// @param slack_s  see Wish
    Answer make(const Need& need, double slack_s, ByteClaim& claim);
    /// Whether a claim that was made before may stand for a chunk that is needed so.
    bool may_keep_claim(const Need& need) const { return bytes_->load() <= limit(need.why); }

    bool has_gone() const { return !gone_.empty(); }
    /// What was evicted since the last call, in order of eviction.
    std::vector<ChunkKey> take_gone() { return std::exchange(gone_, {}); }

    /// How a chunk's coming or going would show now.
    const Watch& watch_of(ChunkTree::Node& node);
    std::size_t bytes() const { return bytes_->load(); }

private:
    /// In this order they go.
    enum class Tier : std::uint8_t {
        unneeded,
        speculative,
        drawn_later,
        drawn_now,
        contact_later,
        pinned,  ///< never
    };
    struct Candidate {
        Tier tier = Tier::unneeded;
        double keep = 0.0;   ///< the least goes first
        double worth = 0.0;  ///< what is wanted must be worth more
        ChunkKey key;
        ChunkTree::Index index = ChunkTree::kNone;
        bool operator<(const Candidate& other) const;  // the one to go first is the largest
    };
    // A chunk that was let go of: its bytes come free when nobody holds an old set any more.
    struct Evicted {
        std::weak_ptr<const Chunk> chunk;
        std::size_t bytes = 0;
        std::uint64_t update = 0;
    };

    std::size_t limit(NeedClass why) const;
    std::size_t soon_free_bytes();
    Candidate candidate(ChunkTree::Index index) const;
    bool is_outweighed(const Candidate& held, const Need& wanted) const;
    std::priority_queue<Candidate>* find_victim(const Need& need);
    void add_candidate(ChunkTree::Index index);
    void list_candidates();
    void evict(ChunkTree::Index index);

    ChunkTree* tree_;
    std::shared_ptr<ByteCount> bytes_;
    PagerSettings settings_;
    std::vector<Evicted> evicted_;
    std::vector<ChunkKey> gone_;
    std::uint64_t update_ = 0;

    // of the update
    std::span<const Outlook> outlooks_;
    std::span<const Watcher> watchers_;
    bool may_jump_ = false;
    std::size_t contact_reserve_ = 0;
    std::size_t waiting_count_ = 0;  // that were answered `later`
    std::size_t leaving_count_ = 0;
    std::size_t leaving_bytes_ = 0;
    bool is_listed_ = false;
    std::array<std::priority_queue<Candidate>, 5> candidates_;  // by tier
    PagerStats* stats_ = nullptr;
};

}  // namespace terrane::internal
