// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"

#include <terrane/dem/georeference.h>
#include <terrane/terrain/check_source.h>

#include <gdal_alg.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <ostream>
#include <random>
#include <string>
#include <vector>

namespace terrane::test {
namespace resampled_test {

constexpr double kDegree = std::numbers::pi / 180.0;

/// Positions on the ellipsoid of a CRS by formulas of their own: geocentric, from places of a raster.
class Earth {
public:
    explicit Earth(const std::string& name) {
        crs_.SetFromUserInput(name.c_str());
        crs_.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
        degrees_.reset(crs_.CloneGeogCS());
        degrees_->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
        transform_.reset(OGRCreateCoordinateTransformation(&crs_, degrees_.get()));
    }

    /// Longitude and latitude, radians.
    std::array<double, 2> lonlat(double x, double y) const {
        if (crs_.IsGeographic() == 0) {
            EXPECT_TRUE(transform_->Transform(1, &x, &y));
        }
        return {x * degrees_->GetAngularUnits(), y * degrees_->GetAngularUnits()};
    }
    Eigen::Vector3d geocentric(const std::array<double, 2>& lonlat, double height) const {
        const double a = degrees_->GetSemiMajor(), b = degrees_->GetSemiMinor();
        const double e2 = 1.0 - b * b / (a * a), sine = std::sin(lonlat[1]);
        const double n = a / std::sqrt(1.0 - e2 * sine * sine);
        return {(n + height) * std::cos(lonlat[1]) * std::cos(lonlat[0]),
                (n + height) * std::cos(lonlat[1]) * std::sin(lonlat[0]),
                (n * (1.0 - e2) + height) * sine};
    }

private:
    OGRSpatialReference crs_;
    std::unique_ptr<OGRSpatialReference> degrees_;
    std::unique_ptr<OGRCoordinateTransformation> transform_;
};

/// A raster with the heights from which it was written, by row from the north.
struct Oracle {
    RasterSpec spec;
    std::vector<double> heights;
    bool is_local = false;

    double sample(int column, int row) const {
        column = std::clamp(column, 0, spec.columns - 1);
        row = std::clamp(row, 0, spec.rows - 1);
        return heights[static_cast<std::size_t>(row * spec.columns + column)];
    }
    /// The raster's own surface at pixel coordinates, of which (0, 0) is the corner; NaN beside a void.
    double surface(double u, double v) const {
        const double c = std::floor(u - 0.5), r = std::floor(v - 0.5);
        const double fu = u - 0.5 - c, fv = v - 0.5 - r;
        const int column = static_cast<int>(c), row = static_cast<int>(r);
        return (1 - fv) * ((1 - fu) * sample(column, row) + fu * sample(column + 1, row)) +
               fv * ((1 - fu) * sample(column, row + 1) + fu * sample(column + 1, row + 1));
    }
    std::array<double, 2> in_crs(double u, double v) const {
        const std::array<double, 6>& t = spec.transform;
        return {t[0] + u * t[1] + v * t[2], t[3] + u * t[4] + v * t[5]};
    }
    /// World position of a point of the raster's surface.
    Eigen::Vector3d world(const Earth& earth, const DemInfo& info, double u, double v) const {
        const double h = surface(u, v);
        const auto p = in_crs(u, v);
        if (!is_local) {
            return {(p[0] - info.centre_x) * info.metres_per_unit_x,
                    (p[1] - info.centre_y) * info.metres_per_unit_y, h};
        }
        const auto m = in_crs(0.5 * spec.columns, 0.5 * spec.rows);
        const auto middle = earth.lonlat(m[0], m[1]);
        const Eigen::Vector3d from_middle =
            earth.geocentric(earth.lonlat(p[0], p[1]), h) - earth.geocentric(middle, 0.0);
        const double sin_lon = std::sin(middle[0]), cos_lon = std::cos(middle[0]);
        const double sin_lat = std::sin(middle[1]), cos_lat = std::cos(middle[1]);
        return {from_middle.dot(Eigen::Vector3d(-sin_lon, cos_lon, 0.0)),
                from_middle.dot(Eigen::Vector3d(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat)),
                from_middle.dot(Eigen::Vector3d(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat))};
    }
};

/// Noise from sample to sample over waves, with voids of one sample to a few.
Oracle rough(RasterSpec spec, double noise_m, double void_share, unsigned seed) {
    Oracle oracle;
    std::mt19937 random(seed);
    const auto columns = static_cast<std::size_t>(spec.columns);
    oracle.heights.resize(columns * static_cast<std::size_t>(spec.rows));
    for (std::size_t i = 0; i < oracle.heights.size(); ++i) {
        const std::size_t row_index = i / columns;
        const auto column = static_cast<double>(i % columns), row = static_cast<double>(row_index);
        oracle.heights[i] = 900.0 + 5.0 * noise_m * std::sin(0.13 * column) * std::cos(0.11 * row) +
                            noise_m * (2.0 * random_unit(random) - 1.0);
        oracle.heights[i] = static_cast<double>(static_cast<float>(oracle.heights[i]));
        if (random_unit(random) < void_share) oracle.heights[i] = std::nan("");
    }
    spec.value = [heights = oracle.heights, columns](int column, int row) {
        return heights[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)];
    };
    oracle.spec = std::move(spec);
    return oracle;
}

DemSettings settings_of(DemProjection projection, double cell = 0.0) {
    DemSettings settings;
    settings.projection = projection;
    settings.cell = cell;
    return settings;
}

/// The contact surface of the finest level, without its rounding to quanta.
struct Cell {
    double height = 0.0, bound = 0.0;
    std::uint8_t flags = 0;
};
Cell cell_at(const HeightSource& source, double x, double y) {
    const Lattice& lattice = source.lattice();
    const double u = (x - lattice.origin_x) / lattice.spacing;
    const double v = (y - lattice.origin_y) / lattice.spacing;
    const auto column = static_cast<std::int64_t>(std::floor(u));
    const auto row = static_cast<std::int64_t>(std::floor(v));
    const SampleGrid grid{{column, row}, 1, 2, 2};
    std::array<double, 4> z{};
    std::array<float, 1> bound{};
    std::array<std::uint8_t, 1> flags{};
    EXPECT_TRUE(source.sample(grid, z));
    EXPECT_TRUE(source.cell_bounds(grid, bound));
    EXPECT_TRUE(source.cell_flags(grid, flags));
    const double s = u - static_cast<double>(column), t = v - static_cast<double>(row);
    Cell cell;
    // Cells with an even index sum are cut from the south-west to the north-east.
    if (((column + row) & 1) == 0) {
        cell.height = s > t ? z[0] + s * (z[1] - z[0]) + t * (z[3] - z[1])
                            : z[0] + t * (z[2] - z[0]) + s * (z[3] - z[2]);
    } else {
        cell.height = s + t < 1.0 ? z[0] + s * (z[1] - z[0]) + t * (z[2] - z[0])
                                  : z[3] + (1 - s) * (z[2] - z[3]) + (1 - t) * (z[1] - z[3]);
    }
    cell.bound = static_cast<double>(bound[0]);
    cell.flags = flags[0];
    return cell;
}

/// Expects 10,000 points of the raster's own surface within the certified bound of the ground there.
///
/// @return the greatest error relative to its bound
double expect_within_bounds(const Oracle& oracle, DemSettings settings, unsigned seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    settings.projection = oracle.is_local ? DemProjection::local : DemProjection::own;
    const auto [source, info] = open_dem(oracle.spec, settings);
    const Earth earth(oracle.spec.crs);
    const bool is_whole =
        std::ranges::none_of(oracle.heights, [](double h) { return std::isnan(h); });
    std::mt19937 random(seed);
    double tightest = 0.0;
    int compared = 0;
    constexpr int kPoints = 10000;
    for (int i = 0; i < kPoints; ++i) {
        double u = random_unit(random) * oracle.spec.columns;
        double v = random_unit(random) * oracle.spec.rows;
        if (i % 8 == 0) u = std::floor(u) + 0.5;  // on the raster's lines
        if (i % 16 == 0) v = std::floor(v) + 0.5;
        if (i % 16 == 1) u = random_unit(random) * 1e-3;  // at its edges
        if (i % 16 == 2) v = oracle.spec.rows - random_unit(random) * 1e-3;
        const Eigen::Vector3d wanted = oracle.world(earth, info, u, v);
        if (std::isnan(wanted.z())) continue;
        const Cell cell = cell_at(*source, wanted.x(), wanted.y());
        if (!is_whole && cell.flags != 0) continue;  // voids, and nodata that reaches the edge
        EXPECT_EQ(cell.flags, 0) << "pixel " << u << ", " << v;
        const double error = std::fabs(cell.height - wanted.z());
        EXPECT_LE(error, cell.bound) << "pixel " << u << ", " << v;
        tightest = std::max(tightest, error / cell.bound);
        ++compared;
        if (testing::Test::HasFailure()) break;
    }
    EXPECT_GT(compared, kPoints / 4);
    return tightest;
}

/// A raster turned by an angle, with oblong or sheared cells.
RasterSpec turned(double degrees, double cell_x, double cell_y, double shear = 0.0) {
    const double c = std::cos(degrees * kDegree), s = std::sin(degrees * kDegree);
    RasterSpec spec{.columns = 90, .rows = 70};
    spec.transform = {300000.0, c * cell_x, s * cell_y + shear, 5000000.0, s * cell_x, -c * cell_y};
    return spec;
}

TEST(ResampledRaster, RotatedRoughRastersAreWithinTheirBounds) {
    unsigned seed = 1;
    double tightest = 0.0;
    for (const double degrees : {1.0, 30.0, 45.0, 163.0, 271.0}) {
        SCOPED_TRACE(degrees);
        for (const double voids : {0.0, 0.02}) {
            ++seed;
            const Oracle oracle =
                rough(turned(degrees, 10.0, degrees == 30.0 ? 23.0 : 10.0), 40.0, voids, seed);
            tightest = std::max(tightest, expect_within_bounds(oracle, {}, seed));
        }
    }
    expect_within_bounds(rough(turned(0.0, 10.0, 10.0, 7.0), 40.0, 0.0, 99), {}, 99);
    EXPECT_GT(tightest, 0.4);
}

TEST(ResampledRaster, AFinerCellHasASmallerError) {
    const Oracle oracle = rough(turned(30.0, 10.0, 10.0), 10.0, 0.0, 5);
    double error = open_dem(oracle.spec).info.resampling_error;
    for (const double cell : {5.0, 2.5}) {
        const double finer =
            open_dem(oracle.spec, settings_of(DemProjection::own, cell)).info.resampling_error;
        EXPECT_LT(finer, 0.75 * error) << cell;
        error = finer;
    }
    expect_within_bounds(oracle, settings_of(DemProjection::own, 4.0), 6);
}

TEST(ResampledRaster, APlaneIsExactInAnyDirection) {
    Oracle oracle = rough(turned(30.0, 10.0, 17.0), 0.0, 0.0, 1);
    for (std::size_t i = 0; i < oracle.heights.size(); ++i) {
        const std::size_t row_index = i / 90;
        const auto column = static_cast<double>(i % 90), row = static_cast<double>(row_index);
        oracle.heights[i] = 0.25 * column - 3.0 * row;  // exact as floats
    }
    oracle.spec.value = [&](int c, int r) { return oracle.sample(c, r); };
    const auto [source, info] = open_dem(oracle.spec);
    const Earth earth(oracle.spec.crs);
    std::mt19937 random(3);
    for (int i = 0; i < 1000; ++i) {
        // Off the edges, beyond which the surface is level.
        const double u = 3.0 + 84.0 * random_unit(random), v = 3.0 + 64.0 * random_unit(random);
        const Eigen::Vector3d wanted = oracle.world(earth, info, u, v);
        ASSERT_NEAR(source->height(wanted.x(), wanted.y()), wanted.z(), 1e-6);
    }
}

/// Ground control points on a grid, of a raster that is turned and bent, with errors of measurement.
std::vector<std::array<double, 4>> control_points(const RasterSpec& spec, int side, double bend,
                                                  unsigned seed) {
    std::mt19937 random(seed);
    std::vector<std::array<double, 4>> points;
    for (int i = 0; i < side * side; ++i) {
        const double u = spec.columns * (i % side) / (side - 1.0),
                     v = spec.rows * (i / side) / (side - 1.0);
        const auto p = Oracle{spec, {}}.in_crs(u, v);
        points.push_back({u, v, p[0] + bend * u * u + 2.0 * random_unit(random),
                          p[1] + bend * u * v + 2.0 * random_unit(random)});
    }
    return points;
}

TEST(ResampledRaster, RastersPlacedByControlPointsAreWithinTheirBounds) {
    double tightest = 0.0;
    // Four points determine planes, nine and more polynomials of the second order.
    for (const int side : {2, 3, 4}) {
        for (const double voids : {0.0, 0.02}) {
            SCOPED_TRACE(testing::Message() << side * side << " points, voids " << voids);
            RasterSpec spec = turned(25.0, 10.0, 14.0);
            const auto points = control_points(spec, side, 0.01, 3);
            spec.has_place = false;
            const Oracle oracle = rough(spec, 40.0, voids, 7);
            const TemporaryFolder folder;
            const std::string path = folder.file("points.tif");
            write_raster(path, oracle.spec);
            std::vector<GDAL_GCP> gcps(points.size());
            GDALInitGCPs(static_cast<int>(gcps.size()), gcps.data());
            for (std::size_t i = 0; i < gcps.size(); ++i) {
                gcps[i].dfGCPPixel = points[i][0];
                gcps[i].dfGCPLine = points[i][1];
                gcps[i].dfGCPX = points[i][2];
                gcps[i].dfGCPY = points[i][3];
            }
            {
                auto* file = static_cast<GDALDataset*>(GDALOpen(path.c_str(), GA_Update));
                ASSERT_NE(file, nullptr);
                OGRSpatialReference crs;
                crs.SetFromUserInput(spec.crs.c_str());
                ASSERT_EQ(file->SetGCPs(static_cast<int>(gcps.size()), gcps.data(), &crs), CE_None);
                GDALClose(file);
            }
            void* polynomials =
                GDALCreateGCPTransformer(static_cast<int>(gcps.size()), gcps.data(), 0, FALSE);
            ASSERT_NE(polynomials, nullptr);
            const auto [source, info] = open_dem(path);
            EXPECT_GT(info.resampling_error, 0.0);
            EXPECT_NE(info.placement.find(" ground control points, resampled to cells of"),
                      std::string::npos)
                << info.placement;
            std::mt19937 random(11);
            const WorldRect extent = source->extent();
            int compared = 0;
            for (int i = 0; i < 10000; ++i) {
                const double x = extent.west + random_unit(random) * (extent.east - extent.west);
                const double y = extent.south + random_unit(random) * (extent.north - extent.south);
                double u = info.centre_x + x / info.metres_per_unit_x,
                       v = info.centre_y + y / info.metres_per_unit_y, z = 0.0;
                int is_good = FALSE;
                GDALGCPTransform(polynomials, TRUE, 1, &u, &v, &z, &is_good);
                ASSERT_TRUE(is_good);
                if (!(u >= 0.0 && v >= 0.0 && u <= spec.columns && v <= spec.rows)) continue;
                const double wanted = oracle.surface(u, v);
                const Cell cell = cell_at(*source, x, y);
                if (std::isnan(wanted) || (voids > 0.0 && cell.flags != 0)) continue;
                ASSERT_EQ(cell.flags, 0) << "pixel " << u << ", " << v;
                ASSERT_LE(std::fabs(cell.height - wanted), cell.bound)
                    << "pixel " << u << ", " << v;
                tightest = std::max(tightest, std::fabs(cell.height - wanted) / cell.bound);
                ++compared;
            }
            EXPECT_GT(compared, 3000);
            GDALDestroyGCPTransformer(polynomials);
            GDALDeinitGCPs(static_cast<int>(gcps.size()), gcps.data());
        }
    }
    EXPECT_GT(tightest, 0.3);
}

struct Place {
    const char* name;
    const char* crs;
    std::array<double, 6> transform;
};
void PrintTo(const Place& place, std::ostream* out) { *out << place.name; }
constexpr Place kPlaces[] = {
    {"utm", "EPSG:32633", {400000.0, 250.0, 0.0, 6020000.0, 0.0, -250.0}},
    {"degrees", "EPSG:4326", {10.0, 0.004, 0.0, 60.3, 0.0, -0.002}},
    {"mercator", "EPSG:3857", {1500000.0, 400.0, 0.0, 8000000.0, 0.0, -400.0}},
    {"lambert", "EPSG:2154", {700000.0, 250.0, 0.0, 6600000.0, 0.0, -250.0}},
    {"polar", "EPSG:3413", {-20000.0, 300.0, 0.0, 20000.0, 0.0, -300.0}},
    {"gon", "EPSG:4807", {2.0, 0.004, 0.0, 50.0, 0.0, -0.003}},
    {"antimeridian", "EPSG:4326", {179.8, 0.004, 0.0, -17.0, 0.0, -0.004}},
    {"continent", "EPSG:3035", {3300000.0, 20000.0, 0.0, 4100000.0, 0.0, -20000.0}},
    {"coarse", "EPSG:4326", {-40.0, 0.6, 0.0, 75.0, 0.0, -0.5}},
    {"northern_rows", "EPSG:32633", {400000.0, 250.0, 0.0, 6000000.0, 0.0, 250.0}},
    {"rotated", "EPSG:32633", {400000.0, 200.0, 120.0, 6000000.0, 120.0, -200.0}}};

Oracle local(const Place& place, double noise_m, double voids, unsigned seed) {
    RasterSpec spec{.columns = 100, .rows = 110};
    spec.transform = place.transform;
    spec.crs = place.crs;
    Oracle oracle = rough(std::move(spec), noise_m, voids, seed);
    oracle.is_local = true;
    return oracle;
}

class LocalPlane : public testing::TestWithParam<Place> {};

TEST_P(LocalPlane, RoughRastersAreWithinTheirBounds) {
    unsigned seed = 11;
    for (const double voids : {0.0, 0.01}) {
        ++seed;
        expect_within_bounds(local(GetParam(), 60.0, voids, seed), {}, seed);
    }
    expect_within_bounds(local(GetParam(), 1.0, 0.0, 20), {}, 20);
}

TEST_P(LocalPlane, WorldDistancesAreThoseOfGeocentricPositions) {
    const Oracle oracle = local(GetParam(), 60.0, 0.0, 4);
    const auto [source, info] = open_dem(oracle.spec, settings_of(DemProjection::local));
    const auto georeference = Georeference::create(info);
    ASSERT_TRUE(georeference.has_value()) << georeference.error().message;
    const Earth earth(oracle.spec.crs);
    std::mt19937 random(5);
    for (int i = 0; i < 400; ++i) {
        std::array<Eigen::Vector3d, 2> world, chord;
        for (std::size_t end = 0; end < 2; ++end) {
            const double u = random_unit(random) * 100.0, v = random_unit(random) * 110.0;
            const auto p = oracle.in_crs(u, v);
            const auto lonlat = earth.lonlat(p[0], p[1]);
            world[end] = oracle.world(earth, info, u, v);
            chord[end] = earth.geocentric(lonlat, oracle.surface(u, v));
            // The library's own conversion, within the datum: there and back.
            const Eigen::Vector3d there = georeference->lonlat_from_world(world[end]);
            EXPECT_LT((georeference->world_from_lonlat(there) - world[end]).norm(), 0.01);
            if (std::string(GetParam().crs) != "EPSG:4807") {  // its datum is not that of WGS 84
                EXPECT_LT((earth.geocentric({there.x() * kDegree, there.y() * kDegree}, there.z()) -
                           chord[end])
                              .norm(),
                          0.01);
            }
            EXPECT_LT((georeference->world_from_crs(georeference->crs_from_world(world[end])) -
                       world[end])
                          .norm(),
                      1e-4);
        }
        EXPECT_NEAR((world[1] - world[0]).norm(), (chord[1] - chord[0]).norm(), 1e-4);
    }
    const PlaneScale scale = georeference->scale_at(0.0, 0.0);
    if (std::string(GetParam().crs) != "EPSG:4807") {
        EXPECT_NEAR(scale.x, 1.0, 1e-7);
        EXPECT_NEAR(scale.y, 1.0, 1e-7);
    }
    EXPECT_NEAR(scale.convergence, 0.0, std::string(GetParam().name) == "polar" ? 7.0 : 2e-5);
}

INSTANTIATE_TEST_SUITE_P(Places, LocalPlane, testing::ValuesIn(kPlaces),
                         [](const auto& each) { return std::string(each.param.name); });

TEST(ResampledRaster, ObeysTheLawsOfSources) {
    for (const bool is_local : {false, true}) {
        Oracle oracle = is_local ? local(kPlaces[0], 30.0, 0.01, 8)
                                 : rough(turned(30.0, 10.0, 10.0), 30.0, 0.01, 9);
        DemSettings settings;
        settings.projection = is_local ? DemProjection::local : DemProjection::own;
        const auto report = check_source(*open_dem(oracle.spec, settings).source,
                                         {.places = 4, .points = 4, .nesting_slack = 1.0});
        ASSERT_TRUE(report.has_value());
        EXPECT_TRUE(report->is_clean()) << to_text(*report);
    }
}

TEST(ResampledRaster, FarMountainsSinkBehindTheHorizon) {
    RasterSpec spec{.columns = 200, .rows = 200};
    spec.transform = {3300000.0, 10000.0, 0.0, 4200000.0, 0.0, -10000.0};
    spec.crs = "EPSG:3035";
    spec.value = [](int, int) { return 1000.0; };
    const auto [source, info] = open_dem(spec, settings_of(DemProjection::local));
    EXPECT_NEAR(source->height(0.0, 0.0), 1000.0, 5.0);
    // 500 km away the ellipsoid is 19.6 km below the plane, within its flattening.
    const double drop = 6.371e6 - std::sqrt(6.371e6 * 6.371e6 - 25e10);
    EXPECT_NEAR(source->height(5e5, 0.0), 1000.0 * std::cos(0.0785) - drop, 100.0);
}

TEST(ResampledRaster, OnlyThePoleOfARasterInDegreesHasNoGround) {
    RasterSpec spec{.columns = 300, .rows = 30};
    spec.transform = {-150.0, 1.0, 0.0, 90.0, 0.0, -1.0};
    spec.crs = "EPSG:4326";
    spec.value = [](int, int row) { return 10.0 * row; };
    const auto [source, info] = open_dem(spec, settings_of(DemProjection::local));
    // The middle is at longitude 0 and latitude 75: the pole is 15 degrees north of it.
    const double y = 6.39e6 * std::sin(15.0 * kDegree);
    EXPECT_NE(cell_at(*source, 0.0, y).flags, 0);
    EXPECT_EQ(cell_at(*source, 0.0, 0.0).flags, 0);
    EXPECT_EQ(cell_at(*source, 1e6, y).flags, 0);
    EXPECT_EQ(cell_at(*source, -1e6, y).flags, 0);
}

TEST(ResampledRaster, TwoByTwoSamplesAreGround) {
    for (const double degrees : {0.0, 45.0}) {
        RasterSpec spec = turned(degrees, 30.0, 30.0);
        spec.columns = spec.rows = 2;
        Oracle oracle = rough(spec, 20.0, 0.0, 2);
        oracle.is_local = true;
        expect_within_bounds(oracle, {}, 3);
    }
}

TEST(ResampledRaster, ARasterWithoutItsPlaceOnTheEarthIsRefused) {
    const TemporaryFolder folder;
    const auto error_of = [&](const RasterSpec& spec) {
        const std::string path = folder.file("refused.tif");
        write_raster(path, spec);
        const auto opened = DemHeights::open(path, settings_of(DemProjection::local));
        return opened ? std::string("opened") : opened.error().message;
    };
    RasterSpec spec{.columns = 36, .rows = 18};
    spec.value = [](int, int) { return 1.0; };
    spec.crs.clear();
    EXPECT_NE(error_of(spec).find("has no CRS"), std::string::npos) << error_of(spec);
    spec.crs = "LOCAL_CS[\"site\",UNIT[\"metre\",1]]";
    EXPECT_NE(error_of(spec).find("no place on the Earth"), std::string::npos) << error_of(spec);
    spec.crs = "EPSG:4326";
    spec.transform = {-180.0, 10.0, 0.0, 90.0, 0.0, -10.0};
    EXPECT_NE(error_of(spec).find("60 degrees"), std::string::npos) << error_of(spec);
    // A cliff that leans over the plane: 2000 m on 10 m, 20 degrees from the middle.
    spec.columns = 400;
    spec.rows = 4;
    spec.transform = {0.0, 0.1, 0.0, 45.0, 0.0, -0.1};
    spec.value = [](int column, int) { return column == 2 ? 1e5 : 0.0; };
    EXPECT_NE(error_of(spec).find("overhang"), std::string::npos) << error_of(spec);
}

}  // namespace resampled_test
}  // namespace terrane::test
