// SPDX-License-Identifier: MIT
#include "paging/demand/contact_needs.h"

#include "support/random.h"
#include "terrain/paging/terraces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

namespace terrane::internal {
namespace contact_needs_test {

using test::all_small_chunks;
using test::deep_terraces;
using test::kDeepLevel;
using test::keys_of;
using test::kLevel;
using test::Random;
using test::small_terraces;
using test::Terraces;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool is_same(const ContactNeeds& a, const ContactNeeds& b) {
    return std::equal(a.entries().begin(), a.entries().end(), b.entries().begin(),
                      b.entries().end(), [](const auto& one, const auto& other) {
                          return one.key == other.key && one.time == other.time;
                      });
}

BodyNeed body_at(const WorldPos& centre, double radius = 1.0,
                 const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero()) {
    return {.centre_world = centre, .velocity = velocity, .radius = radius};
}

std::set<ChunkKey> find_keys(const Terraces& source, const BodyNeed& body, double horizon) {
    ContactNeeds needs(source, kLevel);
    needs.find({&body, 1}, {}, 0.0, horizon);
    return keys_of(needs, kLevel);
}

TEST(ContactNeeds, IncludeChunksTouchedAtEdgesAndCorners) {
    const Terraces source = small_terraces();
    const auto key = [](int x, int y) { return ChunkKey{x, y, kLevel}; };
    using Keys = std::set<ChunkKey>;
    // a point at rest: horizon 0
    EXPECT_EQ(find_keys(source, body_at({10, 10, 0}, 0.0), 0.0), Keys{key(0, 0)});
    EXPECT_EQ(find_keys(source, body_at({64, 10, 0}, 0.0), 0.0), (Keys{key(0, 0), key(1, 0)}));
    EXPECT_EQ(find_keys(source, body_at({-64, -64, 0}, 0.0), 0.0),
              (Keys{key(-2, -2), key(-2, -1), key(-1, -2), key(-1, -1)}));
    // a sphere that just touches an edge, and one that touches the edge's line but not the corner
    EXPECT_EQ(find_keys(source, body_at({60, 10, 0}, 4.0), 0.0), (Keys{key(0, 0), key(1, 0)}));
    EXPECT_EQ(find_keys(source, body_at({60, 10, 0}, 3.999), 0.0), Keys{key(0, 0)});
    EXPECT_EQ(find_keys(source, body_at({60, 60, 0}, 5.0), 0.0),
              (Keys{key(0, 0), key(1, 0), key(0, 1)}));
    // the world's own edge and corner
    EXPECT_EQ(find_keys(source, body_at({512, 512, 0}, 0.0), 0.0), Keys{key(7, 7)});
    EXPECT_EQ(find_keys(source, body_at({-512, 10, 0}, 0.0), 0.0), Keys{key(-8, 0)});
}

TEST(ContactNeeds, AreEmptyBesideAndAboveTheGround) {
    const Terraces source = small_terraces();
    EXPECT_TRUE(find_keys(source, body_at({513.5, 0, 0}), 0.0).empty());
    EXPECT_TRUE(find_keys(source, body_at({1e7, 1e7, 0}), 4.0).empty());
    EXPECT_TRUE(find_keys(source, body_at({-1e300, 1e300, 0}), 4.0).empty());
    EXPECT_TRUE(find_keys(source, body_at({10, 10, 1e6}), 4.0).empty());
    // it falls 78 m, and the highest ground is at 35
    EXPECT_TRUE(find_keys(source, body_at({10, 10, 120.0}), 4.0).empty());
    EXPECT_FALSE(find_keys(source, body_at({10, 10, 110.0}), 4.0).empty());
    EXPECT_TRUE(find_keys(source, body_at({10, 10, 50}, 1.0, {0, 0, 500.0}), 4.0).empty());
    // it waits: at once, whatever the height
    for (const double z : {-1e6, 36.0, 120.0, 1e6}) {
        BodyNeed waiting = body_at({10, 10, z});
        waiting.is_waiting = true;
        ContactNeeds needs(source, kLevel);
        needs.find({&waiting, 1}, {}, 0.0, 0.01);
        ASSERT_TRUE(keys_of(needs, kLevel).contains({0, 0, kLevel})) << z;
        ASSERT_EQ(needs.current_contacts().size(), 1u);
        EXPECT_EQ(keys_of(needs, kLevel).size(), 1u);
    }
    // below the ground, at any depth
    EXPECT_TRUE(find_keys(source, body_at({10, 10, -1e9}), 0.0).contains({0, 0, kLevel}));
}

TEST(ContactNeeds, AreEmptyBeyondTheExtent) {
    const Lattice lattice = test::small_world(kLevel + 1, 0.25);
    const Terraces source(lattice, {-512.0, -512.0, 64.0, 100.0}, kLevel);
    // the chunk that only touches the extent's edge contains no ground
    EXPECT_EQ(find_keys(source, body_at({64, 100, 0}, 10.0), 0.0),
              (std::set<ChunkKey>{{0, 1, kLevel}}));
    EXPECT_TRUE(find_keys(source, body_at({90, 10, 0}, 10.0), 0.0).empty());
}

TEST(ContactNeeds, FollowAGivenTrajectory) {
    const Terraces source = small_terraces();
    const double now = 100.0;
    const auto time_until = [&](const BodyNeed& body, int x, int y) {
        ContactNeeds needs(source, kLevel);
        needs.find({&body, 1}, {}, now, 4.0);
        return needs.time_until({x, y, kLevel});
    };
    constexpr double kStep = 4.0 / ContactNeeds::kSteps;
    BodyNeed body = body_at({32, 32, 0}, 1.0, {0, 300, 0});
    // a jump to (-2, -2) at 102, after a second of motion towards (1, 0); past moments do not matter
    const std::vector<BodyMoment> trajectory{{98.0, {-300, 32, 0}},
                                             {99.0, {-300, 300, 0}},
                                             {101.0, {96, 32, 0}},
                                             {102.0, {96, 32, 0}},
                                             {102.0, {-96, -96, 0}}};
    body.trajectory = trajectory;
    EXPECT_EQ(time_until(body, 0, 0), 0.0);
    EXPECT_NEAR(time_until(body, 1, 0), 31.0 / 64.0, kStep);
    EXPECT_NEAR(time_until(body, -2, -2), 2.0, kStep);
    EXPECT_EQ(time_until(body, 0, 1), kInfinity);    // where its velocity points
    EXPECT_EQ(time_until(body, -1, -1), kInfinity);  // between the ends of the jump
    EXPECT_EQ(time_until(body, -5, 0), kInfinity);   // where it was
    // all moments are past: the body is at rest, and does not fall
    const std::vector<BodyMoment> past{{98.0, {-300, 32, 0}}, {99.0, {-300, 300, 0}}};
    body.trajectory = past;
    EXPECT_EQ(time_until(body, 0, 0), 0.0);
    EXPECT_EQ(time_until(body, 1, 0), kInfinity);
    EXPECT_EQ(time_until(body, 0, 1), kInfinity);
    // the horizon cuts the trajectory
    const std::vector<BodyMoment> late{{108.0, {32.0 + 8.0 * 32.0, 32, 0}}};
    body.trajectory = late;
    EXPECT_NEAR(time_until(body, 2, 0), 95.0 / 32.0, kStep);
    EXPECT_EQ(time_until(body, 3, 0), kInfinity);
    // a jump now: both ends are needed, one is a current contact
    const std::vector<BodyMoment> jump{{100.0, {32, 32, 0}}, {100.0, {-96, -96, 0}}};
    body.trajectory = jump;
    EXPECT_EQ(time_until(body, 0, 0), 0.0);
    EXPECT_EQ(time_until(body, -2, -2), 0.0);
    ContactNeeds needs(source, kLevel);
    needs.find({&body, 1}, {}, now, 4.0);
    ASSERT_EQ(needs.current_contacts().size(), 1u);
    EXPECT_EQ(needs.current_contacts()[0].key, (ChunkKey{0, 0, kLevel}));
}

TEST(ContactNeeds, IncludeRegionsAtTheirDeadlines) {
    const Terraces source = small_terraces();
    ContactNeeds needs(source, kLevel);
    const auto find = [&](const WorldRect& region, double deadline_s) {
        const RegionNeed need{region, deadline_s};
        needs.find({}, {&need, 1}, 10.0, 4.0);
        return keys_of(needs, kLevel).size();
    };
    EXPECT_EQ(find({10, 10, 20, 20}, 13.3), 1u);
    EXPECT_EQ(needs.time_until({0, 0, kLevel}), 13.3 - 10.0);
    EXPECT_EQ(needs.time_until({0, 0, 0}), 13.3 - 10.0);
    EXPECT_EQ(find({10, 10, 20, 20}, -7.0), 1u);
    EXPECT_EQ(needs.time_until({0, 0, kLevel}), 0.0);
    EXPECT_EQ(find({10, 10, 20, 20}, 1e6), 1u);  // beyond the horizon
    EXPECT_EQ(needs.time_until({0, 0, kLevel}), 1e6 - 10.0);
    EXPECT_EQ(find({10, 10, 20, 20}, kInfinity), 1u);
    // points, edges, corners
    EXPECT_EQ(find({10, 10, 10, 10}, 0.0), 1u);
    EXPECT_EQ(find({64, 10, 64, 10}, 0.0), 2u);
    EXPECT_EQ(find({64, 64, 64, 64}, 0.0), 4u);
    EXPECT_EQ(find({0, 0, 64, 64}, 0.0), 9u);
    EXPECT_EQ(find({512, 512, 600, 600}, 0.0), 1u);
    EXPECT_EQ(find({512.5, 0, 600, 600}, 0.0), 0u);
    EXPECT_EQ(find({-1e300, -1e300, 1e300, 1e300}, 0.0), 256u);
    EXPECT_FALSE(needs.is_cut());
}

TEST(ContactNeeds, CombineRegionsAndBodies) {
    const Terraces source = small_terraces();
    const BodyNeed body = body_at({-500, 32, 0}, 1.0, {100, 0, 0});
    const std::vector<RegionNeed> regions{{{-400, 32, -300, 32}, 2.0}, {{300, 0, 400, 0}, 1.0 / 3}};
    ContactNeeds alone(source, kLevel), both(source, kLevel);
    alone.find({&body, 1}, {}, 0.0, 4.0);
    both.find({&body, 1}, regions, 0.0, 4.0);
    for (const ChunkKey& key : all_small_chunks()) {
        double expected = alone.time_until(key);
        if (key.y == 0 && key.x >= -7 && key.x <= -5) expected = std::min(expected, 2.0);
        if ((key.y == 0 || key.y == -1) && key.x >= 4 && key.x <= 6) {
            expected = std::min(expected, 1.0 / 3);
        }
        EXPECT_EQ(both.time_until(key), expected) << key.x << ", " << key.y;
    }
    EXPECT_TRUE(std::is_sorted(both.entries().begin(), both.entries().end(),
                               [](const auto& a, const auto& b) { return a.time < b.time; }));
}

TEST(ContactNeeds, GiveTheSameBitsWhateverTheyDidBefore) {
    constexpr std::uint64_t kSeed = 25;
    Random random(kSeed);
    const Terraces source = deep_terraces();
    ContactNeeds used(source, kDeepLevel);
    std::vector<BodyNeed> bodies;
    for (int run = 0; run < 60; ++run) {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", run " + std::to_string(run));
        // some positions several times, so that the cache is used
        if (run % 3 == 0) bodies.clear();
        for (int i = random.below(6); i >= 0 && run % 3 == 0; --i) {
            bodies.push_back(body_at(
                {random.between(-1e5, 1e5), random.between(-1e5, 1e5), random.between(-10.0, 50.0)},
                random.between(0.0, 20.0),
                {random.between(-50.0, 50.0), random.between(-50.0, 50.0), 0}));
        }
        used.find(bodies, {}, run, 2.0);
        ContactNeeds fresh(source, kDeepLevel);
        fresh.find(bodies, {}, run, 2.0);
        ASSERT_GT(fresh.entries().size(), 1000u);
        ASSERT_TRUE(is_same(used, fresh));
    }
}

TEST(ContactNeeds, CoverAWholeWorldThatIsSmall) {
    const Terraces source = small_terraces();
    EXPECT_EQ(find_keys(source, body_at({0, 0, 0}, 1e9), 4.0).size(), 256u);
    EXPECT_EQ(find_keys(source, body_at({0, 0, 0}, 1e300, {1e300, 0, 0}), 4.0).size(), 256u);
}

TEST(ContactNeeds, FollowTheFastestBodiesOverTheSmallestChunks) {
    const Terraces source = deep_terraces();
    for (const double speed : {1e5, 1e6, 1e7}) {
        for (const WorldPos& direction : {WorldPos(1, 0, 0), WorldPos(0.6, -0.8, 0)}) {
            const BodyNeed body = body_at({0.5, 0.5, 0}, 3.0, speed * direction);
            ContactNeeds needs(source, kDeepLevel);
            needs.find({&body, 1}, {}, 0.0, 0.1);
            EXPECT_EQ(needs.time_until({0, 0, kDeepLevel}), 0.0);
            EXPECT_LE(static_cast<double>(keys_of(needs, kDeepLevel).size()),
                      2.0 * ContactNeeds::kMostSquares);
            EXPECT_EQ(needs.is_cut(), speed > 1e5) << speed;
            const double until = std::min(0.1, 1e3 / speed);  // it is truncated later
            for (double time = 0.0; time < until; time += 1e-4 * until) {
                const WorldPos place = body.centre_world + time * body.velocity;
                ASSERT_LE(needs.time_until({static_cast<int>(std::floor(place.x())),
                                            static_cast<int>(std::floor(place.y())), kDeepLevel}),
                          time);
            }
        }
    }
}

TEST(ContactNeeds, LimitTheWorkOfEachBodyAndOfRegions) {
    const Terraces source = deep_terraces();
    const WorldRect world = test::whole_extent(source.lattice());
    const BodyNeed good = body_at({-500.3, 40.4, 30.0}, 1.0, {8, 3, -2});
    const RegionNeed small{{77, 77, 80, 80}, 1.0};
    const std::vector<BodyNeed> bodies{body_at({0, 0, 0}, 1e9),
                                       body_at({9, 9, 0}, 1.0, {1e7, 0, 0}), good};
    const std::vector<RegionNeed> regions{{world, 2.0}, small};
    ContactNeeds alone(source, kDeepLevel), all(source, kDeepLevel);
    alone.find({&good, 1}, {&small, 1}, 0.0, 1.0);
    ASSERT_FALSE(alone.is_cut());
    all.find(bodies, regions, 0.0, 1.0);
    EXPECT_TRUE(all.is_cut());
    EXPECT_LT(static_cast<double>(all.entries().size()), 4.0 * ContactNeeds::kMostSquares);
    for (const ContactNeeds::Entry& entry : alone.entries()) {
        ASSERT_LE(all.time_until(entry.key), entry.time);
    }
    // the truncated sphere is its middle
    EXPECT_EQ(all.time_until({-50, 50, kDeepLevel}), 0.0);
    EXPECT_EQ(all.current_contacts()[0].body, 0u);
}

// Each body falls over a dozen chunks or more, which kLeastShare allows also in a crowd.
TEST(ContactNeeds, OfACrowdAreTheUnionOfItsBodies) {
    const Terraces source = deep_terraces();
    std::vector<BodyNeed> bodies;
    for (int i = 0; i < 20'000; ++i) {
        bodies.push_back(body_at({3.0 * (i % 200), 3.0 * int{i / 200}, 5.0}, 0.5, {20, 10, -10}));
    }
    ContactNeeds all(source, kDeepLevel);
    all.find(bodies, {}, 0.0, 0.5);
    EXPECT_FALSE(all.is_cut());
    for (std::size_t i = 0; i < bodies.size(); i += 997) {
        ContactNeeds alone(source, kDeepLevel);
        alone.find({&bodies[i], 1}, {}, 0.0, 0.5);
        ASSERT_FALSE(alone.is_cut());
        EXPECT_GT(keys_of(alone, kDeepLevel).size(), 12u);
        for (const ContactNeeds::Entry& entry : alone.entries()) {
            ASSERT_LE(all.time_until(entry.key), entry.time) << i;
        }
    }
}

TEST(ContactNeeds, ContainNothingOfRemovedBodiesAndRegions) {
    const Terraces source = small_terraces();
    const BodyNeed body = body_at({0, 0, 0});
    ContactNeeds needs(source, kLevel);
    needs.find({&body, 1}, {}, 0.0, 1.0);
    EXPECT_FALSE(needs.entries().empty());
    needs.find({}, {}, 1.0, 1.0);
    EXPECT_TRUE(needs.entries().empty());
    EXPECT_TRUE(needs.current_contacts().empty());
    EXPECT_EQ(needs.time_until({0, 0, kLevel}), kInfinity);
    EXPECT_EQ(needs.time_until({0, 0, 0}), kInfinity);
}

}  // namespace contact_needs_test
}  // namespace terrane::internal
