// SPDX-License-Identifier: MIT
#pragma once

#include "raster/crs_frame.h"
#include "raster/raster_checks.h"
#include "raster/raster_reader.h"

#include <terrane/base/math.h>

#include <array>
#include <memory>
#include <vector>

namespace terrane::internal {

/// The plane that touches an ellipsoid at one place, with world axes: x east, y north, z along the normal there.
/// Positions in the world are geocentric positions, turned and shifted: lengths and angles are Euclidean.
class TangentPlane {
public:
    /// @param longitude, latitude of the origin, radians
    TangentPlane(const Ellipsoid& ellipsoid, double longitude, double latitude);

    /// A position above the ellipsoid: longitude and latitude in radians, height in metres.
    struct Geodetic {
        double longitude = 0.0, latitude = 0.0, height = 0.0;
    };
    Eigen::Vector3d world_from_geodetic(const Geodetic& place) const;
    /// Exact to a micrometre from 1000 km below the ellipsoid to 10,000 km above it.
    Geodetic geodetic_from_world(const Eigen::Vector3d& p_world) const;

    /// The point of the ellipsoid with given x and y, on the near side.
    struct Foot {
        double z = 0.0;  ///< NaN: none, beyond the ellipsoid's outline
        Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< of the ellipsoid, in world axes
    };
    Foot foot(double x, double y) const;

    /// Upper bound of the ellipsoid's curvature, 1/m.
    double most_curvature() const;

private:
    Eigen::Vector3d geocentric(const Eigen::Vector3d& p_world) const {
        return origin_ + p_world.x() * east_ + p_world.y() * north_ + p_world.z() * up_;
    }

    Ellipsoid ellipsoid_;
    Eigen::Vector3d origin_;  ///< geocentric
    Eigen::Vector3d east_, north_, up_;
    Eigen::Vector3d inverse_squares_;  ///< of the semi-axes
};

/// A place between a raster's samples; whole numbers are samples, counted from the south-west.
struct SamplePosition {
    double column = 0.0, row = 0.0;
};

/// Where the samples of a raster are in a plane on whose axes they do not lie: the plane of a rotated or sheared
/// raster, or of one that ground control points place, or the tangent plane at a raster's middle.
///
/// The tangent plane's map to sample positions is tabulated, with cubic interpolation, wherever its error in the middle
/// of the table's cells is below kTableError; elsewhere PROJ is called for each position.
class PlaneMap {
public:
    /// Largest error of the table, in samples, estimated as four times that in the middle of its cells.
    static constexpr double kTableError = 1e-4;

    /// @param cell side of a cell in the plane, metres; 0: the shorter side of a raster cell at the middle
    ///
    /// Fails: bad_data for a raster without a CRS, or whose CRS has no place on the Earth, or that extends beyond 60
    ///        degrees from its middle, for the tangent plane
    static Result<std::shared_ptr<const PlaneMap>> create(const RasterReader& reader, double cell);
    ~PlaneMap();

    /// The raster in the plane: its size, cells and georeferencing.
    const DemInfo& info() const { return info_; }
    /// World position of a node: a sample of the raster in the plane.
    double x(double column) const { return (column + 0.5 - 0.5 * info_.columns) * info_.cell_x; }
    double y(double row) const { return (row + 0.5 - 0.5 * info_.rows) * info_.cell_y; }

    /// The surface from which heights are measured along its normals: the ellipsoid, or the plane itself.
    TangentPlane::Foot foot(double x, double y) const {
        return tangent_ ? tangent_->foot(x, y) : TangentPlane::Foot{};
    }
    double most_curvature() const { return tangent_ ? tangent_->most_curvature() : 0.0; }
    bool is_affine() const { return !tangent_ && !points_; }
    /// The place in the raster of the point of that surface at (x, y); NaN: none.
    SamplePosition at(double x, double y) const;

private:
    class Projection;

    PlaneMap();
    Result<void> lay_out_affine(const RasterReader& reader, double cell);
    Result<void> lay_out_points(const RasterReader& reader, double cell);
    Result<void> lay_out_tangent(double cell);
    /// Between places in the raster and its CRS.
    std::array<double, 2> to_crs(const SamplePosition& at) const;
    SamplePosition from_crs(double x, double y) const;
    void make_table();

    DemInfo info_;
    std::array<double, 6> crs_from_sample_{}, sample_from_crs_{};  ///< as geotransforms
    std::shared_ptr<const ControlPoints> points_;                  ///< instead of both; or null
    std::unique_ptr<const TangentPlane> tangent_;
    std::unique_ptr<const Projection> projection_;
    double table_step_ = 0.0, table_x_ = 0.0, table_y_ = 0.0;
    int table_columns_ = 0, table_rows_ = 0;
    std::vector<SamplePosition> table_;
    std::vector<bool> is_smooth_;  ///< [cells of the table]
};

}  // namespace terrane::internal
