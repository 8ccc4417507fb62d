// SPDX-License-Identifier: MIT
#include <terrane/render/sun_position.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace terrane {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;

double sine(double degrees) { return std::sin(std::fmod(degrees, 360.0) * kRadians); }
double cosine(double degrees) { return std::cos(std::fmod(degrees, 360.0) * kRadians); }

}  // namespace

SunPosition sun_position(double unix_seconds, double longitude_deg, double latitude_deg) {
    // days and Julian centuries since 2000-01-01T12:00Z
    const double days = unix_seconds / 86400.0 - 10957.5;
    const double centuries = days / 36525.0;
    // degrees: mean longitude and anomaly, equation of the centre, node of the moon's orbit
    const double mean = 280.46646 + centuries * (36000.76983 + 0.0003032 * centuries);
    const double anomaly = 357.52911 + centuries * (35999.05029 - 0.0001537 * centuries);
    const double centre =
        (1.914602 - centuries * (0.004817 + 0.000014 * centuries)) * sine(anomaly) +
        (0.019993 - 0.000101 * centuries) * sine(2.0 * anomaly) + 0.000289 * sine(3.0 * anomaly);
    const double node = 125.04 - 1934.136 * centuries;
    // apparent longitude: aberration and nutation
    const double longitude = mean + centre - 0.00569 - 0.00478 * sine(node);
    const double obliquity = 23.4392911 - 0.0130042 * centuries + 0.00256 * cosine(node);
    const double right_ascension =
        std::atan2(cosine(obliquity) * sine(longitude), cosine(longitude));
    const double declination = std::asin(sine(obliquity) * sine(longitude));
    const double sidereal =
        280.46061837 + 360.98564736629 * days + 0.000387933 * centuries * centuries;
    const double hour = std::fmod(sidereal + longitude_deg, 360.0) * kRadians - right_ascension;

    const double latitude = latitude_deg * kRadians;
    // components to the east, north and up
    const double east = -std::cos(declination) * std::sin(hour);
    const double north = std::sin(declination) * std::cos(latitude) -
                         std::cos(declination) * std::cos(hour) * std::sin(latitude);
    const double up = std::sin(declination) * std::sin(latitude) +
                      std::cos(declination) * std::cos(hour) * std::cos(latitude);
    const double azimuth = std::atan2(east, north);
    return {azimuth < 0.0 ? azimuth + 2.0 * std::numbers::pi : azimuth,
            std::asin(std::clamp(up, -1.0, 1.0))};
}

Eigen::Vector3d direction_to_sun(const SunPosition& sun, double convergence) {
    const double from_y = sun.azimuth - convergence;
    const double level = std::cos(sun.elevation);
    return {level * std::sin(from_y), level * std::cos(from_y), std::sin(sun.elevation)};
}

}  // namespace terrane
