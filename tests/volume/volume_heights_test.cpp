// SPDX-License-Identifier: MIT
//
// Volumes as a source of a pager: what is loaded, what it claims, and what answers.
#include "support/heights/wave_heights.h"

#include <terrane/terrain/ground.h>
#include <terrane/terrain/pager.h>
#include <terrane/volume/volume_heights.h>

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace terrane {
namespace volume_heights_test {

using test::WaveHeights;

/// Four levels of 1 m to 8 m, one root of 1024 m.
Lattice small_lattice() {
    Lattice lattice;
    lattice.finest_level = 3;
    return lattice;
}

std::shared_ptr<const HeightSource> hills() {
    return std::make_shared<const WaveHeights>(small_lattice(), 30.0, 300.0);
}

VolumeOperation tunnel(double from_x, double to_x, double y, double z, double radius = 4.0) {
    return {.op = VolumeOp::remove,
            .shape = VolumeTube{{{from_x, y, z}, {to_x, y, z}}, radius},
            .voxel = 1.0};
}

std::shared_ptr<const VolumeHeights> with_volumes(const std::vector<VolumeOperation>& operations) {
    const auto volumes =
        Volumes::create(small_lattice(), operations, {.level = small_lattice().finest_level});
    return VolumeHeights::create(hills(), volumes.value()).value();
}

Pager make_pager(const std::shared_ptr<const HeightSource>& source, std::size_t memory_bytes) {
    return Pager::create(source, {.memory_bytes = memory_bytes, .worker_count = 0}).value();
}

TEST(VolumeHeights, RefusesVolumesOfAnotherLatticeOrLevel) {
    const std::vector<VolumeOperation> operations{tunnel(100.0, 900.0, 500.0, -60.0)};
    Lattice other = small_lattice();
    other.origin_x = 1.0;
    const auto refusal = [](const Result<Volumes>& volumes) {
        const auto made = VolumeHeights::create(hills(), volumes.value());
        return made ? std::string() : made.error().message;
    };
    EXPECT_NE(refusal(Volumes::create(other, operations, {.level = 3})).find("another lattice"),
              std::string::npos);
    EXPECT_NE(refusal(Volumes::create(small_lattice(), operations, {.level = 2})).find("got 2"),
              std::string::npos);
}

TEST(VolumeHeights, IntervalsEncloseVolumesAndStayElsewhere) {
    const auto source = with_volumes({tunnel(300.0, 500.0, 500.0, -200.0)});
    const WorldRect inside{390.0, 490.0, 410.0, 510.0}, far{800.0, 100.0, 820.0, 120.0};
    EXPECT_LE(source->interval(inside).low, -204.0);
    EXPECT_EQ(source->interval(far).low, source->heights().interval(far).low);
    EXPECT_LE(source->interval({-1e300, -1e300, 1e300, 1e300}).low, -204.0);
}

TEST(VolumeHeights, AVolumeThatTouchesNothingAddsNothing) {
    VolumeOperation above = tunnel(300.0, 500.0, 500.0, 400.0);
    const auto source = with_volumes({above});
    EXPECT_FALSE(source->solid_extent({0, 0, 0}).has_value());
    above.op = VolumeOp::add;
    EXPECT_TRUE(with_volumes({above})->solid_extent({0, 0, 0}).has_value());
    VolumeOperation below = tunnel(300.0, 500.0, 500.0, -400.0);
    below.op = VolumeOp::add;
    EXPECT_FALSE(with_volumes({below})->solid_extent({0, 0, 0}).has_value());
}

TEST(VolumeHeights, BodiesInATunnelHaveItsChunksResident) {
    const auto source = with_volumes({tunnel(100.0, 900.0, 500.0, -60.0)});
    Pager pager = make_pager(source, std::size_t{256} << 20);
    BodyNeed body;
    body.centre_world = {500.0, 500.0, -61.0};
    body.radius = 2.0;
    body.velocity = {10.0, 0.0, 0.0};
    for (int i = 0; i < 5; ++i) pager.update({}, {&body, 1}, 0.1 * i);
    const Ground ground(pager.resident(), pager.contact_level());
    const HeightAnswer floor = ground.height_below(500.0, 500.0, -60.0);
    ASSERT_EQ(floor.status, GroundStatus::ok);
    EXPECT_NEAR(floor.height, -64.0, 0.1);
    EXPECT_EQ(pager.stats().failed, 0u) << pager.last_failure();
}

TEST(VolumeHeights, ACameraHasDistantVolumesLoaded) {
    // The heightfield itself is almost flat: only the tunnel needs fine chunks.
    const auto flat = std::make_shared<const WaveHeights>(small_lattice(), 0.01, 300.0);
    const auto volumes =
        Volumes::create(small_lattice(), std::vector{tunnel(100.0, 900.0, 500.0, -10.0)},
                        {.level = small_lattice().finest_level});
    const auto source = VolumeHeights::create(flat, volumes.value()).value();
    const auto count_solids = [&](double eye_z) {
        Pager pager = make_pager(source, std::size_t{256} << 20);
        CameraNeed camera;
        camera.view.eye_world = {500.0, -200.0, eye_z};
        camera.view.forward = Eigen::Vector3d(0.0, 1.0, -0.2).normalized();
        camera.view.up = Eigen::Vector3d(0.0, 0.2, 1.0).normalized();
        pager.update({&camera, 1}, {}, 0.0);
        int count = 0;
        for (const auto& chunk : pager.resident()->chunks()) count += chunk->solid ? 1 : 0;
        return count;
    };
    EXPECT_EQ(count_solids(100.0), 8);
    EXPECT_EQ(count_solids(1e6), 0);
}

// A claim that is too small is a failed load, whose retry claims what the chunk needs; the ceiling holds throughout.
TEST(VolumeHeights, ClaimsWhatChunksNeed) {
    std::vector<VolumeOperation> operations;
    for (int i = 0; i < 3; ++i) {
        operations.push_back(tunnel(10.0, 1000.0, 490.0 + 8.0 * i, -60.0, 3.0));
    }
    const auto source = with_volumes(operations);
    const std::size_t ceiling = 48'000'000;
    Pager pager = make_pager(source, ceiling);
    BodyNeed body;
    body.radius = 2.0;
    body.velocity = {50.0, 0.0, 0.0};
    for (int i = 0; i < 200; ++i) {
        body.centre_world = {20.0 + 4.8 * i, 500.0, -60.0};
        pager.update({}, {&body, 1}, 0.1 * i);
        ASSERT_LE(pager.stats().peak_bytes, ceiling);
        const Ground ground(pager.resident(), pager.contact_level());
        const HeightAnswer below = ground.height_below(body.centre_world.x(), 500.0, 0.0);
        ASSERT_EQ(below.status, GroundStatus::ok) << i << ": " << pager.last_failure();
    }
    EXPECT_GT(pager.stats().evicted, 0u);
}

}  // namespace volume_heights_test
}  // namespace terrane
