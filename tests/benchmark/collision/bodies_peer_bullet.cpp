// SPDX-License-Identifier: MIT
#include "benchmark/collision/body_peers.h"
#include "benchmark/collision/bullet_shapes.h"

#include <btBulletDynamicsCommon.h>

#include <vector>

namespace terrane::bench {

struct BodiesPeer::World {
    explicit World(const test::HeightTable& table)
        : surface(table),
          dispatcher(&configuration),
          world(&dispatcher, &broadphase, &solver, &configuration),
          ground(btRigidBody::btRigidBodyConstructionInfo(0.0, nullptr, &surface.field)) {
        world.setGravity(btVector3(0.0, 0.0, btScalar(-9.81)));
        ground.setWorldTransform(surface.place);
        ground.setFriction(btScalar(1.0));  // a contact has the product of both
        ground.setRestitution(btScalar(1.0));
        world.addRigidBody(&ground);
    }
    ~World() {
        for (const auto& body : bodies) world.removeRigidBody(body.get());
        world.removeRigidBody(&ground);
    }

    BulletGround surface;
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher;
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world;
    btRigidBody ground;
    std::vector<std::unique_ptr<btConvexShape>> shapes;
    std::vector<std::unique_ptr<btRigidBody>> bodies;
};

BodiesPeer::BodiesPeer(const test::HeightTable& table) : world_(std::make_unique<World>(table)) {}
BodiesPeer::~BodiesPeer() = default;

std::string BodiesPeer::name() { return bullet_name(); }

void BodiesPeer::add(const BodySettings& settings, const BodyState& state) {
    world_->shapes.push_back(make_bullet_shape(settings.shape));
    btVector3 inertia(0.0, 0.0, 0.0);
    world_->shapes.back()->calculateLocalInertia(btScalar(settings.mass), inertia);
    world_->bodies.push_back(std::make_unique<btRigidBody>(btRigidBody::btRigidBodyConstructionInfo(
        btScalar(settings.mass), nullptr, world_->shapes.back().get(), inertia)));
    btRigidBody& body = *world_->bodies.back();
    body.setWorldTransform(to_bullet(state.pose));
    body.setLinearVelocity(to_bullet(state.velocity));
    body.setAngularVelocity(to_bullet(state.angular_velocity));
    body.setFriction(btScalar(settings.friction));
    body.setRestitution(btScalar(settings.restitution));
    body.setActivationState(DISABLE_DEACTIVATION);
    world_->world.addRigidBody(&body);
}

void BodiesPeer::step(double dt) { world_->world.stepSimulation(btScalar(dt), 0); }

Pose BodiesPeer::pose(std::size_t body) const {
    const btTransform& place = world_->bodies[body]->getWorldTransform();
    Pose pose;
    for (int i = 0; i < 3; ++i) {
        pose.translation[i] = double(place.getOrigin()[i]);
        for (int k = 0; k < 3; ++k) pose.rotation(i, k) = double(place.getBasis()[i][k]);
    }
    return pose;
}

}  // namespace terrane::bench
