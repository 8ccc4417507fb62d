// SPDX-License-Identifier: MIT
#include "adapters/adapter_grounds.h"
#include "adapters/engines/bullet_scene.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace terrane {
namespace bullet_ground_test {

using adapters::BulletGround;
using adapters::BulletGroundSettings;
using test::BulletScene;
using test::Random;

constexpr bool kIsDouble = sizeof(btScalar) == sizeof(double);
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Counter final : btTriangleCallback {
    int count = 0;
    void processTriangle(btVector3*, int, int) override { ++count; }
};

double cast_ray(const BulletScene& scene, const WorldPos& from, const WorldPos& to) {
    const btVector3 a = scene.shape.to_shape(from), b = scene.shape.to_shape(to);
    btCollisionWorld::ClosestRayResultCallback answer(a, b);
    scene.world.rayTest(a, b, answer);
    return answer.hasHit() ? static_cast<double>(answer.m_closestHitFraction) : -1.0;
}

TEST(BulletGround, AnswersRaysAsTheGround) {
    BulletScene scene;
    const Ground ground = test::hilly_ground();
    scene.set_ground(ground);
    Random random(7);
    int hits = 0;
    for (int i = 0; i < 600; ++i) {
        const WorldPos from(random.between(5.0, 250.0), random.between(5.0, 250.0),
                            random.between(-8.0, 12.0));
        WorldPos to(random.between(5.0, 250.0), random.between(5.0, 250.0),
                    random.between(-8.0, 4.0));
        if (i % 3 == 0) to.x() = from.x(), to.y() = from.y();
        const RayAnswer expected = ground.ray(from, to);
        const double fraction = cast_ray(scene, from, to);
        if (expected.status != QueryStatus::ok) {
            EXPECT_EQ(fraction, -1.0);
            continue;
        }
        ++hits;
        // a float resolves 3e-5 m here, and a grazing ray magnifies that
        const double sine = std::abs((to - from).normalized().dot(expected.normal));
        EXPECT_NEAR(fraction, expected.fraction,
                    (kIsDouble ? 1e-9 : 1e-4) / ((to - from).norm() * std::max(sine, 1e-3)))
            << i;
    }
    EXPECT_GT(hits, 300);
}

TEST(BulletGround, GivesARayTheNextSurfaceWhereBackFacesAreFiltered) {
    BulletScene scene;
    scene.set_ground(test::hilly_ground());
    // from below, through a hill, to a rising slope behind it
    const btVector3 from(btScalar(60.3), btScalar(40.2), btScalar(-6)),
        to(btScalar(61), btScalar(40), btScalar(20));
    btCollisionWorld::ClosestRayResultCallback open(from, to), filtered(from, to);
    filtered.m_flags = btTriangleRaycastCallback::kF_FilterBackfaces;
    scene.world.rayTest(from, to, open);
    scene.world.rayTest(from, to, filtered);
    EXPECT_TRUE(open.hasHit());
    EXPECT_FALSE(filtered.hasHit());
}

TEST(BulletGround, LetsABodySlideOverEdgesAndChunkBordersWithoutAKick) {
    for (const bool is_box : {true, false}) {
        BulletScene scene;
        scene.set_ground(test::make_test_ground([](double, double) { return 0.0; }, 1.0, 2));
        scene.ground_body.setFriction(0);
        const btVector3 start(110, btScalar(127.7), btScalar(0.5));
        btRigidBody& body = is_box ? scene.add_box(0.5, start) : scene.add_sphere(0.5, start);
        body.setFriction(0);
        body.setLinearVelocity(btVector3(20, btScalar(0.4), 0));
        double most_up = 0.0, most_turn = 0.0;
        for (int i = 0; i < 120; ++i) {
            scene.step();
            most_up = std::max(most_up, double(body.getLinearVelocity().z()));
            most_turn = std::max(most_turn, double(body.getAngularVelocity().length()));
        }
        EXPECT_GT(body.getWorldTransform().getOrigin().x(), 145);
        EXPECT_LT(most_up, 1e-2);
        EXPECT_LT(most_turn, 1e-2);
        EXPECT_NEAR(body.getLinearVelocity().x(), 20.0, 1e-3);
    }
}

TEST(BulletGround, LetsNoDroppedBodyFallThrough) {
    BulletScene scene;
    scene.set_ground(test::hilly_ground());
    Random random(11);
    for (int i = 0; i < 60; ++i) {
        const btVector3 place(btScalar(random.between(20.0, 230.0)),
                              btScalar(random.between(20.0, 230.0)),
                              btScalar(random.between(5.0, 9.0)));
        if (i % 4 == 0) scene.add_sphere(0.4, place);
        if (i % 4 == 1) scene.add_box(0.4, place);
        if (i % 4 == 2)
            scene.add(std::make_unique<btCapsuleShapeZ>(btScalar(0.3), btScalar(0.8)), place);
        if (i % 4 == 3) {
            auto compound = std::make_unique<btCompoundShape>();
            scene.shapes.push_back(
                std::make_unique<btBoxShape>(btVector3(1, btScalar(0.3), btScalar(0.3))));
            const btTransform up(btQuaternion::getIdentity(), btVector3(0, 0, btScalar(0.2)));
            compound->addChildShape(up, scene.shapes.back().get());
            scene.add(std::move(compound), place);
        }
    }
    for (int i = 0; i < 180; ++i) scene.step();
    for (const auto& body : scene.bodies) EXPECT_GT(scene.clearance(*body), 0.0);
    EXPECT_EQ(scene.shape.counts().refused, 0u);
}

// As bullet: a capsule along each axis has the contacts of that axis.
TEST(BulletGround, KnowsTheAxisOfACapsule) {
    for (int axis = 0; axis < 3; ++axis) {
        BulletScene scene;
        scene.set_ground(test::make_test_ground([](double, double) { return 0.0; }, 1.0, 1));
        std::unique_ptr<btCollisionShape> capsule;
        if (axis == 0) capsule = std::make_unique<btCapsuleShapeX>(btScalar(0.25), btScalar(2));
        if (axis == 1) capsule = std::make_unique<btCapsuleShape>(btScalar(0.25), btScalar(2));
        if (axis == 2) capsule = std::make_unique<btCapsuleShapeZ>(btScalar(0.25), btScalar(2));
        btRigidBody& body =
            scene.add(std::move(capsule), btVector3(60, 60, btScalar(axis == 2 ? 1.25 : 0.25)));
        scene.step();
        EXPECT_EQ(scene.dispatcher.getNumManifolds(), 1);
        const btPersistentManifold* const manifold = scene.dispatcher.getManifoldByIndexInternal(0);
        EXPECT_EQ(manifold->getNumContacts(), axis == 2 ? 1 : 2);
        for (int i = 0; i < 60; ++i) scene.step();
        EXPECT_NEAR(scene.clearance(body), axis == 2 ? 1.25 : 0.25, 0.02);
    }
}

TEST(BulletGround, PushesOutABodyThatIsUnderTheSurface) {
    BulletScene scene;
    scene.set_ground(test::hilly_ground());
    btRigidBody& body = scene.add_sphere(0.5, btVector3(80, 80, 0));
    btTransform place = body.getWorldTransform();
    place.getOrigin().setZ(btScalar(scene.shape.ground()->height(80, 80).height - 3.0));
    body.setWorldTransform(place);
    for (int i = 0; i < 240; ++i) scene.step();
    EXPECT_GT(scene.clearance(body), 0.3);
    EXPECT_LT(scene.clearance(body), 2.0) << "it must not be thrown";
}

TEST(BulletGround, RestsAsNearTheOriginInAFrameTenThousandKilometresOut) {
    BulletScene scene({.origin_world = WorldPos(1e7 + 64.0, -1e7 + 64.0, 0.0)});
    scene.set_ground(test::make_test_ground([](double, double) { return 2.0; },
                                            {.origin_x = 1e7, .origin_y = -1e7}));
    btRigidBody& body = scene.add_box(0.5, btVector3(0, 0, btScalar(2.6)));
    for (int i = 0; i < 60; ++i) scene.step();
    EXPECT_NEAR(scene.clearance(body), 0.5, 0.01);
    EXPECT_NEAR(scene.shape.to_world(body.getWorldTransform().getOrigin()).x(), 1e7 + 64.0, 1e-3);
}

TEST(BulletGround, CarriesBodiesOnVolumes) {
    BulletScene scene;
    scene.set_ground(test::slab_ground());
    btRigidBody& sphere = scene.add_sphere(0.5, btVector3(40, 40, 7));
    auto hull = std::make_unique<btConvexHullShape>();
    for (int i = 0; i < 8; ++i) {
        const btVector3 corner(btScalar(i & 1), btScalar(i >> 1 & 1), btScalar(i >> 2));
        hull->addPoint(corner - btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5)));
    }
    btRigidBody& box = scene.add(std::move(hull), btVector3(36, 36, 7));
    btRigidBody& under = scene.add_sphere(0.5, btVector3(44, 44, 2));
    for (int i = 0; i < 150; ++i) scene.step();
    EXPECT_NEAR(sphere.getWorldTransform().getOrigin().z(), 5.5, 0.02);
    EXPECT_NEAR(box.getWorldTransform().getOrigin().z(), 5.5, 0.06);
    EXPECT_NEAR(under.getWorldTransform().getOrigin().z(), 0.5, 0.02);
}

TEST(BulletGround, SurvivesBoxesThatAreNotFiniteOrEnormous) {
    BulletScene scene({.most_cells = 1000});
    scene.set_ground(test::hilly_ground());
    Counter counter;
    const auto vector = [](double v) { return btVector3(btScalar(v), btScalar(v), btScalar(v)); };
    scene.shape.processAllTriangles(&counter, vector(kNan), vector(1.0));
    scene.shape.processAllTriangles(&counter, vector(-1e9), vector(1e9));
    EXPECT_EQ(counter.count, 0);
    EXPECT_EQ(scene.shape.counts().refused, 2u);
    scene.shape.processAllTriangles(&counter, vector(1e9), vector(1e9));
    EXPECT_EQ(scene.shape.counts().refused, 2u);
    EXPECT_EQ(cast_ray(scene, WorldPos::Constant(kNan), WorldPos(1, 1, 1)), -1.0);
    EXPECT_EQ(cast_ray(scene, WorldPos(10, 10, 9), WorldPos(10, 10, 9)), -1.0);
    // Bullet's own test of a triangle loses hits of rays of 1e6 m in float.
    const double high = sizeof(btScalar) == sizeof(double) ? 1e6 : 1e4;
    EXPECT_GT(cast_ray(scene, WorldPos(10, 10, high), WorldPos(10, 10, -high)), 0.4);

    btRigidBody& far = scene.add_sphere(0.5, btVector3(btScalar(1e9), btScalar(1e9), 5));
    scene.step();
    EXPECT_LT(far.getWorldTransform().getOrigin().z(), 5) << "there is no ground: it falls";
}

TEST(BulletGround, HasNoTrianglesWithoutAGround) {
    BulletGround shape;
    Counter counter;
    shape.processAllTriangles(&counter, btVector3(0, 0, 0), btVector3(1, 1, 1));
    EXPECT_EQ(counter.count, 0);
    shape.setLocalScaling(btVector3(2, 2, 2));
    EXPECT_EQ(shape.getLocalScaling(), btVector3(1, 1, 1)) << "scaling is refused";
}

TEST(BulletGround, SurvivesACallbackThatThrows) {
    BulletGroundSettings settings;
    settings.on_absent = [](const Aabb&) { throw std::runtime_error("thrown"); };
    BulletGround shape(settings);
    shape.set_ground(test::hilly_ground([](int, int) { return false; }));
    Counter counter;
    shape.processAllTriangles(&counter, btVector3(9, 9, -9), btVector3(10, 10, 9));
    EXPECT_EQ(shape.counts().absent, 1u);
    EXPECT_EQ(shape.counts().failed_callbacks, 1u);
}

}  // namespace bullet_ground_test

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
