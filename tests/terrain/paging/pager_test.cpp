// SPDX-License-Identifier: MIT
#include "support/heights/wave_heights.h"
#include "support/random.h"

#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <thread>

namespace terrane {
namespace pager_test {

using test::Random;
using test::WaveHeights;

std::shared_ptr<WaveHeights> hills() {
    return std::make_shared<WaveHeights>(test::small_world(4, 1.0), 200.0, 700.0);
}

CameraNeed camera_at(const WorldPos& eye, const WorldPos& target) {
    return {.view = look_at(eye, target, 1.0, 1280, 720).value(), .threshold_px = 0.5};
}

std::vector<ChunkKey> keys_of(const ResidentSet& set) {
    std::vector<ChunkKey> keys;
    for (const auto& chunk : set.chunks()) keys.push_back(chunk->key);
    return keys;
}

// Calls update() as a frame loop does until nothing is late.
int settle(Pager& pager, const std::vector<CameraNeed>& cameras) {
    for (int frame = 0; frame < 2000; ++frame) {
        pager.update(cameras, {}, 0.01 * frame);
        if (frame > 0 && pager.stats().late_chunks == 0) return frame;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return -1;
}

TEST(Pager, LoadsTheSameSetWithWorkersAsWithout) {
    const std::vector<CameraNeed> cameras{camera_at({0, 0, 300}, {500, 300, 0})};
    Pager synchronous = Pager::create(hills(), {.worker_count = 0}).value();
    synchronous.update(cameras, {}, 0.0);
    EXPECT_EQ(synchronous.stats().late_chunks, 0u);
    for (const int workers : {1, 2, 4}) {
        Pager pager = Pager::create(hills(), {.worker_count = workers}).value();
        pager.update(cameras, {}, 0.0);
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
            pager.update(std::vector<CameraNeed>{camera_at(eye, eye + WorldPos(50, 10, -5))}, {},
                         0.02 * frame);
            if (workers > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
            // workers reach the ceiling also on a slow machine
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

// Any wait would be infinite.
TEST(Pager, DoesNotWaitForASourceThatNeverAnswers) {
    const auto source = hills();
    source->is_held = true;
    Pager pager = Pager::create(source, {.worker_count = 1}).value();
    const std::vector<CameraNeed> cameras{camera_at({0, 0, 300}, {500, 300, 0})};
    for (int frame = 0; frame < 20; ++frame) pager.update(cameras, {}, 0.01 * frame);
    EXPECT_EQ(pager.stats().late_chunks, 4u);  // the roots
    EXPECT_EQ(pager.stats().loaded, 0u);
    source->is_held = false;
    source->is_held.notify_all();
    pager.finish();
    EXPECT_EQ(pager.stats().late_chunks, 0u);
}

TEST(Pager, StopsDuringALoadWithoutLeaks) {
    for (int i = 0; i < 10; ++i) {
        const auto source = hills();
        source->delay_ms = 5;
        Pager pager = Pager::create(source, {.worker_count = 3}).value();
        pager.update(std::vector<CameraNeed>{camera_at({0, 0, 300}, {500, 300, 0})}, {}, 0.0);
        std::this_thread::sleep_for(std::chrono::milliseconds(i));
    }
}

TEST(Pager, CountsASourceThatFailsRetriesItAndRecovers) {
    const auto source = hills();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const std::vector<CameraNeed> cameras{camera_at({0, 0, 300}, {500, 300, 0})};
    source->is_broken = true;
    pager.update(cameras, {}, 0.0);
    EXPECT_EQ(pager.stats().failed, 4u);  // each root once
    EXPECT_EQ(pager.stats().resident_chunks, 0u);
    const int tries = source->sample_count;
    pager.update(cameras, {}, 0.01);  // too early to try again
    EXPECT_EQ(source->sample_count, tries);
    source->is_broken = false;
    source->gives_nan = true;
    pager.update(cameras, {}, 1.0);
    EXPECT_EQ(pager.stats().failed, 8u);
    source->gives_nan = false;
    pager.update(cameras, {}, 100.0);
    EXPECT_EQ(pager.stats().late_chunks, 0u);
    EXPECT_GT(pager.stats().resident_chunks, 4u);
}

TEST(Pager, CancelsQueuedLoadsAfterATeleport) {
    const auto source = hills();
    source->delay_ms = 2;
    Pager pager = Pager::create(source, {.worker_count = 1}).value();
    pager.update({}, {}, 0.0);
    pager.finish();  // the roots
    const auto look = [&](double x) {
        return std::vector<CameraNeed>{camera_at({x, x, 60}, {x + 40, x + 30, 0})};
    };
    EXPECT_GE(settle(pager, look(-1500.0)), 0);
    pager.update(look(1500.0), {}, 50.0);
    pager.update(look(1500.0), {}, 50.01);
    pager.update(look(-100.0), {}, 50.02);
    EXPECT_GT(pager.stats().cancelled, 0u);
    EXPECT_GE(settle(pager, look(-100.0)), 0);
}

TEST(Pager, LoadsARequiredRegionAtContactLevelAndKeepsIt) {
    Pager pager =
        Pager::create(hills(), {.memory_bytes = 30 * Chunk::max_bytes(), .worker_count = 0})
            .value();
    const WorldRect region{-200.0, 100.0, -100.0, 250.0};
    const Pager::Ticket ticket = pager.require(region, 1.0);
    EXPECT_FALSE(pager.is_ready(ticket));
    pager.update({}, {}, 0.0);
    EXPECT_TRUE(pager.is_ready(ticket));
    // cameras elsewhere with more needs than fit do not evict it
    for (int frame = 0; frame < 30; ++frame) {
        const WorldPos eye(1000.0 - 20.0 * frame, -1000.0, 30.0);
        pager.update(std::vector<CameraNeed>{camera_at(eye, eye + WorldPos(30, -30, -3))}, {},
                     0.1 * frame);
        ASSERT_TRUE(pager.is_ready(ticket));
    }
    pager.release(ticket);
    EXPECT_FALSE(pager.is_ready(ticket));
    for (int frame = 0; frame < 30; ++frame) {
        const WorldPos eye(1000.0 - 20.0 * frame, -1000.0, 30.0);
        pager.update(std::vector<CameraNeed>{camera_at(eye, eye + WorldPos(30, -30, -3))}, {},
                     4.0 + frame);
    }
    EXPECT_FALSE(pager.is_ready(pager.require(region, 1.0)));
}

TEST(Pager, LoadsTheGroundAlongABodysTrajectory) {
    Pager pager = Pager::create(hills(), {.worker_count = 0, .horizon = 2.0}).value();
    const std::vector<BodyNeed> bodies{
        {.centre_world = {0, 0, 100}, .velocity = {400, 0, -50}, .radius = 1.0}};
    pager.update({}, bodies, 0.0);
    const ResidentSet& set = *pager.resident();
    for (double x = 0.0; x <= 800.0; x += 50.0) {
        const ChunkKey key{static_cast<std::int32_t>(std::floor(x / 128.0)), 0, 4};
        EXPECT_NE(set.find(key), ResidentSet::kNone) << "x " << x;
    }
    EXPECT_EQ(set.find({-8, 0, 4}), ResidentSet::kNone);
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
    // more than the work limit
    bodies.assign(2000, {.centre_world = {0, 0, z}, .radius = 1e7});
    pager.update({}, bodies, 1.0);
    EXPECT_GT(pager.stats().cut_needs, 0u);
}

// The caller may change a trajectory after update().
TEST(Pager, CopiesTrajectoriesForFinish) {
    Pager pager = Pager::create(hills(), {.worker_count = 1}).value();
    std::vector<BodyMoment> trajectory{
        {0.1, {0, 0, 0}}, {0.1, {900, 900, 0}}, {0.2, {900, 900, 0}}};
    const std::vector<BodyNeed> bodies{
        {.centre_world = {0, 0, 0}, .radius = 1.0, .trajectory = trajectory}};
    pager.update({}, bodies, 0.0);
    for (BodyMoment& moment : trajectory) moment.centre_world = {-900, -900, 0};
    pager.finish();
    EXPECT_NE(pager.resident()->find({7, 7, 4}), ResidentSet::kNone);
    EXPECT_EQ(pager.resident()->find({-8, -8, 4}), ResidentSet::kNone);
}

TEST(Pager, LoadsAheadOfAFastCamera) {
    const auto far_child = [](const Eigen::Vector3d& velocity) {
        Pager pager = Pager::create(hills(), {.worker_count = 0, .horizon = 3.0}).value();
        CameraNeed camera = camera_at({-1500, -1500, 50}, {-1400, -1500, 0});
        camera.velocity = velocity;
        pager.update(std::vector<CameraNeed>{camera}, {}, 0.0);
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
    pager.update(std::vector<CameraNeed>{camera}, bodies, 0.0);
    EXPECT_EQ(pager.stats().refused_needs, 2u);
    EXPECT_EQ(pager.stats().resident_chunks, 4u);
    pager.require({0, 0, std::numeric_limits<double>::quiet_NaN(), 1}, 0.0);
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

}  // namespace pager_test
}  // namespace terrane
