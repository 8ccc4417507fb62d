// SPDX-License-Identifier: MIT
//
// Source: T. Vincenty, Direct and Inverse Solutions of Geodesics on the Ellipsoid with Application of Nested Equations,
//         Survey Review 23 (1975): the length of a geodesic.
#include "raster/crs_frame.h"
#include "raster/plane_map.h"
#include "raster/raster_reader.h"

#include <terrane/base/text.h>
#include <terrane/dem/georeference.h>

#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

namespace terrane {

using internal::CrsTransform;

struct Georeference::State {
    internal::WorldFrame frame;
    /// With DemProjection::local; wgs84_from_crs then is from longitudes and latitudes of the CRS, in `radians` each.
    std::unique_ptr<const internal::TangentPlane> tangent;
    double radians = 1.0;
    std::unique_ptr<const CrsTransform> wgs84_from_crs, crs_from_wgs84;
    /// With heights; null: unknown.
    std::unique_ptr<const CrsTransform> ellipsoid_from_crs, crs_from_ellipsoid;
    double vertical_metres =
        1.0;  ///< per unit of the vertical axis; negative: the axis points down
    HeightReference height_reference = HeightReference::unknown;
    std::string heights = "unknown, the CRS has no vertical axis";

    /// Conversions between the world and the CRS of wgs84_from_crs, with z or the height above the tangent plane's
    /// ellipsoid.
    Eigen::Vector3d plan_from_world(const WorldPos& p) const {
        if (!tangent) return {frame.crs_x_of(p.x()), frame.crs_y_of(p.y()), p.z()};
        const auto place = tangent->geodetic_from_world(p);
        return {place.longitude / radians, place.latitude / radians, place.height};
    }
    WorldPos world_from_plan(const Eigen::Vector3d& p) const {
        if (!tangent) return {frame.x_of(p.x()), frame.y_of(p.y()), p.z()};
        return tangent->world_from_geodetic({p.x() * radians, p.y() * radians, p.z()});
    }
};

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kMostLongitude = 720.0;

std::string quoted(const char* name) {
    return std::string("\"").append(name != nullptr ? name : "").append("\"");
}

std::unique_ptr<OGRSpatialReference> import_epsg(int code) {
    auto crs = std::make_unique<OGRSpatialReference>();
    if (crs->importFromEPSG(code) != OGRERR_NONE) return nullptr;
    crs->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    return crs;
}

/// Longitudes, latitudes and heights of many positions, as PROJ takes them.
struct Columns {
    std::vector<double> x, y, z;

    explicit Columns(std::size_t count) : x(count), y(count), z(count) {}
    void set(std::size_t i, const Eigen::Vector3d& p) {
        x[i] = p.x();
        y[i] = p.y();
        z[i] = p.z();
    }
};

/// Calls convert(positions, out) with pieces of bounded memory.
template <typename Convert>
void in_pieces(std::span<const Eigen::Vector3d> from, std::span<Eigen::Vector3d> out,
               Convert&& convert) {
    TERRANE_ASSERT(from.size() == out.size(), "arrays of positions must have equal sizes");
    constexpr std::size_t kMost = 4096;
    for (std::size_t i = 0; i < from.size(); i += kMost) {
        const std::size_t count = std::min(kMost, from.size() - i);
        convert(from.subspan(i, count), out.subspan(i, count));
    }
}

/// Finds the distance between equal places of a projection, in x: 0 if it has none, or the raster does not reach over
/// the edge of the map.
double turn_of(const CrsTransform& there, const CrsTransform& back, const internal::CrsRect& rect) {
    const double half = rect.half_width;
    std::array<double, 3> x{rect.centre_x - half, rect.centre_x, rect.centre_x + half};
    std::array<double, 3> y{rect.centre_y, rect.centre_y, rect.centre_y};
    const std::array<double, 3> from = x;
    there.apply(x, y);
    back.apply(x, y);
    double turn = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double shift = std::fabs(x[i] - from[i]);
        const bool is_level = std::fabs(y[i] - rect.centre_y) < 1e-3;
        if (is_level && shift > half) turn = std::max(turn, shift);
    }
    return turn;
}

/// The vertical part of a CRS with heights.
void read_vertical(const OGRSpatialReference& crs, Georeference::State& state_out) {
    const bool is_compound = crs.IsCompound() != 0;
    if (!is_compound && crs.GetAxesCount() < 3) return;
    OGRAxisOrientation orientation = OAO_Other;
    double metres = 0.0;
    const char* unit_name = nullptr;
#if GDAL_VERSION_NUM >= GDAL_COMPUTE_VERSION(3, 4, 0)
    crs.GetAxis(nullptr, 2, &orientation, &metres);
#else
    crs.GetAxis(nullptr, 2, &orientation);
#endif
    if (is_compound) metres = crs.GetTargetLinearUnits("COMPD_CS|VERT_CS", &unit_name);
    state_out.vertical_metres = (metres > 0.0 ? metres : 1.0) * (orientation == OAO_Down ? -1 : 1);
    const char* datum_type = crs.GetAttrValue("COMPD_CS|VERT_CS|VERT_DATUM", 1);
    constexpr const char* kEllipsoidal = "2002";  // the code of ellipsoidal heights in WKT 1
    const bool is_ellipsoidal =
        !is_compound || (datum_type != nullptr && std::strcmp(datum_type, kEllipsoidal) == 0);
    state_out.height_reference =
        is_ellipsoidal ? HeightReference::ellipsoidal : HeightReference::orthometric;
    state_out.heights = is_ellipsoidal ? "ellipsoidal, from the 3D CRS " + quoted(crs.GetName())
                                       : "orthometric, from the vertical CRS " +
                                             quoted(crs.GetAttrValue("COMPD_CS|VERT_CS"));
}

/// Opens the conversions of heights, if the grid of the geoid is there.
void open_heights(const OGRSpatialReference& crs, const internal::CrsRect& rect,
                  Georeference::State& state_out) {
    if (state_out.height_reference == HeightReference::unknown) return;
    const auto wgs84 = import_epsg(4979);
    auto up = CrsTransform::create(crs, *wgs84, true);
    auto down = CrsTransform::create(*wgs84, crs, true);
    if (up && down) {
        std::array<double, 1> x{rect.centre_x}, y{rect.centre_y}, z{0.0};
        (*up)->apply(x, y, z);
        if (std::isfinite(z[0])) {
            state_out.ellipsoid_from_crs = *std::move(up);
            state_out.crs_from_ellipsoid = *std::move(down);
            return;
        }
    }
    state_out.heights +=
        "; above the ellipsoid of WGS 84: unknown, PROJ has no conversion of this "
        "vertical datum here, or its grid is not installed";
}

/// The length of the geodesic between two places on the ellipsoid of WGS 84; NaN if Vincenty's iteration does not
/// converge. Degrees.
double vincenty_length(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    const internal::Ellipsoid e;
    const double f = 1.0 - e.semi_minor / e.semi_major;
    const double difference = std::remainder(b.x() - a.x(), 360.0) * kDegree;
    const auto reduced = [f](double latitude) {
        return std::atan2((1.0 - f) * std::sin(latitude * kDegree), std::cos(latitude * kDegree));
    };
    const double u1 = reduced(a.y()), u2 = reduced(b.y());
    const double sin1 = std::sin(u1), cos1 = std::cos(u1), sin2 = std::sin(u2), cos2 = std::cos(u2);
    double lambda = difference;
    constexpr int kMostSteps = 200;
    for (int i = 0; i < kMostSteps; ++i) {
        const double sine_l = std::sin(lambda), cosine_l = std::cos(lambda);
        const double sine = std::hypot(cos2 * sine_l, cos1 * sin2 - sin1 * cos2 * cosine_l);
        if (sine == 0.0) return 0.0;
        const double cosine = sin1 * sin2 + cos1 * cos2 * cosine_l;
        const double sigma = std::atan2(sine, cosine);
        const double sin_azimuth = cos1 * cos2 * sine_l / sine;
        const double cos2_azimuth = 1.0 - sin_azimuth * sin_azimuth;
        const double middle = cos2_azimuth > 0.0 ? cosine - 2.0 * sin1 * sin2 / cos2_azimuth : 0.0;
        const double c = f / 16.0 * cos2_azimuth * (4.0 + f * (4.0 - 3.0 * cos2_azimuth));
        const double next =
            difference +
            (1.0 - c) * f * sin_azimuth *
                (sigma + c * sine * (middle + c * cosine * (2.0 * middle * middle - 1.0)));
        const double change = std::fabs(next - lambda);
        lambda = next;
        if (!(std::fabs(lambda) <= std::numbers::pi)) return kNan;
        if (!(change < 1e-13)) continue;
        const double second = e.semi_major * e.semi_major / (e.semi_minor * e.semi_minor) - 1.0;
        const double u = cos2_azimuth * second;
        const double big_a = 1.0 + u / 16384.0 * (4096.0 + u * (-768.0 + u * (320.0 - 175.0 * u)));
        const double big_b = u / 1024.0 * (256.0 + u * (-128.0 + u * (74.0 - 47.0 * u)));
        const double m2 = middle * middle;
        const double correction =
            big_b * sine *
            (middle + big_b / 4.0 *
                          (cosine * (2.0 * m2 - 1.0) -
                           big_b / 6.0 * middle * (4.0 * sine * sine - 3.0) * (4.0 * m2 - 3.0)));
        return e.semi_minor * big_a * (sigma - correction);
    }
    return kNan;
}

}  // namespace

Result<Georeference> Georeference::create(const DemInfo& dem) {
    if (dem.crs_wkt.empty()) {
        return fail(ErrorCode::invalid_argument,
                    dem.crs.empty() ? "the raster has no CRS"
                                    : "the CRS \"" + dem.crs + "\" is known only by its name");
    }
    const auto crs = internal::import_crs(dem.crs_wkt);
    const internal::QuietGdal quiet;
    if (!crs) {
        return fail(ErrorCode::bad_data,
                    "the CRS \"" + dem.crs + "\" is not understood: " + quiet.message());
    }
    if (crs->IsGeographic() == 0 && crs->IsProjected() == 0) {
        return fail(ErrorCode::invalid_argument,
                    "the CRS \"" + dem.crs + "\" has no longitudes and latitudes");
    }
    const auto wgs84 = import_epsg(4326);
    if (!wgs84) return fail(ErrorCode::bad_data, "PROJ does not find its database proj.db");
    const auto state = std::make_shared<State>();
    const bool is_local = dem.projection == DemProjection::local;
    const std::unique_ptr<OGRSpatialReference> plan(is_local ? crs->CloneGeogCS() : crs->Clone());
    plan->DemoteTo2D(nullptr);
    plan->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    if (is_local) {
        const internal::Ellipsoid ellipsoid{plan->GetSemiMajor(), plan->GetSemiMinor()};
        state->tangent = std::make_unique<const internal::TangentPlane>(
            ellipsoid, dem.middle_longitude * kDegree, dem.middle_latitude * kDegree);
        state->radians = plan->GetAngularUnits();
        state->heights = "taken as ellipsoidal, for the tangent plane";
    }
    const auto open = [&](const OGRSpatialReference& from, const OGRSpatialReference& to,
                          std::unique_ptr<const CrsTransform>& transform_out) -> Result<void> {
        auto transform = CrsTransform::create(from, to);
        if (!transform) {
            return fail(ErrorCode::bad_data, "the CRS \"" + dem.crs +
                                                 "\" cannot be converted to longitude and "
                                                 "latitude: " +
                                                 transform.error().message);
        }
        transform_out = *std::move(transform);
        return {};
    };
    TERRANE_TRY(open(*plan, *wgs84, state->wgs84_from_crs));
    TERRANE_TRY(open(*wgs84, *plan, state->crs_from_wgs84));
    state->frame = internal::world_frame_of(dem);
    const internal::CrsRect rect{dem.centre_x, dem.centre_y,
                                 0.5 * dem.columns * dem.cell_x / dem.metres_per_unit_x,
                                 0.5 * dem.rows * dem.cell_y / dem.metres_per_unit_y};
    if (!dem.geographic && !is_local) {
        state->frame.turn = turn_of(*state->wgs84_from_crs, *state->crs_from_wgs84, rect);
    }
    read_vertical(*crs, *state);
    open_heights(*crs, rect, *state);
    return Georeference(state);
}

void Georeference::crs_from_world(std::span<const WorldPos> world,
                                  std::span<Eigen::Vector3d> crs_out) const {
    TERRANE_ASSERT(world.size() == crs_out.size(), "arrays of positions must have equal sizes");
    const internal::WorldFrame& frame = state_->frame;
    for (std::size_t i = 0; i < world.size(); ++i) {
        WorldPos p = world[i];
        if (state_->tangent) {
            auto place = state_->tangent->geodetic_from_world(p);
            const double height = std::exchange(place.height, 0.0);
            p = state_->tangent->world_from_geodetic(place);
            p.z() = height;
        }
        crs_out[i] = {frame.crs_x_of(p.x()), frame.crs_y_of(p.y()), p.z()};
    }
}

void Georeference::world_from_crs(std::span<const Eigen::Vector3d> crs,
                                  std::span<WorldPos> world_out) const {
    TERRANE_ASSERT(crs.size() == world_out.size(), "arrays of positions must have equal sizes");
    for (std::size_t i = 0; i < crs.size(); ++i) {
        const Eigen::Vector3d p = crs[i];
        if (state_->tangent) {
            const auto foot = state_->tangent->foot(p.x(), p.y());
            world_out[i] = WorldPos(p.x(), p.y(), foot.z) + p.z() * foot.normal;
            continue;
        }
        world_out[i] = {state_->frame.x_of(p.x()), state_->frame.y_of(p.y()), p.z()};
    }
}

void Georeference::lonlat_from_world(std::span<const WorldPos> world,
                                     std::span<Eigen::Vector3d> lonlat_out) const {
    in_pieces(world, lonlat_out, [this](auto from, auto to) {
        Columns plan(from.size());
        for (std::size_t i = 0; i < from.size(); ++i) {
            const bool is_place = from[i].template head<2>().allFinite();
            plan.set(i,
                     is_place ? state_->plan_from_world(from[i]) : Eigen::Vector3d::Constant(kNan));
        }
        Columns high = plan;
        state_->wgs84_from_crs->apply(plan.x, plan.y);
        if (state_->ellipsoid_from_crs) {
            for (double& z : high.z) z /= state_->vertical_metres;
            state_->ellipsoid_from_crs->apply(high.x, high.y, high.z);
        }
        for (std::size_t i = 0; i < from.size(); ++i) {
            const bool is_place = std::fabs(plan.y[i]) <= 90.0;
            to[i] = is_place
                        ? Eigen::Vector3d(std::remainder(plan.x[i], 360.0), plan.y[i], high.z[i])
                        : Eigen::Vector3d::Constant(kNan);
        }
    });
}

void Georeference::world_from_lonlat(std::span<const Eigen::Vector3d> lonlat,
                                     std::span<WorldPos> world_out) const {
    in_pieces(lonlat, world_out, [this](auto from, auto to) {
        Columns plan(from.size());
        for (std::size_t i = 0; i < from.size(); ++i) {
            const Eigen::Vector3d& p = from[i];
            const bool is_place = std::fabs(p.x()) <= kMostLongitude && std::fabs(p.y()) <= 90.0;
            plan.set(i, is_place ? Eigen::Vector3d(std::remainder(p.x(), 360.0), p.y(), p.z())
                                 : Eigen::Vector3d::Constant(kNan));
        }
        Columns high = plan;
        state_->crs_from_wgs84->apply(plan.x, plan.y);
        if (state_->crs_from_ellipsoid) {
            state_->crs_from_ellipsoid->apply(high.x, high.y, high.z);
            for (double& z : high.z) z *= state_->vertical_metres;
        }
        for (std::size_t i = 0; i < from.size(); ++i) {
            to[i] = state_->world_from_plan({plan.x[i], plan.y[i], high.z[i]});
        }
    });
}

Eigen::Vector3d Georeference::lonlat_from_world(const WorldPos& p_world) const {
    Eigen::Vector3d lonlat;
    lonlat_from_world({&p_world, 1}, {&lonlat, 1});
    return lonlat;
}
WorldPos Georeference::world_from_lonlat(const Eigen::Vector3d& lonlat) const {
    WorldPos p_world;
    world_from_lonlat({&lonlat, 1}, {&p_world, 1});
    return p_world;
}
Eigen::Vector3d Georeference::crs_from_world(const WorldPos& p_world) const {
    Eigen::Vector3d p_crs;
    crs_from_world({&p_world, 1}, {&p_crs, 1});
    return p_crs;
}
WorldPos Georeference::world_from_crs(const Eigen::Vector3d& p_crs) const {
    WorldPos p_world;
    world_from_crs({&p_crs, 1}, {&p_world, 1});
    return p_world;
}

PlaneScale Georeference::scale_at(double x, double y) const {
    PlaneScale scale{kNan, kNan, kNan};
    // A short step where a long one, which rounds less, leaves the projection.
    for (const double step : {1000.0, 10.0}) {
        std::array<Eigen::Vector3d, 5> places{
            WorldPos(x, y, 0.0), WorldPos(x + step, y, 0.0), WorldPos(x - step, y, 0.0),
            WorldPos(x, y + step, 0.0), WorldPos(x, y - step, 0.0)};
        lonlat_from_world(places, places);
        const double longitude = places[0].x() * kDegree, latitude = places[0].y() * kDegree;
        for (Eigen::Vector3d& p : places) {
            p = internal::point_on({}, p.x() * kDegree, p.y() * kDegree);
        }
        const Eigen::Vector3d along_x = (places[1] - places[2]) / (2.0 * step);
        const Eigen::Vector3d along_y = (places[3] - places[4]) / (2.0 * step);
        const Eigen::Vector3d east(-std::sin(longitude), std::cos(longitude), 0.0);
        const Eigen::Vector3d north(-std::sin(latitude) * std::cos(longitude),
                                    -std::sin(latitude) * std::sin(longitude), std::cos(latitude));
        if (!along_x.allFinite() || !along_y.allFinite() || !places[0].allFinite()) continue;
        scale.x = along_x.norm();
        scale.y = along_y.norm();
        // The world direction that leads north: its eastward part vanishes.
        const double turned = std::copysign(
            1.0, along_x.dot(east) * along_y.dot(north) - along_x.dot(north) * along_y.dot(east));
        scale.convergence = std::atan2(turned * along_y.dot(east), turned * along_x.dot(east));
        break;
    }
    return scale;
}

double Georeference::geodesic_length(const WorldPos& a_world, const WorldPos& b_world) const {
    std::array<Eigen::Vector3d, 2> places{a_world, b_world};
    lonlat_from_world(places, places);
    if (!places[0].head<2>().allFinite() || !places[1].head<2>().allFinite()) return kNan;
    return vincenty_length(places[0], places[1]);
}

HeightReference Georeference::height_reference() const { return state_->height_reference; }
bool Georeference::has_ellipsoidal_heights() const { return state_->ellipsoid_from_crs != nullptr; }
const std::string& Georeference::describe_heights() const { return state_->heights; }

}  // namespace terrane
