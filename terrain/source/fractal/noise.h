// SPDX-License-Identifier: MIT
#pragma once

#include "source/fractal/noise_kernels.h"

#include <cstdint>

namespace terrane {

/// Upper bounds of gradient noise of wavelength 1, over all choices of unit gradients at the nodes: of its absolute
/// value, of its slope, and of its second derivative in any direction. noise.cpp derives them; noise_test proves them
/// independently by interval subdivision.
inline constexpr double kNoiseSup = 0.70710678118655;
inline constexpr double kNoiseSlope = 2.08;
inline constexpr double kNoiseCurvature = 9.3;

/// A 64-bit hash in which every bit of the result depends on every bit of the argument.
std::uint64_t mix64(std::uint64_t value);

/// Hash keys of one octave of a seed's noise.
struct NoiseKeys {
    std::uint64_t x = 0;
    std::uint64_t y = 0;

    static NoiseKeys make(std::uint64_t seed, int octave);
};

/// A coordinate relative to the noise's lattice of nodes.
struct NoiseCoordinate {
    std::uint64_t cell = 0;  ///< index of the node below, modulo 2^64
    double fraction = 0.0;   ///< from this node, in cells, 0 to 1
};

/// Cell and fraction, in an octave, of a coordinate of `units` + `rest` units.
///
/// @param rest  fraction of a unit, 0 to 1
NoiseCoordinate noise_coordinate(const internal::NoiseAxis& axis, std::uint64_t units, double rest);

/// A coordinate with the hashes of its nodes, for one octave and axis.
struct NoisePlace {
    std::uint64_t cell = 0;
    std::uint64_t low_hash = 0;   ///< of the node below
    std::uint64_t high_hash = 0;  ///< of the node above
    double fraction = 0.0;
    double fade = 0.0;
};

/// @param axis_key   NoiseKeys::x or ::y
/// @param cell_mask  node indices are taken modulo cell_mask + 1, a power of two or 2^64
NoisePlace noise_place(std::uint64_t axis_key, std::uint64_t cell_mask, NoiseCoordinate coordinate);

NoisePlace noise_place(const internal::NoiseAxis& axis, std::uint64_t units, double rest);

/// 6 t^5 - 15 t^4 + 10 t^3.
double quintic_fade(double t);

/// Gradient noise: zero at the nodes, twice continuously differentiable, within +-kNoiseSup.
double noise(const NoisePlace& x, const NoisePlace& y);

}  // namespace terrane
