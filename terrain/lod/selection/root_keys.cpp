// SPDX-License-Identifier: MIT
//
// Keys of a root's vertices of coarser spacings: few, so one at a time. Columns, rows and strides are in even samples.
#include "lod/selection/vertex_keys.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace terrane::internal {
namespace {

constexpr int kSide = kChunkSquares;  // last column and row
constexpr int kCoarsest = kSide / 2;  // stride of the root square's own centre
// The key of vertices that are certainly not below the floor. Not kNever, which says that a parent is absent.
constexpr float kLargestKey = std::numeric_limits<float>::max();

std::size_t coarse_index(int column, int row) {
    return static_cast<std::size_t>(row) * OpenChunk::kCoarseSide +
           static_cast<std::size_t>(column);
}

// Calls use(column, row) for the centres and midpoints of a stride.
template <class Use>
void for_stride(int stride, const Use& use) {
    bool is_centre_row = false;
    for (int row = 0; row <= kSide; row += stride, is_centre_row = !is_centre_row) {
        const int step = is_centre_row ? stride : 2 * stride;
        for (int column = is_centre_row ? 0 : stride; column <= kSide; column += step) {
            use(column, row);
        }
    }
}

// Raises a key to its parents', and records if that holds the vertex.
void trim(OpenChunk& root, float& key, float parents, float floor) {
    root.is_coarse_held |= key < floor && key < parents;
    key = std::max(key, parents);
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

// Whether any vertex of a stride may have a key below the floor: false for most strides of roots far from the eye or
// outside the view, whose keys are not computed.
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

// The centre of a root square has no parents.
void VertexKeys::trim_coarse_centres(OpenChunk& root, int stride, float floor) const {
    if (stride == kCoarsest) return;
    // the parents are the corners of odd index sum, in units of twice the stride
    int row_other = -stride;
    for (int row = stride; row < kSide; row += 2 * stride, row_other = -row_other) {
        int other = row_other;
        for (int column = stride; column < kSide; column += 2 * stride, other = -other) {
            const float parents =
                std::max(root.coarse_keys[coarse_index(column + stride, row + other)],
                         root.coarse_keys[coarse_index(column - stride, row - other)]);
            trim(root, root.coarse_keys[coarse_index(column, row)], parents, floor);
        }
    }
}

void VertexKeys::trim_coarse_midpoints(OpenChunk& root, int stride, float floor) const {
    // the centre beyond a side is the neighbour's, where there is one
    const auto centre = [&](int column, int row) {
        const OpenChunk* owner = &root;
        for (const auto& [side, is_beyond] :
             {std::pair{west, column < 0}, std::pair{east, column > kSide},
              std::pair{south, row < 0}, std::pair{north, row > kSide}}) {
            if (!is_beyond) continue;
            if (root.at_world_border[side]) return 0.0f;
            owner = root.neighbour[side];
        }
        if (owner == nullptr) return OpenChunk::kNever;
        const auto wrap = [](int i) { return i < 0 ? i + kSide : i > kSide ? i - kSide : i; };
        return owner->coarse_keys[coarse_index(wrap(column), wrap(row))];
    };
    bool is_centre_row = false;
    for (int row = 0; row <= kSide; row += stride, is_centre_row = !is_centre_row) {
        const int to_x = is_centre_row ? stride : 0, to_y = is_centre_row ? 0 : stride;
        for (int column = is_centre_row ? 0 : stride; column <= kSide; column += 2 * stride) {
            const float parents =
                std::max(centre(column - to_x, row - to_y), centre(column + to_x, row + to_y));
            trim(root, root.coarse_keys[coarse_index(column, row)], parents, floor);
        }
    }
}

void VertexKeys::find_coarse_keys(const ScreenError& screen, float floor,
                                  std::span<OpenChunk* const> roots) const {
    for (OpenChunk* root : roots) {
        screen.fill_axes(*root->chunk, root->axes);
        root->eye_heights = screen.eye_heights(*root->chunk);
        root->planes = screen.planes_across(screen.box_of(*root->chunk));
        root->coarse_keys.assign(OpenChunk::kCoarseSide * OpenChunk::kCoarseSide, kLargestKey);
        for (const std::size_t corner : {coarse_index(0, 0), coarse_index(kSide, 0),
                                         coarse_index(0, kSide), coarse_index(kSide, kSide)}) {
            root->coarse_keys[corner] = OpenChunk::kNever;
        }
        root->open_strides = 0;
        for (int stride = kCoarsest; stride >= 1; stride /= 2) {
            if (!may_be_below(screen, *root, stride, floor)) continue;
            root->open_strides |= static_cast<unsigned>(stride);
            for_stride(stride, [&](int column, int row) {
                root->coarse_keys[coarse_index(column, row)] =
                    own_coarse_key(screen, *root, column, row);
            });
        }
    }
    const auto is_open = [](const OpenChunk& root, int stride) {
        return (root.open_strides & static_cast<unsigned>(stride)) != 0;
    };
    for (int stride = kCoarsest; stride >= 1; stride /= 2) {
        for (OpenChunk* root : roots) {
            if (is_open(*root, stride)) trim_coarse_centres(*root, stride, floor);
        }
        for (OpenChunk* root : roots) {
            if (is_open(*root, stride)) trim_coarse_midpoints(*root, stride, floor);
        }
    }
}

}  // namespace terrane::internal
