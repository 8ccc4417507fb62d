// SPDX-License-Identifier: MIT
#include "collision/world/body_cases.h"
#include "support/random.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

// Static and kinematic bodies, and dynamic bodies on them.

namespace terrane::body_types_test {

using namespace test;

constexpr BodyType kStatic = BodyType::static_body, kKinematic = BodyType::kinematic_body;

/// Boards whose tops are 0.25 m above their origins.
std::vector<Shape> tables() {
    const CompoundPart board{Box{{3.0, 3.0, 0.25}}, {}};
    std::vector<Eigen::Vector3d> corners;
    for (int i = 0; i < 8; ++i) {
        corners.push_back({i & 1 ? 3.0 : -3.0, i & 2 ? 3.0 : -3.0, i & 4 ? 0.25 : -0.75});
    }
    return {Box{{3.0, 3.0, 0.25}}, ConvexHull::create(corners).value(),
            Compound::create(std::vector{board}).value()};
}

TEST(StaticBody, HoldsWhatIsPutOnItAndNeverMoves) {
    const Ground ground = make_flat();
    for (const Shape& table : tables()) {
        SCOPED_TRACE(name_of(table));
        World world = make_world();
        const BodyId fixed = add(world, {.shape = table, .type = kStatic}, at({60.0, 60.0, 9.75}));
        const Pose pose = world.state(fixed).pose;
        std::vector<BodyId> on_it;
        for (const Shape& shape : {Shape(Box{}), Shape(Sphere{0.5}), Shape(Capsule{0.4, 0.5})}) {
            const double x = 58.5 + 1.5 * static_cast<double>(on_it.size());
            on_it.push_back(add(world, {.shape = shape}, at({x, 60.0, 12.0}, {0.0, 0.0, -20.0})));
        }
        take_steps(world, ground, 400);
        for (const BodyId body : on_it) {
            EXPECT_TRUE(is_asleep(world, body));
            EXPECT_GT(world.state(body).pose.translation.z(), 10.3);
        }
        EXPECT_EQ(world.state(fixed).pose.translation, pose.translation);
        EXPECT_EQ(world.state(fixed).pose.rotation, pose.rotation);
        EXPECT_EQ(world.state(fixed).condition, BodyCondition::fixed);
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
        take_steps(world, ground, 120);
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
        take_steps(world, ground, 1);
        EXPECT_FALSE(is_asleep(world, box));
        EXPECT_TRUE(is_asleep(world, far));
        take_steps(world, ground, 240);
        EXPECT_TRUE(is_asleep(world, box));
        const double z = world.state(box).pose.translation.z();
        if (action == "add") {
            EXPECT_GT(z, 10.4);
            EXPECT_LT(world.state(box).pose.translation.x(), 59.97);
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

/// A board at height 8 that carries a box.
struct Ride {
    explicit Ride(const Ground& ground) {
        take_steps(world, ground, 120);
        EXPECT_TRUE(is_asleep(world, box));
    }
    /// Of the box from the board.
    Eigen::Vector3d offset() const {
        return world.state(box).pose.translation - world.state(board).pose.translation;
    }

    World world = make_world();
    BodyId board =
        add(world, {.shape = Box{{3.0, 3.0, 0.2}}, .type = kKinematic}, at({60.0, 60.0, 8.0}));
    BodyId box = add(world, {.shape = Box{{0.4, 0.4, 0.4}}}, at({60.0, 60.0, 8.6}));
};

TEST(KinematicBody, ALiftCarriesABoxUpAndDown) {
    const Ground ground = make_flat();
    Ride ride(ground);
    for (const double speed : {1.5, -1.5, 0.02, -0.02}) {
        ASSERT_TRUE(ride.world.set_velocity(ride.board, {0.0, 0.0, speed}, {0.0, 0.0, 0.0}));
        take_steps(ride.world, ground, 90);  // takes on the speed
        for (int i = 0; i < 30; ++i) {
            take_steps(ride.world, ground, 1);
            EXPECT_FALSE(is_asleep(ride.world, ride.box));
            EXPECT_NEAR(ride.offset().z(), 0.6, 0.01);
            EXPECT_NEAR(ride.world.state(ride.box).velocity.z(), speed, 0.01);
        }
    }
    ASSERT_TRUE(ride.world.set_velocity(ride.board, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}));
    take_steps(ride.world, ground, 120);
    EXPECT_TRUE(is_asleep(ride.world, ride.box));
}

TEST(KinematicBody, AConveyorCarriesABoxAtItsSpeedAndNothingSleepsOnIt) {
    const Ground ground = make_flat();
    for (const double speed : {0.01, 0.5, 2.0}) {
        Ride ride(ground);
        ASSERT_TRUE(ride.world.set_velocity(ride.board, {speed, 0.0, 0.0}, {0.0, 0.0, 0.0}));
        take_steps(ride.world, ground, 120);
        const Eigen::Vector3d offset = ride.offset();
        for (int i = 0; i < 300; ++i) {
            take_steps(ride.world, ground, 1);
            ASSERT_FALSE(is_asleep(ride.world, ride.box)) << speed;
        }
        EXPECT_NEAR(ride.world.state(ride.box).velocity.x(), speed, 1e-3);
        EXPECT_NEAR(ride.offset().x(), offset.x(), 1e-3);
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
        take_steps(world, ground, 1);
        const Eigen::Vector3d arm =
            world.state(box).pose.translation - world.state(table).pose.translation;
        ASSERT_NEAR(std::hypot(arm.x(), arm.y()), 2.0, 0.1) << i;
        ASSERT_NEAR(arm.z(), 0.6, 0.01);
    }
    EXPECT_NEAR(world.state(box).angular_velocity.z(), 0.8, 0.02);
}

TEST(KinematicBody, ReachesThePoseOfMoveKinematicBitForBitAndStops) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId body =
        add(world, {.shape = make_wedge(), .type = kKinematic}, at({60.0, 60.0, 20.0}));
    SeededRandom random(3);
    for (int i = 0; i < 200; ++i) {
        Pose pose{.translation = Eigen::Vector3d(60.0, 60.0, 20.0) + 3.0 * random.direction()};
        pose.rotation = i % 5 == 4 ? world.state(body).pose.rotation : random.rotation();
        if (i % 7 == 6) pose = world.state(body).pose;
        const double dt = random.between(0.001, 0.2);
        ASSERT_TRUE(world.move_kinematic(body, pose, dt));
        world.step(ground, dt);
        EXPECT_EQ(world.state(body).pose.translation, pose.translation) << i;
        EXPECT_EQ(world.state(body).pose.rotation, pose.rotation) << i;
        EXPECT_TRUE(world.state(body).velocity.isZero(0.0));
        EXPECT_TRUE(world.state(body).angular_velocity.isZero(0.0));
    }
    // After several steps it has arrived, up to rounding.
    ASSERT_TRUE(world.move_kinematic(body, at({61.0, 60.0, 20.0}).pose, 0.5));
    for (int i = 0; i < 30; ++i) world.step(ground, kStep);
    EXPECT_NEAR(world.state(body).pose.translation.x(), 61.0, 1e-9);
    EXPECT_TRUE(world.state(body).velocity.isZero(0.0));
}

TEST(KinematicBody, ThatIsHeldAtItsPoseLetsSleepersSleep) {
    const Ground ground = make_flat();
    Ride ride(ground);
    for (int i = 0; i < 30; ++i) {
        const Pose pose = ride.world.state(ride.board).pose;
        ASSERT_TRUE(ride.world.move_kinematic(ride.board, pose, kStep));
        take_steps(ride.world, ground, 1);
        EXPECT_TRUE(is_asleep(ride.world, ride.box)) << i;
    }
}

TEST(KinematicBody, AWallPushesBoxesButNeverThroughTheGround) {
    const Ground ground = make_test_ground(
        [](double x, double) { return x < 70.0 ? 5.0 : 5.0 + 0.3 * (x - 70.0); }, 1.0, 1);
    for (const double speed : {0.5, 5.0, 50.0}) {
        SCOPED_TRACE(speed);
        World world = make_world();
        // High enough that at the end it is still above the bodies.
        add(world, {.shape = Box{{0.5, 8.0, 12.0}}, .type = kKinematic},
            at({55.0, 60.0, 14.0}, {speed, 0.0, -0.2 * speed}));
        std::vector<BodyId> pushed;
        for (const Shape& shape : all_shapes(0.5)) {
            pushed.push_back(add(world, {.shape = shape},
                                 at({57.5, 54.0 + 3.0 * static_cast<double>(pushed.size()), 6.0})));
        }
        take_steps(world, ground, static_cast<int>(40.0 / speed / kStep));
        int ahead = 0;
        for (const BodyId body : pushed) ahead += world.state(body).pose.translation.x() > 60.0;
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
    EXPECT_EQ(world.state(below).pose.translation.z(), 4.0);
    ASSERT_TRUE(world.set_velocity(above, {0.0, 0.0, -2.0}, {0.0, 0.0, 0.0}));
    EXPECT_EQ(world.step(ground, 0.1).kinematic_in_ground, 2u);
    BodySettings sensor = board;
    sensor.is_sensor = true;
    ASSERT_TRUE(world.change(below, sensor));
    EXPECT_EQ(world.step(ground, 0.1).kinematic_in_ground, 1u);
}

// change(), teleport() and move_to().

TEST(WorldChange, OfEachFieldTakesEffect) {
    const Ground ground = make_flat();
    World world = make_world({.allow_sleep = false});
    BodySettings settings{.shape = Box{}, .mass = 2.0};
    const BodyId body = add(world, settings, at({60.0, 60.0, 5.5}));
    const auto change = [&] { ASSERT_TRUE(world.change(body, settings)); };

    settings.mass = 8.0;
    change();
    ASSERT_TRUE(world.apply_impulse(body, world.state(body).pose.translation, {4.0, 0, 0}));
    EXPECT_DOUBLE_EQ(world.state(body).velocity.x(), 0.5);

    settings.friction = 0.0;
    change();
    take_steps(world, ground, 30);
    EXPECT_NEAR(world.state(body).velocity.x(), 0.5, 1e-9);
    settings.friction = 0.6;
    change();
    take_steps(world, ground, 30);
    EXPECT_NEAR(world.state(body).velocity.x(), 0.0, 1e-6);

    settings.restitution = 1.0;
    change();
    ASSERT_TRUE(world.set_velocity(body, {0.0, 0.0, -3.0}, {0.0, 0.0, 0.0}));
    take_steps(world, ground, 3);
    EXPECT_GT(world.state(body).velocity.z(), 2.0);

    settings.restitution = 0.0;
    settings.rotates = false;
    change();
    EXPECT_FALSE(world.set_velocity(body, {0, 0, 0}, {1.0, 0.0, 0.0}));
    ASSERT_TRUE(world.apply_angular_impulse(body, {5.0, 5.0, 5.0}));
    EXPECT_TRUE(world.state(body).angular_velocity.isZero(0.0));

    settings.shape = Sphere{0.25};
    settings.contact_tolerance = 0.0;
    change();
    EXPECT_DOUBLE_EQ(world.settings()[0].contact_tolerance, 0.01);
    take_steps(world, ground, 300);
    EXPECT_NEAR(world.state(body).pose.translation.z(), 5.25, 0.01);
    settings.contact_tolerance = 0.002;
    change();
    EXPECT_DOUBLE_EQ(world.settings()[0].contact_tolerance, 0.002);

    const BodyId floor = add(world, {.shape = Box{{2.0, 2.0, 0.1}}, .type = BodyType::static_body},
                             at({60.0, 60.0, 9.0}));
    ASSERT_TRUE(world.teleport(body, at({60.0, 60.0, 9.4})));
    take_steps(world, ground, 60);
    EXPECT_GT(world.state(body).pose.translation.z(), 9.3);
    settings.filter = {2, 2};
    change();
    take_steps(world, ground, 120);
    EXPECT_LT(world.state(body).pose.translation.z(), 5.3);

    BodySettings sensor{.shape = Sphere{1.0}, .type = BodyType::static_body, .is_sensor = true};
    ASSERT_TRUE(world.change(floor, sensor));
    EXPECT_TRUE(world.settings(floor).is_sensor);
    sensor.type = BodyType::dynamic_body;
    EXPECT_FALSE(world.change(floor, sensor));
    EXPECT_TRUE(world.settings(floor).is_sensor);
}

TEST(WorldChange, OfTheTypeMakesABodyStopMoveAndFall) {
    const Ground ground = make_flat();
    World world = make_world();
    BodySettings settings{.shape = make_hammer()};
    BodyState start = at({60.0, 60.0, 30.0}, {1.0, 0.0, 2.0}, {0.3, 0.2, 0.1});
    start.pose.rotation = turned({0.3, 0.2, 0.1});
    const BodyId body = add(world, settings, start);
    take_steps(world, ground, 5);
    const Pose flying = world.state(body).pose;

    settings.type = BodyType::static_body;
    ASSERT_TRUE(world.change(body, settings));
    EXPECT_EQ(world.state(body).condition, BodyCondition::fixed);
    take_steps(world, ground, 5);
    EXPECT_EQ(world.state(body).pose.translation, flying.translation);
    EXPECT_TRUE(world.state(body).velocity.isZero(0.0));

    settings.type = BodyType::kinematic_body;
    ASSERT_TRUE(world.change(body, settings));
    EXPECT_EQ(world.state(body).condition, BodyCondition::awake);
    ASSERT_TRUE(world.set_velocity(body, {1.0, 0.0, 0.0}, {0.0, 0.0, 0.0}));
    take_steps(world, ground, 60);
    EXPECT_NEAR(world.state(body).pose.translation.x(), flying.translation.x() + 1.0, 1e-12);
    EXPECT_EQ(world.state(body).pose.translation.z(), flying.translation.z());

    settings.type = BodyType::dynamic_body;
    ASSERT_TRUE(world.change(body, settings));
    EXPECT_NEAR(world.state(body).velocity.x(), 1.0, 0.0);
    take_steps(world, ground, 60);
    EXPECT_NEAR(world.state(body).velocity.z(), -9.81, 1e-9);
    EXPECT_NEAR(world.state(body).pose.translation.x(), flying.translation.x() + 2.0, 1e-9);
}

TEST(WorldChange, ToAStaticBodyKeepsWhatStandsOnIt) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId lower = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    const BodyId upper = add(world, {.shape = Box{}}, at({60.0, 60.0, 6.5}));
    take_steps(world, ground, 120);
    ASSERT_TRUE(is_asleep(world, upper));
    ASSERT_TRUE(world.change(lower, {.shape = Box{}, .type = BodyType::static_body}));
    take_steps(world, ground, 120);
    EXPECT_NEAR(world.state(upper).pose.translation.z(), 6.5, 0.01);
    EXPECT_TRUE(is_asleep(world, upper));
    ASSERT_TRUE(world.change(lower, {.shape = Box{}}));
    EXPECT_EQ(world.state(upper).condition, BodyCondition::awake);
}

TEST(WorldTeleport, IntoTheGroundIsCountedOnceAndRecovers) {
    const Ground ground = make_flat();
    for (const Shape& shape : all_shapes(0.7)) {
        SCOPED_TRACE(name_of(shape));
        World world = make_world();
        const BodyId body = add(world, {.shape = shape}, at({60.0, 60.0, 8.0}));
        take_steps(world, ground, 60);
        ASSERT_TRUE(world.teleport(body, at({64.0, 60.0, 4.0}, {0.0, 0.0, -50.0})));
        EXPECT_EQ(world.step(ground, kStep).placed_deep, 1u);
        for (int i = 0; i < 120; ++i) {
            const StepReport report = world.step(ground, kStep);
            ASSERT_EQ(report.placed_deep + report.too_deep, 0u);
        }
        EXPECT_GT(signed_distance(shape, world.state(body).pose, ground, 10.0).distance, -0.01);
    }
}

TEST(WorldTeleport, OfARecoveringBodyIsSeenByOthersWhereItIs) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId deep = add(world, {.shape = Sphere{0.5}}, at({60.0, 60.0, 0.0}));
    const BodyId box = add(world, {.shape = Box{}, .mass = 0.01}, at({60.0, 60.0, 5.5}));
    take_steps(world, ground, 300);  // it comes up under the sleeping box
    const Eigen::Vector3d between =
        world.state(box).pose.translation - world.state(deep).pose.translation;
    EXPECT_GT(world.state(deep).pose.translation.z(), 5.4);
    EXPECT_GT(between.norm(), 0.98);
}

TEST(WorldMoveTo, EndsAtThePoseWhereNothingIsInTheWay) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId body =
        add(world, {.shape = make_wedge()}, at({60.0, 60.0, 20.0}, {1.0, 2.0, 3.0}));
    Pose pose = at({70.0, 50.0, 12.0}).pose;
    pose.rotation = turned({2.0, -1.0, 0.5});
    const BodyMove moved = world.move_to(body, pose, ground).value();
    EXPECT_TRUE(moved.is_resident);
    EXPECT_EQ(moved.fraction, 1.0);
    EXPECT_TRUE(world.state(body).pose.translation.isApprox(pose.translation, 1e-14));
    EXPECT_TRUE(world.state(body).pose.rotation.isApprox(pose.rotation, 1e-12));
    EXPECT_EQ(world.state(body).velocity, Eigen::Vector3d(1.0, 2.0, 3.0));
}

TEST(WorldMoveTo, StopsAtSlopesAndWallsWithinTheTolerance) {
    const Ground slope = make_test_ground(
        [](double x, double) { return x < 64.0 ? 5.0 : 5.0 + (x - 64.0); }, 1.0, 1);
    const Ground wall =
        make_test_ground([](double x, double) { return x < 70.0 ? 5.0 : 60.0; }, 1.0, 1);
    for (const Ground* ground : {&slope, &wall}) {
        for (const Shape& shape : all_shapes(0.8)) {
            SCOPED_TRACE(name_of(shape));
            World world = make_world();
            const BodyId body = add(world, {.shape = shape}, at({55.0, 60.0, 8.0}));
            const double tolerance = world.settings()[0].contact_tolerance;
            Pose pose = at({100.0, 60.0, 8.0}).pose;
            pose.rotation = turned({0.0, 2.0, 1.0});
            const BodyMove moved = world.move_to(body, pose, *ground).value();
            EXPECT_TRUE(moved.is_resident);
            EXPECT_GT(moved.fraction, 0.15);
            EXPECT_LT(moved.fraction, 0.4);
            const double distance =
                signed_distance(shape, world.state(body).pose, *ground, 10.0).distance;
            EXPECT_GT(distance, -tolerance);
            EXPECT_LT(distance, 0.01);
            EXPECT_EQ(world.step(*ground, kStep).too_deep, 0u);
        }
    }
}

TEST(WorldMoveTo, DoesNotMoveOverMissingGroundOrWhereTheBodyIsTooDeep) {
    TableGroundSettings settings{.roots = 2,
                                 .is_resident = [](int column, int) { return column == 0; }};
    const Ground ground = make_test_ground([](double, double) { return 5.0; }, settings);
    World world = make_world();
    const BodyId body = add(world, {.shape = Box{}}, at({100.0, 60.0, 6.0}));
    const BodyMove moved = world.move_to(body, at({150.0, 60.0, 5.6}).pose, ground).value();
    EXPECT_FALSE(moved.is_resident);
    EXPECT_EQ(moved.fraction, 0.0);
    EXPECT_EQ(world.state(body).pose.translation, Eigen::Vector3d(100.0, 60.0, 6.0));

    ASSERT_TRUE(world.teleport(body, at({60.0, 60.0, 4.0})));
    const BodyMove deep = world.move_to(body, at({60.0, 60.0, 9.0}).pose, ground).value();
    EXPECT_TRUE(deep.is_resident);
    EXPECT_EQ(deep.fraction, 0.0);
    EXPECT_EQ(world.state(body).pose.translation.z(), 4.0);
}

TEST(WorldMoveTo, PassesThroughBodiesAndWakesTheBodyAndThoseItLeaves) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId lower = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    const BodyId upper = add(world, {.shape = Box{}}, at({60.0, 60.0, 6.5}));
    add(world, {.shape = Box{{0.2, 5.0, 5.0}}, .type = BodyType::static_body},
        at({65.0, 60.0, 8.0}));
    take_steps(world, ground, 120);
    ASSERT_TRUE(is_asleep(world, upper));
    EXPECT_EQ(world.move_to(lower, at({75.0, 60.0, 6.0}).pose, ground)->fraction, 1.0);
    EXPECT_EQ(world.state(lower).condition, BodyCondition::awake);
    EXPECT_EQ(world.state(upper).condition, BodyCondition::awake);
    take_steps(world, ground, 120);
    EXPECT_NEAR(world.state(upper).pose.translation.z(), 5.5, 0.01);
}

}  // namespace terrane::body_types_test
