// SPDX-License-Identifier: MIT
#include "bilinear/kinked_surface.h"
#include "bounds/level_bounds.h"
#include "raster/cancellable_work.h"

#include <terrane/terrain/lattice.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>

namespace terrane::internal {

/// Number of tiles after which those beyond the raster repeat: see BoundTier.
inline constexpr std::int64_t kResidues = 4;

/// Side of a block in tiles, which are the cells of the first tier.
inline constexpr int kBlockTiles = 8;

/// A plane over a square: its height at the south-western corner, and its rises from tile to tile.
struct Plane {
    double corner = 0.0, rise_x = 0.0, rise_y = 0.0;
    double at(std::int64_t x, std::int64_t y) const {
        return corner + (static_cast<double>(x) * rise_x + static_cast<double>(y) * rise_y);
    }
};

/// The plane of a triangle, and the address to which its deviation is written: null if it is not needed.
struct Target {
    Plane plane;
    float* deviation = nullptr;
    double found = 0.0;  ///< largest deviation in this block
    float known = 0.0f;  ///< largest so far, rounded outward
};

/// The whole tile, or the half of it whose right angle is at the named corner.
enum class Part { whole, south_west, south_east, north_west, north_east };

/// A square of a level, divided into the two triangles of its cell, and also into four triangles around its centre.
/// Each of the four is half the diamond of the midpoint of a side: this vertex has half the side as its spacing.
struct Square {
    std::int64_t west = 0, south = 0, side = 0;  ///< tiles
    bool is_cut_north_east = false;
    Target lower, upper;  ///< south and north of the diagonal
    Target south_side, east_side, north_side, west_side;

    std::array<Target*, 6> targets() {
        return {&lower, &upper, &south_side, &east_side, &north_side, &west_side};
    }
};

/// The square of a level whose south-western corner has the indices i, j.
///
/// @param levels as in find_deviations()
Square make_square(const BoundTier& first, std::span<BoundTier> levels, std::size_t level,
                   std::int64_t i, std::int64_t j);

/// Range of surface minus plane at the corners of a part of a tile; (x, y) is the tile's position in the plane's
/// square.
///
/// @param heights south-west, south-east, north-west, north-east
Range corner_range(const std::array<double, 4>& heights, const Plane& plane, std::int64_t x,
                   std::int64_t y, Part part);

/// Visits the triangles of a square that contain a tile or a half of it.
///
/// @param x, y   position of the tile in the square
/// @param visit  called with Part, Target&
template <typename Visit>
void for_each_part_of_tile(Square& square, std::int64_t x, std::int64_t y, Visit&& visit) {
    const auto add = [&](Target& target, Part part) {
        if (target.deviation != nullptr) visit(part, target);
    };
    // Positive: the tile is north of the diagonal.
    const std::int64_t rising = y - x, falling = y + x - (square.side - 1);
    const std::int64_t cut = square.is_cut_north_east ? rising : falling;
    if (cut != 0) {
        add(cut < 0 ? square.lower : square.upper, Part::whole);
    } else {
        add(square.lower, square.is_cut_north_east ? Part::south_east : Part::south_west);
        add(square.upper, square.is_cut_north_east ? Part::north_west : Part::north_east);
    }
    if (rising < 0 && falling < 0) add(square.south_side, Part::whole);
    if (rising > 0 && falling > 0) add(square.north_side, Part::whole);
    if (rising > 0 && falling < 0) add(square.west_side, Part::whole);
    if (rising < 0 && falling > 0) add(square.east_side, Part::whole);
    if (rising == 0) {
        add(falling < 0 ? square.south_side : square.east_side, Part::south_east);
        add(falling < 0 ? square.west_side : square.north_side, Part::north_west);
    }
    if (falling == 0) {
        add(rising < 0 ? square.south_side : square.west_side, Part::south_west);
        add(rising < 0 ? square.east_side : square.north_side, Part::north_east);
    }
}

/// A rectangle of tiles; the end is excluded.
struct Tiles {
    std::int64_t west = 0, south = 0, east = 0, north = 0;

    bool empty() const { return west >= east || south >= north; }
    bool contains(const Tiles& other) const {
        return other.west >= west && other.south >= south && other.east <= east &&
               other.north <= north;
    }
};

/// Visits the tiles of a square within a part of a block, once for each triangle that contains the tile or half of it.
///
/// @param block the block's south-western tile
/// @param part  visited tiles of the block
/// @param visit called with column and row in the block, Part, Target&
template <typename Visit>
void for_each_part(LatticePoint block, const Tiles& part, Square& square, Visit&& visit) {
    const std::int64_t west = std::max(part.west, square.west);
    const std::int64_t east = std::min(part.east, square.west + square.side);
    const std::int64_t north = std::min(part.north, square.south + square.side);
    for (std::int64_t y = std::max(part.south, square.south); y < north; ++y) {
        for (std::int64_t x = west; x < east; ++x) {
            for_each_part_of_tile(square, x - square.west, y - square.south,
                                  [&](Part of_tile, Target& target) {
                                      visit(static_cast<int>(x - block.x),
                                            static_cast<int>(y - block.y), of_tile, target);
                                  });
        }
    }
}

// Beyond the raster the surface repeats the raster's edge: it is constant along x beyond the western and eastern edges,
// and along y beyond the southern and northern ones. A plane is linear. So on a row of tiles beyond the western or
// eastern edge, surface minus plane is monotone in x over each triangle: its extremes lie at the row's ends and on the
// square's diagonals. Beyond a corner of the raster, the extremes lie at the vertices of the triangle's part there.
// Rounded sums and products are monotone too, so this also holds with rounding.
//
// A square of n x n tiles beyond the raster thus costs O(n) tiles, or O(1), instead of n^2, and a sweep over the
// squares around a long narrow raster is linear in its length. Runs of tiles over which the heights are too near to the
// planes to exceed what has been found are skipped.

namespace beyond {

/// Visits the tiles of a row or column in [begin, end) at which surface minus plane may be extreme: both ends, and the
/// tiles on the square's diagonals.
template <typename Visit>
void for_each_extreme(std::int64_t begin, std::int64_t end, std::int64_t line, std::int64_t side,
                      Visit&& visit) {
    std::array<std::int64_t, 4> places{begin, end - 1, line, side - 1 - line};
    std::ranges::sort(places);
    std::int64_t before = begin - 1;
    for (const std::int64_t place : places) {
        if (place <= before || place >= end) continue;
        visit(place);
        before = place;
    }
}

/// End of the run of tiles that contains a tile: a multiple of kBlockTiles. Squares that are larger start at such a
/// multiple, and smaller ones lie in one run.
inline std::int64_t run_end(std::int64_t tile) { return (tile | (kBlockTiles - 1)) + 1; }

}  // namespace beyond

/// An edge of the raster, beyond which the surface repeats it.
enum class Edge { south, north, west, east };

/// Visits tiles of a square outside `core`. For each triangle of the square, they include the tiles in which surface
/// minus plane is extreme over the triangle's part outside `core`.
///
/// @param core   a rectangle of tiles outside of which the surface repeats the raster's edge
/// @param skips  called with tiles beyond one edge, at most kBlockTiles along it, by position in the square, and with
///               the edge; if true, they are not visited
/// @param visit  called with the tile's position x, y in the square; some tiles twice
template <typename Skips, typename Visit>
void for_each_extreme_tile(const Square& square, const Tiles& core, Skips&& skips, Visit&& visit) {
    const std::int64_t side = square.side;
    // Limits along one axis of the square's tiles before, in and after the core.
    const auto cuts = [side](std::int64_t begin, std::int64_t end, std::int64_t first) {
        return std::array<std::int64_t, 4>{0, std::clamp<std::int64_t>(begin - first, 0, side),
                                           std::clamp<std::int64_t>(end - first, 0, side), side};
    };
    const auto xs = cuts(core.west, core.east, square.west);
    const auto ys = cuts(core.south, core.north, square.south);
    for (std::size_t v = 0; v < 3; ++v) {
        for (std::size_t u = 0; u < 3; ++u) {
            const Tiles part{xs[u], ys[v], xs[u + 1], ys[v + 1]};
            const bool constant_x = u != 1, constant_y = v != 1;
            if (part.empty() || (!constant_x && !constant_y)) continue;
            const auto row = [&](std::int64_t y) {
                beyond::for_each_extreme(part.west, part.east, y, side,
                                         [&](std::int64_t x) { visit(x, y); });
            };
            const auto column = [&](std::int64_t x) {
                beyond::for_each_extreme(part.south, part.north, x, side,
                                         [&](std::int64_t y) { visit(x, y); });
            };
            if (!constant_y) {
                for (std::int64_t y = part.south, end = y; y < part.north; y = end) {
                    end = std::min(beyond::run_end(y), part.north);
                    const Edge edge = u == 0 ? Edge::west : Edge::east;
                    if (skips(Tiles{part.west, y, part.east, end}, edge)) continue;
                    for (; y < end; ++y) row(y);
                }
                continue;
            }
            if (!constant_x) {
                for (std::int64_t x = part.west, end = x; x < part.east; x = end) {
                    end = std::min(beyond::run_end(x), part.east);
                    const Edge edge = v == 0 ? Edge::south : Edge::north;
                    if (skips(Tiles{x, part.south, end, part.north}, edge)) continue;
                    for (; x < end; ++x) column(x);
                }
                continue;
            }
            row(part.south);
            row(part.north - 1);
            column(part.west);
            column(part.east - 1);
            // Around the square's centre, where four triangles meet.
            for (const std::int64_t y : {side / 2 - 1, side / 2}) {
                for (const std::int64_t x : {side / 2 - 1, side / 2}) {
                    const bool is_inside =
                        x >= part.west && x < part.east && y >= part.south && y < part.north;
                    if (is_inside) visit(x, y);
                }
            }
        }
    }
}

Square make_square(const BoundTier& first, std::span<BoundTier> levels, std::size_t level,
                   std::int64_t i, std::int64_t j) {
    BoundTier& cells = levels[level];
    Square square;
    const std::int64_t side = square.side = cells.step / first.step;
    const std::int64_t west = square.west = i * side, south = square.south = j * side;
    const auto height = [&](std::int64_t x, std::int64_t y) {
        return first.heights[first.at(x, y)];
    };
    const double south_west = height(west, south), south_east = height(west + side, south);
    const double north_west = height(west, south + side),
                 north_east = height(west + side, south + side);
    const double whole = static_cast<double>(side);
    square.is_cut_north_east = ((i + j) & 1) == 0;
    if (cells.contains(i, j)) {
        float* deviation = &cells.cell_bounds[cells.at(i, j)];
        const double along_south = (south_east - south_west) / whole;
        const double along_north = (north_east - north_west) / whole;
        const double along_west = (north_west - south_west) / whole;
        const double along_east = (north_east - south_east) / whole;
        if (square.is_cut_north_east) {
            square.lower = {{south_west, along_south, along_east}, deviation};
            square.upper = {{south_west, along_north, along_west}, deviation};
        } else {
            square.lower = {{south_west, along_south, along_west}, deviation};
            square.upper = {
                {north_east - whole * (along_north + along_east), along_north, along_east},
                deviation};
        }
    }
    if (level == 0) return square;
    BoundTier& middles = levels[level - 1];
    const double centre = height(west + side / 2, south + side / 2), half = 0.5 * whole;
    const auto add_side = [&](Target& target, std::int64_t x, std::int64_t y, double begin,
                              double end, double up, bool along_x) {
        if (!middles.contains(x, y)) return;
        target.deviation = &middles.bounds[middles.at(x, y)];
        const double along = (end - begin) / whole;
        // Rise from the side to the centre; `up` is 1 for the southern and western sides.
        const double across = up * (centre - 0.5 * (begin + end)) / half;
        const double corner = up > 0.0 ? begin : begin - whole * across;
        target.plane = along_x ? Plane{corner, along, across} : Plane{corner, across, along};
    };
    add_side(square.south_side, 2 * i + 1, 2 * j, south_west, south_east, 1.0, true);
    add_side(square.north_side, 2 * i + 1, 2 * j + 2, north_west, north_east, -1.0, true);
    add_side(square.west_side, 2 * i, 2 * j + 1, south_west, north_west, 1.0, false);
    add_side(square.east_side, 2 * i + 2, 2 * j + 1, south_east, north_east, -1.0, false);
    return square;
}

Range corner_range(const std::array<double, 4>& heights, const Plane& plane, std::int64_t x,
                   std::int64_t y, Part part) {
    const double south_west = heights[0] - plane.at(x, y);
    const double south_east = heights[1] - plane.at(x + 1, y);
    const double north_west = heights[2] - plane.at(x, y + 1);
    const double north_east = heights[3] - plane.at(x + 1, y + 1);
    Range range;
    if (part != Part::north_east) range.add(south_west);
    if (part != Part::north_west) range.add(south_east);
    if (part != Part::south_east) range.add(north_west);
    if (part != Part::south_west) range.add(north_east);
    return range;
}

// Triangles of the coarser levels consist of whole *tiles*, the cells of the first tier, and of tiles that the
// triangle's longest side cuts from corner to corner. An upper bound of the deviation over a tile is the deviation at
// its corners plus cell_high. Branch and bound: only tiles whose bound exceeds the deviation found so far are evaluated
// exactly, for all triangles at once, block by block, while the block's part of the raster is in memory.
//
// The order of evaluation decides which tiles are pruned, but not the result: the bound of a pruned tile does not
// exceed the maximum. Beyond the raster, where there is no ground, the bound of a tile is used as its deviation, and
// only tiles in which it can be extreme are visited (for_each_extreme_tile()).

namespace {

/// Covers the rounding of sums in a different order.
constexpr double kSumRounding = 1e-9;

/// Raises a number to at least `value`, from any thread. The result does not depend on the order of calls.
void raise_to(float& target, float value) {
    std::atomic_ref<float> shared(target);
    float before = shared.load(std::memory_order_relaxed);
    while (before < value && !shared.compare_exchange_weak(before, value)) {
    }
}

/// Squares along an axis beyond a raster: each has the same values as the one two squares farther from the raster,
/// because the tiles of both have the same residues modulo 4 (see BoundTier), and both are cut along the same diagonal.
struct Repeats {
    std::int64_t begin = 0, end = 0;  ///< all squares of a level
    std::int64_t low = 0, high = 0;   ///< the squares up to `low`, and those from `high` on, repeat

    /// @param tiles  of the level, along the axis
    /// @param first, last  tiles up to the first one, excluded, repeat, and those from the last one on
    Repeats(std::int64_t side, std::int64_t begin_tile, std::int64_t end_tile, std::int64_t first,
            std::int64_t last)
        : begin(begin_tile / side), end(end_tile / side) {
        const int shift = std::countr_zero(static_cast<std::uint64_t>(side));
        low = (first >> shift) - 1;
        high = (last + side - 1) >> shift;
    }
    /// Whether a square is the nearest one to the raster of those that have its values.
    bool is_nearest(std::int64_t i) const { return i >= low - 1 && i <= high + 1; }
    /// Visits the squares that have the values of such a square.
    template <typename Visit>
    void for_each(std::int64_t nearest, Visit&& visit) const {
        visit(nearest);
        if (nearest <= low) {
            for (std::int64_t i = nearest - 2; i >= begin; i -= 2) visit(i);
        }
        if (nearest >= high) {
            for (std::int64_t i = nearest + 2; i < end; i += 2) visit(i);
        }
    }
};

/// What the surface can be over a run of tiles beyond an edge: the range of the heights at their corners, and the
/// range by which the tiles between them extend it.
struct Run {
    double low = std::numeric_limits<double>::infinity();
    double high = -std::numeric_limits<double>::infinity();
    float cell_low = 0.0f, cell_high = 0.0f;
};

/// Whether no triangle of a square can deviate from the surface over some tiles by more than what has been found. With
/// the same operations as the deviation of a tile, each of which is monotone: so this holds with rounding.
bool is_within_found(const Square& square, const Tiles& tiles, const Run& surface);

class Sweep {
public:
    Sweep(const FineSurface& fine, const BoundTier& first, std::span<BoundTier> levels)
        : fine_(fine), first_(first), levels_(levels) {
        for (const BoundTier& level : levels) {
            const std::int64_t side = level.step / first.step;
            // One square more on every side, because a midpoint belongs to the squares on both sides of it.
            tiles_.push_back({(level.first_x - 1) * side, (level.first_y - 1) * side,
                              (level.first_x + level.columns + 1) * side,
                              (level.first_y + level.rows + 1) * side});
        }
        core_ = {first.first_x + kBeyondRaster, first.first_y + kBeyondRaster,
                 first.first_x + first.columns - 1 - kBeyondRaster,
                 first.first_y + first.rows - 1 - kBeyondRaster};
        const auto round_down = [](std::int64_t tile) { return tile & -std::int64_t{kBlockTiles}; };
        const auto round_up = [&](std::int64_t tile) { return round_down(tile + kBlockTiles - 1); };
        blocks_ = {round_down(core_.west), round_down(core_.south), round_up(core_.east),
                   round_up(core_.north)};
        // Off the lattice the bounds of equal tiles differ in their rounding, so that each tile of a block counts.
        if (!fine.grid().aligned) core_ = blocks_;
        for (const Edge edge : {Edge::south, Edge::north, Edge::west, Edge::east}) {
            runs_[static_cast<std::size_t>(edge)] = make_runs(edge);
        }
        for (std::size_t level = 0; level < levels.size(); ++level) {
            const std::int64_t side = levels[level].step / first.step;
            const Tiles& tiles = tiles_[level];
            columns_.emplace_back(side, tiles.west, tiles.east,
                                  std::min(core_.west, first.first_x + kResidues),
                                  std::max(core_.east, first.first_x + first.columns - kResidues));
            rows_.emplace_back(side, tiles.south, tiles.north,
                               std::min(core_.south, first.first_y + kResidues),
                               std::max(core_.north, first.first_y + first.rows - kResidues));
        }
    }

    /// @return visited tiles, summed over passes and triangles
    Result<std::int64_t> run(OpeningProgress& progress);

private:
    /// The first tier's data of a block.
    struct Block {
        std::int64_t west = 0, south = 0;
        std::array<double, (kBlockTiles + 1) * (kBlockTiles + 1)> heights{};
        std::array<float, kBlockTiles * kBlockTiles> low{}, high{};
        std::optional<DiamondWindow> window;  ///< read when a tile is evaluated

        static std::size_t tile(int column, int row) {
            return static_cast<std::size_t>(row * kBlockTiles + column);
        }
        std::array<double, 4> corners(int column, int row) const {
            const double* row_below = heights.data() + row * (kBlockTiles + 1) + column;
            return {row_below[0], row_below[1], row_below[kBlockTiles + 1],
                    row_below[kBlockTiles + 2]};
        }
    };

    Block read_block(std::int64_t west, std::int64_t south) const;
    /// The runs beyond an edge, along the blocks.
    std::vector<Run> make_runs(Edge edge) const;
    /// The block's tiles in the core.
    Tiles core_of(const Block& block) const {
        return {std::max(block.west, core_.west), std::max(block.south, core_.south),
                std::min(block.west + kBlockTiles, core_.east),
                std::min(block.south + kBlockTiles, core_.north)};
    }
    template <typename Visit>
    void for_each_square(const Block& block, Visit&& visit) const;
    void add_corners(const Block& block) const;
    Result<void> evaluate_block(Block& block) const;
    /// Adds the bounds of the tiles outside the core to the deviations of the squares in one row of a level.
    void add_beyond(std::size_t level, std::int64_t row) const;
    /// Upper bound of |surface - plane| over a whole tile: the range at its corners, enlarged by `low` and `high`.
    ///
    /// @param x, y position of the tile in the plane's square
    static double most(const std::array<double, 4>& corners, float low, float high,
                       const Plane& plane, std::int64_t x, std::int64_t y);
    /// Whether a tile lies beyond the raster.
    bool is_beyond(std::int64_t column, std::int64_t row) const;
    Result<DiamondWindow> read_window(const Block& block) const;
    /// Extends a range by surface minus plane over a part of a tile. Requires that the block's window has been read.
    /// @param in_square position of the tile in the plane's square
    void add_part(const Block& block, const Plane& plane, LatticePoint in_square, int column,
                  int row, Part part, Range& range) const;

    const FineSurface& fine_;
    const BoundTier& first_;
    std::span<BoundTier> levels_;
    std::vector<Tiles> tiles_;             ///< of each level
    std::vector<Repeats> columns_, rows_;  ///< of each level
    /// Tiles outside of which the surface repeats the raster's edge; whole blocks that contain all of them.
    Tiles core_, blocks_;
    std::array<std::vector<Run>, 4> runs_;  ///< by Edge
    mutable std::atomic<std::int64_t> visits_{0};
};

Sweep::Block Sweep::read_block(std::int64_t west, std::int64_t south) const {
    Block block;
    block.west = west;
    block.south = south;
    std::size_t point = 0, tile = 0;
    for (int y = 0; y <= kBlockTiles; ++y) {
        for (int x = 0; x <= kBlockTiles; ++x) {
            const std::size_t at = first_.at(west + x, south + y);
            block.heights[point++] = first_.heights[at];
            if (x == kBlockTiles || y == kBlockTiles) continue;
            block.low[tile] = first_.cell_low[at];
            block.high[tile++] = first_.cell_high[at];
        }
    }
    return block;
}

template <typename Visit>
void Sweep::for_each_square(const Block& block, Visit&& visit) const {
    for (std::size_t k = 0; k < levels_.size(); ++k) {
        const Tiles& tiles = tiles_[k];
        if (block.west >= tiles.east || block.south >= tiles.north ||
            block.west + kBlockTiles <= tiles.west || block.south + kBlockTiles <= tiles.south) {
            continue;
        }
        const std::int64_t side = levels_[k].step / first_.step;
        const std::int64_t across = std::max<std::int64_t>(kBlockTiles / side, 1);
        // Indices of the first square. For squares no larger than a block the shift is exact, because blocks lie at
        // multiples of their side. For larger squares it rounds down, to the square that contains the block.
        const int shift = std::countr_zero(static_cast<std::uint64_t>(side));
        const std::int64_t i = block.west >> shift, j = block.south >> shift;
        for (std::int64_t y = 0; y < across; ++y) {
            for (std::int64_t x = 0; x < across; ++x)
                visit(make_square(first_, levels_, k, i + x, j + y));
        }
    }
}

void Sweep::add_corners(const Block& block) const {
    std::int64_t visits = 0;
    for_each_square(block, [&](Square square) {
        for_each_part({block.west, block.south}, core_of(block), square,
                      [&](int column, int row, Part part, Target& target) {
                          ++visits;
                          const std::int64_t x = block.west + column - square.west;
                          const std::int64_t y = block.south + row - square.south;
                          const Range range =
                              corner_range(block.corners(column, row), target.plane, x, y, part);
                          target.found = std::max(target.found, range.deviation());
                      });
        for (Target* target : square.targets()) {
            if (target->deviation != nullptr) {
                raise_to(*target->deviation, round_outward(target->found));
            }
        }
    });
    visits_ += visits;
}

double Sweep::most(const std::array<double, 4>& corners, float low, float high, const Plane& plane,
                   std::int64_t x, std::int64_t y) {
    // Uses the whole tile even for half of one: along the diagonal the surface may exceed its heights at the ends.
    Range range = corner_range(corners, plane, x, y, Part::whole);
    range.low += static_cast<double>(low);
    range.high += static_cast<double>(high);
    return range.deviation();
}

std::vector<Run> Sweep::make_runs(Edge edge) const {
    const bool along_x = edge == Edge::south || edge == Edge::north;
    const bool is_first = edge == Edge::south || edge == Edge::west;
    const std::int64_t begin = along_x ? blocks_.west : blocks_.south;
    const std::int64_t end = along_x ? blocks_.east : blocks_.north;
    // All tiles across the edge that are stored.
    const std::int64_t stored = along_x ? first_.first_y : first_.first_x;
    const std::int64_t count = along_x ? first_.rows : first_.columns;
    const std::int64_t from = is_first ? stored : stored + count - 1 - kBeyondRaster;
    const std::int64_t to = is_first ? stored + kBeyondRaster : stored + count;
    std::vector<Run> runs(static_cast<std::size_t>((end - begin) / kBlockTiles));
    for (std::int64_t tile = begin; tile < end; ++tile) {
        Run& run = runs[static_cast<std::size_t>((tile - begin) / kBlockTiles)];
        for (std::int64_t across = from; across < to; ++across) {
            const std::size_t at = along_x ? first_.at(tile, across) : first_.at(across, tile);
            const std::size_t next =
                along_x ? first_.at(tile + 1, across) : first_.at(across, tile + 1);
            run.low = std::min({run.low, first_.heights[at], first_.heights[next]});
            run.high = std::max({run.high, first_.heights[at], first_.heights[next]});
            run.cell_low = std::min(run.cell_low, first_.cell_low[at]);
            run.cell_high = std::max(run.cell_high, first_.cell_high[at]);
        }
    }
    return runs;
}

bool is_within_found(const Square& square, const Tiles& tiles, const Run& surface) {
    const auto is_within = [&](const Target& target, const Tiles& part) {
        if (target.deviation == nullptr || part.empty()) return true;
        Range plane;
        for (const std::int64_t x : {part.west, part.east}) {
            for (const std::int64_t y : {part.south, part.north}) plane.add(target.plane.at(x, y));
        }
        const Range range{surface.low - plane.high + static_cast<double>(surface.cell_low),
                          surface.high - plane.low + static_cast<double>(surface.cell_high)};
        return range.deviation() <= target.found;
    };
    // The tiles of the four triangles around the square's centre are in these rectangles.
    const auto [west, south, east, north] = tiles;
    const std::int64_t side = square.side;
    const Tiles in_south{std::max(west, south), south, std::min(east, side - south),
                         std::min({north, east, side - west})};
    const Tiles in_north{std::max(west, side - north), std::max({south, west, side - east}),
                         std::min(east, north), north};
    const Tiles in_west{west, std::max(south, west), std::min({east, north, side - south}),
                        std::min(north, side - west)};
    const Tiles in_east{std::max({west, south, side - north}), std::max(south, side - east), east,
                        std::min(north, east)};
    return is_within(square.lower, tiles) && is_within(square.upper, tiles) &&
           is_within(square.south_side, in_south) && is_within(square.north_side, in_north) &&
           is_within(square.west_side, in_west) && is_within(square.east_side, in_east);
}

void Sweep::add_beyond(std::size_t level, std::int64_t row) const {
    const Repeats& rows = rows_[level];
    const Repeats& columns = columns_[level];
    if (!rows.is_nearest(row)) return;
    std::int64_t visits = 0;
    const std::int64_t side = levels_[level].step / first_.step;
    for (std::int64_t column = columns.begin; column < columns.end; ++column) {
        if (!columns.is_nearest(column) ||
            core_.contains({column * side, row * side, (column + 1) * side, (row + 1) * side}))
            continue;
        Square square = make_square(first_, levels_, level, column, row);
        const auto skips = [&](const Tiles& tiles, Edge edge) {
            const bool along_x = edge == Edge::south || edge == Edge::north;
            const std::int64_t tile = along_x ? square.west + tiles.west - blocks_.west
                                              : square.south + tiles.south - blocks_.south;
            const std::vector<Run>& runs = runs_[static_cast<std::size_t>(edge)];
            return is_within_found(square, tiles,
                                   runs[static_cast<std::size_t>(tile / kBlockTiles)]);
        };
        for_each_extreme_tile(square, core_, skips, [&](std::int64_t x, std::int64_t y) {
            const std::size_t west = first_.column_at(square.west + x);
            const std::size_t east = first_.column_at(square.west + x + 1);
            const std::size_t south = first_.row_at(square.south + y);
            const std::size_t north = first_.row_at(square.south + y + 1);
            const std::array<double, 4> corners{
                first_.heights[south + west], first_.heights[south + east],
                first_.heights[north + west], first_.heights[north + east]};
            const float low = first_.cell_low[south + west], high = first_.cell_high[south + west];
            for_each_part_of_tile(square, x, y, [&](Part, Target& target) {
                ++visits;
                target.found = std::max(target.found, most(corners, low, high, target.plane, x, y));
            });
        });
        const std::array<Target*, 6> found = square.targets();
        rows.for_each(row, [&](std::int64_t j) {
            columns.for_each(column, [&](std::int64_t i) {
                Square equal = make_square(first_, levels_, level, i, j);
                for (std::size_t k = 0; k < found.size(); ++k) {
                    float* deviation = equal.targets()[k]->deviation;
                    if (deviation != nullptr) raise_to(*deviation, round_outward(found[k]->found));
                }
            });
        });
    }
    visits_ += visits;
}

bool Sweep::is_beyond(std::int64_t column, std::int64_t row) const {
    const auto is_off = [](std::int64_t tile, std::int64_t first, int count) {
        return tile < first + kBeyondRaster || tile >= first + count - 1 - kBeyondRaster;
    };
    return is_off(column, first_.first_x, first_.columns) ||
           is_off(row, first_.first_y, first_.rows);
}

Result<void> Sweep::evaluate_block(Block& block) const {
    Result<void> done;
    std::int64_t visits = 0;
    for_each_square(block, [&](Square square) {
        for (Target* target : square.targets()) {
            if (target->deviation == nullptr) continue;
            target->known = std::atomic_ref<float>(*target->deviation).load();
        }
        for_each_part({block.west, block.south}, core_of(block), square,
                      [&](int column, int row, Part part, Target& target) {
                          const std::int64_t x = block.west + column - square.west;
                          const std::int64_t y = block.south + row - square.south;
                          const std::size_t tile = block.tile(column, row);
                          const double most =
                              Sweep::most(block.corners(column, row), block.low[tile],
                                          block.high[tile], target.plane, x, y);
                          ++visits;
                          if (most == 0.0) return;
                          if (is_beyond(block.west + column, block.south + row)) {
                              target.known = std::max(target.known, round_outward(most));
                              return;
                          }
                          if (round_outward(most + kSumRounding) <= target.known) return;
                          if (!block.window) {
                              auto window = read_window(block);
                              if (!window) done = tl::unexpected(window.error());
                              if (!done) return;
                              block.window = std::move(*window);
                          }
                          Range close;
                          add_part(block, target.plane, {x, y}, column, row, part, close);
                          target.known = std::max(target.known, round_outward(close.deviation()));
                      });
        for (Target* target : square.targets()) {
            if (target->deviation != nullptr) raise_to(*target->deviation, target->known);
        }
    });
    visits_ += visits;
    return done;
}

Result<DiamondWindow> Sweep::read_window(const Block& block) const {
    const std::int64_t step = fine_.grid().base_step();
    const int side = static_cast<int>(first_.step / step) * kBlockTiles + 1;
    return fine_.surface_window(
        {{block.west * first_.step, block.south * first_.step}, step, side, side});
}

void Sweep::add_part(const Block& block, const Plane& plane, LatticePoint in_square, int column,
                     int row, Part part, Range& range) const {
    const int points = static_cast<int>(first_.step / fine_.grid().base_step());
    const int x = column * points, y = row * points;
    const std::array<double, 4> corners{
        plane.at(in_square.x, in_square.y), plane.at(in_square.x + 1, in_square.y),
        plane.at(in_square.x, in_square.y + 1), plane.at(in_square.x + 1, in_square.y + 1)};
    const DiamondWindow& window = *block.window;
    const auto add_half = [&](bool east, bool north) {
        const std::size_t corner = (east ? 1u : 0u) + (north ? 2u : 0u);
        add_triangle_part(
            window,
            {east ? x + points : x, north ? y + points : y, east ? -1 : 1, north ? -1 : 1, points,
             corners[corner], corners[corner ^ 1u], corners[corner ^ 2u]},
            range);
    };
    if (part == Part::whole) {
        add_square(window, x, y, points, corners[0], corners[1], corners[2], range);
    }
    if (part == Part::south_west) add_half(false, false);
    if (part == Part::north_east) add_half(true, true);
    if (part == Part::south_east) add_half(true, false);
    if (part == Part::north_west) add_half(false, true);
}

Result<std::int64_t> Sweep::run(OpeningProgress& progress) {
    // The squares beyond the raster come first: a large deviation found there prunes more tiles.
    for (std::size_t level = 0; level < levels_.size(); ++level) {
        const std::int64_t side = levels_[level].step / first_.step;
        const std::int64_t south = tiles_[level].south / side, north = tiles_[level].north / side;
        TERRANE_TRY(in_parallel(static_cast<int>(north - south), [&](int row) -> Result<void> {
            add_beyond(level, south + row);
            return {};
        }));
    }
    const int across = static_cast<int>((blocks_.east - blocks_.west) / kBlockTiles);
    const int rows = static_cast<int>((blocks_.north - blocks_.south) / kBlockTiles);
    const auto block_at = [&](int row, int column) {
        return read_block(blocks_.west + std::int64_t{column} * kBlockTiles,
                          blocks_.south + std::int64_t{row} * kBlockTiles);
    };
    progress.begin(1.0, 2 * std::int64_t{rows});
    auto done = in_parallel(rows, [&](int row) -> Result<void> {
        for (int column = 0; column < across; ++column) add_corners(block_at(row, column));
        return progress.step();
    });
    if (done) {
        done = in_parallel(rows, [&](int row) -> Result<void> {
            for (int column = 0; column < across; ++column) {
                Block block = block_at(row, column);
                TERRANE_TRY(evaluate_block(block));
            }
            return progress.step();
        });
    }
    if (!done) return tl::unexpected(done.error());
    return visits_.load();
}

}  // namespace

Result<std::int64_t> find_deviations(const FineSurface& fine, const BoundTier& first,
                                     std::span<BoundTier> levels, OpeningProgress& progress) {
    return Sweep(fine, first, levels).run(progress);
}

}  // namespace terrane::internal
