// SPDX-License-Identifier: MIT
// Chunks in view fade out before they are evicted at the memory ceiling.
#include "fade_frames.h"
#include "support/random.h"

#include <gtest/gtest.h>

namespace terrane {
namespace fade_out_test {

using namespace test;

TEST(Fade, LeavesNoJumpInAFlightAtTheMemoryCeiling) {
    const std::size_t ceiling = 60 * Chunk::max_bytes();
    const auto source = hills(250.0);
    Pager pager = Pager::create(source, {.memory_bytes = ceiling, .worker_count = 0}).value();
    // backwards, so that evicted chunks are in view; with pauses of the loader
    const Flight flight = fly(pager, 300, [&](int frame) {
        source->is_broken = frame % 100 > 70;
        const WorldPos eye(200.0 + 1.5 * frame, 100.0, 120.0);
        return camera_at(eye, eye + WorldPos(-100, 20, -20), 0.2);
    });
    EXPECT_EQ(flight.jump_count, 0);
    EXPECT_LE(flight.most_px, kMostMove_px * kSlack);
    EXPECT_GT(flight.arrival_count, 10);
    EXPECT_GT(flight.eviction_count, 10);
    EXPECT_GT(flight.leaving_count, 10);
    EXPECT_GT(flight.coming_count, 10);
    const PagerStats stats = pager.stats();
    EXPECT_EQ(stats.hard_evictions, 0u);
    EXPECT_GT(stats.over_ceiling, 0u);
    EXPECT_LE(stats.peak_bytes, ceiling);
}

// One camera fills the memory; a second one needs some of it and is removed again.
TEST(Fade, RisesAgainForAVictimThatIsNeededAgain) {
    const CameraNeed first = camera_at({0, 0, 300}, {500, 300, 0}, 0.2);
    const CameraNeed second = camera_at({-900, -900, 60}, {-500, -700, 0}, 0.1);
    Pager pager =
        Pager::create(hills(250.0), {.memory_bytes = 60 * Chunk::max_bytes(), .worker_count = 0})
            .value();
    double time_s = 0.0;
    const auto update = [&](const std::vector<CameraNeed>& cameras) {
        pager.update(cameras, {}, time_s += 0.01);
    };
    for (int i = 0; i < 3; ++i) update({first});
    ASSERT_EQ(pager.stats().fading_chunks, 0u);
    const std::size_t evicted = pager.stats().evicted;
    for (int i = 0; i < 3; ++i) update({first, second});
    const auto fades = fades_of(*pager.resident());
    ASSERT_GT(pager.stats().fading_chunks, 0u);
    update({first});
    std::size_t fading_count = 0;
    for (const auto& [key, fade] : fades_of(*pager.resident())) {
        const auto found = fades.find(key);
        if (found == fades.end()) continue;
        EXPECT_GE(fade, found->second);
        fading_count += fade < 1.0f ? 1u : 0u;
    }
    EXPECT_GT(fading_count, 0u) << "came back at once";
    for (int i = 0; i < 100; ++i) update({first});
    EXPECT_EQ(pager.stats().fading_chunks, 0u);
    EXPECT_LT(pager.stats().evicted - evicted, 60u);
}

// If victims alternated, none would ever be evicted.
TEST(Fade, ContinuesWithTheSameVictims) {
    Pager pager =
        Pager::create(hills(250.0), {.memory_bytes = 150 * Chunk::max_bytes(), .worker_count = 0})
            .value();
    std::map<ChunkKey, float> before;
    std::map<ChunkKey, bool> is_falling;
    int fall_count = 0;
    int return_count = 0;
    for (int frame = 0; frame < 300; ++frame) {
        const WorldPos eye(200.0 + 1.5 * frame, 100.0, 120.0);
        pager.update(std::vector<CameraNeed>{camera_at(eye, eye + WorldPos(-100, 20, -40), 0.2)},
                     {}, frame / 60.0);
        std::map<ChunkKey, float> now = fades_of(*pager.resident());
        for (const auto& [key, fade] : now) {
            const auto found = before.find(key);
            if (found == before.end() || fade == found->second) continue;
            const bool falls = fade < found->second;
            fall_count += falls ? 1 : 0;
            return_count += !falls && is_falling[key] ? 1 : 0;
            is_falling[key] = falls;
        }
        before = std::move(now);
    }
    EXPECT_GT(fall_count, 100);
    EXPECT_LE(return_count, 2);
}

TEST(Fade, TakesAtMostSixteenChunksOutAtATime) {
    const CameraNeed first = camera_at({0, 0, 300}, {500, 300, 0}, 0.1);
    const CameraNeed second = camera_at({-900, -900, 60}, {-500, -700, 0}, 0.1);
    Pager pager =
        Pager::create(hills(250.0), {.memory_bytes = 150 * Chunk::max_bytes(), .worker_count = 0})
            .value();
    for (int i = 0; i < 3; ++i) pager.update(std::vector<CameraNeed>{first}, {}, 0.01 * i);
    for (int i = 0; i < 3; ++i) {
        pager.update(std::vector<CameraNeed>{first, second}, {}, 0.03 + 0.01 * i);
        EXPECT_EQ(pager.stats().fading_chunks, 16u);
    }
}

TEST(Fade, IsSkippedForGroundAndCounted) {
    const std::size_t ceiling = 60 * Chunk::max_bytes();
    Pager pager = Pager::create(hills(), {.memory_bytes = ceiling, .worker_count = 0}).value();
    const std::vector<CameraNeed> cameras{camera_at({0, 0, 300}, {500, 300, 0}, 0.05)};
    for (int i = 0; i < 3; ++i) pager.update(cameras, {}, 0.01 * i);
    EXPECT_EQ(pager.stats().hard_evictions, 0u);
    const Pager::Ticket ticket = pager.require({-900, -900, -400, -400}, 0.0);
    pager.update(cameras, {}, 0.03);
    EXPECT_TRUE(pager.is_ready(ticket));
    EXPECT_GT(pager.stats().hard_evictions, 0u);
    EXPECT_LE(pager.stats().peak_bytes, ceiling);
}

// finish() does not wait for fades.
TEST(Fade, DoesNotDelayEvictionsOfFinish) {
    const std::size_t ceiling = 60 * Chunk::max_bytes();
    Pager pager = Pager::create(hills(250.0), {.memory_bytes = ceiling, .worker_count = 0}).value();
    const CameraNeed first = camera_at({0, 0, 300}, {500, 300, 0}, 0.2);
    const CameraNeed second = camera_at({-900, -900, 60}, {-500, -700, 0}, 0.1);
    for (int i = 0; i < 3; ++i) pager.update(std::vector<CameraNeed>{first}, {}, 0.01 * i);
    pager.update(std::vector<CameraNeed>{first, second}, {}, 0.03);
    const std::uint64_t loaded = pager.stats().loaded;
    pager.update(std::vector<CameraNeed>{first, second}, {}, 0.04);
    EXPECT_EQ(pager.stats().loaded, loaded) << "no load waits for a fade";
    pager.finish();
    EXPECT_GT(pager.stats().loaded, loaded);
    EXPECT_EQ(least_fade(*pager.resident()), 1.0f);
    EXPECT_EQ(pager.stats().hard_evictions, 0u);
    EXPECT_LE(pager.stats().peak_bytes, ceiling);
}

TEST(Fade, IsTheSameForTheSameUpdates) {
    for (const std::uint64_t seed : {1u, 2u}) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        const auto play = [seed] {
            test::Random random(seed);
            Pager pager =
                Pager::create(hills(), {.memory_bytes = 50 * Chunk::max_bytes(), .worker_count = 0})
                    .value();
            std::vector<Set> sets;
            WorldPos eye(0, 0, 150);
            for (int frame = 0; frame < 80; ++frame) {
                eye += WorldPos(random.between(-2, 4), random.between(-3, 3), 0.0);
                pager.update(std::vector<CameraNeed>{camera_at(
                                 eye, eye + WorldPos(-100, random.between(-30, 30), -20), 0.2)},
                             {}, 0.02 * frame);
                sets.push_back(pager.resident());
                if (frame > 1) sets[static_cast<std::size_t>(frame) - 2].reset();
            }
            return std::pair(fades_of(*pager.resident()), pager.resident()->epoch());
        };
        const auto once = play();
        EXPECT_EQ(once, play());
        EXPECT_GT(once.second, 20u);
    }
}

// A set that is kept for two frames, as by a triangulator, holds evicted bytes.
TEST(Fade, EvictsNoMoreWhileBytesAreAboutToBeReleased) {
    // bytes of chunks of hills, which have no flags, plus a maximal one: the memory must be full
    const std::size_t each = make_chunk(*hills(), {0, 0, 1}).value()->bytes();
    const std::size_t ceiling = 56 * each + Chunk::max_bytes();
    Pager pager = Pager::create(hills(), {.memory_bytes = ceiling, .worker_count = 0}).value();
    const std::vector<CameraNeed> here{camera_at({0, 0, 300}, {500, 300, 0}, 0.2)};
    for (int i = 0; i < 3; ++i) pager.update(here, {}, 0.01 * i);
    const Set held = pager.resident();
    const std::size_t count = held->chunks().size();
    const std::uint64_t evicted = pager.stats().evicted;
    const Pager::Ticket ticket = pager.require({-900, -900, -899, -899}, 0.0);
    for (int i = 0; i < 3; ++i) pager.update(here, {}, 0.1 + 0.01 * i);
    EXPECT_FALSE(pager.is_ready(ticket));
    EXPECT_LE(pager.stats().evicted - evicted, 4u);
    EXPECT_GE(pager.resident()->chunks().size(), count - 4);
    EXPECT_LE(pager.stats().peak_bytes, ceiling);
}

}  // namespace fade_out_test
}  // namespace terrane
