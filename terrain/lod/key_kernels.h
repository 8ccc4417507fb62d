// SPDX-License-Identifier: MIT
#pragma once

#include "base/simd_level.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace terrane::internal {

// Least factor on priorities outside the view: not 0, so that a turning camera finds some detail.
inline constexpr float kLeastWeight = 1.0f / 16.0f;
// Decrease of the factor per (distance outside the view) / (distance from the eye).
inline constexpr float kWeightSlope = 6.0f;

/// A vertex whose key is raised by at most this factor does not count as held: reaches are nested only up to rounding,
/// which reported errors include.
inline constexpr float kNestMargin = 1.0f + 0x1p-9f;

/// Converts stored heights of reaches to metres above the eye: unit * height + base.
struct EyeHeights {
    float unit = 1.0f;
    float base = 0.0f;
    float near_squared = 1.0f;  ///< square of View::near_distance
};

/// Inward normals of side planes of the view, which pass through the eye: only of planes that cut some vertices off.
struct KeyPlanes {
    int count = 0;
    float x[4] = {}, y[4] = {}, z[4] = {};
    float near_distance = 1.0f;
};

// Functions for one vertex (Number is float) or a row of vertices (a vector of float). They have internal linkage
// wherever this header is included: see simd_level.h.
namespace {

template <typename Number, typename Height>
inline Number to_number(Height value) {
    if constexpr (std::is_same_v<Number, float>) {
        return static_cast<float>(value);
    } else {
        return __builtin_convertvector(value, Number);
    }
}

/// The value in all lanes.
template <typename Number>
inline Number broadcast(float value) {
    return value - Number{};
}

template <typename Number>
inline Number max_of(Number a, Number b) {
    return a > b ? a : b;
}
template <typename Number>
inline Number absolute(Number a) {
    return max_of(a, -a);
}

/// Squared distance along one axis from the eye to a reach.
template <typename Number>
inline Number gap_squared(Number from_eye, float reach) {
    const Number gap = max_of(absolute(from_eye) - reach, Number{});
    return gap * gap;
}
template <typename Number>
inline Number height_gap_squared(Number low, Number high) {
    const Number gap = max_of(max_of(low, -high), Number{});
    return gap * gap;
}

template <typename Number, typename Height>
inline Number over_eye(Height height, const EyeHeights& eye) {
    return to_number<Number>(height) * eye.unit + eye.base;
}

/// The key of a vertex: (distance from the eye to the vertex's reach)^2 / bound^2.
/// @param flat_squared  the horizontal part of the squared distance
/// @param low, high     heights of the reach, above the eye
template <typename Number>
inline Number vertex_key(Number flat_squared, Number low, Number high, Number inverse_square_bound,
                         float near_squared) {
    return max_of(flat_squared + height_gap_squared(low, high), broadcast<Number>(near_squared)) *
           inverse_square_bound;
}

/// Approximation of 1 / value, value > 0, to 2^-22: Newton's iteration from a guess by exponent. It consists of
/// products and differences, which every device rounds alike; GLSL leaves the rounding of a division open.
template <typename Number>
inline Number reciprocal(Number value) {
    using Bits = std::conditional_t<std::is_same_v<Number, float>, std::int32_t,
                                    decltype(Number{} < Number{})>;
    static_assert(sizeof(Bits) == sizeof(Number));
    constexpr std::int32_t kGuess = 0x7ef311c3;  // least largest error of the guess: 12 %
    Bits bits;
    std::memcpy(&bits, &value, sizeof bits);
    bits = kGuess - bits;
    Number inverse;
    std::memcpy(&inverse, &bits, sizeof bits);
    for (int i = 0; i < 3; ++i) inverse *= 2.0f - value * inverse;
    return inverse;
}

/// Horizontal and vertical distances from the eye to a reach added up, metres: not below the distance.
/// @param y like x, or one number for all vertices
template <typename Number, typename Y>
inline Number distance_sum(Number x, Y y, Number low, Number high) {
    return absolute(x) + absolute(y) + max_of(absolute(low), absolute(high));
}

/// Distance, metres, of a reach from the view; 0 if it meets the view.
/// @param far distance_sum()
template <typename Number, typename Y>
inline Number distance_outside(Number x, Y y, Number low, Number high, Number far, float half_width,
                               const KeyPlanes& planes) {
    Number outside{};
    for (int i = 0; i < planes.count; ++i) {
        const float nx = planes.x[i], ny = planes.y[i], nz = planes.z[i];
        const Y from_y = ny * y + (absolute(nx) + absolute(ny)) * half_width;
        // moved inward by the rounding error
        const Number inside = nx * x + from_y + (nz > 0.0f ? nz * high : nz * low) + far * 0x1p-18f;
        outside = max_of(-inside, outside);
    }
    return outside;
}

/// Factor on keys outside the view, 1 in the view: the inverse square of a weight that decreases with the reach's
/// distance from the view, relative to its distance from the eye.
/// @param outside distance_outside()
template <typename Number>
inline Number outside_factor(Number outside, Number far, float half_width,
                             const KeyPlanes& planes) {
    const Number reach = far + (2.0f * half_width + planes.near_distance);
    const Number weighted = max_of(reach - kWeightSlope * outside, kLeastWeight * reach);
    const Number inverse = reach * reciprocal(weighted);
    return outside > 0.0f ? inverse * inverse : broadcast<Number>(1.0f);
}

}  // namespace

/// Share of a vertex's rise that is displayed, as a function of its key: clamp(full - slope * key, 0, 1). See Morph.
struct MorphShare {
    float full = 1.0f;
    float slope = 0.0f;
};

// Functions for one vertex or a row of vertices, with internal linkage as above.
namespace {

/// share - 1: in [-1, 0], 0 at the vertex's final height.
template <typename Number>
inline Number share_less_one(Number key, const MorphShare& share) {
    const Number wanted = max_of(share.full - share.slope * key, Number{});
    return (wanted < 1.0f ? wanted : broadcast<Number>(1.0f)) - 1.0f;
}

/// Offset of a vertex from its final height, from the offsets of its two ends. The vertex is displayed at the mean of
/// its displayed ends + share * rise, where rise is its height above the mean of the ends' heights.
template <typename Number>
inline Number morph_offset(Number less_one, Number rise, Number offset_a, Number offset_b) {
    return 0.5f * (offset_a + offset_b) + less_one * rise;
}

}  // namespace

/// Vertices of one kind in an area, 8 rows of 8 from the south-west.
struct VertexGroup {
    const std::uint16_t* inverse_square_bounds = nullptr;  ///< [64] upper halves of floats
    const std::int16_t* low = nullptr;                     ///< [64] of the reaches, see EyeHeights
    const std::int16_t* high = nullptr;                    ///< [64]
    const float* x = nullptr;  ///< [8] by column, relative to the eye, metres
    const float* y = nullptr;  ///< [8] by row, relative to the eye, metres
    float half_width = 0.0f;   ///< of the reaches, metres
};

/// Keys of the midpoints in and around a quarter of an area: the parents of the centres of the finer area that covers
/// this quarter.
struct ParentSides {
    const float* along_x = nullptr;  ///< [64] of the area
    const float* along_y = nullptr;  ///< [64]
    const float* north = nullptr;    ///< [8] midpoints on the area's northern side
    const float* east = nullptr;     ///< [64] first column: midpoints on its eastern side
    int column = 0;                  ///< first square of the quarter: 0 or 4
    int row = 0;
};

/// What own keys of an area's vertices of one kind depend on: keys before they are raised to the parents' keys.
struct OwnKeys {
    VertexGroup group;
    EyeHeights eye;
    const KeyPlanes* planes = nullptr;  ///< null: the whole area is in view
    const float* limits = nullptr;      ///< [64] upper limits of the keys; null: none
    float fade = 1.0f;                  ///< factor on the keys
    float first_fade = 1.0f;            ///< the same for the first row or column of midpoints
};

/// Eight vertices anywhere in a chunk.
struct VertexBatch {
    static constexpr std::size_t kSize = 8;
    using Values = std::array<float, kSize>;
    Values inverse_square_bounds;
    Values x, y;              ///< relative to the eye, metres
    Values low, high;         ///< of the reaches, above the eye, metres
    float half_width = 0.0f;  ///< of the reaches, metres
};

/// A key near the threshold.
struct KeyCandidate {
    float key = 0.0f;
    std::uint32_t chunk = 0;      ///< in the order of the open chunks
    std::uint16_t vertex = 0;     ///< see AreaPlace::first
    std::uint16_t triangles = 0;  ///< 2, or 1 on the world's border
};

/// Counts the triangles of the keys below `low`, and collects the keys in [low, high).
struct KeyWindow {
    float low = 0.0f, high = 0.0f;
    KeyCandidate* candidates = nullptr;  ///< has capacity for every key that is counted
    std::uint32_t count = 0;
    std::size_t below = 0;  ///< triangles of the keys below `low`
};

/// The vertices of one kind in an area, as candidates.
struct AreaPlace {
    std::uint32_t chunk = 0;
    std::uint16_t first = 0;   ///< candidate of square i: first + i
    std::uint64_t border = 0;  ///< bit i: square i's vertex is on the world's border
};

/// Keys of an area's vertices of one kind.
struct FoundKeys {
    std::uint64_t below = 0;        ///< bit i: key i is below the window
    std::uint32_t below_count = 0;  ///< number of these bits
    bool is_held = false;           ///< a key below the floor was raised by more than kNestMargin
};

/// Inputs and output for the offsets of an area's vertices.
struct AreaMorph {
    const float* centre = nullptr;       ///< [64] keys
    const float* along_x = nullptr;      ///< [64]
    const float* along_y = nullptr;      ///< [64]
    const std::int16_t* rise = nullptr;  ///< [3][64] in rise_unit: see AreaVertices
    float rise_unit = 1.0f;
    const float* coarse = nullptr;  ///< [9 rows of 9] offsets of the area's even samples
    std::size_t coarse_stride = 0;  ///< between rows of `coarse`
    float* offsets = nullptr;  ///< [rows of kChunkSamples] from the area's south-western sample
    unsigned rows = 0xff;      ///< bit i: row i of squares has an active centre
    MorphShare share;
};

/// Loops over the vertices of an area, compiled once per vector width; their results are bit-identical.
///
/// Keys are raised to the larger key of the two parents. Own keys are computed for rows with a parent below the floor
/// only: other vertices are inactive, and no triangle is drawn that they would split.
struct KeyKernels {
    /// Own keys without limits and fades.
    void (*own)(const OwnKeys& own, float* keys_out);
    /// The same for vertices that do not share rows.
    void (*own_batch)(const VertexBatch& batch, const KeyPlanes& planes, float near_squared,
                      float* keys_out);
    /// Keys of centres. Their parents are the midpoints of the two sides of the coarser square that bound the centre's
    /// quarter.
    FoundKeys (*find_centres)(const OwnKeys& own, const ParentSides& parents, float floor,
                              const AreaPlace& place, KeyWindow& window, float* keys_out);
    /// Keys of midpoints. Their parents are the two adjacent centres.
    /// @param south [8] the last row of centres in the area to the south
    FoundKeys (*find_along_x)(const OwnKeys& own, const float* centres, const float* south,
                              float floor, const AreaPlace& place, KeyWindow& window,
                              float* keys_out);
    /// As find_along_x(), for midpoints along y. @param west [64] the centres of the area to the west
    FoundKeys (*find_along_y)(const OwnKeys& own, const float* centres, const float* west,
                              float floor, const AreaPlace& place, KeyWindow& window,
                              float* keys_out);
    /// Counts and collects 64 keys again, in another window.
    FoundKeys (*count)(const float* keys, const AreaPlace& place, KeyWindow& window);
    /// Bit i: whether key i of 64 is below a threshold.
    std::uint64_t (*mask)(const float* keys, float threshold);
    /// Offsets of the samples of an area's rows with active centres, including the even samples on its eastern and
    /// northern side.
    void (*morph)(const AreaMorph& area);
};

/// The kernels of a SIMD level, or of the next lower level that is built.
const KeyKernels& key_kernels(SimdLevel level);

}  // namespace terrane::internal
