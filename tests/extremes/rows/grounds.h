// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/world.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/height_source.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

// Grounds of the table, without functions of the C library, so that every compiler measures the same.
namespace terrane::extremes {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinite = std::numeric_limits<double>::infinity();

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

// Bodies that fall onto the ground of a row, and how deep they get.

/// Bodies that are simulated together.
struct Fall {
    std::vector<Shape> shapes;          ///< a body of each
    double x = 0.3, y = 0.7;            ///< of the first body, metres; the others lie to the east
    double gap = 0.0;                   ///< metres between two bodies, and to the ground below
    Eigen::Vector3d velocity{0, 0, 0};  ///< m/s
    double dt = 1.0 / 60.0;             ///< seconds
    int steps = 60;                     ///< number of steps
    double max_substep = 1.0 / 120.0;   ///< WorldSettings::max_substep
};

/// A sphere, a capsule, a box, a hull and a compound whose largest half extent is `size`, metres.
std::vector<Shape> shapes_of_size(double size);

/// The largest of depth / contact_tolerance over bodies and steps, by the contact query signed_distance(). Infinite
/// where a body was parked; NaN where a body is refused or has no ground below, or a state is not finite.
double worst_depth_share(const Ground& ground, const Fall& fall);

/// The same of a body at its pose, 0 where it does not overlap the ground.
double depth_share(const Ground& ground, const BodySettings& settings, const BodyState& state);

/// A body of this state without velocity.
BodyState at_place(double x, double y, double z);

}  // namespace terrane::extremes
