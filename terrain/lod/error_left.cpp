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

constexpr int kCentres = kChunkCells / 2;

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
    double look_at_cell_row(int row, double most) const;
    double look_at_vertex(int column, int row, int stride, bool is_centre, double most) const;
    bool has_parent(int column, int row, int stride, bool is_centre) const;
    bool is_active(int column, int row) const {
        return chunk_.keys[sample_index(column, row)] < threshold_;
    }
    std::int32_t height(int column, int row) const {
        return chunk_.chunk->heights[sample_index(column, row)];
    }

    const OpenChunk& chunk_;
    const VertexKeys& keys_;
    const ScreenError& screen_;
    float threshold_;
    std::array<double, kChunkAreas * kChunkAreas> pixels_per_metre_{};  // at most, in view
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

// The cells of one row of squares that are drawn undivided, over children that are not there.
double Search::look_at_cell_row(int row, double most) const {
    const SquareRow squares = square_row(chunk_, row);
    constexpr std::array<int, 4> kEast{0, 1, 1, 0}, kNorth{0, 0, 1, 1};
    for (std::size_t k = 0; k < 4; ++k) {
        // both sides of the quarter are split, or it is no cell yet
        std::uint64_t cells =
            squares.centre & squares.split[k] & squares.split[(k + 3) % 4] & ~squares.divided[k];
        const int cell_row = 2 * row + kNorth[k];
        const std::size_t half = cell_row < kCentres ? 0 : 2;
        constexpr std::uint64_t kWestHalf = 0xffffffffu;
        if (!chunk_.is_absent[half]) cells &= ~kWestHalf;
        if (!chunk_.is_absent[half + 1]) cells &= kWestHalf;
        for (; cells != 0; cells &= cells - 1) {
            const int column = 2 * std::countr_zero(cells) + kEast[k];
            const auto area =
                static_cast<std::size_t>(cell_row / kAreaCells * kChunkAreas + column / kAreaCells);
            const auto bound =
                static_cast<double>(chunk_.chunk->cell_bounds[cell_index(column, cell_row)]);
            if (bound * pixels_per_metre_[area] > most) {
                most = look_at_cell(column, cell_row, most);
            }
        }
    }
    return most;
}

double Search::look_at_cells(double most) {
    const Chunk& chunk = *chunk_.chunk;
    for (int row = 0; row < kChunkAreas; ++row) {
        bool any = false;
        for (int column = 0; column < kChunkAreas; ++column) {
            const auto area = static_cast<std::size_t>(row * kChunkAreas + column);
            const auto bound = static_cast<double>(chunk.areas[area].max_cell_bound);
            pixels_per_metre_[area] = 0.0;
            if ((chunk_.open_areas[static_cast<std::size_t>(row)] >> column & 1) == 0) continue;
            ScreenError::Box box = screen_.box_of_area(chunk, static_cast<int>(area));
            box.low.z() -= bound;
            box.high.z() += bound;
            pixels_per_metre_[area] = screen_.error_in_view(box, 1.0) * (1.0 + 1e-12);
            any = any || bound * pixels_per_metre_[area] > most;
        }
        if (!any) continue;
        constexpr int kRows = kAreaCells / 2;
        for (int i = row * kRows; i < (row + 1) * kRows; ++i) most = look_at_cell_row(i, most);
    }
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
    if (chunk_.is_root()) {
        if (stride == kCentres) return true;
        const bool is_even = ((column / stride + row / stride) / 2) % 2 == 1;
        const int other = is_even ? -stride : stride;
        return is_active(column + stride, row + other) || is_active(column - stride, row - other);
    }
    const int shift_x = (chunk_.chunk->key.x & 1) != 0 ? kCentres : 0;
    const int shift_y = (chunk_.chunk->key.y & 1) != 0 ? kCentres : 0;
    const bool is_even = (column / 2 + row / 2) % 2 == 0;
    const int x = shift_x + column / 2, y = shift_y + row / 2;
    const std::vector<float>& parents = chunk_.parent->keys;
    const std::size_t a = is_even ? sample_index(x + 1, y) : sample_index(x, y);
    const std::size_t b = is_even ? sample_index(x, y + 1) : sample_index(x + 1, y + 1);
    return parents[a] < threshold_ || parents[b] < threshold_;
}

double Search::look_at_vertex(int column, int row, int stride, bool is_centre, double most) const {
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
    const auto bound = static_cast<double>(
        bound_of(chunk_.chunk->inverse_square_bounds[sample_index(column, row)]));
    return std::max(most, error_of(west, south, east, north, heights, bound));
}

// Vertices that are wanted, but held back by parents that are not there.
double Search::look_at_held(double most) const {
    std::array<float, OpenChunk::kSamples> own;
    keys_.compute_own(screen_, chunk_, own.data());
    for (int stride = VertexKeys::coarsest_stride(*chunk_.chunk); stride >= 1; stride /= 2) {
        for (int row = 0; row <= kChunkCells; row += stride) {
            const bool is_centre_row = (row / stride) % 2 != 0;
            for (int column = is_centre_row ? 0 : stride; column <= kChunkCells;
                 column += is_centre_row ? stride : 2 * stride) {
                const std::size_t sample = sample_index(column, row);
                if (!(own[sample] < threshold_) || is_active(column, row)) continue;
                const bool is_centre = is_centre_row && (column / stride) % 2 != 0;
                most = look_at_vertex(column, row, stride, is_centre, most);
            }
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
