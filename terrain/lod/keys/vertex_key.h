// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <type_traits>

namespace terrane::internal {

// Outside the view priorities are reduced, but not to 0, so that a turning camera finds some detail: to this share,
inline constexpr float kLeastWeight = 1.0f / 16.0f;
// linearly over a margin of about a quarter of the distance.
inline constexpr float kWeightSlope = 6.0f;

/// A vertex whose key is raised to its parents' by at most this factor is not held: reaches nest up to their
/// rounding, and reported errors include it.
inline constexpr float kNestMargin = 1.0f + 0x1p-9f;

/// Converts stored heights of reaches to metres above the eye: unit * height + base.
struct EyeHeights {
    float unit = 1.0f;
    float base = 0.0f;
    float near_squared = 1.0f;  ///< of the view
};

/// Inward normals of the view's side planes through the eye that vertices may lie outside of.
struct KeyPlanes {
    int count = 0;
    float x[4] = {}, y[4] = {}, z[4] = {};
    float near_distance = 1.0f;
};

// For one vertex (Number is float) or a row of them (a vector of float). Internal linkage, also where it is included:
// see simd_level.h.
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

/// Distance along one axis from the eye to a reach, squared.
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

/// The key: squared distance from the eye to a vertex's reach over the square of its bound.
/// @param flat_squared  the part of x and y
/// @param low, high     of the reach, above the eye
template <typename Number>
inline Number vertex_key(Number flat_squared, Number low, Number high, Number inverse_square_bound,
                         float near_squared) {
    return max_of(flat_squared + height_gap_squared(low, high), broadcast<Number>(near_squared)) *
           inverse_square_bound;
}

/// The divisor of keys outside the view: the square of a weight that decreases with the distance from the view to the
/// reach, relative to the distance from the eye.
template <typename Number>
inline Number squared_weight(Number x, float y, Number low, Number high, float half_width,
                             const KeyPlanes& planes) {
    const Number far = absolute(x) + absolute(y) + max_of(absolute(low), absolute(high));
    Number outside{};
    for (int i = 0; i < planes.count; ++i) {
        const float nx = planes.x[i], ny = planes.y[i], nz = planes.z[i];
        const float from_y = ny * y + (absolute(nx) + absolute(ny)) * half_width;
        // moved inward by the rounding
        const Number inside = nx * x + from_y + (nz > 0.0f ? nz * high : nz * low) + far * 0x1p-18f;
        outside = max_of(-inside, outside);
    }
    const Number reach = far + (2.0f * half_width + planes.near_distance);
    const Number weight =
        max_of(1.0f - kWeightSlope * outside / reach, broadcast<Number>(kLeastWeight));
    return weight * weight;
}

}  // namespace

}  // namespace terrane::internal
