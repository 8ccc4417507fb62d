// SPDX-License-Identifier: MIT
//
// The requests of a pager depend on the clock, not on the rate of updates.
#include "pager_scene.h"

#include <terrane/terrain/chunk_loader.h>

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <set>

namespace terrane {
namespace pager_rate_test {

using Keys = std::set<ChunkKey>;

// Needs that last for less than the time between two updates may be found at one rate only: up to two chunks of forty.
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

// Chunks loaded in eight seconds of a trajectory at a rate of updates. It starts and ends with a time at one fixed
// rate: the duration of loading the first levels, and the last requests, depend on the rate.
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
            pager.update(std::vector{trajectory(time_s)}, {}, time_s);
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

// Alternating turns.
Trajectory weaving(double speed) {
    return [speed](double t) {
        constexpr int kSteps_a_s = 480;
        WorldPos eye(-1500, -600, 260);
        Eigen::Vector3d forward = Eigen::Vector3d::UnitX();
        for (int step = 0; step < static_cast<int>(std::lround(kSteps_a_s * t)); ++step) {
            const double angle = 0.8 * std::sin(0.9 * step / kSteps_a_s);
            forward = {std::cos(angle), std::sin(angle), 0.0};
            eye += speed / kSteps_a_s * forward;
        }
        return camera(eye, speed * forward,
                      (forward - 0.2 * Eigen::Vector3d::UnitZ()).normalized());
    };
}

// Measured: 0 of 38 to 98 chunks apart, but 2 of 40 on the weaving trajectory.
TEST(PagerRate, OfUpdatesDoesNotChangeTheLoadedChunks) {
    const std::pair<const char*, Trajectory> trajectories[] = {
        {"straight at 50 m/s", straight(50)},       {"straight at 250 m/s", straight(250)},
        {"turning at 0.1 /s", turning(150, 0.1)},   {"turning at 0.4 /s", turning(250, 0.4)},
        {"turning at -0.8 /s", turning(600, -0.8)}, {"weaving", weaving(200)}};
    for (const auto& [name, trajectory] : trajectories) {
        SCOPED_TRACE(name);
        const Keys slow = loaded(trajectory, 20);
        const Keys fast = loaded(trajectory, 240);
        EXPECT_GT(slow.size(), 1u);
        EXPECT_LE(share_apart(slow, fast), kMostApart)
            << slow.size() << " and " << fast.size() << " chunks";
    }
}

}  // namespace pager_rate_test
}  // namespace terrane
