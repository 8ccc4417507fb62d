// SPDX-License-Identifier: MIT
#pragma once

#include "paging/demand/need.h"

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/view.h>

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace terrane::internal {

/// A camera that may see chunks appear and vanish.
struct FadeObserver {
    View view;
    Frustum frustum;
    double threshold_px = 1.0;
    /// Its view at the update before; absent for a new camera.
    struct PreviousView {
        WorldPos eye_world;
        Frustum frustum;
    };
    std::optional<PreviousView> previous;
};

/// How visible the fade of a chunk is.
struct FadeVisibility {
    /// Upper bound of the largest screen error of its vertices over the camera's threshold, maximum over the
    /// cameras; 0 if none would see it change. Errors are limited to the most that fades ever hold back. A
    /// fade of at most 1 / ratio hides the chunk, or that much of it.
    double ratio = 0.0;
    double fade_in = 1.0;   ///< least 1 / fade after one more update of fading in
    double fade_out = 1.0;  ///< greatest 1 / fade after one more update of fading out
};

/// Evaluates a chunk for the cameras that would see it change: those whose last two frusta both may contain
/// some of the surface that it moves, farther away than ten times the eye's displacement between them. The
/// step of the fade is that of the camera that sees most of it; a chunk below a camera's threshold is invisible
/// to it.
///
/// @param inverse_fade 1 / fade of the chunk now, >= 1
FadeVisibility find_fade_visibility(const Lattice& lattice, const Chunk& chunk,
                                    std::span<const FadeObserver> observers, double inverse_fade);

/// 1 / fade of a chunk after one more update.
///
/// @param is_new        it was inserted in this update
/// @param is_fading_out it is to be evicted; else it fades in
double next_inverse_fade(const FadeVisibility& visibility, bool is_new, bool is_fading_out);

/// 1 / inverse_fade, rounded down.
float fade_of(double inverse_fade);

/// The quadtree of resident chunks with the pager's state of each. Every chunk's parent is resident.
class ChunkTree {
public:
    using Index = std::int32_t;
    static constexpr Index kNone = -1;

    struct Node {
        std::shared_ptr<const Chunk> chunk;
        Index parent = kNone;
        std::array<Index, 4> child{kNone, kNone, kNone, kNone};
        int child_count = 0;
        /// By quadrant: the box of the surface there, and the bound that loading a child can reduce, metres.
        std::array<WorldBox, 4> boxes;
        std::array<double, 4> bounds{};

        Need need;                   ///< found by the last plan
        std::size_t bytes_read = 0;  ///< from storage
        double contact_until_s = -std::numeric_limits<double>::infinity();  ///< last prediction
        bool was_needed = false;      ///< it was needed while resident
        bool is_fading_out = false;   ///< before its eviction
        bool was_fading_out = false;  ///< in the update before
        bool is_new = true;           ///< not in a ResidentSet yet
        double inverse_fade = 1.0;
        std::optional<FadeVisibility> visibility;  ///< of this update, computed on demand
    };

    /// @param source outlives the tree, which asks it for the extents of volumes
    explicit ChunkTree(const HeightSource& source);

    /// Requires a resident parent, except of roots, and a chunk that is not resident.
    Index insert(std::shared_ptr<const Chunk> chunk);
    /// Requires a chunk without children.
    void erase(Index index);
    /// Exchanges a chunk for another one of the same key.
    void replace(Index index, std::shared_ptr<const Chunk> chunk);
    /// Asks the source again what volumes add over a chunk, for the resident chunks above it.
    void refresh_above(const ChunkKey& key);

    Index find(const ChunkKey& key) const;
    Node& operator[](Index index) { return nodes_[static_cast<std::size_t>(index)]; }
    const Node& operator[](Index index) const { return nodes_[static_cast<std::size_t>(index)]; }
    std::size_t size() const { return index_.size(); }
    /// Nodes have indices below capacity(); those without a chunk are free.
    Index capacity() const { return static_cast<Index>(nodes_.size()); }

    const Lattice& lattice() const { return lattice_; }
    /// The lattice of the root squares that may be resident: see ResidentSet::window().
    const Lattice& window() const { return window_; }
    /// Requires that no chunk outside of it is resident.
    void set_window(const Lattice& window);
    /// Keys of the window's root squares, row by row.
    const std::vector<ChunkKey>& roots() const { return roots_; }

private:
    void find_quadrants(Node& node) const;
    void find_quadrant(Node& node, int quadrant) const;

    const HeightSource* source_;
    Lattice lattice_, window_;
    std::vector<ChunkKey> roots_;
    std::vector<Node> nodes_;
    std::vector<Index> free_;
    std::unordered_map<ChunkKey, Index, ChunkKeyHash> index_;  // never iterated
};

/// The square of a chunk, world, metres.
WorldRect rect_of(const Lattice& lattice, const ChunkKey& key);

/// Whether a rectangle and a chunk's closed square share a point.
bool overlaps(const Lattice& lattice, const ChunkKey& key, const WorldRect& rect);

}  // namespace terrane::internal
