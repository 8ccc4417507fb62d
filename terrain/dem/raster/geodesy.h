// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>

namespace terrane::internal {

/// The largest error of a length along a parallel that a plane with one scale is used for: ten times
/// too long. It is reached 84 degrees away from the equator by a raster that is centred there.
inline constexpr double kMostScaleError = 9.0;

struct Ellipsoid {
    double semi_major = 0.0, semi_minor = 0.0;  ///< metres
};

/// Metres for one angular unit of a CRS around a latitude.
struct AngularScale {
    double east = 0.0, north = 0.0;
    /// Largest relative error of a length along the parallels half_height north and south of it.
    double east_error = 0.0;
};

/// Scale of a geographic raster. Its sines are the only place where the C library has a say in a
/// world's bits; rounding to 2^-10 m takes it away again.
///
/// @param radians_per_unit of the CRS's angular unit
/// @param latitude         of the centre, in that unit
/// @param half_height      from the centre to the northern edge, in that unit
///
/// Fails: bad_data where the raster reaches beyond a pole, or so near that the error is above
///        kMostScaleError; the message begins with a verb
Result<AngularScale> metres_per_degree(const Ellipsoid& ellipsoid, double radians_per_unit,
                                       double latitude, double half_height);

}  // namespace terrane::internal
