// SPDX-License-Identifier: MIT
#pragma once

#include "paging/chunk_tree.h"
#include "paging/demand/contact_needs.h"
#include "paging/load_times.h"
#include "paging/demand/predicted_view.h"

#include <terrane/terrain/pager.h>

#include <array>
#include <span>
#include <vector>

namespace terrane::internal {

/// Walks the resident chunks down as far as anybody needs to go: what each is needed for, and what is
/// absent.
class NeedFinder {
public:
    NeedFinder(const PagerSettings& settings, int contact_level)
        : settings_(settings), contact_level_(contact_level) {}

    /// What an arrived chunk teaches about its level.
    ///
    /// @param bound what its parent expected it to improve on, metres
    void learn(const Chunk& chunk, double bound);

    /// Bytes that were read for chunks.
    struct Bytes {
        std::size_t used = 0;     ///< that are needed now for the first time
        std::size_t awaited = 0;  ///< that nobody has needed yet, but somebody will
    };

    /// Sets the need of every node, and lists what is absent: also what lies below absent chunks, as far
    /// as it is needed before it could be asked for in turn.
    ///
    /// @param may_guess  false: only what hangs below resident chunks
    Bytes find(ChunkTree& tree, std::span<const Outlook> outlooks, const ContactNeeds& contact,
               const LoadTimes& times, double time_s, bool may_guess);

    /// In no order.
    std::vector<Wish>& wishes() { return wishes_; }

private:
    Need camera_need(const Box& box, double bound, double arrival_s, bool is_there) const;
    Need held_need(const ChunkTree::Node& node, const Box& box, double bound,
                   double arrival_s) const;
    Need contact_need(const ChunkKey& key) const;
    void count_used(ChunkTree::Node& node);
    Need visit(ChunkTree& tree, ChunkTree::Index index);
    double visit_absent(const ChunkKey& key, const Box& box, double bound, double arrival_s,
                        const Need& need);
    void visit_below_absent(const ChunkKey& key, const Box& box, double bound, double arrival_s,
                            NeedClass why, double& slack_s);
    double decay(int level) const { return decays_[static_cast<std::size_t>(level)]; }

    PagerSettings settings_;
    int contact_level_ = 0;
    std::array<double, 32> decays_ = filled_decays();  ///< of bounds, from a level to the next
    static std::array<double, 32> filled_decays();

    // of the plan
    std::span<const Outlook> outlooks_;
    const ContactNeeds* contact_ = nullptr;
    const LoadTimes* times_ = nullptr;
    double time_s_ = 0.0;
    bool may_guess_ = true;
    const ChunkTree* tree_ = nullptr;
    const Lattice* lattice_ = nullptr;
    Bytes bytes_;
    std::vector<Wish> wishes_;
};

}  // namespace terrane::internal
