// SPDX-License-Identifier: MIT
#include "adapters/adapter_grounds.h"
#include "support/random.h"

#include <terrane/adapters/earth_frame.h>
#include <terrane/adapters/jsbsim_ground.h>

#include <gtest/gtest.h>

#include <array>
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
    const Eigen::Vector3d east = earth.earth_from_world({1, 0, 0}) - origin;
    const Eigen::Vector3d north = earth.earth_from_world({0, 1, 0}) - origin;
    const Eigen::Vector3d up = earth.earth_from_world({0, 0, 1}) - origin;
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

namespace jsbsim_ground_test {

// NOLINTBEGIN(readability-identifier-naming): JSBSim's names
// What JsbsimGround uses of JSBSim's classes, written from their documentation.
struct FGColumnVector3 {
    FGColumnVector3() = default;
    FGColumnVector3(double x, double y, double z) : value{x, y, z} {}
    double operator()(unsigned int i) const { return value[i - 1]; }
    std::array<double, 3> value{};
};

struct FGLocation : FGColumnVector3 {
    FGLocation() = default;
    explicit FGLocation(const FGColumnVector3& v) : FGColumnVector3(v) {}
    FGLocation& operator=(const FGColumnVector3& v) {
        value = v.value;
        return *this;
    }
    void SetEllipse(double a, double) { semi_major = a; }
    double semi_major = 0.0;
};

class FGGroundCallback {
public:
    virtual ~FGGroundCallback() = default;
    virtual double GetAGLevel(double t, const FGLocation& location, FGLocation& contact,
                              FGColumnVector3& normal, FGColumnVector3& v,
                              FGColumnVector3& w) const = 0;
    virtual double GetAGLevel(const FGLocation& location, FGLocation& contact,
                              FGColumnVector3& normal, FGColumnVector3& v,
                              FGColumnVector3& w) const {
        return GetAGLevel(0.0, location, contact, normal, v, w);
    }
    virtual double GetAGLevel(const FGLocation& location) const {
        FGLocation contact;
        FGColumnVector3 unused;
        return GetAGLevel(location, contact, unused, unused, unused);
    }
};

// NOLINTEND(readability-identifier-naming)

using Callback = JsbsimGround<FGGroundCallback, FGLocation, FGColumnVector3>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

JsbsimGroundSettings settings_at(double latitude, double longitude, EarthMapping mapping) {
    return {.earth = {
                .latitude = latitude, .longitude = longitude, .height = 30.0, .mapping = mapping}};
}

Callback make_callback(const Ground& ground, const JsbsimGroundSettings& settings) {
    Callback callback(AircraftGround::create(settings).value());
    callback.aircraft_ground().set_ground(ground);
    return callback;
}

FGLocation location_of(const Eigen::Vector3d& p_earth) {
    FGLocation location(
        FGColumnVector3(p_earth.x() / 0.3048, p_earth.y() / 0.3048, p_earth.z() / 0.3048));
    location.SetEllipse(6378137.0 / 0.3048, 6356752.3 / 0.3048);
    return location;
}

Eigen::Vector3d vector_of(const FGColumnVector3& v) { return {v(1), v(2), v(3)}; }

TEST(JsbsimGround, AnswersSignedHeightsAboveGroundInFeet) {
    const Ground ground = test::make_test_ground(test::plane_height);
    test::Random random(19);
    for (const EarthMapping mapping : {EarthMapping::tangent_plane, EarthMapping::plate_carree}) {
        const Callback callback = make_callback(ground, settings_at(0.7, -2.1, mapping));
        const FGGroundCallback& base = callback;
        const EarthFrame& earth = callback.aircraft_ground().earth();
        for (int i = 0; i < 300; ++i) {
            const WorldPos p(random.between(1, 127), random.between(1, 127),
                             random.between(-200, 5000));
            const FGLocation location = location_of(earth.earth_from_world(p));
            FGLocation contact;
            FGColumnVector3 normal, v(1, 1, 1), w(1, 1, 1);
            const double height = base.GetAGLevel(12.0, location, contact, normal, v, w);
            const double ground_z = test::plane_height(p.x(), p.y());
            EXPECT_NEAR(height * 0.3048, p.z() - ground_z, 1e-6);
            EXPECT_NEAR(base.GetAGLevel(location), height, 0.0);
            const WorldPos below(p.x(), p.y(), ground_z);
            EXPECT_LT((0.3048 * vector_of(contact) - earth.earth_from_world(below)).norm(), 1e-6);
            EXPECT_EQ(contact.semi_major, location.semi_major);
            const Eigen::Vector3d want = earth.normal_earth_from_world(below, test::plane_normal());
            EXPECT_LT((vector_of(normal) - want).norm(), 1e-6);
            EXPECT_TRUE(vector_of(v).isZero(0.0) && vector_of(w).isZero(0.0));
        }
    }
}

TEST(JsbsimGround, IsInfinitelyHighAboveAbsentGroundAndCountsIt) {
    const Callback callback = make_callback(test::make_broken_ground(),
                                            settings_at(0.3, 0.4, EarthMapping::plate_carree));
    const EarthFrame& earth = callback.aircraft_ground().earth();
    const auto expect_absent = [&](const Eigen::Vector3d& p_earth, QueryStatus status) {
        FGLocation contact;
        FGColumnVector3 normal, v, w;
        const FGLocation location = location_of(p_earth);
        EXPECT_EQ(callback.GetAGLevel(0.0, location, contact, normal, v, w), kInfinity);
        EXPECT_EQ(contact.value, location.value);
        EXPECT_NEAR(vector_of(normal).norm(), 1.0, 1e-12);
        EXPECT_EQ(callback.aircraft_ground().counts().of(status), 1u);
    };
    expect_absent(earth.earth_from_world({4, 10, 100}), QueryStatus::outside);
    expect_absent(earth.earth_from_world({200, 200, 100}), QueryStatus::not_resident);
    expect_absent({0, 0, 0}, QueryStatus::invalid);
    EXPECT_EQ(callback.aircraft_ground().counts().failed(), 3u);
}

TEST(JsbsimGround, IsInvalidForPlacesThatAreNotFinite) {
    const Callback callback = make_callback(test::make_test_ground(test::plane_height),
                                            settings_at(0.3, 0.4, EarthMapping::tangent_plane));
    for (const Eigen::Vector3d& p :
         {Eigen::Vector3d(kNan, 0, 0), Eigen::Vector3d(7e6, kInfinity, 0),
          Eigen::Vector3d(-6.5e6, 0, 0)}) {  // the other side of the earth
        EXPECT_EQ(callback.GetAGLevel(location_of(p)), kInfinity);
    }
    EXPECT_EQ(callback.aircraft_ground().counts().of(QueryStatus::invalid), 3u);
    const Callback without(AircraftGround::create({}).value());
    EXPECT_EQ(without.GetAGLevel(location_of({6378137, 0, 0})), kInfinity);
    EXPECT_EQ(without.aircraft_ground().counts().of(QueryStatus::not_resident), 1u);
}

TEST(JsbsimGround, HasGroundAtTheHeightThatWasChosenWhereThereIsNone) {
    JsbsimGroundSettings settings = settings_at(0.3, 0.4, EarthMapping::plate_carree);
    settings.absent_height = 12.0;
    const Callback callback = make_callback(test::make_broken_ground(), settings);
    const EarthFrame& earth = callback.aircraft_ground().earth();
    FGLocation contact;
    FGColumnVector3 normal, v, w;
    const FGLocation location = location_of(earth.earth_from_world({-5e4, 10, 112}));
    EXPECT_NEAR(callback.GetAGLevel(0.0, location, contact, normal, v, w), 100.0 / 0.3048, 1e-5);
    EXPECT_LT((0.3048 * vector_of(contact) - earth.earth_from_world({-5e4, 10, 12})).norm(), 1e-6);
    EXPECT_EQ(callback.aircraft_ground().counts().of(QueryStatus::outside), 1u);
}

TEST(JsbsimGround, FindsTheFloorOfAHangarWhereTheSearchEndsBelowItsCeiling) {
    JsbsimGroundSettings settings = settings_at(0.3, 0.4, EarthMapping::tangent_plane);
    settings.search_above = 1.0;
    const Callback callback = make_callback(test::make_room_ground(), settings);
    const EarthFrame& earth = callback.aircraft_ground().earth();
    EXPECT_NEAR(callback.GetAGLevel(location_of(earth.earth_from_world({50.3, 50.2, 6}))) * 0.3048,
                1.0, 1e-6);
}

TEST(JsbsimGround, RefusesSettingsThatMakeNoSense) {
    EXPECT_FALSE(AircraftGround::create({.absent_height = kNan}));
    EXPECT_FALSE(AircraftGround::create({.absent_height = kInfinity}));
    EXPECT_FALSE(AircraftGround::create({.search_above = -1.0}));
    EXPECT_FALSE(AircraftGround::create({.earth = {.latitude = 2.0}}));
}

}  // namespace jsbsim_ground_test
}  // namespace terrane::adapters
