// SPDX-License-Identifier: MIT
#include "raster_files.h"

#include <terrane/dem/georeference.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <ostream>
#include <thread>

namespace terrane::test {
namespace georeference_test {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegree = std::numbers::pi / 180.0;

/// A flat raster of 61 x 61 samples around a place of a CRS.
struct MapCase {
    const char* name;
    const char* crs;
    double x, y;            ///< its middle
    double cell_x, cell_y;  ///< units of the CRS
};
void PrintTo(const MapCase& map, std::ostream* out) { *out << map.name; }

RasterSpec spec_of(const MapCase& map) {
    RasterSpec spec;
    spec.columns = spec.rows = 61;
    spec.crs = map.crs;
    spec.transform = {map.x - 30.5 * map.cell_x, map.cell_x, 0.0,
                      map.y + 30.5 * map.cell_y, 0.0,        -map.cell_y};
    spec.value = [](int column, int) { return column; };
    return spec;
}

DemInfo info_of(const MapCase& map) { return open_dem(spec_of(map)).info; }

Georeference georeference_of(const DemInfo& dem) {
    auto made = Georeference::create(dem);
    EXPECT_TRUE(made.has_value()) << made.error().message;
    return std::move(made).value();
}

// Oracle: a point of the ellipsoid of WGS 84 at lon, lat, in Cartesian coordinates, and back to the nearest point of
// the ellipsoid by Newton's iteration on the latitude.
constexpr double kA = 6378137.0, kE2 = 6.69437999014e-3;

Eigen::Vector3d cartesian(double longitude_deg, double latitude_deg) {
    const double l = longitude_deg * kDegree, p = latitude_deg * kDegree;
    const double n = kA / std::sqrt(1.0 - kE2 * std::sin(p) * std::sin(p));
    return {n * std::cos(p) * std::cos(l), n * std::cos(p) * std::sin(l),
            n * (1.0 - kE2) * std::sin(p)};
}

Eigen::Vector3d nearest_on_ellipsoid(const Eigen::Vector3d& c) {
    const double r = std::hypot(c.x(), c.y());
    double p = std::atan2(c.z(), r * (1.0 - kE2));
    for (int i = 0; i < 20; ++i) {
        const double n = kA / std::sqrt(1.0 - kE2 * std::sin(p) * std::sin(p));
        p = std::atan2(c.z() + kE2 * n * std::sin(p), r);
    }
    return cartesian(std::atan2(c.y(), c.x()) / kDegree, p / kDegree);
}

// Length of the geodesic: the shortest chain of chords over points of the ellipsoid, which are moved to the middle
// between their neighbours, from few points to many.
double oracle_length(const Eigen::Vector3d& lonlat_a, const Eigen::Vector3d& lonlat_b, int pieces) {
    std::vector<Eigen::Vector3d> chain{cartesian(lonlat_a.x(), lonlat_a.y()),
                                       cartesian(lonlat_b.x(), lonlat_b.y())};
    while (static_cast<int>(chain.size()) <= pieces) {
        std::vector<Eigen::Vector3d> finer{chain.front()};
        for (std::size_t i = 1; i < chain.size(); ++i) {
            finer.push_back(nearest_on_ellipsoid(0.5 * (chain[i - 1] + chain[i])));
            finer.push_back(chain[i]);
        }
        chain = finer;
        for (int turn = 0; turn < 12; ++turn) {
            for (std::size_t i = 1; i + 1 < chain.size(); ++i) {
                chain[i] = nearest_on_ellipsoid(0.5 * (chain[i - 1] + chain[i + 1]));
            }
        }
    }
    double length = 0.0;
    for (std::size_t i = 1; i < chain.size(); ++i) length += (chain[i] - chain[i - 1]).norm();
    // Chords of n pieces are short by 1 / (24 n^2) of the squared angle.
    const double angle = length / 6.37e6 / static_cast<double>(chain.size() - 1);
    return length * (1.0 + angle * angle / 24.0);
}

const MapCase kMaps[] = {
    {"utm", "EPSG:32632", 690000.0, 5300000.0, 500.0, 500.0},
    {"degrees_at_60_north", "EPSG:4326", 10.0, 60.0, 0.01, 0.005},
    {"web_mercator", "EPSG:3857", 1.2e6, 8.3e6, 1000.0, 1000.0},
    {"lambert_conformal", "EPSG:2154", 900000.0, 6300000.0, 600.0, 600.0},
    {"polar_stereographic", "EPSG:3413", -400000.0, -900000.0, 900.0, 900.0},
    {"gon_from_paris", "EPSG:4807", 0.1, 54.3, 0.012, 0.008},
    {"south_pole", "EPSG:3031", 0.0, 0.0, 1000.0, 1000.0},
    {"world_mercator", "EPSG:3395", -7.0e6, 5.0e6, 800.0, 800.0},
    {"plate_carree", "EPSG:32662", 2.0e6, 6.0e6, 900.0, 900.0},
    {"albers", "EPSG:5070", -300000.0, 1400000.0, 1000.0, 1000.0},
    {"feet", "EPSG:2229", 6.5e6, 1.8e6, 2000.0, 2000.0},
    {"antimeridian", "EPSG:4326", 180.0, -17.0, 0.008, 0.008},
    {"to_360_degrees", "EPSG:4326", 359.9, 45.0, 0.01, 0.01},
    {"mercator_over_the_antimeridian", "EPSG:3857", 20037508.0, 2.0e6, 900.0, 900.0},
    {"intl_1924", "EPSG:23031", 500000.0, 4500000.0, 500.0, 500.0},
};

class GeoreferenceOf : public ::testing::TestWithParam<MapCase> {};
INSTANTIATE_TEST_SUITE_P(Maps, GeoreferenceOf, ::testing::ValuesIn(kMaps),
                         [](const auto& map) { return std::string(map.param.name); });

TEST_P(GeoreferenceOf, LengthsOf20KmAreWithinTheScaleError) {
    const DemInfo dem = info_of(GetParam());
    const Georeference georeference = georeference_of(dem);
    const double half_x = 0.5 * dem.columns * dem.cell_x, half_y = 0.5 * dem.rows * dem.cell_y;
    std::mt19937 random(7);
    double worst = 0.0;
    int compared = 0;
    for (int i = 0; i < 2000; ++i) {
        const double turn = 2.0 * std::numbers::pi * random_unit(random);
        // Half of the lines lie along an edge, where lengths are worst.
        const auto anywhere = [&](double half) {
            const double share = random_unit(random);
            return half * (i % 2 == 0 ? 2.0 * share - 1.0 : share < 0.5 ? -1.0 : 1.0);
        };
        const WorldPos a(anywhere(half_x), anywhere(half_y), 0.0);
        const double length = i % 3 == 0 ? 1000.0 : 20'000.0;
        const WorldPos b = a + length * WorldPos(std::cos(turn), std::sin(turn), 0.0);
        if (std::fabs(b.x()) > half_x || std::fabs(b.y()) > half_y) continue;
        const double truth =
            oracle_length(georeference.lonlat_from_world(a), georeference.lonlat_from_world(b), 8);
        const double error = std::fabs(length / truth - 1.0);
        worst = std::max(worst, error);
        ASSERT_LE(error, dem.scale_error) << a.transpose() << " to " << b.transpose();
        ASSERT_NEAR(georeference.geodesic_length(a, b), truth, 1e-4);
        ++compared;
    }
    EXPECT_GT(compared, 500);
    std::printf("scale_error %.3g, worst found %.3g\n", dem.scale_error, worst);
    EXPECT_LT(dem.scale_error, 1.3 * worst + 1.2e-4) << "the bound is loose";
}

TEST_P(GeoreferenceOf, PositionsReturnFromLongitudeAndLatitude) {
    const DemInfo dem = info_of(GetParam());
    const Georeference georeference = georeference_of(dem);
    std::vector<WorldPos> world;
    std::mt19937 random(3);
    for (int i = 0; i < 9000; ++i) {  // more than a piece
        world.emplace_back((random_unit(random) - 0.5) * dem.columns * dem.cell_x,
                           (random_unit(random) - 0.5) * dem.rows * dem.cell_y, 0.1 * i);
    }
    std::vector<Eigen::Vector3d> lonlat(world.size());
    georeference.lonlat_from_world(world, lonlat);
    for (const Eigen::Vector3d& p : lonlat) {
        ASSERT_LE(std::fabs(p.x()), 180.0);
        ASSERT_LE(std::fabs(p.y()), 90.0);
    }
    std::vector<WorldPos> again = lonlat;
    georeference.world_from_lonlat(again, again);  // in place
    for (std::size_t i = 0; i < world.size(); ++i) {
        // A change of datum is inverted to millimetres.
        ASSERT_LT((again[i] - world[i]).norm(), 5e-3) << world[i].transpose();
        ASSERT_EQ(again[i].z(), world[i].z());
        const Eigen::Vector3d turned = lonlat[i] + Eigen::Vector3d(360.0, 0.0, 0.0);
        if (i % 100 == 0) {
            ASSERT_LT((georeference.world_from_lonlat(turned) - world[i]).norm(), 5e-3);
        }
    }
    EXPECT_EQ(georeference.lonlat_from_world(world[5]), lonlat[5]);
    std::vector<Eigen::Vector3d> crs(world.size());
    georeference.crs_from_world(world, crs);
    georeference.world_from_crs(crs, again);
    for (std::size_t i = 0; i < world.size(); ++i) ASSERT_LT((again[i] - world[i]).norm(), 1e-6);
}

TEST_P(GeoreferenceOf, NorthLiesAtTheConvergence) {
    const DemInfo dem = info_of(GetParam());
    const Georeference georeference = georeference_of(dem);
    for (const WorldPos& p : {WorldPos(1000, 2000, 0), WorldPos(-9000, 8000, 0)}) {
        const PlaneScale scale = georeference.scale_at(p.x(), p.y());
        const double step = 20.0;
        const WorldPos north =
            p + step * WorldPos(-std::sin(scale.convergence), std::cos(scale.convergence), 0.0);
        const Eigen::Vector3d from = georeference.lonlat_from_world(p),
                              to = georeference.lonlat_from_world(north);
        EXPECT_GT(to.y(), from.y());
        const double sideways =
            std::remainder(to.x() - from.x(), 360.0) * kDegree * std::cos(from.y() * kDegree) * kA;
        EXPECT_NEAR(sideways, 0.0, 2e-3);
        const auto measured = [&](const WorldPos& along) {
            return georeference.geodesic_length(p - 100.0 * along, p + 100.0 * along) / 200.0;
        };
        EXPECT_NEAR(scale.x, measured(WorldPos::UnitX()), 1e-6);
        EXPECT_NEAR(scale.y, measured(WorldPos::UnitY()), 1e-6);
    }
}

TEST(Georeference, KnowsPlacesOfOtherDatumsUnitsAndMeridians) {
    struct Place {
        MapCase map;
        double longitude, latitude;
    };
    // From EPSG guidance note 7-2 and the definitions of the CRS
    const Place places[] = {
        {{"utm", "EPSG:32632", 500000.0, 5000000.0, 10.0, 10.0}, 9.0, 45.153477},
        {{"paris", "EPSG:4807", 0.0, 54.0, 0.001, 0.001}, 2.3365, 48.6000},
        {{"osgb", "EPSG:27700", 577274.99, 69740.50, 10.0, 10.0}, 0.49829, 50.50055},
        {{"web mercator", "EPSG:3857", -11169055.58, 2800000.0, 10.0, 10.0},
         -100.3333333,
         24.381787},
        {{"polar", "EPSG:3031", 0.0, 0.0, 10.0, 10.0}, kNan, -90.0},
    };
    for (const Place& place : places) {
        SCOPED_TRACE(place.map.name);
        const Georeference georeference = georeference_of(info_of(place.map));
        const Eigen::Vector3d lonlat = georeference.lonlat_from_world(WorldPos::Zero());
        if (!std::isnan(place.longitude)) {
            EXPECT_NEAR(lonlat.x(), place.longitude, 2e-4);
        }
        EXPECT_NEAR(lonlat.y(), place.latitude, 1e-4);
        const Eigen::Vector3d crs = georeference.crs_from_world(WorldPos::Zero());
        EXPECT_NEAR(crs.x(), place.map.x, 1e-6);
        EXPECT_NEAR(crs.y(), place.map.y, 1e-6);
    }
}

TEST(Georeference, MercatorsMetresAreTrueAtTheMiddleOfARaster) {
    for (const char* crs :
         {"EPSG:3857", "EPSG:900913", "ESRI:102100", "EPSG:3785", "EPSG:3395",
          "+proj=merc +a=6378137 +b=6378137 +lat_ts=0 +units=m +nadgrids=@null +no_defs"}) {
        SCOPED_TRACE(crs);
        const MapCase map{"", crs, 1.0e6, 8399737.9, 100.0, 100.0};
        const OpenedDem dem = open_dem(spec_of(map));
        EXPECT_THAT(dem.info.notes, ::testing::Contains(HasSubstr("not true lengths")));
        const PlaneScale scale = georeference_of(dem.info).scale_at(0.0, 0.0);
        // A sphere stands for the ellipsoid in some spellings.
        EXPECT_NEAR(scale.x, 1.0, 4e-3);
        EXPECT_NEAR(scale.y, 1.0, 4e-3);
        if (std::string(crs) == "EPSG:3857") {
            EXPECT_NEAR(scale.x, 1.0, 2e-6);
            EXPECT_NEAR(scale.y, 1.0, 2e-6);
            EXPECT_NEAR(dem.info.cell_x, 50.0, 0.2);
        }
    }
    const DemInfo utm = info_of(kMaps[0]);
    EXPECT_EQ(utm.metres_per_unit_x, 1.0);
    EXPECT_TRUE(utm.notes.empty());
}

std::string wkt_of(const char* crs) {
    OGRSpatialReference reference;
    EXPECT_EQ(reference.SetFromUserInput(crs), OGRERR_NONE);
    char* text = nullptr;
    reference.exportToWkt(&text);
    const std::string wkt = text;
    CPLFree(text);
    return wkt;
}

DemInfo info_with(const char* crs, double x, double y) {
    DemInfo info;
    info.columns = info.rows = 10;
    info.cell_x = info.cell_y = 100.0;
    info.crs = crs;
    info.crs_wkt = wkt_of(crs);
    info.centre_x = x;
    info.centre_y = y;
    return info;
}

TEST(Georeference, TellsHeightsAboveTheEllipsoidFromThoseAboveTheGeoid) {
    const Georeference none = georeference_of(info_with("EPSG:32632", 5e5, 5e6));
    EXPECT_EQ(none.height_reference(), HeightReference::unknown);
    EXPECT_FALSE(none.has_ellipsoidal_heights());
    EXPECT_THAT(none.describe_heights(), HasSubstr("unknown"));
    EXPECT_EQ(none.lonlat_from_world({0, 0, 123.0}).z(), 123.0);

    DemInfo degrees = info_with("EPSG:4979", 9.0, 45.0);
    degrees.geographic = true;
    degrees.metres_per_unit_x = degrees.metres_per_unit_y = 1e5;
    const Georeference satellite = georeference_of(degrees);
    EXPECT_EQ(satellite.height_reference(), HeightReference::ellipsoidal);
    EXPECT_TRUE(satellite.has_ellipsoidal_heights());
    EXPECT_NEAR(satellite.lonlat_from_world({0, 0, 123.0}).z(), 123.0, 1e-6);

    // No grid for it is in Debian's proj-data.
    const Georeference kronstadt = georeference_of(info_with("EPSG:32632+5705", 5e5, 5e6));
    EXPECT_EQ(kronstadt.height_reference(), HeightReference::orthometric);
    EXPECT_FALSE(kronstadt.has_ellipsoidal_heights());
    EXPECT_THAT(kronstadt.describe_heights(), HasSubstr("unknown"));
    EXPECT_EQ(kronstadt.lonlat_from_world({0, 0, 123.0}).z(), 123.0);

    const Georeference egm96 = georeference_of(info_with("EPSG:32632+5773", 5e5, 5e6));
    EXPECT_EQ(egm96.height_reference(), HeightReference::orthometric);
    EXPECT_THAT(egm96.describe_heights(), HasSubstr("EGM96"));
    if (!egm96.has_ellipsoidal_heights()) GTEST_SKIP() << "PROJ's grid of EGM96 is not installed";
    // The geoid is 41.5 m above the ellipsoid at 9 E, 45.15 N.
    EXPECT_NEAR(egm96.lonlat_from_world({0, 0, 100.0}).z(), 141.5, 0.5);
    EXPECT_NEAR(egm96.world_from_lonlat({9.0, 45.153477, 141.5}).z(), 100.0, 0.5);
    const Eigen::Vector3d without = egm96.lonlat_from_world({0, 0, kNan});
    EXPECT_NEAR(without.x(), 9.0, 1e-9);
    EXPECT_TRUE(std::isnan(without.z()));
}

TEST(Georeference, PlacesWithoutACounterpartAreNan) {
    const Georeference utm = georeference_of(info_of(kMaps[0]));
    const Georeference degrees = georeference_of(info_of(kMaps[1]));
    const Georeference mercator = georeference_of(info_of(kMaps[2]));
    const double infinite = std::numeric_limits<double>::infinity();
    for (const Georeference* georeference : {&utm, &degrees, &mercator}) {
        for (const Eigen::Vector3d& lonlat :
             {Eigen::Vector3d(kNan, 60, 0), Eigen::Vector3d(10, kNan, 0),
              Eigen::Vector3d(10, 91, 0), Eigen::Vector3d(10, -90.001, 0),
              Eigen::Vector3d(721, 60, 0), Eigen::Vector3d(infinite, 60, 0)}) {
            EXPECT_TRUE(georeference->world_from_lonlat(lonlat).head<2>().hasNaN())
                << lonlat.transpose();
        }
        for (const WorldPos& p : {WorldPos(kNan, 0, 0), WorldPos(0, infinite, 0)}) {
            EXPECT_TRUE(georeference->lonlat_from_world(p).head<2>().hasNaN()) << p.transpose();
            EXPECT_TRUE(std::isnan(georeference->scale_at(p.x(), p.y()).x));
            EXPECT_TRUE(std::isnan(georeference->geodesic_length(p, WorldPos::Zero())));
        }
    }
    // Beyond the pole; and one good place among bad ones stays good.
    EXPECT_TRUE(degrees.lonlat_from_world({0, 4e6, 0}).hasNaN());
    std::vector<Eigen::Vector3d> mixed{{10, 91, 0}, {10, 60, 7}, {kNan, 60, 0}};
    degrees.world_from_lonlat(mixed, mixed);
    EXPECT_NEAR(mixed[1].head<2>().norm(), 0.0, 1e-6);
    EXPECT_EQ(mixed[1].z(), 7.0);
    EXPECT_TRUE(mixed[0].hasNaN() && mixed[2].hasNaN());
}

TEST(Georeference, LongGeodesicsAreAsLongAsTheShortestChain) {
    MapCase world{"", "EPSG:4326", 0.0, 0.0, 5.9, 2.5};
    const DemInfo dem = info_of(world);
    const Georeference georeference = georeference_of(dem);
    for (const auto& [a, b] : {std::pair{Eigen::Vector3d(2, 48, 0), Eigen::Vector3d(-74, 40, 0)},
                               std::pair{Eigen::Vector3d(170, 10, 0), Eigen::Vector3d(-170, -5, 0)},
                               std::pair{Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(90, 0, 0)}}) {
        const double length = georeference.geodesic_length(georeference.world_from_lonlat(a),
                                                           georeference.world_from_lonlat(b));
        EXPECT_NEAR(length, oracle_length(a, b, 256), 2e-5 * length);
    }
    const WorldPos equator = georeference.world_from_lonlat({0, 0, 0});
    EXPECT_EQ(georeference.geodesic_length(equator, equator), 0.0);
    EXPECT_TRUE(std::isnan(
        georeference.geodesic_length(equator, georeference.world_from_lonlat({179.8, 0.1, 0}))));
}

TEST(Georeference, IsRefusedWithoutAPlaceOnTheEarth) {
    DemInfo info = info_with("EPSG:32632", 5e5, 5e6);
    info.crs_wkt = "LOCAL_CS[\"a mine\",UNIT[\"metre\",1]]";
    info.crs = "a mine";
    auto made = Georeference::create(info);
    ASSERT_FALSE(made.has_value());
    EXPECT_EQ(made.error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(made.error().message, "the CRS \"a mine\" has no longitudes and latitudes");
    info.crs_wkt = wkt_of("EPSG:4978");
    EXPECT_FALSE(Georeference::create(info).has_value());
    info.crs_wkt = "no CRS at all";
    EXPECT_FALSE(Georeference::create(info).has_value());
    made = Georeference::create(DemInfo{});
    ASSERT_FALSE(made.has_value());
    EXPECT_EQ(made.error().message, "the raster has no CRS");
}

TEST(Georeference, GivesTheSameAnswersOnManyThreads) {
    const Georeference georeference = georeference_of(info_of(kMaps[3]));
    const std::vector<WorldPos> world(20'000, WorldPos(1000, 2000, 3));
    const Eigen::Vector3d expected = georeference.lonlat_from_world(world[0]);
    std::vector<std::thread> threads;
    std::array<int, 4> wrong{};
    for (int& count : wrong) {
        threads.emplace_back([&count, georeference, &world, expected] {
            std::vector<Eigen::Vector3d> lonlat(world.size());
            georeference.lonlat_from_world(world, lonlat);
            for (const Eigen::Vector3d& p : lonlat) count += p == expected ? 0 : 1;
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_THAT(wrong, ::testing::Each(0));
}

}  // namespace georeference_test
}  // namespace terrane::test
