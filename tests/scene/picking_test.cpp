// SPDX-License-Identifier: MIT
#include "scene/random_scene.h"
#include "scene/scene_cases.h"
#include "support/meshes.h"

#include <terrane/scene/culling.h>
#include <terrane/scene/object_model.h>
#include <terrane/scene/scene.h>
#include <terrane/scene/scene_nodes.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

namespace terrane::test::picking {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// A triangle in the world, and the number of the object or node that it is of.
struct Placed {
    std::size_t owner = 0;
    Eigen::Vector3d a, b, c;
};

struct Nearest {
    std::size_t owner = 0;
    double fraction = kNever;
    // not near an edge, an end, or another owner's triangle, where rounding decides
    bool is_clear = true;
};

// All triangles one by one (T. Moller, B. Trumbore, 1997).
Nearest find_nearest(const std::vector<Placed>& triangles, const WorldPos& from,
                     const WorldPos& to) {
    constexpr double kNear = 1e-7;
    const Eigen::Vector3d along = to - from;
    Nearest nearest;
    double second = kNever;
    for (const auto& [owner, a, b, c] : triangles) {
        const Eigen::Vector3d p = along.cross(c - a);
        const double determinant = (b - a).dot(p);
        if (determinant == 0.0) continue;
        const double u = (from - a).dot(p) / determinant;
        const Eigen::Vector3d q = (from - a).cross(b - a);
        const double v = along.dot(q) / determinant;
        const double t = (c - a).dot(q) / determinant;
        const double inside = std::min({u, v, 1.0 - u - v});
        if (t < -kNear || t > 1.0 + kNear || inside < -kNear) continue;
        if (inside < kNear || std::min(std::abs(t), std::abs(t - 1.0)) < kNear)
            nearest.is_clear = false;
        if (t >= nearest.fraction) {
            if (owner != nearest.owner) second = std::min(second, t);
            continue;
        }
        if (owner != nearest.owner) second = nearest.fraction;
        nearest.owner = owner;
        nearest.fraction = t;
    }
    if (second - nearest.fraction < kNear) nearest.is_clear = false;
    return nearest;
}

template <class Place>
void add_triangles(const TriangleMesh& mesh, std::size_t owner, const Place& place,
                   std::vector<Placed>& triangles_out) {
    for (const auto& [a, b, c] : mesh.triangles) {
        triangles_out.push_back(
            {owner, place(mesh.positions[a]), place(mesh.positions[b]), place(mesh.positions[c])});
    }
}

TEST(MeshRays, AgreeWithAllTrianglesOneByOne) {
    const TriangleMesh mesh = make_rock(3, 7);
    const MeshRays rays = MeshRays::create(mesh).value();
    std::vector<Placed> triangles;
    add_triangles(
        mesh, 0, [](const Eigen::Vector3d& p) { return p; }, triangles);
    Random random(11);
    int hits = 0, misses = 0;
    for (int i = 0; i < 20'000; ++i) {
        const Eigen::Vector3d from = random.between(0.0, 4.0) * random.direction();
        const Eigen::Vector3d to = random.between(0.0, 4.0) * random.direction();
        const Nearest nearest = find_nearest(triangles, from, to);
        if (!nearest.is_clear) continue;
        const std::optional<MeshHit> hit = rays.ray(from, to);
        ASSERT_EQ(hit.has_value(), nearest.fraction <= 1.0) << i;
        ++(hit ? hits : misses);
        if (!hit) continue;
        EXPECT_NEAR(hit->fraction, nearest.fraction, 1e-9);
        EXPECT_NEAR(hit->normal.norm(), 1.0, 1e-12);
        EXPECT_LE(hit->normal.dot(to - from), 0.0);
    }
    EXPECT_GT(hits, 2000);
    EXPECT_GT(misses, 2000);
}

TEST(MeshRays, DoNotGetThroughEdgesAndVertices) {
    const TriangleMesh mesh = make_rock(3, 7);
    const MeshRays rays = MeshRays::create(mesh).value();
    Random random(12);
    const Eigen::Vector3d inside(0.0, 0.0, 0.2);
    for (int i = 0; i < 50'000; ++i) {
        const auto& triangle = mesh.triangles[static_cast<std::size_t>(
            random.below(static_cast<int>(mesh.triangles.size())))];
        const Eigen::Vector3d& a = mesh.positions[triangle[0]];
        const Eigen::Vector3d& b = mesh.positions[triangle[1]];
        const double share = random.below(3) == 0 ? 0.0 : random.between(0.0, 1.0);
        const Eigen::Vector3d on_edge = a + share * (b - a);
        // from outside to the inside, through a point of an edge
        const Eigen::Vector3d from = inside + random.between(3.0, 1000.0) * (on_edge - inside);
        EXPECT_TRUE(rays.ray(from, inside)) << i;
    }
}

TEST(MeshRays, MeetNothingWhereThereIsNothing) {
    const MeshRays none = MeshRays::create({}).value();
    EXPECT_FALSE(none.ray({0, 0, 0}, {0, 0, -1}));
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {1, 1, 2}};  // the last two without area
    const MeshRays rays = MeshRays::create(mesh).value();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(rays.ray({0.2, 0.2, 1}, {0.2, 0.2, -1}));
    EXPECT_TRUE(rays.ray({0.2, 0.2, 1}, {0.2, 0.2, 0}));  // ends on it
    EXPECT_EQ(rays.ray({0.2, 0.2, 0}, {0.2, 0.2, -1})->fraction, 0.0);
    EXPECT_TRUE(rays.ray({0.2, 0.2, 1e6}, {0.2, 0.2, -1e6}));
    EXPECT_FALSE(rays.ray({1.5, 0.0, 1}, {1.5, 0.0, -1}));  // the one without area
    EXPECT_FALSE(rays.ray({0.2, 0.2, 1}, {0.2, 0.2, 0.5}));
    EXPECT_FALSE(rays.ray({0.2, 0.2, 0}, {0.2, 0.2, 0}));
    EXPECT_FALSE(rays.ray({-1, 0.2, 0}, {2, 0.2, 0}));  // in its plane
    EXPECT_FALSE(rays.ray({0.2, 0.2, nan}, {0.2, 0.2, -1}));
    EXPECT_FALSE(rays.ray({0.2, 0.2, infinity}, {0.2, 0.2, -1}));
    mesh.positions[0].x() = nan;
    EXPECT_FALSE(MeshRays::create(mesh));
}

TEST(SceneRay, MeetsTheFirstOfAllObjects) {
    Random random(13);
    const TriangleMesh mesh = make_rock(1, 3);
    ObjectModel model;
    model.bounds = {Eigen::Vector3d::Constant(-2.0), Eigen::Vector3d::Constant(2.0)};
    model.levels = {{0.0, 80, 0, false}};
    model.absence_error_m = 2.0;
    Scene scene = Scene::create({}).value();
    const ModelId unseen = scene.add_model(model).value();
    model.rays = MeshRays::create(mesh).value();
    const ModelId rock = scene.add_model(model).value();
    const WorldPos far_away(3e5, -2e5, 100.0);
    constexpr std::size_t kObjects = 200;  // of each group
    std::vector<NodeId> groups;
    std::vector<Placed> triangles;
    for (int i = 0; i < 4; ++i) {
        std::vector<PlacedObject> objects;
        for (std::size_t k = 0; k < kObjects; ++k) {
            PlacedObject& object = objects.emplace_back(random_object(random, 60.0));
            object.position += far_away;
            object.scale = static_cast<float>(random.between(0.3, 2.0));
            if (i == 1) continue;  // removed below
            const Eigen::Matrix3d rotation = rotation_of(object).toRotationMatrix();
            const auto place = [&](const Eigen::Vector3d& p) {
                return WorldPos(object.position +
                                static_cast<double>(object.scale) * (rotation * p));
            };
            add_triangles(mesh, groups.size() * kObjects + k, place, triangles);
        }
        groups.push_back(add_instances(scene, rock, objects).value());
        ASSERT_TRUE(add_instances(scene, unseen, objects));
    }
    scene.remove(groups[1]);
    int hits = 0;
    for (int i = 0; i < 2000; ++i) {
        const WorldPos from = far_away + random.between(0.0, 90.0) * random.direction();
        const WorldPos to = far_away + random.between(0.0, 90.0) * random.direction();
        const Nearest nearest = find_nearest(triangles, from, to);
        if (!nearest.is_clear) continue;
        const std::optional<SceneHit> hit = scene.ray(from, to);
        ASSERT_EQ(hit.has_value(), nearest.fraction <= 1.0) << i;
        if (!hit) continue;
        ++hits;
        // positions of instances are float within their cluster
        EXPECT_NEAR(hit->fraction * (to - from).norm(), nearest.fraction * (to - from).norm(),
                    1e-2);
        EXPECT_LT((hit->point_world - (from + nearest.fraction * (to - from))).norm(), 1e-2);
        EXPECT_EQ(hit->node, groups[nearest.owner / kObjects]);
        EXPECT_EQ(hit->object, nearest.owner % kObjects);
    }
    EXPECT_GT(hits, 300);
}

// Adds a model of a mesh, for one node.
ModelNode model_of(Scene& scene, const TriangleMesh& mesh, bool has_rays = true) {
    ObjectModel model = plain_model(0, bounding_box(mesh.positions));
    if (has_rays) model.rays = MeshRays::create(mesh).value();
    return {.model = scene.add_model(model).value()};
}

NodePlace at(const Eigen::Vector3d& translation, double scale = 1.0) {
    return {{Eigen::Matrix3d::Identity(), translation}, scale};
}

// A rectangle in the plane x = 0, y from -1 to 1 and z from 0 to 2.
TriangleMesh plate() {
    TriangleMesh mesh;
    mesh.positions = {{0, -1, 0}, {0, 1, 0}, {0, 1, 2}, {0, -1, 2}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

struct Tree {
    Scene scene = Scene::create({}).value();
    std::vector<Placed> triangles;
};

// Groups, models and switches, up to 40 m from the world's origin, with scales from 1/4 to 4 a level.
Tree random_tree(Random& random, const WorldPos& middle) {
    struct Parent {
        NodeId id;
        Eigen::Affine3d world_from_node;
        bool is_met;
        bool is_switch;
        int children;
    };
    Tree tree;
    std::vector<Parent> parents = {
        {tree.scene.root(), Eigen::Affine3d::Identity(), true, false, 0}};
    for (int i = 0; i < 40; ++i) {
        const auto chosen =
            static_cast<std::size_t>(random.below(static_cast<int>(parents.size())));
        NodePlace place;
        place.parent_from_node.rotation = random.rotation();
        place.parent_from_node.translation = random.between(0.0, 20.0) * random.direction();
        if (chosen == 0) place.parent_from_node.translation += middle;
        place.scale = std::exp2(random.between(-2.0, 2.0));
        Eigen::Affine3d world_from_node = parents[chosen].world_from_node;
        world_from_node.translate(place.parent_from_node.translation);
        world_from_node.rotate(place.parent_from_node.rotation);
        world_from_node.scale(place.scale);
        const bool is_met =
            parents[chosen].is_met && !(parents[chosen].is_switch && parents[chosen].children > 0);
        ++parents[chosen].children;
        const int kind = random.below(4);
        NodeContent content = GroupNode{};
        const TriangleMesh mesh = make_rock(1, random.bits());
        if (kind == 0) content = SwitchNode{.limits = {0.1}};
        if (kind > 1) content = model_of(tree.scene, mesh);
        const NodeId id = tree.scene.add(parents[chosen].id, place, content).value();
        parents.push_back({id, world_from_node, is_met, kind == 0, 0});
        if (kind < 2 || !is_met) continue;
        add_triangles(
            mesh, static_cast<std::size_t>(id),
            [&](const Eigen::Vector3d& p) { return WorldPos(world_from_node * p); },
            tree.triangles);
    }
    return tree;
}

TEST(NodeRay, AgreesWithAllTrianglesOneByOne) {
    int hits = 0, misses = 0;
    for (std::uint64_t seed = 0; seed < 30; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        const WorldPos middle =
            seed % 3 == 0 ? WorldPos(2e5, -3e5, 1e3) : WorldPos(WorldPos::Zero());
        const Tree tree = random_tree(random, middle);
        for (int i = 0; i < 300; ++i) {
            const WorldPos from = middle + random.between(0.0, 60.0) * random.direction();
            WorldPos to = middle + random.between(0.0, 60.0) * random.direction();
            if (i % 2 == 0 && !tree.triangles.empty()) {
                // beyond a triangle
                const Placed& aim = tree.triangles[static_cast<std::size_t>(
                    random.below(static_cast<int>(tree.triangles.size())))];
                to = from + 1.5 * ((aim.a + aim.b + aim.c) / 3.0 - from);
            }
            const Nearest nearest = find_nearest(tree.triangles, from, to);
            if (!nearest.is_clear) continue;
            const std::optional<SceneHit> hit = tree.scene.ray(from, to);
            ASSERT_EQ(hit.has_value(), nearest.fraction <= 1.0) << i;
            ++(hit ? hits : misses);
            if (!hit) continue;
            EXPECT_EQ(static_cast<std::size_t>(hit->node), nearest.owner);
            EXPECT_NEAR(hit->fraction, nearest.fraction, 1e-9);
            EXPECT_LE((hit->point_world - (from + hit->fraction * (to - from))).norm(), 1e-9);
            EXPECT_NEAR(hit->normal.norm(), 1.0, 1e-12);
            EXPECT_LE(hit->normal.dot(to - from), 0.0);
        }
    }
    EXPECT_GT(hits, 1000);
    EXPECT_GT(misses, 1000);
}

TEST(NodeRay, FollowsPlacesContentAndNodesThatGo) {
    Scene scene = Scene::create({}).value();
    const WorldPos from(-10, 0.3, 0.9), to(10, 0.3, 0.9);
    EXPECT_FALSE(scene.ray(from, to));
    const NodeId far = scene.add(scene.root(), at({4, 0, 0}), model_of(scene, plate())).value();
    const NodeId arm = scene.add(scene.root(), at({-2, 0, 0}), GroupNode{}).value();
    const NodeId near = scene.add(arm, at({0, 0, 0}), model_of(scene, plate())).value();
    ASSERT_TRUE(scene.ray(from, to));
    EXPECT_EQ(scene.ray(from, to)->node, near);
    EXPECT_DOUBLE_EQ(scene.ray(from, to)->fraction, 0.4);
    EXPECT_EQ(scene.ray(from, to)->normal, Eigen::Vector3d(-1, 0, 0));
    EXPECT_EQ(scene.ray(to, from)->node, far);
    ASSERT_TRUE(scene.set_place(arm, at({-2, 0, 5})));
    EXPECT_EQ(scene.ray(from, to)->node, far);
    // the plate is a tenth as large, and the ray passes above it
    ASSERT_TRUE(scene.set_place(arm, at({-2, 0, 0}, 0.1)));
    EXPECT_EQ(scene.ray(from, to)->node, far);
    ASSERT_TRUE(scene.set_place(arm, at({-2, 0, 0})));
    ASSERT_TRUE(scene.set_content(near, GroupNode{}));
    EXPECT_EQ(scene.ray(from, to)->node, far);
    scene.remove(far);
    EXPECT_FALSE(scene.ray(from, to));
}

TEST(NodeRay, MeetsTheNodeThatWasAddedFirstOfTwoInOnePlace) {
    Scene scene = Scene::create({}).value();
    const NodeId late_parent = scene.add(scene.root(), at({0, 0, 0}), GroupNode{}).value();
    const NodeId first = scene.add(scene.root(), at({0, 0, 0}), model_of(scene, plate())).value();
    ASSERT_TRUE(scene.add(late_parent, at({0, 0, 0}), model_of(scene, plate())));
    const auto hit = scene.ray({-10, 0.3, 1}, {10, 0.3, 1});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->node, first);
}

TEST(NodeRay, MeetsTheFinestLevelOfASwitchAlone) {
    Scene scene = Scene::create({}).value();
    const NodeId levels =
        scene.add(scene.root(), at({0, 0, 0}), SwitchNode{.limits = {1.0, 2.0}}).value();
    EXPECT_FALSE(scene.ray({-10, 0.3, 1}, {10, 0.3, 1}));
    const NodeId finest = scene.add(levels, at({5, 0, 0}), model_of(scene, plate())).value();
    ASSERT_TRUE(scene.add(levels, at({-5, 0, 0}), model_of(scene, plate())));
    const auto hit = scene.ray({-10, 0.3, 1}, {10, 0.3, 1});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->node, finest);
}

TEST(NodeRay, MeetsBillboardsAsTheyFaceTheLastFrame) {
    Scene scene = Scene::create({}).value();
    const NodeId tree =
        scene.add(scene.root(), at({0, 0, 0}), BillboardNode{.axis = BillboardNode::Axis::up})
            .value();
    ASSERT_TRUE(scene.add(tree, at({0, 0, 0}), model_of(scene, plate())));
    const WorldPos west(-10, 0.3, 1), east(10, 0.3, 1), south(0.3, -10, 1), north(0.3, 10, 1);
    EXPECT_FALSE(scene.ray(west, east)) << "no frame yet";
    View view;
    view.eye_world = south;
    view.eye_world.x() = 0.0;
    scene.begin_frame(view);
    EXPECT_TRUE(scene.ray(south, north));
    EXPECT_FALSE(scene.ray(west, east)) << "seen edge on";
    view.eye_world = {-10, 0, 1};
    view.forward = {1, 0, 0};
    scene.begin_frame(view);
    EXPECT_FALSE(scene.ray(south, north));
    EXPECT_TRUE(scene.ray(west, east));
    view.vertical_fov = -1.0;
    scene.begin_frame(view);
    EXPECT_TRUE(scene.ray(west, east)) << "an invalid view changes nothing";
}

TEST(NodeRay, MeetsNeitherParticlesNorModelsWithoutRays) {
    Scene scene = Scene::create({}).value();
    ASSERT_TRUE(scene.add(scene.root(), at({0, 0, 0}), model_of(scene, plate(), false)));
    ASSERT_TRUE(scene.add(scene.root(), at({0, 0, 0}), ParticlesNode{.discs = {{}}}));
    EXPECT_FALSE(scene.ray({-10, 0.3, 1}, {10, 0.3, 1}));
}

TEST(NodeRay, HasNoAnswerToSegmentsThatAreNone) {
    Scene scene = Scene::create({}).value();
    ASSERT_TRUE(scene.add(scene.root(), at({0, 0, 0}), model_of(scene, plate())));
    const double nan = std::nan("");
    EXPECT_FALSE(scene.ray({nan, 0.3, 1}, {10, 0.3, 1}));
    EXPECT_FALSE(scene.ray({-10, 0.3, 1}, {kNever, 0.3, 1}));
    EXPECT_FALSE(scene.ray({-10, 0.3, 1}, {-10, 0.3, 1}));
    const auto far = scene.ray({-1e7, 0.3, 1}, {1e7, 0.3, 1});
    ASSERT_TRUE(far);
    EXPECT_NEAR(far->fraction, 0.5, 1e-12);
}

}  // namespace
}  // namespace terrane::test::picking
