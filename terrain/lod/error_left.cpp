// SPDX-License-Identifier: MIT
//
// What refinement left undone because something is not there. Where a triangle's next vertex is
// missing, the triangle's error is at most the vertex's bound, seen from where the triangle is: found
// here box by box, in double precision, and only for triangles in view.
#include "error_left.h"

#include "active_set.h"

#include <algorithm>
#include <array>
#include <bit>

namespace terrane::internal {
namespace {

struct HeightRange {
    std::int32_t low, high;
    explicit HeightRange(std::int32_t height) : low(height), high(height) {}
    void take(std::int32_t height) {
        low = std::min(low, height);
        high = std::max(high, height);
    }
};

class Search {
public:
    Search(const OpenChunk& chunk, const VertexKeys& keys, const ScreenError& screen,
           float threshold)
        : chunk_(chunk), keys_(keys), screen_(screen), threshold_(threshold) {}

    double look_at_cells(double most);
    double look_at_held(double most) const;

private:
    double error_of(int west, int south, int east, int north, const HeightRange& heights,
                    double bound) const;
    double look_at_cell(int column, int row, double most) const;
    double look_at_area(int area, double most) const;
    double look_at_vertex(int column, int row, int stride, float own_key, double most) const;
    bool has_parent(int column, int row, int stride, bool is_centre) const;
    bool is_active(int column, int row) const { return chunk_.key_at(column, row) < threshold_; }
    std::int32_t height(int column, int row) const {
        return chunk_.chunk->heights[sample_index(column, row)];
    }

    const OpenChunk& chunk_;
    const VertexKeys& keys_;
    const ScreenError& screen_;
    float threshold_;
};

// Over a rectangle of the chunk's samples.
double Search::error_of(int west, int south, int east, int north, const HeightRange& heights,
                        double bound) const {
    const Lattice& lattice = keys_.lattice();
    const Chunk& chunk = *chunk_.chunk;
    return screen_.error_in_view(
        {{lattice.x(chunk.corner.x + west * chunk.step),
          lattice.y(chunk.corner.y + south * chunk.step), lattice.quantum * heights.low - bound},
         {lattice.x(chunk.corner.x + east * chunk.step),
          lattice.y(chunk.corner.y + north * chunk.step), lattice.quantum * heights.high + bound}},
        bound);
}

double Search::look_at_cell(int column, int row, double most) const {
    HeightRange heights(height(column, row));
    heights.take(height(column + 1, row));
    heights.take(height(column, row + 1));
    heights.take(height(column + 1, row + 1));
    const auto bound = static_cast<double>(chunk_.chunk->cell_bounds[cell_index(column, row)]);
    return std::max(most, error_of(column, row, column + 1, row + 1, heights, bound));
}

// The cells of an area that are drawn undivided, over a child that is not there.
double Search::look_at_area(int area, double most) const {
    const Chunk& chunk = *chunk_.chunk;
    const auto at_most =
        static_cast<double>(chunk.areas[static_cast<std::size_t>(area)].max_cell_bound);
    ScreenError::Box box = screen_.box_of_area(chunk, area);
    box.low.z() -= at_most;
    box.high.z() += at_most;
    const double pixels_per_metre = screen_.error_in_view(box, 1.0) * (1.0 + 1e-12);
    if (!(at_most * pixels_per_metre > most)) return most;
    const AreaBits bits = area_bits(chunk_, area);
    const int west = area % kChunkAreas * kAreaCells, south = area / kChunkAreas * kAreaCells;
    constexpr std::array<int, 4> kEast{0, 1, 1, 0}, kNorth{0, 0, 1, 1};
    for (std::size_t k = 0; k < 4; ++k) {
        // both sides of the quarter are split, or it is no cell yet
        std::uint64_t cells =
            bits.centre & bits.split[k] & bits.split[(k + 3) % 4] & ~bits.divided[k];
        for (; cells != 0; cells &= cells - 1) {
            const int square = std::countr_zero(cells);
            const int column = west + 2 * (square % kAreaSquares) + kEast[k];
            const int row = south + 2 * (square / kAreaSquares) + kNorth[k];
            const auto bound = static_cast<double>(chunk.cell_bounds[cell_index(column, row)]);
            if (bound * pixels_per_metre > most) most = look_at_cell(column, row, most);
        }
    }
    return most;
}

double Search::look_at_cells(double most) {
    constexpr int kHalf = kChunkAreas / 2;
    for_each_area(chunk_.active_areas, [&](int area) {
        const int quadrant = area % kChunkAreas / kHalf + 2 * (area / kChunkAreas / kHalf);
        if (!chunk_.is_absent[static_cast<std::size_t>(quadrant)]) return;
        most = look_at_area(area, most);
    });
    return most;
}

// Whether a triangle is drawn that the vertex would split, with this chunk's samples or above.
bool Search::has_parent(int column, int row, int stride, bool is_centre) const {
    if (!is_centre) {
        const bool along_x = (column / stride) % 2 != 0;
        const int to_x = along_x ? 0 : stride, to_y = along_x ? stride : 0;
        const auto is_inside = [](int x, int y) {
            return x >= 0 && y >= 0 && x <= kChunkCells && y <= kChunkCells;
        };
        return (is_inside(column - to_x, row - to_y) && is_active(column - to_x, row - to_y)) ||
               (is_inside(column + to_x, row + to_y) && is_active(column + to_x, row + to_y));
    }
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

// Where a vertex is wanted, but not active.
double Search::look_at_vertex(int column, int row, int stride, float own_key, double most) const {
    if (!(own_key < threshold_) || is_active(column, row)) return most;
    const bool is_centre = ((column / stride) & (row / stride) & 1) != 0;
    if (!has_parent(column, row, stride, is_centre)) return most;
    const int west = std::max(column - stride, 0), east = std::min(column + stride, kChunkCells);
    const int south = std::max(row - stride, 0), north = std::min(row + stride, kChunkCells);
    HeightRange heights(height(column, row));
    if (is_centre) {
        for (const int x : {west, east}) {
            for (const int y : {south, north}) heights.take(height(x, y));
        }
    } else {
        heights.take(height(west, row));
        heights.take(height(east, row));
        heights.take(height(column, south));
        heights.take(height(column, north));
    }
    const auto bound =
        static_cast<double>(bound_of(chunk_.chunk->inverse_square_bound(column, row)));
    return std::max(most, error_of(west, south, east, north, heights, bound));
}

// Vertices that are wanted, but held back by parents that are not there.
double Search::look_at_held(double most) const {
    for_each_area(chunk_.open_areas, [&](int area) {
        const int west = area % kChunkAreas * kAreaCells, south = area / kChunkAreas * kAreaCells;
        for (const auto kind :
             {AreaVertices::centre, AreaVertices::along_x, AreaVertices::along_y}) {
            std::array<float, AreaVertices::kSquares> own;
            keys_.own_keys(screen_, chunk_, area, kind, own.data());
            const int to_x = kind == AreaVertices::along_y ? 0 : 1;
            const int to_y = kind == AreaVertices::along_x ? 0 : 1;
            for (int i = 0; i < static_cast<int>(own.size()); ++i) {
                most = look_at_vertex(west + 2 * (i % kAreaSquares) + to_x,
                                      south + 2 * (i / kAreaSquares) + to_y, 1,
                                      own[static_cast<std::size_t>(i)], most);
            }
        }
    });
    for (const Side side : {east, north}) {
        if (chunk_.beyond[side] == OpenChunk::Beyond::resident) continue;
        for (int i = 0; i < kChunkSquares; ++i) {
            const int along = 2 * i + 1;
            most = look_at_vertex(side == east ? kChunkCells : along,
                                  side == east ? along : kChunkCells, 1,
                                  keys_.own_side_key(screen_, chunk_, side, i), most);
        }
    }
    if (!chunk_.is_root()) return most;
    for (int row = 0; row <= kChunkSquares; ++row) {
        for (int column = 0; column <= kChunkSquares; ++column) {
            const float own = keys_.own_coarse_key(screen_, chunk_, column, row);
            if (!(own < threshold_)) continue;
            const int stride = 2 << std::countr_zero(static_cast<unsigned>(column | row));
            most = look_at_vertex(2 * column, 2 * row, stride, own, most);
        }
    }
    return most;
}

}  // namespace

void find_error_left(const OpenChunk& chunk, const VertexKeys& keys, const ScreenError& screen,
                     float threshold, ErrorLeft& left) {
    Search search(chunk, keys, screen, threshold);
    const bool is_finest = chunk.chunk->key.level == keys.lattice().finest_level;
    const bool any_absent =
        std::find(chunk.is_absent.begin(), chunk.is_absent.end(), true) != chunk.is_absent.end();
    double& of_cells = is_finest ? left.finest : left.absent;
    if (any_absent) of_cells = search.look_at_cells(of_cells);
    if (chunk.is_held) left.absent = search.look_at_held(left.absent);
}

}  // namespace terrane::internal
