// SPDX-License-Identifier: MIT
#include "chunk/chunk_outline.h"
#include "ground/ray_walk.h"

#include <terrane/base/result.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace terrane {
namespace {

constexpr SampleRange kEverything{std::numeric_limits<std::int32_t>::min(),
                                  std::numeric_limits<std::int32_t>::max()};
constexpr SampleRange kNothing{std::numeric_limits<std::int32_t>::max(),
                               std::numeric_limits<std::int32_t>::min()};

// log2 of the side of the smallest squares that ranges are composed of, cells.
constexpr int kBlockLog2 = 3;

void add(SampleRange& range, const SampleRange& more) {
    range.low = std::min(range.low, more.low);
    range.high = std::max(range.high, more.high);
}

// Cells of a chunk, ends included.
struct ChunkCells {
    int west, south, east, north;
};

// Adds the ranges of those blocks in a square of the pyramid that overlap the cells.
void add_blocks(const SamplePyramid& pyramid, int log2_side, int column, int row,
                const ChunkCells& cells, SampleRange& range) {
    const int last = (1 << log2_side) - 1;
    if (column > cells.east || column + last < cells.west || row > cells.north ||
        row + last < cells.south) {
        return;
    }
    if (log2_side == kBlockLog2 || (column >= cells.west && column + last <= cells.east &&
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
    // the smallest aligned square that contains all cells
    const auto differing =
        static_cast<unsigned>((cells.west ^ cells.east) | (cells.south ^ cells.north));
    const int log2_side = std::max(static_cast<int>(std::bit_width(differing)), kBlockLog2);
    const int corner = -(1 << log2_side);
    SampleRange range = kNothing;
    add_blocks(chunk.pyramid, log2_side, cells.west & corner, cells.south & corner, cells, range);
    return range;
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
    // Edges that cut off slivers are moved, because triangles without area have no normal.
    for (const auto& [lines, edge] :
         {std::pair(&columns_, &extent_.west), std::pair(&columns_, &extent_.east),
          std::pair(&rows_, &extent_.south), std::pair(&rows_, &extent_.north)}) {
        const double line = lines->at(lines->last_up_to(*edge + 0.5 * spacing_));
        if (std::abs(line - *edge) <= 0x1p-20 * spacing_) *edge = line;
    }
    in_extent_ = {column_at(extent_.west), row_at(extent_.south), column_at(extent_.east),
                  row_at(extent_.north)};
    // excludes cells that only touch the extent's edge, and cells outside the root squares
    if (columns_.at(in_extent_.east) >= extent_.east) --in_extent_.east;
    if (rows_.at(in_extent_.north) >= extent_.north) --in_extent_.north;
    whole_ = in_extent_;
    if (columns_.at(whole_.west) < extent_.west) ++whole_.west;
    if (rows_.at(whole_.south) < extent_.south) ++whole_.south;
    if (columns_.at(whole_.east + 1) > extent_.east) --whole_.east;
    if (rows_.at(whole_.north + 1) > extent_.north) --whole_.north;
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
    if (!(lattice() == other.lattice()) || !(extent_ == other.extent_)) return false;
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

// Bounds of the contact surface over an absent chunk, from its finest resident ancestor. Unbounded if there is none.
SampleRange Ground::range_of_absent(const ChunkKey& key) const {
    for (ChunkKey ancestor = key; ancestor.level > 0;) {
        ancestor = ancestor.parent();
        if (const Chunk* const chunk = resident_->find_ground(ancestor))
            return internal::range_over(*chunk, key, quantum_);
        if (const UndrawnChunk* const undrawn = resident_->find_undrawn(ancestor))
            return internal::range_over(*undrawn->outline, key);
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
                answer.status = QueryStatus::not_resident;
                add(range, range_of_absent({static_cast<std::int32_t>(chunk_column),
                                            static_cast<std::int32_t>(chunk_row),
                                            static_cast<std::uint8_t>(level_)}));
                continue;
            }
            if (answer.status == QueryStatus::outside) answer.status = QueryStatus::ok;
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

// A point of a closed cell: metres from its south-west corner, and in the world.
struct Ground::CellPoint {
    std::int64_t column, row;
    double x, y;
    double x_world, y_world;
};

namespace {

// Answers with the higher of two surfaces at or below at_most: the heightfield, unless replaced, and the joined solid.
void answer_from_solid(const SolidSurface& solid, bool is_replaced, double x, double y,
                       double at_most, HeightAnswer& answer) {
    const bool has_field = !is_replaced && answer.height <= at_most;
    const std::optional<SolidSurface::Hit> hit = solid.highest(x, y, at_most);
    // The solid has copies of triangles next to replaced ones: the heightfield wins ties, up to rounding.
    const double rounding = 1e-14 * (1.0 + std::abs(answer.height));
    if (hit && !(has_field && answer.height >= hit->t - rounding)) {
        answer.height = hit->t;
        answer.normal = solid.normal(hit->triangle);
        // A clipped triangle has the error of its cell.
        answer.error_m = std::max(answer.error_m, solid.error_m(hit->triangle));
        answer.filled = false;
    } else if (!has_field) {
        answer = {.status = QueryStatus::miss};
    }
}

}  // namespace

// Returns false if the cell is not ground; true with an answer or with not_resident.
inline bool Ground::height_over(const CellPoint& point, double at_most,
                                HeightAnswer& answer) const {
    if (!is_in_extent(point.column, point.row)) return false;
    const Chunk* const chunk = find_chunk(point.column, point.row);
    if (chunk == nullptr) {
        answer.status = QueryStatus::not_resident;
        return true;
    }
    const auto i = static_cast<std::size_t>(point.column & (kChunkCells - 1));
    const auto j = static_cast<std::size_t>(point.row & (kChunkCells - 1));
    const std::size_t cell = j * kChunkCells + i;
    if (!chunk->cell_flags.empty()) {
        const std::uint8_t flags = chunk->cell_flags[cell];
        if ((flags & cell_outside) != 0) return false;
        answer.filled = (flags & cell_filled) != 0;
    }
    const double u = std::min(1.0, point.x / spacing_);
    const double v = std::min(1.0, point.y / spacing_);
    const internal::CellHeight found =
        internal::height_in_cell(&chunk->heights[j * kChunkSamples + i], u, v,
                                 cut_to_north_east(point.column, point.row), quantum_);
    answer.status = QueryStatus::ok;
    answer.height = found.height;
    answer.normal = found.normal(spacing_);
    answer.error_m = static_cast<double>(chunk->cell_error(cell));
    if (chunk->solid != nullptr) {
        answer_from_solid(*chunk->solid, chunk->solid->is_replaced(cell, !found.is_south),
                          point.x_world, point.y_world, at_most, answer);
    } else if (!(answer.height <= at_most)) {
        answer = {.status = QueryStatus::miss};
    }
    return true;
}

HeightAnswer Ground::height(double x, double y) const {
    return height_at_most(x, y, std::numeric_limits<double>::infinity());
}

HeightAnswer Ground::height_below(double x, double y, double z) const {
    if (std::isnan(z)) return {};
    return height_at_most(x, y, z);
}

inline HeightAnswer Ground::height_at_most(double x, double y, double at_most) const {
    HeightAnswer answer;
    if (!extent_.contains(x, y)) {
        if (std::isfinite(x) && std::isfinite(y)) answer.status = QueryStatus::outside;
        return answer;
    }
    answer.status = QueryStatus::outside;
    const std::int64_t column = columns_.last_up_to(x);
    const std::int64_t row = rows_.last_up_to(y);
    const auto over = [&](std::int64_t before_x, std::int64_t before_y) -> CellPoint {
        return {column - before_x,
                row - before_y,
                x - columns_.at(column - before_x),
                y - rows_.at(row - before_y),
                x,
                y};
    };
    const CellPoint point = over(0, 0);
    if (height_over(point, at_most, answer)) return answer;
    // cells are closed: on a line, the western or southern cell answers if the eastern or northern one is not ground
    const bool is_on_column = point.x == 0.0, is_on_row = point.y == 0.0;
    if (is_on_column && height_over(over(1, 0), at_most, answer)) return answer;
    if (is_on_row && height_over(over(0, 1), at_most, answer)) return answer;
    if (is_on_column && is_on_row) height_over(over(1, 1), at_most, answer);
    return answer;
}

}  // namespace terrane
