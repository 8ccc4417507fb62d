// SPDX-License-Identifier: MIT
#include "paging/chunk_tree.h"

#include "chunks/root_window.h"

#include <terrane/terrain/assert.h>
#include <terrane/terrain/height_source.h>

#include <algorithm>

namespace terrane::internal {

WorldRect rect_of(const Lattice& lattice, const ChunkKey& key) {
    const LatticePoint corner = lattice.corner(key);
    const std::int64_t side = lattice.chunk_side(key.level);
    return {lattice.x(corner.x), lattice.y(corner.y), lattice.x(corner.x + side),
            lattice.y(corner.y + side)};
}

bool overlaps(const Lattice& lattice, const ChunkKey& key, const WorldRect& rect) {
    const WorldRect own = rect_of(lattice, key);
    return own.west <= rect.east && own.east >= rect.west && own.south <= rect.north &&
           own.north >= rect.south;
}

ChunkTree::ChunkTree(const HeightSource& source) : source_(&source), lattice_(source.lattice()) {
    set_window(first_root_window(lattice_));
}

void ChunkTree::set_window(const Lattice& window) {
    window_ = window;
    roots_.clear();
    for (std::int32_t y = 0; y < window.root_count_y; ++y) {
        for (std::int32_t x = 0; x < window.root_count_x; ++x) {
            roots_.push_back({window.first_root_x + x, window.first_root_y + y, 0});
        }
    }
}

ChunkTree::Index ChunkTree::insert(std::shared_ptr<const Chunk> chunk) {
    const ChunkKey key = chunk->key;
    Index index = capacity();
    if (free_.empty()) {
        nodes_.emplace_back();
    } else {
        index = free_.back();
        free_.pop_back();
    }
    const bool is_first = index_.emplace(key, index).second;
    TERRANE_ASSERT(is_first, "no chunk may be resident twice");
    static_cast<void>(is_first);
    Node& node = (*this)[index];
    node = {};
    if (key.level > 0) {
        node.parent = find(key.parent());
        TERRANE_ASSERT(node.parent != kNone, "the parent of a resident chunk must be resident");
        Node& parent = (*this)[node.parent];
        parent.child[static_cast<std::size_t>(key.quadrant())] = index;
        ++parent.child_count;
    }
    node.chunk = std::move(chunk);
    if (key.level < lattice_.finest_level) find_quadrants(node);
    return index;
}

// Sets boxes and bounds.
void ChunkTree::find_quadrants(Node& node) const {
    for (int quadrant = 0; quadrant < 4; ++quadrant) find_quadrant(node, quadrant);
}

void ChunkTree::find_quadrant(Node& node, int quadrant) const {
    const Chunk& chunk = *node.chunk;
    const auto at = static_cast<std::size_t>(quadrant);
    const ChunkKey child = chunk.key.child(quadrant);
    double bound = static_cast<double>(chunk.quadrant_bound[at]);
    // the surface over the child, with a margin of one of its cells
    const double margin = lattice_.level_spacing(child.level);
    constexpr int kHalf = kChunkAreas / 2;
    std::int32_t low = chunk.high;
    std::int32_t high = chunk.low;
    for (int i = 0; i < kHalf * kHalf; ++i) {
        const int column = i % kHalf + (quadrant & 1) * kHalf;
        const int row = i / kHalf + (quadrant >> 1) * kHalf;
        const Chunk::Area& area = chunk.areas[static_cast<std::size_t>(row * kChunkAreas + column)];
        low = std::min(low, area.low);
        high = std::max(high, area.high);
    }
    HeightInterval heights{lattice_.quantum * low - bound, lattice_.quantum * high + bound};
    if (const auto solid = source_->solid_extent(child)) {
        bound += solid->error_m;
        heights = {std::min(heights.low, solid->heights.low),
                   std::max(heights.high, solid->heights.high)};
    }
    const WorldRect rect = rect_of(lattice_, child);
    node.bounds[at] = bound;
    node.boxes[at] = {{rect.west - margin, rect.south - margin, heights.low},
                      {rect.east + margin, rect.north + margin, heights.high}};
}

void ChunkTree::replace(Index index, std::shared_ptr<const Chunk> chunk) {
    Node& node = (*this)[index];
    TERRANE_ASSERT(node.chunk->key == chunk->key, "a chunk is replaced by one of its key");
    node.chunk = std::move(chunk);
    node.visibility.reset();
    if (node.chunk->key.level < lattice_.finest_level) find_quadrants(node);
}

void ChunkTree::refresh_above(const ChunkKey& key) {
    for (ChunkKey at = key; at.level > 0; at = at.parent()) {
        const Index above = find(at.parent());
        if (above != kNone) find_quadrant((*this)[above], at.quadrant());
    }
}

void ChunkTree::erase(Index index) {
    Node& node = (*this)[index];
    TERRANE_ASSERT(node.child_count == 0, "children go before their parents");
    const ChunkKey key = node.chunk->key;
    if (node.parent != kNone) {
        Node& parent = (*this)[node.parent];
        parent.child[static_cast<std::size_t>(key.quadrant())] = kNone;
        --parent.child_count;
    }
    index_.erase(key);
    node = {};
    free_.push_back(index);
}

ChunkTree::Index ChunkTree::find(const ChunkKey& key) const {
    const auto found = index_.find(key);
    return found == index_.end() ? kNone : found->second;
}

}  // namespace terrane::internal
