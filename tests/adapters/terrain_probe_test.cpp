// SPDX-License-Identifier: MIT
#include "adapters/adapter_grounds.h"
#include "support/random.h"

#include <terrane/adapters/chrono_terrain.h>
#include <terrane/adapters/terrain_probe.h>

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>

namespace terrane::adapters {
namespace terrain_probe_test {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// NOLINTBEGIN(readability-identifier-naming): X-Plane's names
struct ProbeInfo {
    int structSize = static_cast<int>(sizeof(ProbeInfo));
    float locationX = 0, locationY = 0, locationZ = 0;
    float normalX = 0, normalY = 0, normalZ = 0;
    float velocityX = 0, velocityY = 0, velocityZ = 0;
    int is_wet = 0;
};
// NOLINTEND(readability-identifier-naming)

TerrainProbe make_probe(const Ground& ground, const TerrainProbeSettings& settings = {}) {
    TerrainProbe probe = TerrainProbe::create(settings).value();
    probe.set_ground(ground);
    return probe;
}

/// plane_height() with a surface map.
Ground ground_with(const std::function<SurfaceProperties(double, double)>& surface) {
    return test::make_test_ground(test::plane_height,
                                  {.surface = SurfaceMap::from_function(surface).value()});
}

TEST(TerrainProbe, FillsTheStructureInAFrameWithYUpAndZSouth) {
    const TerrainProbe probe =
        make_probe(test::make_test_ground(test::plane_height), {.origin_world = {64, 64, 8}});
    ProbeInfo info;
    ASSERT_EQ(probe.probe(16.0f, 0.0f, 32.0f, &info), ProbeResult::hit);  // 16 m east, 32 m south
    EXPECT_EQ(info.locationX, 16.0f);
    EXPECT_EQ(info.locationZ, 32.0f);
    EXPECT_EQ(info.locationY, static_cast<float>(test::plane_height(80.0, 32.0) - 8.0));
    const Eigen::Vector3d normal = test::plane_normal();
    EXPECT_FLOAT_EQ(info.normalX, static_cast<float>(normal.x()));
    EXPECT_FLOAT_EQ(info.normalY, static_cast<float>(normal.z()));
    EXPECT_FLOAT_EQ(info.normalZ, static_cast<float>(-normal.y()));
    EXPECT_EQ(info.velocityX, 0.0f);
    EXPECT_EQ(info.is_wet, 0);
}

TEST(TerrainProbe, AgreesWithGroundEverywhere) {
    const Ground ground = test::make_test_ground(test::rough_height);
    const TerrainProbe probe = make_probe(ground, {.origin_world = {60, 70, 5}});
    test::Random random(8);
    int hits = 0;
    for (int i = 0; i < 500; ++i) {
        const double east = random.between(-70.0, 80.0), south = random.between(-70.0, 80.0);
        const TerrainProbe::Answer answer =
            probe.probe(Eigen::Vector3d(east, random.between(-1e3, 1e3), south));
        const HeightAnswer want = ground.height(60.0 + east, 70.0 - south);
        ASSERT_EQ(answer.status, want.status);
        ASSERT_EQ(answer.result,
                  want.status == QueryStatus::ok ? ProbeResult::hit : ProbeResult::missed);
        if (want.status != QueryStatus::ok) continue;
        ++hits;
        EXPECT_EQ(answer.location.y(), want.height - 5.0);
    }
    EXPECT_GT(hits, 300) << "of the area, 0.73 is ground";
}

TEST(TerrainProbe, LeavesTheStructureAloneWhereItIsNoHit) {
    const TerrainProbe probe = make_probe(test::make_broken_ground());
    const auto expect = [&](float x, float z, ProbeResult result) {
        ProbeInfo info;
        info.locationY = 777.0f;
        EXPECT_EQ(probe.probe(x, 0.0f, z, &info), result) << x << ' ' << z;
        EXPECT_EQ(info.locationY, 777.0f);
    };
    expect(4.0f, -10.0f, ProbeResult::missed);    // nodata at the border
    expect(1e30f, -10.0f, ProbeResult::missed);   // beyond the extent
    expect(200.0f, -200.0f, ProbeResult::error);  // not resident: not known
    expect(static_cast<float>(kNan), 0.0f, ProbeResult::error);
    expect(20.0f, static_cast<float>(kInfinity), ProbeResult::error);
    EXPECT_EQ(probe.counts().of(QueryStatus::outside), 2u);
    EXPECT_EQ(probe.counts().of(QueryStatus::not_resident), 1u);
    EXPECT_EQ(probe.counts().of(QueryStatus::invalid), 2u);
}

TEST(TerrainProbe, IsAnErrorForAStructureOfAnotherSizeAndWithoutGround) {
    const TerrainProbe probe = make_probe(test::make_test_ground(test::plane_height));
    ProbeInfo info;
    info.structSize = 12;
    EXPECT_EQ(probe.probe(10.0f, 0.0f, -10.0f, &info), ProbeResult::error);
    EXPECT_EQ(info.locationX, 0.0f);
    EXPECT_EQ(probe.probe(10.0f, 0.0f, -10.0f, static_cast<ProbeInfo*>(nullptr)),
              ProbeResult::error);
    const TerrainProbe without = TerrainProbe::create({}).value();
    EXPECT_EQ(without.probe(Eigen::Vector3d(10, 0, -10)).status, QueryStatus::not_resident);
}

TEST(TerrainProbe, AsksForWaterByMaterialAndForTheVelocityOfTheSurface) {
    const Ground ground = ground_with(
        [](double x, double) { return SurfaceProperties{.material = x < 50.0 ? 9u : 1u}; });
    TerrainProbeSettings settings;
    settings.is_wet = [](std::uint32_t material) { return material == 9; };
    settings.velocity = [](const WorldPos& p) { return Eigen::Vector3d(1.0, p.x(), 3.0); };
    const TerrainProbe probe = make_probe(ground, settings);
    const TerrainProbe::Answer lake = probe.probe(Eigen::Vector3d(40, 0, -20));
    EXPECT_TRUE(lake.is_wet);
    EXPECT_EQ(lake.velocity, Eigen::Vector3d(1.0, 3.0, -40.0));
    EXPECT_FALSE(probe.probe(Eigen::Vector3d(60, 0, -20)).is_wet);
}

TEST(TerrainProbe, CountsFunctionsThatThrow) {
    const Ground ground = ground_with([](double, double) { return SurfaceProperties{}; });
    TerrainProbeSettings settings;
    settings.is_wet = [](std::uint32_t) -> bool { throw std::runtime_error("no water"); };
    const TerrainProbe dry = make_probe(ground, settings);
    EXPECT_EQ(dry.probe(Eigen::Vector3d(40, 0, -20)).result, ProbeResult::hit);
    EXPECT_EQ(dry.fault_count(), 1u);
    settings.velocity = [](const WorldPos&) -> Eigen::Vector3d { throw 7; };
    const TerrainProbe thrown = make_probe(ground, settings);
    EXPECT_EQ(thrown.probe(Eigen::Vector3d(40, 0, -20)).result, ProbeResult::error);
    EXPECT_EQ(thrown.fault_count(), 2u);
    settings.velocity = [](const WorldPos&) { return Eigen::Vector3d(kNan, 0.0, 0.0); };
    EXPECT_EQ(make_probe(ground, settings).probe(Eigen::Vector3d(40, 0, -20)).result,
              ProbeResult::error);
}

TEST(TerrainProbe, KeepsItsPrecisionAMillionKilometresOut) {
    TerrainProbe probe = make_probe(test::make_far_ground(), {.origin_world = {1e9, -1e9, 1e5}});
    ProbeInfo info;
    ASSERT_EQ(probe.probe(40.0f, 0.0f, -24.0f, &info), ProbeResult::hit);
    EXPECT_NEAR(info.locationY, test::plane_height(40.0, 24.0), 1e-5);
    probe.set_origin({1e9 + 40.0, -1e9 + 24.0, 1e5});  // the frame follows the aircraft
    ASSERT_EQ(probe.probe(0.0f, 0.0f, 0.0f, &info), ProbeResult::hit);
    EXPECT_NEAR(info.locationY, test::plane_height(40.0, 24.0), 1e-5);
}

TEST(TerrainProbe, FindsTheFloorOfARoomOnlyWhereItIsAskedTo) {
    const Ground ground = test::make_room_ground();
    const Eigen::Vector3d in_room(50.3, 6.0, -50.2);
    EXPECT_EQ(make_probe(ground).probe(in_room).location.y(), 20.0);
    EXPECT_EQ(make_probe(ground, {.search_above = 2.0}).probe(in_room).location.y(), 5.0);
}

TEST(TerrainProbe, RefusesSettingsThatMakeNoSense) {
    EXPECT_FALSE(TerrainProbe::create({.origin_world = {kNan, 0, 0}}));
    EXPECT_FALSE(TerrainProbe::create({.search_above = -1.0}));
    EXPECT_FALSE(TerrainProbe::create({.search_above = kNan}));
}

}  // namespace terrain_probe_test

namespace chrono_terrain_test {

// NOLINTBEGIN(readability-identifier-naming): Chrono's names
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

// NOLINTEND(readability-identifier-naming)

using Terrain = ChronoTerrain<ChTerrain, ChVector3d>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Terrain make_terrain(const Ground& ground, const ChronoTerrainSettings& settings = {}) {
    Terrain terrain(TyreGround::create(settings).value());
    terrain.tyre_ground().set_ground(ground);
    return terrain;
}

TEST(ChronoTerrain, AnswersTheContactSurfaceThroughTheBaseClass) {
    const auto properties = [](double x, double) {
        return SurfaceProperties{.friction = x < 50.0 ? 0.3 : 0.9};
    };
    const Ground ground = test::make_test_ground(
        test::rough_height, {.surface = SurfaceMap::from_function(properties).value()});
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
    EXPECT_EQ(terrain.tyre_ground().counts().of(QueryStatus::ok), 600u);
    EXPECT_EQ(terrain.tyre_ground().counts().failed(), 0u);
}

TEST(ChronoTerrain, MeasuresHeightsAlongTheVerticalOfAnyFrame) {
    const Ground ground = test::make_test_ground(test::plane_height);
    test::Random random(5);
    for (int i = 0; i < 100; ++i) {
        ChronoTerrainSettings settings;
        Pose& world_from_sim = settings.world_from_sim;
        world_from_sim.rotation = random.rotation();
        // the first frame is the SAE's: x forward and east, y right and south, z down
        if (i == 0) world_from_sim.rotation = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
        world_from_sim.translation = {random.between(-1e3, 1e3), random.between(-1e3, 1e3),
                                      random.between(-1e3, 1e3)};
        const Eigen::Matrix3d sim_from_world = world_from_sim.rotation.transpose();
        const Terrain terrain = make_terrain(ground, settings);
        const double x = random.between(2, 126), y = random.between(2, 126);
        const TyreGround::Answer answer = terrain.tyre_ground().find(
            sim_from_world * (WorldPos(x, y, 70.0) - world_from_sim.translation));
        EXPECT_EQ(answer.status, QueryStatus::ok);
        const WorldPos on_plane(x, y, test::plane_height(x, y));
        EXPECT_LT((world_from_sim * answer.point_sim - on_plane).norm(), 1e-9);
        EXPECT_NEAR(answer.height, sim_from_world.col(2).dot(answer.point_sim), 1e-9);
        EXPECT_LT((world_from_sim.rotation * answer.normal_sim - test::plane_normal()).norm(),
                  1e-9);
    }
}

TEST(ChronoTerrain, TellsOfAbsentGroundByTheHeightThatWasChosenAndByCounts) {
    for (const double chosen : {-kInfinity, -1e4, kNan}) {
        const Terrain terrain =
            make_terrain(test::make_broken_ground(), {.absent_height = chosen, .friction = 0.5f});
        const auto expect_absent = [&](const ChVector3d& p, QueryStatus status) {
            const std::uint64_t before = terrain.tyre_ground().counts().of(status);
            const double height = terrain.GetHeight(p);
            EXPECT_TRUE(std::isnan(chosen) ? std::isnan(height) : height == chosen) << height;
            EXPECT_EQ(terrain.GetNormal(p).z(), 1.0);
            EXPECT_EQ(terrain.GetCoefficientFriction(p), 0.5f);
            EXPECT_EQ(terrain.tyre_ground().counts().of(status), before + 3);
        };
        expect_absent({4.0, 10.0, 0.0}, QueryStatus::outside);
        expect_absent({-1e9, 10.0, 0.0}, QueryStatus::outside);
        expect_absent({200.0, 200.0, 0.0}, QueryStatus::not_resident);
        expect_absent({kNan, 0.0, 0.0}, QueryStatus::invalid);
        expect_absent({20.0, kInfinity, 0.0}, QueryStatus::invalid);
        expect_absent({20.0, 10.0, kNan}, QueryStatus::invalid);
        EXPECT_EQ(terrain.tyre_ground().counts().failed(), 18u);
        EXPECT_EQ(terrain.GetHeight({20.0, 10.0, 0.0}), test::plane_height(20.0, 10.0));
    }
    const Terrain without(TyreGround::create({}).value());
    EXPECT_EQ(without.GetHeight({20.0, 10.0, 0.0}), -kInfinity);
    EXPECT_EQ(without.tyre_ground().counts().of(QueryStatus::not_resident), 1u);
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
    EXPECT_EQ(near.tyre_ground().counts().of(QueryStatus::miss), 1u);
}

TEST(ChronoTerrain, RefusesSettingsThatMakeNoSense) {
    ChronoTerrainSettings skew, mirror, nowhere;
    skew.world_from_sim.rotation(0, 1) = 0.1;
    mirror.world_from_sim.rotation(2, 2) = -1.0;
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
