// SPDX-License-Identifier: MIT
#pragma once

#include "collision/world/body_cases.h"
#include "support/random.h"

#include <terrane/collision/world.h>

#include <cmath>
#include <tuple>
#include <vector>

// A world in which bodies are in every state and do everything at once, for tests of determinism and of saved worlds.
namespace terrane::test {

/// Hills of two by two root squares; the north-eastern one is not resident.
inline Ground make_busy_ground() {
    TableGroundSettings settings{
        .roots = 2, .is_resident = [](int column, int row) { return column == 0 || row == 0; }};
    return make_test_ground(
        [](double x, double y) { return 2.0 * std::sin(0.11 * x) * std::sin(0.07 * y); }, settings);
}

/// Bodies of the busy world that tests use.
struct BusyBodies {
    BodyId lift, removed, truck, tracked, walker;
    std::vector<BodyId> heap;
};

/// A heap of all shapes, vehicles, characters, sleeping bodies, a body deep in the ground, one without resident ground,
/// one that has left the world, static and kinematic bodies, sensors, and slots of removed bodies.
inline BusyBodies fill_busy_world(World& world) {
    Random random(77);
    BusyBodies bodies;
    const std::vector<Shape> shapes = all_shapes(0.6);
    for (int i = 0; i < 40; ++i) {
        const double x = 60.0 + 2.0 * (i % 3), y = 60.0 + 2.0 * (i / 3 % 3);
        const int layer = i / 9;
        BodyState state = at({x, y, 4.0 + 2.5 * layer});
        state.pose.rotation = random.rotation();
        BodySettings settings{.shape = shapes[static_cast<std::size_t>(i) % shapes.size()],
                              .mass = random.between(0.5, 20.0),
                              .restitution = i % 4 == 0 ? 0.7 : 0.1};
        bodies.heap.push_back(add(world, settings, state));
    }
    for (int i = 0; i < 4; ++i) {  // a stack on a static floor, which falls asleep
        add(world, {.shape = Box{{0.5, 0.5, 0.5}}}, at({30.0, 30.0, 5.51 + i}));
    }
    add(world, {.shape = Box{{3.0, 3.0, 2.0}}, .type = BodyType::static_body},
        at({30.0, 30.0, 3.0}));
    add(world, {.shape = make_hammer(0.8)}, at({100.0, 30.0, -4.0}));  // deep in the ground
    add(world, {.shape = Sphere{0.5}}, at({200.0, 200.0, 5.0}, {1.0, 0.0, 0.0}));  // parks
    add(world, {.shape = make_wedge()}, at({-30.0, 10.0, 5.0}, {0.0, 1.0, 0.0}, {3, 1, 2}));
    const BodySettings board{.shape = Box{{3.0, 3.0, 0.2}}, .type = BodyType::kinematic_body};
    add(world, board, at({80.0, 90.0, 6.0}, {0.5, 0.0, 0.0}));
    add(world, {.shape = Box{{0.4, 0.4, 0.4}}}, at({80.0, 90.0, 6.7}));
    bodies.lift = add(world, board, at({40.0, 90.0, 6.0}));
    add(world, {.shape = make_wedge(0.5), .rotates = false}, at({40.0, 90.0, 7.0}));
    add(world, {.shape = make_hammer(), .type = BodyType::static_body, .friction = 0.2},
        at({62.0, 62.0, 2.5}));
    BodySettings gate{.shape = Sphere{3.0}, .type = BodyType::static_body, .is_sensor = true};
    add(world, gate, at({60.0, 60.0, 3.0}));
    gate.type = BodyType::kinematic_body;
    add(world, gate, at({50.0, 60.0, 3.0}, {0.7, 0.1, 0.0}));
    add(world, {.shape = Box{}, .filter = {2, 4}}, at({20.0, 80.0, 20.0}, {1, 2, 3}, {4, 5, 6}));
    bodies.truck = world.add_vehicle(make_truck(), at({40.0, 62.0, 4.0}).pose).value();
    bodies.tracked = world.add_vehicle(make_tracked(), at({60.0, 20.0, 4.0}).pose).value();
    world.add_vehicle(make_six_wheeler(), at({210.0, 190.0, 9.0}).pose).value();  // parks
    bodies.walker = world.add_character({}, {50.0, 64.0, 5.0}).value();
    world.add_character({.max_step = 0.6}, {78.5, 90.0, 7.3}).value();  // on the platform
    std::vector<BodyId> spare;
    for (int i = 0; i < 5; ++i) {
        spare.push_back(add(world, {.shape = Capsule{}}, at({10.0 + 3.0 * i, 10.0, 9.0})));
    }
    for (const int i : {3, 0, 4}) EXPECT_TRUE(world.remove(spare[static_cast<std::size_t>(i)]));
    bodies.removed = spare[0];
    return bodies;
}

/// Acts on the busy world before step number `step`.
inline void act_on_busy_world(World& world, const BusyBodies& bodies, int step) {
    if (step % 50 == 10) {
        Pose pose{turned({0.0, 0.0, step % 100 == 10 ? 0.4 : 0.0}),
                  {40.0, 90.0, step % 100 == 10 ? 7.0 : 6.0}};
        EXPECT_TRUE(world.move_kinematic(bodies.lift, pose, 0.5));
    }
    if (step % 7 == 0) {
        EXPECT_TRUE(world.add_force(bodies.heap[3], {50.0, 10.0, 30.0}));
        EXPECT_TRUE(world.add_torque(bodies.heap[4], {1.0, 2.0, 3.0}));
    }
    const double turn = step % 80 < 40 ? 0.5 : -0.5;
    EXPECT_TRUE(world.set_controls(bodies.truck, VehicleControls{.throttle = 0.6, .steer = turn}));
    EXPECT_TRUE(world.set_controls(bodies.tracked, VehicleControls{.brake = 1.0}));
    CharacterControls pace{.velocity = {2.0, turn}, .jump_speed = step % 90 == 89 ? 4.0 : 0.0};
    EXPECT_TRUE(world.set_controls(bodies.walker, pace));
    if (step % 60 == 59) {
        EXPECT_TRUE(world.teleport(bodies.heap[5], at({61.0, 61.0, 14.0}, {0.0, 0.0, -9.0})));
    }
}

inline void expect_same_events(const World& a, const World& b) {
    ASSERT_EQ(a.contact_events().size(), b.contact_events().size());
    for (std::size_t i = 0; i < a.contact_events().size(); ++i) {
        const ContactEvent &x = a.contact_events()[i], &y = b.contact_events()[i];
        EXPECT_EQ(std::tie(x.a, x.b, x.phase, x.is_sensor, x.point_count),
                  std::tie(y.a, y.b, y.phase, y.is_sensor, y.point_count));
        EXPECT_EQ(x.impulse, y.impulse);
        EXPECT_EQ(x.normal, y.normal);
    }
}

}  // namespace terrane::test
