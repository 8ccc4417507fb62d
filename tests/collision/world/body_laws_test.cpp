// SPDX-License-Identifier: MIT
#include "collision/world/body_cases.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace terrane::body_laws_test {

using namespace test;

/// The plane z = slope * x, in which all triangles lie.
struct Tilted {
    double slope;
    double cosine = 1.0 / std::sqrt(1.0 + slope * slope), sine = slope * cosine;
    Eigen::Matrix3d rotation = turned({0.0, -std::atan(slope), 0.0});
    Ground ground = make_test_ground([s = slope](double x, double) { return s * x; }, 1.0, 2);

    /// A body at rest that lies on the plane, its centre at a distance from the plane's point over x and y.
    BodyState lying(double x, double y, double distance) const {
        BodyState state = at(Eigen::Vector3d(x, y, slope * x) + distance * rotation.col(2));
        state.pose.rotation = rotation;
        return state;
    }
};

/// Principal moments of inertia of a box of 1 kg, kg m^2.
Eigen::Vector3d box_inertia(const Eigen::Vector3d& half) {
    const Eigen::Vector3d square = half.cwiseAbs2() / 3.0;
    return {square.y() + square.z(), square.x() + square.z(), square.x() + square.y()};
}

/// Angular momentum of a box of 1 kg about its centre, kg m^2/s.
Eigen::Vector3d spin_momentum(const Eigen::Vector3d& half, const BodyState& state) {
    const Eigen::Matrix3d& r = state.pose.rotation;
    return r * box_inertia(half).cwiseProduct(r.transpose() * state.angular_velocity);
}

TEST(World, FallsFreelyAsTheIntegratorSays) {
    const Ground ground = make_flat();
    for (const double dt : {1.0 / 60.0, 0.1}) {
        World world = make_world();
        const BodyId body =
            add(world, {.shape = Sphere{0.5}}, at({kMiddle, kMiddle, 500.0}, {3.0, 0, 0}));
        const double substeps = std::ceil(dt * 120.0 - 1e-9);
        const double h = dt / substeps;
        double z = 500.0, vz = 0.0;
        for (int step = 0; step < 20; ++step) {
            const StepReport report = world.step(ground, dt);
            EXPECT_EQ(report.awake, 1u);
            EXPECT_NEAR(report.simulated_time, dt, 1e-12);
            for (double i = 0.0; i < substeps; i += 1.0) {
                vz -= kGravity * h;
                z += vz * h;
            }
            EXPECT_NEAR(world.state(body).pose.translation.z(), z, 1e-9);
            EXPECT_NEAR(world.state(body).pose.translation.x(), kMiddle + 3.0 * dt * (step + 1),
                        1e-9);
        }
    }
}

TEST(World, KeepsAngularMomentumInTheAirAndItsEnergyDoesNotGrow) {
    const Ground ground = make_flat();
    World world = make_world();
    const Eigen::Vector3d half(1.0, 2.0, 0.5);
    BodyState state = at({kMiddle, kMiddle, 4000.0});
    state.angular_velocity = {3.0, 7.0, 11.0};
    const BodyId body = add(world, {.shape = Box{half}, .mass = 3.0}, state);
    const auto energy = [&](const BodyState& s) {
        return s.angular_velocity.dot(spin_momentum(half, s));
    };
    const Eigen::Vector3d momentum_before = spin_momentum(half, state);
    double energy_before = energy(state);
    for (int step = 0; step < 600; ++step) {
        world.step(ground, kStep);
        const double energy_now = energy(world.state(body));
        EXPECT_LE(energy_now, energy_before * (1.0 + 1e-12));
        energy_before = energy_now;
    }
    EXPECT_GT(energy_before, 0.99 * energy(state));
    EXPECT_LT((spin_momentum(half, world.state(body)) - momentum_before).norm(),
              0.01 * momentum_before.norm());
}

TEST(World, RestsOnAPlaneWithinItsToleranceAndFallsAsleep) {
    const Ground ground = make_flat();
    for (const Shape& shape : all_shapes()) {
        World world = make_world();
        const BodyId body = add(world, {.shape = shape}, at({kMiddle, kMiddle, 7.5}));
        StepReport report;
        for (int step = 0; step < 60 * 8; ++step) {
            report = world.step(ground, kStep);
            EXPECT_EQ(report.too_deep, 0u);
            EXPECT_EQ(report.lost_time, 0.0);
        }
        const BodyState& rest = world.state(body);
        const double gap =
            rest.pose.translation.z() - 5.0 -
            support_distance(shape, rest.pose.rotation.transpose() * Eigen::Vector3d(0, 0, -1));
        EXPECT_LE(std::abs(gap), 0.01) << name_of(shape);
        EXPECT_EQ(rest.condition, BodyCondition::asleep) << name_of(shape);
        EXPECT_EQ(rest.velocity.norm(), 0.0);
        EXPECT_EQ(report.asleep, 1u);
        EXPECT_EQ(report.awake, 0u);
    }
}

TEST(World, SlidesDownATiltedPlaneAsCoulombSays) {
    const Tilted plane{0.5};
    for (const double friction : {0.0, 0.1, 0.3}) {
        World world = make_world();
        const BodyId body = add(world, {.shape = Box{{1.0, 2.0, 0.5}}, .friction = friction},
                                plane.lying(190.2, 128.6, 0.5));
        for (int step = 0; step < 60 * 3; ++step) world.step(plane.ground, kStep);
        const double expected = kGravity * (plane.sine - friction * plane.cosine) * 3.0;
        EXPECT_NEAR(world.state(body).velocity.norm(), expected, 0.01 * expected + 0.02)
            << friction;
        EXPECT_LT(std::abs(world.state(body).velocity.y()), 0.02);
    }
}

// Friction opposes slip regardless of the effective masses along the two tangents: the box does not rotate and moves
// like a point mass.
TEST(World, SlidesAcrossATiltedPlaneWithoutTurning) {
    const double friction = 0.3;
    const Tilted plane{0.5};
    World world = make_world({.allow_sleep = false});
    BodyState state = plane.lying(kMiddle, kMiddle, 0.4);
    state.velocity.y() = 2.0;
    const BodyId body = add(world, {.shape = Box{{1.0, 0.6, 0.4}}, .friction = friction}, state);
    for (int step = 0; step < 120; ++step) world.step(plane.ground, kStep);

    Eigen::Vector2d place(0.0, 0.0), velocity(0.0, 2.0);  // down the slope and across it
    constexpr double kTick = 1e-5;
    for (double time = 0.0; time < 2.0; time += kTick) {
        const Eigen::Vector2d pull(kGravity * plane.sine, 0.0);
        velocity += kTick * (pull - friction * kGravity * plane.cosine * velocity.normalized());
        place += kTick * velocity;
    }
    const Pose& end = world.state(body).pose;
    const Eigen::Vector3d moved = end.translation - state.pose.translation;
    EXPECT_NEAR(-moved.x(), place.x() * plane.cosine, 0.01 * place.x());
    EXPECT_NEAR(moved.y(), place.y(), 0.01 * place.y());
    const double yaw = (end.rotation * state.pose.rotation.transpose())(1, 0);
    EXPECT_LT(std::abs(yaw), 1e-6);
}

/// A box with half extents 1, 0.6, 0.4 in three representations: a box, a hull, a compound of two parts.
std::vector<Shape> make_boxes(const Pose& shape_from_box) {
    const Eigen::Vector3d half(1.0, 0.6, 0.4);
    std::vector<Eigen::Vector3d> corners;
    for (int i = 0; i < 8; ++i) {
        const Eigen::Vector3d signs((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1,
                                    (i & 4) != 0 ? 1 : -1);
        corners.push_back(shape_from_box * half.cwiseProduct(signs));
    }
    std::vector<CompoundPart> parts;
    for (const double side : {-0.5, 0.5}) {
        Pose pose = shape_from_box;
        pose.translation = shape_from_box * Eigen::Vector3d(side, 0.0, 0.0);
        parts.push_back({Box{{0.5, 0.6, 0.4}}, pose});
    }
    return {Box{half}, ConvexHull::create(corners).value(), Compound::create(parts).value()};
}

// Motion does not depend on the origin and axes of the shape's frame.
TEST(World, MovesABoxAlikeWhateverItIsMadeOf) {
    const Tilted plane{0.5};
    const Pose shape_from_box{turned({0.3, -0.5, 2.0}), {3.0, -1.0, 0.5}};
    const std::vector<Shape> boxes = make_boxes(shape_from_box);
    std::vector<Eigen::Vector3d> ends;
    for (const Shape& shape : boxes) {
        const bool is_itself = std::holds_alternative<Box>(shape);
        const Pose from_box = is_itself ? Pose{} : shape_from_box;
        World world = make_world({.allow_sleep = false});
        // One body slides down the plane; one is in free flight, spinning about none of its axes.
        for (const bool flies : {false, true}) {
            BodyState state = at({0.0, 0.0, 0.0}, {0.0, 2.0, 0.0});
            if (flies) state.angular_velocity = {2.0, -1.0, 3.0};
            const double above = flies ? 40.0 : 0.4 / plane.cosine + 0.0005;
            const Eigen::Vector3d centre(kMiddle, kMiddle, 0.5 * kMiddle + above);
            state.pose.rotation = plane.rotation * from_box.rotation.transpose();
            state.pose.translation = centre - state.pose.rotation * from_box.translation;
            ASSERT_TRUE(world.add({.shape = shape, .mass = 2.0, .friction = 0.3}, state));
        }
        for (int step = 0; step < 60; ++step) world.step(plane.ground, kStep);
        for (const BodyState& state : world.states()) {
            ends.push_back(state.pose * from_box.translation);
            ends.push_back(state.pose * (from_box * Eigen::Vector3d(1.0, 0.6, 0.4)));
        }
    }
    for (std::size_t i = 4; i < ends.size(); ++i) {
        EXPECT_LT((ends[i] - ends[i % 4]).norm(), i % 4 < 2 ? 1e-4 : 1e-9)
            << name_of(boxes[i / 4]) << ", point " << i % 4;
    }
}

TEST(World, RollsDownATiltedPlaneAsASolidSphereDoes) {
    const Tilted plane{0.3};
    World world = make_world();
    const BodyId body = add(world, {.shape = Sphere{0.5}}, plane.lying(200.2, 128.6, 0.5));
    for (int step = 0; step < 60 * 3; ++step) world.step(plane.ground, kStep);
    const double expected = 5.0 / 7.0 * kGravity * plane.sine * 3.0;
    EXPECT_NEAR(world.state(body).velocity.norm(), expected, 0.01 * expected);
    EXPECT_NEAR(world.state(body).angular_velocity.norm() * 0.5, expected, 0.02 * expected);
}

TEST(World, HoldsWithoutCreepingWhereFrictionIsEnough) {
    const Tilted plane{0.5};
    World world = make_world({.allow_sleep = false});
    const BodyId body = add(world, {.shape = Box{{1.0, 2.0, 0.5}}, .friction = 0.6},
                            plane.lying(128.2, 128.6, 0.505));
    for (int step = 0; step < 60; ++step) world.step(plane.ground, kStep);
    const Eigen::Vector3d settled = world.state(body).pose.translation;
    for (int step = 0; step < 60 * 10; ++step) world.step(plane.ground, kStep);
    EXPECT_LT((world.state(body).pose.translation - settled).norm(), 1e-3);
}

TEST(World, BouncesToTheHeightThatRestitutionGives) {
    const Ground ground = make_flat();
    for (const double restitution : {0.0, 0.5, 0.8, 1.0}) {
        World world = make_world({.allow_sleep = false});
        const double drop = 3.0;
        const BodyId body = add(world, {.shape = Sphere{0.5}, .restitution = restitution},
                                at({kMiddle, kMiddle, 5.5 + drop}));
        double highest = 0.0;
        bool has_bounced = false;
        for (int step = 0; step < 240 * 2; ++step) {
            const StepReport report = world.step(ground, 1.0 / 240.0);
            if (has_bounced && report.impacts > 0) break;
            has_bounced = has_bounced || report.impacts > 0;
            if (has_bounced) {
                highest = std::max(highest, world.state(body).pose.translation.z() - 5.5);
            }
        }
        ASSERT_TRUE(has_bounced);
        EXPECT_NEAR(highest, restitution * restitution * drop, 0.03 * drop) << restitution;
    }
}

TEST(World, GainsNoEnergyInRoughFrictionalImpacts) {
    Random random(11);
    const Ground ground = make_test_ground(
        [](double x, double y) { return 2.0 * std::sin(0.7 * x) * std::sin(0.9 * y); }, 1.0, 1);
    for (int run = 0; run < 30; ++run) {
        World world = make_world({.allow_sleep = false});
        BodyState state = at({random.between(40, 90), random.between(40, 90), 8.0});
        state.velocity = {random.between(-20, 20), random.between(-20, 20), random.between(-30, 0)};
        for (int axis = 0; axis < 3; ++axis) state.angular_velocity[axis] = random.between(-8, 8);
        const Eigen::Vector3d half(1.0, 2.0, 0.5);
        const BodyId body = add(world, {.shape = Box{half}, .restitution = 0.7}, state);
        const auto energy = [&](const BodyState& s) {
            return 0.5 * s.velocity.squaredNorm() + kGravity * s.pose.translation.z() +
                   0.5 * s.angular_velocity.dot(spin_momentum(half, s));
        };
        double before = energy(world.state(body));
        for (int step = 0; step < 120; ++step) {
            world.step(ground, kStep);
            const double now = energy(world.state(body));
            // Separation within the tolerance may raise the energy slightly; an impact may not add speed.
            EXPECT_LE(now, before + kGravity * 0.012) << "run " << run << " step " << step;
            before = now;
        }
    }
}

TEST(WorldForces, AccelerateByForceOverMassForOneStep) {
    const Ground ground = make_flat();
    for (const double dt : {kStep, 0.001, 0.1, 1.0}) {
        World world = make_world({.gravity = {0, 0, 0}});
        const BodyId body = add(world, {.mass = 4.0}, at({60.0, 60.0, 50.0}, {1.0, 0.0, 0.0}));
        ASSERT_TRUE(world.add_force(body, {2.0, 1.0, 0.0}));
        ASSERT_TRUE(world.add_force(body, {0.0, 1.0, 2.0}));
        world.step(ground, dt);
        const Eigen::Vector3d expected(1.0 + 0.5 * dt, 0.5 * dt, 0.5 * dt);
        const Eigen::Vector3d reached = world.state(body).velocity;
        EXPECT_LT((reached - expected).norm(), 1e-14) << dt;
        world.step(ground, dt);
        EXPECT_EQ(world.state(body).velocity, reached);
    }
}

TEST(WorldForces, TurnByTorqueOverInertia) {
    const Ground ground = make_flat();
    World world = make_world({.gravity = {0, 0, 0}});
    const Box box{{0.5, 1.0, 1.5}};
    BodyState state = at({60.0, 60.0, 50.0});
    state.pose.rotation = turned({0.3, -0.7, 1.1});
    const BodyId body = add(world, {.shape = box, .mass = 3.0}, state);
    const Eigen::Vector3d torque(0.1, -0.2, 0.3);
    ASSERT_TRUE(world.add_torque(body, torque));
    const double dt = 1.0 / 240.0;
    world.step(ground, dt);
    const Eigen::Vector3d local = state.pose.rotation.transpose() * torque;
    const Eigen::Vector3d expected =
        state.pose.rotation * (dt * local.cwiseQuotient(3.0 * box_inertia(box.half_extents)));
    EXPECT_LT((world.state(body).angular_velocity - expected).norm(), 1e-6 * expected.norm());
    EXPECT_TRUE(world.state(body).velocity.isZero(0.0));
    const Eigen::Vector3d before = world.state(body).angular_velocity;
    world.step(ground, dt);
    EXPECT_LT((world.state(body).angular_velocity - before).norm(), 1e-6 * before.norm());
}

TEST(WorldForces, AtAPointAreAForceAndATorqueAboutTheCentreOfMass) {
    const Ground ground = make_flat();
    World a = make_world({.gravity = {0, 0, 0}}), b = make_world({.gravity = {0, 0, 0}});
    const BodyState state = at({60.0, 60.0, 50.0});
    const BodyId in_a = add(a, {.shape = Sphere{}}, state),
                 in_b = add(b, {.shape = Sphere{}}, state);
    const Eigen::Vector3d arm(0.3, 0.1, -0.2), force(1.0, 2.0, 3.0);
    ASSERT_TRUE(a.add_force(in_a, state.pose.translation + arm, force));
    ASSERT_TRUE(b.add_force(in_b, force));
    ASSERT_TRUE(b.add_torque(in_b, arm.cross(force)));
    a.step(ground, kStep);
    b.step(ground, kStep);
    EXPECT_LT((a.state(in_a).angular_velocity - b.state(in_b).angular_velocity).norm(), 1e-12);
    EXPECT_EQ(a.state(in_a).velocity, b.state(in_b).velocity);
    EXPECT_GT(a.state(in_a).angular_velocity.norm(), 0.01);
}

TEST(WorldForces, OnASleeperWakeIt) {
    const Ground ground = make_flat();
    World world = make_world();
    const BodyId body = add(world, {.shape = Box{}}, at({60.0, 60.0, 5.5}));
    take_steps(world, ground, 120);
    ASSERT_TRUE(is_asleep(world, body));
    ASSERT_TRUE(world.add_force(body, {0.0, 0.0, 30.0}));
    EXPECT_EQ(world.state(body).condition, BodyCondition::awake);
    world.step(ground, kStep);
    EXPECT_NEAR(world.state(body).velocity.z(), (30.0 - 9.81) * kStep, 1e-12);
}

TEST(WorldForces, AreDroppedWhereTheBodyIsChanged) {
    const Ground ground = make_flat();
    World world = make_world({.gravity = {0, 0, 0}});
    const BodyId body = add(world, {.mass = 1e6}, at({60.0, 60.0, 50.0}));
    ASSERT_TRUE(world.add_force(body, {1e9, 0.0, 0.0}));
    ASSERT_TRUE(world.change(body, {.type = BodyType::kinematic_body}));
    world.step(ground, kStep);
    ASSERT_TRUE(world.change(body, {.mass = 1e-6}));
    world.step(ground, kStep);
    EXPECT_TRUE(world.state(body).velocity.isZero(0.0));
}

TEST(WorldForces, HoldABodyOnASlopeAgainstGravity) {
    const Ground ground = make_test_ground([](double x, double) { return x; }, 1.0, 1);
    World world = make_world();
    const BodyId body = add(world, {.shape = Sphere{0.5}, .friction = 0.0},
                            at({60.0, 60.0, 60.0 + 0.5 * std::sqrt(2.0)}));
    for (int i = 0; i < 120; ++i) {
        ASSERT_TRUE(world.add_force(body, {9.81, 0.0, 0.0}));  // cancels gravity on the slope
        EXPECT_EQ(world.step(ground, kStep).too_deep, 0u);
    }
    EXPECT_LT((world.state(body).velocity).norm(), 1e-9);
}

TEST(WorldForces, OutOfRangeAreRefusedAndChangeNothing) {
    const Ground ground = make_flat();
    World world = make_world({.gravity = {0, 0, 0}});
    const BodyId body = add(world, {.shape = Box{}, .mass = 2.0}, at({60.0, 60.0, 50.0}));
    const Eigen::Vector3d p(60.0, 60.0, 50.0);
    for (const double bad : {kNan, kInfinity, 1e300, -2.1e6}) {
        EXPECT_FALSE(world.add_force(body, {bad, 0.0, 0.0})) << bad;
        EXPECT_FALSE(world.add_force(body, p, {bad, 0.0, 0.0})) << bad;
        EXPECT_FALSE(world.add_torque(body, {0.0, bad, 0.0})) << bad;
    }
    EXPECT_FALSE(world.add_force(body, {kNan, 0.0, 0.0}, {1.0, 0.0, 0.0}));
    // The force is in range, but its torque is not.
    EXPECT_FALSE(world.add_force(body, p + Eigen::Vector3d(0.0, 1e9, 0.0), {1e3, 0.0, 0.0}));
    world.step(ground, kStep);
    EXPECT_TRUE(world.state(body).velocity.isZero(0.0));
    EXPECT_TRUE(world.state(body).angular_velocity.isZero(0.0));
    // The largest allowed forces give finite velocities.
    ASSERT_TRUE(world.add_force(body, {2e6, 0.0, 0.0}));
    world.step(ground, 1.0);
    EXPECT_NEAR(world.state(body).velocity.x(), 1e6, 1e-3);
    ASSERT_TRUE(world.teleport(body, at(p)));
    ASSERT_TRUE(world.add_torque(body, {3e5, 0.0, 0.0}));
    world.step(ground, 1.0);
    EXPECT_GT(world.state(body).angular_velocity.x(), 1e5);
    EXPECT_TRUE(world.state(body).angular_velocity.allFinite());
}

TEST(GravityAt, PullsBodiesTowardsThePlanetsCentre) {
    const Ground ground = make_flat();
    const Eigen::Vector3d centre(60.0, 60.0, 60.0);
    WorldSettings settings;
    settings.callbacks.gravity_at = [&](const WorldPos& place) -> Eigen::Vector3d {
        return kGravity * (centre - place).normalized();  // a zero vector stays zero
    };
    World world = make_world(settings);
    add(world, {.shape = Sphere{10.0}, .type = BodyType::static_body}, at(centre));
    std::vector<BodyId> bodies;
    for (const Eigen::Vector3d& side :
         {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0), Eigen::Vector3d(0, 0, -1),
          Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)}) {
        bodies.push_back(add(world, {.shape = Box{}}, at(centre + 12.0 * side)));
    }
    for (int i = 0; i < 300; ++i) EXPECT_EQ(world.step(ground, kStep).failed_callbacks, 0u);
    for (const BodyId body : bodies) {
        EXPECT_NEAR((world.state(body).pose.translation - centre).norm(), 10.5, 0.02);
        EXPECT_TRUE(is_asleep(world, body));
    }
}

TEST(GravityAt, OfZeroLetsBodiesFloat) {
    WorldSettings settings;
    settings.callbacks.gravity_at = [](const WorldPos&) { return Eigen::Vector3d(0, 0, 0); };
    World world = make_world(settings);
    const BodyId body = add(world, {}, at({60.0, 60.0, 50.0}, {0.25, 0.5, 1.0}));
    const Ground ground = make_flat();
    for (int i = 0; i < 60; ++i) world.step(ground, kStep);
    EXPECT_EQ(world.state(body).velocity, Eigen::Vector3d(0.25, 0.5, 1.0));
}

TEST(GravityAt, ThatThrowsOrGivesNoValidValueIsCountedAndTheSettingIsUsed) {
    const Ground ground = make_flat();
    for (int kind = 0; kind < 4; ++kind) {
        WorldSettings settings{.gravity = {0.0, 0.0, -1.0}};
        settings.callbacks.gravity_at = [kind](const WorldPos&) -> Eigen::Vector3d {
            if (kind == 0) throw std::runtime_error("no");
            if (kind == 1) throw 7;
            return {0.0, kind == 2 ? kNan : 1.1e4, 0.0};
        };
        World world = make_world(settings);
        const BodyId body = add(world, {}, at({60.0, 60.0, 50.0}));
        add(world, {}, at({70.0, 60.0, 50.0}));
        EXPECT_EQ(world.step(ground, 0.5).failed_callbacks, 2u);
        EXPECT_NEAR(world.state(body).velocity.z(), -0.5, 1e-12);
    }
}

}  // namespace terrane::body_laws_test
