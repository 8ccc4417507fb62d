// SPDX-License-Identifier: MIT
#include "pager_scene.h"
#include "support/random.h"

#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/solid_surface.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <thread>
#include <vector>

namespace terrane::pager_test {

using namespace test;

std::shared_ptr<WaveHeights> hills() {
    return std::make_shared<WaveHeights>(test::small_world(4, 1.0), 200.0, 700.0);
}

CameraNeed camera_at(const WorldPos& eye, const WorldPos& target) {
    return test::camera_at(eye, target, 0.5);
}

std::vector<ChunkKey> keys_of(const ResidentSet& set) {
    std::vector<ChunkKey> keys;
    for (const auto& chunk : set.chunks()) keys.push_back(chunk->key);
    return keys;
}

// Updates as a frame loop does, until nothing is late.
int settle(Pager& pager, const CameraNeed& camera) {
    for (int frame = 0; frame < 2000; ++frame) {
        pager.update({camera}, {}, 0.01 * frame);
        if (frame > 0 && pager.stats().late_chunks == 0) return frame;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return -1;
}

TEST(Pager, LoadsTheSameSetWithWorkersAsWithout) {
    const CameraNeed camera = camera_at({0, 0, 300}, {500, 300, 0});
    Pager synchronous = Pager::create(hills(), {.worker_count = 0}).value();
    synchronous.update({camera}, {}, 0.0);
    EXPECT_EQ(synchronous.stats().late_chunks, 0u);
    for (const int workers : {1, 2, 4}) {
        Pager pager = Pager::create(hills(), {.worker_count = workers}).value();
        pager.update({camera}, {}, 0.0);
        pager.finish();
        EXPECT_EQ(keys_of(*pager.resident()), keys_of(*synchronous.resident()));
    }
    EXPECT_GT(synchronous.resident()->chunks().size(), 20u);
}

TEST(Pager, NeverExceedsItsCeiling) {
    Random random(5);
    for (const int workers : {0, 2}) {
        SCOPED_TRACE(testing::Message() << workers << " workers, seed 5");
        const std::size_t ceiling = 40 * Chunk::max_bytes();
        Pager pager =
            Pager::create(hills(), {.memory_bytes = ceiling, .worker_count = workers}).value();
        std::shared_ptr<const ResidentSet> held;  // as by a triangulator
        for (int frame = 0; frame < 150; ++frame) {
            const WorldPos eye(random.between(-900, 900), random.between(-900, 900), 40.0);
            pager.update({camera_at(eye, eye + WorldPos(50, 10, -5))}, {}, 0.02 * frame);
            if (workers > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
            // workers reach the ceiling even on a slow machine
            if (workers > 0 && frame % 10 == 9) pager.finish();
            held = pager.resident();
            const PagerStats stats = pager.stats();
            ASSERT_LE(stats.resident_bytes, ceiling);
            ASSERT_LE(stats.peak_bytes, ceiling);
            for (std::size_t i = 0; i < held->chunks().size(); ++i) {
                const bool is_root = held->chunks()[i]->key.level == 0;
                ASSERT_TRUE(is_root || held->links(i).parent != ResidentSet::kNone);
            }
        }
        EXPECT_GT(pager.stats().evicted, 0u);
        EXPECT_GT(pager.stats().over_ceiling + pager.stats().evicted, 0u);
    }
}

TEST(Pager, RefusesACeilingBelowTheRoots) {
    const auto refused = Pager::create(hills(), {.memory_bytes = 4 * Chunk::max_bytes() - 1});
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, ErrorCode::out_of_memory);
    EXPECT_TRUE(Pager::create(hills(), {.memory_bytes = 4 * Chunk::max_bytes()}).has_value());
}

TEST(Pager, KeepsACeilingThatIsLoweredBelowWhatIsResident) {
    const std::size_t roots = 4 * Chunk::max_bytes(), low = 16 * Chunk::max_bytes();
    const CameraNeed camera = camera_at({0, 0, 300}, {500, 300, 0});
    const std::vector<BodyNeed> bodies{{.centre_world = {60, 60, 0}, .radius = 40.0}};
    for (const int workers : {0, 2}) {
        SCOPED_TRACE(testing::Message() << workers << " workers");
        Pager pager = Pager::create(hills(), {.worker_count = workers}).value();
        pager.update({camera}, bodies, 0.0);
        pager.finish();
        const std::size_t high = pager.stats().resident_bytes;
        const std::vector<ChunkKey> before = keys_of(*pager.resident());
        ASSERT_GT(high, 2 * low);
        ASSERT_TRUE(pager.set_memory_bytes(low).has_value());
        pager.update({camera}, bodies, 0.01);
        for (int frame = 2; frame < 100; ++frame) {
            ASSERT_LE(pager.stats().resident_bytes + pager.stats().in_flight_bytes, low) << frame;
            const std::shared_ptr<const ResidentSet> held = pager.resident();  // as a triangulator
            pager.update({camera}, bodies, 0.01 * frame);
        }
        // the camera's chunks went, not the ground that bodies touch
        EXPECT_GT(pager.stats().evicted, 0u);
        EXPECT_EQ(pager.stats().groundless_bodies, 0u);
        EXPECT_GT(pager.stats().resident_bytes, low / 2);
        // even that goes where only the roots fit
        pager.finish();
        ASSERT_TRUE(pager.set_memory_bytes(roots).has_value());
        pager.update({camera}, bodies, 1.0);
        EXPECT_LE(pager.stats().resident_bytes + pager.stats().in_flight_bytes, roots);
        EXPECT_EQ(pager.resident()->chunks().size(), 4u);
        const Result<void> refused = pager.set_memory_bytes(roots - 1);
        ASSERT_FALSE(refused.has_value());
        EXPECT_EQ(refused.error().code, ErrorCode::out_of_memory);
        ASSERT_TRUE(pager.set_memory_bytes(2 * high).has_value());
        pager.update({camera}, bodies, 2.0);
        pager.finish();
        EXPECT_EQ(pager.stats().late_chunks, 0u);
        EXPECT_EQ(pager.stats().groundless_bodies, 0u);
        EXPECT_GT(pager.stats().resident_bytes, low);
        // Loader threads measure how long loads take, and needs reach further ahead where loads take longer.
        if (workers == 0) {
            EXPECT_EQ(keys_of(*pager.resident()), before);
        }
    }
}

TEST(Pager, CancelsQueuedLoadsAfterATeleport) {
    const auto source = hills();
    source->delay_ms = 2;
    Pager pager = Pager::create(source, {.worker_count = 1}).value();
    pager.update({}, {}, 0.0);
    pager.finish();  // the roots
    const auto look = [&](double x) { return camera_at({x, x, 60}, {x + 40, x + 30, 0}); };
    EXPECT_GE(settle(pager, look(-1500.0)), 0);
    pager.update({look(1500.0)}, {}, 50.0);
    pager.update({look(1500.0)}, {}, 50.01);
    pager.update({look(-100.0)}, {}, 50.02);
    EXPECT_GT(pager.stats().cancelled, 0u);
    EXPECT_GE(settle(pager, look(-100.0)), 0);
}

TEST(Pager, LoadsARequiredRegionAtContactLevelAndKeepsIt) {
    Pager pager =
        Pager::create(hills(), {.memory_bytes = 30 * Chunk::max_bytes(), .worker_count = 0})
            .value();
    const WorldRect region{-200.0, 100.0, -100.0, 250.0};
    RequiredRegion required = pager.require(region, 1.0);
    EXPECT_FALSE(required.is_ready());
    pager.update({}, {}, 0.0);
    EXPECT_TRUE(required.is_ready());
    const auto look_elsewhere = [&](int frame, double time_s) {
        const WorldPos eye(1000.0 - 20.0 * frame, -1000.0, 30.0);
        pager.update({camera_at(eye, eye + WorldPos(30, -30, -3))}, {}, time_s);
    };
    // cameras elsewhere with more needs than fit do not evict it
    for (int frame = 0; frame < 30; ++frame) {
        look_elsewhere(frame, 0.1 * frame);
        ASSERT_TRUE(required.is_ready());
    }
    required = RequiredRegion();  // as its destructor
    EXPECT_FALSE(required.is_ready());
    for (int frame = 0; frame < 30; ++frame) look_elsewhere(frame, 4.0 + frame);
    EXPECT_FALSE(pager.require(region, 1.0).is_ready());
}

TEST(Pager, LoadsTheGroundAlongABodysTrajectory) {
    Pager pager = Pager::create(hills(), {.worker_count = 0, .horizon = 2.0}).value();
    const std::vector<BodyNeed> bodies{
        {.centre_world = {0, 0, 100}, .velocity = {400, 0, -50}, .radius = 1.0}};
    pager.update({}, bodies, 0.0);
    const ResidentSet& set = *pager.resident();
    for (double x = 0.0; x <= 800.0; x += 50.0) {
        const ChunkKey key{static_cast<std::int32_t>(std::floor(x / 128.0)), 0, 4};
        EXPECT_TRUE(test::holds(set, key)) << "x " << x;
    }
    EXPECT_FALSE(test::holds(set, {-8, 0, 4}));
}

TEST(Pager, CountsBodiesWithoutGround) {
    const auto source = hills();
    source->is_held = true;
    Pager pager = Pager::create(source, {.worker_count = 1}).value();
    const double z = source->height(0, 0);
    std::vector<BodyNeed> bodies{{.centre_world = {0, 0, z}, .radius = 1.0},
                                 {.centre_world = {0, 0, 1e6}, .radius = 1.0},
                                 {.centre_world = {900, 0, -1e6}, .radius = 1.0}};
    pager.update({}, bodies, 0.0);
    EXPECT_EQ(pager.stats().groundless_bodies, 2u);
    source->is_held = false;
    pager.finish();
    EXPECT_EQ(pager.stats().groundless_bodies, 0u);
    EXPECT_EQ(pager.stats().cut_needs, 0u);
    // exceeds the work limit
    bodies.assign(2000, {.centre_world = {0, 0, z}, .radius = 1e7});
    pager.update({}, bodies, 1.0);
    EXPECT_GT(pager.stats().cut_needs, 0u);
}

// The caller may change a trajectory after update() has returned.
TEST(Pager, CopiesTrajectoriesForFinish) {
    Pager pager = Pager::create(hills(), {.worker_count = 1}).value();
    std::vector<BodyMoment> trajectory{
        {0.1, {0, 0, 0}}, {0.1, {900, 900, 0}}, {0.2, {900, 900, 0}}};
    const std::vector<BodyNeed> bodies{
        {.centre_world = {0, 0, 0}, .radius = 1.0, .trajectory = trajectory}};
    pager.update({}, bodies, 0.0);
    for (BodyMoment& moment : trajectory) moment.centre_world = {-900, -900, 0};
    pager.finish();
    EXPECT_TRUE(test::holds(*pager.resident(), {7, 7, 4}));
    EXPECT_FALSE(test::holds(*pager.resident(), {-8, -8, 4}));
}

TEST(Pager, LoadsAheadOfAFastCamera) {
    const auto far_child = [](const Eigen::Vector3d& velocity) {
        Pager pager = Pager::create(hills(), {.worker_count = 0, .horizon = 3.0}).value();
        CameraNeed camera = camera_at({-1500, -1500, 50}, {-1400, -1500, 0});
        camera.velocity = velocity;
        pager.update({camera}, {}, 0.0);
        return pager.resident()->find({-1, -12, 4}) != ResidentSet::kNone;  // 1.4 km further east
    };
    EXPECT_FALSE(far_child({0, 0, 0}));
    EXPECT_TRUE(far_child({500, 0, 0}));
}

TEST(Pager, RefusesNeedsThatAreNotFinite) {
    Pager pager = Pager::create(hills(), {.worker_count = 0}).value();
    CameraNeed camera = camera_at({0, 0, 300}, {500, 300, 0});
    camera.view.eye_world.x() = std::numeric_limits<double>::quiet_NaN();
    const std::vector<BodyNeed> bodies{
        {.centre_world = {0, std::numeric_limits<double>::infinity(), 0}}};
    pager.update({camera}, bodies, 0.0);
    EXPECT_EQ(pager.stats().refused_needs, 2u);
    EXPECT_EQ(pager.stats().resident_chunks, 4u);
    EXPECT_EQ(pager.require({0, 0, std::numeric_limits<double>::quiet_NaN(), 1}, 0.0).state(),
              RegionState::released);
    EXPECT_EQ(pager.stats().refused_needs, 3u);
}

TEST(Pager, RefusesSettingsOutOfRange) {
    EXPECT_FALSE(Pager::create(nullptr, {}).has_value());
    EXPECT_FALSE(Pager::create(hills(), {.worker_count = -1}).has_value());
    EXPECT_FALSE(Pager::create(hills(), {.horizon = -1.0}).has_value());
    EXPECT_FALSE(
        Pager::create(hills(), {.contact_spacing = std::numeric_limits<double>::quiet_NaN()})
            .has_value());
}

}  // namespace terrane::pager_test

// Chunks larger than the claims of their loads are loaded again with a larger claim; the ceiling holds.

namespace terrane::chunk_claims_test {

using namespace test;

constexpr std::size_t kTriangles = 20'000;

/// Hills whose finest chunk (0, 0) has a large solid surface that the source does not announce.
class Surprising final : public ForwardedHeights {
public:
    explicit Surprising(std::shared_ptr<const WaveHeights> hills)
        : ForwardedHeights(std::move(hills)) {
        SolidTriangles triangles;
        triangles.vertices_world = {{1.0, 1.0, -9.0}, {2.0, 1.0, -9.0}, {1.0, 2.0, -9.0}};
        triangles.triangles.assign(kTriangles, {0, 1, 2});
        triangles.parts.assign(kTriangles, SolidPart::cavity);
        solid_ = std::make_shared<const SolidSurface>(std::move(triangles));
    }
    ChunkKey key() const { return {0, 0, static_cast<std::uint8_t>(lattice().finest_level)}; }
    /// Bytes of this solid surface.
    std::size_t solid_bytes() const { return solid_->bytes(); }
    bool learns = true;

    Result<std::shared_ptr<const Chunk>> stored_chunk(const ChunkKey& wanted,
                                                      const std::stop_token& stop) const override {
        if (wanted != key()) return std::shared_ptr<const Chunk>();
        auto chunk = std::make_shared<Chunk>(**make_chunk(heights(), wanted, stop));
        chunk->solid = solid_;
        known_bytes_ = learns ? chunk->bytes() : 0;
        return std::shared_ptr<const Chunk>(std::move(chunk));
    }
    std::size_t max_chunk_bytes(const ChunkKey& wanted) const override {
        return std::max(Chunk::max_bytes(), wanted == key() ? known_bytes_.load() : 0);
    }

private:
    std::shared_ptr<const SolidSurface> solid_;
    mutable std::atomic<std::size_t> known_bytes_{0};
};

std::shared_ptr<Surprising> surprise() {
    return std::make_shared<Surprising>(
        std::make_shared<const WaveHeights>(test::small_world(3, 1.0), 20.0, 700.0));
}

/// Another source, unchanged.
class Same final : public ForwardedHeights {
public:
    explicit Same(std::shared_ptr<const HeightSource> heights)
        : ForwardedHeights(std::move(heights)) {}
};

TEST(ChunkSource, IsForwardedTogetherWithTheHeights) {
    const auto source = surprise();
    const Same outer(std::make_shared<const Same>(source));
    const auto chunk = make_chunk(outer, source->key()).value();
    EXPECT_NE(chunk->solid, nullptr);
    EXPECT_EQ(chunks_of(outer).max_chunk_bytes(source->key()), chunk->bytes());
    EXPECT_GT(chunk->bytes(), Chunk::max_bytes());
}

/// Keeps what was expected.
class Expecting final : public ForwardedHeights {
public:
    explicit Expecting(std::shared_ptr<const HeightSource> heights)
        : ForwardedHeights(std::move(heights)) {}
    void expect_chunks(std::span<const ChunkKey> keys) const override {
        calls.emplace_back(keys.begin(), keys.end());
    }
    mutable std::vector<std::vector<ChunkKey>> calls;
};

TEST(ChunkSource, ExpectsAllChunksUnderABodyAtOnce) {
    const auto source = std::make_shared<Expecting>(
        std::make_shared<const WaveHeights>(test::small_world(5, 1.0), 20.0, 700.0));
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const BodyNeed body{.centre_world = {1.0, 1.0, 0.0}};
    pager.update({}, {&body, 1}, 0.0);
    const auto longest = std::ranges::max_element(source->calls, {}, &std::vector<ChunkKey>::size);
    ASSERT_NE(longest, source->calls.end());
    std::set<ChunkKey> listed;
    std::set<int> levels;
    for (const ChunkKey& key : *longest) {
        EXPECT_TRUE(key.level == 1 || listed.contains(key.parent())) << int{key.level};
        listed.insert(key);
        levels.insert(key.level);
    }
    EXPECT_EQ(levels, (std::set<int>{1, 2, 3, 4, 5}));
    EXPECT_EQ(pager.stats().failed, 0u);
}

// Places a body at the chunk; returns whether the chunk is resident after two seconds of the pager's clock.
bool arrives(Pager& pager, const ChunkKey& key, std::size_t ceiling) {
    BodyNeed body{.centre_world = {1.0, 1.0, 0.0}};
    for (int i = 0; i < 200; ++i) {
        pager.update({}, {&body, 1}, 0.01 * i);
        EXPECT_LE(pager.stats().peak_bytes, ceiling);
        if (test::holds(*pager.resident(), key)) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

TEST(ChunkClaims, ALargeChunkArrivesAtItsSecondLoad) {
    for (const int workers : {0, 2}) {
        const auto source = surprise();
        const std::size_t ceiling = 40 * Chunk::max_bytes() + 2 * source->solid_bytes();
        Pager pager =
            Pager::create(source, {.memory_bytes = ceiling, .worker_count = workers}).value();
        EXPECT_TRUE(arrives(pager, source->key(), ceiling)) << pager.last_failure();
        EXPECT_EQ(pager.stats().failed, 0u);
        EXPECT_GE(pager.stats().resident_bytes, source->solid_bytes());
    }
}

TEST(ChunkClaims, ALargeChunkThatNobodyClaimsIsNotTaken) {
    const auto source = surprise();
    source->learns = false;
    const std::size_t ceiling = 100 * Chunk::max_bytes();
    Pager pager = Pager::create(source, {.memory_bytes = ceiling, .worker_count = 0}).value();
    EXPECT_FALSE(arrives(pager, source->key(), ceiling));
    EXPECT_GT(pager.stats().failed, 2u);
}

TEST(ChunkClaims, WhatDoesNotFitUnderTheCeilingIsPostponedAndCounted) {
    const auto source = surprise();
    const std::size_t ceiling = 4 * Chunk::max_bytes() + source->solid_bytes() / 2;
    Pager pager = Pager::create(source, {.memory_bytes = ceiling, .worker_count = 0}).value();
    EXPECT_FALSE(arrives(pager, source->key(), ceiling));
    EXPECT_GT(pager.stats().over_ceiling, 0u);
}

}  // namespace terrane::chunk_claims_test

// A pager's requests depend on the clock, not on the update rate.

namespace terrane::pager_rate_test {

using Keys = std::set<ChunkKey>;

// A need shorter than the interval between updates may be found at one rate only: up to two of forty chunks.
constexpr double kMostApart = 0.07;

const test::WaveHeights kGround(test::small_world(5, 1.0), 200.0, 700.0);

Result<std::shared_ptr<const Chunk>> chunk_of(const ChunkKey& key) {
    static std::map<ChunkKey, std::shared_ptr<const Chunk>> made;
    std::shared_ptr<const Chunk>& chunk = made[key];
    if (!chunk) chunk = make_chunk(kGround, key).value();
    return chunk;
}

using Trajectory = std::function<CameraNeed(double time_s)>;

CameraNeed camera(const WorldPos& eye, const Eigen::Vector3d& velocity,
                  const Eigen::Vector3d& forward) {
    CameraNeed need = test::camera_at(eye, eye + 100.0 * forward, 0.5);
    need.velocity = velocity;
    return need;
}

// Chunks loaded in eight seconds of a trajectory at an update rate. A common rate is used at the start and the end,
// because the duration of the first loads and the last requests depend on the rate.
Keys loaded(const Trajectory& trajectory, int rate) {
    constexpr int kSeconds = 8;
    constexpr int kCommonRate = 240;
    Keys keys;
    auto loader = VirtualLoader::create({.latency = 0.004, .bandwidth = 1e9, .slots = 16},
                                        [&](const ChunkKey& key) {
                                            keys.insert(key);
                                            return chunk_of(key);
                                        })
                      .value();
    const auto source = std::make_shared<test::WaveHeights>(kGround.lattice(), 200.0, 700.0);
    Pager pager = Pager::create(source, {}, std::move(loader)).value();
    const auto fly = [&](double begin_s, int updates, int updates_a_s) {
        for (int i = 1; i <= updates; ++i) {
            const double time_s = begin_s + static_cast<double>(i) / updates_a_s;
            pager.update({trajectory(time_s)}, {}, time_s);
        }
    };
    fly(0.0, kCommonRate, kCommonRate);
    keys.clear();
    fly(1.0, kSeconds * rate, rate);
    fly(1.0 + kSeconds, kCommonRate / 10, kCommonRate);
    return keys;
}

double share_apart(const Keys& a, const Keys& b) {
    std::size_t common = 0;
    for (const ChunkKey& key : a) common += b.contains(key) ? 1u : 0u;
    const std::size_t all = a.size() + b.size() - common;
    return static_cast<double>(all - common) / static_cast<double>(all);
}

Trajectory straight(double speed) {
    return [speed](double t) {
        const Eigen::Vector3d forward = Eigen::Vector3d(0.8, 0.6, 0.0);
        return camera(WorldPos(-2600, -1700, 260) + speed * t * forward, speed * forward,
                      Eigen::Vector3d(0.8, 0.6, -0.2).normalized());
    };
}

Trajectory turning(double speed, double rate) {
    return [speed, rate](double t) {
        const double angle = rate * t;
        const Eigen::Vector3d forward(std::cos(angle), std::sin(angle), 0.0);
        const WorldPos eye =
            WorldPos(0, 0, 260) +
            speed / rate * Eigen::Vector3d(std::sin(angle), 1 - std::cos(angle), 0);
        return camera(eye, speed * forward,
                      (forward - 0.2 * Eigen::Vector3d::UnitZ()).normalized());
    };
}

// Turns in alternating directions.
Trajectory weaving(double speed) {
    return [speed](double t) {
        constexpr int kStepsPerSecond = 480;
        WorldPos eye(-1500, -600, 260);
        Eigen::Vector3d forward = Eigen::Vector3d::UnitX();
        for (int step = 0; step < static_cast<int>(std::lround(kStepsPerSecond * t)); ++step) {
            const double angle = 0.8 * std::sin(0.9 * step / kStepsPerSecond);
            forward = {std::cos(angle), std::sin(angle), 0.0};
            eye += speed / kStepsPerSecond * forward;
        }
        return camera(eye, speed * forward,
                      (forward - 0.2 * Eigen::Vector3d::UnitZ()).normalized());
    };
}

// Measured: the sets are equal, 38 to 98 chunks, but for 2 of 40 on the weaving trajectory.
TEST(PagerRate, OfUpdatesDoesNotChangeTheLoadedChunks) {
    const std::pair<const char*, Trajectory> trajectories[] = {
        {"straight at 250 m/s", straight(250)},
        {"turning at 0.4 /s", turning(250, 0.4)},
        {"turning at -0.8 /s", turning(600, -0.8)},
        {"weaving", weaving(200)}};
    for (const auto& [name, trajectory] : trajectories) {
        SCOPED_TRACE(name);
        const Keys slow = loaded(trajectory, 20);
        const Keys fast = loaded(trajectory, 240);
        EXPECT_GT(slow.size(), 1u);
        EXPECT_LE(share_apart(slow, fast), kMostApart)
            << slow.size() << " and " << fast.size() << " chunks";
    }
}

}  // namespace terrane::pager_rate_test

// Chunks that are replaced because their source has changed.

namespace terrane::pager_replace_test {

using namespace test;

std::shared_ptr<const Chunk> copy_of(const Chunk& chunk) {
    auto copy = std::make_shared<Chunk>(chunk);
    copy->change = chunk.change + 1;
    return copy;
}

TEST(PagerReplace, SwapsWhatIsResidentInOneSetAndIgnoresOtherChunks) {
    const auto waves = std::make_shared<const WaveHeights>(small_world(2, 1.0), 10.0, 100.0);
    Pager pager = Pager::create(waves, {.worker_count = 0}).value();
    const RequiredRegion region = pager.require({-200.0, -200.0, 200.0, 200.0}, 0.0);
    pager.update({}, {}, 0.0);
    const auto before = pager.resident();
    std::vector<std::shared_ptr<const Chunk>> chunks;
    std::vector<ChunkKey> keys;
    for (const ResidentChunk& chunk : before->chunks()) {
        if (chunk->key.level != 2) continue;
        chunks.push_back(copy_of(*chunk));
        keys.push_back(chunk->key);
    }
    ASSERT_GE(chunks.size(), 4u);
    auto absent = std::make_shared<Chunk>(*chunks.front());
    absent->key = {-8, -8, 2};
    ASSERT_EQ(before->find(absent->key), ResidentSet::kNone);
    const std::size_t resident_count = chunks.size();
    chunks.push_back(absent);
    int switches = 0;
    EXPECT_TRUE(replace_chunks(pager, {chunks, keys, [&] { ++switches; }}));
    EXPECT_EQ(switches, 1);
    EXPECT_EQ(pager.resident(), before) << "the set changes in update()";
    pager.update({}, {}, 1.0);
    const auto after = pager.resident();
    EXPECT_GT(after->epoch(), before->epoch());
    ASSERT_EQ(after->chunks().size(), before->chunks().size());
    for (std::size_t i = 0; i < after->chunks().size(); ++i) {
        const ResidentChunk &now = after->chunks()[i], &then = before->chunks()[i];
        EXPECT_EQ(now->key, then->key);
        EXPECT_EQ(now->change, now->key.level == 2 ? 1u : 0u);
        EXPECT_EQ(now.get() == then.get(), now->key.level != 2);
        EXPECT_EQ(after->fade(i), before->fade(i));
        EXPECT_EQ(after->links(i).parent, before->links(i).parent);
        EXPECT_EQ(after->links(i).child, before->links(i).child);
        EXPECT_EQ(after->links(i).neighbour, before->links(i).neighbour);
    }
    EXPECT_EQ(pager.stats().replaced, resident_count);
}

TEST(PagerReplace, DoesNothingWhereTheBytesDoNotFitUntilOthersAreEvicted) {
    Lattice lattice{.finest_level = 1};
    const auto waves = std::make_shared<const WaveHeights>(lattice, 10.0, 100.0);
    const std::size_t ceiling = 3 * Chunk::max_bytes();
    Pager pager = Pager::create(waves, {.memory_bytes = ceiling, .worker_count = 0}).value();
    RequiredRegion all = pager.require(whole_extent(lattice), 0.0);
    pager.update({}, {}, 0.0);
    ASSERT_GE(pager.resident()->chunks().size(), 3u) << "as many as fit";
    const std::shared_ptr<const Chunk> root = copy_of(*pager.resident()->find_chunk({0, 0, 0}));
    int switches = 0;
    const auto replace = [&] {
        return replace_chunks(pager, {{&root, 1}, {}, [&] { ++switches; }});
    };
    // All chunks are current contacts, which are never evicted.
    EXPECT_FALSE(replace());
    pager.update({}, {}, 1.0);
    EXPECT_FALSE(replace());
    EXPECT_EQ(switches, 0);
    EXPECT_EQ(pager.resident()->find_chunk({0, 0, 0})->change, 0u);
    EXPECT_EQ(pager.stats().postponed_replacements, 2u);
    all.release();
    pager.update({}, {}, 2.0);
    EXPECT_TRUE(replace());
    EXPECT_EQ(switches, 1);
    pager.update({}, {}, 3.0);
    EXPECT_EQ(pager.resident()->find_chunk({0, 0, 0})->change, 1u);
    EXPECT_GT(pager.stats().evicted, 0u);
    EXPECT_LE(pager.stats().peak_bytes, ceiling);
}

}  // namespace terrane::pager_replace_test
