// SPDX-License-Identifier: MIT
//
// Sources: J. P. Snyder, Map Projections - A Working Manual, USGS Professional Paper 1395 (1987),
//          equations 4-18 and 4-19: radii of curvature of the meridian and of the prime vertical.
#include "raster/geodesy.h"

#include <terrane/terrain/number_text.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

namespace terrane::internal {
namespace {

/// Metres per radian along the parallel.
double parallel_radius(const Ellipsoid& e, double latitude_rad) {
    const double flat = 1.0 - (e.semi_minor * e.semi_minor) / (e.semi_major * e.semi_major);
    const double sine = std::sin(latitude_rad);
    return e.semi_major * std::cos(latitude_rad) / std::sqrt(1.0 - flat * sine * sine);
}

/// Metres per radian along the meridian.
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
    constexpr double kQuarterTurn = 0.5 * std::numbers::pi;
    const double centre_rad = latitude * radians_per_unit;
    const double half_rad = half_height * radians_per_unit;
    const double furthest_rad = std::fabs(centre_rad) + half_rad;
    const double furthest_deg = std::copysign(furthest_rad * 180.0 / std::numbers::pi, centre_rad);
    // Tolerance for the rounding of sums and of degrees in radians.
    constexpr double kRounding = 1e-12;
    if (!(furthest_rad <= kQuarterTurn + kRounding)) {
        return fail(ErrorCode::bad_data, "is geographic and reaches latitude " +
                                             number_text(furthest_deg) +
                                             " degrees, -90 to 90 are possible");
    }
    AngularScale scale;
    scale.east = round_to_grid(parallel_radius(ellipsoid, centre_rad) * radians_per_unit);
    scale.north = round_to_grid(meridian_radius(ellipsoid, centre_rad) * radians_per_unit);
    for (const double edge_rad : {centre_rad - half_rad, centre_rad + half_rad}) {
        const double edge = parallel_radius(ellipsoid, edge_rad) * radians_per_unit;
        const double error = edge > 0.0 ? std::fabs(scale.east / edge - 1.0)
                                        : std::numeric_limits<double>::infinity();
        scale.east_error = std::max(scale.east_error, error);
    }
    if (!(scale.east_error <= kMostScaleError)) {
        return fail(ErrorCode::bad_data,
                    "is geographic and reaches latitude " + number_text(furthest_deg) +
                        " degrees, where lengths east are " + number_text(scale.east_error + 1.0) +
                        " times too long in the plane, at most " +
                        number_text(kMostScaleError + 1.0) + " times is possible: reproject it");
    }
    return scale;
}

}  // namespace terrane::internal
