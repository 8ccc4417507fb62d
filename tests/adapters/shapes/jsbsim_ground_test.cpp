// SPDX-License-Identifier: MIT
#include "adapter_grounds.h"
#include "support/random.h"

#include <terrane/adapters/jsbsim_ground.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

// NOLINTBEGIN(readability-identifier-naming): JSBSim's names
namespace jsbsim_stub {

// What JsbsimGround uses of JSBSim's classes, written from their documentation.
struct FGColumnVector3 {
    FGColumnVector3() = default;
    FGColumnVector3(double x, double y, double z) : value{x, y, z} {}
    double operator()(unsigned int i) const { return value[i - 1]; }
    std::array<double, 3> value{};
};

class FGLocation {
public:
    FGLocation() = default;
    explicit FGLocation(const FGColumnVector3& v) : place_(v) {}
    FGLocation& operator=(const FGColumnVector3& v) {
        place_ = v;
        return *this;
    }
    double operator()(unsigned int i) const { return place_(i); }
    void SetEllipse(double a, double) { semi_major = a; }
    double semi_major = 0.0;

private:
    FGColumnVector3 place_;
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

}  // namespace jsbsim_stub
// NOLINTEND(readability-identifier-naming)

namespace terrane::adapters {
namespace jsbsim_ground_test {

using jsbsim_stub::FGColumnVector3;
using jsbsim_stub::FGGroundCallback;
using jsbsim_stub::FGLocation;
using Callback = JsbsimGround<FGGroundCallback, FGLocation, FGColumnVector3>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

JsbsimGroundSettings settings_at(double latitude, double longitude, EarthMapping mapping) {
    JsbsimGroundSettings settings;
    settings.earth = {
        .latitude = latitude, .longitude = longitude, .height = 30.0, .mapping = mapping};
    return settings;
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

Eigen::Vector3d metres(const FGLocation& location) {
    return 0.3048 * Eigen::Vector3d(location(1), location(2), location(3));
}

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
            EXPECT_LT((metres(contact) - earth.earth_from_world(below)).norm(), 1e-6);
            EXPECT_EQ(contact.semi_major, location.semi_major);
            EXPECT_LT((Eigen::Vector3d(normal(1), normal(2), normal(3)) -
                       earth.normal_earth_from_world(below, test::plane_normal()))
                          .norm(),
                      1e-6);
            EXPECT_EQ(v.value, (std::array{0.0, 0.0, 0.0}));
            EXPECT_EQ(w.value, (std::array{0.0, 0.0, 0.0}));
        }
    }
}

TEST(JsbsimGround, IsInfinitelyHighAboveAbsentGroundAndCountsIt) {
    const Callback callback = make_callback(test::make_broken_ground(),
                                            settings_at(0.3, 0.4, EarthMapping::plate_carree));
    const EarthFrame& earth = callback.aircraft_ground().earth();
    const auto expect_absent = [&](const Eigen::Vector3d& p_earth, GroundStatus status) {
        FGLocation contact;
        FGColumnVector3 normal, v, w;
        const FGLocation location = location_of(p_earth);
        EXPECT_EQ(callback.GetAGLevel(0.0, location, contact, normal, v, w), kInfinity);
        for (unsigned int i = 1; i <= 3; ++i) {  // the contact is the location
            EXPECT_EQ(contact(i), location(i));
        }
        EXPECT_NEAR(std::hypot(normal(1), normal(2), normal(3)), 1.0, 1e-12);
        EXPECT_EQ(callback.aircraft_ground().counts().of(status), 1u);
    };
    expect_absent(earth.earth_from_world({4, 10, 100}), GroundStatus::outside);
    expect_absent(earth.earth_from_world({200, 200, 100}), GroundStatus::not_resident);
    expect_absent({0, 0, 0}, GroundStatus::invalid);
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
    EXPECT_EQ(callback.aircraft_ground().counts().of(GroundStatus::invalid), 3u);
    const Callback without(AircraftGround::create({}).value());
    EXPECT_EQ(without.GetAGLevel(location_of({6378137, 0, 0})), kInfinity);
    EXPECT_EQ(without.aircraft_ground().counts().of(GroundStatus::not_resident), 1u);
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
    EXPECT_LT((metres(contact) - earth.earth_from_world({-5e4, 10, 12})).norm(), 1e-6);
    EXPECT_EQ(callback.aircraft_ground().counts().of(GroundStatus::outside), 1u);
}

TEST(JsbsimGround, KnowsThatAWheelHasSunkIn) {
    const Callback callback = make_callback(test::make_test_ground(test::plane_height),
                                            settings_at(-0.5, 2.4, EarthMapping::tangent_plane));
    const EarthFrame& earth = callback.aircraft_ground().earth();
    const double ground_z = test::plane_height(64, 64);
    EXPECT_NEAR(
        callback.GetAGLevel(location_of(earth.earth_from_world({64, 64, ground_z - 0.1}))) * 0.3048,
        -0.1, 1e-6);
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
    JsbsimGroundSettings settings;
    settings.absent_height = kNan;
    EXPECT_FALSE(AircraftGround::create(settings));
    settings.absent_height = kInfinity;
    EXPECT_FALSE(AircraftGround::create(settings));
    settings = {};
    settings.search_above = -1.0;
    EXPECT_FALSE(AircraftGround::create(settings));
    settings = {};
    settings.earth.latitude = 2.0;
    EXPECT_FALSE(AircraftGround::create(settings));
}

}  // namespace jsbsim_ground_test
}  // namespace terrane::adapters
