// SPDX-License-Identifier: MIT
//
// Triangles of the coarser levels consist of whole *tiles*, the cells of the first tier, and of tiles that the longest
// side cuts from corner to corner. The deviation over a tile has an upper bound: its corners minus the plane, plus
// cell_high. Only tiles whose bound is above the deviation found so far are evaluated exactly, for all triangles at
// once, block by block, while their part of the raster is in memory (branch and bound).
//
// Which tiles are pruned depends on the order, the result does not: a pruned tile is not above the maximum. Beyond the
// raster, where there is no ground, the bound of a tile is used as its deviation, and only tiles where it can be
// extreme are visited (sweep_beyond.h).
#include "bounds/deviation_sweep.h"

#include "bounds/parallel.h"
#include "bounds/sweep_beyond.h"
#include "bounds/sweep_square.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace terrane::internal {
namespace {

/// Covers the rounding of sums in another order.
constexpr double kSumRounding = 1e-9;

/// Exact: the maximum does not depend on the order.
void take_largest(float& target, float value) {
    std::atomic_ref<float> shared(target);
    float before = shared.load(std::memory_order_relaxed);
    while (before < value && !shared.compare_exchange_weak(before, value)) {
    }
}

class Sweep {
public:
    Sweep(const FineSurface& fine, const BoundTier& first, std::span<BoundTier> levels)
        : fine_(fine), first_(first), levels_(levels) {
        for (const BoundTier& level : levels) {
            const std::int64_t side = level.step / first.step;
            // A centre has one square, a midpoint two.
            tiles_.push_back({(level.first_x - 1) * side, (level.first_y - 1) * side,
                              (level.first_x + level.columns + 1) * side,
                              (level.first_y + level.rows + 1) * side});
        }
        const auto round_down = [](std::int64_t tile) { return tile & -std::int64_t{kBlockTiles}; };
        const auto round_up = [&](std::int64_t tile) { return round_down(tile + kBlockTiles - 1); };
        core_ = {round_down(first.first_x + kBeyondRaster),
                 round_down(first.first_y + kBeyondRaster),
                 round_up(first.first_x + first.columns - 1 - kBeyondRaster),
                 round_up(first.first_y + first.rows - 1 - kBeyondRaster)};
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
    template <typename Visit>
    void for_each_square(const Block& block, Visit&& visit) const;
    void add_corners(const Block& block) const;
    Result<void> evaluate_block(Block& block) const;
    /// Adds the bounds of the tiles beyond the core to the squares of a row of a level.
    void add_beyond(std::size_t level, std::int64_t row) const;
    /// Upper bound of surface minus plane over a whole tile: at its corners, plus the deviation between them.
    ///
    /// @param x, y  position of the tile in the plane's square
    static double most(const std::array<double, 4>& corners, float low, float high,
                       const Plane& plane, std::int64_t x, std::int64_t y);
    /// Whether a tile lies beyond the raster.
    bool is_beyond(std::int64_t column, std::int64_t row) const;
    Result<DiamondWindow> read_window(const Block& block) const;
    /// Surface minus plane over a part of a tile of a block whose window was read.
    /// @param in_square  position of the tile in the plane's square
    void add_part(const Block& block, const Plane& plane, LatticePoint in_square, int column,
                  int row, Part part, Range& range) const;

    const FineSurface& fine_;
    const BoundTier& first_;
    std::span<BoundTier> levels_;
    std::vector<Tiles> tiles_;  ///< of each level
    /// Blocks that contain all tiles over the raster; outside of it the surface repeats the edge.
    Tiles core_;
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
        // Exact: blocks lie at multiples of their side. The shift rounds down.
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
        for_each_part({block.west, block.south}, square,
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
                take_largest(*target->deviation, round_outward(target->found));
            }
        }
    });
    visits_ += visits;
}

double Sweep::most(const std::array<double, 4>& corners, float low, float high, const Plane& plane,
                   std::int64_t x, std::int64_t y) {
    // Over the whole tile: along a cut the surface may bow beyond its ends.
    Range range = corner_range(corners, plane, x, y, Part::whole);
    range.low += static_cast<double>(low);
    range.high += static_cast<double>(high);
    return range.deviation();
}

void Sweep::add_beyond(std::size_t level, std::int64_t row) const {
    std::int64_t visits = 0;
    const std::int64_t side = levels_[level].step / first_.step;
    for (std::int64_t west = tiles_[level].west; west < tiles_[level].east; west += side) {
        if (core_.contains({west, row * side, west + side, (row + 1) * side})) continue;
        Square square = make_square(first_, levels_, level, west / side, row);
        for_each_extreme_tile(square, core_, [&](std::int64_t x, std::int64_t y) {
            const std::int64_t column = square.west + x, tile_row = square.south + y;
            const std::array<double, 4> corners{
                first_.heights[first_.at(column, tile_row)],
                first_.heights[first_.at(column + 1, tile_row)],
                first_.heights[first_.at(column, tile_row + 1)],
                first_.heights[first_.at(column + 1, tile_row + 1)]};
            const std::size_t at = first_.at(column, tile_row);
            for_each_part_of_tile(square, x, y, [&](Part, Target& target) {
                ++visits;
                target.known = std::max(
                    target.known, round_outward(most(corners, first_.cell_low[at],
                                                     first_.cell_high[at], target.plane, x, y)));
            });
        });
        for (Target* target : square.targets()) {
            if (target->deviation != nullptr) take_largest(*target->deviation, target->known);
        }
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
        for_each_part(
            {block.west, block.south}, square, [&](int column, int row, Part part, Target& target) {
                const std::int64_t x = block.west + column - square.west;
                const std::int64_t y = block.south + row - square.south;
                const std::size_t tile = block.tile(column, row);
                const double most = Sweep::most(block.corners(column, row), block.low[tile],
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
            if (target->deviation != nullptr) take_largest(*target->deviation, target->known);
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
    // Beyond the raster first: a larger deviation found there prunes more tiles.
    for (std::size_t level = 0; level < levels_.size(); ++level) {
        const std::int64_t side = levels_[level].step / first_.step;
        const std::int64_t south = tiles_[level].south / side, north = tiles_[level].north / side;
        const auto done =
            in_parallel(static_cast<int>(north - south), [&](int row) -> Result<void> {
                add_beyond(level, south + row);
                return {};
            });
        if (!done) return tl::unexpected(done.error());
    }
    const int across = static_cast<int>((core_.east - core_.west) / kBlockTiles);
    const int rows = static_cast<int>((core_.north - core_.south) / kBlockTiles);
    const auto block_at = [&](int row, int column) {
        return read_block(core_.west + std::int64_t{column} * kBlockTiles,
                          core_.south + std::int64_t{row} * kBlockTiles);
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
                if (auto evaluated = evaluate_block(block); !evaluated) return evaluated;
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
