// SPDX-License-Identifier: MIT
//
// Storage or memory does not suffice for all needs.
#include "pager_scene.h"

#include <terrane/terrain/chunk_loader.h>

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <map>
#include <thread>
#include <vector>

namespace terrane {
namespace pager_overload_test {

constexpr double kFrame_s = 0.05;

const Lattice kWorld = test::small_world(5, 1.0);

std::unique_ptr<ChunkLoader> storage(const VirtualStorage& settings, const HeightSource& ground) {
    return VirtualLoader::create(settings,
                                 [&ground](const ChunkKey& key) {
                                     static std::map<ChunkKey, std::shared_ptr<const Chunk>> made;
                                     std::shared_ptr<const Chunk>& chunk = made[key];
                                     if (!chunk) chunk = make_chunk(ground, key).value();
                                     return Result<std::shared_ptr<const Chunk>>(chunk);
                                 })
        .value();
}

ChunkKey key_at(const HeightSource& ground, int level, double x, double y) {
    const Lattice& lattice = ground.lattice();
    const double side = lattice.level_spacing(level) * kChunkCells;
    return {static_cast<std::int32_t>(std::floor((x - lattice.origin_x) / side)),
            static_cast<std::int32_t>(std::floor((y - lattice.origin_y) / side)),
            static_cast<std::uint8_t>(level)};
}

// Four bodies in a row, faster than storage can load ground ahead of them: four of ten chunks.
PagerStats race(double speed) {
    const auto ground = std::make_shared<test::WaveHeights>(kWorld, 200.0, 700.0);
    const double chunk_s = 1.0 / 64.0;
    const VirtualStorage slow{.latency = 0.002,
                              .bandwidth = static_cast<double>(Chunk::max_bytes()) / chunk_s,
                              .slots = 8};
    Pager pager = Pager::create(ground, {}, storage(slow, *ground)).value();
    for (int frame = 0; frame < 120; ++frame) {
        std::vector<BodyNeed> bodies(4);
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            const double x = -3000.0 + kFrame_s * frame * speed;
            const double y = 500.0 * static_cast<double>(i) - 750.0;
            bodies[i] = {.centre_world = {x, y, ground->height(x, y)},
                         .velocity = {speed, 0.0, 0.0},
                         .radius = 1.0};
        }
        pager.update({}, bodies, kFrame_s * frame);
    }
    return pager.stats();
}

TEST(PagerOverload, BeginsNoLoadOfGroundThatABodyWillHavePassed) {
    for (const double speed : {100.0, 1000.0, 3000.0}) {
        const PagerStats stats = race(speed);
        const double wasted =
            1.0 - static_cast<double>(stats.bytes_used) / static_cast<double>(stats.bytes_read);
        EXPECT_GT(stats.loaded, 40u);
        EXPECT_LT(wasted, 0.25);
    }
}

// At 5 km/s.
bool asks_for_ground(Pager& pager, const HeightSource& ground, double x, double time_s) {
    const BodyNeed body{.centre_world = {x, 10.0, ground.height(x, 10.0)},
                        .velocity = {5000.0, 0.0, 0.0},
                        .radius = 1.0};
    pager.update({}, std::vector{body}, time_s);
    return test::holds(*pager.resident(), key_at(ground, pager.contact_level(), x, 10.0));
}

// Bodies are parked and keep their velocity: the ground that they should have passed is loaded nevertheless.
TEST(PagerOverload, LoadsTheGroundOfAParkedBody) {
    const auto ground = std::make_shared<test::WaveHeights>(kWorld, 200.0, 700.0);
    const VirtualStorage slow{.latency = 0.4, .bandwidth = 1e9, .slots = 4};
    Pager pager = Pager::create(ground, {}, storage(slow, *ground)).value();
    int frame = 0;
    // measures the load times
    for (; frame < 100; ++frame) asks_for_ground(pager, *ground, -3000.0, kFrame_s * frame);
    const int begin = frame;
    while (frame < begin + 60 && !asks_for_ground(pager, *ground, 2000.0, kFrame_s * frame)) {
        ++frame;
    }
    EXPECT_LT(frame, begin + 60);
}

TEST(PagerOverload, LoadsTheGroundOfAParkedBodyOnAStoppedClock) {
    const auto ground = std::make_shared<test::WaveHeights>(kWorld, 200.0, 700.0);
    ground->delay_ms = 40;
    Pager pager = Pager::create(ground, {.worker_count = 2}).value();
    int updates = 0;
    const auto wait_at = [&](double x, double time_s) {
        for (updates = 0; updates < 5000 && !asks_for_ground(pager, *ground, x, time_s); ++updates)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return updates < 5000;
    };
    EXPECT_TRUE(wait_at(-3000.0, 0.0));
    EXPECT_TRUE(wait_at(2000.0, 0.1));
    EXPECT_GT(updates, 0);
}

// Predictions vary with a vertical oscillation.
PagerStats fly_low(std::size_t chunks) {
    const auto ground = std::make_shared<test::WaveHeights>(kWorld, 200.0, 700.0);
    const VirtualStorage quick{.latency = 0.005, .bandwidth = 100e6, .slots = 16};
    Pager pager = Pager::create(ground, {.memory_bytes = chunks * Chunk::max_bytes()},
                                storage(quick, *ground))
                      .value();
    constexpr double kSpeed = 400.0;
    constexpr double kRate = 6.0;  // 1/s
    constexpr double kHeight = 10.0;
    for (int frame = 0; frame < 300; ++frame) {
        const double time_s = kFrame_s * frame;
        const WorldPos eye(-3000.0 + kSpeed * time_s, 100.0,
                           300.0 + kHeight * std::sin(kRate * time_s));
        CameraNeed need = test::camera_at(eye, eye + WorldPos(100.0, 20.0, -20.0), 0.5);
        need.velocity = {kSpeed, 0.0, kHeight * kRate * std::cos(kRate * time_s)};
        pager.update(std::vector{need}, {}, time_s);
    }
    return pager.stats();
}

TEST(PagerOverload, KeepsChunksThatAreAlmostNeeded) {
    const PagerStats stats = fly_low(70);
    EXPECT_GT(stats.evicted, 100u);
    EXPECT_LE(50 * stats.reloaded, stats.loaded);
}

}  // namespace pager_overload_test
}  // namespace terrane
