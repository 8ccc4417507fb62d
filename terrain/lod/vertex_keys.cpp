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
    const std::size_t vertex = coarse_index(column, row);
    VertexBatch::Values keys;
    own_coarse_keys(screen, root, stride, is_centre, {&vertex, 1}, keys.data());
    return keys[0];
}

// Own keys of up to VertexBatch::kSize vertices of one stride and kind.
void VertexKeys::own_coarse_keys(const ScreenError& screen, const OpenChunk& root, int stride,
                                 bool is_centre, std::span<const std::size_t> vertices,
                                 float* keys_out) const {
    const Reach around = reach(*root.chunk, 2 * stride, is_centre);
    VertexBatch batch;
    batch.half_width = around.half_width;
    for (std::size_t i = 0; i < VertexBatch::kSize; ++i) {
        const std::size_t vertex = vertices[std::min(i, vertices.size() - 1)];
        const std::size_t column = vertex % OpenChunk::kCoarseSide;
        const std::size_t row = vertex / OpenChunk::kCoarseSide;
        batch.x[i] = root.axes.x.even[column];
        batch.y[i] = root.axes.y.even[row];
        const std::int32_t height =
            root.chunk->heights[2 * (row * std::size_t{kChunkSamples} + column)];
        const float z = screen.height_over_eye(lattice_.quantum * height);
        batch.low[i] = z - around.half_height;
        batch.high[i] = z + around.half_height;
        batch.inverse_square_bounds[i] = root.chunk->vertices->coarse_bounds[vertex];
    }
    kernels_->own_batch(batch, root.planes, root.eye_heights.near_squared, keys_out);
    if (!root.is_pinned) return;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        const auto column = static_cast<int>(vertices[i] % OpenChunk::kCoarseSide);
        const auto row = static_cast<int>(vertices[i] / OpenChunk::kCoarseSide);
        keys_out[i] =
            pins_->lowered(*root.chunk, 2 * column, 2 * row, 2 * stride, is_centre, keys_out[i]);
    }
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
    return screen.may_be_below(box, root.chunk->vertices->largest_coarse_bounds[exponent], floor);
}

namespace {

// Calls use(column, row, key of a parent, key of the other) for the centres of a stride.
template <typename Use>
void for_coarse_centres(const OpenChunk& root, int stride, const Use& use) {
    if (stride == kCoarsest) {
        // the centre of a root square has no parents
        use(stride, stride, 0.0f, 0.0f);
        return;
    }
    // the parents are the corners of odd index sum, in units of twice the stride
    int row_other = -stride;
    for (int row = stride; row < kSide; row += 2 * stride, row_other = -row_other) {
        int other = row_other;
        for (int column = stride; column < kSide; column += 2 * stride, other = -other) {
            use(column, row, root.coarse_keys[coarse_index(column + stride, row + other)],
                root.coarse_keys[coarse_index(column - stride, row - other)]);
        }
    }
}

// The same for the midpoints of a stride.
template <typename Use>
void for_coarse_midpoints(const OpenChunk& root, int stride, const Use& use) {
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
            use(along, row, row > 0 ? inside(along, row - stride) : beyond(south, along, last),
                row < kSide ? inside(along, row + stride) : beyond(north, along, stride));
        }
        for (int column = 0; column <= kSide; column += 2 * stride) {
            use(column, along,
                column > 0 ? inside(column - stride, along) : beyond(west, last, along),
                column < kSide ? inside(column + stride, along) : beyond(east, stride, along));
        }
    }
}

}  // namespace

// Sets the keys of the centres or midpoints of a stride: their own, raised to their parents' keys. Own keys are not
// computed where no parent is below the floor: such vertices are inactive, and no triangle is drawn that they would
// split.
void VertexKeys::find_coarse_keys(const ScreenError& screen, OpenChunk& root, int stride,
                                  bool is_centre, float floor) const {
    std::array<std::size_t, VertexBatch::kSize> vertices{};
    std::size_t count = 0;
    const auto finish = [&] {
        VertexBatch::Values own;
        own_coarse_keys(screen, root, stride, is_centre, {vertices.data(), count}, own.data());
        for (std::size_t i = 0; i < count; ++i) {
            float& key = root.coarse_keys[vertices[i]];
            root.is_coarse_held |= own[i] < floor && own[i] < key;
            key = std::max(own[i], key);
        }
        count = 0;
    };
    const auto use = [&](int column, int row, float parent, float other_parent) {
        const std::size_t vertex = coarse_index(column, row);
        root.coarse_keys[vertex] = std::max(parent, other_parent);
        if (!(std::min(parent, other_parent) < floor)) return;
        vertices[count++] = vertex;
        if (count == vertices.size()) finish();
    };
    if (is_centre) {
        for_coarse_centres(root, stride, use);
    } else {
        for_coarse_midpoints(root, stride, use);
    }
    if (count > 0) finish();
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
            if (is_open(*root, stride)) find_coarse_keys(screen, *root, stride, true, floor);
        }
        for (OpenChunk* root : roots) {
            if (is_open(*root, stride)) find_coarse_keys(screen, *root, stride, false, floor);
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
        pool_[i]->coarse_squares.reserve(OpenChunk::kCoarseSquares);
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
    chunk.place = static_cast<std::uint32_t>(open_count_ - 1);
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

OwnKeys VertexKeys::own_of(const OpenChunk& chunk, int area, AreaVertices::Kind kind) const {
    const AreaVertices& vertices = chunk.chunk->vertices->areas[static_cast<std::size_t>(area)];
    const auto column = static_cast<std::size_t>(area % kChunkAreas * kAreaSquares);
    const auto row = static_cast<std::size_t>(area / kChunkAreas * kAreaSquares);
    OwnKeys own;
    own.group.inverse_square_bounds = vertices.inverse_square_bounds[kind].data();
    own.group.low = vertices.low[kind].data();
    own.group.high = vertices.high[kind].data();
    own.group.x =
        kind == AreaVertices::along_y ? &chunk.axes.x.even[column] : &chunk.axes.x.odd[column];
    own.group.y = kind == AreaVertices::along_x ? &chunk.axes.y.even[row] : &chunk.axes.y.odd[row];
    own.group.half_width = reach(*chunk.chunk, 1, kind == AreaVertices::centre).half_width;
    own.eye = chunk.eye_heights;
    if ((chunk.partly_visible_areas >> area & 1) != 0) own.planes = &chunk.planes;
    return own;
}

void VertexKeys::own_keys(const OpenChunk& chunk, int area, AreaVertices::Kind kind,
                          float* keys_out) const {
    kernels_->own(own_of(chunk, area, kind), keys_out);
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
    const float far = distance_sum(x, y, low, high);
    const float outside = distance_outside(x, y, low, high, far, half_width, chunk.planes);
    return key * outside_factor(outside, far, half_width, chunk.planes);
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

// Upper limits of the keys of an area of a pinned chunk.
const float* VertexKeys::limits_of(const OpenChunk& chunk, int area, AreaVertices::Kind kind,
                                   Limits& limits_out) const {
    if (!chunk.is_pinned) return nullptr;
    limits_out.fill(OpenChunk::kNever);
    pins_->lower(*chunk.chunk, area, kind, limits_out.data());
    return limits_out.data();
}

void VertexKeys::find_centres(float floor, OpenChunk& chunk, int area, KeyWindow& window) const {
    Limits limits;
    OwnKeys own = own_of(chunk, area, AreaVertices::centre);
    own.limits = limits_of(chunk, area, AreaVertices::centre, limits);
    own.fade = chunk.fade_factor;
    const CentreParents parents(chunk, area);
    const FoundKeys found = kernels_->find_centres(
        own, parents.sides(), floor, Selection::place_of(chunk, area, AreaVertices::centre), window,
        chunk.keys_of(area)[AreaVertices::centre].data());
    chunk.set_bits(area, AreaVertices::centre, found);
    if (found.is_held) chunk.held_areas |= std::uint64_t{1} << area;
}

void VertexKeys::find_midpoints(float floor, OpenChunk& chunk, int area, KeyWindow& window) const {
    // vertices on the line between two chunks fade with both
    const auto fade_beside = [&](Side side) {
        const AreaRef adjacent = adjacent_area(chunk, area, side);
        return adjacent.chunk == nullptr ? chunk.fade_factor
                                         : std::max(chunk.fade_factor, adjacent.chunk->fade_factor);
    };
    OpenChunk::Keys& keys = chunk.keys_of(area);
    const float* const centres = keys[AreaVertices::centre].data();
    const auto find = [&](AreaVertices::Kind kind, Side side, auto kernel, const float* beyond) {
        Limits limits;
        OwnKeys own = own_of(chunk, area, kind);
        own.limits = limits_of(chunk, area, kind, limits);
        own.fade = chunk.fade_factor;
        own.first_fade = fade_beside(side);
        const FoundKeys found =
            kernel(own, centres, beyond, floor, Selection::place_of(chunk, area, kind), window,
                   keys[kind].data());
        chunk.set_bits(area, kind, found);
        if (found.is_held) chunk.held_areas |= std::uint64_t{1} << area;
    };
    find(AreaVertices::along_x, south, kernels_->find_along_x,
         adjacent_centres(chunk, area, south) + kLastRow);
    find(AreaVertices::along_y, west, kernels_->find_along_y, adjacent_centres(chunk, area, west));
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

void VertexKeys::find_centres(float floor, OpenChunk& chunk, KeyWindow& window) const {
    chunk.clear_bits();
    for_each_area(
        chunk.open_areas, [&](int area) { find_centres(floor, chunk, area, window); },
        [&](int area) { fetch_kinds(chunk, area, AreaVertices::centre, AreaVertices::centre); });
}

// Requires the keys of the neighbours' centres.
void VertexKeys::find_midpoints(float floor, OpenChunk& chunk, KeyWindow& window) const {
    for_each_area(
        chunk.open_areas, [&](int area) { find_midpoints(floor, chunk, area, window); },
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
                if (!is_pinned &&
                    !screen.may_be_below(reach_of(screen, chunk), chunk.max_vertex_bound, floor)) {
                    continue;
                }
            }
            open_chunk(resident, first);
            open_[open_count_ - 1]->is_pinned = is_pinned;
        }
        const std::span<OpenChunk* const> here = open().subspan(first_open);
        if (here.empty()) break;
        for (OpenChunk* chunk : here) link(resident, *chunk);
        if (level == 0) find_coarse_keys(screen, floor, here);
        team.run(here.size(), [&](std::size_t i, int worker) {
            if (level > 0) place(screen, *here[i]);
            open_areas(screen, floor, *here[i]);
            find_centres(floor, *here[i], selection.window(worker));
        });
        team.run(here.size(), [&](std::size_t i, int worker) {
            find_midpoints(floor, *here[i], selection.window(worker));
            selection.add_others(*here[i], worker);
        });
    }
}

}  // namespace terrane::internal
