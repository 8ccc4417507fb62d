// SPDX-License-Identifier: MIT
//
// Lengths on a map are compared with lengths on the ellipsoid through the derivatives of the map: the least and the
// greatest stretch over all directions are the singular values of the Jacobian. Over a raster they are sampled; second
// differences bound what lies between the samples.
//
// Sources: J. P. Snyder, Map Projections - A Working Manual, USGS Professional Paper 1395 (1987), equations 3-11, 4-18
//          and 4-19: the ellipsoid, radii of curvature of the meridian and of the prime vertical.
#include "raster/crs_frame.h"

#include "raster/raster_reader.h"

#include <terrane/base/text.h>

#include <gdal_alg.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>
#include <string_view>
#include <vector>

namespace terrane::internal {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

double eccentricity2(const Ellipsoid& e) {
    return 1.0 - (e.semi_minor * e.semi_minor) / (e.semi_major * e.semi_major);
}

/// Metres per radian along the parallel.
double parallel_radius(const Ellipsoid& e, double latitude) {
    const double sine = std::sin(latitude);
    return e.semi_major * std::cos(latitude) / std::sqrt(1.0 - eccentricity2(e) * sine * sine);
}

/// Metres per radian along the meridian.
double meridian_radius(const Ellipsoid& e, double latitude) {
    const double sine = std::sin(latitude);
    const double w = 1.0 - eccentricity2(e) * sine * sine;
    return e.semi_major * (1.0 - eccentricity2(e)) / (w * std::sqrt(w));
}

double round_to(double value, double per_step) {
    return std::floor(value * per_step + 0.5) / per_step;
}

/// Logarithms of the least and the greatest length on the ellipsoid per length in the plane, over all directions.
struct Stretch {
    double least = kNan, greatest = kNan;
};

/// Stretches on a grid of places.
struct StretchGrid {
    int columns = 0, rows = 0;
    double step_x = 0.0, step_y = 0.0;  ///< metres in the plane
    std::vector<Stretch> all{};
};

/// Bound of the relative error of lengths in the plane, from the stretches at samples of a raster.
double scale_error_of(const StretchGrid& grid) {
    double least = 0.0, greatest = 0.0, slope = 0.0, bend = 0.0;
    for (const double Stretch::*value : {&Stretch::least, &Stretch::greatest}) {
        double bend_of[2] = {0.0, 0.0};
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column) {
                const auto at = [&](int c, int r) {
                    if (c >= grid.columns || r >= grid.rows) return kNan;
                    return grid.all[static_cast<std::size_t>(r * grid.columns + c)].*value;
                };
                const double here = at(column, row);
                if (!std::isfinite(here)) continue;
                least = std::min(least, here);
                greatest = std::max(greatest, here);
                const double next[2] = {at(column + 1, row), at(column, row + 1)};
                const double after[2] = {at(column + 2, row), at(column, row + 2)};
                const double step[2] = {grid.step_x, grid.step_y};
                for (const int axis : {0, 1}) {
                    if (std::isnan(next[axis])) continue;
                    slope = std::max(slope, std::fabs(next[axis] - here) / step[axis]);
                    if (std::isnan(after[axis])) continue;
                    bend_of[axis] =
                        std::max(bend_of[axis], std::fabs(here - 2.0 * next[axis] + after[axis]));
                }
            }
        }
        bend = std::max(bend, bend_of[0] + bend_of[1]);
    }
    // Between samples a function exceeds its linear interpolation by an eighth of its second difference; twice that, as
    // the second derivative is only sampled. A geodesic bends away from the straight line by up to an eighth of its
    // length squared times the slope.
    constexpr double kLength = 20'000.0;
    const double width = std::max(grid.columns - 1, 0) * grid.step_x;
    const double height = std::max(grid.rows - 1, 0) * grid.step_y;
    const double bent = std::min(kLength, std::hypot(width, height)) * slope;
    const double margin = 0.25 * bend + 0.125 * bent * bent;
    return std::max(std::exp(margin - least) - 1.0, 1.0 - std::exp(-margin - greatest));
}

/// Bound of the relative difference between lengths on an ellipsoid and on that of WGS 84, whose centre may be up to
/// about 100 m away.
double datum_error_of(const Ellipsoid& ellipsoid) {
    const Ellipsoid wgs84;
    const double difference = std::max(std::fabs(ellipsoid.semi_major / wgs84.semi_major - 1.0),
                                       std::fabs(ellipsoid.semi_minor / wgs84.semi_minor - 1.0));
    constexpr double kSame = 1e-7, kShift = 2e-5;
    return difference < kSame ? kSame : 1.5 * difference + kShift;
}

Result<CrsScale> plane_of_degrees(const OGRSpatialReference& crs, const Ellipsoid& ellipsoid,
                                  const CrsRect& rect) {
    constexpr double kQuarterTurn = 0.5 * std::numbers::pi;
    const double radians = crs.GetAngularUnits();
    const double centre = rect.centre_y * radians, half = rect.half_height * radians;
    const double furthest = std::fabs(centre) + half;
    const double furthest_deg = std::copysign(furthest * 180.0 / std::numbers::pi, centre);
    // Tolerance for the rounding of sums and of degrees in radians.
    constexpr double kRounding = 1e-12;
    if (!(furthest <= kQuarterTurn + kRounding)) {
        return fail(ErrorCode::bad_data, "is geographic and reaches latitude " +
                                             number_text(furthest_deg) +
                                             " degrees, -90 to 90 are possible");
    }
    CrsScale plane;
    plane.is_geographic = true;
    plane.metres_x = round_to(parallel_radius(ellipsoid, centre) * radians, 1024.0);
    plane.metres_y = round_to(meridian_radius(ellipsoid, centre) * radians, 1024.0);
    constexpr int kRows = 65;
    StretchGrid grid{1, kRows, 0.0, 2.0 * rect.half_height / (kRows - 1) * plane.metres_y};
    for (int row = 0; row < kRows; ++row) {
        const double latitude = centre + half * (2.0 * row / (kRows - 1) - 1.0);
        const double east = parallel_radius(ellipsoid, latitude) * radians / plane.metres_x;
        const double north = meridian_radius(ellipsoid, latitude) * radians / plane.metres_y;
        const double least = std::max(std::min(east, north), 0.0);
        grid.all.push_back({std::log(least), std::log(std::max(east, north))});
        if (!(least * (1.0 + kMostScaleError) >= 1.0)) {
            return fail(ErrorCode::bad_data,
                        "is geographic and reaches latitude " + number_text(furthest_deg) +
                            " degrees, where lengths east are " + number_text(1.0 / least) +
                            " times too long in the plane, at most " +
                            number_text(kMostScaleError + 1.0) +
                            " times is possible: reproject it");
        }
    }
    plane.scale_error = std::min(kMostScaleError, scale_error_of(grid));
    return plane;
}

/// The derivatives of the position on the ellipsoid, metres per unit of the CRS, at many places.
struct Jacobian {
    Eigen::Vector3d x = Eigen::Vector3d::Constant(kNan), y = x;
};
std::vector<Jacobian> jacobians(const CrsTransform& geographic_from_crs, const Ellipsoid& ellipsoid,
                                double radians, std::span<const WorldVec2> places, double step) {
    std::vector<double> x, y;
    for (const WorldVec2& p : places) {
        for (const double side : {1.0, -1.0}) {
            x.insert(x.end(), {p.x() + side * step, p.x()});
            y.insert(y.end(), {p.y(), p.y() + side * step});
        }
    }
    geographic_from_crs.apply(x, y);
    std::vector<Jacobian> all;
    for (std::size_t i = 0; i < x.size(); i += 4) {
        const auto point = [&](std::size_t j) {
            return point_on(ellipsoid, x[i + j] * radians, y[i + j] * radians);
        };
        all.push_back({(point(0) - point(2)) / (2.0 * step), (point(1) - point(3)) / (2.0 * step)});
    }
    return all;
}

Stretch stretch_of(const Jacobian& jacobian, const CrsScale& plane) {
    const Eigen::Vector3d x = jacobian.x / plane.metres_x, y = jacobian.y / plane.metres_y;
    const double middle = 0.5 * (x.squaredNorm() + y.squaredNorm());
    const double half = std::hypot(0.5 * (x.squaredNorm() - y.squaredNorm()), x.dot(y));
    return {0.5 * std::log(std::max(middle - half, 0.0)), 0.5 * std::log(middle + half)};
}

/// Whether a projection is one of Mercator's, whose lengths are true at the equator alone.
bool is_mercator(const OGRSpatialReference& crs) {
    const char* name = crs.GetAttrValue("PROJECTION");
    const std::string_view projection = name != nullptr ? name : "";
    return projection.starts_with("Mercator") ||
           projection.find("Pseudo") != std::string_view::npos;
}

CrsScale plane_of_projection(const OGRSpatialReference& crs, const Ellipsoid& ellipsoid,
                             const CrsRect& rect) {
    CrsScale plane;
    plane.metres_x = plane.metres_y = crs.GetLinearUnits();
    const std::unique_ptr<OGRSpatialReference> geographic(crs.CloneGeogCS());
    if (!geographic) return plane;
    geographic->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    const auto transform = CrsTransform::create(crs, *geographic);
    if (!transform) return plane;
    const double radians = geographic->GetAngularUnits();
    constexpr double kStep = 500.0;  // metres
    const double step = kStep / plane.metres_x;
    const WorldVec2 centre(rect.centre_x, rect.centre_y);
    const Jacobian middle = jacobians(**transform, ellipsoid, radians, {&centre, 1}, step).front();
    const double x = middle.x.norm(), y = middle.y.norm();
    if (std::isfinite(x) && std::isfinite(y) && x > 0.0 && y > 0.0) {
        constexpr double kMostDistortion = 0.05, kConformal = 1e-6;
        const auto is_off = [&](double metres) {
            const double factor = metres / crs.GetLinearUnits();
            return std::max(factor, 1.0 / factor) > 1.0 + kMostDistortion;
        };
        plane.is_scaled = is_mercator(crs) || is_off(x) || is_off(y);
        if (plane.is_scaled) {
            constexpr double kPerStep = 0x1p20;
            plane.metres_x = round_to(x, kPerStep);
            // Equal cells stay equal.
            plane.metres_y =
                std::fabs(x / y - 1.0) < kConformal ? plane.metres_x : round_to(y, kPerStep);
        }
    }
    constexpr int kSide = 17;
    StretchGrid grid{kSide, kSide, 2.0 * rect.half_width / (kSide - 1) * plane.metres_x,
                     2.0 * rect.half_height / (kSide - 1) * plane.metres_y};
    std::vector<WorldVec2> places;
    for (int row = 0; row < kSide; ++row) {
        for (int column = 0; column < kSide; ++column) {
            places.emplace_back(
                rect.centre_x + rect.half_width * (2.0 * column / (kSide - 1) - 1.0),
                rect.centre_y + rect.half_height * (2.0 * row / (kSide - 1) - 1.0));
        }
    }
    for (const Jacobian& j : jacobians(**transform, ellipsoid, radians, places, step)) {
        grid.all.push_back(stretch_of(j, plane));
    }
    plane.scale_error = scale_error_of(grid);
    return plane;
}

}  // namespace

Eigen::Vector3d point_on(const Ellipsoid& ellipsoid, double longitude, double latitude) {
    const double along = parallel_radius(ellipsoid, latitude);
    const double sine = std::sin(latitude);
    const double e2 = eccentricity2(ellipsoid);
    const double up = ellipsoid.semi_major * (1.0 - e2) * sine / std::sqrt(1.0 - e2 * sine * sine);
    return {along * std::cos(longitude), along * std::sin(longitude), up};
}

std::unique_ptr<OGRSpatialReference> import_crs(const std::string& wkt) {
    const QuietGdal quiet;
    auto crs = std::make_unique<OGRSpatialReference>();
    if (wkt.empty() || crs->importFromWkt(wkt.c_str()) != OGRERR_NONE) return nullptr;
    crs->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    return crs;
}

Result<std::unique_ptr<const CrsTransform>> CrsTransform::create(const OGRSpatialReference& from,
                                                                 const OGRSpatialReference& to,
                                                                 bool is_exact) {
    const QuietGdal quiet;
    OGRCoordinateTransformationOptions options;
    options.SetBallparkAllowed(!is_exact);
    std::unique_ptr<CrsTransform> made(new CrsTransform);
    made->transform_.reset(OGRCreateCoordinateTransformation(&from, &to, options));
    if (made->transform_) return std::unique_ptr<const CrsTransform>(std::move(made));
    return fail(ErrorCode::bad_data, quiet.message());
}

CrsTransform::~CrsTransform() = default;

void CrsTransform::apply(std::span<double> x, std::span<double> y, std::span<double> z) const {
    // In pieces, so that other threads have their turn.
    constexpr std::size_t kMost = 4096;
    std::array<int, kMost> is_good{};
    for (std::size_t i = 0; i < x.size(); i += kMost) {
        const std::size_t count = std::min(kMost, x.size() - i);
        {
            const std::lock_guard lock(mutex_);
            const QuietGdal quiet;
            transform_->Transform(static_cast<int>(count), x.data() + i, y.data() + i,
                                  z.empty() ? nullptr : z.data() + i, nullptr, is_good.data());
        }
        for (std::size_t j = 0; j < count; ++j) {
            const bool is_finite = std::isfinite(x[i + j]) && std::isfinite(y[i + j]) &&
                                   (z.empty() || std::isfinite(z[i + j]));
            if (is_good[j] != 0 && is_finite) continue;
            x[i + j] = y[i + j] = kNan;
            if (!z.empty()) z[i + j] = kNan;
        }
    }
}

std::shared_ptr<const ControlPoints> ControlPoints::create(GDALDataset& dataset) {
    const QuietGdal quiet;
    constexpr int kAutomaticOrder = 0;
    void* polynomials =
        GDALCreateGCPTransformer(dataset.GetGCPCount(), dataset.GetGCPs(), kAutomaticOrder, FALSE);
    if (polynomials == nullptr) return nullptr;
    std::shared_ptr<ControlPoints> made(new ControlPoints);
    made->polynomials_ = {polynomials, GDALDestroyGCPTransformer};
    return made;
}

std::array<double, 2> ControlPoints::convert(double x, double y, bool to_pixel) const {
    double z = 0.0;
    int is_good = FALSE;
    GDALGCPTransform(polynomials_.get(), to_pixel ? TRUE : FALSE, 1, &x, &y, &z, &is_good);
    if (is_good == FALSE || !std::isfinite(x) || !std::isfinite(y)) return {kNan, kNan};
    return {x, y};
}

// A sample is in the middle of its pixel.
std::array<double, 2> ControlPoints::to_crs(double column, double row) const {
    return convert(column + 0.5, row + 0.5, false);
}
std::array<double, 2> ControlPoints::from_crs(double x, double y) const {
    const std::array<double, 2> pixel = convert(x, y, true);
    return {pixel[0] - 0.5, pixel[1] - 0.5};
}

CrsRect ControlPoints::extent(int columns, int rows) const {
    constexpr int kEdge = 1024;
    constexpr double kInfinite = std::numeric_limits<double>::infinity();
    double west = kInfinite, south = kInfinite, east = -kInfinite, north = -kInfinite;
    for (int i = 0; i <= kEdge; ++i) {
        const double part = static_cast<double>(i) / kEdge;
        const double column = columns * part - 0.5, row = rows * part - 0.5;
        for (const std::array<double, 2>& p : {to_crs(column, -0.5), to_crs(column, rows - 0.5),
                                               to_crs(-0.5, row), to_crs(columns - 0.5, row)}) {
            if (std::isnan(p[0])) continue;
            west = std::min(west, p[0]);
            east = std::max(east, p[0]);
            south = std::min(south, p[1]);
            north = std::max(north, p[1]);
        }
    }
    return {0.5 * (west + east), 0.5 * (south + north), 0.5 * (east - west), 0.5 * (north - south)};
}

Result<CrsScale> crs_scale_of(const OGRSpatialReference& crs, const CrsRect& rect) {
    const QuietGdal quiet;
    const Ellipsoid ellipsoid{crs.GetSemiMajor(), crs.GetSemiMinor()};
    CrsScale plane;
    if (crs.IsGeographic() != 0) {
        TERRANE_TRY(plane, plane_of_degrees(crs, ellipsoid, rect));
    } else if (crs.IsProjected() != 0) {
        plane = plane_of_projection(crs, ellipsoid, rect);
    } else {
        plane.metres_x = plane.metres_y = crs.GetLinearUnits();
        return plane;
    }
    plane.scale_error += datum_error_of(ellipsoid) * (1.0 + plane.scale_error);
    return plane;
}

WorldRect WorldFrame::rect_of(const CrsRect& rect) const {
    const double x = x_of(rect.centre_x), y = y_of(rect.centre_y);
    const double half_x = rect.half_width * metres_x, half_y = rect.half_height * metres_y;
    return {x - half_x, y - half_y, x + half_x, y + half_y};
}

WorldFrame world_frame_of(const DemInfo& dem) {
    WorldFrame frame{dem.centre_x, dem.centre_y, dem.metres_per_unit_x, dem.metres_per_unit_y};
    if (!dem.geographic) return frame;
    const auto crs = import_crs(dem.crs_wkt);
    const double radians = crs ? crs->GetAngularUnits() : std::numbers::pi / 180.0;
    frame.turn = round_to(2.0 * std::numbers::pi / radians, 0x1p20);
    return frame;
}

}  // namespace terrane::internal
