// SPDX-License-Identifier: MIT
#pragma once

// Transforms between the earth-centred, earth-fixed frame (ECEF) and Terrane's world. ECEF: x from the earth's centre
// through latitude 0, longitude 0; z through the north pole; metres. The earth is an ellipsoid of revolution, WGS84 by
// default; a sphere if the semi-axes are equal.
//
// There are two mappings between the ellipsoid and the planar world.
// - tangent_plane: the world's axes are east, north and up at the origin. Lengths and angles are true; ground that
//   follows the earth must be modelled with the earth's curvature (785 m below the plane at 100 km). This is the world
//   of a raster with DemProjection::local, whose DemInfo has the origin: middle_latitude and middle_longitude.
// - plate_carree: x and y are longitude and latitude, relative to the origin, times constants; z is the height above
//   the ellipsoid. This is Terrane's mapping of a raster in degrees: heights equal the raster's, eastward lengths are
//   true only at the origin's latitude. Slopes are converted with the true lengths.
//
// Uses the C library's sine and cosine, so answers may differ in the last bits between machines.
//
// Sources: B. R. Bowring. Transformation from spatial to geographical coordinates. 1976 (latitude and height).
//          NGA.STND.0036. World Geodetic System 1984. 2014 (ellipsoid).
//          J. P. Snyder. Map projections. USGS Professional Paper 1395, 1987, chapter 12 (equidistant cylindrical).
// Deviations: Bowring's formula is iterated from a first value that accounts for the height, so that it is valid from
//             200 km below the surface to any height.

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/base/text.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

namespace terrane::adapters {

/// Mapping between the flat world and the earth.
enum class EarthMapping {
    tangent_plane,  ///< Cartesian: east, north, up at the origin
    plate_carree,  ///< x and y proportional to longitude and latitude, z the height above the ellipsoid
};

/// A place in geodetic coordinates.
struct Geodetic {
    double latitude = 0.0;   ///< geodetic, -pi/2 to pi/2
    double longitude = 0.0;  ///< -pi to pi
    double height = 0.0;     ///< above the ellipsoid, metres
};

/// Settings of an EarthFrame.
struct EarthFrameSettings {
    double latitude = 0.0;                  ///< geodetic, of the world's (0, 0), radians
    double longitude = 0.0;                 ///< of the world's (0, 0), radians
    double height = 0.0;                    ///< of world z = 0 above the ellipsoid, metres
    double semi_major = 6378137.0;          ///< of the ellipsoid; WGS84
    double semi_minor = 6356752.314245179;  ///< equal to semi_major for a sphere
    EarthMapping mapping = EarthMapping::tangent_plane;  ///< meaning of x and y
    /// With plate_carree: metres of x per radian of longitude; 0 for the true length at the origin. For a raster in
    /// degrees: 180 / pi times the metres_per_unit_x printed by `terrane info`.
    double metres_per_radian_east = 0.0;
    double metres_per_radian_north = 0.0;  ///< as above, for y and latitude
};

/// Transforms between ECEF and a world. Immutable. Threads: any number. Allocates: nothing.
class EarthFrame {
public:
    /// Fails: invalid_argument, naming the field and its value: angles, height or scales out of range, axes not 1e5 m
    ///        to 1e9 m with 0.9 semi_major <= semi_minor <= semi_major, plate_carree within 0.01 degrees of a pole
    static Result<EarthFrame> create(const EarthFrameSettings& settings) {
        const double half_turn = std::numbers::pi;
        struct Range {
            const char* name;
            double value, least, most;
        };
        const Range ranges[] = {
            {"latitude", settings.latitude, -half_turn / 2, half_turn / 2},
            {"longitude", settings.longitude, -2 * half_turn, 2 * half_turn},
            {"height", settings.height, -1e5, 1e9},
            {"semi_major", settings.semi_major, 1e5, 1e9},
            {"semi_minor", settings.semi_minor, 0.9 * settings.semi_major, settings.semi_major},
            {"metres_per_radian_east", settings.metres_per_radian_east, 0.0, 1e12},
            {"metres_per_radian_north", settings.metres_per_radian_north, 0.0, 1e12},
        };
        for (const Range& range : ranges) {
            if (range.value >= range.least && range.value <= range.most) continue;
            return fail(ErrorCode::invalid_argument,
                        std::string(range.name) + " must be " + number_text(range.least) + " to " +
                            number_text(range.most) + ", got " + number_text(range.value));
        }
        if (settings.mapping == EarthMapping::plate_carree &&
            std::abs(settings.latitude) > (90.0 - 0.01) * half_turn / 180.0) {
            return fail(ErrorCode::invalid_argument,
                        "latitude must be 0.01 degrees from the poles for plate_carree, got " +
                            number_text(settings.latitude * 180.0 / half_turn) + " degrees");
        }
        return EarthFrame(settings);
    }

    /// Settings passed to create().
    const EarthFrameSettings& settings() const { return settings_; }

    /// ECEF of a geodetic place.
    Eigen::Vector3d earth_from_geodetic(const Geodetic& place) const {
        const double across = prime_vertical_radius(place.latitude);
        const double plane = (across + place.height) * std::cos(place.latitude);
        return {plane * std::cos(place.longitude), plane * std::sin(place.longitude),
                (across * (1.0 - e2_) + place.height) * std::sin(place.latitude)};
    }

    /// Geodetic place of an ECEF position. Nothing if it is not finite, or nearer to the earth's centre than the
    /// semi-minor axis less 200 km. Longitude is 0 on the earth's axis.
    ///
    /// Accuracy: 3e-15 of the distance from the earth's centre, 2e-8 m at the surface (EarthFrame tests)
    std::optional<Geodetic> geodetic_from_earth(const Eigen::Vector3d& p_earth) const {
        const double radius = p_earth.stableNorm();
        if (!(radius >= settings_.semi_minor - 2e5) || std::isinf(radius)) return std::nullopt;
        const double a = settings_.semi_major, b = settings_.semi_minor;
        const double plane = std::hypot(p_earth.x(), p_earth.y());
        const double second_e2 = (a * a) / (b * b) - 1.0;
        double reduced = std::atan2(p_earth.z() * b * (1.0 + second_e2 * b / radius), plane * a);
        double latitude = 10.0;  // none yet: out of range
        constexpr int kMostRounds = 20;
        for (int i = 0; i < kMostRounds; ++i) {
            const double s = std::sin(reduced), c = std::cos(reduced);
            const double last = std::exchange(
                latitude,
                std::atan2(p_earth.z() + second_e2 * b * s * s * s, plane - e2_ * a * c * c * c));
            if (std::abs(latitude - last) < 1e-16) break;
            reduced = std::atan2(b * std::sin(latitude), a * std::cos(latitude));
        }
        const double s = std::sin(latitude), c = std::cos(latitude);
        const double height = plane * c + p_earth.z() * s - a * std::sqrt(1.0 - e2_ * s * s);
        return Geodetic{latitude, std::atan2(p_earth.y(), p_earth.x()), height};
    }

    /// World position of an ECEF position. Nothing if geodetic_from_earth() returns nothing; with tangent_plane also if
    /// the vertical is more than 45 degrees from the origin's, because world z is no longer a measure of height there.
    std::optional<WorldPos> world_from_earth(const Eigen::Vector3d& p_earth) const {
        const std::optional<Geodetic> place = geodetic_from_earth(p_earth);
        if (!place) return std::nullopt;
        if (settings_.mapping == EarthMapping::tangent_plane) {
            if (up_at(place->latitude, place->longitude).dot(axes_.col(2)) < std::sqrt(0.5)) {
                return std::nullopt;
            }
            return WorldPos(axes_.transpose() * (p_earth - origin_earth_));
        }
        const double turn = 2.0 * std::numbers::pi;
        const double east = std::remainder(place->longitude - settings_.longitude, turn);
        return WorldPos(east * metres_east_, (place->latitude - settings_.latitude) * metres_north_,
                        place->height - settings_.height);
    }

    /// ECEF of a world position. With plate_carree, x wraps around the earth and y is clamped to the poles.
    Eigen::Vector3d earth_from_world(const WorldPos& p_world) const {
        if (settings_.mapping == EarthMapping::tangent_plane) {
            return origin_earth_ + axes_ * p_world;
        }
        return earth_from_geodetic(geodetic_from_flat(p_world));
    }

    /// Transforms a surface normal at a world position to ECEF, unit. With plate_carree, slopes are converted with the
    /// true lengths of a radian at the position.
    Eigen::Vector3d normal_earth_from_world(const WorldPos& p_world,
                                            const Eigen::Vector3d& normal_world) const {
        if (settings_.mapping == EarthMapping::tangent_plane) return axes_ * normal_world;
        const Geodetic place = geodetic_from_flat(p_world);
        const double across = prime_vertical_radius(place.latitude);
        const double s = std::sin(place.latitude);
        const double along = across * (1.0 - e2_) / (1.0 - e2_ * s * s);
        const double true_east = (across + place.height) * std::cos(place.latitude);
        const double true_north = along + place.height;
        // normals transform by the inverse transpose of the scales, here times true_east: no division by 0 at a pole
        const Eigen::Vector3d local(normal_world.x() * metres_east_,
                                    normal_world.y() * metres_north_ * (true_east / true_north),
                                    normal_world.z() * true_east);
        return (axes_at(place.latitude, place.longitude) * local).stableNormalized();
    }

    /// The vertical at a world position, as a vector in ECEF: the normal of the ellipsoid or of the tangent plane.
    Eigen::Vector3d up_earth(const WorldPos& p_world) const {
        if (settings_.mapping == EarthMapping::tangent_plane) return axes_.col(2);
        const Geodetic place = geodetic_from_flat(p_world);
        return up_at(place.latitude, place.longitude);
    }

private:
    explicit EarthFrame(const EarthFrameSettings& settings) : settings_(settings) {
        const double a = settings.semi_major, b = settings.semi_minor;
        e2_ = (a - b) * (a + b) / (a * a);
        axes_ = axes_at(settings.latitude, settings.longitude);
        origin_earth_ =
            earth_from_geodetic({settings.latitude, settings.longitude, settings.height});
        const double s = std::sin(settings.latitude);
        const double across = prime_vertical_radius(settings.latitude);
        metres_east_ = settings.metres_per_radian_east > 0.0
                           ? settings.metres_per_radian_east
                           : (across + settings.height) * std::cos(settings.latitude);
        metres_north_ = settings.metres_per_radian_north > 0.0
                            ? settings.metres_per_radian_north
                            : across * (1.0 - e2_) / (1.0 - e2_ * s * s) + settings.height;
    }

    double prime_vertical_radius(double latitude) const {
        const double s = std::sin(latitude);
        return settings_.semi_major / std::sqrt(1.0 - e2_ * s * s);
    }
    static Eigen::Vector3d up_at(double latitude, double longitude) {
        return {std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude),
                std::sin(latitude)};
    }
    // Columns: east, north, up.
    static Eigen::Matrix3d axes_at(double latitude, double longitude) {
        Eigen::Matrix3d axes;
        axes.col(0) = Eigen::Vector3d(-std::sin(longitude), std::cos(longitude), 0.0);
        axes.col(2) = up_at(latitude, longitude);
        axes.col(1) = axes.col(2).cross(axes.col(0));
        return axes;
    }
    Geodetic geodetic_from_flat(const WorldPos& p_world) const {
        const double quarter = std::numbers::pi / 2;
        const double latitude = settings_.latitude + p_world.y() / metres_north_;
        return {latitude < -quarter ? -quarter : (latitude > quarter ? quarter : latitude),
                settings_.longitude + p_world.x() / metres_east_, settings_.height + p_world.z()};
    }

    EarthFrameSettings settings_;
    double e2_ = 0.0;                                // first eccentricity squared
    double metres_east_ = 0.0, metres_north_ = 0.0;  // per radian of longitude, latitude
    Eigen::Matrix3d axes_;
    Eigen::Vector3d origin_earth_;
};

}  // namespace terrane::adapters
