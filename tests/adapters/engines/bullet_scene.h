// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/adapters/bullet_bodies.h>
#include <terrane/adapters/bullet_contacts.h>
#include <terrane/adapters/bullet_ground.h>

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <vector>

namespace terrane::test {

/// A world of Bullet on Terrane's ground.
struct BulletScene {
    explicit BulletScene(adapters::BulletGroundSettings settings = {})
        : contacts(dispatcher),
          world(&dispatcher, &broadphase, &solver, &configuration),
          shape(std::move(settings)),
          ground_body(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &shape)) {
        world.setGravity(btVector3(0, 0, btScalar(-9.81)));
    }
    ~BulletScene() {
        for (const auto& body : bodies) world.removeRigidBody(body.get());
        world.removeRigidBody(&ground_body);
    }
    BulletScene(const BulletScene&) = delete;
    BulletScene& operator=(const BulletScene&) = delete;

    /// The first call adds the ground to the world, because Bullet keeps its box.
    void set_ground(Ground ground) {
        const bool is_first = shape.ground() == nullptr;
        shape.set_ground(std::move(ground));
        if (is_first) world.addRigidBody(&ground_body);
    }

    btRigidBody& add(std::unique_ptr<btCollisionShape> body_shape, const btVector3& place,
                     double mass = 10.0) {
        btVector3 inertia(0, 0, 0);
        body_shape->calculateLocalInertia(btScalar(mass), inertia);
        shapes.push_back(std::move(body_shape));
        bodies.push_back(std::make_unique<btRigidBody>(btRigidBody::btRigidBodyConstructionInfo(
            btScalar(mass), nullptr, shapes.back().get(), inertia)));
        bodies.back()->setWorldTransform(btTransform(btQuaternion::getIdentity(), place));
        bodies.back()->setActivationState(DISABLE_DEACTIVATION);
        world.addRigidBody(bodies.back().get());
        return *bodies.back();
    }
    btRigidBody& add_sphere(double radius, const btVector3& place) {
        return add(std::make_unique<btSphereShape>(btScalar(radius)), place);
    }
    btRigidBody& add_box(double half, const btVector3& place) {
        return add(
            std::make_unique<btBoxShape>(btVector3(btScalar(half), btScalar(half), btScalar(half))),
            place);
    }
    void step(double dt = 1.0 / 60.0) {
        keeper.hold(world, shape, dt);
        world.stepSimulation(btScalar(dt), 0);
    }
    /// World z of the surface below a body, metres above it.
    double clearance(const btRigidBody& body) const {
        const WorldPos p = shape.to_world(body.getWorldTransform().getOrigin());
        const HeightAnswer at = shape.ground()->height(p.x(), p.y());
        return p.z() - at.height;
    }

    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    adapters::BulletContacts contacts;
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world;
    adapters::BulletGround shape;
    btRigidBody ground_body;
    adapters::BulletBodies keeper;
    std::vector<std::unique_ptr<btCollisionShape>> shapes;
    std::vector<std::unique_ptr<btRigidBody>> bodies;
};

}  // namespace terrane::test
