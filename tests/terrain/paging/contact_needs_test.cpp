// SPDX-License-Identifier: MIT
#include "paging/demand/contact_needs.h"

#include "support/grounds.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace terrane::internal::contact_needs_test {

using namespace test;

/// Terraced ground: each chunk of one level is flat at its own height.
class Terraces final : public HeightSource {
public:
    Terraces(const Lattice& lattice, const WorldRect& extent, int level)
        : HeightSource(lattice, extent), side_(lattice.level_spacing(level) * kChunkCells) {}

    double terrace(std::int64_t column, std::int64_t row) const {
        return 5.0 * static_cast<double>(((column * 7 + row * 13) % 8 + 8) % 8);
    }
    double height(double x, double y) const override {
        return terrace(index((x - lattice().origin_x) / side_),
                       index((y - lattice().origin_y) / side_));
    }
    /// Counts the edges of a rectangle as part of its own chunk only.
    HeightInterval interval(const WorldRect& rect) const override {
        if (rect.east - rect.west > 1.5 * side_) return {0.0, 35.0};
        const double middle =
            height(0.5 * (rect.west + rect.east), 0.5 * (rect.south + rect.north));
        return {middle, middle};
    }
    double rise_bound(double) const override { return 35.0; }
    Result<void> sample(const SampleGrid&, std::span<double>) const override { return {}; }
    Result<void> vertex_bounds(const SampleGrid&, std::span<float>) const override { return {}; }
    Result<void> cell_bounds(const SampleGrid&, std::span<float>) const override { return {}; }

private:
    static std::int64_t index(double place) { return static_cast<std::int64_t>(std::floor(place)); }
    double side_;
};

/// A lattice of 16 x 16 chunks of 64 m at level 3 around the origin.
constexpr int kLevel = 3;
constexpr double kSide = 64.0;
Terraces small_terraces() {
    const Lattice lattice = small_world(kLevel + 1, 0.25);
    return {lattice, whole_extent(lattice), kLevel};
}

/// A lattice of 2^18 x 2^18 chunks of 1 m.
constexpr int kDeepLevel = 17;
Terraces deep_terraces() {
    const Lattice lattice = small_world(kDeepLevel, 1.0 / kChunkCells);
    return {lattice, whole_extent(lattice), kDeepLevel};
}

/// All chunks of level 3 of the small world.
std::vector<ChunkKey> all_small_chunks() {
    std::vector<ChunkKey> keys;
    for (int y = -8; y < 8; ++y) {
        for (int x = -8; x < 8; ++x) keys.push_back({x, y, kLevel});
    }
    return keys;
}

/// The needed chunks of one level.
std::set<ChunkKey> keys_of(const ContactNeeds& needs, int level) {
    std::set<ChunkKey> keys;
    for (const ContactNeeds::Entry& entry : needs.entries()) {
        if (entry.key.level == level) keys.insert(entry.key);
    }
    return keys;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool is_same(const ContactNeeds& a, const ContactNeeds& b) {
    return std::ranges::equal(a.entries(), b.entries(), [](const auto& one, const auto& other) {
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
    // a point at rest, horizon 0
    EXPECT_EQ(find_keys(source, body_at({10, 10, 0}, 0.0), 0.0), Keys{key(0, 0)});
    EXPECT_EQ(find_keys(source, body_at({64, 10, 0}, 0.0), 0.0), (Keys{key(0, 0), key(1, 0)}));
    EXPECT_EQ(find_keys(source, body_at({-64, -64, 0}, 0.0), 0.0),
              (Keys{key(-2, -2), key(-2, -1), key(-1, -2), key(-1, -1)}));
    // a sphere that just touches an edge, and one that touches the edge's line beyond its corner
    EXPECT_EQ(find_keys(source, body_at({60, 10, 0}, 4.0), 0.0), (Keys{key(0, 0), key(1, 0)}));
    EXPECT_EQ(find_keys(source, body_at({60, 10, 0}, 3.999), 0.0), Keys{key(0, 0)});
    EXPECT_EQ(find_keys(source, body_at({60, 60, 0}, 5.0), 0.0),
              (Keys{key(0, 0), key(1, 0), key(0, 1)}));
    // on the border and the corner of the world
    EXPECT_EQ(find_keys(source, body_at({512, 512, 0}, 0.0), 0.0), Keys{key(7, 7)});
    EXPECT_EQ(find_keys(source, body_at({-512, 10, 0}, 0.0), 0.0), Keys{key(-8, 0)});
    // the whole world
    EXPECT_EQ(find_keys(source, body_at({0, 0, 0}, 1e9), 4.0).size(), 256u);
    EXPECT_EQ(find_keys(source, body_at({0, 0, 0}, 1e300, {1e300, 0, 0}), 4.0).size(), 256u);
}

TEST(ContactNeeds, AreEmptyBesideAndAboveTheGround) {
    const Terraces source = small_terraces();
    EXPECT_TRUE(find_keys(source, body_at({513.5, 0, 0}), 0.0).empty());
    EXPECT_TRUE(find_keys(source, body_at({1e7, 1e7, 0}), 4.0).empty());
    EXPECT_TRUE(find_keys(source, body_at({-1e300, 1e300, 0}), 4.0).empty());
    EXPECT_TRUE(find_keys(source, body_at({10, 10, 1e6}), 4.0).empty());
    // it falls 78 m; the highest ground is at 35 m
    EXPECT_TRUE(find_keys(source, body_at({10, 10, 120.0}), 4.0).empty());
    EXPECT_FALSE(find_keys(source, body_at({10, 10, 110.0}), 4.0).empty());
    EXPECT_TRUE(find_keys(source, body_at({10, 10, 50}, 1.0, {0, 0, 500.0}), 4.0).empty());
    // a waiting body: needed at once, at any height
    for (const double z : {-1e6, 36.0, 120.0, 1e6}) {
        BodyNeed waiting = body_at({10, 10, z});
        waiting.is_waiting = true;
        ContactNeeds needs(source, kLevel);
        needs.find({&waiting, 1}, {}, 0.0, 0.01);
        ASSERT_TRUE(keys_of(needs, kLevel).contains({0, 0, kLevel})) << z;
        ASSERT_EQ(needs.current_contacts().size(), 1u);
        EXPECT_EQ(keys_of(needs, kLevel).size(), 1u);
    }
    // at any depth below the ground
    EXPECT_TRUE(find_keys(source, body_at({10, 10, -1e9}), 0.0).contains({0, 0, kLevel}));
}

TEST(ContactNeeds, AreEmptyBeyondTheExtent) {
    const Lattice lattice = test::small_world(kLevel + 1, 0.25);
    const Terraces source(lattice, {-512.0, -512.0, 64.0, 100.0}, kLevel);
    // a chunk that only touches the extent's edge contains no ground
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
    // one second of motion towards (1, 0), then a jump to (-2, -2) at 102 s; past moments do not matter
    const std::vector<BodyMoment> trajectory{{98.0, {-300, 32, 0}},
                                             {99.0, {-300, 300, 0}},
                                             {101.0, {96, 32, 0}},
                                             {102.0, {96, 32, 0}},
                                             {102.0, {-96, -96, 0}}};
    body.trajectory = trajectory;
    EXPECT_EQ(time_until(body, 0, 0), 0.0);
    EXPECT_NEAR(time_until(body, 1, 0), 31.0 / 64.0, kStep);
    EXPECT_NEAR(time_until(body, -2, -2), 2.0, kStep);
    EXPECT_EQ(time_until(body, 0, 1), kInfinity);    // along its velocity
    EXPECT_EQ(time_until(body, -1, -1), kInfinity);  // between the ends of the jump
    EXPECT_EQ(time_until(body, -5, 0), kInfinity);   // where it was before
    // all moments are past: the body is at rest and does not fall
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
    // a jump now: both ends are needed, one of them is a current contact
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
    EXPECT_TRUE(std::ranges::is_sorted(
        both.entries(), [](const auto& a, const auto& b) { return a.time < b.time; }));
}

TEST(ContactNeeds, GiveTheSameBitsWhateverTheyDidBefore) {
    SeededRandom random(25);
    const Terraces source = deep_terraces();
    ContactNeeds used(source, kDeepLevel);
    std::vector<BodyNeed> bodies;
    for (int run = 0; run < 60; ++run) {
        SCOPED_TRACE("run " + std::to_string(run));
        // some positions recur, so that the cache is used
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
            const double until = std::min(0.1, 1e3 / speed);  // longer motions are truncated
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
    // of the truncated sphere only the middle remains
    EXPECT_EQ(all.time_until({-50, 50, kDeepLevel}), 0.0);
    EXPECT_EQ(all.current_contacts()[0].body, 0u);
}

// Each body falls over a dozen chunks or more; kLeastShare allows that for each body of a crowd.
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

// ContactNeeds against dense sampling of every body's trajectory over all chunks.

constexpr double kGravity = 9.81;

WorldRect square_of(const ChunkKey& key) {
    return {kSide * key.x, kSide * key.y, kSide * (key.x + 1), kSide * (key.y + 1)};
}

// Distance of a point from the column below the highest ground of a chunk.
double distance_to(const Terraces& source, const ChunkKey& key, const WorldPos& point) {
    const WorldRect square = square_of(key);
    const double x = std::clamp(point.x(), square.west, square.east) - point.x();
    const double y = std::clamp(point.y(), square.south, square.north) - point.y();
    const double z = std::max(0.0, point.z() - source.terrace(key.x, key.y));
    return std::sqrt(x * x + y * y + z * z);
}

// Calls use(seconds from now, centre, reach) at dense, increasing times along a body's trajectory.
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

// Contacts with chunks by dense sampling, with every body enlarged by `wider` metres.
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
    std::vector<std::vector<BodyMoment>> trajectories;  // followed by the bodies
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
        BodyNeed body{.centre_world = random_place(random, 650.0)};
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
    SeededRandom random(21);
    const Terraces source = small_terraces();
    const int runs = few_or_many(150, 400);
    for (int run = 0; run < runs; ++run) {
        SCOPED_TRACE("run " + std::to_string(run));
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
                // infinite at the horizon's end
                if (needs.end_of(key) == kInfinity) continue;
                ++ends;
                late += needs.end_of(key) - touched.last;
            }
        }
        SCOPED_TRACE("seed " + std::to_string(kSeed) +
                     (has_trajectories ? ", trajectories" : ", no trajectories"));
        EXPECT_GT(count, 2000u);
        // measured: 0.12 without trajectories, where most bodies are in the air and a box is lower than its sphere at
        // the edges; 0.05 with trajectories
        EXPECT_LT(static_cast<double>(missed), 0.15 * static_cast<double>(count));
        EXPECT_LT(early, 0.05 * horizons);
        EXPECT_GT(ends, 200u);
        EXPECT_LT(late, 0.03 * horizons);
    }
}

TEST(ContactNeeds, AreOrderedByTimeLevelAndKeyAndAncestorsSpanTheTimesOfDescendants) {
    SeededRandom random(23);
    const Terraces source = small_terraces();
    for (int run = 0; run < 100; ++run) {
        SCOPED_TRACE("run " + std::to_string(run));
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
        ASSERT_TRUE(std::ranges::equal(expected, needs.entries(), [](const auto& a, const auto& b) {
            return a.key == b.key && a.time == b.time;
        }));
        EXPECT_EQ(needs.time_until({0, 0, kLevel + 1}), kInfinity);
    }
}

TEST(ContactNeeds, ListTheCurrentContactsOfBodies) {
    SeededRandom random(24);
    const Terraces source = small_terraces();
    std::size_t count = 0;
    for (int run = 0; run < 300; ++run) {
        SCOPED_TRACE("run " + std::to_string(run));
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
                // no body is that close to touching
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

}  // namespace terrane::internal::contact_needs_test
