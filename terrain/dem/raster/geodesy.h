// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>

namespace terrane::internal {

/// Largest accepted relative error of lengths along parallels from using one scale: ten times too long. A raster
/// centred on the equator reaches it at 84 degrees of latitude.
inline constexpr double kMostScaleError = 9.0;

struct Ellipsoid {
    double semi_major = 0.0, semi_minor = 0.0;  ///< metres
};

/// Metres per angular unit of a CRS at a latitude.
struct AngularScale {
    double east = 0.0, north = 0.0;
    /// Largest relative error of a length along the parallels half_height north and south of it.
    double east_error = 0.0;
};

/// Scale of a geographic raster. Its sines are the only use of the C library that could affect a world's bits; rounding
/// to 2^-10 m removes the effect.
///
/// @param radians_per_unit of the CRS's angular unit
/// @param latitude         of the centre, in that unit
/// @param half_height      from the centre to the northern edge, in that unit
///
/// Fails: bad_data if the raster extends beyond a pole, or so near that the error is above
///        kMostScaleError; the message begins with a verb
Result<AngularScale> metres_per_degree(const Ellipsoid& ellipsoid, double radians_per_unit,
                                       double latitude, double half_height);

}  // namespace terrane::internal
