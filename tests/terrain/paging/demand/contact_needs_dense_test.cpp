// SPDX-License-Identifier: MIT
//
// ContactNeeds against a dense sampling of every body's trajectory over all chunks.
#include "paging/demand/contact_needs.h"
#include "support/random.h"
#include "terrain/paging/terraces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace terrane::internal {
namespace contact_needs_dense_test {

using test::all_small_chunks;
using test::keys_of;
using test::kLevel;
using test::kSide;
using test::Random;
using test::small_terraces;
using test::Terraces;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kGravity = 9.81;

WorldRect square_of(const ChunkKey& key) {
    return {kSide * key.x, kSide * key.y, kSide * (key.x + 1), kSide * (key.y + 1)};
}

// Distance of a point to the column of the chunk's square below its highest ground.
double distance_to(const Terraces& source, const ChunkKey& key, const WorldPos& point) {
    const WorldRect square = square_of(key);
    const double x = std::clamp(point.x(), square.west, square.east) - point.x();
    const double y = std::clamp(point.y(), square.south, square.north) - point.y();
    const double z = std::max(0.0, point.z() - source.terrace(key.x, key.y));
    return std::sqrt(x * x + y * y + z * z);
}

// Calls use(seconds from now, centre, reach) at dense times of a body's trajectory, increasing.
template <class Use>
void sample_way(const BodyNeed& body, double now, double horizon, const Use& use) {
    constexpr double kStep = 2.0;  // metres
    const auto go = [&](double begin, double end, const WorldPos& from, const WorldPos& to,
                        double until, double growth) {
        const int count =
            std::min(20'000, std::max(200, static_cast<int>((to - from).norm() / kStep)));
        for (int i = 0; i <= count; ++i) {
            const double time = begin + (std::min(end, until) - begin) * i / count;
            const double share = end > begin ? (time - begin) / (end - begin) : 0.0;
            use(time, WorldPos(from + share * (to - from)),
                body.radius + 0.5 * growth * time * time);
        }
    };
    if (body.trajectory.empty()) {
        const WorldPos end = body.centre_world + horizon * body.velocity;
        go(0.0, horizon, body.centre_world, end, horizon, kGravity);
        return;
    }
    double begin = 0.0;
    WorldPos from = body.centre_world;
    for (const BodyMoment& moment : body.trajectory) {
        const double end = moment.time_s - now;
        if (end < 0.0) continue;
        go(begin, end, from, moment.centre_world, horizon, 0.0);
        if (end > horizon) return;
        begin = end;
        from = moment.centre_world;
    }
    go(begin, horizon, from, from, horizon, 0.0);
}

struct Touched {
    double first = 0.0;
    double last = 0.0;
};

// Touches of chunks by dense sampling, with the body enlarged by `wider` metres.
std::map<ChunkKey, Touched> look_densely(const Terraces& source, std::span<const BodyNeed> bodies,
                                         double now, double horizon, double wider) {
    std::map<ChunkKey, Touched> times;
    const std::vector<ChunkKey> keys = all_small_chunks();
    for (const BodyNeed& body : bodies) {
        sample_way(body, now, horizon, [&](double time, const WorldPos& centre, double reach) {
            for (const ChunkKey& key : keys) {
                if (distance_to(source, key, centre) > reach + wider) continue;
                const auto [found, is_new] = times.emplace(key, Touched{time, time});
                found->second.first = std::min(found->second.first, time);
                found->second.last = std::max(found->second.last, time);
            }
        });
    }
    return times;
}

struct Scene {
    std::vector<BodyNeed> bodies;
    std::vector<std::vector<BodyMoment>> trajectories;  // that bodies follow
    double now = 0.0;
    double horizon = 0.0;
};

WorldPos random_place(Random& random, double half_side) {
    return {random.between(-half_side, half_side), random.between(-half_side, half_side),
            random.between(-50.0, 150.0)};
}

Scene make_scene(Random& random, double most_speed, bool has_trajectories) {
    Scene scene;
    scene.now = random.between(-100.0, 100.0);
    scene.horizon = random.below(10) == 0 ? 0.0 : random.between(0.1, 6.0);
    const int count = 1 + random.below(3);
    scene.trajectories.resize(static_cast<std::size_t>(count));
    for (std::vector<BodyMoment>& trajectory : scene.trajectories) {
        BodyNeed body;
        body.centre_world = random_place(random, 650.0);
        const double speed = random.below(4) == 0 ? 0.0 : random.between(0.0, most_speed);
        body.velocity =
            speed * Eigen::Vector3d(random.between(-1.0, 1.0), random.between(-1.0, 1.0),
                                    random.between(-0.5, 0.5));
        body.radius = random.below(4) == 0 ? 0.0 : random.between(0.0, 60.0);
        if (has_trajectories) {
            double time = scene.now + random.between(-3.0, 2.0);
            for (int i = random.below(6); i >= 0; --i) {
                trajectory.push_back({time, random_place(random, 650.0)});
                if (random.below(3) != 0) time += random.between(0.0, 2.0);
            }
            body.trajectory = trajectory;
        }
        scene.bodies.push_back(body);
    }
    return scene;
}

ContactNeeds find(const Terraces& source, const Scene& scene) {
    ContactNeeds needs(source, kLevel);
    needs.find(scene.bodies, {}, scene.now, scene.horizon);
    return needs;
}

TEST(ContactNeeds, ContainEveryTouchOfADenseSampling) {
    constexpr std::uint64_t kSeed = 21;
    Random random(kSeed);
    const Terraces source = small_terraces();
    for (int run = 0; run < 400; ++run) {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", run " + std::to_string(run));
        const Scene scene = make_scene(random, run % 5 == 0 ? 3000.0 : 300.0, run % 2 == 1);
        const ContactNeeds needs = find(source, scene);
        ASSERT_FALSE(needs.is_cut());
        for (const auto& [key, touched] :
             look_densely(source, scene.bodies, scene.now, scene.horizon, 0.0)) {
            ASSERT_LE(needs.time_until(key), touched.first) << key.x << ", " << key.y;
            ASSERT_GE(needs.end_of(key), touched.last) << key.x << ", " << key.y;
        }
    }
}

TEST(ContactNeeds, AddFewChunksThatASlightlyLargerBodyDoesNotTouch) {
    constexpr std::uint64_t kSeed = 22;
    Random random(kSeed);
    const Terraces source = small_terraces();
    for (const bool has_trajectories : {false, true}) {
        std::size_t count = 0, missed = 0;
        double early = 0.0, late = 0.0, horizons = 0.0;
        std::size_t ends = 0;
        for (int run = 0; run < 200; ++run) {
            const Scene scene = make_scene(random, 300.0, has_trajectories);
            const ContactNeeds needs = find(source, scene);
            const auto wide =
                look_densely(source, scene.bodies, scene.now, scene.horizon, 0.05 * kSide);
            const auto exact = look_densely(source, scene.bodies, scene.now, scene.horizon, 0.0);
            for (const ChunkKey& key : keys_of(needs, kLevel)) {
                ++count;
                missed += wide.contains(key) ? 0u : 1u;
                if (!exact.contains(key)) continue;
                const Touched& touched = exact.at(key);
                early += touched.first - needs.time_until(key);
                horizons += scene.horizon;
                // infinite at the end of the horizon
                if (needs.end_of(key) == kInfinity) continue;
                ++ends;
                late += needs.end_of(key) - touched.last;
            }
        }
        SCOPED_TRACE("seed " + std::to_string(kSeed) +
                     (has_trajectories ? ", trajectories" : ", no trajectories"));
        EXPECT_GT(count, 2000u);
        // 0.12 without trajectories, where most bodies are in the air and a box is lower than its sphere at the
        // edges; 0.05 with
        EXPECT_LT(static_cast<double>(missed), 0.15 * static_cast<double>(count));
        EXPECT_LT(early, 0.05 * horizons);
        EXPECT_GT(ends, 200u);
        EXPECT_LT(late, 0.03 * horizons);
    }
}

TEST(ContactNeeds, AreOrderedByTimeLevelAndKeyAndAncestorsSpanTheTimesOfDescendants) {
    constexpr std::uint64_t kSeed = 23;
    Random random(kSeed);
    const Terraces source = small_terraces();
    for (int run = 0; run < 100; ++run) {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", run " + std::to_string(run));
        const Scene scene = make_scene(random, 300.0, run % 2 == 1);
        const ContactNeeds needs = find(source, scene);
        std::map<ChunkKey, double> least, last;
        for (const ContactNeeds::Entry& entry : needs.entries()) {
            ASSERT_EQ(needs.time_until(entry.key), entry.time);
            if (entry.key.level != kLevel) continue;
            for (ChunkKey key = entry.key;; key = key.parent()) {
                const auto [found, is_new] = least.emplace(key, entry.time);
                found->second = std::min(found->second, entry.time);
                last[key] = std::max(last[key], needs.end_of(entry.key));
                if (key.level == 0) break;
            }
        }
        std::vector<ContactNeeds::Entry> expected;
        for (const auto& [key, time] : least) {
            expected.push_back({key, time});
            ASSERT_EQ(needs.end_of(key), last[key]);
        }
        std::sort(expected.begin(), expected.end(), [](const auto& a, const auto& b) {
            if (a.time != b.time) return a.time < b.time;
            return a.key.level != b.key.level ? a.key.level < b.key.level : a.key < b.key;
        });
        ASSERT_TRUE(std::equal(
            expected.begin(), expected.end(), needs.entries().begin(), needs.entries().end(),
            [](const auto& a, const auto& b) { return a.key == b.key && a.time == b.time; }));
        EXPECT_EQ(needs.time_until({0, 0, kLevel + 1}), kInfinity);
    }
}

TEST(ContactNeeds, ListTheCurrentContactsOfBodies) {
    constexpr std::uint64_t kSeed = 24;
    Random random(kSeed);
    const Terraces source = small_terraces();
    std::size_t count = 0;
    for (int run = 0; run < 300; ++run) {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", run " + std::to_string(run));
        const Scene scene = make_scene(random, 300.0, run % 2 == 1);
        const ContactNeeds needs = find(source, scene);
        std::vector<std::pair<std::size_t, ChunkKey>> contacts, expected;
        for (const ContactNeeds::CurrentContact& contact : needs.current_contacts()) {
            contacts.emplace_back(contact.body, contact.key);
            EXPECT_EQ(needs.time_until(contact.key), 0.0);
        }
        EXPECT_TRUE(std::is_sorted(contacts.begin(), contacts.end(),
                                   [](const auto& a, const auto& b) { return a.first < b.first; }));
        for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
            const BodyNeed& need = scene.bodies[body];
            for (const ChunkKey& key : all_small_chunks()) {
                const double distance = distance_to(source, key, need.centre_world);
                if (distance <= need.radius) expected.emplace_back(body, key);
                // no body is within a quantum of a border
                ASSERT_TRUE(distance == 0.0 || std::abs(distance - need.radius) > 1e-3);
            }
        }
        std::sort(contacts.begin(), contacts.end());
        std::sort(expected.begin(), expected.end());
        EXPECT_EQ(contacts, expected);
        count += contacts.size();
    }
    EXPECT_GT(count, 300u);
}

}  // namespace contact_needs_dense_test
}  // namespace terrane::internal
