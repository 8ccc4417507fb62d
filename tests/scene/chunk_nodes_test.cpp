// SPDX-License-Identifier: MIT
#include "scene/random_scene.h"

#include <terrane/scene/chunk_nodes.h>
#include <terrane/scene/scene.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace terrane::test::chunk_nodes {
namespace {

constexpr int kLevel = 6;  // chunks of 1 km, 8 m between samples

std::shared_ptr<const HeightSource> hills() { return FractalHeights::create({.seed = 4}).value(); }

// A disc in the middle of a chunk, and the keys in the order in which they were made.
struct Made {
    std::vector<ChunkKey> keys = {};
    std::set<ChunkKey, ResidentSet::Order> refused = {};

    ChunkNodes::Make function() {
        return [this](const Chunk& chunk, Scene& scene, NodeId node) -> Result<void> {
            keys.push_back(chunk.key);
            const auto disc =
                scene.add(node, {}, ParticlesNode{.discs = {{.centre = {1.0, 2.0, 3.0}}}});
            if (refused.contains(chunk.key)) return fail(ErrorCode::io, "no houses");
            return disc ? Result<void>() : tl::unexpected(disc.error());
        };
    }
};

// An eye, and a pager that holds the chunks around it, and older ones as long as they fit into its memory.
struct Flight {
    Pager pager;
    WorldPos eye_world{0.0, 0.0, 600.0};
    double time_s = 0.0;
    RequiredRegion around = {};

    explicit Flight(std::size_t chunks)
        : pager(Pager::create(hills(), {.memory_bytes = Chunk::max_bytes() * chunks,
                                        .worker_count = 0,
                                        .contact_spacing = 8.0})
                    .value()) {}

    std::shared_ptr<const ResidentSet> move(double metres) {
        constexpr double kReach = 1500.0;
        eye_world.x() += metres;
        time_s += 0.1;
        around = pager.require({eye_world.x() - kReach, -kReach, eye_world.x() + kReach, kReach},
                               time_s);
        pager.update({}, {}, time_s);
        return pager.resident();
    }
};

std::set<ChunkKey, ResidentSet::Order> keys_of_level(const ResidentSet& resident, int level) {
    std::set<ChunkKey, ResidentSet::Order> keys;
    for (const ResidentChunk& chunk : resident.chunks()) {
        if (chunk->key.level == level) keys.insert(chunk->key);
    }
    return keys;
}

double distance_to(const ChunkKey& key, const Lattice& lattice, const WorldPos& eye_world) {
    const double side = lattice.level_spacing(key.level) * kChunkCells;
    const double x = lattice.origin_x + (key.x + 0.5) * side - eye_world.x();
    const double y = lattice.origin_y + (key.y + 0.5) * side - eye_world.y();
    return std::sqrt(x * x + y * y);
}

TEST(ChunkNodes, AreThoseOfTheResidentChunksWhileACameraMoves) {
    Flight flight(60);
    Scene scene = Scene::create({}).value();
    Made made;
    ChunkNodes nodes =
        ChunkNodes::create({.level = kLevel, .most_made = 3}, scene.root(), made.function())
            .value();
    std::size_t came = 0, went = 0;
    for (int frame = 0; frame < 150; ++frame) {
        const auto resident = flight.move(frame % 50 < 40 ? 300.0 : 0.0);
        const std::size_t calls = made.keys.size();
        ASSERT_TRUE(nodes.update(*resident, flight.eye_world, scene));
        came += nodes.counts().made;
        went += nodes.counts().removed;
        ASSERT_EQ(made.keys.size() - calls, nodes.counts().made);
        ASSERT_LE(nodes.counts().made, 3u);
        const auto wanted = keys_of_level(*resident, kLevel);
        ASSERT_EQ(nodes.size() + nodes.counts().waiting, wanted.size());
        ASSERT_EQ(scene.node_count(), 1 + 2 * nodes.size());
        for (const ChunkKey& key : wanted) {
            const auto node = nodes.node_of(key);
            if (!node) continue;
            const double side = resident->lattice().level_spacing(kLevel) * kChunkCells;
            const auto box = scene.bounds_world(*node);
            ASSERT_TRUE(box);
            const Eigen::Vector3d corner(resident->lattice().origin_x + key.x * side,
                                         resident->lattice().origin_y + key.y * side, 0.0);
            EXPECT_LE((0.5 * (box->low + box->high) - corner - Eigen::Vector3d(1, 2, 3)).norm(),
                      1e-6);
        }
        // nearest first, and none that is farther than one that waits
        for (std::size_t i = calls; i < made.keys.size(); ++i) {
            const double distance =
                distance_to(made.keys[i], resident->lattice(), flight.eye_world);
            if (i > calls) {
                EXPECT_GE(distance,
                          distance_to(made.keys[i - 1], resident->lattice(), flight.eye_world));
            }
            for (const ChunkKey& key : wanted) {
                if (nodes.node_of(key)) continue;
                EXPECT_LE(distance, distance_to(key, resident->lattice(), flight.eye_world) + 1e-9);
            }
        }
        if (frame % 50 == 49) {
            EXPECT_EQ(nodes.counts().waiting, 0u) << "ten frames of rest";
        }
    }
    EXPECT_GT(came, 30u);
    EXPECT_GT(went, 10u);
}

TEST(ChunkNodes, TwoFlightsMakeTheSameInTheSameOrder) {
    std::array<Made, 2> made;
    for (Made& each : made) {
        Flight flight(60);
        Scene scene = Scene::create({}).value();
        ChunkNodes nodes =
            ChunkNodes::create({.level = kLevel}, scene.root(), each.function()).value();
        for (int frame = 0; frame < 40; ++frame) {
            const auto resident = flight.move(400.0);
            ASSERT_TRUE(nodes.update(*resident, flight.eye_world, scene));
        }
    }
    EXPECT_GT(made[0].keys.size(), 10u);
    EXPECT_EQ(made[0].keys, made[1].keys);
}

std::shared_ptr<const Chunk> chunk_of(std::int32_t x, std::int32_t y, int level) {
    auto chunk = std::make_shared<Chunk>();
    chunk->key = {x, y, static_cast<std::uint8_t>(level)};
    return chunk;
}

// Of sets of chunks of level 0 and 1, made by hand.
class ChunkNodesOfSets : public testing::Test {
protected:
    Result<void> update(std::vector<std::shared_ptr<const Chunk>> chunks, std::uint64_t epoch,
                        const WorldPos& eye_world = {0, 0, 0}) {
        chunks.push_back(root_);
        return nodes_.update(
            ResidentSet(lattice_, {0.0, 0.0, 256.0, 256.0}, std::move(chunks), epoch), eye_world,
            scene_);
    }

    const Lattice lattice_{.spacing = 1.0, .finest_level = 1};
    const std::shared_ptr<const Chunk> root_ = chunk_of(0, 0, 0), west_ = chunk_of(0, 0, 1),
                                       east_ = chunk_of(1, 0, 1);
    Scene scene_ = Scene::create({}).value();
    Made made_;
    ChunkNodes nodes_ = ChunkNodes::create({.level = 1}, scene_.root(), made_.function()).value();
};

TEST_F(ChunkNodesOfSets, DoNothingWhereNothingChanges) {
    ASSERT_TRUE(update({west_, east_}, 1));
    const auto node = nodes_.node_of(west_->key);
    for (std::uint64_t epoch : {1u, 1u, 2u}) {
        ASSERT_TRUE(update({west_, east_}, epoch, {300, 0, 0}));
        EXPECT_EQ(nodes_.counts().made, 0u);
        EXPECT_EQ(nodes_.counts().removed, 0u);
        EXPECT_EQ(nodes_.node_of(west_->key), node);
    }
    EXPECT_EQ(made_.keys.size(), 2u);
}

TEST_F(ChunkNodesOfSets, OfEquallyNearChunksTheSouthernAndThenTheWesternComesFirst) {
    ASSERT_TRUE(update({chunk_of(1, 1, 1), chunk_of(0, 1, 1), east_, west_}, 1, {128, 128, 0}));
    EXPECT_EQ(made_.keys, (std::vector<ChunkKey>{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}}));
}

TEST_F(ChunkNodesOfSets, OfAChunkThatIsReplacedAreMadeAnew) {
    const auto first = chunk_of(0, 0, 1);
    ASSERT_TRUE(update({first}, 1));
    const auto before = nodes_.node_of(first->key);
    ASSERT_TRUE(update({west_}, 2));
    EXPECT_EQ(nodes_.counts().made, 1u);
    EXPECT_EQ(nodes_.counts().removed, 1u);
    EXPECT_NE(nodes_.node_of(first->key), before);
    EXPECT_EQ(scene_.node_count(), 3u);
    EXPECT_EQ(first.use_count(), 1) << "the chunk that has gone is not held";
}

TEST_F(ChunkNodesOfSets, ThatFailLeaveNothingAndAreTriedAgainWhenTheirChunkComesBack) {
    made_.refused = {west_->key};
    const Result<void> failed = update({west_, east_}, 1);
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().message, "no houses");
    EXPECT_EQ(nodes_.counts().failed, 1u);
    EXPECT_EQ(nodes_.size(), 1u);
    EXPECT_FALSE(nodes_.node_of(west_->key));
    EXPECT_TRUE(nodes_.node_of(east_->key));
    EXPECT_EQ(scene_.node_count(), 3u);
    EXPECT_TRUE(update({west_, east_}, 2));
    EXPECT_EQ(made_.keys.size(), 2u) << "it is not tried again";
    made_.refused.clear();
    EXPECT_TRUE(update({east_}, 3));
    EXPECT_EQ(nodes_.counts().failed, 0u);
    EXPECT_TRUE(update({west_, east_}, 4));
    EXPECT_EQ(nodes_.size(), 2u);
    nodes_.clear(scene_);
    EXPECT_EQ(scene_.node_count(), 1u);
    EXPECT_TRUE(update({west_, east_}, 4));
    EXPECT_EQ(nodes_.size(), 2u);
}

TEST(ChunkNodes, RefuseSettingsOutOfRange) {
    Scene scene = Scene::create({}).value();
    Made made;
    const auto message = [&](const ChunkNodesSettings& settings, ChunkNodes::Make make) {
        const auto nodes = ChunkNodes::create(settings, scene.root(), std::move(make));
        return nodes ? std::string() : nodes.error().message;
    };
    EXPECT_EQ(message({.level = 24}, made.function()), "");
    EXPECT_NE(message({.level = 25}, made.function()).find("got 25"), std::string::npos);
    EXPECT_NE(message({.level = -1}, made.function()).find("got -1"), std::string::npos);
    EXPECT_NE(message({.most_made = 0}, made.function()).find("most_made"), std::string::npos);
    EXPECT_NE(message({}, nullptr).find("function"), std::string::npos);
}

}  // namespace
}  // namespace terrane::test::chunk_nodes
