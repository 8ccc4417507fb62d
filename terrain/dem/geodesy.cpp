// SPDX-License-Identifier: MIT
//
// Sources: J. P. Snyder, Map Projections - A Working Manual, USGS Professional Paper 1395 (1987),
//          equations 4-18 and 4-19: radii of curvature of the meridian and of the prime vertical.
#include "geodesy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace terrane::internal {
namespace {

/// Metres a radian along the parallel.
double parallel_radius(const Ellipsoid& e, double latitude_rad) {
    const double flat = 1.0 - (e.semi_minor * e.semi_minor) / (e.semi_major * e.semi_major);
    const double sine = std::sin(latitude_rad);
    return e.semi_major * std::cos(latitude_rad) / std::sqrt(1.0 - flat * sine * sine);
}

/// Metres a radian along the meridian.
double meridian_radius(const Ellipsoid& e, double latitude_rad) {
    const double flat = 1.0 - (e.semi_minor * e.semi_minor) / (e.semi_major * e.semi_major);
    const double sine = std::sin(latitude_rad);
    const double w = 1.0 - flat * sine * sine;
    return e.semi_major * (1.0 - flat) / (w * std::sqrt(w));
}

double round_to_grid(double value) { return std::floor(value * 1024.0 + 0.5) / 1024.0; }

}  // namespace

Result<AngularScale> metres_per_degree(const Ellipsoid& ellipsoid, double radians_per_unit,
                                       double latitude, double half_height) {
    constexpr double kHalfTurn = 0.5 * std::numbers::pi;
    constexpr double kNearPole = 1.7e-4;
    const double centre_rad = latitude * radians_per_unit;
    if (!(std::fabs(centre_rad) < kHalfTurn - kNearPole)) {
        return fail(ErrorCode::bad_data,
                    "a geographic raster needs its centre between the poles, got latitude " +
                        std::to_string(latitude));
    }
    AngularScale scale;
    scale.east = round_to_grid(parallel_radius(ellipsoid, centre_rad) * radians_per_unit);
    scale.north = round_to_grid(meridian_radius(ellipsoid, centre_rad) * radians_per_unit);
    const double half_rad = half_height * radians_per_unit;
    for (const double edge_rad : {centre_rad - half_rad, centre_rad + half_rad}) {
        const double edge =
            parallel_radius(ellipsoid, std::clamp(edge_rad, -kHalfTurn, kHalfTurn)) *
            radians_per_unit;
        const double error = edge > 0.0 ? std::fabs(scale.east / edge - 1.0)
                                        : std::numeric_limits<double>::infinity();
        scale.east_error = std::max(scale.east_error, error);
    }
    return scale;
}

}  // namespace terrane::internal
