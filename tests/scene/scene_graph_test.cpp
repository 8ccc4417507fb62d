// SPDX-License-Identifier: MIT
#include "scene/scene_cases.h"

#include <terrane/scene/culling.h>
#include <terrane/scene/scene_graph.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace terrane::test::scene_graph {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

GeometryNode cube(std::uint32_t mesh, double half = 1.0) {
    return {.mesh = MeshId{mesh},
            .bounds = {Eigen::Vector3d::Constant(-half), Eigen::Vector3d::Constant(half)},
            .triangles = 12};
}

NodePlace at(const Eigen::Vector3d& translation, double scale = 1.0) {
    return {{Eigen::Matrix3d::Identity(), translation}, scale};
}

NodePlace random_place(Random& random, double spread) {
    return {{random.rotation(), random.between(0.0, spread) * random.direction()},
            std::exp2(random.between(-1.0, 1.0))};
}

NodeId add(SceneGraph& graph, NodeId parent, const NodePlace& place, NodeContent content) {
    return graph.add(parent, place, std::move(content)).value();
}

// Meshes that a frame draws, with their coverage.
std::map<std::uint32_t, float> drawn(SceneGraph& graph, const View& view,
                                     double threshold_px = 1.0) {
    std::map<std::uint32_t, float> meshes;
    const SceneDraws draws = graph.collect(view, threshold_px);
    for (const MeshDraw& draw : draws.meshes) {
        for (std::uint32_t i = 0; i < draw.instance_count; ++i)
            meshes[static_cast<std::uint32_t>(draw.mesh)] =
                draws.instances[draw.first_instance + i].coverage;
    }
    return meshes;
}

View view_at_distance(double distance) {
    View view;
    view.eye_world = {0.0, -distance, 0.0};
    return view;
}

// A tree of nodes and, beside it, where each mesh is in the world.
struct Known {
    SceneGraph graph;
    std::vector<NodeId> nodes;
    std::map<std::uint32_t, OrientedBox> boxes;
};

Known random_tree(Random& random) {
    Known known;
    struct Placed {
        NodeId id;
        Pose pose;
        double scale;
    };
    std::vector<Placed> placed = {{known.graph.root(), {}, 1.0}};
    for (std::uint32_t i = 0; i < 60; ++i) {
        const Placed& parent =
            placed[static_cast<std::size_t>(random.below(static_cast<int>(placed.size())))];
        const NodePlace place = random_place(random, 40.0);
        const Pose pose = {
            parent.pose.rotation * place.parent_from_node.rotation,
            parent.pose * Eigen::Vector3d(parent.scale * place.parent_from_node.translation)};
        const double scale = parent.scale * place.scale;
        const bool is_mesh = random.below(3) > 0;
        const double half = random.between(0.1, 5.0);
        const NodeId id = add(known.graph, parent.id, place,
                              is_mesh ? NodeContent(cube(i, half)) : NodeContent(GroupNode{}));
        if (is_mesh) known.boxes[i] = transform(pose, scale, cube(i, half).bounds);
        placed.push_back({id, pose, scale});
        known.nodes.push_back(id);
    }
    return known;
}

TEST(SceneGraph, DrawsEveryMeshInViewWhereverItHangsInTheTree) {
    std::size_t in_view = 0, culled = 0;
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Known known = random_tree(random);
        for (int frame = 0; frame < 10; ++frame) {
            const View view = random_view(random, WorldPos(0, 0, 0));
            const ViewVolume volume(view);
            const std::map<std::uint32_t, float> meshes = drawn(known.graph, view);
            for (const auto& [mesh, box] : known.boxes) {
                if (volume.meets(box)) {
                    ++in_view;
                    ASSERT_TRUE(meshes.contains(mesh)) << mesh;
                }
                culled += meshes.contains(mesh) ? 0u : 1u;
            }
        }
    }
    EXPECT_GT(in_view, 1000u);
    EXPECT_GT(culled, 1000u);
}

TEST(SceneGraph, GivesMeshesOutOfViewWhoseShadowsCanFallIntoItAsCasters) {
    int needed = 0, casters = 0;
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Known known = random_tree(random);
        for (int frame = 0; frame < 10; ++frame) {
            const View view = random_view(random, WorldPos(0, 0, 0));
            const SunShadows shadows{.sun_direction = random.direction(), .distance = 100.0};
            const std::map<std::uint32_t, float> meshes = drawn(known.graph, view);
            const GraphCounts counts = known.graph.counts();
            const SceneDraws draws = known.graph.collect(view, 1.0, shadows);
            ASSERT_EQ(known.graph.counts().drawn, counts.drawn);
            ASSERT_EQ(known.graph.counts().triangles, counts.triangles);
            ASSERT_EQ(draws.meshes.size(), meshes.size());
            std::set<std::uint32_t> given;
            for (const MeshDraw& draw : draws.meshes) {
                ASSERT_TRUE(meshes.contains(static_cast<std::uint32_t>(draw.mesh)));
                given.insert(static_cast<std::uint32_t>(draw.mesh));
            }
            for (const MeshDraw& draw : draws.caster_meshes) {
                ASSERT_TRUE(given.insert(static_cast<std::uint32_t>(draw.mesh)).second);
                ++casters;
            }
            const ViewVolume receivers(view, shadows.distance);
            for (const auto& [mesh, box] : known.boxes) {
                OrientedBox moved = box;
                moved.frame_from_box.translation -=
                    random.between(0.0, 200.0) * shadows.sun_direction;
                if (!receivers.meets(moved)) continue;
                ++needed;
                ASSERT_TRUE(given.contains(mesh)) << mesh;
            }
        }
    }
    EXPECT_GT(needed, 1000);
    EXPECT_GT(casters, 1000);
}

TEST(SceneGraph, BoundsFollowPlacesContentAndNodesThatGo) {
    SceneGraph graph;
    const NodeId arm = add(graph, graph.root(), at({10, 0, 0}), GroupNode{});
    EXPECT_FALSE(graph.bounds_world(graph.root()).has_value());
    const NodeId hand = add(graph, arm, at({5, 0, 0}), cube(0));
    const auto high_x = [&] { return graph.bounds_world(graph.root())->high.x(); };
    EXPECT_NEAR(high_x(), 16.0, 1e-9);
    EXPECT_NEAR(graph.bounds_world(hand)->low.x(), 14.0, 1e-9);
    ASSERT_TRUE(graph.set_place(arm, at({20, 0, 0}, 2.0)));
    EXPECT_NEAR(high_x(), 32.0, 1e-9);
    ASSERT_TRUE(graph.set_content(hand, cube(0, 3.0)));
    EXPECT_NEAR(high_x(), 36.0, 1e-9);
    const NodeId finger = add(graph, hand, at({8, 0, 0}), cube(1));
    EXPECT_NEAR(high_x(), 20.0 + 2.0 * (5.0 + 9.0), 1e-9);
    EXPECT_EQ(graph.size(), 4u);
    graph.remove(hand);
    EXPECT_EQ(graph.size(), 2u);
    EXPECT_FALSE(graph.bounds_world(graph.root()).has_value());
    EXPECT_FALSE(graph.bounds_world(finger).has_value());
    graph.remove(graph.root());
    EXPECT_EQ(graph.size(), 2u);
}

// A switch at the origin with as many small cubes as levels.
SceneGraph graph_of_levels(const SwitchNode& by, std::uint32_t count) {
    SceneGraph graph;
    const NodeId levels = add(graph, graph.root(), at({0, 0, 0}), by);
    for (std::uint32_t i = 0; i < count; ++i) add(graph, levels, at({0, 0, 0}), cube(i, 0.001));
    return graph;
}

TEST(SceneGraph, ASwitchByDistanceDrawsTheLevelOfItsDistance) {
    SceneGraph graph =
        graph_of_levels({.by = SwitchNode::By::distance, .limits = {50.0, 200.0, 1000.0}}, 3);
    using Meshes = std::map<std::uint32_t, float>;
    EXPECT_EQ(drawn(graph, view_at_distance(10.0)), (Meshes{{0, 1.0f}}));
    EXPECT_EQ(drawn(graph, view_at_distance(60.0)), (Meshes{{1, 1.0f}}));
    EXPECT_EQ(drawn(graph, view_at_distance(900.0)), (Meshes{{2, 1.0f}}));
    EXPECT_TRUE(drawn(graph, view_at_distance(1100.0)).empty());
}

TEST(SceneGraph, ASwitchByErrorFollowsTheThreshold) {
    SceneGraph graph = graph_of_levels({.limits = {0.1, 0.5, kNever}}, 3);
    const View view = view_at_distance(100.0);
    const double pixel = view.pixels_per_radian() / 100.0;  // of a metre
    using Meshes = std::map<std::uint32_t, float>;
    EXPECT_EQ(drawn(graph, view, 0.09 * pixel), (Meshes{{0, 1.0f}}));
    EXPECT_EQ(drawn(graph, view, 0.11 * pixel), (Meshes{{1, 1.0f}}));
    EXPECT_EQ(drawn(graph, view, 0.6 * pixel), (Meshes{{2, 1.0f}}));
    EXPECT_EQ(drawn(graph, view, 1e9), (Meshes{{2, 1.0f}})) << "an infinite limit draws always";
}

TEST(SceneGraph, HysteresisKeepsALevelNearItsLimit) {
    SceneGraph graph = graph_of_levels(
        {.by = SwitchNode::By::distance, .limits = {100.0, kNever}, .hysteresis = 1.2}, 2);
    const auto level_at = [&](double distance) {
        return drawn(graph, view_at_distance(distance)).begin()->first;
    };
    EXPECT_EQ(level_at(90.0), 0u);
    EXPECT_EQ(level_at(110.0), 0u) << "not far enough beyond the limit";
    EXPECT_EQ(level_at(125.0), 1u);
    EXPECT_EQ(level_at(95.0), 1u) << "not near enough";
    EXPECT_EQ(level_at(80.0), 0u);
    int changes = 0;
    std::uint32_t before = level_at(100.0);
    for (int i = 0; i < 200; ++i) {
        const std::uint32_t now = level_at(100.0 + 5.0 * std::sin(0.7 * i));
        changes += now != before ? 1 : 0;
        before = now;
    }
    EXPECT_EQ(changes, 0);
}

TEST(SceneGraph, AFadeDrawsBothLevelsWithComplementaryCoverage) {
    SceneGraph graph = graph_of_levels(
        {.by = SwitchNode::By::distance, .limits = {100.0, 400.0}, .fade_ratio = 1.25}, 2);
    std::map<std::uint32_t, float> before = drawn(graph, view_at_distance(90.0));
    int fading = 0;
    for (double distance = 90.0; distance < 600.0; distance *= 1.0005) {
        std::map<std::uint32_t, float> now = drawn(graph, view_at_distance(distance));
        if (now.size() == 2) {
            ++fading;
            ASSERT_EQ(now[1], now[0] - 1.0f);
        }
        for (std::uint32_t level = 0; level < 2; ++level)
            ASSERT_LT(std::abs(std::abs(now[level]) - std::abs(before[level])), 0.01f);
        before = now;
    }
    EXPECT_GT(fading, 300);
    EXPECT_EQ(std::abs(before[0]) + std::abs(before[1]), 0.0f) << "beyond the last limit: nothing";
}

// The rotation of the only instance that is drawn.
Eigen::Matrix3d rotation_drawn(SceneGraph& graph, const View& view) {
    const SceneDraws draws = graph.collect(view, 1.0);
    EXPECT_EQ(draws.instances.size(), 1u);
    const std::array<float, 4>& q = draws.instances[0].rotation;
    return Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix();
}

TEST(SceneGraph, ABillboardTurnsItsChildrenToThePictureOrAboutItsAxisOnly) {
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        View view = random_view(random, WorldPos(0, 0, 0));
        view.eye_world = 30.0 * random.direction();
        view.forward = -view.eye_world.normalized();
        view.up = any_perpendicular(view.forward, random);
        view.vertical_fov = 1.0;
        for (const BillboardNode::Axis axis :
             {BillboardNode::Axis::screen, BillboardNode::Axis::up}) {
            SceneGraph graph;
            const NodePlace place = {{random.rotation(), {0, 0, 0}}, 1.0};
            const NodeId board = add(graph, graph.root(), place, BillboardNode{axis});
            add(graph, board, at({0, 0, 0}), cube(0));
            const Eigen::Matrix3d turned = rotation_drawn(graph, view);
            EXPECT_NEAR((turned.transpose() * turned - Eigen::Matrix3d::Identity()).norm(), 0.0,
                        1e-5);
            if (axis == BillboardNode::Axis::screen) {
                EXPECT_LT((turned.col(0) - view.right()).norm(), 1e-5);
                EXPECT_LT((turned.col(1) - view.up).norm(), 1e-5);
                continue;
            }
            const Eigen::Vector3d up = place.parent_from_node.rotation.col(2);
            EXPECT_LT((turned.col(2) - up).norm(), 1e-5) << "its axis stays";
            // nothing of the direction to the eye is left along y
            EXPECT_NEAR(turned.col(1).dot(view.eye_world), 0.0, 1e-3);
            EXPECT_GT(turned.col(0).dot(view.eye_world), 0.0);
            // another roll of the viewer's head changes nothing
            View rolled = view;
            rolled.up = any_perpendicular(view.forward, random);
            EXPECT_LT((rotation_drawn(graph, rolled) - turned).norm(), 1e-6);
        }
    }
}

TEST(SceneGraph, ParticlesComeFromFarToNear) {
    Random random(1);
    SceneGraph graph;
    ParticlesNode smoke;
    for (int i = 0; i < 200; ++i)
        smoke.discs.push_back({20.0 * random.direction(), random.between(0.1, 1.0), {}});
    const NodeId node = add(graph, graph.root(), at({0, 60, 0}, 2.0), smoke);
    View view;
    const SceneDraws draws = graph.collect(view, 1.0);
    ASSERT_EQ(draws.particles.size(), 200u);
    EXPECT_EQ(graph.counts().triangles, 400u);
    double before = kNever;
    for (const Particle& particle : draws.particles) {
        const double distance = Eigen::Vector3f(particle.offset_eye.data()).norm();
        ASSERT_LE(distance, before * (1.0 + 1e-6));
        before = distance;
    }
    ASSERT_TRUE(graph.set_place(node, at({0, -200, 0})));
    EXPECT_TRUE(graph.collect(view, 1.0).particles.empty());
    EXPECT_EQ(graph.counts().culled, 1u);
}

TEST(SceneGraph, RefusesWhatIsOutOfRangeByItsName) {
    SceneGraph graph;
    const auto message = [&](const NodePlace& place, NodeContent content) {
        const auto added = graph.add(graph.root(), place, std::move(content));
        return added ? std::string() : added.error().message;
    };
    EXPECT_EQ(graph.add(NodeId{77}, {}, GroupNode{}).error().message, "the graph has no node 77");
    EXPECT_EQ(graph.set_place(NodeId{77}, {}).error().message, "the graph has no node 77");
    EXPECT_EQ(message(at({0, 0, 0}, 0.0), GroupNode{}), "scale must be 1e-06 to 1e+06, got 0");
    EXPECT_EQ(message(at({std::nan(""), 0, 0}), GroupNode{}),
              "the translation must be within 2e9 m along each axis");
    EXPECT_EQ(message({{2.0 * Eigen::Matrix3d::Identity(), {0, 0, 0}}, 1.0}, GroupNode{}),
              "the rotation must be orthonormal to 1e-6 with determinant 1");
    EXPECT_EQ(message({}, SwitchNode{}), "a switch needs at least one limit, got 0");
    EXPECT_EQ(message({}, SwitchNode{.limits = {2.0, 1.0}}),
              "limits must not decrease, and differ by fade_ratio at least, got 1 after 2");
    EXPECT_EQ(message({}, SwitchNode{.limits = {-1.0}}), "limits must be above 0, got -1 at 0");
    EXPECT_EQ(message({}, SwitchNode{.limits = {1.0}, .hysteresis = 1.1, .fade_ratio = 1.1}),
              "a switch has hysteresis or a fade_ratio, not both");
    EXPECT_EQ(message({}, GeometryNode{.bounds = {{1, 0, 0}, {0, 0, 0}}}),
              "bounds must be finite, low at most high");
    EXPECT_EQ(message({}, ParticlesNode{{{{0, 0, 0}, 0.0, {}}}}),
              "the radius of disc 0 must be above 0, got 0");
    NodeId deepest = graph.root();
    for (int i = 0; i < 256; ++i) deepest = add(graph, deepest, {}, GroupNode{});
    EXPECT_EQ(graph.add(deepest, {}, GroupNode{}).error().message,
              "nodes must be at most 256 deep");
    EXPECT_EQ(graph.size(), 257u);
    View invalid;
    invalid.vertical_fov = -1.0;
    EXPECT_TRUE(graph.collect(invalid, 1.0).instances.empty());
}

}  // namespace

namespace chunk_nodes_test {

constexpr int kLevel = 6;  // chunks of 1 km, 8 m between samples

std::shared_ptr<const HeightSource> hills() { return FractalHeights::create({.seed = 4}).value(); }

// A disc in the middle of a chunk, and the keys in the order in which they were made.
struct Made {
    std::vector<ChunkKey> keys = {};
    std::set<ChunkKey, ResidentSet::Order> refused = {};

    ChunkNodes::Make function() {
        return [this](const Chunk& chunk, SceneGraph& graph, NodeId node) -> Result<void> {
            keys.push_back(chunk.key);
            const auto disc =
                graph.add(node, {}, ParticlesNode{.discs = {{.centre = {1.0, 2.0, 3.0}}}});
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
    SceneGraph graph;
    Made made;
    ChunkNodes nodes =
        ChunkNodes::create({.level = kLevel, .most_made = 3}, graph.root(), made.function())
            .value();
    std::size_t came = 0, went = 0;
    for (int frame = 0; frame < 150; ++frame) {
        const auto resident = flight.move(frame % 50 < 40 ? 300.0 : 0.0);
        const std::size_t calls = made.keys.size();
        ASSERT_TRUE(nodes.update(*resident, flight.eye_world, graph));
        came += nodes.counts().made;
        went += nodes.counts().removed;
        ASSERT_EQ(made.keys.size() - calls, nodes.counts().made);
        ASSERT_LE(nodes.counts().made, 3u);
        const auto wanted = keys_of_level(*resident, kLevel);
        ASSERT_EQ(nodes.size() + nodes.counts().waiting, wanted.size());
        ASSERT_EQ(graph.size(), 1 + 2 * nodes.size());
        for (const ChunkKey& key : wanted) {
            const auto node = nodes.node_of(key);
            if (!node) continue;
            const double side = resident->lattice().level_spacing(kLevel) * kChunkCells;
            const auto box = graph.bounds_world(*node);
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
        SceneGraph graph;
        ChunkNodes nodes =
            ChunkNodes::create({.level = kLevel}, graph.root(), each.function()).value();
        for (int frame = 0; frame < 40; ++frame) {
            const auto resident = flight.move(400.0);
            ASSERT_TRUE(nodes.update(*resident, flight.eye_world, graph));
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
            graph_);
    }

    const Lattice lattice_{.spacing = 1.0, .finest_level = 1};
    const std::shared_ptr<const Chunk> root_ = chunk_of(0, 0, 0), west_ = chunk_of(0, 0, 1),
                                       east_ = chunk_of(1, 0, 1);
    SceneGraph graph_;
    Made made_;
    ChunkNodes nodes_ = ChunkNodes::create({.level = 1}, graph_.root(), made_.function()).value();
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
    EXPECT_EQ(graph_.size(), 3u);
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
    EXPECT_EQ(graph_.size(), 3u);
    EXPECT_TRUE(update({west_, east_}, 2));
    EXPECT_EQ(made_.keys.size(), 2u) << "it is not tried again";
    made_.refused.clear();
    EXPECT_TRUE(update({east_}, 3));
    EXPECT_EQ(nodes_.counts().failed, 0u);
    EXPECT_TRUE(update({west_, east_}, 4));
    EXPECT_EQ(nodes_.size(), 2u);
    nodes_.clear(graph_);
    EXPECT_EQ(graph_.size(), 1u);
    EXPECT_TRUE(update({west_, east_}, 4));
    EXPECT_EQ(nodes_.size(), 2u);
}

TEST(ChunkNodes, RefuseSettingsOutOfRange) {
    SceneGraph graph;
    Made made;
    const auto message = [&](const ChunkNodesSettings& settings, ChunkNodes::Make make) {
        const auto nodes = ChunkNodes::create(settings, graph.root(), std::move(make));
        return nodes ? std::string() : nodes.error().message;
    };
    EXPECT_EQ(message({.level = 24}, made.function()), "");
    EXPECT_NE(message({.level = 25}, made.function()).find("got 25"), std::string::npos);
    EXPECT_NE(message({.level = -1}, made.function()).find("got -1"), std::string::npos);
    EXPECT_NE(message({.most_made = 0}, made.function()).find("most_made"), std::string::npos);
    EXPECT_NE(message({}, nullptr).find("function"), std::string::npos);
}

}  // namespace chunk_nodes_test
}  // namespace terrane::test::scene_graph
