// SPDX-License-Identifier: MIT
#include "scene/random_scene.h"
#include "scene/scene_cases.h"

#include <terrane/scene/culling.h>
#include <terrane/scene/scene.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace terrane::test::scene_nodes {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

Scene make_scene() { return Scene::create({}).value(); }

Aabb cube_bounds(double half) {
    return {Eigen::Vector3d::Constant(-half), Eigen::Vector3d::Constant(half)};
}

// Adds a model of a cube, for one node.
ModelNode cube(Scene& scene, std::uint32_t mesh, double half = 1.0) {
    return {.model = scene.add_model(plain_model(mesh, cube_bounds(half))).value()};
}

SceneDraws collect(Scene& scene, const View& view, double threshold_px = 1.0,
                   const std::optional<SunShadows>& shadows = {}) {
    scene.begin_frame(view, threshold_px, shadows);
    return scene.end_frame(threshold_px);
}

NodePlace at(const Eigen::Vector3d& translation, double scale = 1.0) {
    return {{Eigen::Matrix3d::Identity(), translation}, scale};
}

NodePlace random_place(Random& random, double spread) {
    return {{random.rotation(), random.between(0.0, spread) * random.direction()},
            std::exp2(random.between(-1.0, 1.0))};
}

NodeId add(Scene& scene, NodeId parent, const NodePlace& place, NodeContent content) {
    return scene.add(parent, place, std::move(content)).value();
}

// Meshes that a frame draws, with their coverage.
std::map<std::uint32_t, float> drawn(Scene& scene, const View& view, double threshold_px = 1.0) {
    std::map<std::uint32_t, float> meshes;
    const SceneDraws draws = collect(scene, view, threshold_px);
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
    Scene scene = make_scene();
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
    std::vector<Placed> placed = {{known.scene.root(), {}, 1.0}};
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
        const NodeId id =
            add(known.scene, parent.id, place,
                is_mesh ? NodeContent(cube(known.scene, i, half)) : NodeContent(GroupNode{}));
        if (is_mesh) known.boxes[i] = transform(pose, scale, cube_bounds(half));
        placed.push_back({id, pose, scale});
        known.nodes.push_back(id);
    }
    return known;
}

TEST(SceneNodes, DrawsEveryMeshInViewWhereverItHangsInTheTree) {
    std::size_t in_view = 0, culled = 0;
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Known known = random_tree(random);
        for (int frame = 0; frame < 10; ++frame) {
            const View view = random_view(random, WorldPos(0, 0, 0));
            const ViewVolume volume(view);
            const std::map<std::uint32_t, float> meshes = drawn(known.scene, view);
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

TEST(SceneNodes, GivesMeshesOutOfViewWhoseShadowsCanFallIntoItAsCasters) {
    int needed = 0, casters = 0;
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Known known = random_tree(random);
        for (int frame = 0; frame < 10; ++frame) {
            const View view = random_view(random, WorldPos(0, 0, 0));
            const SunShadows shadows{.sun_direction = random.direction(), .distance = 100.0};
            const std::map<std::uint32_t, float> meshes = drawn(known.scene, view);
            const SceneCounts counts = known.scene.counts();
            const SceneDraws draws = collect(known.scene, view, 1.0, shadows);
            ASSERT_EQ(known.scene.counts().drawn, counts.drawn);
            ASSERT_EQ(known.scene.counts().triangles, counts.triangles);
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

TEST(SceneNodes, BoundsFollowPlacesContentAndNodesThatGo) {
    Scene scene = make_scene();
    const NodeId arm = add(scene, scene.root(), at({10, 0, 0}), GroupNode{});
    EXPECT_FALSE(scene.bounds_world(scene.root()).has_value());
    const NodeId hand = add(scene, arm, at({5, 0, 0}), cube(scene, 0));
    const auto high_x = [&] { return scene.bounds_world(scene.root())->high.x(); };
    EXPECT_NEAR(high_x(), 16.0, 1e-9);
    EXPECT_NEAR(scene.bounds_world(hand)->low.x(), 14.0, 1e-9);
    ASSERT_TRUE(scene.set_place(arm, at({20, 0, 0}, 2.0)));
    EXPECT_NEAR(high_x(), 32.0, 1e-9);
    ASSERT_TRUE(scene.set_content(hand, cube(scene, 0, 3.0)));
    EXPECT_NEAR(high_x(), 36.0, 1e-9);
    const NodeId finger = add(scene, hand, at({8, 0, 0}), cube(scene, 1));
    EXPECT_NEAR(high_x(), 20.0 + 2.0 * (5.0 + 9.0), 1e-9);
    EXPECT_EQ(scene.node_count(), 4u);
    scene.remove(hand);
    EXPECT_EQ(scene.node_count(), 2u);
    EXPECT_FALSE(scene.bounds_world(scene.root()).has_value());
    EXPECT_FALSE(scene.bounds_world(finger).has_value());
    scene.remove(scene.root());
    EXPECT_EQ(scene.node_count(), 2u);
}

// A switch at the origin with as many small cubes as levels.
Scene scene_of_levels(const SwitchNode& by, std::uint32_t count) {
    Scene scene = make_scene();
    const NodeId levels = add(scene, scene.root(), at({0, 0, 0}), by);
    for (std::uint32_t i = 0; i < count; ++i)
        add(scene, levels, at({0, 0, 0}), cube(scene, i, 0.001));
    return scene;
}

TEST(SceneNodes, ASwitchByDistanceDrawsTheLevelOfItsDistance) {
    Scene scene =
        scene_of_levels({.by = SwitchNode::By::distance, .limits = {50.0, 200.0, 1000.0}}, 3);
    using Meshes = std::map<std::uint32_t, float>;
    EXPECT_EQ(drawn(scene, view_at_distance(10.0)), (Meshes{{0, 1.0f}}));
    EXPECT_EQ(drawn(scene, view_at_distance(60.0)), (Meshes{{1, 1.0f}}));
    EXPECT_EQ(drawn(scene, view_at_distance(900.0)), (Meshes{{2, 1.0f}}));
    EXPECT_TRUE(drawn(scene, view_at_distance(1100.0)).empty());
}

TEST(SceneNodes, ASwitchByErrorFollowsTheThreshold) {
    Scene scene = scene_of_levels({.limits = {0.1, 0.5, kNever}}, 3);
    const View view = view_at_distance(100.0);
    const double pixel = view.pixels_per_radian() / 100.0;  // of a metre
    using Meshes = std::map<std::uint32_t, float>;
    EXPECT_EQ(drawn(scene, view, 0.09 * pixel), (Meshes{{0, 1.0f}}));
    EXPECT_EQ(drawn(scene, view, 0.11 * pixel), (Meshes{{1, 1.0f}}));
    EXPECT_EQ(drawn(scene, view, 0.6 * pixel), (Meshes{{2, 1.0f}}));
    EXPECT_EQ(drawn(scene, view, 1e9), (Meshes{{2, 1.0f}})) << "an infinite limit draws always";
}

TEST(SceneNodes, HysteresisKeepsALevelNearItsLimit) {
    Scene scene = scene_of_levels(
        {.by = SwitchNode::By::distance, .limits = {100.0, kNever}, .hysteresis = 1.2}, 2);
    const auto level_at = [&](double distance) {
        return drawn(scene, view_at_distance(distance)).begin()->first;
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

TEST(SceneNodes, AFadeDrawsBothLevelsWithComplementaryCoverage) {
    Scene scene = scene_of_levels(
        {.by = SwitchNode::By::distance, .limits = {100.0, 400.0}, .fade_ratio = 1.25}, 2);
    std::map<std::uint32_t, float> before = drawn(scene, view_at_distance(90.0));
    int fading = 0;
    for (double distance = 90.0; distance < 600.0; distance *= 1.0005) {
        std::map<std::uint32_t, float> now = drawn(scene, view_at_distance(distance));
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
Eigen::Matrix3d rotation_drawn(Scene& scene, const View& view) {
    const SceneDraws draws = collect(scene, view, 1.0);
    EXPECT_EQ(draws.instances.size(), 1u);
    const std::array<float, 4>& q = draws.instances[0].rotation;
    return Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix();
}

TEST(SceneNodes, ABillboardTurnsItsChildrenToThePictureOrAboutItsAxisOnly) {
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
            Scene scene = make_scene();
            const NodePlace place = {{random.rotation(), {0, 0, 0}}, 1.0};
            const NodeId board = add(scene, scene.root(), place, BillboardNode{axis});
            add(scene, board, at({0, 0, 0}), cube(scene, 0));
            const Eigen::Matrix3d turned = rotation_drawn(scene, view);
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
            EXPECT_LT((rotation_drawn(scene, rolled) - turned).norm(), 1e-6);
        }
    }
}

TEST(SceneNodes, ParticlesComeFromFarToNear) {
    Random random(1);
    Scene scene = make_scene();
    ParticlesNode smoke;
    for (int i = 0; i < 200; ++i)
        smoke.discs.push_back({20.0 * random.direction(), random.between(0.1, 1.0), {}});
    const NodeId node = add(scene, scene.root(), at({0, 60, 0}, 2.0), smoke);
    View view;
    const SceneDraws draws = collect(scene, view, 1.0);
    ASSERT_EQ(draws.particles.size(), 200u);
    EXPECT_EQ(scene.counts().triangles, 400u);
    double before = kNever;
    for (const Particle& particle : draws.particles) {
        const double distance = Eigen::Vector3f(particle.offset_eye.data()).norm();
        ASSERT_LE(distance, before * (1.0 + 1e-6));
        before = distance;
    }
    ASSERT_TRUE(scene.set_place(node, at({0, -200, 0})));
    EXPECT_TRUE(collect(scene, view, 1.0).particles.empty());
    EXPECT_EQ(scene.counts().culled_nodes, 1u);
}

TEST(SceneNodes, ASwitchByCentreIgnoresTheSizeOfItsLevels) {
    Scene scene = make_scene();
    const NodeId levels = add(scene, scene.root(), at({0, 0, 0}),
                              SwitchNode{.by = SwitchNode::By::centre, .limits = {100.0, kNever}});
    for (std::uint32_t i = 0; i < 2; ++i) add(scene, levels, at({0, 0, 0}), cube(scene, i, 20.0));
    EXPECT_EQ(drawn(scene, view_at_distance(99.0)).begin()->first, 0u);
    EXPECT_EQ(drawn(scene, view_at_distance(101.0)).begin()->first, 1u);
}

// All that a frame draws, in an order that does not depend on the kinds of nodes.
std::multiset<std::array<float, 12>> instances_of(const SceneDraws& draws) {
    std::multiset<std::array<float, 12>> all;
    const auto add_all = [&](float kind, float id, float level, std::uint32_t first,
                             std::uint32_t count) {
        for (const ObjectInstance& each : draws.instances.subspan(first, count)) {
            const auto& [x, y, z] = each.offset_eye;
            const auto& q = each.rotation;
            const auto rounded = [](float value) { return std::round(1e3f * value); };
            all.insert({kind, id, level, rounded(x), rounded(y), rounded(z), rounded(each.scale),
                        rounded(each.coverage), rounded(q[0]), rounded(q[1]), rounded(q[2]),
                        rounded(q[3])});
        }
    };
    for (const MeshDraw& draw : draws.meshes)
        add_all(0.0f, static_cast<float>(draw.mesh), static_cast<float>(draw.level),
                draw.first_instance, draw.instance_count);
    for (const ImpostorDraw& draw : draws.impostors)
        add_all(1.0f, static_cast<float>(draw.impostor), 0.0f, draw.first_instance,
                draw.instance_count);
    return all;
}

// One frame of a scene of models, and of the same objects as instances below a node that is turned, moved and scaled.
TEST(SceneNodes, ModelsAndInstancesAreOneKindOfObject) {
    std::size_t compared = 0;
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        const ObjectModel model = random_model(random, 0);
        Scene singles = make_scene(), instances = make_scene();
        const ModelId id = singles.add_model(model).value();
        ASSERT_EQ(instances.add_model(model).value(), id);
        const NodePlace above = random_place(random, 100.0);
        const NodeId single_parent = add(singles, singles.root(), above, GroupNode{});
        const NodeId parent = add(instances, instances.root(), at({3, 4, 5}, 2.0), GroupNode{});
        std::vector<PlacedObject> objects;
        for (int i = 0; i < 60; ++i) {
            const PlacedObject& object = objects.emplace_back(random_object(random, 200.0));
            const auto& q = object.rotation;
            const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
            add(singles, single_parent,
                {{rotation.normalized().toRotationMatrix(), object.position},
                 static_cast<double>(object.scale)},
                ModelNode{.model = id, .tint = object.tint});
        }
        add(instances, parent, {}, InstancesNode{id, objects});
        ASSERT_TRUE(instances.set_place(parent, above)) << "instances follow their parent";
        ASSERT_EQ(singles.object_count(), instances.object_count());
        for (int frame = 0; frame < 10; ++frame) {
            // all objects are in view: models are culled by boxes, instances by spheres
            View view;
            view.forward = random.direction();
            view.up = any_perpendicular(view.forward, random);
            view.eye_world = -2000.0 * view.forward;
            const double threshold = std::exp2(random.between(-6.0, 6.0));
            const auto of_singles = instances_of(collect(singles, view, threshold));
            const auto of_instances = instances_of(collect(instances, view, threshold));
            EXPECT_EQ(singles.counts().drawn, instances.counts().drawn);
            EXPECT_EQ(singles.counts().in_view, singles.object_count());
            ASSERT_EQ(of_singles.size(), of_instances.size());
            // shares and quaternions differ by the rounding of their sums
            std::vector<std::array<float, 12>> apart;
            std::ranges::set_difference(of_singles, of_instances, std::back_inserter(apart));
            EXPECT_LE(apart.size(), 2 + of_singles.size() / 4);
            compared += of_singles.size();
        }
    }
    EXPECT_GT(compared, 1000u);
}

TEST(SceneNodes, ModelsInstancesAndParticlesKeepToTheirDemands) {
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        Scene scene = make_scene();
        const ModelId model = scene.add_model(random_model(random, 0)).value();
        const NodeId levels = add(
            scene, scene.root(), at({0, 0, 0}),
            SwitchNode{.by = SwitchNode::By::distance, .limits = {60.0, 120.0}, .fade_ratio = 1.5});
        for (int i = 0; i < 3; ++i)
            add(scene, levels, random_place(random, 20.0), ModelNode{.model = model});
        for (int i = 0; i < 20; ++i)
            add(scene, scene.root(), random_place(random, 200.0), ModelNode{.model = model});
        ASSERT_TRUE(add_instances(scene, model, spread_objects(random, 200, 200.0)));
        add(scene, scene.root(), random_place(random, 50.0), ParticlesNode{.discs = {{}, {}}});
        for (int frame = 0; frame < 10; ++frame) {
            const View view = random_view(random, WorldPos(0, 0, 0));
            const double threshold = std::exp2(random.between(-3.0, 6.0));
            std::size_t granted = 0;
            for (const TriangleDemand& demand : scene.begin_frame(view)) {
                if (demand.threshold_px > threshold) granted += demand.triangles;
            }
            scene.end_frame(threshold);
            ASSERT_LE(scene.counts().triangles, granted);
        }
        EXPECT_TRUE(scene.end_frame(kNever).particles.empty()) << "nothing is granted";
    }
}

TEST(SceneNodes, ChangesShowInTheNextFrame) {
    Scene scene = make_scene();
    const NodeId node = add(scene, scene.root(), at({0, 20, 0}), cube(scene, 0));
    const View view;
    scene.begin_frame(view);
    ASSERT_TRUE(scene.set_place(node, at({0, 25, 0})));
    const NodeId other = add(scene, node, at({0, 1, 0}), cube(scene, 1));
    EXPECT_EQ(scene.end_frame(1.0).instances.size(), 1u);
    EXPECT_EQ(scene.end_frame(1.0).instances[0].offset_eye[1], 20.0f);
    EXPECT_EQ(collect(scene, view).instances.size(), 2u);
    scene.begin_frame(view);
    scene.remove(other);
    EXPECT_EQ(scene.end_frame(1.0).instances.size(), 2u);
    EXPECT_EQ(collect(scene, view).instances[0].offset_eye[1], 25.0f);
    EXPECT_EQ(scene.object_count(), 1u);
}

SceneDraws collect_at(Scene& scene, double time_s, const View& view) {
    scene.set_time(time_s);
    return collect(scene, view);
}

std::vector<std::array<float, 8>> particles_at(Scene& scene, double time_s, const View& view) {
    std::vector<std::array<float, 8>> all;
    for (const Particle& p : collect_at(scene, time_s, view).particles) {
        all.push_back({p.offset_eye[0], p.offset_eye[1], p.offset_eye[2], p.radius, p.colour[0],
                       p.colour[1], p.colour[2], p.colour[3]});
    }
    return all;
}

View view_of_smoke() {
    View view;
    view.eye_world = {0.0, -60.0, 5.0};
    return view;
}

TEST(Emitter, ASeekShowsTheSameSmoke) {
    const View view = view_of_smoke();
    const EmitterNode smoke{.rate = 40.0, .wind = {1.0, 0.5, 0.0}, .seed = 3};
    Scene played = make_scene(), sought = make_scene();
    add(played, played.root(), at({0, 0, 0}), smoke);
    add(sought, sought.root(), at({0, 0, 0}), smoke);
    std::size_t count = 0;
    for (int frame = 0; frame < 200; ++frame) {
        const auto now = particles_at(played, 0.05 * frame, view);
        count += now.size();
        if (frame % 37 == 36) {
            EXPECT_EQ(particles_at(sought, 0.05 * frame, view), now);
        }
    }
    EXPECT_NEAR(static_cast<double>(count) / 200.0, 40.0 * 3.0, 10.0) << "rate times mean life";
    EXPECT_EQ(particles_at(played, 1.0, view), particles_at(sought, 1.0, view)) << "back in time";
    EXPECT_EQ(sought.counts().particles, particles_at(sought, 1.0, view).size());
    EXPECT_EQ(sought.counts().triangles, 2 * sought.counts().particles);
}

TEST(Emitter, ImagesAreTurnedBySeedAndNumberAlone) {
    const View view = view_of_smoke();
    Scene played = make_scene(), sought = make_scene(), discs = make_scene(), other = make_scene();
    EmitterNode smoke{.rate = 40.0, .seed = 3};
    add(discs, discs.root(), at({0, 0, 0}), smoke);
    smoke.image = ParticleImageId{7};
    add(played, played.root(), at({0, 0, 0}), smoke);
    add(sought, sought.root(), at({0, 0, 0}), smoke);
    smoke.seed = 4;
    add(other, other.root(), at({0, 0, 0}), smoke);
    const auto turns_at = [&](Scene& scene, double time_s) {
        std::vector<float> turns;
        for (const Particle& p : collect_at(scene, time_s, view).particles) {
            EXPECT_EQ(p.image, ParticleImageId{7});
            turns.push_back(p.turn);
        }
        return turns;
    };
    std::vector<float> turns;
    for (int frame = 0; frame <= 40; ++frame) turns = turns_at(played, 0.05 * frame);
    EXPECT_EQ(turns_at(sought, 2.0), turns);
    EXPECT_NE(turns_at(other, 2.0), turns);
    EXPECT_EQ(particles_at(played, 2.0, view), particles_at(discs, 2.0, view))
        << "an image moves nothing";
    // evenly around: about as many in each quarter
    std::array<int, 4> quarters{};
    for (const float turn : turns) {
        ASSERT_TRUE(turn >= 0.0f && turn < 6.2832f);
        ++quarters[static_cast<std::size_t>(turn / 1.5708f)];
    }
    ASSERT_GT(turns.size(), 100u);
    for (const int count : quarters)
        EXPECT_NEAR(count, static_cast<double>(turns.size()) / 4.0, 14.0);
}

TEST(Emitter, TheCornersOfImagesReachOutOfTheDisc) {
    const View view = view_of_smoke();
    Scene scene = make_scene();
    EmitterNode puff{.life = {2.0, 2.0},
                     .source_radius = 0.0,
                     .velocity = {0, 0, 0},
                     .velocity_spread = 0.0,
                     .radius = {10.0, 10.0}};
    const NodeId node = add(scene, scene.root(), at({0, 0, 0}), puff);
    // largest distance from the middle of the picture at which particles are drawn
    const auto last_seen = [&](ParticleImageId image) {
        puff.image = image;
        EXPECT_TRUE(scene.set_content(node, puff));
        for (double x = 200.0; x > 0.0; x -= 0.25) {
            EXPECT_TRUE(scene.set_place(node, at({x, -20.0, 5.0})));
            if (!particles_at(scene, 5.0, view).empty()) return x;
        }
        return 0.0;
    };
    const double disc = last_seen(ParticleImageId::soft_disc);
    EXPECT_GT(disc, 10.0);
    EXPECT_GE(last_seen(ParticleImageId{1}), disc + 10.0 * (std::sqrt(2.0) - 1.0) - 0.25);
}

// Particles move, grow and fade without jumps, for as long as they live.
TEST(Emitter, ParticlesChangeLittleFromFrameToFrame) {
    const View view = view_of_smoke();
    Scene scene = make_scene();
    // one particle at a time: the next is born when it is gone
    const EmitterNode puff{.rate = 0.2,
                           .life = {2.0, 2.0},
                           .source_radius = 0.0,
                           .velocity = {0.0, 0.0, 4.0},
                           .velocity_spread = 0.0,
                           .drag_time = 2.0,
                           .start = 0.0};
    add(scene, scene.root(), at({0, 0, 0}), puff);
    std::optional<std::array<float, 8>> before;
    int lives = 0;
    for (int frame = 0; frame < 4000; ++frame) {
        const auto now = particles_at(scene, 0.005 * frame, view);
        ASSERT_LE(now.size(), 1u);
        if (now.empty()) {
            if (before) {
                EXPECT_LT((*before)[7], 0.01f) << "it has faded when it goes";
                EXPECT_NEAR((*before)[2] + 5.0f, 4.0f, 0.05f) << "2 s of 4 m/s, slowed by half";
            }
            before.reset();
            continue;
        }
        const std::array<float, 8>& particle = now[0];
        if (!before) {
            ++lives;
            EXPECT_LT(particle[7], 0.02f) << "it appears";
            EXPECT_NEAR(particle[2], -5.0f, 0.03f) << "at its source";
        } else {
            for (std::size_t i = 0; i < 8; ++i)
                ASSERT_LT(std::abs(particle[i] - (*before)[i]), 0.025f);
        }
        before = particle;
    }
    EXPECT_EQ(lives, 4);
}

TEST(Emitter, ATrailStaysWhereItsEmitterWas) {
    const View view = view_of_smoke();
    Scene scene = make_scene();
    const NodeId truck = add(scene, scene.root(), at({0, 0, 0}), GroupNode{});
    EmitterNode dust{.rate = 100.0,
                     .life = {1.0, 1.0},
                     .source_radius = 0.0,
                     .velocity = {0, 0, 0},
                     .velocity_spread = 0.0,
                     .start = 0.0};
    const NodeId node = add(scene, truck, at({0, 0, 0}), dust);
    for (int frame = 0; frame <= 120; ++frame) {
        ASSERT_TRUE(scene.set_place(truck, at({0.25 * frame, 0, 0})));
        if (frame == 110) {
            dust.strength = 0.0f;
            ASSERT_TRUE(scene.set_content(node, dust));
        }
        particles_at(scene, frame / 60.0, view);
    }
    // born in the last second up to frame 110, at 15 m/s
    std::vector<float> places;
    for (const auto& particle : particles_at(scene, 2.0, view)) places.push_back(particle[0]);
    std::ranges::sort(places);
    ASSERT_NEAR(static_cast<double>(places.size()), 100.0 * 50.0 / 60.0, 3.0);
    EXPECT_NEAR(places.front(), 15.0f, 0.4f);
    EXPECT_NEAR(places.back(), 27.5f, 0.4f);
    for (std::size_t i = 1; i < places.size(); ++i)
        EXPECT_LT(places[i] - places[i - 1], 0.31f) << "no gaps between frames";
}

TEST(Emitter, IsBoundedByItsCountAndAbsentWhereItIsNotSeen) {
    View view = view_of_smoke();
    Scene scene = make_scene();
    const NodeId node = add(scene, scene.root(), at({0, 0, 0}),
                            EmitterNode{.rate = 1e5, .life = {100.0, 100.0}, .most_particles = 70});
    EXPECT_NEAR(static_cast<double>(particles_at(scene, 1e6, view).size()), 70.0, 2.0);
    view.eye_world.y() = -600.0;
    EXPECT_FALSE(particles_at(scene, 1e6, view).empty());
    view.forward = {0, -1, 0};
    EXPECT_TRUE(particles_at(scene, 1e6, view).empty()) << "behind the eye";
    view = view_of_smoke();
    view.eye_world.y() = -1e6;
    EXPECT_TRUE(particles_at(scene, 1e6, view).empty()) << "smaller than a pixel";
    ASSERT_TRUE(scene.set_content(node, EmitterNode{.rate = 0.0}));
    EXPECT_TRUE(particles_at(scene, 1e6, view_of_smoke()).empty());
    scene.remove(node);
    EXPECT_TRUE(particles_at(scene, 1e6, view_of_smoke()).empty());
}

TEST(Emitter, RefusesWhatIsOutOfRangeByItsName) {
    Scene scene = make_scene();
    const auto message = [&](const EmitterNode& emitter) {
        const auto added = scene.add(scene.root(), {}, emitter);
        return added ? std::string() : added.error().message;
    };
    EXPECT_EQ(message({.rate = 1e9}), "rate must be 0 to 100000, got 1e+09");
    EXPECT_EQ(message({.life = {3.0, 1.0}}), "life[1] must be 3 to 1000, got 1");
    EXPECT_EQ(message({.wind = {0.0, std::nan(""), 0.0}}),
              "wind must be within 1e4 along each axis");
    EXPECT_EQ(message({.most_particles = 0}), "most_particles must be 1 to 65536, got 0");
    EXPECT_EQ(message({.start = std::nan("")}), "start must be at most 1e12, got nan");
    const NodeId board = add(scene, scene.root(), {}, BillboardNode{});
    EXPECT_EQ(scene.add(board, {}, EmitterNode{}).error().message,
              "instances and emitters cannot be below a switch or a billboard");
}

TEST(SceneNodes, BoundsOfInstancesAreThoseOfTheirObjectsInTheWorld) {
    Random random(1);
    Scene scene = make_scene();
    const ObjectModel model = random_model(random, 0);
    const ModelId id = scene.add_model(model).value();
    const NodeId parent = add(scene, scene.root(), at({3, 4, 5}, 2.0), GroupNode{});
    std::vector<PlacedObject> objects;
    for (int i = 0; i < 600; ++i) objects.push_back(random_object(random, 200.0));
    const NodeId node = add(scene, parent, {}, InstancesNode{id, objects});
    const NodePlace above = random_place(random, 100.0);
    ASSERT_TRUE(scene.set_place(parent, above));
    std::vector<Eigen::Vector3d> corners_world;
    for (const PlacedObject& object : objects) {
        const auto& q = object.rotation;
        const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
        for (int i = 0; i < 8; ++i) {
            Eigen::Vector3d corner = model.bounds.low;
            for (int axis = 0; axis < 3; ++axis) {
                if ((i >> axis & 1) != 0) corner[axis] = model.bounds.high[axis];
            }
            const Eigen::Vector3d turned =
                rotation.normalized() * Eigen::Vector3d(static_cast<double>(object.scale) * corner);
            corners_world.push_back(above.parent_from_node *
                                    Eigen::Vector3d(above.scale * (object.position + turned)));
        }
    }
    const Aabb expected = bounding_box(corners_world);
    const std::optional<Aabb> bounds_world = scene.bounds_world(scene.root());
    ASSERT_TRUE(bounds_world);
    EXPECT_LE((bounds_world->low - expected.low).norm(), 1e-3);
    EXPECT_LE((bounds_world->high - expected.high).norm(), 1e-3);
    scene.remove(node);
    EXPECT_FALSE(scene.bounds_world(parent).has_value());
}

TEST(SceneNodes, InstancesAreNotAllowedWhereTheirFrameChanges) {
    constexpr const char* kMessage =
        "instances and emitters cannot be below a switch or a billboard";
    Scene scene = make_scene();
    const ModelId model = scene.add_model(plain_model(0, cube_bounds(1.0))).value();
    const InstancesNode trees{model, {{}, {}}};
    const NodeId levels = add(scene, scene.root(), {}, SwitchNode{.limits = {1.0}});
    const NodeId below = add(scene, levels, {}, GroupNode{});
    EXPECT_EQ(scene.add(below, {}, trees).error().message, kMessage);
    EXPECT_EQ(scene.set_content(below, trees).error().message, kMessage);
    const NodeId group = add(scene, scene.root(), {}, GroupNode{});
    const NodeId forest = add(scene, group, {}, trees);
    EXPECT_EQ(scene.set_content(group, BillboardNode{}).error().message, kMessage);
    EXPECT_EQ(scene.object_count(), 2u);
    EXPECT_TRUE(scene.bounds_world(group)->low.isApprox(Eigen::Vector3d(-1, -1, -1)));
    ASSERT_TRUE(scene.set_content(forest, GroupNode{}));
    EXPECT_EQ(scene.object_count(), 0u);
    EXPECT_TRUE(scene.set_content(group, BillboardNode{}));
}

TEST(SceneNodes, RefusesWhatIsOutOfRangeByItsName) {
    Scene scene = make_scene();
    const auto message = [&](const NodePlace& place, NodeContent content) {
        const auto added = scene.add(scene.root(), place, std::move(content));
        return added ? std::string() : added.error().message;
    };
    EXPECT_EQ(scene.add(NodeId{77}, {}, GroupNode{}).error().message, "the scene has no node 77");
    EXPECT_EQ(scene.set_place(NodeId{77}, {}).error().message, "the scene has no node 77");
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
    EXPECT_EQ(message({}, ModelNode{.model = ModelId{3}}), "there is no model 3 of 0");
    EXPECT_EQ(message({}, ParticlesNode{{{{0, 0, 0}, 0.0, {}}}}),
              "the radius of disc 0 must be above 0, got 0");
    NodeId deepest = scene.root();
    for (int i = 0; i < 256; ++i) deepest = add(scene, deepest, {}, GroupNode{});
    EXPECT_EQ(scene.add(deepest, {}, GroupNode{}).error().message,
              "nodes must be at most 256 deep");
    EXPECT_EQ(scene.node_count(), 257u);
    View invalid;
    invalid.vertical_fov = -1.0;
    EXPECT_TRUE(collect(scene, invalid, 1.0).instances.empty());
}

}  // namespace
}  // namespace terrane::test::scene_nodes
