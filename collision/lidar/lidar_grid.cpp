// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "base/trigonometry.h"

#include <terrane/collision/lidar.h>

#include <cmath>

namespace terrane {
namespace {

constexpr double kPi = std::numbers::pi;

/// Of a turn: cosine and sine.
struct Turn {
    double cosine, sine;
};

/// |angle| up to pi or little more. The tangent of a quarter of the angle, where it is accurate, gives both functions
/// of half of it, and these those of the angle.
Turn turn_of(double angle) {
    const double t = internal::tangent(0.25 * angle);
    const double share = 1.0 / (1.0 + t * t);
    const double cosine = (1.0 - t * t) * share, sine = 2.0 * t * share;
    return {cosine * cosine - sine * sine, 2.0 * sine * cosine};
}

/// An angle as one from -pi to pi.
double wrapped(double angle) { return angle - 2.0 * kPi * std::floor(angle / (2.0 * kPi) + 0.5); }

}  // namespace

Result<std::vector<Eigen::Vector3d>> make_lidar_grid(const LidarGridSettings& settings) {
    constexpr int kMostCount = 1 << 20;
    constexpr std::int64_t kMostDirections = std::int64_t{1} << 26;
    const auto check = [&]() -> Result<void> {
        if (auto ok = check_range("azimuth_count", settings.azimuth_count, 1, kMostCount); !ok)
            return ok;
        if (auto ok = check_range("first_azimuth", settings.first_azimuth, -2.0 * kPi, 2.0 * kPi);
            !ok)
            return ok;
        if (auto ok = check_range("azimuth_step", settings.azimuth_step, -2.0 * kPi, 2.0 * kPi);
            !ok)
            return ok;
        if (auto ok = check_range("elevation_count", settings.elevation_count, 1, kMostCount); !ok)
            return ok;
        if (auto ok =
                check_range("first_elevation", settings.first_elevation, -0.5 * kPi, 0.5 * kPi);
            !ok)
            return ok;
        if (auto ok = check_range("elevation_step", settings.elevation_step, -kPi, kPi); !ok)
            return ok;
        const double last =
            settings.first_elevation + settings.elevation_step * (settings.elevation_count - 1);
        // to rounding of the product
        if (auto ok =
                check_range("the last elevation", last, -0.5 * kPi - 1e-12, 0.5 * kPi + 1e-12);
            !ok)
            return ok;
        return check_range("azimuth_count * elevation_count",
                           std::int64_t{settings.azimuth_count} * settings.elevation_count,
                           std::int64_t{1}, kMostDirections);
    };
    if (auto ok = check(); !ok) return tl::unexpected(ok.error());
    std::vector<Turn> azimuths;
    for (int i = 0; i < settings.azimuth_count; ++i)
        azimuths.push_back(turn_of(wrapped(settings.first_azimuth + settings.azimuth_step * i)));
    std::vector<Eigen::Vector3d> directions;
    directions.reserve(azimuths.size() * static_cast<std::size_t>(settings.elevation_count));
    for (int j = 0; j < settings.elevation_count; ++j) {
        const Turn up = turn_of(settings.first_elevation + settings.elevation_step * j);
        for (const Turn& azimuth : azimuths) {
            directions.emplace_back(up.cosine * azimuth.cosine, up.cosine * azimuth.sine, up.sine);
        }
    }
    return directions;
}

}  // namespace terrane
