// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>

namespace terrane::internal {

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
/// Fails: bad_data where the centre lies within 0.01 degrees of a pole, or beyond
Result<AngularScale> metres_per_degree(const Ellipsoid& ellipsoid, double radians_per_unit,
                                       double latitude, double half_height);

}  // namespace terrane::internal
