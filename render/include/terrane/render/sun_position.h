// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>

namespace terrane {

/// Where the sun stands in the sky of a place, radians.
struct SunPosition {
    double azimuth = 0.0;    ///< clockwise from true north, 0 to 2 pi
    double elevation = 0.0;  ///< of the disc's centre above the horizontal, without refraction
};

/// The sun's position at a time and a place, within 0.02 degrees in the years 1900 to 2100.
///
/// Source: J. Meeus, Astronomical Algorithms, 2nd edition, 1998, chapters 12, 13 and 25 (low accuracy).
///
/// @param unix_seconds  UTC, seconds since 1970-01-01T00:00Z without leap seconds
/// @param longitude_deg degrees east
/// @param latitude_deg  degrees north
SunPosition sun_position(double unix_seconds, double longitude_deg, double latitude_deg);

/// Unit vector towards the sun in the axes of a world, for RendererSettings::sun_direction.
///
/// @param convergence angle from world y to true north, radians, positive counterclockwise: PlaneScale::convergence of
///                    the component dem; 0 if world y is true north
Eigen::Vector3d direction_to_sun(const SunPosition& sun, double convergence = 0.0);

}  // namespace terrane
