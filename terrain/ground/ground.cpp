// SPDX-License-Identifier: MIT
#include <terrane/terrain/assert.h>
#include <terrane/terrain/ground.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane {
namespace {

constexpr int kChunkShift = 7;
static_assert(1 << kChunkShift == kChunkCells);
constexpr std::int64_t kBlockCells = kChunkCells / kChunkBlocks;

// The chunk that a cell lies in; rounds down, also below zero.
ChunkKey key_of(std::int64_t column, std::int64_t row, int level) {
    return {static_cast<std::int32_t>(column >> kChunkShift),
            static_cast<std::int32_t>(row >> kChunkShift), static_cast<std::uint8_t>(level)};
}

struct HeightRange {
    std::int32_t low = std::numeric_limits<std::int32_t>::min();
    std::int32_t high = std::numeric_limits<std::int32_t>::max();
};

// Bounds of the contact surface over a chunk that is not resident: its finest resident ancestor's
// samples there, and how far the true surface may be from them. Everything, where there is none.
HeightRange bound_from_ancestors(const ResidentSet& resident, const ChunkKey& key) {
    for (ChunkKey ancestor = key; ancestor.level > 0;) {
        ancestor = ancestor.parent();
        const std::int32_t found = resident.find(ancestor);
        if (found == ResidentSet::kNone) continue;
        const Chunk& chunk = *resident.chunks()[static_cast<std::size_t>(found)];
        // the ancestor's cells over the chunk: one at least
        const int below = key.level - ancestor.level;
        const int side = std::max(kChunkCells >> below, 1);
        const auto cell_of = [&](std::int32_t index, std::int32_t first) {
            const std::int64_t chunks = index - (std::int64_t{first} << below);
            return static_cast<int>((chunks * kChunkCells) >> below);
        };
        const int west = cell_of(key.x, ancestor.x);
        const int south = cell_of(key.y, ancestor.y);
        HeightRange range{std::numeric_limits<std::int32_t>::max(),
                          std::numeric_limits<std::int32_t>::min()};
        float bound = 0.0f;
        for (int row = south; row <= south + side; ++row) {
            for (int column = west; column <= west + side; ++column) {
                const std::int32_t height = chunk.heights[sample_index(column, row)];
                range.low = std::min(range.low, height);
                range.high = std::max(range.high, height);
                if (row == south + side || column == west + side) continue;
                bound = std::max(bound, chunk.cell_bounds[cell_index(column, row)]);
            }
        }
        // one quantum more, for the rounding of the samples that are not here
        const double margin =
            std::ceil(static_cast<double>(bound) / resident.lattice().quantum) + 1.0;
        const auto clamp = [](double quanta) {
            return static_cast<std::int32_t>(std::clamp(quanta, -2147483648.0, 2147483647.0));
        };
        return {clamp(range.low - margin), clamp(range.high + margin)};
    }
    return {};
}

}  // namespace

Ground::Ground(std::shared_ptr<const ResidentSet> resident, int contact_level)
    : resident_(std::move(resident)), level_(contact_level) {
    TERRANE_ASSERT(resident_ != nullptr, "a ground stands on a resident set");
    TERRANE_ASSERT(level_ >= 0 && level_ <= lattice().finest_level,
                   "contact_level must be a level of the lattice");
    step_ = lattice().step(level_);
    spacing_ = lattice().level_spacing(level_);
    in_extent_ = {column_at(extent().west), row_at(extent().south), column_at(extent().east),
                  row_at(extent().north)};
    // what only touches the edge is beyond it
    if (cell_x(in_extent_.east) >= extent().east) --in_extent_.east;
    if (cell_y(in_extent_.north) >= extent().north) --in_extent_.north;
}

// The quotient may round across a line: the comparison with the line itself decides.
std::int64_t Ground::column_at(double x) const {
    auto column = static_cast<std::int64_t>(std::floor((x - lattice().origin_x) / spacing_));
    if (x < cell_x(column)) --column;
    if (x >= cell_x(column + 1)) ++column;
    return column;
}

std::int64_t Ground::row_at(double y) const {
    auto row = static_cast<std::int64_t>(std::floor((y - lattice().origin_y) / spacing_));
    if (y < cell_y(row)) --row;
    if (y >= cell_y(row + 1)) ++row;
    return row;
}

// Null where it is not resident.
const Chunk* GroundReader::chunk_of(std::int64_t column, std::int64_t row) {
    if (chunk_ != nullptr && column >> kChunkShift == chunk_column_ &&
        row >> kChunkShift == chunk_row_) {
        return chunk_;
    }
    const ResidentSet& resident = *ground_->resident_;
    const std::int32_t found = resident.find(key_of(column, row, ground_->level_));
    if (found == ResidentSet::kNone) return nullptr;
    chunk_column_ = column >> kChunkShift;
    chunk_row_ = row >> kChunkShift;
    return chunk_ = resident.chunks()[static_cast<std::size_t>(found)].get();
}

RangeAnswer GroundReader::block(std::int64_t column, std::int64_t row) {
    const std::int64_t west = column & ~(kBlockCells - 1);
    const std::int64_t south = row & ~(kBlockCells - 1);
    const CellRange& in_extent = ground_->in_extent_;
    const bool is_near = west <= in_extent.east && west + kBlockCells > in_extent.west &&
                         south <= in_extent.north && south + kBlockCells > in_extent.south;
    const Chunk* const chunk = is_near ? chunk_of(west, south) : nullptr;
    if (chunk == nullptr) {
        return ground_->range({west, south, west + kBlockCells - 1, south + kBlockCells - 1});
    }
    const std::int64_t block_column = (west & (kChunkCells - 1)) / kBlockCells;
    const std::int64_t block_row = (south & (kChunkCells - 1)) / kBlockCells;
    const auto at = static_cast<std::size_t>(block_row * kChunkBlocks + block_column);
    return {GroundStatus::ok, chunk->block_low[at], chunk->block_high[at]};
}

GroundCell Ground::cell(std::int64_t column, std::int64_t row) const {
    return GroundReader(*this).cell(column, row);
}

GroundCell GroundReader::cell(std::int64_t column, std::int64_t row) {
    GroundCell cell;
    const CellRange& in_extent = ground_->in_extent_;
    if (column < in_extent.west || column > in_extent.east || row < in_extent.south ||
        row > in_extent.north) {
        return cell;
    }
    const Chunk* const found = chunk_of(column, row);
    if (found == nullptr) {
        if (ground_->lattice().contains(key_of(column, row, ground_->level_))) {
            cell.status = GroundStatus::not_resident;
        }
        return cell;
    }
    const Chunk& chunk = *found;
    const int i = static_cast<int>(column & (kChunkCells - 1));
    const int j = static_cast<int>(row & (kChunkCells - 1));
    const std::uint8_t flags = chunk.flags_at(i, j);
    if ((flags & cell_outside) != 0) return cell;
    cell.status = GroundStatus::ok;
    const std::size_t south_west = sample_index(i, j);
    cell.south_west = chunk.heights[south_west];
    cell.south_east = chunk.heights[south_west + 1];
    cell.north_west = chunk.heights[south_west + kChunkSamples];
    cell.north_east = chunk.heights[south_west + kChunkSamples + 1];
    cell.cut_to_north_east = cut_to_north_east(column, row);
    cell.error_m = chunk.cell_bounds[cell_index(i, j)];
    cell.filled = (flags & cell_filled) != 0;
    return cell;
}

RangeAnswer Ground::range(const CellRange& cells) const {
    RangeAnswer answer;
    answer.low = std::numeric_limits<std::int32_t>::max();
    answer.high = std::numeric_limits<std::int32_t>::min();
    // only what lies in the extent can be ground
    const std::int64_t west = std::max(cells.west, in_extent_.west);
    const std::int64_t east = std::min(cells.east, in_extent_.east);
    const std::int64_t south = std::max(cells.south, in_extent_.south);
    const std::int64_t north = std::min(cells.north, in_extent_.north);
    if (west > east || south > north) return answer;
    for (std::int64_t chunk_row = south >> kChunkShift; chunk_row <= north >> kChunkShift;
         ++chunk_row) {
        for (std::int64_t chunk_column = west >> kChunkShift; chunk_column <= east >> kChunkShift;
             ++chunk_column) {
            const std::int64_t corner_x = chunk_column << kChunkShift;
            const std::int64_t corner_y = chunk_row << kChunkShift;
            const ChunkKey key = key_of(corner_x, corner_y, level_);
            if (!lattice().contains(key)) continue;
            const std::int32_t found = resident_->find(key);
            if (found == ResidentSet::kNone) {
                answer.status = GroundStatus::not_resident;
                const HeightRange coarse = bound_from_ancestors(*resident_, key);
                answer.low = std::min(answer.low, coarse.low);
                answer.high = std::max(answer.high, coarse.high);
                continue;
            }
            if (answer.status == GroundStatus::outside) answer.status = GroundStatus::ok;
            const Chunk& chunk = *resident_->chunks()[static_cast<std::size_t>(found)];
            const std::int64_t first_column =
                std::max<std::int64_t>(west - corner_x, 0) / kBlockCells;
            const std::int64_t last_column =
                std::min<std::int64_t>(east - corner_x, kChunkCells - 1) / kBlockCells;
            const std::int64_t first_row =
                std::max<std::int64_t>(south - corner_y, 0) / kBlockCells;
            const std::int64_t last_row =
                std::min<std::int64_t>(north - corner_y, kChunkCells - 1) / kBlockCells;
            if (first_column == 0 && first_row == 0 && last_column == kChunkBlocks - 1 &&
                last_row == kChunkBlocks - 1) {
                answer.low = std::min(answer.low, chunk.low);
                answer.high = std::max(answer.high, chunk.high);
                continue;
            }
            for (std::int64_t row = first_row; row <= last_row; ++row) {
                for (std::int64_t column = first_column; column <= last_column; ++column) {
                    const auto block = static_cast<std::size_t>(row * kChunkBlocks + column);
                    answer.low = std::min(answer.low, chunk.block_low[block]);
                    answer.high = std::max(answer.high, chunk.block_high[block]);
                }
            }
        }
    }
    return answer;
}

HeightAnswer Ground::height(double x, double y) const {
    HeightAnswer answer;
    if (!std::isfinite(x) || !std::isfinite(y)) return answer;
    answer.status = GroundStatus::outside;
    if (!extent().contains(x, y)) return answer;

    // cells are closed: on a line the cell before it answers where the one behind it is no ground
    const std::int64_t east_column = column_at(x);
    const std::int64_t north_row = row_at(y);
    const int columns = x == cell_x(east_column) ? 2 : 1;
    const int rows = y == cell_y(north_row) ? 2 : 1;
    for (int i = 0; i < columns * rows; ++i) {
        const std::int64_t column = east_column - i % columns;
        const std::int64_t row = north_row - i / columns;
        const GroundCell cell = this->cell(column, row);
        if (cell.status == GroundStatus::outside) continue;
        answer.status = cell.status;
        if (cell.status != GroundStatus::ok) return answer;

        const double u = std::clamp((x - cell_x(column)) / spacing_, 0.0, 1.0);
        const double v = std::clamp((y - cell_y(row)) / spacing_, 0.0, 1.0);
        const double quantum = lattice().quantum;
        const double to_east = quantum * (static_cast<double>(cell.south_east) - cell.south_west);
        const double to_north = quantum * (static_cast<double>(cell.north_west) - cell.south_west);
        const double east_to_north =
            quantum * (static_cast<double>(cell.north_east) - cell.south_east);
        const double north_to_east =
            quantum * (static_cast<double>(cell.north_east) - cell.north_west);
        double slope_x = to_east;
        double slope_y = to_north;
        double rise = 0.0;  // above the south-west corner
        if (cell.cut_to_north_east) {
            if (u >= v)
                slope_y = east_to_north;
            else
                slope_x = north_to_east;
            rise = slope_x * u + slope_y * v;
        } else if (u + v <= 1.0) {
            rise = slope_x * u + slope_y * v;
        } else {
            slope_x = north_to_east;
            slope_y = east_to_north;
            rise = to_east + east_to_north - slope_x * (1.0 - u) - slope_y * (1.0 - v);
        }
        answer.height = quantum * static_cast<double>(cell.south_west) + rise;
        const Eigen::Vector3d up(-slope_x / spacing_, -slope_y / spacing_, 1.0);
        answer.normal = up / up.norm();
        answer.error_m = static_cast<double>(cell.error_m);
        answer.filled = cell.filled;
        return answer;
    }
    return answer;
}

}  // namespace terrane
