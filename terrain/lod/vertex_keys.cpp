// SPDX-License-Identifier: MIT
#include "vertex_keys.h"

#include <algorithm>
#include <bit>

namespace terrane::internal {
namespace {

constexpr int kLast = kChunkCells;  // column or row of a chunk's far sides

}  // namespace

VertexKeys::VertexKeys(const HeightSource& source, SimdLevel simd, std::size_t open_chunks)
    : lattice_(source.lattice()), reaches_(make_reaches(source)), kernels_(&key_kernels(simd)) {
    for (int level = 0; level <= lattice_.finest_level; ++level) {
        // rows of one parity are alike below the roots
        std::vector<ReachRow>& rows = reach_rows_.emplace_back(level == 0 ? kChunkSamples : 2);
        for (int row = 0; row < static_cast<int>(rows.size()); ++row) {
            for (int column = 0; column < kChunkSamples; ++column) {
                const auto both = static_cast<unsigned>(row | column);
                const int stride = both == 0 ? kChunkCells : 1 << std::countr_zero(both);
                // vertices of other chunks have no key here: their reach does not matter
                const int own = std::min(stride, level == 0 ? kChunkCells / 2 : 1);
                const bool is_centre = ((row / own) & (column / own) & 1) != 0;
                const std::size_t e = exponent(level, own);
                const Reach reach = is_centre ? reaches_.centre[e] : reaches_.midpoint[e];
                rows[static_cast<std::size_t>(row)].across[static_cast<std::size_t>(column)] =
                    reach.across;
                rows[static_cast<std::size_t>(row)].up[static_cast<std::size_t>(column)] = reach.up;
            }
        }
    }
    pool_.reserve(open_chunks);
    for (std::size_t i = 0; i < open_chunks; ++i) pool_.push_back(std::make_unique<OpenChunk>());
    open_.resize(open_chunks);
    by_index_.reserve(16 * open_chunks);
}

std::size_t VertexKeys::exponent(int level, int stride) const {
    return static_cast<std::size_t>(lattice_.finest_level - level +
                                    std::countr_zero(static_cast<unsigned>(stride)));
}

const VertexKeys::ReachRow& VertexKeys::reach_row(int level, int row) const {
    return reach_rows_[static_cast<std::size_t>(level)]
                      [static_cast<std::size_t>(level == 0 ? row : row % 2)];
}

Reach VertexKeys::largest_reach(const Chunk& chunk) const {
    return reaches_.centre[exponent(chunk.key.level, coarsest_stride(chunk))];
}

OpenChunk* VertexKeys::find(std::int32_t index) const {
    return index == ResidentSet::kNone ? nullptr : by_index_[static_cast<std::size_t>(index)];
}

void VertexKeys::open_chunk(const ResidentSet& resident, std::size_t index) {
    if (open_count_ == pool_.size()) {
        pool_.push_back(std::make_unique<OpenChunk>());
        open_.resize(pool_.size());
    }
    OpenChunk& chunk = *pool_[open_count_];
    open_[open_count_++] = &chunk;
    by_index_[index] = &chunk;
    chunk.chunk = resident.chunks()[index].get();
    chunk.index = static_cast<std::int32_t>(index);
    const float fade = chunk.is_root() ? 1.0f : resident.fade(index);
    chunk.fade_factor = fade < 1.0f ? 1.0f / (fade * fade) : 1.0f;
}

// Finds the relatives of a chunk whose level is all open.
void VertexKeys::link(const ResidentSet& resident, OpenChunk& chunk) {
    const ResidentSet::Links& links = resident.links(static_cast<std::size_t>(chunk.index));
    const auto is_there = [&](std::int32_t index) {
        return index != ResidentSet::kNone && resident.fade(static_cast<std::size_t>(index)) > 0.0f;
    };
    const ChunkKey& key = chunk.chunk->key;
    const std::array<ChunkKey, 4> beyond{
        ChunkKey{key.x - 1, key.y, key.level}, ChunkKey{key.x + 1, key.y, key.level},
        ChunkKey{key.x, key.y - 1, key.level}, ChunkKey{key.x, key.y + 1, key.level}};
    for (std::size_t side = 0; side < 4; ++side) {
        chunk.neighbour[side] = find(links.neighbour[side]);
        chunk.beyond[side] = !lattice_.contains(beyond[side])  ? OpenChunk::Beyond::world_end
                             : is_there(links.neighbour[side]) ? OpenChunk::Beyond::resident
                                                               : OpenChunk::Beyond::absent;
    }
    for (std::size_t quadrant = 0; quadrant < 4; ++quadrant) {
        chunk.child[quadrant] = nullptr;
        chunk.is_absent[quadrant] = !is_there(links.child[quadrant]);
    }
    chunk.parent = find(links.parent);
    if (chunk.parent != nullptr) {
        chunk.parent->child[static_cast<std::size_t>(key.quadrant())] = &chunk;
    }
}

void VertexKeys::open_areas(const ScreenError& screen, float floor, OpenChunk& chunk) const {
    const Reach reach = largest_reach(*chunk.chunk);
    chunk.planes = screen.planes_across(screen.box_of(*chunk.chunk));
    const bool is_in_view = chunk.planes.count == 0;
    for (int row = 0; row < kChunkAreas; ++row) {
        unsigned open = 0, beside = 0;
        for (int column = 0; column < kChunkAreas; ++column) {
            const int area = row * kChunkAreas + column;
            const float bound = chunk.chunk->areas[static_cast<std::size_t>(area)].max_vertex_bound;
            const ScreenError::Box box = screen.box_of_area(*chunk.chunk, area);
            if (!chunk.is_root() && !(screen.least_key(box, bound, reach) < floor)) continue;
            open |= 1u << column;
            if (!is_in_view && !screen.is_inside(box)) beside |= 1u << column;
        }
        chunk.open_areas[static_cast<std::size_t>(row)] = static_cast<std::uint8_t>(open);
        chunk.areas_beside[static_cast<std::size_t>(row)] = static_cast<std::uint8_t>(beside);
    }
}

void VertexKeys::compute_own_row(const ScreenError& screen, const ScreenError::Axes& axes,
                                 const OpenChunk& chunk, int row, int first, int last,
                                 bool is_in_view, float* keys_out) const {
    const auto at = static_cast<std::size_t>(first);
    const ReachRow& reach = reach_row(chunk.chunk->key.level, row);
    const std::size_t sample = sample_index(first, row);
    KeyRow part;
    part.count = last - first + 1;
    part.x = &axes.x[at];
    part.y = axes.y[static_cast<std::size_t>(row)];
    part.heights = &chunk.chunk->heights[sample];
    part.inverse_square_bounds = &chunk.chunk->inverse_square_bounds[sample];
    part.across = &reach.across[at];
    part.up = &reach.up[at];
    part.height_base = screen.heights().base;
    part.quantum = screen.heights().quantum;
    part.height_rest = screen.heights().rest;
    part.near_squared = screen.near_squared();
    kernels_->own(part, keys_out);
    if (is_in_view) return;
    kernels_->weigh(part, chunk.planes, keys_out);
}

void VertexKeys::compute_own(const ScreenError& screen, const OpenChunk& chunk,
                             float* keys_out) const {
    ScreenError::Axes axes;
    screen.fill_axes(*chunk.chunk, axes);
    for (int row = 0; row < kChunkSamples; ++row) {
        if (chunk.open_columns(row) != 0xffu) {
            std::fill_n(keys_out + sample_index(0, row), kChunkSamples, OpenChunk::kNever);
        }
        const unsigned open = chunk.open_columns(row);
        const unsigned beside = open & chunk.columns_beside(row);
        const auto compute = [&](unsigned columns, bool is_in_view) {
            OpenChunk::for_each_run(columns, [&](int first, int last) {
                compute_own_row(screen, axes, chunk, row, first, last, is_in_view,
                                keys_out + sample_index(first, row));
            });
        };
        // what lies on a line between areas gets the same bits from both
        compute(open & ~beside, true);
        compute(beside, false);
    }
}

// The lines on a chunk's sides fade with the neighbours, too: in trim_border_midpoint().
void VertexKeys::fade_inside(OpenChunk& chunk) const {
    if (chunk.fade_factor == 1.0f) return;
    for (int row = 1; row < kLast; ++row) {
        for (int column = 1; column < kLast; ++column) {
            chunk.keys[sample_index(column, row)] *= chunk.fade_factor;
        }
    }
}

// Raises keys to those of the parents, but for midpoints on the chunk's sides.
void VertexKeys::trim_inside(OpenChunk& chunk, float floor) const {
    const Chunk& heights = *chunk.chunk;
    const int shift_x = (heights.key.x & 1) != 0 ? kChunkCells / 2 : 0;
    const int shift_y = (heights.key.y & 1) != 0 ? kChunkCells / 2 : 0;
    bool held = false;
    for (int row = 1; row < kLast; row += 2) {
        OpenChunk::for_each_run(chunk.open_columns(row), [&](int first, int last) {
            float* keys = chunk.key_row(row) + first;
            const int count = last - first + 1;
            if (!chunk.is_root()) {
                const float* south = chunk.parent->key_row(shift_y + row / 2) + shift_x + first / 2;
                held |= kernels_->trim_centres(keys, count, south, south + kChunkSamples,
                                               (row / 2 + first / 2) % 2 == 0, floor);
            }
            // between open areas and closed ones: nothing beyond is below the floor
            if (first > 0) keys[0] = std::max(keys[0], std::max(keys[-1], keys[1]));
            held |= kernels_->trim_between(keys, count, floor);
            if (last < kLast) {
                keys[count - 1] = std::max(keys[count - 1], std::max(keys[count - 2], keys[count]));
            }
        });
    }
    for (int row = 2; row < kLast; row += 2) {
        OpenChunk::for_each_run(chunk.open_columns(row), [&](int first, int last) {
            held |= kernels_->trim_across(chunk.key_row(row) + first, last - first + 1,
                                          chunk.key_row(row - 1) + first,
                                          chunk.key_row(row + 1) + first, floor);
        });
    }
    chunk.is_held |= held;
}

// The midpoint at `sample` of a chunk's side; its parents are the centres at `inside`, and at
// `across` of the neighbour. On the world's border there is one.
void VertexKeys::trim_border_midpoint(OpenChunk& chunk, Side side, std::size_t sample,
                                      std::size_t inside, std::size_t across, float floor) const {
    float factor = chunk.fade_factor;
    float parents = chunk.keys[inside];
    if (chunk.beyond[side] == OpenChunk::Beyond::absent) {
        parents = OpenChunk::kNever;
    } else if (chunk.beyond[side] == OpenChunk::Beyond::resident) {
        const OpenChunk* other = chunk.neighbour[side];
        parents = other == nullptr ? OpenChunk::kNever : std::max(parents, other->keys[across]);
        if (other != nullptr) factor = std::max(factor, other->fade_factor);
    }
    const float key = factor * chunk.keys[sample];
    // beyond a closed chunk's side nothing is below the floor
    chunk.is_held |= key < floor && key < parents;
    chunk.keys[sample] = std::max(key, parents);
}

void VertexKeys::trim_borders(OpenChunk& chunk, float floor) const {
    for (int i = 1; i < kLast; i += 2) {
        trim_border_midpoint(chunk, west, sample_index(0, i), sample_index(1, i),
                             sample_index(kLast - 1, i), floor);
        trim_border_midpoint(chunk, east, sample_index(kLast, i), sample_index(kLast - 1, i),
                             sample_index(1, i), floor);
        trim_border_midpoint(chunk, south, sample_index(i, 0), sample_index(i, 1),
                             sample_index(i, kLast - 1), floor);
        trim_border_midpoint(chunk, north, sample_index(i, kLast), sample_index(i, kLast - 1),
                             sample_index(i, 1), floor);
    }
}

// The centre of a root square has no parents.
void VertexKeys::trim_root_centres(OpenChunk& root, int stride, float floor) const {
    if (stride == kChunkCells / 2) return;
    // the parents are the corners of odd index sum, in units of twice the stride
    int row_other = -stride;
    for (int row = stride; row < kLast; row += 2 * stride, row_other = -row_other) {
        int other = row_other;
        for (int column = stride; column < kLast; column += 2 * stride, other = -other) {
            const float parents = std::max(root.keys[sample_index(column + stride, row + other)],
                                           root.keys[sample_index(column - stride, row - other)]);
            float& key = root.keys[sample_index(column, row)];
            root.is_held |= key < floor && key < parents;
            key = std::max(key, parents);
        }
    }
}

// Midpoints of a spacing coarser than the root's own samples, those on its sides included.
void VertexKeys::trim_root_midpoints(OpenChunk& root, int stride, float floor) const {
    bool is_centre_row = false;
    for (int row = 0; row <= kLast; row += stride, is_centre_row = !is_centre_row) {
        for (int column = is_centre_row ? 0 : stride; column <= kLast; column += 2 * stride) {
            const std::size_t sample = sample_index(column, row);
            if (is_centre_row && column == 0) {
                trim_border_midpoint(root, west, sample, sample_index(stride, row),
                                     sample_index(kLast - stride, row), floor);
            } else if (is_centre_row && column == kLast) {
                trim_border_midpoint(root, east, sample, sample_index(kLast - stride, row),
                                     sample_index(stride, row), floor);
            } else if (row == 0) {
                trim_border_midpoint(root, south, sample, sample_index(column, stride),
                                     sample_index(column, kLast - stride), floor);
            } else if (row == kLast) {
                trim_border_midpoint(root, north, sample, sample_index(column, kLast - stride),
                                     sample_index(column, stride), floor);
            } else {
                const std::size_t step = is_centre_row
                                             ? static_cast<std::size_t>(stride)
                                             : static_cast<std::size_t>(stride) * kChunkSamples;
                const float parents = std::max(root.keys[sample - step], root.keys[sample + step]);
                root.is_held |= root.keys[sample] < floor && root.keys[sample] < parents;
                root.keys[sample] = std::max(root.keys[sample], parents);
            }
        }
    }
}

void VertexKeys::compute(const ResidentSet& resident, const ScreenError& screen, float floor,
                         WorkerTeam& team) {
    const std::size_t count = resident.chunks().size();
    by_index_.assign(count, nullptr);
    open_count_ = 0;
    std::size_t first = 0;
    while (first < count) {
        const int level = resident.chunks()[first]->key.level;
        const std::size_t first_open = open_count_;
        for (; first < count && resident.chunks()[first]->key.level == level; ++first) {
            const Chunk& chunk = *resident.chunks()[first];
            if (level > 0) {
                if (find(resident.links(first).parent) == nullptr) continue;
                if (!(resident.fade(first) > 0.0f)) continue;
                const float least = screen.least_key(screen.box_of(chunk), chunk.max_vertex_bound,
                                                     largest_reach(chunk));
                if (!(least < floor)) continue;
            }
            open_chunk(resident, first);
        }
        const std::span<OpenChunk* const> here = open().subspan(first_open);
        if (here.empty()) break;
        for (OpenChunk* chunk : here) link(resident, *chunk);
        team.run(here.size(), [&](std::size_t i, int) {
            here[i]->is_held = false;
            open_areas(screen, floor, *here[i]);
            compute_own(screen, *here[i], here[i]->keys.data());
            fade_inside(*here[i]);
            if (level > 0) trim_inside(*here[i], floor);
        });
        if (level == 0) {
            for (int stride = kChunkCells / 2; stride >= 1; stride /= 2) {
                for (OpenChunk* root : here) trim_root_centres(*root, stride, floor);
                if (stride == 1) break;
                for (OpenChunk* root : here) trim_root_midpoints(*root, stride, floor);
            }
            for (OpenChunk* root : here) trim_inside(*root, floor);
        }
        team.run(here.size(), [&](std::size_t i, int) { trim_borders(*here[i], floor); });
    }
}

}  // namespace terrane::internal
