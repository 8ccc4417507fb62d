// SPDX-License-Identifier: MIT
//
// Keys of a root's vertices of coarser spacings, computed one at a time because there are few. In this section columns,
// rows and strides count even samples.
#include "lod/screen_error.h"
#include "lod/selection.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace terrane::internal {
namespace {

constexpr int kSide = kChunkSquares;  // last column and row
constexpr int kCoarsest = kSide / 2;  // stride of the root square's own centre

std::size_t coarse_index(int column, int row) {
    return static_cast<std::size_t>(row) * OpenChunk::kCoarseSide +
           static_cast<std::size_t>(column);
}

}  // namespace

float VertexKeys::own_coarse_key(const ScreenError& screen, const OpenChunk& root, int column,
                                 int row) const {
    const auto both = static_cast<unsigned>(column | row);
    if (both % kSide == 0) return OpenChunk::kNever;  // corners of the root square
    const int stride = 1 << std::countr_zero(both);
    const bool is_centre = ((row / stride) & (column / stride) & 1) != 0;
    const Reach around = reach(*root.chunk, 2 * stride, is_centre);
    const std::int32_t height = root.chunk->heights[sample_index(2 * column, 2 * row)];
    const float z = screen.height_over_eye(lattice_.quantum * height);
    const float key =
        own_key(root, 2 * column, 2 * row, z - around.half_height, z + around.half_height,
                around.half_width, root.chunk->vertices->coarse_bounds[coarse_index(column, row)]);
    if (!root.is_pinned) return key;
    return pins_->lowered(*root.chunk, 2 * column, 2 * row, 2 * stride, is_centre, key);
}

// Whether any vertex of a stride may have a key below the floor. False for most strides of roots that are far from the
// eye or outside the view; their keys are not computed.
bool VertexKeys::may_be_below(const ScreenError& screen, const OpenChunk& root, int stride,
                              float floor) const {
    if (root.is_pinned) return true;
    const Reach around = reach(*root.chunk, 2 * stride, true);
    ScreenError::WorldBox box = screen.box_of(*root.chunk);
    const Eigen::Vector3d wider(static_cast<double>(around.half_width),
                                static_cast<double>(around.half_width),
                                static_cast<double>(around.half_height));
    box.low -= wider;
    box.high += wider;
    const auto exponent = static_cast<std::size_t>(std::countr_zero(static_cast<unsigned>(stride)));
    return screen.least_key(box, root.chunk->vertices->largest_coarse_bounds[exponent]) < floor;
}

// Sets a coarser vertex's key: its own, raised to its parents' keys. The own key is not computed if no parent is below
// the floor: then the vertex is inactive, and no triangle is drawn that it would split.
void VertexKeys::find_coarse_key(const ScreenError& screen, OpenChunk& root, int column, int row,
                                 float parent, float other_parent, float floor) const {
    float& key = root.coarse_keys[coarse_index(column, row)];
    key = std::max(parent, other_parent);
    if (!(std::min(parent, other_parent) < floor)) return;
    const float own = own_coarse_key(screen, root, column, row);
    root.is_coarse_held |= own < floor && own < key;
    key = std::max(own, key);
}

void VertexKeys::find_coarse_centres(const ScreenError& screen, OpenChunk& root, int stride,
                                     float floor) const {
    if (stride == kCoarsest) {
        // the centre of a root square has no parents
        find_coarse_key(screen, root, stride, stride, 0.0f, 0.0f, floor);
        return;
    }
    // the parents are the corners of odd index sum, in units of twice the stride
    int row_other = -stride;
    for (int row = stride; row < kSide; row += 2 * stride, row_other = -row_other) {
        int other = row_other;
        for (int column = stride; column < kSide; column += 2 * stride, other = -other) {
            find_coarse_key(screen, root, column, row,
                            root.coarse_keys[coarse_index(column + stride, row + other)],
                            root.coarse_keys[coarse_index(column - stride, row - other)], floor);
        }
    }
}

void VertexKeys::find_coarse_midpoints(const ScreenError& screen, OpenChunk& root, int stride,
                                       float floor) const {
    // a centre beyond a side belongs to the neighbour, if there is one
    const auto beyond = [&](Side side, int column, int row) {
        if (root.at_world_border[side]) return 0.0f;
        const OpenChunk* const owner = root.neighbour[side];
        return owner == nullptr ? OpenChunk::kNever : owner->coarse_keys[coarse_index(column, row)];
    };
    const auto inside = [&](int column, int row) {
        return root.coarse_keys[coarse_index(column, row)];
    };
    const int last = kSide - stride;
    for (int along = stride; along < kSide; along += 2 * stride) {
        for (int row = 0; row <= kSide; row += 2 * stride) {
            find_coarse_key(
                screen, root, along, row,
                row > 0 ? inside(along, row - stride) : beyond(south, along, last),
                row < kSide ? inside(along, row + stride) : beyond(north, along, stride), floor);
        }
        for (int column = 0; column <= kSide; column += 2 * stride) {
            find_coarse_key(
                screen, root, column, along,
                column > 0 ? inside(column - stride, along) : beyond(west, last, along),
                column < kSide ? inside(column + stride, along) : beyond(east, stride, along),
                floor);
        }
    }
}

void VertexKeys::find_coarse_keys(const ScreenError& screen, float floor,
                                  std::span<OpenChunk* const> roots) const {
    for (OpenChunk* root : roots) {
        place(screen, *root);
        root->planes = screen.planes_across(screen.box_of(*root->chunk));
        root->coarse_keys.assign(OpenChunk::kCoarseSide * OpenChunk::kCoarseSide,
                                 OpenChunk::kAboveFloor);
        for (const std::size_t corner : {coarse_index(0, 0), coarse_index(kSide, 0),
                                         coarse_index(0, kSide), coarse_index(kSide, kSide)}) {
            root->coarse_keys[corner] = OpenChunk::kNever;
        }
        root->open_strides = 0;
        for (int stride = kCoarsest; stride >= 1; stride /= 2) {
            if (!may_be_below(screen, *root, stride, floor)) continue;
            root->open_strides |= static_cast<unsigned>(stride);
        }
    }
    const auto is_open = [](const OpenChunk& root, int stride) {
        return (root.open_strides & static_cast<unsigned>(stride)) != 0;
    };
    for (int stride = kCoarsest; stride >= 1; stride /= 2) {
        for (OpenChunk* root : roots) {
            if (is_open(*root, stride)) find_coarse_centres(screen, *root, stride, floor);
        }
        for (OpenChunk* root : roots) {
            if (is_open(*root, stride)) find_coarse_midpoints(screen, *root, stride, floor);
        }
    }
}

namespace {

constexpr auto kSquares = static_cast<int>(AreaVertices::kSquares);
constexpr int kLastRow = kSquares - kAreaSquares;  // first square of an area's northernmost row

}  // namespace

VertexKeys::VertexKeys(const HeightSource& source, SimdLevel simd, std::size_t open_chunks)
    : lattice_(source.lattice()), reaches_(make_reaches(source)), kernels_(&key_kernels(simd)) {
    pool_.reserve(open_chunks);
    for (std::size_t i = 0; i < open_chunks; ++i) pool_.push_back(std::make_unique<OpenChunk>());
    open_.resize(open_chunks);
    by_index_.reserve(16 * open_chunks);
    const auto roots = static_cast<std::size_t>(lattice_.resident_root_count());
    for (std::size_t i = 0; i < std::min(roots, open_chunks); ++i) {
        pool_[i]->coarse_keys.reserve(OpenChunk::kCoarseSide * OpenChunk::kCoarseSide);
    }
}

Reach VertexKeys::reach(const Chunk& chunk, int stride, bool is_centre) const {
    const auto exponent = static_cast<std::size_t>(lattice_.finest_level - chunk.key.level +
                                                   std::countr_zero(static_cast<unsigned>(stride)));
    return is_centre ? reaches_.centre[exponent] : reaches_.midpoint[exponent];
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
    chunk.replaced = nullptr;
    chunk.held_areas = 0;
    chunk.is_side_held = chunk.is_coarse_held = false;
    const float fade = chunk.is_root() ? 1.0f : resident.fade(index);
    chunk.fade_factor = fade < 1.0f ? 1.0f / (fade * fade) : 1.0f;
}

// Sets positions relative to the eye.
void VertexKeys::place(const ScreenError& screen, OpenChunk& chunk) {
    screen.fill_axes(*chunk.chunk, chunk.axes);
    chunk.eye_heights = screen.eye_heights(*chunk.chunk);
}

// Links a chunk to its parent, children and neighbours. Requires all chunks of its level to be open.
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
        chunk.at_world_border[side] = !resident.window().contains(beyond[side]);
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
    const float half_width = reach(*chunk.chunk, 1, true).half_width;
    chunk.planes = screen.planes_across(screen.box_of(*chunk.chunk));
    const bool is_in_view = chunk.planes.count == 0;
    chunk.open_areas = screen.areas_below(*chunk.chunk, half_width, floor, is_in_view);
    if (chunk.is_pinned) {
        for_each_bit(~chunk.open_areas, [&](int area) {
            if (!pins_->opens(*chunk.chunk, area, floor)) return;
            chunk.open_areas |= std::uint64_t{1} << area;
        });
    }
    chunk.partly_visible_areas = 0;
    if (is_in_view) return;
    for_each_bit(chunk.open_areas, [&](int area) {
        if (screen.is_inside(screen.box_of_area(*chunk.chunk, area))) return;
        chunk.partly_visible_areas |= std::uint64_t{1} << area;
    });
}

void VertexKeys::own_keys(const OpenChunk& chunk, int area, AreaVertices::Kind kind,
                          float* keys_out) const {
    const AreaVertices& vertices = chunk.chunk->vertices->areas[static_cast<std::size_t>(area)];
    const auto column = static_cast<std::size_t>(area % kChunkAreas * kAreaSquares);
    const auto row = static_cast<std::size_t>(area / kChunkAreas * kAreaSquares);
    VertexGroup group;
    group.inverse_square_bounds = vertices.inverse_square_bounds[kind].data();
    group.low = vertices.low[kind].data();
    group.high = vertices.high[kind].data();
    group.x =
        kind == AreaVertices::along_y ? &chunk.axes.x.even[column] : &chunk.axes.x.odd[column];
    group.y = kind == AreaVertices::along_x ? &chunk.axes.y.even[row] : &chunk.axes.y.odd[row];
    group.half_width = reach(*chunk.chunk, 1, kind == AreaVertices::centre).half_width;
    kernels_->own(group, chunk.eye_heights, keys_out);
    if ((chunk.partly_visible_areas >> area & 1) != 0) {
        kernels_->weigh(group, chunk.eye_heights, chunk.planes, keys_out);
    }
    if (chunk.is_pinned) pins_->lower(*chunk.chunk, area, kind, keys_out);
}

// The own key of one vertex, computed by the same operations as in the kernels.
float VertexKeys::own_key(const OpenChunk& chunk, int column, int row, float low, float high,
                          float half_width, float inverse_square_bound) const {
    const auto position = [](const ChunkAxes::Axis& axis, int i) {
        const auto k = static_cast<std::size_t>(i / 2);
        return i % 2 == 0 ? axis.even[k] : axis.odd[k];
    };
    const float x = position(chunk.axes.x, column), y = position(chunk.axes.y, row);
    const float flat = gap_squared(x, half_width) + gap_squared(y, half_width);
    const float key =
        vertex_key(flat, low, high, inverse_square_bound, chunk.eye_heights.near_squared);
    if (chunk.planes.count == 0) return key;
    return key * outside_factor(x, y, low, high, half_width, chunk.planes);
}

float VertexKeys::own_side_key(const OpenChunk& chunk, Side side, int i) const {
    const bool is_east = side == east;
    const SideVertices& vertices =
        is_east ? chunk.chunk->vertices->east_side : chunk.chunk->vertices->north_side;
    const auto k = static_cast<std::size_t>(i);
    const int column = is_east ? kChunkCells : 2 * i + 1, row = is_east ? 2 * i + 1 : kChunkCells;
    const float key =
        own_key(chunk, column, row, over_eye<float>(vertices.low[k], chunk.eye_heights),
                over_eye<float>(vertices.high[k], chunk.eye_heights),
                reach(*chunk.chunk, 1, false).half_width,
                from_upper_half(vertices.inverse_square_bounds[k]));
    return chunk.is_pinned ? pins_->lowered(*chunk.chunk, column, row, 1, false, key) : key;
}

void VertexKeys::find_centres(float floor, OpenChunk& chunk, int area) const {
    float* keys = chunk.keys_of(area)[AreaVertices::centre].data();
    own_keys(chunk, area, AreaVertices::centre, keys);
    if (chunk.fade_factor != 1.0f) {
        for (int i = 0; i < kSquares; ++i) keys[i] *= chunk.fade_factor;
    }
    const CentreParents parents(chunk, area);
    if (kernels_->trim_centres(parents.sides(), floor, keys)) {
        chunk.held_areas |= std::uint64_t{1} << area;
    }
}

void VertexKeys::find_midpoints(float floor, OpenChunk& chunk, int area) const {
    OpenChunk::Keys& keys = chunk.keys_of(area);
    float* along_x = keys[AreaVertices::along_x].data();
    float* along_y = keys[AreaVertices::along_y].data();
    own_keys(chunk, area, AreaVertices::along_x, along_x);
    own_keys(chunk, area, AreaVertices::along_y, along_y);
    // vertices on the line between two chunks fade with both
    const auto fade_beside = [&](Side side) {
        const AreaRef adjacent = adjacent_area(chunk, area, side);
        return adjacent.chunk == nullptr ? chunk.fade_factor
                                         : std::max(chunk.fade_factor, adjacent.chunk->fade_factor);
    };
    const float from_south = fade_beside(south), from_west = fade_beside(west);
    if (std::max(from_south, from_west) != 1.0f) {
        for (int i = 0; i < kSquares; ++i) {
            along_x[i] *= i < kAreaSquares ? from_south : chunk.fade_factor;
            along_y[i] *= i % kAreaSquares == 0 ? from_west : chunk.fade_factor;
        }
    }
    const float* centres = keys[AreaVertices::centre].data();
    const float* to_south = adjacent_centres(chunk, area, south) + kLastRow;
    const float* to_west = adjacent_centres(chunk, area, west);
    const bool is_x_held = kernels_->trim_along_x(centres, to_south, floor, along_x);
    const bool is_y_held = kernels_->trim_along_y(centres, to_west, floor, along_y);
    if (is_x_held || is_y_held) chunk.held_areas |= std::uint64_t{1} << area;
}

// Prefetches the kinds `first` to `last` of an area's vertices.
void VertexKeys::fetch_kinds(const OpenChunk& chunk, int area, std::size_t first,
                             std::size_t last) const {
    const AreaVertices& vertices = chunk.chunk->vertices->areas[static_cast<std::size_t>(area)];
    const std::size_t bytes = (last - first + 1) * sizeof(vertices.inverse_square_bounds[0]);
    fetch(&vertices.inverse_square_bounds[first], bytes);
    fetch(&vertices.low[first], bytes);
    fetch(&vertices.high[first], bytes);
    fetch(&chunk.keys_of(area)[first], 2 * bytes);
}

void VertexKeys::find_centres(float floor, OpenChunk& chunk) const {
    for_each_area(
        chunk.open_areas, [&](int area) { find_centres(floor, chunk, area); },
        [&](int area) { fetch_kinds(chunk, area, AreaVertices::centre, AreaVertices::centre); });
}

// Requires the keys of the neighbours' centres.
void VertexKeys::find_midpoints(float floor, OpenChunk& chunk) const {
    for_each_area(
        chunk.open_areas, [&](int area) { find_midpoints(floor, chunk, area); },
        [&](int area) { fetch_kinds(chunk, area, AreaVertices::along_x, AreaVertices::along_y); });
    find_sides(floor, chunk);
}

// Computes keys of midpoints on sides without an open neighbour. At the world's border these midpoints have one parent;
// elsewhere the missing neighbour would own them, and they are inactive.
void VertexKeys::find_sides(float floor, OpenChunk& chunk) const {
    for (const Side side : {east, north}) {
        if (chunk.neighbour[side] != nullptr) continue;
        auto& keys = side == east ? chunk.east_keys : chunk.north_keys;
        for (int i = 0; i < kChunkSquares; ++i) {
            const int along = i / kAreaSquares, square = i % kAreaSquares;
            const int area = side == east ? along * kChunkAreas + kChunkAreas - 1
                                          : (kChunkAreas - 1) * kChunkAreas + along;
            float& key = keys[static_cast<std::size_t>(i)];
            key = OpenChunk::kNever;
            if (!chunk.is_open(area)) continue;
            const int inside =
                side == east ? square * kAreaSquares + kAreaSquares - 1 : kLastRow + square;
            float parent = OpenChunk::kNever;
            if (chunk.at_world_border[side]) {
                parent =
                    chunk.keys_of(area)[AreaVertices::centre][static_cast<std::size_t>(inside)];
            }
            const float own = chunk.fade_factor * own_side_key(chunk, side, i);
            chunk.is_side_held |= own < floor && own < parent;
            key = std::max(own, parent);
        }
    }
}

void VertexKeys::compute(const ResidentSet& resident, const ScreenError& screen,
                         const SolidPins& pins, float floor, Selection& selection,
                         WorkerTeam& team) {
    pins_ = &pins;
    const std::size_t count = resident.chunks().size();
    by_index_.assign(count, nullptr);
    open_count_ = 0;
    std::size_t first = 0;
    while (first < count) {
        const int level = resident.chunks()[first]->key.level;
        const std::size_t first_open = open_count_;
        for (; first < count && resident.chunks()[first]->key.level == level; ++first) {
            const Chunk& chunk = *resident.chunks()[first];
            const bool is_pinned = !pins.is_empty() && pins.opens(chunk, floor);
            if (level > 0) {
                if (find(resident.links(first).parent) == nullptr) continue;
                if (!(resident.fade(first) > 0.0f)) continue;
                const float least =
                    screen.least_key(reach_of(screen, chunk), chunk.max_vertex_bound);
                if (!(least < floor) && !is_pinned) continue;
            }
            open_chunk(resident, first);
            open_[open_count_ - 1]->is_pinned = is_pinned;
        }
        const std::span<OpenChunk* const> here = open().subspan(first_open);
        if (here.empty()) break;
        for (OpenChunk* chunk : here) link(resident, *chunk);
        if (level == 0) find_coarse_keys(screen, floor, here);
        team.run(here.size(), [&](std::size_t i, int) {
            if (level > 0) place(screen, *here[i]);
            open_areas(screen, floor, *here[i]);
            find_centres(floor, *here[i]);
        });
        team.run(here.size(), [&](std::size_t i, int worker) {
            find_midpoints(floor, *here[i]);
            selection.add(*here[i], *kernels_, worker);
        });
    }
}

}  // namespace terrane::internal
