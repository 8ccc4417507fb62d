// SPDX-License-Identifier: MIT
//
// Errors of triangles whose refinement is blocked by missing vertices. If the vertex that would split a triangle is
// missing, the triangle's error is at most the vertex's bound at the triangle's distance. This error is evaluated for
// one triangle at a time, in double precision, over the part of the triangle that may be in view.
#include "lod/frame_mesh.h"

#include <algorithm>
#include <array>
#include <bit>

namespace terrane::internal {
namespace {

// Converts a column or row beyond a chunk's side to the neighbour's coordinates.
int wrap(int i) { return i < 0 ? i + kChunkCells : i > kChunkCells ? i - kChunkCells : i; }

class ResidualErrorSearch {
public:
    ResidualErrorSearch(const OpenChunk& chunk, const VertexKeys& keys, const ScreenError& screen,
                        float threshold, const Morph& morph, ResidualError& residual)
        : chunk_(chunk),
          keys_(keys),
          screen_(screen),
          threshold_(threshold),
          in_place_(morph.in_place(threshold)),
          morph_(morph),
          residual_(residual) {}

    double visit_cells(double most);
    void visit_finest_cells();
    void visit_held_vertices();

private:
    double cell_error(int column, int row, double most) const;
    double pixels_per_metre(int area) const;
    template <class Visitor>
    void for_each_drawn_cell(int area, const Visitor& visitor) const;
    double area_error(int area, double most) const;
    void visit_held_area(int area);
    void visit_held_sides();
    void visit_held_coarse();
    void visit_vertex(int column, int row, int stride, float own_key);
    double midpoint_error(int column, int row, int stride, double bound, double most) const;
    bool has_parent(int column, int row, int stride) const;
    bool is_active(int column, int row) const { return chunk_.key_at(column, row) < threshold_; }
    /// Whether a vertex is held by its parents: it is displayed with less than the share of its own key, because it is
    /// inactive or morphs with its parents' key.
    bool is_held(float own_key, float key) const {
        return own_key < threshold_ && own_key * kNestMargin < key && !(key < in_place_);
    }
    /// World position of a sample of `owner`, at a column and row of this chunk that may be beyond this chunk's sides.
    Eigen::Vector3d point(const Chunk& owner, int column, int row) const {
        const Lattice& lattice = keys_.lattice();
        const Chunk& chunk = *chunk_.chunk;
        return {lattice.x(chunk.corner.x + column * chunk.step),
                lattice.y(chunk.corner.y + row * chunk.step),
                lattice.quantum * owner.heights[sample_index(wrap(column), wrap(row))]};
    }
    Eigen::Vector3d point(int column, int row) const { return point(*chunk_.chunk, column, row); }
    double error_of_square(int west, int south, int side, double bound, double most) const;

    const OpenChunk& chunk_;
    const VertexKeys& keys_;
    const ScreenError& screen_;
    float threshold_;
    float in_place_;
    const Morph& morph_;
    ResidualError& residual_;
};

// Error over a square of the chunk's samples that is cut along either diagonal.
double ResidualErrorSearch::error_of_square(int west, int south, int side, double bound,
                                            double most) const {
    const std::array<Eigen::Vector3d, 4> corners{point(west, south), point(west + side, south),
                                                 point(west + side, south + side),
                                                 point(west, south + side)};
    for (std::size_t i = 0; i < 4; ++i) {
        const ScreenError::Triangle without{corners[(i + 1) % 4], corners[(i + 2) % 4],
                                            corners[(i + 3) % 4]};
        most = std::max(most, screen_.error_in_view(without, bound));
    }
    return most;
}

double ResidualErrorSearch::cell_error(int column, int row, double most) const {
    const auto bound = static_cast<double>(chunk_.chunk->cell_bounds[cell_index(column, row)]);
    return error_of_square(column, row, 1, bound, most);
}

// Largest screen error of a deviation of 1 m over the cells of an area; 0 if no part of the area is in view.
double ResidualErrorSearch::pixels_per_metre(int area) const {
    const Chunk& chunk = *chunk_.chunk;
    const auto at_most =
        static_cast<double>(chunk.areas[static_cast<std::size_t>(area)].max_cell_bound);
    ScreenError::WorldBox box = screen_.box_of_area(chunk, area);
    box.low.z() -= at_most;
    box.high.z() += at_most;
    return screen_.error_in_view(box, 1.0) * (1.0 + 1e-12);
}

// Calls visitor(int column, int row, double bound) for the cells of an area that are drawn undivided.
template <class Visitor>
void ResidualErrorSearch::for_each_drawn_cell(int area, const Visitor& visitor) const {
    const AreaBits bits = area_bits(chunk_, area);
    const int west = area % kChunkAreas * kAreaCells, south = area / kChunkAreas * kAreaCells;
    constexpr std::array<int, 4> kEast{0, 1, 1, 0}, kNorth{0, 0, 1, 1};
    for (std::size_t k = 0; k < 4; ++k) {
        // a quarter is drawn as a cell if both of its sides are split
        std::uint64_t cells =
            bits.centre & bits.split[k] & bits.split[(k + 3) % 4] & ~bits.divided[k];
        for (; cells != 0; cells &= cells - 1) {
            const int square = std::countr_zero(cells);
            const int column = west + 2 * (square % kAreaSquares) + kEast[k];
            const int row = south + 2 * (square / kAreaSquares) + kNorth[k];
            visitor(column, row,
                    static_cast<double>(chunk_.chunk->cell_bounds[cell_index(column, row)]));
        }
    }
}

// Error of the cells of an area that are drawn undivided over an absent child.
double ResidualErrorSearch::area_error(int area, double most) const {
    const auto at_most =
        static_cast<double>(chunk_.chunk->areas[static_cast<std::size_t>(area)].max_cell_bound);
    const double scale = pixels_per_metre(area);
    if (!(at_most * scale > most)) return most;
    for_each_drawn_cell(area, [&](int column, int row, double bound) {
        if (bound * scale > most) most = cell_error(column, row, most);
    });
    return most;
}

double ResidualErrorSearch::visit_cells(double most) {
    constexpr int kHalf = kChunkAreas / 2;
    for_each_bit(chunk_.active_areas, [&](int area) {
        const int quadrant = area % kChunkAreas / kHalf + 2 * (area / kChunkAreas / kHalf);
        if (!chunk_.is_absent[static_cast<std::size_t>(quadrant)]) return;
        most = area_error(area, most);
    });
    return most;
}

// Finds the largest bound of the cells that are drawn at the finest spacing, in areas that are in view.
void ResidualErrorSearch::visit_finest_cells() {
    double& most = residual_.finest_m;
    for_each_bit(chunk_.active_areas, [&](int area) {
        const Chunk::Area& of_area = chunk_.chunk->areas[static_cast<std::size_t>(area)];
        if (!(static_cast<double>(of_area.max_cell_bound) > most)) return;
        if (!(pixels_per_metre(area) > 0.0)) return;
        for_each_drawn_cell(area, [&](int, int, double bound) { most = std::max(most, bound); });
    });
}

// Whether a triangle is drawn that a given centre would split.
bool ResidualErrorSearch::has_parent(int column, int row, int stride) const {
    if (chunk_.is_root() && stride > 1) {
        if (stride == kChunkSquares) return true;
        const bool is_even = ((column / stride + row / stride) / 2) % 2 == 1;
        const int other = is_even ? -stride : stride;
        return is_active(column + stride, row + other) || is_active(column - stride, row - other);
    }
    // corners of the square, as samples of the coarser spacing
    const OpenChunk& owner = chunk_.is_root() ? chunk_ : *chunk_.parent;
    const ChunkKey& key = chunk_.chunk->key;
    const int scale = chunk_.is_root() ? 2 : 1;
    const int shift_x = !chunk_.is_root() && (key.x & 1) != 0 ? kChunkSquares : 0;
    const int shift_y = !chunk_.is_root() && (key.y & 1) != 0 ? kChunkSquares : 0;
    const bool is_even = (column / 2 + row / 2) % 2 == 0;
    const int x = shift_x + column / 2, y = shift_y + row / 2;
    const auto is_corner_active = [&](int to_x, int to_y) {
        return owner.key_at(scale * (x + to_x), scale * (y + to_y)) < threshold_;
    };
    return is_even ? is_corner_active(1, 0) || is_corner_active(0, 1)
                   : is_corner_active(0, 0) || is_corner_active(1, 1);
}

// Adds the error of a vertex if it is held.
void ResidualErrorSearch::visit_vertex(int column, int row, int stride, float own_key) {
    const float key = chunk_.key_at(column, row);
    if (!is_held(own_key, key)) return;
    const auto bound =
        static_cast<double>(bound_of(chunk_.chunk->vertices->inverse_square_bound(column, row)));
    double error_px = 0.0;
    if (((column / stride) & (row / stride) & 1) == 0) {
        error_px = midpoint_error(column, row, stride, bound, 0.0);
    } else if (has_parent(column, row, stride)) {
        error_px = error_of_square(column - stride, row - stride, 2 * stride, bound, 0.0);
    }
    if (key < threshold_) {
        const double shown = screen_.error_px_of(key) / screen_.error_px_of(threshold_);
        const double wanted = error_px / screen_.error_px_of(threshold_);
        residual_.morphing = std::max(residual_.morphing, morph_.error_with_held(wanted, shown));
    } else if (key == OpenChunk::kNever) {
        residual_.absent = std::max(residual_.absent, error_px);
    } else {
        residual_.held = std::max(residual_.held, error_px);
    }
}

// Error of the drawn triangles on both sides of the edge that a midpoint would split. A triangle is drawn if its apex
// is active; the apex may belong to a neighbour.
double ResidualErrorSearch::midpoint_error(int column, int row, int stride, double bound,
                                           double most) const {
    const bool along_x = (column / stride) % 2 != 0;
    const int to_x = along_x ? 0 : stride, to_y = along_x ? stride : 0;
    const Eigen::Vector3d begin = point(column - to_y, row - to_x);
    const Eigen::Vector3d end = point(column + to_y, row + to_x);
    for (const int side : {-1, 1}) {
        const int apex_x = column + side * to_x, apex_y = row + side * to_y;
        const OpenChunk* owner = apex_x < 0             ? chunk_.neighbour[west]
                                 : apex_x > kChunkCells ? chunk_.neighbour[east]
                                 : apex_y < 0           ? chunk_.neighbour[south]
                                 : apex_y > kChunkCells ? chunk_.neighbour[north]
                                                        : &chunk_;
        const int x = wrap(apex_x), y = wrap(apex_y);
        if (owner == nullptr || !(owner->key_at(x, y) < threshold_)) continue;
        const Eigen::Vector3d apex = point(*owner->chunk, apex_x, apex_y);
        most =
            std::max(most, screen_.error_in_view(ScreenError::Triangle{begin, end, apex}, bound));
    }
    return most;
}

void ResidualErrorSearch::visit_held_area(int area) {
    const int west = area % kChunkAreas * kAreaCells, south = area / kChunkAreas * kAreaCells;
    for (const auto kind : {AreaVertices::centre, AreaVertices::along_x, AreaVertices::along_y}) {
        alignas(64) std::array<float, AreaVertices::kSquares> own;
        keys_.own_keys(chunk_, area, kind, own.data());
        const int to_x = kind == AreaVertices::along_y ? 0 : 1;
        const int to_y = kind == AreaVertices::along_x ? 0 : 1;
        std::uint64_t held = keys_.kernels().mask(own.data(), threshold_);
        for (; held != 0; held &= held - 1) {
            const int square = std::countr_zero(held);
            visit_vertex(west + 2 * (square % kAreaSquares) + to_x,
                         south + 2 * (square / kAreaSquares) + to_y, 1,
                         own[static_cast<std::size_t>(square)]);
        }
    }
}

// Visits held vertices: their parents are absent, or have reaches that do not quite enclose theirs.
void ResidualErrorSearch::visit_held_vertices() {
    for_each_bit(chunk_.held_areas, [&](int area) { visit_held_area(area); });
    if (chunk_.is_side_held) visit_held_sides();
    if (chunk_.is_coarse_held) visit_held_coarse();
}

void ResidualErrorSearch::visit_held_sides() {
    for (const Side side : {east, north}) {
        if (chunk_.neighbour[side] != nullptr) continue;
        for (int i = 0; i < kChunkSquares; ++i) {
            const int along = 2 * i + 1;
            visit_vertex(side == east ? kChunkCells : along, side == east ? along : kChunkCells, 1,
                         keys_.own_side_key(chunk_, side, i));
        }
    }
}

void ResidualErrorSearch::visit_held_coarse() {
    for (int row = 0; row <= kChunkSquares; ++row) {
        for (int column = 0; column <= kChunkSquares; ++column) {
            const float own = keys_.own_coarse_key(screen_, chunk_, column, row);
            if (!(own < threshold_)) continue;
            const int stride = 2 << std::countr_zero(static_cast<unsigned>(column | row));
            visit_vertex(2 * column, 2 * row, stride, own);
        }
    }
}

}  // namespace

void find_residual_error(const OpenChunk& chunk, const VertexKeys& keys, const ScreenError& screen,
                         float threshold, const Morph& morph, ResidualError& residual) {
    ResidualErrorSearch search(chunk, keys, screen, threshold, morph, residual);
    const bool is_finest = chunk.chunk->key.level == keys.lattice().finest_level;
    const bool any_absent =
        std::find(chunk.is_absent.begin(), chunk.is_absent.end(), true) != chunk.is_absent.end();
    double& of_cells = is_finest ? residual.finest : residual.absent;
    if (any_absent) of_cells = search.visit_cells(of_cells);
    if (is_finest) search.visit_finest_cells();
    search.visit_held_vertices();
}

}  // namespace terrane::internal
