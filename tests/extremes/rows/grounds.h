// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/height_source.h>

#include <memory>
#include <string>

// Grounds of the table, without functions of the C library, so that every compiler measures the same.
namespace terrane::extremes {

/// A source of heights.
using Source = std::shared_ptr<const HeightSource>;

/// Hills z = base + amplitude * (w(x / wavelength) + w(y / wavelength)) with w(t) = 16 f^2 (1 - f)^2, f the fraction
/// of t. |w'| <= 3.08 and |w''| <= 32, from which the source's bounds follow.
struct Hills {
    double middle_x = 0.0;     ///< of the extent, metres
    double middle_y = 0.0;     ///< metres
    double side = 256.0;       ///< of the extent, metres
    double spacing = 1.0;      ///< of the finest level, metres
    double base = 0.0;         ///< metres
    double amplitude = 4.0;    ///< metres, >= 0
    double wavelength = 40.0;  ///< metres, > 0
    double quantum = 0x1p-12;  ///< Lattice::quantum
};
Result<Source> make_hills(const Hills& hills);

/// V-shaped valleys along y with walls of one slope and a period of 8 m; the bottoms are 0.3 m beside lattice lines.
///
/// @param side of the extent, metres, around (0, 0)
Result<Source> make_valleys(double slope, double side);

/// Level ground at z = 5 m, of a spacing.
///
/// @param side of the extent, metres, around (0, 0)
Source make_flat(double side, double spacing);

/// Settings of a fractal of 12 octaves; amplitude 800 m, 1 m between samples, four root squares of 65,536 m.
FractalSettings fractal_settings();

/// The contact surface at the finest level over the chunks that a region meets; everything else is not resident.
///
/// Fails: what make_chunk() fails with
Result<Ground> load(const HeightSource& source, const WorldRect& region);
/// The same over the whole extent.
Result<Ground> load(const HeightSource& source);

/// A square around a point, metres.
WorldRect square_around(double x, double y, double half_side);

/// Largest of |height of the contact surface - height of the source| / error_m over random points of a region. NaN
/// where the ground does not answer. The seed is fixed.
double worst_error_share(const HeightSource& source, const Ground& ground, const WorldRect& region);

/// The message of a failed result; empty for a success.
template <class T>
std::string message_of(const Result<T>& result) {
    return result.has_value() ? std::string() : result.error().message;
}

}  // namespace terrane::extremes
