// SPDX-License-Identifier: MIT
#pragma once

#include "chunk/chunk_outline.h"
#include "paging/demand/need.h"

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/chunk_source.h>
#include <terrane/terrain/view.h>

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

namespace terrane::internal {

/// A camera to which chunks may visibly appear or vanish.
struct FadeObserver {
    View view;
    Frustum frustum;
    double threshold_px = 1.0;
    /// Its view at the previous update; absent for a new camera.
    struct PreviousView {
        WorldPos eye_world;
        Frustum frustum;
    };
    std::optional<PreviousView> previous;
};

/// Visibility of a chunk's fade.
struct FadeVisibility {
    /// Upper bound of (screen error of the chunk's vertices) / (the camera's threshold), for the camera with the
    /// largest ratio; 0 if no camera would see the chunk change. Screen errors are clamped to the largest one that
    /// fades hold back: up to that error, a fade of at most 1 / ratio hides the chunk.
    double ratio = 0.0;
    double fade_in = 1.0;   ///< least 1 / fade after one more update of fading in
    double fade_out = 1.0;  ///< greatest 1 / fade after one more update of fading out
};

/// Evaluates a chunk for the cameras that would see it change. A camera sees a change if its present and its previous
/// frustum may both contain part of the affected surface, at a distance of more than ten times the eye's displacement.
/// The camera that sees most of the change limits the fade's step. No camera sees chunks below its threshold.
///
/// @param inverse_fade 1 / fade of the chunk now, >= 1
FadeVisibility find_fade_visibility(const Lattice& lattice, const Chunk& chunk,
                                    std::span<const FadeObserver> observers, double inverse_fade);

/// 1 / fade of a chunk after one more update.
///
/// @param is_new        inserted in this update
/// @param is_fading_out true: to be evicted; false: fades in
double next_inverse_fade(const FadeVisibility& visibility, bool is_new, bool is_fading_out);

/// 1 / inverse_fade, rounded down.
float fade_of(double inverse_fade);

/// The quadtree of resident chunks, with per-chunk state of the pager. The parent of every chunk is resident.
class ChunkTree {
public:
    using Index = std::int32_t;
    static constexpr Index kNone = -1;

    /// A resident chunk, or its outline; neither in a free node. It is drawn if the chunk and all its ancestors are
    /// there.
    struct Node {
        ChunkKey key;
        Index parent = kNone;
        std::array<Index, 4> child{kNone, kNone, kNone, kNone};
        int child_count = 0;
        bool is_drawn = false;
        bool is_to_be_drawn =
            false;  ///< at the last plan: whether a camera or a region needs the chunk
        bool was_needed = false;      ///< has been needed while resident
        bool is_fading_out = false;   ///< fades until its eviction
        bool was_fading_out = false;  ///< at the previous plan
        bool is_new = false;          ///< drawn, but not in a ResidentSet yet
        bool is_fading = false;       ///< in the pager's list of chunks whose fade may change
        Need need;                    ///< from the last plan
        double contact_until_s = -std::numeric_limits<double>::infinity();  ///< kept until then
        std::size_t bytes = 0;       ///< of the chunk or the outline
        std::size_t bytes_read = 0;  ///< from storage
        std::shared_ptr<const ChunkOutline> outline;
        std::shared_ptr<const Chunk> chunk;

        double inverse_fade = 1.0;
        std::optional<FadeVisibility> visibility;  ///< of this update, computed on demand

        bool is_free() const { return chunk == nullptr && outline == nullptr; }
        /// Largest cell bound of a quadrant, metres. Requires a node that is not free.
        double quadrant_bound(int quadrant) const {
            const auto at = static_cast<std::size_t>(quadrant);
            return static_cast<double>(chunk != nullptr ? chunk->quadrant_bound[at]
                                                        : outline->quadrant_bound[at]);
        }
    };

    /// What cameras need to know of the quadrants of a chunk, apart from the nodes, which every plan reads.
    struct Quadrants {
        /// [quadrant] Bounding box of the surface, and error bound, metres, if the child is absent. They include those
        /// of the midpoints on the sides of drawn chunks beside the child, which are not active without it.
        std::array<WorldBox, 4> boxes;
        std::array<double, 4> bounds{};
    };

    /// @param source gives the extents of volumes; has the same lattice, and outlives the tree
    ChunkTree(const Lattice& lattice, const ChunkSource& source);

    /// Inserts a chunk with a resident parent, unless it is a root. Replaces the outline of the chunk, if there is one;
    /// the chunk itself must not be resident.
    Index insert(std::shared_ptr<const Chunk> chunk);
    /// Requires a chunk without children.
    void erase(Index index);
    /// Replaces a chunk, or its outline, by a chunk of the same key.
    void replace(Index index, std::shared_ptr<const Chunk> chunk);
    /// Replaces a chunk by its outline. Its descendants are not drawn any more.
    void replace(Index index, std::shared_ptr<const ChunkOutline> outline);
    /// Updates boxes and bounds of a chunk's resident ancestors after volumes over the chunk have changed.
    void refresh_above(const ChunkKey& key);

    Index find(const ChunkKey& key) const;
    Node& operator[](Index index) { return nodes_[static_cast<std::size_t>(index)]; }
    const Node& operator[](Index index) const { return nodes_[static_cast<std::size_t>(index)]; }
    /// The quadrants of a node's chunk, of a level above the finest.
    const Quadrants& quadrants(Index index) const {
        return quadrants_[static_cast<std::size_t>(index)];
    }
    std::size_t size() const { return index_.size(); }
    /// Nodes have indices below capacity(); those without a chunk are free.
    Index capacity() const { return static_cast<Index>(nodes_.size()); }

    const Lattice& lattice() const { return lattice_; }
    /// The lattice of the root squares that may be resident: see ResidentSet::window().
    const Lattice& window() const { return window_; }
    /// Requires that no chunk outside the window is resident.
    void set_window(const Lattice& window);
    /// Keys of the window's root squares, row by row.
    const std::vector<ChunkKey>& roots() const { return roots_; }

    /// Keys of the chunks that were inserted, replaced, erased, shown or hidden since the last call; some repeatedly.
    std::vector<ChunkKey> take_changes() { return std::exchange(changes_, {}); }
    bool has_changes() const { return !changes_.empty(); }
    /// Nodes that were drawn since the last call and whose fades have not begun; some may be free by now.
    std::vector<Index> take_shown() { return std::exchange(shown_, {}); }

private:
    void set_drawn(Index index, bool is_drawn);
    void find_quadrants(Index index);
    void find_quadrant(Index index, int quadrant);
    void find_quadrants_beside(const ChunkKey& key);

    const ChunkSource* source_;
    Lattice lattice_, window_;
    std::vector<ChunkKey> roots_;
    std::vector<Node> nodes_;
    std::vector<Quadrants> quadrants_;  // [nodes_]
    std::vector<Index> free_;
    std::vector<ChunkKey> changes_;
    std::vector<Index> shown_;
    std::unordered_map<ChunkKey, Index, ChunkKeyHash> index_;  // never iterated
};

/// The square of a chunk, world, metres.
WorldRect rect_of(const Lattice& lattice, const ChunkKey& key);

/// Whether a rectangle and a chunk's closed square share a point.
bool overlaps(const Lattice& lattice, const ChunkKey& key, const WorldRect& rect);

}  // namespace terrane::internal
