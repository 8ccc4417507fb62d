// SPDX-License-Identifier: MIT
#pragma once

#include "chunk/chunk_vertices.h"
#include "lod/key_kernels.h"

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/view.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <vector>

namespace terrane::internal {

struct ReplacedTriangles;

/// Sides of a chunk, in the order of ResidentSet::Links::neighbour.
enum Side : std::size_t { west = 0, east = 1, south = 2, north = 3 };

/// Positions of a chunk's columns and rows relative to the eye, metres.
struct ChunkAxes {
    /// Positions of even samples, including the last one, and of odd samples.
    struct Axis {
        std::array<float, kChunkSquares + 1> even;
        std::array<float, kChunkSquares> odd;
    };
    Axis x, y;
};

/// A chunk that the view may refine (it may have a vertex below the floor, see VertexKeys), with its per-frame state:
/// keys and bits of its own vertices, by area as in AreaVertices.
struct OpenChunk {
    static constexpr std::size_t kSamples = std::size_t{kChunkSamples} * kChunkSamples;
    static constexpr std::size_t kAreas = std::size_t{kChunkAreas} * kChunkAreas;
    static constexpr std::size_t kCoarseSide = kChunkSquares + 1;
    /// Number of a root's centres of coarser spacings.
    static constexpr std::size_t kCoarseSquares =
        (std::size_t{kChunkSquares} * kChunkSquares - 1) / 3;
    /// Key of a vertex that cannot be active.
    static constexpr float kNever = std::numeric_limits<float>::infinity();
    /// Key of vertices that are certainly not below the floor. Not kNever, which marks absent parents.
    static constexpr float kAboveFloor = std::numeric_limits<float>::max();
    using Keys = AreaVertices::PerVertex<float>;
    struct alignas(64) AreaKeys {
        Keys of;
    };
    /// Bit i for square i.
    struct Bits {
        std::uint64_t centre = 0, along_x = 0, along_y = 0;
        std::uint64_t& of(std::size_t kind) {  // of AreaVertices::Kind
            return kind == AreaVertices::centre    ? centre
                   : kind == AreaVertices::along_x ? along_x
                                                   : along_y;
        }
    };

    OpenChunk() : keys(kAreas), offsets(kSamples, 0.0f) {}

    const Chunk* chunk = nullptr;
    std::int32_t index = ResidentSet::kNone;  ///< in the resident set
    std::uint32_t place = 0;                  ///< in the order of the open chunks
    OpenChunk* parent = nullptr;              ///< null for roots
    std::array<OpenChunk*, 4> child{};        ///< by quadrant; null if not open
    std::array<OpenChunk*, 4> neighbour{};    ///< by Side; null if not open
    std::array<bool, 4> is_absent{};          ///< by quadrant: no resident child
    std::array<bool, 4> at_world_border{};    ///< by Side
    float fade_factor = 1.0f;                 ///< factor on own keys: 1 / fade^2

    ChunkAxes axes;
    EyeHeights eye_heights;
    KeyPlanes planes;  ///< side planes of the view that do not have the whole chunk inside
    std::uint64_t open_areas = 0;  ///< bit per area that may contain a vertex below the floor
    std::uint64_t partly_visible_areas = 0;  ///< open areas that are not entirely in view
    /// Areas with a *held* vertex, whose own key is below the floor and was raised to its parents' keys: detail may be
    /// missing there.
    std::uint64_t held_areas = 0;
    bool is_side_held = false;    ///< whether a vertex on the eastern or northern side is held
    bool is_coarse_held = false;  ///< whether a root's vertex of a coarser spacing is held
    unsigned open_strides =
        0;  ///< strides, in even samples, of a root's coarser vertices that may be below the floor

    /// [kAreas] keys, raised to the parents' keys; undefined in areas that are not open.
    std::vector<AreaKeys> keys;
    /// Keys of the midpoints on the eastern side, from the south, and on the northern side, from the west. Used only if
    /// no neighbour is open there; otherwise the neighbour owns these keys.
    std::array<float, kChunkSquares> east_keys, north_keys;
    std::vector<float> coarse_keys;  ///< of a root, indexed like its coarse bounds; else empty
    /// The square around an active centre of a coarser spacing of a root.
    struct CoarseSquare {
        std::uint16_t centre = 0;  ///< its sample
        std::uint8_t stride = 0;   ///< spacing in samples
        std::uint8_t word = 0;     ///< bit k: side k is split; bit 4 + k: quarter k is divided
    };
    std::vector<CoarseSquare> coarse_squares;  ///< [at most kCoarseSquares]
    std::vector<float> offsets;                ///< [kSamples] see MeshChunk

    /// Active vertices; 0 in areas that are not open. Before Selection::find() has ended: vertices below its window.
    std::array<Bits, kAreas> bits{};
    /// Number of bits of centres and of midpoints.
    std::size_t centre_count = 0, midpoint_count = 0;
    std::uint64_t east_bits = 0, north_bits = 0;
    std::uint64_t active_areas = 0;  ///< areas with an active centre: only these are drawn

    bool is_pinned = false;  ///< volumes may lower its keys: see SolidPins
    /// Triangles that are not drawn, because the chunk's solid surface replaces them; null if none.
    const ReplacedTriangles* replaced = nullptr;
    std::size_t triangle_count = 0;
    std::size_t first_triangle = 0;

    bool is_root() const { return chunk->key.level == 0; }
    bool is_open(int area) const { return (open_areas >> area & 1) != 0; }

    const Keys& keys_of(int area) const { return keys[static_cast<std::size_t>(area)].of; }
    Keys& keys_of(int area) { return keys[static_cast<std::size_t>(area)].of; }
    /// Sets the bits of an area's vertices of one kind, which were 0.
    void set_bits(int area, AreaVertices::Kind kind, const FoundKeys& found) {
        bits[static_cast<std::size_t>(area)].of(kind) = found.below;
        (kind == AreaVertices::centre ? centre_count : midpoint_count) += found.below_count;
    }
    void clear_bits() {
        bits.fill({});
        centre_count = midpoint_count = 0;
    }
    const Bits& bits_of(int area) const { return bits[static_cast<std::size_t>(area)]; }

    /// Key of the vertex at a sample. On the eastern and northern side the key comes from the open neighbour that owns
    /// the vertex. kNever if that neighbour or the vertex's area is not open, and for vertices of coarser chunks
    /// (column and row even, unless this chunk is a root).
    float key_at(int column, int row) const;
    /// Key of a root's vertex of a coarser spacing at a sample.
    float coarse_key(int column, int row) const {
        return coarse_keys[static_cast<std::size_t>(row / 2) * kCoarseSide +
                           static_cast<std::size_t>(column / 2)];
    }
    /// Rise, metres, of the midpoint at an odd sample of the eastern or northern side: stored by the neighbour, or at
    /// the world's border computed from the heights.
    float side_rise(Side side, int at, float quantum) const;
};

/// Calls use(i) for each set bit of a word.
template <typename Use>
void for_each_bit(std::uint64_t bits, const Use& use) {
    for (; bits != 0; bits &= bits - 1) use(std::countr_zero(bits));
}

/// Calls use(area) for each set bit of a word, and fetch(area) one area ahead, to prefetch it.
template <typename Use, typename Fetch>
void for_each_area(std::uint64_t areas, const Use& use, const Fetch& fetch) {
    if (areas != 0) fetch(std::countr_zero(areas));
    while (areas != 0) {
        const int area = std::countr_zero(areas);
        areas &= areas - 1;
        if (areas != 0) fetch(std::countr_zero(areas));
        use(area);
    }
}

inline void fetch(const void* from, std::size_t bytes) {
    constexpr std::size_t kCacheLine = 64;
    const auto* line = static_cast<const char*>(from);
    for (std::size_t i = 0; i < bytes; i += kCacheLine) __builtin_prefetch(line + i);
}

/// An area of a chunk.
struct AreaRef {
    const OpenChunk* chunk = nullptr;  ///< null: there is no chunk, or it is not open
    int area = 0;

    bool is_open() const { return chunk != nullptr && chunk->is_open(area); }
};

/// The area adjacent to an area, in the same chunk or its open neighbour.
AreaRef adjacent_area(const OpenChunk& chunk, int area, Side side);

/// Whether a side of an area lies on the world's border.
bool is_world_border(const OpenChunk& chunk, int area, Side side);

/// The *reach* of a vertex is a box around it that encloses the true surface over its diamond and the reaches of its
/// descendants, so that the eye's distance to the reach does not decrease from parent to child. A Reach follows from
/// the source's rise bound; chunks store tighter height intervals for their own vertices, nested up to kNestMargin.
struct Reach {
    float half_width = 0.0f;   ///< metres
    float half_height = 0.0f;  ///< metres
};

/// Upper bounds of reaches by log2 of the vertex's spacing, in finest spacings.
struct Reaches {
    std::vector<Reach> centre;
    std::vector<Reach> midpoint;
};
Reaches make_reaches(const HeightSource& source);

/// Lower bound of the distance from a point to the true surface, metres, from the source's intervals around the point;
/// also valid if chunks are absent.
double clearance_of(const HeightSource& source, const WorldPos& eye);

/// The screen error of vertical deviations from one eye.
///
/// The *key* of a vertex orders refinement, smaller keys first. In the view it is (distance from the eye to the
/// vertex's reach)^2 / bound^2; outside the view it is larger. It equals (pixels_per_radian / priority)^2, where the
/// priority is the screen error in pixels. Keys are floats, computed in a fixed order of operations.
class ScreenError {
public:
    /// Factor that makes pixels computed from keys upper bounds: it covers the square root of kNestMargin and the
    /// rounding of keys.
    static constexpr double kRounding = 1.0 + 0x1p-10 + 0x1p-16;

    /// @param clearance  clearance_of() at the view's eye, metres
    ScreenError(const View& view, const HeightSource& source, double clearance);

    float key_of(double error_px) const;
    double error_px_of(float key) const;
    /// Screen error, pixels, of a vertical deviation of `bound` metres at a distance of the true surface, metres.
    double error_px_at(double bound, double distance) const;
    /// Distance for which the errors of nearer points are computed, metres.
    double least_distance() const { return std::max(near_, clearance_); }

    void fill_axes(const Chunk& chunk, ChunkAxes& axes_out) const;
    EyeHeights eye_heights(const Chunk& chunk) const;
    float height_over_eye(double height) const;

    /// An axis-aligned box, world, metres.
    struct WorldBox {
        Eigen::Vector3d low, high;
    };
    /// Box of the samples of a chunk or an area.
    WorldBox box_of(const Chunk& chunk) const;
    WorldBox box_of_area(const Chunk& chunk, int area) const;
    /// Box that contains the reaches of a chunk's or an area's own vertices; `half_width` is that of one reach.
    WorldBox reach_of(const Chunk& chunk, float half_width) const;
    WorldBox reach_of_area(const Chunk& chunk, int area, float half_width) const;

    /// Lower bound of the keys of vertices whose reaches are in a box and whose bounds are at most `largest_bound`.
    float least_key(const WorldBox& reach, float largest_bound) const;
    /// Whether least_key() is below a floor.
    bool may_be_below(const WorldBox& reach, float largest_bound, float floor) const;

    /// Areas of a chunk, a bit each, for which least_key() is below a floor.
    /// @param half_width  of the reach of a centre
    /// @param is_in_view  the chunk is known to be inside the view
    std::uint64_t areas_below(const Chunk& chunk, float half_width, float floor,
                              bool is_in_view) const;

    /// The side planes of the view that do not have a whole box inside; only these affect the keys in the box.
    KeyPlanes planes_across(const WorldBox& box) const;
    bool is_inside(const WorldBox& box) const;

    /// Largest screen error, pixels, of a vertical deviation of `bound` metres at any point of a box, rounded up; 0 if
    /// no point of the box is in view.
    double error_in_view(const WorldBox& box, double bound) const;

    using Triangle = std::array<Eigen::Vector3d, 3>;  ///< world
    /// As above, for a surface within a vertical distance of `bound` from a triangle.
    double error_in_view(const Triangle& triangle, double bound) const;

private:
    double distance_squared(const WorldBox& box) const;

    Lattice lattice_;
    WorldPos eye_;
    double near_ = 1.0;
    double clearance_ = 0.0;  ///< lower bound of the distance to the true surface, metres
    double pixels_ = 1.0;
    Frustum frustum_;
    float near_squared_ = 1.0f;
};

/// Keys of the centres of the area to the south or west, which are parents of midpoints: [AreaVertices::kSquares]. All
/// are kNever if no chunk is open there, kAboveFloor if only the area is not open, and 0 beyond the world's border,
/// where midpoints have only one parent.
const float* adjacent_centres(const OpenChunk& chunk, int area, Side side);

/// Keys of the parents of an area's centres, which are midpoints of the parent chunk, or coarser vertices of the root
/// itself. Keys are kAboveFloor in areas that are not open. Not movable, because sides() may point into the object.
class CentreParents {
public:
    CentreParents(const OpenChunk& chunk, int area);
    CentreParents(const CentreParents&) = delete;
    CentreParents& operator=(const CentreParents&) = delete;

    const ParentSides& sides() const { return sides_; }

private:
    using Keys = std::array<float, AreaVertices::kSquares>;
    void gather(const OpenChunk& root, int area);
    void find(const OpenChunk& chunk, int area);

    ParentSides sides_;
    Keys along_x_, along_y_;  // copies, used if the keys are not contiguous
};

}  // namespace terrane::internal
