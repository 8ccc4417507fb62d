// SPDX-License-Identifier: MIT
#include "ground/cell_lines.h"

#include <terrane/terrain/assert.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace terrane {
namespace {

constexpr SampleRange kEverything{std::numeric_limits<std::int32_t>::min(),
                                  std::numeric_limits<std::int32_t>::max()};
constexpr SampleRange kNothing{std::numeric_limits<std::int32_t>::max(),
                               std::numeric_limits<std::int32_t>::min()};

// log2 of the cells along the side of the smallest squares that ranges are made of.
constexpr int kBlock = 3;

void add(SampleRange& range, const SampleRange& more) {
    range.low = std::min(range.low, more.low);
    range.high = std::max(range.high, more.high);
}

// Cells of a chunk, ends included.
struct ChunkCells {
    int west, south, east, north;
};

// Adds the ranges of the blocks of one square of the pyramid that overlap the cells.
void add_blocks(const SamplePyramid& pyramid, int log2_side, int column, int row,
                const ChunkCells& cells, SampleRange& range) {
    const int last = (1 << log2_side) - 1;
    if (column > cells.east || column + last < cells.west || row > cells.north ||
        row + last < cells.south) {
        return;
    }
    if (log2_side == kBlock || (column >= cells.west && column + last <= cells.east &&
                                row >= cells.south && row + last <= cells.north)) {
        add(range, pyramid.at(log2_side, column, row));
        return;
    }
    const int half = 1 << (log2_side - 1);
    for (const int y : {row, row + half}) {
        for (const int x : {column, column + half}) {
            add_blocks(pyramid, log2_side - 1, x, y, cells, range);
        }
    }
}

SampleRange range_of_blocks(const Chunk& chunk, const ChunkCells& cells) {
    // the smallest aligned square that contains them all
    const auto differing =
        static_cast<unsigned>((cells.west ^ cells.east) | (cells.south ^ cells.north));
    const int log2_side = std::max(static_cast<int>(std::bit_width(differing)), kBlock);
    const int corner = -(1 << log2_side);
    SampleRange range = kNothing;
    add_blocks(chunk.pyramid, log2_side, cells.west & corner, cells.south & corner, cells, range);
    return range;
}

// The largest bound of the cells of a square, aligned to its size.
float largest_bound(const Chunk& chunk, int west, int south, int side) {
    float bound = 0.0f;
    if (side >= kAreaCells) {
        for (int row = south / kAreaCells; row < (south + side) / kAreaCells; ++row) {
            for (int column = west / kAreaCells; column < (west + side) / kAreaCells; ++column) {
                const auto area = static_cast<std::size_t>(row * kChunkAreas + column);
                bound = std::max(bound, chunk.areas[area].max_cell_bound);
            }
        }
        return bound;
    }
    for (int row = south; row < south + side; ++row) {
        for (int column = west; column < west + side; ++column) {
            bound = std::max(bound, chunk.cell_bounds[cell_index(column, row)]);
        }
    }
    return bound;
}

}  // namespace

Ground::Ground(std::shared_ptr<const ResidentSet> resident, int contact_level,
               std::shared_ptr<const SurfaceMap> surface_map)
    : resident_(std::move(resident)), surface_map_(std::move(surface_map)), level_(contact_level) {
    TERRANE_ASSERT(resident_ != nullptr, "a ground needs a resident set");
    const Lattice& lattice = this->lattice();
    TERRANE_ASSERT(level_ >= 0 && level_ <= lattice.finest_level,
                   "contact_level must be a level of the lattice");
    step_ = lattice.step(level_);
    spacing_ = lattice.level_spacing(level_);
    quantum_ = lattice.quantum;
    has_solids_ = resident_->has_solids();
    inverse_quantum_ = 1.0 / quantum_;
    columns_ = {lattice.origin_x, spacing_, 1.0 / spacing_};
    rows_ = {lattice.origin_y, spacing_, 1.0 / spacing_};
    extent_ = resident_->extent();
    in_extent_ = {column_at(extent_.west), row_at(extent_.south), column_at(extent_.east),
                  row_at(extent_.north)};
    // without cells that only touch the extent's edge, and clipped to the root squares
    if (columns_.at(in_extent_.east) >= extent_.east) --in_extent_.east;
    if (rows_.at(in_extent_.north) >= extent_.north) --in_extent_.north;
    in_extent_.west = std::max(in_extent_.west, lattice.west() / step_);
    in_extent_.south = std::max(in_extent_.south, lattice.south() / step_);
    in_extent_.east = std::min(in_extent_.east, lattice.east() / step_ - 1);
    in_extent_.north = std::min(in_extent_.north, lattice.north() / step_ - 1);
}

std::int64_t Ground::column_at(double x) const { return columns_.last_up_to(x); }

std::int64_t Ground::row_at(double y) const { return rows_.last_up_to(y); }

const SolidSurface* Ground::solid(std::int64_t column, std::int64_t row) const {
    const Chunk* const chunk = find_chunk(column, row);
    return chunk != nullptr ? chunk->solid.get() : nullptr;
}

bool Ground::has_same_cells(const Ground& other, const CellRange& cells) const {
    if (level_ != other.level_) return false;
    if (resident_ == other.resident_) return true;
    if (!(lattice() == other.lattice()) || !(in_extent_ == other.in_extent_)) return false;
    for (std::int64_t row = cells.south >> kChunkShift; row <= cells.north >> kChunkShift; ++row) {
        for (std::int64_t column = cells.west >> kChunkShift; column <= cells.east >> kChunkShift;
             ++column) {
            const Chunk* const chunk = find_chunk(column << kChunkShift, row << kChunkShift);
            if (chunk == nullptr ||
                chunk != other.find_chunk(column << kChunkShift, row << kChunkShift)) {
                return false;
            }
        }
    }
    return true;
}

GroundCell Ground::cell(std::int64_t column, std::int64_t row) const {
    return GroundReader(*this).cell(column, row);
}

// Bounds of the contact surface over an absent chunk: the samples of its finest resident ancestor there, widened by
// their bound to the true surface. Unbounded if no ancestor is resident.
SampleRange Ground::range_of_absent(const ChunkKey& key) const {
    for (ChunkKey ancestor = key; ancestor.level > 0;) {
        ancestor = ancestor.parent();
        const std::int32_t found = resident_->find(ancestor);
        if (found == ResidentSet::kNone) continue;
        const Chunk& chunk = *resident_->chunks()[static_cast<std::size_t>(found)];
        // the ancestor's cells over the chunk, at least one
        const int below = key.level - ancestor.level;
        const int side = std::max(kChunkCells >> below, 1);
        const auto cell_of = [&](std::int32_t index, std::int32_t first) {
            const std::int64_t chunks = index - (std::int64_t{first} << below);
            return static_cast<int>((chunks * kChunkCells) >> below);
        };
        const int west = cell_of(key.x, ancestor.x);
        const int south = cell_of(key.y, ancestor.y);
        const int log2_side = std::countr_zero(static_cast<unsigned>(side));
        const SampleRange samples = chunk.samples_in(log2_side, west, south);
        const float bound = largest_bound(chunk, west, south, side);
        // one quantum more, for the rounding of the absent samples
        const double margin = std::ceil(static_cast<double>(bound) / quantum_) + 1.0;
        const auto clamp = [](double quanta) {
            return static_cast<std::int32_t>(std::clamp(quanta, -2147483648.0, 2147483647.0));
        };
        return {clamp(samples.low - margin), clamp(samples.high + margin)};
    }
    return kEverything;
}

RangeAnswer Ground::range(const CellRange& cells) const {
    RangeAnswer answer;
    SampleRange range = kNothing;
    // only cells inside the extent can be ground
    const std::int64_t west = std::max(cells.west, in_extent_.west);
    const std::int64_t east = std::min(cells.east, in_extent_.east);
    const std::int64_t south = std::max(cells.south, in_extent_.south);
    const std::int64_t north = std::min(cells.north, in_extent_.north);
    if (west > east || south > north) return {answer.status, range.low, range.high};
    for (std::int64_t chunk_row = south >> kChunkShift; chunk_row <= north >> kChunkShift;
         ++chunk_row) {
        for (std::int64_t chunk_column = west >> kChunkShift; chunk_column <= east >> kChunkShift;
             ++chunk_column) {
            const std::int64_t first_column = chunk_column << kChunkShift;
            const std::int64_t first_row = chunk_row << kChunkShift;
            const Chunk* const chunk = find_chunk(first_column, first_row);
            if (chunk == nullptr) {
                answer.status = GroundStatus::not_resident;
                add(range, range_of_absent({static_cast<std::int32_t>(chunk_column),
                                            static_cast<std::int32_t>(chunk_row),
                                            static_cast<std::uint8_t>(level_)}));
                continue;
            }
            if (answer.status == GroundStatus::outside) answer.status = GroundStatus::ok;
            const auto in_chunk = [](std::int64_t cell, std::int64_t first) {
                return static_cast<int>(std::clamp<std::int64_t>(cell - first, 0, kChunkCells - 1));
            };
            add(range, range_of_blocks(*chunk,
                                       {in_chunk(west, first_column), in_chunk(south, first_row),
                                        in_chunk(east, first_column), in_chunk(north, first_row)}));
        }
    }
    return {answer.status, range.low, range.high};
}

}  // namespace terrane
