// SPDX-License-Identifier: MIT
//
// A pager over slow or hanging storage: update() never blocks, and the pager can be destroyed. A blocking call would
// hang the test.
#include "pager_scene.h"
#include "support/faulty_heights.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

namespace terrane::pager_stall_test {

using namespace test;

void wait_a_bit() { std::this_thread::sleep_for(std::chrono::milliseconds(1)); }

// The source is released by the detached threads.
void expect_released(const std::shared_ptr<FaultyHeights>& source) {
    while (source.use_count() > 1) std::this_thread::yield();
}

TEST(PagerStall, DoesNotBlockAnUpdateHoweverLongStorageTakes) {
    for (const int delay_ms : {0, 10, 200}) {
        SCOPED_TRACE(testing::Message() << delay_ms << " ms, then for ever");
        const auto source = std::make_shared<FaultyHeights>(
            steep_hills(), std::vector<FaultRule>{{.fault = Fault::hang,
                                                   .delay = std::chrono::milliseconds(delay_ms)}});
        {
            Pager pager = Pager::create(source, {.worker_count = 2}).value();
            int frame = 0;
            for (; frame < 100; ++frame) pager.update({steep_camera()}, {}, 0.01 * frame);
            source->wait_for_hung(2);
            for (; frame < 200; ++frame) pager.update({steep_camera()}, {}, 0.01 * frame);
            EXPECT_EQ(pager.stats().loaded, 0u);
            EXPECT_EQ(pager.stats().late_chunks, 4u);
            EXPECT_EQ(source->question_count(), 2);  // by the threads, none by update()
            source->set_plan({});
            source->release();
            pager.finish();
            EXPECT_EQ(pager.stats().late_chunks, 0u);
        }
        expect_released(source);
    }
}

// With resident chunks, and loads that never end.
TEST(PagerStall, DoesNotBlockAnUpdateDuringAFlight) {
    const auto source = std::make_shared<FaultyHeights>(steep_hills());
    Pager pager = Pager::create(source, {.worker_count = 2}).value();
    pager.update({steep_camera()}, {}, 0.0);
    pager.finish();
    const PagerStats before = pager.stats();
    source->set_plan({{.fault = Fault::hang}});
    const CameraNeed elsewhere = camera_at({-700, -700, 60}, {-600, -650, 0}, kSteepTarget_px);
    const std::vector<BodyNeed> bodies{{.centre_world = {-500, -500, 0}, .radius = 5.0}};
    int frame = 0;
    for (; frame < 10; ++frame) pager.update({elsewhere}, bodies, 1.0 + 0.01 * frame);
    source->wait_for_hung(2);
    for (; frame < 300; ++frame)
        pager.update({frame % 2 == 0 ? elsewhere : steep_camera()}, bodies, 1.0 + 0.01 * frame);
    EXPECT_EQ(pager.stats().loaded, before.loaded);
    EXPECT_GT(pager.stats().late_chunks, 0u);
    source->set_plan({});
    source->release();
    pager.finish();
    EXPECT_EQ(pager.stats().late_chunks, 0u);
}

TEST(PagerStall, OfOneLoadTimesOutAndTheOthersGoOn) {
    const auto ground = steep_hills();
    const auto source = std::make_shared<FaultyHeights>(
        ground, std::vector<FaultRule>{{.fault = Fault::hang, .chunk = kBelow, .times = 1}});
    {
        Pager pager = Pager::create(source, {.worker_count = 2, .load_timeout = 0.5}).value();
        const auto hung_only = [&] {
            return holds(*pager.resident(), kBeside) && pager.stats().timed_out > 0;
        };
        // the clock stands still: no retry
        while (!hung_only()) {
            pager.update({steep_camera()}, {}, 0.0);
            wait_a_bit();
        }
        EXPECT_GE(pager.stats().failed, pager.stats().timed_out);
        EXPECT_FALSE(holds(*pager.resident(), kBelow));
        const Frame frame = draw_steep(pager, *ground);
        EXPECT_EQ(frame.status, MeshStatus::not_resident);
        EXPECT_GT(frame.error_px, kSteepTarget_px);
        // the retry does not hang; the first load still does
        for (double time_s = 20.0; pager.stats().late_chunks > 0; time_s += 0.01) {
            pager.update({steep_camera()}, {}, time_s);
            wait_a_bit();
        }
        EXPECT_TRUE(holds(*pager.resident(), kBelow));
    }
    source->release();
    expect_released(source);
}

TEST(PagerStall, OfEverythingEndsWhenStorageComesBack) {
    const auto source = std::make_shared<FaultyHeights>(
        steep_hills(), std::vector<FaultRule>{{.fault = Fault::hang}});
    Pager pager = Pager::create(source, {.worker_count = 2, .load_timeout = 0.05}).value();
    double time_s = 0.0;
    // each worker's thread has been replaced once
    while (pager.stats().timed_out < 4) {
        pager.update({steep_camera()}, {}, time_s += 0.01);
        wait_a_bit();
    }
    for (int i = 0; i < 100; ++i) pager.update({steep_camera()}, {}, time_s += 0.01);
    EXPECT_EQ(pager.stats().timed_out, 4u);
    EXPECT_EQ(pager.stats().loaded, 0u);
    source->set_plan({});
    source->release();
    while (pager.stats().resident_chunks <= 4 || pager.stats().late_chunks > 0) {
        pager.update({steep_camera()}, {}, time_s += 0.1);
        wait_a_bit();
    }
    EXPECT_GE(pager.stats().failed, 4u);
}

TEST(PagerStall, OfEverythingIsNotWaitedForByFinish) {
    const auto source = std::make_shared<FaultyHeights>(
        steep_hills(), std::vector<FaultRule>{{.fault = Fault::hang}});
    Pager pager = Pager::create(source, {.worker_count = 2, .load_timeout = 0.3}).value();
    pager.update({steep_camera()}, {}, 0.0);
    pager.finish();
    EXPECT_EQ(pager.stats().timed_out, 4u);  // each root
    pager.update({steep_camera()}, {}, 1.0);
    pager.finish();  // no load can start
    EXPECT_EQ(pager.stats().timed_out, 4u);
    EXPECT_EQ(pager.stats().late_chunks, 4u);
    source->set_plan({});
    source->release();
    // on a slow machine a load may time out although it does not hang
    for (double time_s = 20.0; pager.stats().late_chunks > 0; time_s += 10.0) {
        pager.update({steep_camera()}, {}, time_s);
        pager.finish();
    }
    EXPECT_GT(pager.stats().resident_chunks, 4u);
}

TEST(PagerStall, AllowsDestructionAtAnyTimeOfALoad) {
    for (int questions = 0; questions < 30; questions += 3) {
        const auto source = std::make_shared<FaultyHeights>(
            steep_hills(), std::vector<FaultRule>{{.delay = std::chrono::milliseconds(1)}});
        std::shared_ptr<const ResidentSet> set;
        {
            Pager pager = Pager::create(source, {.worker_count = 3}).value();
            for (int frame = 0; source->question_count() < questions || frame == 0; ++frame) {
                pager.update({steep_camera()}, {}, 0.01 * frame);
                std::this_thread::yield();
            }
            set = pager.resident();
        }
        expect_released(source);
        for (const auto& chunk : set->chunks()) EXPECT_FALSE(chunk->heights.empty());
    }
}

// Readers query one set repeatedly while the pager evicts and loads its chunks.
TEST(PagerReaders, GetTheSameAnswersFromASetWhileThePagerEvicts) {
    const auto ground = steep_hills();
    std::mutex mutex;
    std::shared_ptr<const ResidentSet> latest;  // guarded by the mutex
    std::atomic<bool> is_over{false};
    std::atomic<int> rounds{0};
    Pager pager =
        Pager::create(ground, {.memory_bytes = 24 * Chunk::max_bytes(), .worker_count = 2}).value();
    latest = pager.resident();

    const auto read = [&](double shift) {
        while (!is_over) {
            std::shared_ptr<const ResidentSet> set;
            {
                const std::lock_guard lock(mutex);
                set = latest;
            }
            const Ground contact(set, 3);
            std::vector<HeightAnswer> first;
            for (int round = 0; round < 3; ++round) {
                std::size_t at = 0;
                for (double x = -1000.0 + shift; x < 1000.0; x += 90.0) {
                    const HeightAnswer answer = contact.height(x, 0.7 * x);
                    if (answer.status == QueryStatus::ok) {
                        EXPECT_NEAR(answer.height, ground->height(x, 0.7 * x),
                                    answer.error_m + 1e-9);
                    }
                    if (round == 0) {
                        first.push_back(answer);
                        continue;
                    }
                    EXPECT_EQ(answer.status, first[at].status);
                    EXPECT_EQ(answer.height, first[at].height);
                    EXPECT_EQ(answer.normal, first[at].normal);
                    ++at;
                }
                const RayAnswer ray = contact.ray({-900, -900, 80}, {900, 800, -80});
                EXPECT_NE(ray.status, QueryStatus::invalid);
            }
            ++rounds;
        }
    };
    std::thread one(read, 0.0), other(read, 31.0);
    int found = 0;
    for (int frame = 0; frame < 600 || rounds < 20; ++frame) {
        const double x = -900.0 + 30.0 * (frame % 60);
        const WorldPos place(x, 0.7 * x, 20.0);
        const std::vector<BodyNeed> bodies{
            {.centre_world = place, .velocity = {300, 210, 0}, .radius = 30.0}};
        pager.update({camera_at(place, place + WorldPos(50, 35, -9), 1.0)}, bodies, 0.1 * frame);
        if (frame % 10 == 0) pager.finish();  // with slow loads too
        found += holds(*pager.resident(), {0, 0, 3}) ? 1 : 0;
        {
            const std::lock_guard lock(mutex);
            latest = pager.resident();
        }
        wait_a_bit();
    }
    is_over = true;
    one.join();
    other.join();
    EXPECT_GT(pager.stats().evicted, 100u);
    EXPECT_GT(found, 0);
}

}  // namespace terrane::pager_stall_test

// Storage or memory too small for all needs.

namespace terrane::pager_overload_test {

using namespace test;

constexpr double kFrame_s = 0.05;

const Lattice kWorld = small_world(5, 1.0);

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

// Four bodies in a row, too fast for storage: four of ten chunks are loaded ahead of them.
PagerStats race(double speed) {
    const auto ground = std::make_shared<WaveHeights>(kWorld, 200.0, 700.0);
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

// Updates the pager with a body at x that moves at 5 km/s; returns whether its ground is resident.
bool asks_for_ground(Pager& pager, const HeightSource& ground, double x, double time_s) {
    const BodyNeed body{.centre_world = {x, 10.0, ground.height(x, 10.0)},
                        .velocity = {5000.0, 0.0, 0.0},
                        .radius = 1.0};
    pager.update({}, std::vector{body}, time_s);
    return holds(*pager.resident(), key_at(ground, pager.contact_level(), x, 10.0));
}

// Parked bodies keep their velocity; the ground along their path is loaded nevertheless.
TEST(PagerOverload, LoadsTheGroundOfAParkedBody) {
    const auto ground = std::make_shared<WaveHeights>(kWorld, 200.0, 700.0);
    const VirtualStorage slow{.latency = 0.4, .bandwidth = 1e9, .slots = 4};
    Pager pager = Pager::create(ground, {}, storage(slow, *ground)).value();
    int frame = 0;
    // load times are measured first
    for (; frame < 100; ++frame) asks_for_ground(pager, *ground, -3000.0, kFrame_s * frame);
    const int begin = frame;
    while (frame < begin + 60 && !asks_for_ground(pager, *ground, 2000.0, kFrame_s * frame)) {
        ++frame;
    }
    EXPECT_LT(frame, begin + 60);
}

TEST(PagerOverload, LoadsTheGroundOfAParkedBodyOnAStoppedClock) {
    const auto ground = std::make_shared<WaveHeights>(kWorld, 200.0, 700.0);
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

// A vertical oscillation makes the predictions vary.
PagerStats fly_low(std::size_t chunks) {
    const auto ground = std::make_shared<WaveHeights>(kWorld, 200.0, 700.0);
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
        CameraNeed need = camera_at(eye, eye + WorldPos(100.0, 20.0, -20.0), 0.5);
        need.velocity = {kSpeed, 0.0, kHeight * kRate * std::cos(kRate * time_s)};
        pager.update({need}, {}, time_s);
    }
    return pager.stats();
}

TEST(PagerOverload, KeepsChunksThatAreAlmostNeeded) {
    const PagerStats stats = fly_low(70);
    EXPECT_GT(stats.evicted, 100u);
    EXPECT_LE(50 * stats.reloaded, stats.loaded);
}

}  // namespace terrane::pager_overload_test
