// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/dem/dem_heights.h>

#include <memory>
#include <span>
#include <string>

namespace terrane {

/// The surface above which heights are measured.
enum class HeightReference {
    unknown,      ///< the file does not say
    ellipsoidal,  ///< an ellipsoid, as for heights by satellite
    orthometric,  ///< the geoid or another level surface near mean sea level
};

/// Lengths and directions in the world's plane against those on the ellipsoid of WGS 84, at one place.
struct PlaneScale {
    double x = 1.0;  ///< metres on the ellipsoid per metre of world x
    double y = 1.0;  ///< metres on the ellipsoid per metre of world y
    /// Angle from world y to true north, radians, positive counterclockwise seen from above: the grid convergence.
    double convergence = 0.0;
};

/// Where the world of a raster is on the Earth: conversions between world positions, the raster's CRS, and longitude
/// and latitude in WGS 84, by PROJ. A value; copies share their state.
///
/// A position is a vector of three numbers. In the world they are x, y and z in metres; in the CRS, its easting and
/// northing, or longitude and latitude, in its units, and z; in WGS 84, degrees east of Greenwich, -180 to 180, degrees
/// north, and a height in metres. If has_ellipsoidal_heights(), that height is above the ellipsoid of WGS 84, otherwise
/// it is z unchanged. Longitudes are accepted from -720 to 720 degrees; of equal places one turn apart, the one nearest
/// to the raster's middle is returned.
///
/// With DemProjection::local, the world is the tangent plane with z along its normal: conversions go through the
/// geocentric position, the height in WGS 84 is that above the ellipsoid of the raster's CRS, and the CRS is the
/// orthographic projection of DemInfo::crs_wkt, with that height in place of z.
///
/// A position without a counterpart is NaN: one that is not finite, beyond a pole, or outside the projection. If only
/// the height has none, only the height is NaN. A function that takes arrays requires equal sizes; both may be the same
/// memory.
///
/// Threads: any; conversions of one raster, its copies included, wait for each other. Cost: 0.05 to 1 us a position in
/// arrays; a call has an overhead of about 1 us.
class Georeference {
public:
    Georeference() = delete;

    /// @param dem what DemHeights::open() reported
    ///
    /// Fails: invalid_argument if the raster has no CRS, or one without a place on the Earth; bad_data if PROJ cannot
    ///        convert it
    /// Cost:  1 to 50 ms
    static Result<Georeference> create(const DemInfo& dem);

    /// Converts arrays of positions to longitude, latitude and height.
    void lonlat_from_world(std::span<const WorldPos> world,
                           std::span<Eigen::Vector3d> lonlat_out) const;
    /// The inverse.
    void world_from_lonlat(std::span<const Eigen::Vector3d> lonlat,
                           std::span<WorldPos> world_out) const;
    /// Coordinates in the raster's CRS.
    void crs_from_world(std::span<const WorldPos> world, std::span<Eigen::Vector3d> crs_out) const;
    /// The inverse.
    void world_from_crs(std::span<const Eigen::Vector3d> crs, std::span<WorldPos> world_out) const;

    /// Converts one position to longitude, latitude and height.
    Eigen::Vector3d lonlat_from_world(const WorldPos& p_world) const;
    /// The inverse, of one position.
    WorldPos world_from_lonlat(const Eigen::Vector3d& lonlat) const;
    /// Coordinates of one position in the raster's CRS.
    Eigen::Vector3d crs_from_world(const WorldPos& p_world) const;
    /// The inverse, of one position.
    WorldPos world_from_crs(const Eigen::Vector3d& p_crs) const;

    /// The scale at a place of the world, metres. NaN where the place or its surroundings of 10 m have no longitude.
    PlaneScale scale_at(double x, double y) const;

    /// Length of the geodesic between two places of the world, on the ellipsoid of WGS 84, metres. The relative error
    /// of their distance in the plane is distance / geodesic_length() - 1. NaN if a place has no longitude, and for
    /// places nearly opposite on the Earth.
    double geodesic_length(const WorldPos& a_world, const WorldPos& b_world) const;

    /// What the raster's heights are measured from.
    HeightReference height_reference() const;
    /// Whether heights can be converted to the ellipsoid of WGS 84: that of orthometric heights needs a grid of their
    /// geoid among PROJ's files (proj-data), and reads "unknown" for geoids without a grid.
    bool has_ellipsoidal_heights() const;
    /// height_reference() and has_ellipsoidal_heights() in words, with the source: "orthometric, from the vertical CRS
    /// \"EGM2008 height\"; above the ellipsoid: unknown, no grid of this geoid is installed".
    const std::string& describe_heights() const;

    /// Implementation.
    struct State;

private:
    explicit Georeference(std::shared_ptr<const State> state) : state_(std::move(state)) {}

    std::shared_ptr<const State> state_;
};

}  // namespace terrane
