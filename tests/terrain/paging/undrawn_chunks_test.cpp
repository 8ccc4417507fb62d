// SPDX-License-Identifier: MIT
//
// Ground that only bodies need: it answers as if all of its chunks were whole, takes little memory, and is drawn as
// soon as a camera needs it.
#include "chunk/chunk_outline.h"
#include "pager_scene.h"
#include "support/random.h"

#include <terrane/terrain/ground.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace terrane::undrawn_chunks_test {

using namespace test;

constexpr int kFinest = 5;
constexpr double kHalf_m = 32.0 * kChunkCells;  // half the side of the world

std::shared_ptr<const WaveHeights> make_waves() {
    return std::make_shared<WaveHeights>(small_world(kFinest, 1.0), 120.0, 150.0);
}

const std::shared_ptr<const WaveHeights>& waves() {
    static const std::shared_ptr<const WaveHeights> heights = make_waves();
    return heights;
}

// Chunks are made once and shared by all pagers.
std::shared_ptr<const Chunk> chunk_of(const ChunkKey& key) {
    static std::map<ChunkKey, std::shared_ptr<const Chunk>> made;
    std::shared_ptr<const Chunk>& chunk = made[key];
    if (!chunk) chunk = make_chunk(*waves(), key).value();
    return chunk;
}

Pager make_pager(const PagerSettings& settings, const VirtualStorage& storage = {}) {
    auto loader = VirtualLoader::create(storage, [](const ChunkKey& key) {
                      return Result<std::shared_ptr<const Chunk>>(chunk_of(key));
                  }).value();
    return Pager::create(waves(), settings, std::move(loader)).value();
}

BodyNeed body_at(double x, double y) {
    return {.centre_world = {x, y, waves()->height(x, y) + 1.0}, .radius = 1.0};
}

// Finishes until the set no longer changes.
void settle(Pager& pager, std::span<const CameraNeed> cameras, std::span<const BodyNeed> bodies,
            double& time_s) {
    for (int i = 0; i < 4; ++i) {
        pager.update(cameras, bodies, time_s += 0.1);
        pager.finish();
    }
}

std::set<ChunkKey> drawn_keys(const Pager& pager) {
    std::set<ChunkKey> keys;
    for (const auto& chunk : pager.resident()->chunks()) keys.insert(chunk->key);
    return keys;
}

std::vector<ChunkKey> all_keys() {
    std::vector<ChunkKey> keys;
    for (int level = 0; level <= kFinest; ++level) {
        const std::int32_t half = 1 << level;
        for (std::int32_t y = -half; y < half; ++y) {
            for (std::int32_t x = -half; x < half; ++x) {
                keys.push_back({x, y, static_cast<std::uint8_t>(level)});
            }
        }
    }
    return keys;
}

// The set with whole chunks in place of outlines: all of them are drawn then.
std::shared_ptr<const ResidentSet> whole(const ResidentSet& set) {
    std::vector<std::shared_ptr<const Chunk>> chunks;
    for (const ChunkKey& key : all_keys()) {
        if (set.find(key) != ResidentSet::kNone || set.find_undrawn(key) != nullptr)
            chunks.push_back(chunk_of(key));
    }
    return std::make_shared<const ResidentSet>(set.lattice(), set.extent(), std::move(chunks), 1);
}

// Checks what holds for every set of a pager.
void check(const Pager& pager) {
    const ResidentSet& set = *pager.resident();
    std::size_t bytes = 0, undrawn = 0;
    for (const auto& chunk : set.chunks()) {
        bytes += chunk->bytes();
        ASSERT_EQ(set.find_undrawn(chunk->key), nullptr) << "it is drawn";
    }
    for (const ChunkKey& key : all_keys()) {
        const UndrawnChunk* const found = set.find_undrawn(key);
        if (found == nullptr) continue;
        ++undrawn;
        ASSERT_NE(found->chunk == nullptr, found->outline == nullptr);
        bytes += found->chunk != nullptr ? found->chunk->bytes() : found->outline->bytes();
        const ChunkKey parent = key.parent();
        const UndrawnChunk* const above = set.find_undrawn(parent);
        ASSERT_TRUE(above != nullptr || set.find(parent) != ResidentSet::kNone);
        if (found->chunk != nullptr) {
            ASSERT_NE(above, nullptr) << "a whole chunk below a drawn one is drawn";
        }
        if (found->outline != nullptr) {
            ASSERT_LT(key.level, pager.contact_level());
        }
    }
    ASSERT_EQ(undrawn, set.undrawn_count());
    const PagerStats stats = pager.stats();
    ASSERT_EQ(stats.resident_chunks, set.chunks().size() + undrawn);
    ASSERT_LE(bytes, stats.resident_bytes);
}

// Compares answers at random places near the bodies.
void compare_answers(const Ground& ground, const Ground& reference,
                     std::span<const BodyNeed> bodies, Random& random, std::size_t& absent_count) {
    for (const BodyNeed& body : bodies) {
        const double x = body.centre_world.x() + random.between(-200, 200);
        const double y = body.centre_world.y() + random.between(-200, 200);
        const HeightAnswer height = ground.height(x, y), expected = reference.height(x, y);
        ASSERT_EQ(height.status, expected.status);
        ASSERT_EQ(height.height, expected.height);
        ASSERT_EQ(height.error_m, expected.error_m);
        const auto column = static_cast<std::int64_t>(std::floor(x / ground.spacing()));
        const auto row = static_cast<std::int64_t>(std::floor(y / ground.spacing()));
        const CellRange cells{column - random.below(300), row - random.below(300),
                              column + random.below(300), row + random.below(300)};
        const RangeAnswer range = ground.range(cells), wanted = reference.range(cells);
        ASSERT_EQ(range.status, wanted.status);
        ASSERT_EQ(range.low, wanted.low);
        ASSERT_EQ(range.high, wanted.high);
        absent_count += range.status == QueryStatus::not_resident ? 1u : 0u;
    }
}

class UndrawnChunks : public testing::TestWithParam<int> {};

// Bodies fall, roll and jump, cameras and regions come and go, memory is ample or scarce.
TEST_P(UndrawnChunks, AnswerAsWholeChunksDoThroughRandomMotions) {
    SeededRandom random(static_cast<std::uint64_t>(GetParam()));
    constexpr std::array<std::size_t, 3> kCeilings{60, 200, 6000};
    const std::size_t ceiling =
        kCeilings[static_cast<std::size_t>(GetParam()) % kCeilings.size()] * Chunk::max_bytes();
    const double spacing = random.below(3) == 0 ? 2.0 : 1.0;
    Pager pager = make_pager({.memory_bytes = ceiling, .contact_spacing = spacing},
                             {.latency = random.between(0.0, 0.05),
                              .bandwidth = random.between(2e7, 1e9),
                              .slots = 1 + random.below(16),
                              .failure_share = random.below(3) == 0 ? 0.1 : 0.0,
                              .seed = static_cast<std::uint64_t>(GetParam())});
    const auto draw_body = [&] {
        BodyNeed body =
            body_at(random.between(-kHalf_m, kHalf_m), random.between(-kHalf_m, kHalf_m));
        body.centre_world.z() += random.between(-2, 30);
        body.velocity = {random.between(-80, 80), random.between(-80, 80), random.between(-20, 5)};
        body.radius = random.between(0.1, 10);
        return body;
    };
    std::vector<BodyNeed> bodies(static_cast<std::size_t>(1 + random.below(40)));
    std::ranges::generate(bodies, draw_body);
    std::vector<CameraNeed> cameras;
    std::vector<RequiredRegion> regions;
    std::array<std::shared_ptr<const ResidentSet>, 2> held;
    std::size_t absent_count = 0, outlines = 0, shown = 0;
    double time_s = 0.0;
    for (int frame = 0; frame < few_or_many(150, 1000) && !HasFailure(); ++frame) {
        SCOPED_TRACE(testing::Message() << "frame " << frame);
        const double step_s = random.between(0.005, 0.05);
        for (BodyNeed& body : bodies) {
            body.centre_world += step_s * body.velocity;
            body.is_waiting = random.below(50) == 0;
            if (random.below(200) == 0) body = draw_body();
        }
        if (random.below(30) == 0) bodies.push_back(draw_body());
        if (random.below(30) == 0 && !bodies.empty()) bodies.pop_back();
        if (random.below(25) == 0) {
            if (cameras.size() < 2 && !bodies.empty()) {
                const WorldPos at = bodies.front().centre_world;
                cameras.push_back(camera_at(at + WorldPos(-60, -20, 40), at, 2.0));
            } else {
                cameras.clear();
            }
        }
        if (random.below(40) == 0) {
            regions.clear();
            const WorldPos at = draw_body().centre_world;
            regions.push_back(pager.require({at.x(), at.y(), at.x() + 150, at.y() + 90}, time_s));
        }
        pager.update(cameras, bodies, time_s += step_s);
        if (random.below(100) == 0) pager.finish();
        check(pager);
        const PagerStats stats = pager.stats();
        ASSERT_LE(stats.resident_bytes + stats.in_flight_bytes, ceiling);
        held[0] = std::exchange(held[1], pager.resident());
        const auto reference = whole(*pager.resident());
        compare_answers(pager.ground(), {reference, pager.contact_level()}, bodies, random,
                        absent_count);
        outlines += pager.resident()->undrawn_count();
        shown += pager.resident()->chunks().size();
    }
    EXPECT_GT(absent_count, 50u);
    EXPECT_GT(outlines, 300u);
    EXPECT_GT(shown, 500u);
}

INSTANTIATE_TEST_SUITE_P(Seeds, UndrawnChunks, testing::Range(0, 12));

TEST(Undrawn, ABodyTakesLessThanHalfAMegabyte) {
    constexpr int kBodies = 50;
    constexpr std::uint64_t kSeed = 3;
    SeededRandom random(kSeed);
    Pager pager = make_pager({});
    double time_s = 0.0;
    settle(pager, {}, {}, time_s);
    const std::size_t roots = pager.stats().resident_bytes;
    std::vector<BodyNeed> bodies;
    for (int i = 0; i < kBodies; ++i) {
        bodies.push_back(
            body_at(random.between(-kHalf_m, kHalf_m), random.between(-kHalf_m, kHalf_m)));
    }
    settle(pager, {}, bodies, time_s);
    EXPECT_EQ(pager.stats().groundless_bodies, 0u);
    EXPECT_EQ(pager.stats().late_chunks, 0u);
    EXPECT_EQ(pager.resident()->chunks().size(), 4u);
    EXPECT_LT(pager.stats().resident_bytes - roots, std::size_t{kBodies} * 500'000);
    // one more body in the same place needs nothing
    const std::size_t bytes = pager.stats().resident_bytes;
    bodies.resize(10'000, bodies.front());
    settle(pager, {}, bodies, time_s);
    EXPECT_EQ(pager.stats().resident_bytes, bytes);
    EXPECT_EQ(pager.stats().groundless_bodies, 0u);
}

TEST(Undrawn, ACameraShowsWhatItWouldShowWithoutBodies) {
    constexpr std::uint64_t kSeed = 4;
    SeededRandom random(kSeed);
    for (int run = 0; run < 6; ++run) {
        SCOPED_TRACE(testing::Message() << "run " << run);
        const double x = random.between(-3000, 3000), y = random.between(-3000, 3000);
        const double z = waves()->height(x, y);
        const std::vector<CameraNeed> cameras{
            camera_at({x - 80, y - 30, z + 60}, {x, y, z}, kSteepTarget_px)};
        std::vector<BodyNeed> bodies;
        for (int i = 0; i < 20; ++i) {
            bodies.push_back(body_at(x + random.between(-300, 300), y + random.between(-300, 300)));
        }
        Pager alone = make_pager({}), pager = make_pager({});
        double time_s = 0.0, alone_s = 0.0;
        settle(alone, cameras, {}, alone_s);
        settle(pager, {}, bodies, time_s);
        EXPECT_EQ(pager.resident()->chunks().size(), 4u);
        EXPECT_GT(pager.resident()->undrawn_count(), 5u);
        settle(pager, cameras, bodies, time_s);
        check(pager);
        const std::set<ChunkKey> needed = drawn_keys(alone), drawn = drawn_keys(pager);
        EXPECT_TRUE(std::ranges::includes(drawn, needed));
        EXPECT_EQ(pager.stats().late_chunks, 0u);
        const View& view = cameras[0].view;
        const Frame frame = draw(pager.resident(), *waves(), view, kSteepTarget_px);
        const Frame expected = draw(alone.resident(), *waves(), view, kSteepTarget_px);
        EXPECT_EQ(frame.status, expected.status);
        EXPECT_LE(frame.error_px, expected.error_px);
    }
}

TEST(Undrawn, ChunksThatACameraBeginsToSeeFadeIn) {
    Pager pager = make_pager({}, {.latency = 0.001, .bandwidth = 1e9});
    const WorldPos at(700, -900, waves()->height(700, -900));
    const std::vector<BodyNeed> bodies{body_at(at.x(), at.y())};
    const std::vector<CameraNeed> far{camera_at(at + WorldPos(-1500, 0, 900), at, 20.0)};
    double time_s = 0.0;
    settle(pager, far, bodies, time_s);
    const ResidentSet before = *pager.resident();
    ASSERT_GT(before.undrawn_count(), 0u);
    std::vector<CameraNeed> near = far;
    near[0].threshold_px = 0.5;
    std::size_t fading = 0;
    for (int frame = 0; frame < 200; ++frame) {
        near[0].view.eye_world += WorldPos(4, 0, -1);
        near[0].velocity = WorldPos(240, 0, -60);
        pager.update(near, bodies, time_s += 1.0 / 60.0);
        const ResidentSet& set = *pager.resident();
        for (std::size_t i = 0; i < set.chunks().size(); ++i) {
            const bool was_undrawn = before.find_undrawn(set.chunks()[i]->key) != nullptr;
            fading += was_undrawn && set.fade(i) < 1.0f ? 1u : 0u;
        }
    }
    EXPECT_GT(fading, 0u);
}

TEST(Undrawn, ARequiredRegionIsReadyWhenItsGroundCanBeDrawn) {
    Pager pager = make_pager({}, {.latency = 0.01});
    const std::vector<BodyNeed> bodies{body_at(700, -900)};
    double time_s = 0.0;
    settle(pager, {}, bodies, time_s);
    ASSERT_EQ(pager.resident()->chunks().size(), 4u);
    const RequiredRegion region = pager.require({690, -910, 710, -890}, 0.0);
    EXPECT_FALSE(region.is_ready());
    settle(pager, {}, bodies, time_s);
    EXPECT_TRUE(region.is_ready());
    const ChunkKey contact{5, -8, kFinest};
    EXPECT_NE(pager.resident()->find(contact), ResidentSet::kNone);
}

// A camera has seen the ground of bodies and is gone: when memory is short, only outlines remain of coarser chunks.
TEST(Undrawn, CoarserChunksGiveWayWhereMemoryIsShort) {
    constexpr std::size_t kChunks = 30;
    Pager pager = make_pager({.memory_bytes = kChunks * Chunk::max_bytes()});
    std::vector<BodyNeed> bodies;
    double time_s = 0.0;
    for (int i = 0; i < 12; ++i) {
        bodies.push_back(body_at(-3500 + 600 * i, 2000));
        const WorldPos at = bodies.back().centre_world;
        const RequiredRegion region =
            pager.require({at.x() - 1, at.y() - 1, at.x() + 1, at.y() + 1}, 0.0);
        settle(pager, {}, bodies, time_s);
        check(pager);
        EXPECT_TRUE(region.is_ready());
        EXPECT_EQ(pager.stats().groundless_bodies, 0u);
        EXPECT_LE(pager.stats().peak_bytes, kChunks * Chunk::max_bytes());
    }
    EXPECT_GT(pager.resident()->undrawn_count(), 10u);
}

TEST(Undrawn, TenThousandBodiesKeepACeiling) {
    constexpr std::size_t kChunks = 300;
    constexpr std::uint64_t kSeed = 8;
    SeededRandom random(kSeed);
    Pager pager = make_pager({.memory_bytes = kChunks * Chunk::max_bytes()},
                             {.latency = 0.001, .bandwidth = 1e9, .slots = 16});
    std::vector<BodyNeed> bodies(10'000);
    for (BodyNeed& body : bodies) {
        body = body_at(random.between(-kHalf_m, kHalf_m), random.between(-kHalf_m, kHalf_m));
    }
    bodies[17].centre_world.x() = std::numeric_limits<double>::quiet_NaN();
    for (int frame = 1; frame < 200; ++frame) {
        pager.update({}, bodies, frame / 60.0);
        ASSERT_LE(pager.stats().peak_bytes, kChunks * Chunk::max_bytes());
    }
    check(pager);
    EXPECT_EQ(pager.stats().refused_needs, 199u);
    EXPECT_GT(pager.stats().resident_chunks, kChunks);
    const std::size_t groundless = pager.stats().groundless_bodies;
    EXPECT_GT(groundless, 5000u);
    EXPECT_LT(groundless, 9900u);
    // all jump to one place
    for (BodyNeed& body : bodies) body = body_at(40, 40);
    for (int frame = 200; frame < 260; ++frame) pager.update({}, bodies, frame / 60.0);
    EXPECT_EQ(pager.stats().groundless_bodies, 0u);
    // no bodies
    for (int frame = 260; frame < 400; ++frame) pager.update({}, {}, frame / 60.0);
    EXPECT_EQ(pager.stats().groundless_bodies, 0u);
    EXPECT_EQ(pager.stats().late_chunks, 0u);
}

}  // namespace terrane::undrawn_chunks_test
