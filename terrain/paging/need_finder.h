// SPDX-License-Identifier: MIT
#pragma once

#include "paging/chunk_loader.h"
#include "paging/chunk_tree.h"
#include "paging/demand/contact_needs.h"
#include "paging/demand/need.h"

#include <terrane/terrain/pager.h>

#include <array>
#include <limits>
#include <span>
#include <vector>

namespace terrane::internal {

/// Traverses the tree of resident chunks, computes the need of each, and lists needed absent chunks.
class NeedFinder {
public:
    explicit NeedFinder(const PagerSettings& settings) : settings_(settings) {}

    /// Updates the mean ratio of the error bounds of a level to their parents' bounds, from an arrived chunk of the
    /// level.
    ///
    /// @param bound the parent's error bound over the chunk, metres
    void learn_decay(const Chunk& chunk, double bound);

    /// Bytes read from storage for resident chunks, by whether the chunks have been needed.
    struct Bytes {
        std::size_t used = 0;     ///< for chunks first needed in this plan
        std::size_t awaited = 0;  ///< for chunks not needed yet, but predicted to be
    };

    /// Sets the need of every node and lists the needed absent chunks, including those descendants of absent chunks
    /// that would arrive late if they were requested only after their parents' arrival. Cameras and regions treat an
    /// outline as an absent chunk.
    ///
    /// Cost: proportional to the needed chunks, present and absent, and those needed before
    ///
    /// @param may_guess  false: for cameras, list only roots and children of resident chunks
    Bytes find(ChunkTree& tree, std::span<const PredictedView> predicted_views,
               const ContactNeeds& contact, const LoadTimes& times, double time_s, bool may_guess);

    /// Candidates of the last find(), unordered.
    std::vector<LoadCandidate>& candidates() { return candidates_; }
    /// The resident nodes that the last find() visited; all others have no need.
    std::span<const ChunkTree::Index> needed() const { return needed_; }

private:
    Need camera_need(const WorldBox& box, double bound, double arrival_s, bool is_resident) const;
    Need retention_need(const ChunkTree::Node& node, const WorldBox& box, double bound,
                        double arrival_s) const;
    Need contact_need(ContactNeeds::Slot slot) const;
    bool is_of_region(ContactNeeds::Slot slot) const;
    void count_used(ChunkTree::Node& node);
    void set_need(ChunkTree::Node& node, ChunkTree::Index index, const Need& need);
    double slack_of(const Need& need, double load_s) const;
    /// The combined needs of a chunk and its descendants.
    struct Needs {
        Need all;
        Need of_drawing;  ///< without those of bodies
    };
    Needs visit(ChunkTree& tree, ChunkTree::Index index, ContactNeeds::Slot slot);
    Needs visit_child(ChunkTree& tree, ChunkTree::Index index, int quadrant,
                      ContactNeeds::Slot slot);
    /// The least slack of an absent chunk and its absent descendants, and their needs without those of bodies.
    struct Absent {
        double slack_s = std::numeric_limits<double>::infinity();
        Need of_drawing;
    };
    Absent visit_absent(const ChunkKey& key, ContactNeeds::Slot slot, const WorldBox& box,
                        double bound, double arrival_s, const Needs& needs);
    Absent visit_below_absent(const ChunkKey& key, ContactNeeds::Slot slot, const WorldBox& box,
                              double bound, double arrival_s, NeedClass why);
    double decay(int level) const { return decays_[static_cast<std::size_t>(level)]; }

    PagerSettings settings_;
    std::array<double, 32> decays_ =
        filled_decays();  ///< mean ratio of a level's bound to its parent's
    static std::array<double, 32> filled_decays();

    // of the last find()
    std::span<const PredictedView> predicted_views_;
    const ContactNeeds* contact_ = nullptr;
    const LoadTimes* times_ = nullptr;
    double time_s_ = 0.0;
    bool may_guess_ = true;
    const ChunkTree* tree_ = nullptr;
    const Lattice* lattice_ = nullptr;
    Bytes bytes_;
    std::vector<LoadCandidate> candidates_;
    std::vector<ChunkTree::Index> needed_;  // nodes whose need was set
};

}  // namespace terrane::internal
