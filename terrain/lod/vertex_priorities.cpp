// SPDX-License-Identifier: MIT
#include "vertex_priorities.h"

#include <algorithm>
#include <array>
#include <bit>

namespace terrane::internal {
namespace {

constexpr std::size_t kSamples = std::size_t{kChunkSamples} * kChunkSamples;

enum Neighbour : std::size_t { west = 0, east = 1, south = 2, north = 3 };

}  // namespace

VertexPriorities::VertexPriorities(const HeightSource& source)
    : lattice_(source.lattice()), radii_(make_radii(source)) {
    for (int level = 0; level <= lattice_.finest_level; ++level) {
        radius_rows_.push_back(make_radius_rows(level));
    }
}

std::size_t VertexPriorities::exponent(int level, int stride) const {
    return static_cast<std::size_t>(lattice_.finest_level - level +
                                    std::countr_zero(static_cast<unsigned>(stride)));
}

std::int32_t VertexPriorities::slot_of(std::int32_t index) const {
    return index == ResidentSet::kNone ? index : slot_[static_cast<std::size_t>(index)];
}

const ChunkPriorities* VertexPriorities::find(std::int32_t index) const {
    const std::int32_t slot = slot_of(index);
    return slot == ResidentSet::kNone ? nullptr : &open_[static_cast<std::size_t>(slot)];
}

ChunkPriorities* VertexPriorities::open(std::int32_t index) {
    const std::int32_t slot = slot_of(index);
    return slot == ResidentSet::kNone ? nullptr : &open_[static_cast<std::size_t>(slot)];
}

// Radii of every row of samples of a level. Rows of one parity are alike below the roots.
std::vector<float> VertexPriorities::make_radius_rows(int level) const {
    const int rows = level == 0 ? kChunkSamples : 2;
    std::vector<float> table;
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < kChunkSamples; ++column) {
            const auto both = static_cast<unsigned>(row | column);
            const int stride = both == 0 ? kChunkCells : 1 << std::countr_zero(both);
            // vertices of other chunks have a bound of 0 here: their radius does not matter
            const int own = std::min(stride, level == 0 ? kChunkCells / 2 : 1);
            const bool is_centre = ((row / own) & (column / own) & 1) != 0;
            const std::size_t e = exponent(level, own);
            table.push_back(is_centre ? radii_.centre[e] : radii_.midpoint[e]);
        }
    }
    return table;
}

// What a vertex would get from its own bound and distance, in the areas that may be above the floor.
void VertexPriorities::compute_own(const ScreenError& screen, const Chunk& chunk, float floor,
                                   ChunkPriorities& into) const {
    into.ranges.clear();
    if (chunk.key.level == 0) {
        into.ranges.push_back({0, 0, kChunkCells, kChunkCells});
    } else {
        const float largest = radii_.centre[exponent(chunk.key.level, 1)];
        for (int area = 0; area < kChunkAreas * kChunkAreas; ++area) {
            if (!(screen.upper_bound(chunk, area, largest) > floor)) continue;
            const int west = area % kChunkAreas * kAreaCells;
            const int south = area / kChunkAreas * kAreaCells;
            into.ranges.push_back({west, south, west + kAreaCells, south + kAreaCells});
        }
    }
    std::fill(into.own.begin(), into.own.end(), 0.0f);
    std::fill(into.trimmed.begin(), into.trimmed.end(), 0.0f);
    const ScreenError::Axes axes = screen.axes(chunk);
    const ScreenError::Side side = screen.side(chunk);
    const std::vector<float>& table = radius_rows_[chunk.key.level];
    for (const SampleRange& range : into.ranges) {
        for (int row = range.south; row <= range.north; ++row) {
            const int table_row = chunk.key.level == 0 ? row : row % 2;
            screen.priorities(chunk, axes, {row, range.west, range.east - range.west + 1},
                              &table[sample_index(0, table_row)], side,
                              &into.own[sample_index(0, row)]);
        }
    }
}

// A centre's parents are the corners of its square with an odd index sum: midpoints of twice the
// spacing, in the same root or in the chunk's parent. The centre of a root square has none.
void VertexPriorities::trim_centres(std::size_t index, const SampleRange& range, int stride) {
    const Chunk& chunk = *resident_->chunks()[index];
    ChunkPriorities& mine = *open(static_cast<std::int32_t>(index));
    const bool is_root = chunk.key.level == 0;
    const ChunkPriorities* above = is_root ? &mine : open(resident_->links(index).parent);
    const int shift_x = !is_root && (chunk.key.x & 1) != 0 ? kChunkCells / 2 : 0;
    const int shift_y = !is_root && (chunk.key.y & 1) != 0 ? kChunkCells / 2 : 0;
    const auto parent_priority = [&](int column, int row) {
        if (is_root) return mine.trimmed[sample_index(column, row)];
        return above->trimmed[sample_index(shift_x + column / 2, shift_y + row / 2)];
    };
    for (int row = range.south + stride; row < range.north; row += 2 * stride) {
        for (int column = range.west + stride; column < range.east; column += 2 * stride) {
            const std::size_t vertex = sample_index(column, row);
            float priority = mine.own[vertex];
            if (above == nullptr) {
                priority = 0.0f;
            } else if (2 * stride < kChunkCells) {
                // index sum of the south-western corner, in units of twice the stride
                const bool is_even = (((column - stride) + (row - stride)) / (2 * stride)) % 2 == 0;
                const int other = is_even ? -stride : stride;
                priority = std::min({priority, parent_priority(column + stride, row + other),
                                     parent_priority(column - stride, row - other)});
            }
            mine.trimmed[vertex] = priority;
        }
    }
}

// A midpoint's parents are the centres on both sides of it; on the world's border there is one.
void VertexPriorities::trim_midpoints(std::size_t index, const SampleRange& range, int stride) {
    const Chunk& chunk = *resident_->chunks()[index];
    ChunkPriorities& mine = *open(static_cast<std::int32_t>(index));
    const ResidentSet::Links& links = resident_->links(index);
    const auto inside = [&](int column, int row) {
        return mine.trimmed[sample_index(column, row)];
    };
    // the centre across a border of the chunk
    const auto across = [&](Neighbour side, int column, int row, float otherwise) {
        const ChunkKey& key = chunk.key;
        const std::array<ChunkKey, 4> keys{
            ChunkKey{key.x - 1, key.y, key.level}, ChunkKey{key.x + 1, key.y, key.level},
            ChunkKey{key.x, key.y - 1, key.level}, ChunkKey{key.x, key.y + 1, key.level}};
        if (!lattice_.contains(keys[side])) return otherwise;
        const ChunkPriorities* other = open(links.neighbour[side]);
        return other == nullptr ? 0.0f : other->trimmed[sample_index(column, row)];
    };
    for (int row = range.south; row <= range.north; row += stride) {
        const bool on_side = (row / stride) % 2 != 0;  // of a square: its centres are east and west
        for (int column = range.west + (on_side ? 0 : stride); column <= range.east;
             column += 2 * stride) {
            float first = 0.0f;
            float second = 0.0f;
            if (on_side) {
                if (column == 0) {
                    second = inside(stride, row);
                    first = across(west, kChunkCells - stride, row, second);
                } else if (column == kChunkCells) {
                    first = inside(kChunkCells - stride, row);
                    second = across(east, stride, row, first);
                } else {
                    first = inside(column - stride, row);
                    second = inside(column + stride, row);
                }
            } else if (row == 0) {
                second = inside(column, stride);
                first = across(south, column, kChunkCells - stride, second);
            } else if (row == kChunkCells) {
                first = inside(column, kChunkCells - stride);
                second = across(north, column, stride, first);
            } else {
                first = inside(column, row - stride);
                second = inside(column, row + stride);
            }
            const std::size_t vertex = sample_index(column, row);
            mine.trimmed[vertex] = std::min({mine.own[vertex], first, second});
        }
    }
}

// Opens every chunk that may have a vertex above the floor, and trims from the roots down.
void VertexPriorities::compute(std::shared_ptr<const ResidentSet> resident,
                               const ScreenError& screen, float floor) {
    resident_ = std::move(resident);
    slot_.assign(resident_->chunks().size(), ResidentSet::kNone);
    open_count_ = 0;
    std::size_t first = 0;
    const std::size_t count = resident_->chunks().size();
    while (first < count) {
        const int level = resident_->chunks()[first]->key.level;
        std::size_t end = first;
        for (; end < count && resident_->chunks()[end]->key.level == level; ++end) {
            const Chunk& chunk = *resident_->chunks()[end];
            const ResidentSet::Links& links = resident_->links(end);
            if (level > 0) {
                if (slot_[static_cast<std::size_t>(links.parent)] == ResidentSet::kNone) continue;
                const float largest = radii_.centre[exponent(level, 1)];
                if (!(screen.upper_bound(chunk, largest) > floor)) continue;
            }
            if (open_count_ == open_.size()) {
                open_.push_back({{}, std::vector<float>(kSamples), std::vector<float>(kSamples)});
            }
            slot_[end] = static_cast<std::int32_t>(open_count_);
            compute_own(screen, chunk, floor, open_[open_count_]);
            ++open_count_;
        }
        const auto for_all_ranges = [&](auto trim) {
            for (std::size_t i = first; i < end; ++i) {
                const ChunkPriorities* chunk = find(static_cast<std::int32_t>(i));
                if (chunk == nullptr) continue;
                for (const SampleRange& range : chunk->ranges) trim(i, range);
            }
        };
        for (int stride = level == 0 ? kChunkCells / 2 : 1; stride >= 1; stride /= 2) {
            for_all_ranges(
                [&](std::size_t i, const SampleRange& range) { trim_centres(i, range, stride); });
            for_all_ranges(
                [&](std::size_t i, const SampleRange& range) { trim_midpoints(i, range, stride); });
        }
        first = end;
    }
}

// Collects a chunk's vertices above the floor. Those on a shared border belong to the chunk east or
// north of it.
std::size_t VertexPriorities::gather_chunk(std::size_t index, float floor,
                                           std::vector<Candidate>& candidates) const {
    std::size_t weight = 0;
    const Chunk& chunk = *resident_->chunks()[index];
    const ChunkPriorities& mine = *find(static_cast<std::int32_t>(index));
    const std::int64_t side = chunk.step * kChunkCells;
    const bool at_west = chunk.corner.x == lattice_.west();
    const bool at_east = chunk.corner.x + side == lattice_.east();
    const bool at_south = chunk.corner.y == lattice_.south();
    const bool at_north = chunk.corner.y + side == lattice_.north();
    for (const SampleRange& range : mine.ranges) {
        // the lines at a range's east and north belong to the next range, but on the world's border
        const int last_row = at_north && range.north == kChunkCells ? range.north : range.north - 1;
        const int last_column = at_east && range.east == kChunkCells ? range.east : range.east - 1;
        for (int row = range.south; row <= last_row; ++row) {
            const float* priorities = &mine.trimmed[sample_index(0, row)];
            const bool on_border_row = (row == 0 && at_south) || row == kChunkCells;
            for (int column = range.west; column <= last_column; ++column) {
                if (!(priorities[column] > floor)) continue;
                const bool on_border =
                    on_border_row || (column == 0 && at_west) || column == kChunkCells;
                candidates.push_back({priorities[column], on_border ? 1u : 2u});
                weight += on_border ? 1 : 2;
            }
        }
    }
    return weight;
}

std::size_t VertexPriorities::gather(float floor, std::vector<Candidate>& candidates) const {
    std::size_t weight = 0;
    for (std::size_t i = 0; i < slot_.size(); ++i) {
        if (slot_[i] != ResidentSet::kNone) weight += gather_chunk(i, floor, candidates);
    }
    return weight;
}

}  // namespace terrane::internal
