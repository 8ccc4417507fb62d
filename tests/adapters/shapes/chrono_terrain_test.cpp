// SPDX-License-Identifier: MIT
#include "adapter_grounds.h"
#include "support/random.h"

#include <terrane/adapters/chrono_terrain.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

// NOLINTBEGIN(readability-identifier-naming): Chrono's names
namespace chrono_stub {

// What ChronoTerrain uses of ChVector3d and ChTerrain, written from their documentation.
struct ChVector3d {
    ChVector3d(double x_, double y_, double z_) : x_value(x_), y_value(y_), z_value(z_) {}
    double x() const { return x_value; }
    double y() const { return y_value; }
    double z() const { return z_value; }
    double x_value, y_value, z_value;
};

class ChTerrain {
public:
    virtual ~ChTerrain() = default;
    virtual double GetHeight(const ChVector3d&) const { return 0.0; }
    virtual ChVector3d GetNormal(const ChVector3d&) const { return {0.0, 0.0, 1.0}; }
    virtual float GetCoefficientFriction(const ChVector3d&) const { return 0.8f; }
};

}  // namespace chrono_stub
// NOLINTEND(readability-identifier-naming)

namespace terrane::adapters {
namespace chrono_terrain_test {

using chrono_stub::ChTerrain;
using chrono_stub::ChVector3d;
using Terrain = ChronoTerrain<ChTerrain, ChVector3d>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Terrain make_terrain(const Ground& ground, const ChronoTerrainSettings& settings = {}) {
    Terrain terrain(TyreGround::create(settings).value());
    terrain.tyre_ground().set_ground(ground);
    return terrain;
}

TEST(ChronoTerrain, AnswersTheContactSurfaceThroughTheBaseClass) {
    test::TableGroundSettings ground_settings;
    ground_settings.surface = SurfaceMap::from_function([](double x, double) {
                                  return SurfaceProperties{.friction = x < 50.0 ? 0.3 : 0.9};
                              }).value();
    const Ground ground = test::make_test_ground(test::rough_height, ground_settings);
    const Terrain terrain = make_terrain(ground);
    const ChTerrain& base = terrain;
    test::Random random(3);
    for (int i = 0; i < 200; ++i) {
        const double x = random.between(1.0, 127.0), y = random.between(1.0, 127.0);
        const double z = random.between(-100.0, 100.0);
        const HeightAnswer want = ground.height(x, y);
        EXPECT_EQ(base.GetHeight({x, y, z}), want.height) << x << ' ' << y;
        const ChVector3d normal = base.GetNormal({x, y, z});
        EXPECT_EQ(Eigen::Vector3d(normal.x(), normal.y(), normal.z()), want.normal);
        EXPECT_EQ(base.GetCoefficientFriction({x, y, z}), x < 50.0 ? 0.3f : 0.9f);
    }
    EXPECT_EQ(terrain.tyre_ground().counts().of(GroundStatus::ok), 600u);
    EXPECT_EQ(terrain.tyre_ground().counts().failed(), 0u);
}

TEST(ChronoTerrain, MeasuresHeightsAlongTheVerticalOfAnyFrame) {
    const Ground ground = test::make_test_ground(test::plane_height);
    test::Random random(5);
    for (int i = 0; i < 100; ++i) {
        ChronoTerrainSettings settings;
        settings.world_from_sim.rotation = random.rotation();
        settings.world_from_sim.translation = {random.between(-1e3, 1e3), random.between(-1e3, 1e3),
                                               random.between(-1e3, 1e3)};
        const TyreGround::Answer answer = [&] {
            const Terrain terrain = make_terrain(ground, settings);
            const WorldPos p_world(random.between(2, 126), random.between(2, 126), 70.0);
            const Eigen::Vector3d p_sim = settings.world_from_sim.rotation.transpose() *
                                          (p_world - settings.world_from_sim.translation);
            const TyreGround::Answer found = terrain.tyre_ground().find(p_sim);
            const WorldPos on_plane(p_world.x(), p_world.y(),
                                    test::plane_height(p_world.x(), p_world.y()));
            EXPECT_LT((settings.world_from_sim * found.point_sim - on_plane).norm(), 1e-9);
            return found;
        }();
        const Eigen::Vector3d up_sim =
            settings.world_from_sim.rotation.transpose() * Eigen::Vector3d::UnitZ();
        EXPECT_EQ(answer.status, GroundStatus::ok);
        EXPECT_NEAR(answer.height, up_sim.dot(answer.point_sim), 1e-9);
        EXPECT_LT(
            (settings.world_from_sim.rotation * answer.normal_sim - test::plane_normal()).norm(),
            1e-9);
    }
}

TEST(ChronoTerrain, IsTheSaeFrameWithZDown) {
    ChronoTerrainSettings settings;  // x forward and east, y right and south, z down
    settings.world_from_sim.rotation = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    const Terrain terrain = make_terrain(test::make_test_ground(test::plane_height), settings);
    EXPECT_EQ(terrain.GetHeight({40.0, -16.0, -100.0}), test::plane_height(40.0, 16.0));
    const ChVector3d normal = terrain.GetNormal({40.0, -16.0, -100.0});
    EXPECT_NEAR(normal.z(), -test::plane_normal().z(), 1e-15);
    EXPECT_NEAR(normal.y(), -test::plane_normal().y(), 1e-15);
}

TEST(ChronoTerrain, TellsOfAbsentGroundByTheHeightThatWasChosenAndByCounts) {
    for (const double chosen : {-kInfinity, -1e4, kNan}) {
        const Terrain terrain =
            make_terrain(test::make_broken_ground(), {.absent_height = chosen, .friction = 0.5f});
        const auto expect_absent = [&](const ChVector3d& p, GroundStatus status) {
            const std::uint64_t before = terrain.tyre_ground().counts().of(status);
            const double height = terrain.GetHeight(p);
            EXPECT_TRUE(std::isnan(chosen) ? std::isnan(height) : height == chosen) << height;
            EXPECT_EQ(terrain.GetNormal(p).z(), 1.0);
            EXPECT_EQ(terrain.GetCoefficientFriction(p), 0.5f);
            EXPECT_EQ(terrain.tyre_ground().counts().of(status), before + 3);
        };
        expect_absent({4.0, 10.0, 0.0}, GroundStatus::outside);
        expect_absent({-1e9, 10.0, 0.0}, GroundStatus::outside);
        expect_absent({200.0, 200.0, 0.0}, GroundStatus::not_resident);
        expect_absent({kNan, 0.0, 0.0}, GroundStatus::invalid);
        expect_absent({20.0, kInfinity, 0.0}, GroundStatus::invalid);
        expect_absent({20.0, 10.0, kNan}, GroundStatus::invalid);
        EXPECT_EQ(terrain.tyre_ground().counts().failed(), 18u);
        EXPECT_EQ(terrain.GetHeight({20.0, 10.0, 0.0}), test::plane_height(20.0, 10.0));
    }
    const Terrain without(TyreGround::create({}).value());
    EXPECT_EQ(without.GetHeight({20.0, 10.0, 0.0}), -kInfinity);
    EXPECT_EQ(without.tyre_ground().counts().of(GroundStatus::not_resident), 1u);
}

TEST(ChronoTerrain, AnswersAtTheBorderAndNotBeyondIt) {
    const Terrain terrain = make_terrain(test::make_test_ground(test::plane_height));
    const Ground& ground = *terrain.tyre_ground().ground();
    for (const double x : {0.0, 128.0}) {
        for (const double y : {0.0, 64.0, 128.0}) {
            EXPECT_EQ(terrain.tyre_ground().find({x, y, 0.0}).status, ground.height(x, y).status);
            EXPECT_EQ(terrain.GetHeight({x, y, 0.0}), test::plane_height(x, y));
        }
    }
    EXPECT_EQ(terrain.GetHeight({std::nextafter(128.0, 129.0), 64.0, 0.0}), -kInfinity);
    EXPECT_EQ(terrain.GetHeight({std::nextafter(0.0, -1.0), 64.0, 0.0}), -kInfinity);
}

TEST(ChronoTerrain, AnswersAMillionKilometresOutWithItsOriginThere) {
    ChronoTerrainSettings settings;
    settings.world_from_sim.translation = {1e9, -1e9, 1e5};
    const Terrain terrain = make_terrain(test::make_far_ground(), settings);
    EXPECT_NEAR(terrain.GetHeight({40.0, 24.0, 0.0}), test::plane_height(40.0, 24.0), 1e-6);
}

TEST(ChronoTerrain, FindsTheFloorOfARoomWhereTheSearchEndsBelowItsCeiling) {
    const Ground ground = test::make_room_ground();
    const Terrain highest = make_terrain(ground);
    const Terrain near = make_terrain(ground, {.search_above = 1.0});
    EXPECT_EQ(highest.GetHeight({50.3, 50.2, 6.0}), 20.0);
    EXPECT_EQ(near.GetHeight({50.3, 50.2, 6.0}), 5.0);
    EXPECT_EQ(near.GetHeight({50.3, 50.2, 4.5}), 5.0);    // half a metre deep in the floor
    EXPECT_EQ(near.GetHeight({50.3, 50.2, 19.5}), 20.0);  // and in the ground
    EXPECT_EQ(near.GetHeight({50.3, 50.2, 8.5}), 5.0);    // not the ceiling above
    EXPECT_EQ(near.GetHeight({50.3, 50.2, 2.0}), -kInfinity);
    EXPECT_EQ(near.tyre_ground().counts().of(GroundStatus::miss), 1u);
}

TEST(ChronoTerrain, RefusesSettingsThatMakeNoSense) {
    ChronoTerrainSettings skew;
    skew.world_from_sim.rotation(0, 1) = 0.1;
    ChronoTerrainSettings mirror;
    mirror.world_from_sim.rotation(2, 2) = -1.0;
    ChronoTerrainSettings nowhere;
    nowhere.world_from_sim.translation.x() = kNan;
    for (const ChronoTerrainSettings& settings :
         {skew, mirror, nowhere, ChronoTerrainSettings{.search_above = -1.0},
          ChronoTerrainSettings{.search_above = kNan}, ChronoTerrainSettings{.friction = -0.1f}}) {
        const Result<TyreGround> refused = TyreGround::create(settings);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
        EXPECT_NE(refused.error().message.find(" must be "), std::string::npos);
    }
}

}  // namespace chrono_terrain_test
}  // namespace terrane::adapters
