// SPDX-License-Identifier: MIT
#include "adapter_grounds.h"
#include "support/random.h"

#include <terrane/adapters/terrain_probe.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
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
    for (int i = 0; i < 500; ++i) {
        const double x = random.between(-10.0, 140.0), y = random.between(-10.0, 140.0);
        const TerrainProbe::Answer answer =
            probe.probe(Eigen::Vector3d(x - 60.0, random.between(-1e3, 1e3), 70.0 - y));
        const HeightAnswer want = ground.height(60.0 + (x - 60.0), 70.0 - (70.0 - y));
        ASSERT_EQ(answer.status, want.status);
        ASSERT_EQ(answer.result,
                  want.status == GroundStatus::ok ? ProbeResult::hit : ProbeResult::missed);
        if (want.status != GroundStatus::ok) continue;
        EXPECT_EQ(answer.location.y(), want.height - 5.0);
    }
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
    EXPECT_EQ(probe.counts().of(GroundStatus::outside), 2u);
    EXPECT_EQ(probe.counts().of(GroundStatus::not_resident), 1u);
    EXPECT_EQ(probe.counts().of(GroundStatus::invalid), 2u);
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
    EXPECT_EQ(without.probe(Eigen::Vector3d(10, 0, -10)).status, GroundStatus::not_resident);
}

TEST(TerrainProbe, AsksForWaterByMaterialAndForTheVelocityOfTheSurface) {
    test::TableGroundSettings ground_settings;
    ground_settings.surface = SurfaceMap::from_function([](double x, double) {
                                  return SurfaceProperties{.material = x < 50.0 ? 9u : 1u};
                              }).value();
    TerrainProbeSettings settings;
    settings.is_wet = [](std::uint32_t material) { return material == 9; };
    settings.velocity = [](const WorldPos& p) { return Eigen::Vector3d(1.0, p.x(), 3.0); };
    const TerrainProbe probe =
        make_probe(test::make_test_ground(test::plane_height, ground_settings), settings);
    const TerrainProbe::Answer lake = probe.probe(Eigen::Vector3d(40, 0, -20));
    EXPECT_TRUE(lake.is_wet);
    EXPECT_EQ(lake.velocity, Eigen::Vector3d(1.0, 3.0, -40.0));
    EXPECT_FALSE(probe.probe(Eigen::Vector3d(60, 0, -20)).is_wet);
}

TEST(TerrainProbe, CountsFunctionsThatThrow) {
    test::TableGroundSettings ground_settings;
    ground_settings.surface =
        SurfaceMap::from_function([](double, double) { return SurfaceProperties{}; }).value();
    const Ground ground = test::make_test_ground(test::plane_height, ground_settings);
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
}  // namespace terrane::adapters
