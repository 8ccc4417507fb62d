// SPDX-License-Identifier: MIT
#include "frames/body_nodes.h"

#include "scene/shape_meshes.h"
#include "support/grounds.h"
#include "support/meshes.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace shape_meshes_test {

ConvexHull make_stone(double size) {
    const std::vector<Eigen::Vector3d> corners{{size, 0.0, 0.0},
                                               {-size, 0.0, 0.0},
                                               {0.0, size, 0.0},
                                               {0.0, -size, 0.0},
                                               {0.0, 0.0, size},
                                               {0.0, 0.0, -size},
                                               {0.5 * size, 0.5 * size, 0.5 * size}};
    return ConvexHull::create(corners).value();
}

std::vector<Shape> make_shapes() {
    const std::vector<CompoundPart> hammer{{Box{{0.2, 0.5, 0.2}}, {.translation = {0.0, 0.0, 0.6}}},
                                           {Capsule{0.1, 0.5}, Pose{}}};
    return {Sphere{0.5},
            Sphere{0.6},
            Capsule{0.4, 0.8},
            Capsule{0.4, 0.9},
            Box{{1, 2, 3}},
            Box{{1, 2, 4}},
            make_stone(1.0),
            make_stone(1.5),
            Compound::create(hammer).value(),
            Compound::create(std::span(hammer).first(1)).value()};
}

TEST(ShapeMeshes, AShapeIsTheSameAsItselfOnly) {
    const std::vector<Shape> shapes = make_shapes(), copies = make_shapes();
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        for (std::size_t k = 0; k < copies.size(); ++k)
            EXPECT_EQ(is_same_shape(shapes[i], copies[k]), i == k) << i << " " << k;
    }
}

/// Volume by the divergence theorem.
double volume_of(const TriangleMesh& mesh) {
    double sum = 0.0;
    for (const TriangleMesh::Triangle& t : mesh.triangles) {
        const auto& p = mesh.positions;
        sum += p[t[0]].dot(p[t[1]].cross(p[t[2]])) / 6.0;
    }
    return sum;
}

TEST(ShapeMeshes, MeshesAreTheSurfacesOfTheirShapesFromOutside) {
    for (const Shape& shape : make_shapes()) {
        SCOPED_TRACE(shape.index());
        const TriangleMesh mesh = make_shape_mesh(shape).value();
        ASSERT_TRUE(mesh.validate());
        ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
        const Aabb box = bounding_box(mesh.positions);
        for (const Eigen::Vector3d& axis :
             {Eigen::Vector3d(Eigen::Vector3d::UnitX()), Eigen::Vector3d(Eigen::Vector3d::UnitY()),
              Eigen::Vector3d(Eigen::Vector3d::UnitZ())}) {
            EXPECT_NEAR(box.high.dot(axis), support_distance(shape, axis), 1e-9);
            EXPECT_NEAR(-box.low.dot(axis), support_distance(shape, -axis), 1e-9);
        }
        EXPECT_GT(volume_of(mesh), 0.0);
        for (const TriangleMesh::Triangle& t : mesh.triangles) {
            const Eigen::Vector3d normal = (mesh.positions[t[1]] - mesh.positions[t[0]])
                                               .cross(mesh.positions[t[2]] - mesh.positions[t[0]]);
            for (const std::uint32_t corner : t)
                EXPECT_GT(normal.dot(mesh.normals[corner].cast<double>()), 0.0);
        }
    }
    EXPECT_NEAR(volume_of(make_shape_mesh(Box{{1, 2, 3}}).value()), 48.0, 1e-9);
}

TEST(ShapeMeshes, AHullWithoutFacesIsRefused) {
    const std::vector<Eigen::Vector3d> segment{{0, 0, 0}, {1, 0, 0}};
    const auto made = make_shape_mesh(ConvexHull::create(segment).value());
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().message, "a hull without faces cannot be drawn");
}

}  // namespace shape_meshes_test

namespace body_nodes_test {

class BodyNodesTest : public testing::Test {
protected:
    BodyNodesTest() {
        const auto source = FractalHeights::create({.seed = 5}).value();
        field_.emplace(ObjectField::create(source, {}, {.picture = view()}, nullptr).value());
    }
    static View view() {
        return look_at({-20.0, 0.0, 20.0}, {0.0, 0.0, 20.0}, 1.0, 400, 400).value();
    }
    SceneDraws frame() {
        field_->begin_frame(view());
        return field_->end_frame(1.0);
    }
    static BodyState state_at(const WorldPos& place,
                              BodyCondition condition = BodyCondition::awake) {
        BodyState state;
        state.pose.translation = place;
        state.condition = condition;
        return state;
    }
    std::optional<ObjectField> field_;
};

TEST_F(BodyNodesTest, ABodyIsDrawnWhereItIs) {
    BodyNodes nodes(*field_, nullptr, false);
    const Shape ball = Sphere{1.0};
    ASSERT_TRUE(nodes.show(7, ball, state_at({0.0, 0.0, 20.0})));
    ASSERT_EQ(frame().instances.size(), 1u);
    ASSERT_TRUE(nodes.show(7, ball, state_at({0.0, 3.0, 20.0})));
    const SceneDraws moved = frame();
    ASSERT_EQ(moved.instances.size(), 1u);
    EXPECT_EQ(moved.instances[0].offset_eye[0], 20.0f);
    EXPECT_EQ(moved.instances[0].offset_eye[1], 3.0f);
}

TEST_F(BodyNodesTest, BodiesOfOneShapeShareAModel) {
    BodyNodes nodes(*field_, nullptr, false);
    for (std::size_t i = 0; i < 5; ++i) {
        const double y = static_cast<double>(i);
        ASSERT_TRUE(nodes.show(i, Sphere{0.3}, state_at({0.0, y, 20.0})));
        ASSERT_TRUE(nodes.show(10 + i, Box{{0.3, 0.3, 0.3}}, state_at({0.0, y, 22.0})));
    }
    const SceneDraws drawn = frame();
    EXPECT_EQ(drawn.instances.size(), 10u);
    EXPECT_EQ(drawn.meshes.size(), 2u);
}

TEST_F(BodyNodesTest, SleepingBodiesAreDarkerAndLostOnesGo) {
    BodyNodes nodes(*field_, nullptr, false);
    const Shape ball = Sphere{1.0};
    const auto tint_of = [&](BodyCondition condition) {
        EXPECT_TRUE(nodes.show(0, ball, state_at({0.0, 0.0, 20.0}, condition)));
        const SceneDraws drawn = frame();
        return drawn.instances.empty() ? 0.0f : drawn.instances[0].tint[1];
    };
    EXPECT_EQ(tint_of(BodyCondition::awake), 1.0f);
    EXPECT_LT(tint_of(BodyCondition::asleep), 0.8f);
    EXPECT_EQ(tint_of(BodyCondition::parked), 1.0f);
    EXPECT_EQ(tint_of(BodyCondition::left_world), 0.0f);
    EXPECT_EQ(tint_of(BodyCondition::awake), 1.0f);
    EXPECT_EQ(tint_of(BodyCondition::removed), 0.0f);
    // far outside: its pose would not be a place of a node
    BodyState lost = state_at({0.0, 0.0, -1e300}, BodyCondition::left_world);
    EXPECT_TRUE(nodes.show(0, ball, lost));
}

TEST_F(BodyNodesTest, VehiclesHaveWheelsAndDustOnlyWhereTheyDrive) {
    const VehicleSettings settings = make_truck();
    VehicleState state;
    state.chassis = state_at({0.0, 0.0, 20.0});
    for (const AxleSettings& axle : settings.axles) {
        for (const double side : {0.5, -0.5}) {
            WheelState wheel;
            wheel.centre_world = {axle.position, side * axle.track, 19.6};
            wheel.point_world = wheel.centre_world - Eigen::Vector3d(0.0, 0.0, 0.42);
            state.wheels.push_back(wheel);
        }
    }
    BodyNodes nodes(*field_, nullptr, false);
    const auto particles = [&](double from, double to) {
        std::size_t most = 0;
        for (double time = from; time < to; time += 0.1) {
            EXPECT_TRUE(nodes.show(settings, state));
            field_->set_time(time);
            most = frame().particles.size();
        }
        return most;
    };
    const std::size_t standing = particles(0.0, 3.0);
    EXPECT_EQ(frame().instances.size(), 1 + state.wheels.size());
    state.chassis.velocity = {15.0, 0.0, 0.0};
    const std::size_t in_the_air = particles(3.0, 6.0);
    for (WheelState& wheel : state.wheels) wheel.in_contact = true;
    const std::size_t driving = particles(6.0, 9.0);
    EXPECT_GT(standing, 10u);  // the exhaust
    EXPECT_NEAR(static_cast<double>(in_the_air), static_cast<double>(standing), 15.0);
    EXPECT_GT(driving, standing + 50);
}

// Two barrels of one shape: of the first a box stands 2 m off along the body's x axis and smokes, below a node that is
// twice as large; the second has a ball. The third body has no node.
constexpr const char* kBarrels = R"([
  {"shape":{"sphere":{"radius":1}}, "position":[0,0,20], "node":{"scale":2, "children":[
    {"position":[1,0,0], "box":{"half_extents":[0.5,0.5,0.5]}, "children":[
      {"position":[0,0,0.5], "emitter":{"per_s":50, "life_s":[1,1], "source_m":0, "spread_m_s":0,
                                        "velocity":[0,0,1], "drag_s":1000}}]},
    {"mesh":"pine.obj", "scale":0.05}]}},
  {"shape":{"sphere":{"radius":1}}, "position":[0,5,20], "node":{"sphere":{"radius":0.5}}},
  {"shape":{"sphere":{"radius":1}}, "position":[0,-5,20]}])";

std::vector<PlacedBody> read_barrels() {
    return read_bodies(nlohmann::ordered_json::parse(kBarrels), TERRANE_SOURCE_DIR "/tools/data")
        .value();
}

TEST_F(BodyNodesTest, ABodyMovesTheSubtreeOfItsNode) {
    const std::vector<PlacedBody> bodies = read_barrels();
    BodyNodes nodes(*field_, nullptr, false);
    nodes.set_node(4, bodies[0]);
    const Shape& shape = bodies[0].settings.shape;
    BodyState state = bodies[0].state;
    const auto show = [&](double time) {
        EXPECT_TRUE(nodes.show(4, shape, state));
        field_->set_time(time);
        return frame();
    };
    const SceneDraws first = show(0.0);
    ASSERT_EQ(first.instances.size(), 2u) << "box and pine";
    EXPECT_EQ(first.instances[0].offset_eye, (std::array<float, 3>{22.0f, 0.0f, 0.0f}));
    EXPECT_EQ(first.instances[0].scale, 2.0f);
    EXPECT_EQ(first.instances[1].offset_eye, (std::array<float, 3>{20.0f, 0.0f, 0.0f}));
    // a quarter turn about z, and 3 m up
    state.pose.rotation << 0, -1, 0, 1, 0, 0, 0, 0, 1;
    state.pose.translation = {0.0, 0.0, 23.0};
    const SceneDraws turned = show(1.0);
    EXPECT_EQ(turned.instances[0].offset_eye, (std::array<float, 3>{20.0f, 2.0f, 3.0f}));
    // new smoke starts where the emitter is now
    const SceneDraws later = show(1.2);
    float nearest = 100.0f;
    for (const Particle& p : later.particles) {
        const auto& [x, y, z] = p.offset_eye;
        nearest = std::min(nearest, std::hypot(x - 20.0f, y - 2.0f, z - 4.0f));
    }
    EXPECT_GT(later.particles.size(), 40u);
    EXPECT_LT(nearest, 0.1f);
    // asleep, all of it is darker; lost, all of it is gone
    state.condition = BodyCondition::asleep;
    for (const ObjectInstance& instance : show(1.3).instances) EXPECT_LT(instance.tint[0], 0.8f);
    state.condition = BodyCondition::left_world;
    const SceneDraws lost = show(1.4);
    EXPECT_TRUE(lost.instances.empty());
    EXPECT_TRUE(lost.particles.empty());
}

TEST_F(BodyNodesTest, BodiesOfOneShapeHaveTheirOwnNodesAndProxiesHaveNone) {
    const std::vector<PlacedBody> bodies = read_barrels();
    for (const bool proxies : {false, true}) {
        field_.emplace(ObjectField::create(FractalHeights::create({.seed = 5}).value(), {},
                                           {.picture = view()}, nullptr)
                           .value());
        BodyNodes nodes(*field_, nullptr, proxies);
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            nodes.set_node(i, bodies[i]);
            ASSERT_TRUE(nodes.show(i, bodies[i].settings.shape, bodies[i].state));
        }
        field_->set_time(2.0);
        const SceneDraws drawn = frame();
        EXPECT_EQ(drawn.instances.size(), proxies ? 3u : 4u);
        EXPECT_EQ(drawn.meshes.size(), proxies ? 1u : 4u);
        EXPECT_EQ(drawn.particles.empty(), proxies);
    }
}

TEST_F(BodyNodesTest, NodesThatCannotBeInASceneAreNamed) {
    const auto bodies = read_bodies(nlohmann::ordered_json::parse(
        R"([{"shape":{"sphere":{"radius":1}}, "position":[0,0,20],
                 "node":{"switch":{"limits":["always"]}, "children":[{"emitter":{}}]}}])"));
    ASSERT_TRUE(bodies) << bodies.error();
    BodyNodes nodes(*field_, nullptr, false);
    nodes.set_node(0, (*bodies)[0]);
    const Result<void> shown = nodes.show(0, (*bodies)[0].settings.shape, (*bodies)[0].state);
    ASSERT_FALSE(shown);
    EXPECT_EQ(shown.error().message,
              "bodies[0].node.children[0]: instances and emitters cannot be below a switch or a "
              "billboard");
    EXPECT_TRUE(frame().instances.empty());
}

TEST_F(BodyNodesTest, ProxiesHaveTheShapesThatCollide) {
    BodyNodes nodes(*field_, nullptr, true);
    nodes.set_mesh(Sphere{1.0}, "no such file");
    EXPECT_TRUE(nodes.show(0, Sphere{1.0}, state_at({0.0, 0.0, 20.0})));
    BodyNodes others(*field_, nullptr, false);
    others.set_mesh(Sphere{1.0}, "no such file");
    const Result<void> shown = others.show(0, Sphere{1.0}, state_at({0.0, 0.0, 20.0}));
    ASSERT_FALSE(shown);
    EXPECT_NE(shown.error().message.find("no such file"), std::string::npos);
}

}  // namespace body_nodes_test
}  // namespace terrane::tools
