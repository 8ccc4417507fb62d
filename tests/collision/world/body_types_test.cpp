// SPDX-License-Identifier: MIT
#include "collision/bodies/body_cases.h"
#include "support/random.h"

#include <terrane/collision/world.h>

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

// Static and kinematic bodies, and dynamic ones on them.
namespace terrane {
namespace body_types_test {

using test::at;
using test::make_flat;
using test::make_world;

constexpr double kStep = 1.0 / 60.0;
constexpr BodyType kStatic = BodyType::static_body, kKinematic = BodyType::kinematic_body;

BodyId add(World& world, const BodySettings& settings, const BodyState& state) {
    return world.add(settings, state).value();
}

const BodyState& state_of(const World& world, BodyId body) { return world.states()[body.index]; }

void step(World& world, const Ground& ground, int count) {
    for (int i = 0; i < count; ++i) {
        const StepReport report = world.step(ground, kStep);
        ASSERT_EQ(report.too_deep, 0u);
    }
}

bool is_asleep(const World& world, BodyId body) {
    return state_of(world, body).condition == BodyCondition::asleep;
}

/// A shape whose top is level at z = 10, and its pose.
struct Table {
    const char* name;
    Shape shape;
    double height;  // of its centre
};

std::vector<Table> tables() {
    const CompoundPart board{Box{{3.0, 3.0, 0.25}}, {}};
    std::vector<Eigen::Vector3d> corners;
    for (int i = 0; i < 8; ++i) {
        corners.push_back({i & 1 ? 3.0 : -3.0, i & 2 ? 3.0 : -3.0, i & 4 ? 0.25 : -0.75});
    }
    return {{"box", Box{{3.0, 3.0, 0.25}}, 9.75},
            {"hull", ConvexHull::create(corners).value(), 9.75},
            {"compound", Compound::create(std::vector{board}).value(), 9.75}};
}

TEST(StaticBody, HoldsWhatIsPutOnItAndNeverMoves) {
    const Ground ground = make_flat();
    for (const Table& table : tables()) {
        SCOPED_TRACE(table.name);
        World world = make_world();
        const BodyId fixed =
            add(world, {.shape = table.shape, .type = kStatic}, at({60.0, 60.0, table.height}));
        const Pose pose = state_of(world, fixed).pose;
        std::vector<BodyId> on_it;
        double x = 58.5;
        for (const Shape& shape : {Shape(Box{}), Shape(Sphere{0.5}), Shape(Capsule{0.4, 0.5})}) {
            on_it.push_back(add(world, {.shape = shape}, at({x, 60.0, 12.0}, {0.0, 0.0, -20.0})));
            x += 1.5;
        }
        step(world, ground, 400);
        for (const BodyId body : on_it) {
            EXPECT_TRUE(is_asleep(world, body));
            EXPECT_GT(state_of(world, body).pose.translation.z(), 10.3);
        }
        EXPECT_EQ(state_of(world, fixed).pose.translation, pose.translation);
        EXPECT_EQ(state_of(world, fixed).pose.rotation, pose.rotation);
        EXPECT_EQ(state_of(world, fixed).condition, BodyCondition::fixed);
    }
}

TEST(StaticBody, WakesSleepersWhenItIsRemovedMovedOrAdded) {
    const Ground ground = make_flat();
    for (const std::string action : {"remove", "teleport", "change", "add"}) {
        SCOPED_TRACE(action);
        World world = make_world();
        const BodySettings table{.shape = Box{{3.0, 3.0, 0.25}}, .type = kStatic};
        const BodyId fixed = add(world, table, at({60.0, 60.0, 9.75}));
        const BodyId box = add(world, {.shape = Box{}}, at({60.0, 60.0, 10.5}));
        const BodyId far = add(world, {.shape = Box{}}, at({90.0, 60.0, 5.5}));
        step(world, ground, 120);
        ASSERT_TRUE(is_asleep(world, box));
        ASSERT_TRUE(is_asleep(world, far));
        if (action == "remove") {
            ASSERT_TRUE(world.remove(fixed));
        } else if (action == "teleport") {
            ASSERT_TRUE(world.teleport(fixed, at({80.0, 60.0, 9.75})));
        } else if (action == "change") {
            BodySettings other = table;
            other.shape = Box{{0.1, 0.1, 0.1}};
            ASSERT_TRUE(world.change(fixed, other));
        } else {  // overlaps the sleeper by 5 cm
            add(world, {.shape = Box{}, .type = kStatic}, at({60.95, 60.0, 10.5}));
        }
        step(world, ground, 1);
        EXPECT_FALSE(is_asleep(world, box));
        EXPECT_TRUE(is_asleep(world, far));
        step(world, ground, 240);
        EXPECT_TRUE(is_asleep(world, box));
        const double z = state_of(world, box).pose.translation.z();
        if (action == "add") {
            EXPECT_GT(z, 10.4);
            EXPECT_LT(state_of(world, box).pose.translation.x(), 59.97);
        } else if (action == "change") {  // it stands on the small box
            EXPECT_NEAR(z, 10.35, 0.01);
        } else {
            EXPECT_LT(z, 5.8);
        }
    }
}

TEST(StaticBody, MayNotHaveAVelocity) {
    World world = make_world();
    EXPECT_FALSE(world.add({.type = kStatic}, at({0, 0, 0}, {1.0, 0.0, 0.0})));
    EXPECT_FALSE(world.add({.type = kStatic}, at({0, 0, 0}, {0, 0, 0}, {0.0, 1.0, 0.0})));
    const BodyId fixed = add(world, {.type = kStatic}, {});
    EXPECT_FALSE(world.set_velocity(fixed, {1.0, 0.0, 0.0}, {0.0, 0.0, 0.0}));
    EXPECT_FALSE(world.apply_impulse(fixed, {0, 0, 0}, {1.0, 0.0, 0.0}));
    EXPECT_FALSE(world.add_force(fixed, {1.0, 0.0, 0.0}));
    EXPECT_FALSE(world.move_kinematic(fixed, {}, 0.1));
    EXPECT_FALSE(world.move_to(fixed, {}, make_flat()));
}

/// A board at height 8 with a box on it.
struct Ride {
    World world;
    BodyId board, box;
};

Ride make_ride(const Ground& ground, const Shape& shape = Box{{0.4, 0.4, 0.4}}) {
    Ride ride{make_world(), {}, {}};
    ride.board =
        add(ride.world, {.shape = Box{{3.0, 3.0, 0.2}}, .type = kKinematic}, at({60.0, 60.0, 8.0}));
    ride.box = add(ride.world, {.shape = shape}, at({60.0, 60.0, 8.6}));
    step(ride.world, ground, 120);
    EXPECT_TRUE(is_asleep(ride.world, ride.box));
    return ride;
}

TEST(KinematicBody, ALiftCarriesABoxUpAndDown) {
    const Ground ground = make_flat();
    Ride ride = make_ride(ground);
    for (const double speed : {1.5, -1.5, 0.02, -0.02}) {
        ASSERT_TRUE(ride.world.set_velocity(ride.board, {0.0, 0.0, speed}, {0.0, 0.0, 0.0}));
        step(ride.world, ground, 90);  // takes up the speed
        for (int i = 0; i < 30; ++i) {
            step(ride.world, ground, 1);
            EXPECT_FALSE(is_asleep(ride.world, ride.box));
            const BodyState &board = state_of(ride.world, ride.board),
                            &box = state_of(ride.world, ride.box);
            EXPECT_NEAR(box.pose.translation.z() - board.pose.translation.z(), 0.6, 0.01);
            EXPECT_NEAR(box.velocity.z(), speed, 0.01);
        }
    }
    ASSERT_TRUE(ride.world.set_velocity(ride.board, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}));
    step(ride.world, ground, 120);
    EXPECT_TRUE(is_asleep(ride.world, ride.box));
}

TEST(KinematicBody, AConveyorCarriesABoxAtItsSpeedAndNothingSleepsOnIt) {
    const Ground ground = make_flat();
    for (const double speed : {0.01, 0.5, 2.0}) {
        Ride ride = make_ride(ground);
        ASSERT_TRUE(ride.world.set_velocity(ride.board, {speed, 0.0, 0.0}, {0.0, 0.0, 0.0}));
        step(ride.world, ground, 120);
        const double offset = state_of(ride.world, ride.box).pose.translation.x() -
                              state_of(ride.world, ride.board).pose.translation.x();
        for (int i = 0; i < 300; ++i) {
            step(ride.world, ground, 1);
            ASSERT_FALSE(is_asleep(ride.world, ride.box)) << speed;
        }
        EXPECT_NEAR(state_of(ride.world, ride.box).velocity.x(), speed, 1e-3);
        EXPECT_NEAR(state_of(ride.world, ride.box).pose.translation.x() -
                        state_of(ride.world, ride.board).pose.translation.x(),
                    offset, 1e-3);
    }
}

TEST(KinematicBody, ATurntableCarriesABoxRound) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId table = add(world, {.shape = Box{{3.0, 3.0, 0.2}}, .type = kKinematic},
                             at({60.0, 60.0, 8.0}, {0, 0, 0}, {0.0, 0.0, 0.8}));
    const BodyId box =
        add(world, {.shape = Box{{0.4, 0.4, 0.4}}}, at({62.0, 60.0, 8.6}, {0.0, 1.6, 0.0}));
    for (int i = 0; i < 600; ++i) {
        step(world, ground, 1);
        const Eigen::Vector3d arm =
            state_of(world, box).pose.translation - state_of(world, table).pose.translation;
        ASSERT_NEAR(std::hypot(arm.x(), arm.y()), 2.0, 0.1) << i;
        ASSERT_NEAR(arm.z(), 0.6, 0.01);
    }
    EXPECT_NEAR(state_of(world, box).angular_velocity.z(), 0.8, 0.02);
}

TEST(KinematicBody, ReachesThePoseOfMoveKinematicBitForBitAndStops) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId body =
        add(world, {.shape = test::make_wedge(), .type = kKinematic}, at({60.0, 60.0, 20.0}));
    test::Random random(3);
    SCOPED_TRACE("seed 3");
    for (int i = 0; i < 200; ++i) {
        Pose pose;
        pose.translation = Eigen::Vector3d(60.0, 60.0, 20.0) + 3.0 * random.direction();
        pose.rotation = i % 5 == 4 ? state_of(world, body).pose.rotation : random.rotation();
        if (i % 7 == 6) pose = state_of(world, body).pose;
        const double dt = random.between(0.001, 0.2);
        ASSERT_TRUE(world.move_kinematic(body, pose, dt));
        world.step(ground, dt);
        EXPECT_EQ(state_of(world, body).pose.translation, pose.translation) << i;
        EXPECT_EQ(state_of(world, body).pose.rotation, pose.rotation) << i;
        EXPECT_TRUE(state_of(world, body).velocity.isZero(0.0));
        EXPECT_TRUE(state_of(world, body).angular_velocity.isZero(0.0));
    }
    // Over several steps it is there to rounding.
    ASSERT_TRUE(world.move_kinematic(body, at({61.0, 60.0, 20.0}).pose, 0.5));
    for (int i = 0; i < 30; ++i) world.step(ground, kStep);
    EXPECT_NEAR(state_of(world, body).pose.translation.x(), 61.0, 1e-9);
    EXPECT_TRUE(state_of(world, body).velocity.isZero(0.0));
}

TEST(KinematicBody, ThatIsHeldAtItsPoseLetsSleepersSleep) {
    const Ground ground = make_flat();
    Ride ride = make_ride(ground);
    for (int i = 0; i < 30; ++i) {
        const Pose pose = state_of(ride.world, ride.board).pose;
        ASSERT_TRUE(ride.world.move_kinematic(ride.board, pose, kStep));
        step(ride.world, ground, 1);
        EXPECT_TRUE(is_asleep(ride.world, ride.box)) << i;
    }
}

TEST(KinematicBody, AWallPushesBoxesButNeverThroughTheGround) {
    const Ground ground = test::make_test_ground(
        [](double x, double) { return x < 70.0 ? 5.0 : 5.0 + 0.3 * (x - 70.0); }, 1.0, 1);
    for (const double speed : {0.5, 5.0, 50.0}) {
        SCOPED_TRACE(speed);
        World world = make_world();
        // High enough that it has not sunk below the bodies at the end.
        add(world, {.shape = Box{{0.5, 8.0, 12.0}}, .type = kKinematic},
            at({55.0, 60.0, 14.0}, {speed, 0.0, -0.2 * speed}));
        std::vector<BodyId> pushed;
        for (const Shape& shape : test::all_shapes(0.5)) {
            pushed.push_back(add(world, {.shape = shape},
                                 at({57.5, 54.0 + 3.0 * static_cast<double>(pushed.size()), 6.0})));
        }
        for (int i = 0; i < static_cast<int>(40.0 / speed / kStep); ++i) {
            const StepReport report = world.step(ground, kStep);
            ASSERT_EQ(report.too_deep, 0u) << i;
        }
        int ahead = 0;
        for (const BodyId body : pushed) ahead += state_of(world, body).pose.translation.x() > 60.0;
        EXPECT_GE(ahead, 4);
    }
}

TEST(KinematicBody, IsCountedWhereItIsInTheGround) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodySettings board{.shape = Box{{3.0, 3.0, 0.2}}, .type = kKinematic};
    const BodyId above = add(world, board, at({60.0, 60.0, 5.2}));
    EXPECT_EQ(world.step(ground, kStep).kinematic_in_ground, 0u);
    const BodyId below = add(world, board, at({80.0, 60.0, 4.0}));
    for (int i = 0; i < 3; ++i) EXPECT_EQ(world.step(ground, kStep).kinematic_in_ground, 1u);
    EXPECT_EQ(state_of(world, below).pose.translation.z(), 4.0);
    ASSERT_TRUE(world.set_velocity(above, {0.0, 0.0, -2.0}, {0.0, 0.0, 0.0}));
    EXPECT_EQ(world.step(ground, 0.1).kinematic_in_ground, 2u);
    BodySettings sensor = board;
    sensor.is_sensor = true;
    ASSERT_TRUE(world.change(below, sensor));
    EXPECT_EQ(world.step(ground, 0.1).kinematic_in_ground, 1u);
}

}  // namespace body_types_test
}  // namespace terrane
