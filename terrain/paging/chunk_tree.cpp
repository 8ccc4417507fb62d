// SPDX-License-Identifier: MIT
//
// Fades. A vertex with screen error p in a chunk with fade f has the priority f p. It is not displaced while this is
// below the threshold t; above t it is displaced by the share F (1 - (t / (f p))^2) of its rise, at most 1, where
// F = w^2 / (w^2 - 1) and w is the morph ratio. The derivative of the share with respect to 1 / f is at most 2 F t / p.
// So a change of 1 / f by d moves the vertex by at most 2 F t d pixels, whatever p and f are. Therefore 1 / f changes
// in equal steps; t / f is the screen error that is still held back.
#include "paging/chunk_tree.h"

#include "chunk/chunk_vertices.h"
#include "chunk/resident_set.h"
#include "paging/demand/need.h"

#include <terrane/base/result.h>
#include <terrane/terrain/resident_set.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

// 2 F of the comment above, for the default morph ratio: largest displacement of a vertex, in thresholds, per change of
// 1 / fade.
constexpr double kMorphGain =
    2.0 * kDefaultMorphRatio * kDefaultMorphRatio / (kDefaultMorphRatio * kDefaultMorphRatio - 1.0);
// Largest displacement of a vertex on screen that fades cause per update.
constexpr double kMostMove_px = 0.25;
// Largest screen error that a fade holds back. Above 1.5 pixels a frame misses its target anyway, and a longer fade
// would only delay a late chunk further.
constexpr double kMostHeld_px = 1.55;
// Fades ignore points nearer than this many displacements of the eye between two frames, because these move on screen
// anyway.
constexpr double kNearDisplacements = 10.0;

enum Side { west, south, east, north };
constexpr std::array kSides{west, south, east, north};

ChunkKey beside(const ChunkKey& key, Side side) {
    return {key.x + (side == east   ? 1
                     : side == west ? -1
                                    : 0),
            key.y + (side == north   ? 1
                     : side == south ? -1
                                     : 0),
            key.level};
}

Side opposite(Side side) { return static_cast<Side>((side + 2) % 4); }

// Largest bound of the midpoints on a side of a chunk, metres.
double side_bound(const Chunk& chunk, Side side) {
    const ChunkVertices& vertices = *chunk.vertices;
    float least = std::numeric_limits<float>::infinity();  // 1 / bound^2
    for (int i = 0; i < kChunkSquares; ++i) {
        const int along = 2 * i + 1;
        const auto at = static_cast<std::size_t>(i);
        const float inverse = side == west    ? vertices.inverse_square_bound(0, along)
                              : side == south ? vertices.inverse_square_bound(along, 0)
                              : side == east
                                  ? from_upper_half(vertices.east_side.inverse_square_bounds[at])
                                  : from_upper_half(vertices.north_side.inverse_square_bounds[at]);
        least = std::min(least, inverse);
    }
    return static_cast<double>(bound_of(least));
}

// Conservative: false only if the box lies outside one of the side planes.
bool may_hold(const Frustum& frustum, const WorldPos& eye, const WorldBox& box) {
    for (const Eigen::Vector3d& normal : frustum.normals) {
        // the corner farthest inside the plane
        const Eigen::Vector3d corner(normal.x() > 0.0 ? box.high.x() : box.low.x(),
                                     normal.y() > 0.0 ? box.high.y() : box.low.y(),
                                     normal.z() > 0.0 ? box.high.z() : box.low.z());
        if (normal.dot(corner - eye) < 0.0) return false;
    }
    return true;
}

// Upper bound, over the vertices of a chunk, of a vertex's error bound divided by the distance from the eye to a box
// that encloses the vertex and its descendants.
double largest_angle(const Lattice& lattice, const Chunk& chunk, const View& view) {
    // half the width of the box: s + s / 2 + s / 2 + s / 4 + ... for a spacing of s
    const double across = 3.0 * lattice.level_spacing(chunk.key.level);
    const std::int64_t side = kAreaCells * chunk.step;
    double largest = 0.0;
    for (int i = 0; i < kChunkAreas * kChunkAreas; ++i) {
        const Chunk::Area& area = chunk.areas[static_cast<std::size_t>(i)];
        const std::int64_t west = chunk.corner.x + i % kChunkAreas * side;
        const std::int64_t south = chunk.corner.y + i / kChunkAreas * side;
        const HeightInterval reach = chunk.vertices->reach_of_area(i);
        const WorldBox box{
            {lattice.x(west) - across, lattice.y(south) - across, reach.low},
            {lattice.x(west + side) + across, lattice.y(south + side) + across, reach.high}};
        const double distance =
            std::max(view.near_distance, std::sqrt(square_distance(box, view.eye_world)));
        largest = std::max(largest, static_cast<double>(area.max_vertex_bound) / distance);
    }
    return largest;
}

}  // namespace

FadeVisibility find_fade_visibility(const Lattice& lattice, const Chunk& chunk,
                                    std::span<const FadeObserver> observers, double inverse_fade) {
    // a vertex affects the surface up to one cell around it
    const double margin = lattice.level_spacing(chunk.key.level);
    const auto bound = static_cast<double>(chunk.max_vertex_bound);
    const LatticePoint corner = chunk.corner;
    const std::int64_t side = lattice.chunk_side(chunk.key.level);
    const WorldBox box{{lattice.x(corner.x) - margin, lattice.y(corner.y) - margin,
                        lattice.quantum * chunk.low - bound},
                       {lattice.x(corner.x + side) + margin, lattice.y(corner.y + side) + margin,
                        lattice.quantum * chunk.high + bound}};
    FadeVisibility visibility;
    double least_out = std::numeric_limits<double>::infinity();
    for (const FadeObserver& observer : observers) {
        const View& view = observer.view;
        if (!observer.previous) continue;
        const double displacement = (view.eye_world - observer.previous->eye_world).norm();
        if (farthest_from(box, view.eye_world) < kNearDisplacements * displacement) continue;
        if (!may_hold(observer.frustum, view.eye_world, box) ||
            !may_hold(observer.previous->frustum, observer.previous->eye_world, box)) {
            continue;
        }
        constexpr double kWider = 1.001;  // allows for the rounding of the triangulator's keys
        const double error_px =
            kWider * view.pixels_per_radian() * largest_angle(lattice, chunk, view);
        const double step = kMostMove_px / (kMorphGain * observer.threshold_px);
        const double ratio = std::min(error_px, kMostHeld_px) / observer.threshold_px;
        visibility.ratio = std::max(visibility.ratio, ratio);
        visibility.fade_in = std::max(visibility.fade_in, std::min(inverse_fade, ratio) - step);
        if (inverse_fade + step < ratio) least_out = std::min(least_out, inverse_fade + step);
    }
    visibility.fade_out = std::max(inverse_fade, std::min(least_out, visibility.ratio));
    return visibility;
}

double next_inverse_fade(const FadeVisibility& visibility, bool is_new, bool is_fading_out) {
    if (is_new) return std::max(1.0, visibility.ratio);
    return is_fading_out ? visibility.fade_out : visibility.fade_in;
}

float fade_of(double inverse_fade) {
    const auto fade = static_cast<float>(1.0 / inverse_fade);
    return static_cast<double>(fade) * inverse_fade > 1.0 ? std::nextafter(fade, 0.0f) : fade;
}

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

ChunkTree::ChunkTree(const Lattice& lattice, const ChunkSource& source)
    : source_(&source), lattice_(lattice) {
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
    if (const Index outlined = find(key); outlined != kNone) {
        TERRANE_ASSERT((*this)[outlined].chunk == nullptr, "no chunk may be resident twice");
        replace(outlined, std::move(chunk));
        return outlined;
    }
    Index index = capacity();
    if (free_.empty()) {
        nodes_.emplace_back();
        quadrants_.emplace_back();
    } else {
        index = free_.back();
        free_.pop_back();
    }
    index_.emplace(key, index);
    Node& node = (*this)[index];
    node = {};
    node.key = key;
    if (key.level > 0) {
        node.parent = find(key.parent());
        TERRANE_ASSERT(node.parent != kNone, "the parent of a resident chunk must be resident");
        Node& parent = (*this)[node.parent];
        parent.child[static_cast<std::size_t>(key.quadrant())] = index;
        ++parent.child_count;
    }
    replace(index, std::move(chunk));
    return index;
}

// Shows or hides a node and its descendants. Chunks below an outline stay hidden.
void ChunkTree::set_drawn(Index index, bool is_drawn) {
    Node& node = (*this)[index];
    if (node.is_drawn == is_drawn || node.chunk == nullptr) return;
    node.is_drawn = is_drawn;
    node.is_new = is_drawn;
    node.is_fading_out = false;
    node.inverse_fade = 1.0;
    if (is_drawn) shown_.push_back(index);
    changes_.push_back(node.key);
    find_quadrants_beside(node.key);
    for (const Index child : node.child) {
        if (child != kNone) set_drawn(child, is_drawn);
    }
}

// Computes boxes and bounds of all quadrants.
void ChunkTree::find_quadrants(Index index) {
    for (int quadrant = 0; quadrant < 4; ++quadrant) find_quadrant(index, quadrant);
}

void ChunkTree::find_quadrant(Index index, int quadrant) {
    const Node& node = (*this)[index];
    Quadrants& found = quadrants_[static_cast<std::size_t>(index)];
    const auto at = static_cast<std::size_t>(quadrant);
    const ChunkKey child = node.key.child(quadrant);
    double bound = node.quadrant_bound(quadrant);
    const SampleRange samples = node.chunk != nullptr ? range_of_quadrant(*node.chunk, quadrant)
                                                      : node.outline->quadrant_range[at];
    // the box bounds the surface over the child, extended by one of the child's cells
    const double margin = lattice_.level_spacing(child.level);
    HeightInterval heights{lattice_.quantum * samples.low - bound,
                           lattice_.quantum * samples.high + bound};
    if (const auto solid = source_->solid_extent(child)) {
        bound += solid->error_m;
        heights = {std::min(heights.low, solid->heights.low),
                   std::max(heights.high, solid->heights.high)};
    }
    for (const Side side : kSides) {
        const Index other = find(beside(child, side));
        if (other == kNone || !(*this)[other].is_drawn) continue;
        const Chunk& chunk = *(*this)[other].chunk;
        const double of_side = side_bound(chunk, opposite(side));
        if (!(of_side > bound)) continue;
        // the triangles that a midpoint splits extend into the chunk beside the child
        bound = of_side;
        heights = {std::min(heights.low, lattice_.quantum * chunk.low - bound),
                   std::max(heights.high, lattice_.quantum * chunk.high + bound)};
    }
    const WorldRect rect = rect_of(lattice_, child);
    found.bounds[at] = bound;
    found.boxes[at] = {{rect.west - margin, rect.south - margin, heights.low},
                       {rect.east + margin, rect.north + margin, heights.high}};
}

// Updates the quadrants that children beside a chunk belong to.
void ChunkTree::find_quadrants_beside(const ChunkKey& key) {
    if (key.level == 0) return;
    for (const Side side : kSides) {
        const ChunkKey child = beside(key, side);
        if (const Index parent = find(child.parent()); parent != kNone)
            find_quadrant(parent, child.quadrant());
    }
}

void ChunkTree::replace(Index index, std::shared_ptr<const Chunk> chunk) {
    Node& node = (*this)[index];
    const bool was_drawn = node.is_drawn;
    TERRANE_ASSERT(node.key == chunk->key, "a chunk is replaced by one of its key");
    const ChunkKey key = node.key;
    node.chunk = std::move(chunk);
    node.bytes = node.chunk->bytes();
    node.outline.reset();
    node.visibility.reset();
    changes_.push_back(node.key);
    if (node.key.level < lattice_.finest_level) find_quadrants(index);
    set_drawn(index, node.parent == kNone || (*this)[node.parent].is_drawn);
    if (was_drawn) find_quadrants_beside(key);
}

void ChunkTree::replace(Index index, std::shared_ptr<const ChunkOutline> outline) {
    Node& node = (*this)[index];
    TERRANE_ASSERT(node.key == outline->key && node.parent != kNone,
                   "a chunk is replaced by its outline, and roots are always drawn");
    set_drawn(index, false);
    node.chunk.reset();
    node.bytes = outline->bytes();
    node.outline = std::move(outline);
    changes_.push_back(node.key);
}

void ChunkTree::refresh_above(const ChunkKey& key) {
    for (ChunkKey at = key; at.level > 0; at = at.parent()) {
        const Index above = find(at.parent());
        if (above != kNone) find_quadrant(above, at.quadrant());
    }
}

void ChunkTree::erase(Index index) {
    Node& node = (*this)[index];
    TERRANE_ASSERT(node.child_count == 0, "children go before their parents");
    const ChunkKey key = node.key;
    changes_.push_back(key);
    if (node.parent != kNone) {
        Node& parent = (*this)[node.parent];
        parent.child[static_cast<std::size_t>(key.quadrant())] = kNone;
        --parent.child_count;
    }
    index_.erase(key);
    const bool was_drawn = node.is_drawn;
    node = {};
    free_.push_back(index);
    if (was_drawn) find_quadrants_beside(key);
}

ChunkTree::Index ChunkTree::find(const ChunkKey& key) const {
    const auto found = index_.find(key);
    return found == index_.end() ? kNone : found->second;
}

}  // namespace terrane::internal
