// Bullet bodies and a Bullet raycast vehicle on Terrane ground: see docs/adapters.md. Prints where the vehicle ends,
// and how many bodies end below the ground.
#include "motion_trace.h"

#include <terrane/adapters/bullet_bodies.h>
#include <terrane/adapters/bullet_contacts.h>
#include <terrane/adapters/bullet_ground.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/terrain.h>

#include <btBulletDynamicsCommon.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

int main(int argc, char** argv) {
    using namespace terrane;
    MotionTrace trace(argc, argv);
    const auto source = FractalHeights::create({.seed = 7}).value();
    Terrain terrain = Terrain::create(source, {.paging = {.worker_count = 0}}).value();

    // Bullet's world, with Terrane's contacts registered at its dispatcher.
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    adapters::BulletContacts contacts(dispatcher);
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
    world.setGravity(btVector3(0, 0, btScalar(-9.81)));

    // Before anything stands on it, load the ground around the start, which is the origin of Bullet's frame.
    RequiredRegion start = terrain.require({-60, -60, 60, 60}, 0.0);
    const Ground first = terrain.load({}, {}, 0.0).ground;
    const WorldPos origin(0.0, 0.0, first.height(0.0, 0.0).height);
    adapters::BulletGround ground({.origin_world = origin});
    ground.set_ground(first);
    btRigidBody ground_body(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &ground));
    world.addRigidBody(&ground_body);
    start.release();

    btSphereShape ball(btScalar(0.4));
    btBoxShape chassis_box(btVector3(2, 1, btScalar(0.4)));
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    const auto add = [&](btCollisionShape& shape, double mass, double x, double y, double up) {
        const double z = first.height(x, y).height + up;
        btVector3 inertia(0, 0, 0);
        shape.calculateLocalInertia(btScalar(mass), inertia);
        bodies.push_back(std::make_unique<btRigidBody>(
            btRigidBody::btRigidBodyConstructionInfo(btScalar(mass), nullptr, &shape, inertia)));
        bodies.back()->setWorldTransform(
            btTransform(btQuaternion::getIdentity(), ground.to_shape({x, y, z})));
        world.addRigidBody(bodies.back().get());
        return bodies.back().get();
    };
    for (int i = 0; i < 10; ++i) add(ball, 30, 10 + 2 * i, 5, 4);
    btRigidBody* const chassis = add(chassis_box, 1500, 0, 0, 1.5);
    chassis->setActivationState(DISABLE_DEACTIVATION);
    btDefaultVehicleRaycaster raycaster(&world);
    btRaycastVehicle::btVehicleTuning tuning;
    btRaycastVehicle vehicle(tuning, chassis, &raycaster);
    vehicle.setCoordinateSystem(1, 2, 0);  // right, up, forward
    for (const double x : {1.4, -1.4}) {
        for (const double y : {0.9, -0.9}) {
            vehicle.addWheel(btVector3(btScalar(x), btScalar(y), 0), btVector3(0, 0, -1),
                             btVector3(0, -1, 0), btScalar(0.5), btScalar(0.45), tuning, x > 0);
        }
    }
    world.addVehicle(&vehicle);

    adapters::BulletBodies keeper;
    const double dt = 1.0 / 60.0;
    for (int frame = 0; frame < 300; ++frame) {
        // 1. What the bodies need. 2. The newest ground. 3. Bodies whose ground is absent are held. 4. The step.
        ground.set_ground(terrain.update({}, keeper.needs(world, ground), frame * dt).ground);
        keeper.hold(world, ground, dt);
        for (int wheel = 0; wheel < 4; ++wheel) vehicle.applyEngineForce(1000, wheel);
        world.stepSimulation(btScalar(dt), 0);
        for (const std::size_t i : {std::size_t{0}, std::size_t{5}, bodies.size() - 1}) {
            const WorldPos p = ground.to_world(bodies[i]->getWorldTransform().getOrigin());
            const std::string name =
                i + 1 == bodies.size() ? "vehicle" : "ball " + std::to_string(i);
            trace.add(name, frame * dt, p, ground.ground()->height(p.x(), p.y()).height);
        }
    }

    int below = 0;
    for (const auto& body : bodies) {
        const WorldPos p = ground.to_world(body->getWorldTransform().getOrigin());
        if (p.z() < ground.ground()->height(p.x(), p.y()).height) ++below;
    }
    const btVector3 end = chassis->getWorldTransform().getOrigin();
    std::printf("the vehicle drove to (%.1f, %.1f); %zu held, %d below the ground\n",
                double(end.x()), double(end.y()), keeper.held_count(), below);
    world.removeVehicle(&vehicle);
    for (const auto& body : bodies) world.removeRigidBody(body.get());
    world.removeRigidBody(&ground_body);
    return below == 0 ? 0 : 1;
}
