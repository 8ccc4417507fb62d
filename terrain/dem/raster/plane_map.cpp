// SPDX-License-Identifier: MIT
//
// Sources: B. R. Bowring, Transformation from spatial to geographical coordinates, Survey Review 181 (1976): latitude
//          and height of a geocentric position. Deviation: its formula is iterated until the latitude is stable.
#include "raster/plane_map.h"

#include <terrane/base/text.h>

#include <cpl_conv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>

namespace terrane::internal {
namespace {

constexpr double kNoPlace = std::numeric_limits<double>::quiet_NaN();
/// Cosine of the largest angle between the normals of the ellipsoid and of the plane.
constexpr double kLeastCosine = 0.5;
/// Height by which the extent is widened, times the sine of that angle, metres: high ground leans outward.
constexpr double kHighGround = 9000.0;
constexpr double kMostSamples = 0x1p31 - 256.0;

std::array<double, 6> inverse_of(const std::array<double, 6>& t) {
    const double area = t[1] * t[5] - t[2] * t[4];
    return {(t[2] * t[3] - t[5] * t[0]) / area, t[5] / area,  -t[2] / area,
            (t[4] * t[0] - t[1] * t[3]) / area, -t[4] / area, t[1] / area};
}

/// Weights of four equally spaced values for the cubic through them, at a fraction of the middle interval.
std::array<double, 4> cubic_weights(double t) {
    return {-t * (t - 1.0) * (t - 2.0) / 6.0, (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
            -(t + 1.0) * t * (t - 2.0) / 2.0, (t + 1.0) * t * (t - 1.0) / 6.0};
}

}  // namespace

TangentPlane::TangentPlane(const Ellipsoid& ellipsoid, double longitude, double latitude)
    : ellipsoid_(ellipsoid), origin_(point_on(ellipsoid, longitude, latitude)) {
    const double sin_lon = std::sin(longitude), cos_lon = std::cos(longitude);
    const double sin_lat = std::sin(latitude), cos_lat = std::cos(latitude);
    east_ = {-sin_lon, cos_lon, 0.0};
    north_ = {-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat};
    up_ = {cos_lat * cos_lon, cos_lat * sin_lon, sin_lat};
    const double a2 = ellipsoid.semi_major * ellipsoid.semi_major;
    const double b2 = ellipsoid.semi_minor * ellipsoid.semi_minor;
    inverse_squares_ = {1.0 / a2, 1.0 / a2, 1.0 / b2};
}

Eigen::Vector3d TangentPlane::world_from_geodetic(const Geodetic& place) const {
    const double cos_lat = std::cos(place.latitude);
    const Eigen::Vector3d normal{cos_lat * std::cos(place.longitude),
                                 cos_lat * std::sin(place.longitude), std::sin(place.latitude)};
    const Eigen::Vector3d p =
        point_on(ellipsoid_, place.longitude, place.latitude) + place.height * normal - origin_;
    return {p.dot(east_), p.dot(north_), p.dot(up_)};
}

TangentPlane::Geodetic TangentPlane::geodetic_from_world(const Eigen::Vector3d& p_world) const {
    const Eigen::Vector3d p = geocentric(p_world);
    const double a = ellipsoid_.semi_major, b = ellipsoid_.semi_minor;
    const double flat = 1.0 - (b * b) / (a * a), second = (a * a) / (b * b) - 1.0;
    const double from_axis = std::hypot(p.x(), p.y());
    // The parametric latitude, as sine and cosine.
    double sine = p.z() * a, cosine = from_axis * b, latitude = 0.0;
    constexpr int kRounds = 4;  // each gains more than four digits
    for (int round = 0; round < kRounds; ++round) {
        const double length = std::hypot(sine, cosine);
        sine /= length;
        cosine /= length;
        latitude = std::atan2(p.z() + second * b * sine * sine * sine,
                              from_axis - flat * a * cosine * cosine * cosine);
        sine = b * std::sin(latitude);
        cosine = a * std::cos(latitude);
    }
    const double sin_lat = std::sin(latitude), cos_lat = std::cos(latitude);
    const double height =
        from_axis * cos_lat + p.z() * sin_lat - a * std::sqrt(1.0 - flat * sin_lat * sin_lat);
    return {std::atan2(p.y(), p.x()), latitude, height};
}

// With t = x east + y north, and the metric of the ellipsoid: |origin + t + z up| = 1 is a z^2 + 2 b z + c = 0, where
// c = |t|^2, because t is tangential at the origin.
TangentPlane::Foot TangentPlane::foot(double x, double y) const {
    const Eigen::Vector3d t = x * east_ + y * north_;
    const Eigen::Vector3d metric_up = up_.cwiseProduct(inverse_squares_);
    const double a = up_.dot(metric_up), b = (origin_ + t).dot(metric_up);
    const double c = t.dot(t.cwiseProduct(inverse_squares_));
    const double root = b * b - a * c;
    Foot foot;
    if (!(root > 0.0) || !(b > 0.0)) {
        foot.z = kNoPlace;
        return foot;
    }
    foot.z = -c / (b + std::sqrt(root));
    const Eigen::Vector3d normal =
        geocentric({x, y, foot.z}).cwiseProduct(inverse_squares_).normalized();
    foot.normal = {normal.dot(east_), normal.dot(north_), normal.dot(up_)};
    return foot;
}

double TangentPlane::most_curvature() const {
    const double a = ellipsoid_.semi_major, b = ellipsoid_.semi_minor;
    return std::max(a / (b * b), b / (a * a));
}

/// Conversions between a raster's CRS and the tangent plane, through PROJ.
class PlaneMap::Projection {
public:
    /// Fails: bad_data; the message begins with a verb
    static Result<std::unique_ptr<const Projection>> create(const DemInfo& info) {
        if (info.crs_wkt.empty()) {
            return fail(ErrorCode::bad_data, "has no CRS; --project local needs one");
        }
        std::unique_ptr<Projection> made(new Projection);
        const std::unique_ptr<OGRSpatialReference> crs = import_crs(info.crs_wkt);
        std::unique_ptr<OGRSpatialReference>& degrees = made->degrees_;
        if (crs) {
            crs->DemoteTo2D(nullptr);
            degrees.reset(crs->CloneGeogCS());
        }
        if (!degrees) {
            return fail(ErrorCode::bad_data,
                        "has the CRS \"" + info.crs +
                            "\", which has no place on the Earth; --project local needs one");
        }
        crs->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
        degrees->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
        made->ellipsoid_ = {degrees->GetSemiMajor(), degrees->GetSemiMinor()};
        made->radians_ = degrees->GetAngularUnits();
        if (crs->IsGeographic() != 0) return made;
        auto to_crs = CrsTransform::create(*degrees, *crs);
        auto from_crs = CrsTransform::create(*crs, *degrees);
        if (!to_crs || !from_crs) {
            return fail(ErrorCode::bad_data,
                        "has the CRS \"" + info.crs +
                            "\", which PROJ cannot convert to longitudes and latitudes; --project "
                            "local needs that");
        }
        made->to_crs_ = *std::move(to_crs);
        made->from_crs_ = *std::move(from_crs);
        return made;
    }

    const Ellipsoid& ellipsoid() const { return ellipsoid_; }

    /// Replaces the CRS of a raster by the orthographic projection that the plane is for points of the ellipsoid.
    void describe(DemInfo& info) const {
        OGRSpatialReference plane;
        plane.CopyGeogCSFrom(degrees_.get());
        plane.SetOrthographic(info.middle_latitude, info.middle_longitude, 0.0, 0.0);
        info.crs = "tangent plane of " + info.crs;
        plane.SetProjCS(info.crs.c_str());
        char* wkt = nullptr;
        if (plane.exportToWkt(&wkt) == OGRERR_NONE) info.crs_wkt = wkt;
        CPLFree(wkt);
        info.geographic = false;
        info.projection = DemProjection::local;
        info.centre_x = info.centre_y = 0.0;
        info.metres_per_unit_x = info.metres_per_unit_y = 1.0;
        info.scale_error = 0.0;
    }

    /// Converts positions in the CRS to longitudes and latitudes, radians, in place; NaN: none.
    void to_radians(std::span<double> x, std::span<double> y) const {
        if (from_crs_) from_crs_->apply(x, y);
        for (double& each : x) each *= radians_;
        for (double& each : y) each *= radians_;
    }
    /// The opposite. Longitudes are taken within half a turn of `middle`.
    void from_radians(std::span<double> x, std::span<double> y, double middle) const {
        for (double& each : x) {
            each = (middle + std::remainder(each - middle, 2.0 * std::numbers::pi)) / radians_;
        }
        for (double& each : y) each /= radians_;
        if (to_crs_) to_crs_->apply(x, y);
    }

private:
    Projection() = default;

    std::unique_ptr<OGRSpatialReference> degrees_;  ///< the longitudes and latitudes of the CRS
    Ellipsoid ellipsoid_;
    double radians_ = 1.0;
    std::unique_ptr<const CrsTransform> to_crs_, from_crs_;  ///< null: geographic
};

PlaneMap::PlaneMap() = default;
PlaneMap::~PlaneMap() = default;

Result<std::shared_ptr<const PlaneMap>> PlaneMap::create(const RasterReader& reader, double cell) {
    const std::shared_ptr<PlaneMap> map(new PlaneMap);
    map->info_ = reader.info();
    map->crs_from_sample_ = reader.crs_from_sample();
    map->sample_from_crs_ = inverse_of(reader.crs_from_sample());
    map->points_ = reader.control_points();
    const bool is_local = reader.reading().projection == DemProjection::local;
    const auto done = is_local       ? map->lay_out_tangent(cell)
                      : map->points_ ? map->lay_out_points(reader, cell)
                                     : map->lay_out_affine(reader, cell);
    if (!done)
        return fail(done.error().code, named_raster(reader.path()) + " " + done.error().message);
    TERRANE_TRY(check_cells(reader.path(), map->info_));
    if (is_local) map->make_table();
    return map;
}

namespace {

/// Sets the size of the raster in the plane.
Result<void> set_size(double half_width, double half_height, double cell, DemInfo& info_out) {
    // The outermost nodes, half a cell within the extent, are on the raster's edges or beyond. A tolerance for
    // rounding.
    const auto cells = [cell](double half) { return 2.0 * std::ceil(half / cell + 0.5 - 1e-6); };
    const double columns = cells(half_width), rows = cells(half_height);
    if (!(columns <= kMostSamples && rows <= kMostSamples)) {
        return fail(ErrorCode::bad_data, "has " + number_text(columns) + " x " + number_text(rows) +
                                             " cells of " + number_text(cell) +
                                             " m in the plane, at most 2^31 a side are possible");
    }
    info_out.columns = static_cast<int>(columns);
    info_out.rows = static_cast<int>(rows);
    info_out.cell_x = info_out.cell_y = cell;
    return {};
}

}  // namespace

Result<void> PlaneMap::lay_out_affine(const RasterReader& reader, double cell) {
    const std::array<double, 6> t = reader.crs_from_sample();
    const double mx = info_.metres_per_unit_x, my = info_.metres_per_unit_y;
    const double columns = info_.columns, rows = info_.rows;
    if (cell == 0.0)
        cell = std::min(std::hypot(t[1] * mx, t[4] * my), std::hypot(t[2] * mx, t[5] * my));
    return set_size(0.5 * mx * (columns * std::fabs(t[1]) + rows * std::fabs(t[2])),
                    0.5 * my * (columns * std::fabs(t[4]) + rows * std::fabs(t[5])), cell, info_);
}

Result<void> PlaneMap::lay_out_points(const RasterReader& reader, double cell) {
    const double mx = info_.metres_per_unit_x, my = info_.metres_per_unit_y;
    if (cell == 0.0) {
        const double column = 0.5 * info_.columns - 0.5, row = 0.5 * info_.rows - 0.5;
        const auto length = [&](double by_column, double by_row) {
            const auto from = to_crs({column - 0.5 * by_column, row - 0.5 * by_row});
            const auto to = to_crs({column + 0.5 * by_column, row + 0.5 * by_row});
            return std::hypot((to[0] - from[0]) * mx, (to[1] - from[1]) * my);
        };
        cell = std::min(length(1.0, 0.0), length(0.0, 1.0));
        if (!(cell > 0.0)) {
            return fail(ErrorCode::bad_data, "has cells without length at its middle");
        }
    }
    return set_size(reader.rect().half_width * mx, reader.rect().half_height * my, cell, info_);
}

std::array<double, 2> PlaneMap::to_crs(const SamplePosition& at) const {
    if (points_) return points_->to_crs(at.column, at.row);
    const std::array<double, 6>& t = crs_from_sample_;
    return {t[0] + t[1] * at.column + t[2] * at.row, t[3] + t[4] * at.column + t[5] * at.row};
}

SamplePosition PlaneMap::from_crs(double x, double y) const {
    if (points_) {
        const std::array<double, 2> at = points_->from_crs(x, y);
        return {at[0], at[1]};
    }
    const std::array<double, 6>& t = sample_from_crs_;
    return {t[0] + t[1] * x + t[2] * y, t[3] + t[4] * x + t[5] * y};
}

Result<void> PlaneMap::lay_out_tangent(double cell) {
    TERRANE_TRY(projection_, Projection::create(info_));
    // Longitudes and latitudes of places in the raster.
    const auto geodetic = [&](std::span<const SamplePosition> places, std::vector<double>& x_out,
                              std::vector<double>& y_out) {
        x_out.clear();
        y_out.clear();
        for (const SamplePosition& at : places) {
            const std::array<double, 2> p = to_crs(at);
            x_out.push_back(p[0]);
            y_out.push_back(p[1]);
        }
        projection_->to_radians(x_out, y_out);
    };
    const double columns = info_.columns, rows = info_.rows;
    const SamplePosition middle{0.5 * columns - 0.5, 0.5 * rows - 0.5};
    std::vector<double> x, y;
    geodetic(std::array{middle}, x, y);
    if (!std::isfinite(x[0]) || !std::isfinite(y[0])) {
        return fail(ErrorCode::bad_data,
                    "has no longitude and latitude at its middle; --project "
                    "local needs them");
    }
    tangent_ = std::make_unique<const TangentPlane>(projection_->ellipsoid(), x[0], y[0]);
    info_.middle_longitude = x[0] * 180.0 / std::numbers::pi;
    info_.middle_latitude = y[0] * 180.0 / std::numbers::pi;

    // Places along the edges and inside.
    constexpr int kEdge = 1024, kStride = 32;
    std::vector<SamplePosition> places;
    for (int i = 0; i <= kEdge; ++i) {
        for (int j = 0; j <= kEdge; ++j) {
            const bool is_edge = i == 0 || j == 0 || i == kEdge || j == kEdge;
            if (!is_edge && (i % kStride != 0 || j % kStride != 0)) continue;
            places.push_back({columns * i / kEdge - 0.5, rows * j / kEdge - 0.5});
        }
    }
    geodetic(places, x, y);
    double half_width = 0.0, half_height = 0.0, least_cosine = 1.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        if (!std::isfinite(x[i]) || !std::isfinite(y[i])) continue;
        const Eigen::Vector3d foot = tangent_->world_from_geodetic({x[i], y[i], 0.0});
        const Eigen::Vector3d lean =
            tangent_->world_from_geodetic({x[i], y[i], kHighGround}) - foot;
        least_cosine = std::min(least_cosine, lean.z() / kHighGround);
        half_width = std::max({half_width, std::fabs(foot.x()), std::fabs(foot.x() + lean.x())});
        half_height = std::max({half_height, std::fabs(foot.y()), std::fabs(foot.y() + lean.y())});
    }
    if (least_cosine < kLeastCosine) {
        return fail(
            ErrorCode::bad_data,
            "extends to " + number_text(std::acos(least_cosine) * 180.0 / std::numbers::pi) +
                " degrees from its middle, at most 60 degrees are possible on a tangent plane "
                "(--project local)");
    }
    if (cell == 0.0) {
        const SamplePosition around[] = {{middle.column - 0.5, middle.row},
                                         {middle.column + 0.5, middle.row},
                                         {middle.column, middle.row - 0.5},
                                         {middle.column, middle.row + 0.5}};
        geodetic(around, x, y);
        std::array<Eigen::Vector3d, 4> feet;
        for (std::size_t i = 0; i < feet.size(); ++i) {
            feet[i] = tangent_->world_from_geodetic({x[i], y[i], 0.0});
        }
        cell = std::min((feet[1] - feet[0]).norm(), (feet[3] - feet[2]).norm());
        if (!(cell > 0.0)) {
            return fail(ErrorCode::bad_data, "has cells without length at its middle");
        }
    }
    projection_->describe(info_);
    return set_size(half_width, half_height, cell, info_);
}

void PlaneMap::make_table() {
    constexpr int kNodes = 16;
    const double step = kNodes * info_.cell_x;
    const auto points = [](int nodes) { return (nodes + kNodes - 1) / kNodes + 4; };
    table_step_ = step;
    table_columns_ = points(info_.columns);
    table_rows_ = points(info_.rows);
    table_x_ = x(0) - 1.5 * step;
    table_y_ = y(0) - 1.5 * step;
    const double middle = info_.middle_longitude * std::numbers::pi / 180.0;
    const auto line_at = [&](double offset, int row, int count, std::vector<SamplePosition>& out) {
        std::vector<double> x(static_cast<std::size_t>(count)), y(x.size());
        for (std::size_t i = 0; i < x.size(); ++i) {
            const double at_x = table_x_ + (static_cast<double>(i) + offset) * step;
            const double at_y = table_y_ + (row + offset) * step;
            const auto place =
                tangent_->geodetic_from_world({at_x, at_y, tangent_->foot(at_x, at_y).z});
            x[i] = place.longitude;
            y[i] = place.latitude;
        }
        projection_->from_radians(x, y, middle);
        for (std::size_t i = 0; i < x.size(); ++i) out.push_back(from_crs(x[i], y[i]));
    };
    for (int row = 0; row < table_rows_; ++row) line_at(0.0, row, table_columns_, table_);
    is_smooth_.assign(table_.size(), true);
    std::vector<SamplePosition> exact;
    for (int row = 1; row + 2 < table_rows_; ++row) {
        exact.clear();
        line_at(0.5, row, table_columns_, exact);
        for (int column = 1; column + 2 < table_columns_; ++column) {
            const SamplePosition near =
                at(table_x_ + (column + 0.5) * step, table_y_ + (row + 0.5) * step);
            const SamplePosition& is = exact[static_cast<std::size_t>(column)];
            const double error = std::hypot(near.column - is.column, near.row - is.row);
            is_smooth_[static_cast<std::size_t>(row * table_columns_ + column)] =
                4.0 * error <= kTableError;
        }
    }
}

SamplePosition PlaneMap::at(double x, double y) const {
    if (!tangent_) {
        return from_crs(info_.centre_x + x / info_.metres_per_unit_x,
                        info_.centre_y + y / info_.metres_per_unit_y);
    }
    const double u = (x - table_x_) / table_step_, v = (y - table_y_) / table_step_;
    const double column = std::floor(u), row = std::floor(v);
    if (!(column >= 1.0 && row >= 1.0 && column + 2.0 < table_columns_ &&
          row + 2.0 < table_rows_)) {
        return {kNoPlace, kNoPlace};
    }
    const int first = (static_cast<int>(row) - 1) * table_columns_ + static_cast<int>(column) - 1;
    if (!is_smooth_[static_cast<std::size_t>(first + table_columns_ + 1)]) {
        const auto place = tangent_->geodetic_from_world({x, y, tangent_->foot(x, y).z});
        double X[] = {place.longitude}, Y[] = {place.latitude};
        projection_->from_radians(X, Y, info_.middle_longitude * std::numbers::pi / 180.0);
        return from_crs(X[0], Y[0]);
    }
    const std::array<double, 4> across = cubic_weights(u - column), along = cubic_weights(v - row);
    SamplePosition sum;
    for (int j = 0; j < 4; ++j) {
        const SamplePosition* line =
            table_.data() + first + static_cast<std::ptrdiff_t>(j) * table_columns_;
        const auto k = static_cast<std::size_t>(j);
        sum.column += along[k] * (across[0] * line[0].column + across[1] * line[1].column +
                                  across[2] * line[2].column + across[3] * line[3].column);
        sum.row += along[k] * (across[0] * line[0].row + across[1] * line[1].row +
                               across[2] * line[2].row + across[3] * line[3].row);
    }
    return sum;
}

}  // namespace terrane::internal
