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

/// What turns samples into heights over the eye: quantum * (height - base) + rest.
struct EyeHeights {
    std::int32_t base = 0;
    float quantum = 1.0f;
    float rest = 0.0f;
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

template <typename Number, typename Height>
inline Number over_eye(Height height, const EyeHeights& eye) {
    return to_number<Number>(height - eye.base) * eye.quantum + eye.rest;
}

/// The squared distance from the eye to a vertex's reach over the square of its bound.
/// @param flat_squared  that along x and y
template <typename Number>
inline Number vertex_key(Number flat_squared, Number z, float up, Number inverse_square_bound,
                         float near_squared) {
    return larger(flat_squared + gap_squared(z, up), spread<Number>(near_squared)) *
           inverse_square_bound;
}

/// What a key is divided by beside the view: the square of a weight.
/// @param outside  how far the reach lies outside of the view, metres
/// @param far      sum of the vertex's coordinates from the eye, absolute
template <typename Number>
inline Number squared_weight(Number outside, Number far, float across, float up,
                             float near_distance) {
    const Number reach = far + (2.0f * across + up + near_distance);
    const Number weight =
        larger(1.0f - kWeightSlope * outside / reach, spread<Number>(kLeastWeight));
    return weight * weight;
}

/// How far a reach lies outside of the view, or 0.
template <typename Number>
inline Number outside_view(Number x, float y, Number z, Number far, float across, float up,
                           const KeyPlanes& planes) {
    Number outside{};
    for (int i = 0; i < planes.count; ++i) {
        const float nx = planes.x[i], ny = planes.y[i], nz = planes.z[i];
        const float size = (absolute(nx) + absolute(ny)) * across + absolute(nz) * up;
        // a little further in, for the rounding
        const Number inside = nx * x + nz * z + (ny * y + size) + far * 0x1p-18f;
        outside = larger(-inside, outside);
    }
    return outside;
}

}  // namespace

}  // namespace terrane::internal
