// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/dem/dem_heights.h>

#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <span>
#include <string>

class GDALDataset;
class OGRCoordinateTransformation;
class OGRSpatialReference;

namespace terrane::internal {

/// Largest accepted relative error of lengths along parallels, due to the constant scale of a geographic raster. With
/// this error a length is ten times too long. A raster centred on the equator reaches it at a latitude of 84 degrees.
inline constexpr double kMostScaleError = 9.0;

struct Ellipsoid {
    double semi_major = 6378137.0, semi_minor = 6356752.314245179;  ///< metres; WGS 84
};

/// The point of an ellipsoid's surface at a longitude and latitude, from the ellipsoid's centre, metres.
///
/// @param longitude, latitude radians
Eigen::Vector3d point_on(const Ellipsoid& ellipsoid, double longitude, double latitude);

/// A CRS from well-known text, with x towards the east and y towards the north; null if GDAL does not understand it.
std::unique_ptr<OGRSpatialReference> import_crs(const std::string& wkt);

/// Converts coordinates from one CRS to another. Threads: any; calls wait for each other.
class CrsTransform {
public:
    /// @param is_exact refuses conversions that leave a datum out of account
    ///
    /// Fails: bad_data, with PROJ's reason
    static Result<std::unique_ptr<const CrsTransform>> create(const OGRSpatialReference& from,
                                                              const OGRSpatialReference& to,
                                                              bool is_exact = false);
    ~CrsTransform();
    CrsTransform(const CrsTransform&) = delete;
    CrsTransform& operator=(const CrsTransform&) = delete;

    /// Converts in place: x, y, z; NaN if a position has no counterpart. z may be empty.
    void apply(std::span<double> x, std::span<double> y, std::span<double> z = {}) const;

private:
    CrsTransform() = default;

    std::unique_ptr<OGRCoordinateTransformation> transform_;
    mutable std::mutex mutex_;
};

/// The outer edges of a raster in its CRS.
struct CrsRect {
    double centre_x = 0.0, centre_y = 0.0;
    double half_width = 0.0, half_height = 0.0;
};

/// The polynomials that GDAL fits to a raster's ground control points: from places in the raster to the CRS and, fitted
/// separately, from the CRS to the raster. Whole numbers of columns and rows are samples, in the order of the file.
/// Threads: any.
class ControlPoints {
public:
    /// Null if the points determine no polynomial.
    static std::shared_ptr<const ControlPoints> create(GDALDataset& dataset);

    /// Converts a place in the raster to the CRS, or the opposite; NaN if it has no counterpart.
    std::array<double, 2> to_crs(double column, double row) const;
    std::array<double, 2> from_crs(double x, double y) const;
    /// The smallest rectangle around a raster's outer edges, found from a thousand places on each.
    CrsRect extent(int columns, int rows) const;

private:
    ControlPoints() = default;
    std::array<double, 2> convert(double x, double y, bool to_pixel) const;

    std::shared_ptr<void> polynomials_;
};

/// How a raster's CRS becomes the plane of the world: two factors.
struct CrsScale {
    bool is_geographic = false;
    double metres_x = 1.0, metres_y = 1.0;  ///< of the world per unit of the CRS
    double scale_error = 0.0;               ///< as DemInfo::scale_error
    bool is_scaled = false;                 ///< metres of the CRS are not metres of the world
};

/// The plane of a raster. Degrees are scaled to their true lengths at the raster's middle, and so are the metres of
/// projections that distort lengths there by more than 5 percent, or that are kinds of Mercator's. All factors are
/// rounded, so that differences between C libraries and between releases of PROJ do not affect a world's bits.
///
/// Fails: bad_data if a geographic raster extends beyond a pole, or so near it that the error exceeds kMostScaleError;
///        the message begins with a verb
Result<CrsScale> crs_scale_of(const OGRSpatialReference& crs, const CrsRect& rect);

/// The affine conversion from a raster's CRS to its world, of which longitudes wrap.
struct WorldFrame {
    double centre_x = 0.0, centre_y = 0.0;  ///< of the world in the CRS
    double metres_x = 1.0, metres_y = 1.0;  ///< per unit of the CRS
    double turn = 0.0;  ///< distance in x between equal places of the CRS; 0: none

    double x_of(double crs_x) const {
        const double x = crs_x - centre_x;
        return (turn > 0.0 ? std::remainder(x, turn) : x) * metres_x;
    }
    double y_of(double crs_y) const { return (crs_y - centre_y) * metres_y; }
    double crs_x_of(double x) const { return centre_x + x / metres_x; }
    double crs_y_of(double y) const { return centre_y + y / metres_y; }
    /// Places a rectangle by its centre.
    WorldRect rect_of(const CrsRect& rect) const;
};
WorldFrame world_frame_of(const DemInfo& dem);

}  // namespace terrane::internal
