// SPDX-License-Identifier: MIT
#include "bullet_scene.h"
#include "engine_grounds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace terrane {
namespace bullet_bodies_test {

using test::BulletScene;

bool all_but_last(int column, int row) { return column + row != 2; }

TEST(BulletBodies, HoldsABodyOverAbsentGroundUntilItIsThere) {
    BulletScene scene;
    int held = 0, released = 0;
    scene.keeper =
        adapters::BulletBodies([&](btRigidBody&, bool is_held) { is_held ? ++held : ++released; });
    scene.set_ground(test::hilly_ground(all_but_last));
    btRigidBody& over = scene.add_sphere(0.5, btVector3(180, 180, 5));
    btRigidBody& beside = scene.add_sphere(0.5, btVector3(60, 60, 5));
    over.setLinearVelocity(btVector3(1, 0, -2));
    for (int i = 0; i < 120; ++i) scene.step();
    EXPECT_EQ(over.getWorldTransform().getOrigin().z(), 5);
    EXPECT_TRUE(scene.keeper.is_held(over));
    EXPECT_EQ(scene.keeper.held_count(), 1u);
    EXPECT_NEAR(scene.clearance(beside), 0.5, 0.2);
    EXPECT_EQ(held, 1);
    const auto needs = scene.keeper.needs(scene.world, scene.shape);
    ASSERT_EQ(needs.size(), 2u);
    EXPECT_TRUE(needs[0].is_waiting);
    EXPECT_FALSE(needs[1].is_waiting);
    EXPECT_NEAR(needs[0].velocity.z(), -2.0, 1e-12);
    EXPECT_NEAR(needs[0].centre_world.x(), 180.0, 1e-3);
    EXPECT_GE(needs[0].radius, 0.5);

    scene.set_ground(test::hilly_ground());
    scene.step();
    EXPECT_EQ(released, 1);
    EXPECT_LT(over.getLinearVelocity().z(), -1.9) << "its velocity is given back";
    for (int i = 0; i < 240; ++i) scene.step();
    EXPECT_GT(scene.clearance(over), 0.3);
}

TEST(BulletBodies, HoldsABodyBeforeItMovesOntoAbsentGround) {
    BulletScene scene;
    scene.set_ground(test::hilly_ground(all_but_last));
    btRigidBody& body = scene.add_sphere(0.5, btVector3(120, 180, 4));
    body.setLinearVelocity(btVector3(60, 0, 0));
    for (int i = 0; i < 60; ++i) scene.step();
    EXPECT_TRUE(scene.keeper.is_held(body));
    EXPECT_LT(body.getWorldTransform().getOrigin().x(), 128);
}

TEST(BulletBodies, LetsABodyFallBeyondTheExtent) {
    BulletScene scene;
    scene.set_ground(test::hilly_ground(all_but_last));
    btRigidBody& body = scene.add_sphere(0.5, btVector3(-50, -50, 0));
    for (int i = 0; i < 60; ++i) scene.step();
    EXPECT_EQ(scene.keeper.held_count(), 0u);
    EXPECT_LT(body.getWorldTransform().getOrigin().z(), -3);
}

TEST(BulletBodies, SurvivesACallbackThatThrowsAndABodyThatGoes) {
    BulletScene scene;
    scene.keeper =
        adapters::BulletBodies([](btRigidBody&, bool) { throw std::runtime_error("thrown"); });
    scene.set_ground(test::hilly_ground(all_but_last));
    btRigidBody& body = scene.add_sphere(0.5, btVector3(180, 180, 5));
    scene.step();
    EXPECT_TRUE(scene.keeper.is_held(body));
    scene.world.removeRigidBody(&body);
    scene.keeper.forget(body);
    EXPECT_EQ(scene.keeper.held_count(), 0u);
    scene.step();
    scene.world.addRigidBody(&body);
}

TEST(BulletVehicle, DrivesOverHillsAndChunkBordersOnItsWheels) {
    BulletScene scene;
    scene.set_ground(test::hilly_ground());
    const double start = scene.shape.ground()->height(30, 130).height;
    btRigidBody& chassis = scene.add(std::make_unique<btBoxShape>(btVector3(2, 1, btScalar(0.4))),
                                     btVector3(30, 130, btScalar(start + 2.0)), 1200.0);
    btDefaultVehicleRaycaster raycaster(&scene.world);
    btRaycastVehicle::btVehicleTuning tuning;
    btRaycastVehicle vehicle(tuning, &chassis, &raycaster);
    vehicle.setCoordinateSystem(1, 2, 0);
    for (const double x : {1.5, -1.5}) {
        for (const double y : {0.9, -0.9}) {
            btWheelInfo& wheel =
                vehicle.addWheel(btVector3(btScalar(x), btScalar(y), 0), btVector3(0, 0, -1),
                                 btVector3(0, -1, 0), btScalar(0.5), btScalar(0.45), tuning, x > 0);
            wheel.m_suspensionStiffness = 30;
            wheel.m_wheelsDampingRelaxation = btScalar(3.5);
            wheel.m_wheelsDampingCompression = btScalar(3.5);
            wheel.m_rollInfluence = btScalar(0.1);
        }
    }
    scene.world.addVehicle(&vehicle);
    int wheel_contacts = 0;
    double travelled = 0.0;
    btVector3 last = chassis.getWorldTransform().getOrigin();
    for (int i = 0; i < 600; ++i) {
        const bool is_slow = vehicle.getCurrentSpeedKmHour() < 25;
        for (int wheel = 0; wheel < 4; ++wheel)
            vehicle.applyEngineForce(btScalar(is_slow ? 1200 : 0), wheel);
        scene.step();
        for (int wheel = 0; wheel < 4; ++wheel)
            wheel_contacts += vehicle.getWheelInfo(wheel).m_raycastInfo.m_isInContact ? 1 : 0;
        const btVector3 now = chassis.getWorldTransform().getOrigin();
        travelled += double((now - last).length());
        last = now;
        ASSERT_GT(scene.clearance(chassis), 0.1) << "step " << i;
    }
    scene.world.removeVehicle(&vehicle);
    EXPECT_GT(travelled, 20.0);
    EXPECT_GT(wheel_contacts, 600);
}

}  // namespace bullet_bodies_test
}  // namespace terrane
