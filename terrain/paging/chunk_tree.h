// SPDX-License-Identifier: MIT
#pragma once

#include "paging/fades.h"
#include "paging/demand/need.h"
#include "paging/demand/predicted_view.h"

#include <terrane/terrain/chunk.h>

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

namespace terrane::internal {

/// The resident chunks as the pager walks them: each knows its children, and its parent is there too.
class ChunkTree {
public:
    using Index = std::int32_t;
    static constexpr Index kNone = -1;

    struct Node {
        std::shared_ptr<const Chunk> chunk;
        Index parent = kNone;
        std::array<Index, 4> child{kNone, kNone, kNone, kNone};
        int child_count = 0;
        /// What quadrants cover and what the child there can improve on, metres.
        std::array<Box, 4> boxes;
        std::array<double, 4> bounds{};

        Need need;                   ///< of the last plan
        std::size_t bytes_read = 0;  ///< from storage, for it
        double contact_until_s = -std::numeric_limits<double>::infinity();  ///< as foreseen last
        bool was_needed = false;   ///< somebody did need it while it was there
        bool is_leaving = false;   ///< fades out, to make room
        bool was_leaving = false;  ///< in the last update
        bool is_new = true;        ///< not in a set yet
        double inverse_fade = 1.0;
        std::optional<Watch> watch;  ///< of this update, once somebody asked
    };

    explicit ChunkTree(const Lattice& lattice);

    /// Requires its parent, and that it is not there yet.
    Index insert(std::shared_ptr<const Chunk> chunk);
    /// Requires that it has no children.
    void erase(Index index);

    Index find(const ChunkKey& key) const;
    Node& operator[](Index index) { return nodes_[static_cast<std::size_t>(index)]; }
    const Node& operator[](Index index) const { return nodes_[static_cast<std::size_t>(index)]; }
    std::size_t size() const { return index_.size(); }
    /// Nodes are 0 to capacity(); those without a chunk are free.
    Index capacity() const { return static_cast<Index>(nodes_.size()); }

    const Lattice& lattice() const { return lattice_; }
    /// Keys of all root squares, row by row.
    const std::vector<ChunkKey>& roots() const { return roots_; }

private:
    Lattice lattice_;
    std::vector<ChunkKey> roots_;
    std::vector<Node> nodes_;
    std::vector<Index> free_;
    std::unordered_map<ChunkKey, Index, ChunkKeyHash> index_;  // looked up, never walked
};

/// Where a chunk lies in the plane, metres.
WorldRect rect_of(const Lattice& lattice, const ChunkKey& key);

/// Whether a rectangle and a chunk share a point.
bool overlaps(const Lattice& lattice, const ChunkKey& key, const WorldRect& rect);

}  // namespace terrane::internal
