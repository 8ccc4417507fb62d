// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <type_traits>

namespace terrane::internal {

// Beside the view a vertex counts for less, so that a turning camera does not find bare roots: down to
// this share of its priority,
inline constexpr float kLeastWeight = 1.0f / 16.0f;
// over a margin of about a quarter of the distance.
inline constexpr float kWeightSlope = 6.0f;

/// A vertex whose key is raised to its parents' by no more than this is not held back: reaches nest up to
/// their rounding, and reported errors allow for it.
inline constexpr float kNestMargin = 1.0f + 0x1p-9f;

/// What turns heights of reaches into metres over the eye: unit * height + base.
struct EyeHeights {
    float unit = 1.0f;
    float base = 0.0f;
    float near_squared = 1.0f;  ///< of the view
};

/// Side planes of a view, for vertices that are not surely inside it.
struct KeyPlanes {
    int count = 0;
    float x[4] = {}, y[4] = {}, z[4] = {};
    float near_distance = 1.0f;
};

// Of one vertex (Number is float), or of a row of them (a vector of float). Of internal linkage, here and in what
// includes it: see simd_level.h.
namespace {

template <typename Number, typename Height>
inline Number to_number(Height value) {
    if constexpr (std::is_same_v<Number, float>) {
        return static_cast<float>(value);
    } else {
        return __builtin_convertvector(value, Number);
    }
}

/// In all lanes.
template <typename Number>
inline Number spread(float value) {
    return value - Number{};
}

template <typename Number>
inline Number larger(Number a, Number b) {
    return a > b ? a : b;
}
template <typename Number>
inline Number absolute(Number a) {
    return larger(a, -a);
}

/// Distance along one axis from the eye to a reach, squared.
template <typename Number>
inline Number gap_squared(Number from_eye, float reach) {
    const Number gap = larger(absolute(from_eye) - reach, Number{});
    return gap * gap;
}
template <typename Number>
inline Number height_gap_squared(Number low, Number high) {
    const Number gap = larger(larger(low, -high), Number{});
    return gap * gap;
}

template <typename Number, typename Height>
inline Number over_eye(Height height, const EyeHeights& eye) {
    return to_number<Number>(height) * eye.unit + eye.base;
}

/// The squared distance from the eye to a vertex's reach over the square of its bound.
/// @param flat_squared  that along x and y
/// @param low, high     of the reach, over the eye
template <typename Number>
inline Number vertex_key(Number flat_squared, Number low, Number high, Number inverse_square_bound,
                         float near_squared) {
    return larger(flat_squared + height_gap_squared(low, high), spread<Number>(near_squared)) *
           inverse_square_bound;
}

/// What a key is divided by beside the view: the square of a weight, which falls with the distance
/// from the view to the reach.
template <typename Number>
inline Number squared_weight(Number x, float y, Number low, Number high, float across,
                             const KeyPlanes& planes) {
    const Number far = absolute(x) + absolute(y) + larger(absolute(low), absolute(high));
    Number outside{};
    for (int i = 0; i < planes.count; ++i) {
        const float nx = planes.x[i], ny = planes.y[i], nz = planes.z[i];
        const float from_y = ny * y + (absolute(nx) + absolute(ny)) * across;
        // a little further in, for the rounding
        const Number inside = nx * x + from_y + (nz > 0.0f ? nz * high : nz * low) + far * 0x1p-18f;
        outside = larger(-inside, outside);
    }
    const Number reach = far + (2.0f * across + planes.near_distance);
    const Number weight =
        larger(1.0f - kWeightSlope * outside / reach, spread<Number>(kLeastWeight));
    return weight * weight;
}

}  // namespace

}  // namespace terrane::internal
