// SPDX-License-Identifier: MIT
#include "support/random.h"

#include <terrane/adapters/earth_frame.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <ostream>

namespace terrane::adapters {

void PrintTo(EarthMapping mapping, std::ostream* out) {
    *out << (mapping == EarthMapping::tangent_plane ? "tangent_plane" : "plate_carree");
}

namespace earth_frame_test {

constexpr double kPi = std::numbers::pi;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

EarthFrame wgs84() { return EarthFrame::create({}).value(); }

TEST(EarthFrame, HasTheKnownPointsOfTheEllipsoid) {
    const EarthFrame earth = wgs84();
    EXPECT_LT((earth.earth_from_geodetic({0, 0, 0}) - Eigen::Vector3d(6378137, 0, 0)).norm(), 1e-8);
    EXPECT_LT((earth.earth_from_geodetic({kPi / 2, 1.0, 100}) -
               Eigen::Vector3d(0, 0, 6356752.314245179 + 100))
                  .norm(),
              1e-8);
    // 45 degrees: N = a / sqrt(1 - e2 / 2), with e2 of WGS84 as its table has it
    const double e2 = 6.69437999014e-3, n = 6378137.0 / std::sqrt(1.0 - e2 / 2);
    const Eigen::Vector3d p = earth.earth_from_geodetic({kPi / 4, kPi / 2, 0});
    EXPECT_LT((p - Eigen::Vector3d(0, n, n * (1.0 - e2)) * std::sqrt(0.5)).norm(), 1e-4);
}

TEST(EarthFrame, FindsThePlaceAgainAtAnyHeightOnAnyEarth) {
    test::Random random(11);
    for (const double semi_minor : {6378137.0, 6356752.314245179, 0.9 * 6378137.0}) {
        const EarthFrame earth = EarthFrame::create({.semi_minor = semi_minor}).value();
        for (int i = 0; i < 3000; ++i) {
            const double decade = random.between(-1.0, 8.0);
            const double height =
                random.below(4) == 0 ? -random.between(0.0, 1.5e5) : std::pow(10.0, decade) - 1.0;
            Geodetic place{random.between(-kPi / 2, kPi / 2), random.between(-kPi, kPi), height};
            if (i < 4) place.latitude = (i & 1) != 0 ? kPi / 2 : -kPi / 2;
            if (i >= 4 && i < 8) place.latitude = 0.0;
            const Eigen::Vector3d p = earth.earth_from_geodetic(place);
            const auto found = earth.geodetic_from_earth(p);
            ASSERT_TRUE(found) << height;
            const double most = 3e-15 * p.norm();
            EXPECT_NEAR(found->height, height, most) << place.latitude << ' ' << semi_minor;
            EXPECT_LT((earth.earth_from_geodetic(*found) - p).norm(), most)
                << place.latitude << ' ' << height << ' ' << semi_minor;
        }
    }
}

TEST(EarthFrame, HasNoPlaceInTheEarthsCoreOrNowhere) {
    const EarthFrame earth = wgs84();
    for (const Eigen::Vector3d& p :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1e5, 0, -1e5), Eigen::Vector3d(kNan, 0, 7e6),
          Eigen::Vector3d(7e6, std::numeric_limits<double>::infinity(), 0)}) {
        EXPECT_FALSE(earth.geodetic_from_earth(p));
        EXPECT_FALSE(earth.world_from_earth(p));
    }
    EXPECT_TRUE(earth.geodetic_from_earth({1e300, 1e300, 0}));
}

class EarthMappings : public testing::TestWithParam<EarthMapping> {};

TEST_P(EarthMappings, GoThereAndBack) {
    test::Random random(13);
    for (int i = 0; i < 500; ++i) {
        EarthFrameSettings settings{.latitude = random.between(-1.5, 1.5),
                                    .longitude = random.between(-kPi, kPi),
                                    .height = random.between(-100.0, 3000.0),
                                    .mapping = GetParam()};
        if (random.below(2) == 0) settings.semi_minor = settings.semi_major;
        const EarthFrame earth = EarthFrame::create(settings).value();
        const WorldPos p(random.between(-3e4, 3e4), random.between(-3e4, 3e4),
                         random.between(-5e3, 2e4));
        const auto found = earth.world_from_earth(earth.earth_from_world(p));
        ASSERT_TRUE(found);
        EXPECT_LT((*found - p).norm(), 1e-7) << settings.latitude << ' ' << p.transpose();
    }
}

TEST_P(EarthMappings, HaveEastNorthAndUpAtTheOrigin) {
    const EarthFrameSettings settings{
        .latitude = 0.8, .longitude = -1.2, .height = 250.0, .mapping = GetParam()};
    const EarthFrame earth = EarthFrame::create(settings).value();
    const Eigen::Vector3d origin = earth.earth_from_world(WorldPos::Zero());
    EXPECT_LT((origin - earth.earth_from_geodetic({0.8, -1.2, 250.0})).norm(), 1e-8);
    const double step = 1.0;
    const Eigen::Vector3d east = (earth.earth_from_world({step, 0, 0}) - origin) / step;
    const Eigen::Vector3d north = (earth.earth_from_world({0, step, 0}) - origin) / step;
    const Eigen::Vector3d up = (earth.earth_from_world({0, 0, step}) - origin) / step;
    EXPECT_NEAR(east.z(), 0.0, 1e-6);
    EXPECT_NEAR(east.norm(), 1.0, 1e-6);
    EXPECT_NEAR(north.norm(), 1.0, 1e-6);
    EXPECT_LT((east.cross(north) - up).norm(), 1e-6);
    EXPECT_LT((up - earth.up_earth(WorldPos::Zero())).norm(), 1e-8);
}

// Of three points of a slope in the world, moved to ECEF one by one.
TEST_P(EarthMappings, TurnNormalsAsTheyTurnSurfaces) {
    test::Random random(17);
    for (int i = 0; i < 300; ++i) {
        const EarthFrame earth =
            EarthFrame::create({.latitude = random.between(-1.3, 1.3),
                                .longitude = random.between(-kPi, kPi),
                                .mapping = GetParam(),
                                .metres_per_radian_east = random.below(2) == 0 ? 0.0 : 5e6})
                .value();
        const double slope_x = random.between(-2.0, 2.0), slope_y = random.between(-2.0, 2.0);
        const WorldPos p(random.between(-1e5, 1e5), random.between(-1e5, 1e5), 500.0);
        const Eigen::Vector3d there = earth.earth_from_world(p);
        const Eigen::Vector3d u = earth.earth_from_world(p + WorldPos(1, 0, slope_x)) - there;
        const Eigen::Vector3d v = earth.earth_from_world(p + WorldPos(0, 1, slope_y)) - there;
        const Eigen::Vector3d normal =
            earth.normal_earth_from_world(p, Eigen::Vector3d(-slope_x, -slope_y, 1.0).normalized());
        EXPECT_LT((normal - u.cross(v).normalized()).norm(), 1e-6);
        EXPECT_NEAR(normal.norm(), 1.0, 1e-14);
    }
}

INSTANTIATE_TEST_SUITE_P(All, EarthMappings,
                         testing::Values(EarthMapping::tangent_plane, EarthMapping::plate_carree),
                         testing::PrintToStringParamName());

TEST(EarthFrame, LeavesATangentPlaneByTheSquareOfTheDistance) {
    const EarthFrame earth = EarthFrame::create({.semi_minor = 6378137.0}).value();
    const double arc = 1e5 / 6378137.0;
    const auto p = earth.world_from_earth(earth.earth_from_geodetic({0.0, arc, 0.0}));
    ASSERT_TRUE(p);
    EXPECT_NEAR(p->z(), -6378137.0 * (1.0 - std::cos(arc)), 1e-6);
    EXPECT_NEAR(p->z(), -784.0, 1.0);
    EXPECT_FALSE(earth.world_from_earth(earth.earth_from_geodetic({0.0, 0.8, 0.0})));
    EXPECT_FALSE(earth.world_from_earth(earth.earth_from_geodetic({0.0, kPi, 0.0})));
}

TEST(EarthFrame, GoesRoundTheDateLineByTheShorterWay) {
    const EarthFrame earth =
        EarthFrame::create({.longitude = 3.14, .mapping = EarthMapping::plate_carree}).value();
    const auto p = earth.world_from_earth(earth.earth_from_geodetic({0.0, -3.14, 0.0}));
    ASSERT_TRUE(p);
    EXPECT_NEAR(p->x(), (2 * kPi - 6.28) * 6378137.0, 1e-6);
}

TEST(EarthFrame, TakesTheScaleOfARasterInDegrees) {
    const EarthFrame earth = EarthFrame::create({.latitude = 0.9,
                                                 .longitude = 0.1,
                                                 .mapping = EarthMapping::plate_carree,
                                                 .metres_per_radian_east = 4e6,
                                                 .metres_per_radian_north = 6.4e6})
                                 .value();
    const auto p = earth.world_from_earth(earth.earth_from_geodetic({0.91, 0.12, 77.0}));
    ASSERT_TRUE(p);
    EXPECT_NEAR(p->x(), 0.02 * 4e6, 1e-6);
    EXPECT_NEAR(p->y(), 0.01 * 6.4e6, 1e-6);
    EXPECT_NEAR(p->z(), 77.0, 1e-8);
}

TEST(EarthFrame, RefusesSettingsOutOfRange) {
    for (const EarthFrameSettings& settings :
         {EarthFrameSettings{.latitude = 1.6}, EarthFrameSettings{.latitude = kNan},
          EarthFrameSettings{.longitude = 7.0}, EarthFrameSettings{.height = -1e6},
          EarthFrameSettings{.semi_major = 0.0}, EarthFrameSettings{.semi_minor = 7e6},
          EarthFrameSettings{.semi_minor = kNan},
          EarthFrameSettings{.metres_per_radian_east = -1.0},
          EarthFrameSettings{.latitude = kPi / 2, .mapping = EarthMapping::plate_carree}}) {
        const Result<EarthFrame> refused = EarthFrame::create(settings);
        ASSERT_FALSE(refused);
        EXPECT_NE(refused.error().message.find(", got "), std::string::npos);
    }
    EXPECT_TRUE(EarthFrame::create({.latitude = kPi / 2}));
}

}  // namespace earth_frame_test
}  // namespace terrane::adapters
