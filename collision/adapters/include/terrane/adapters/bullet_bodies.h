// SPDX-License-Identifier: MIT
#pragma once

// Keeps Bullet's bodies from falling through absent ground: holds them until their ground is resident, and lists their
// needs for Terrain::update(). Use one object per world and BulletGround; see bullet_ground.h for units and frames.
//
// Each frame:  const Frame& frame = terrain.update(cameras, bodies.needs(world, ground), time);
//              ground.set_ground(frame.ground);
//              bodies.hold(world, ground, dt);
//              world.stepSimulation(dt, 0);
//
// A body is held if its box, swept by velocity and gravity over dt, may touch absent ground (may_meet_absent()). A held
// body is not integrated (DISABLE_SIMULATION); its velocity is saved, and restored on release. on_held is called when
// a body becomes held and when it is released.
//
// Threads: one at a time, and not during a step.

#include <terrane/adapters/bullet_ground.h>
#include <terrane/terrain/body_need.h>

#include <BulletDynamics/Dynamics/btDynamicsWorld.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <span>
#include <vector>

namespace terrane::adapters {

/// Holds bodies over absent ground, and lists the needs of all bodies.
class BulletBodies {
public:
    /// @param on_held called when a body becomes held or is released; exceptions are caught
    explicit BulletBodies(std::function<void(btRigidBody&, bool is_held)> on_held = {})
        : on_held_(std::move(on_held)) {}

    /// The needs of all dynamic bodies, for Terrain::update(); valid until the next call.
    std::span<const BodyNeed> needs(btDynamicsWorld& world, const BulletGround& ground) {
        needs_.clear();
        for_each_moving(world, [&](btRigidBody& body) {
            const Aabb box = box_of(body, ground);
            BodyNeed need;
            need.centre_world = 0.5 * (box.low + box.high);
            need.radius = 0.5 * (box.high - box.low).norm();
            const Held* const held = find(body);
            need.velocity = eigen(held ? held->velocity : body.getLinearVelocity());
            need.is_waiting = held != nullptr;
            needs_.push_back(need);
        });
        return needs_;
    }

    /// Releases held bodies whose ground is resident, and holds bodies that may reach absent ground in the step.
    ///
    /// @param dt total time of the following stepSimulation(), seconds
    void hold(btDynamicsWorld& world, const BulletGround& ground, double dt) {
        if (ground.ground() == nullptr) return;
        for_each_moving(world, [&](btRigidBody& body) {
            const Held* const held = find(body);
            const btVector3 velocity = held ? held->velocity : body.getLinearVelocity();
            const Eigen::Vector3d displacement =
                dt * eigen(velocity) + dt * dt * eigen(body.getGravity());
            const bool is_absent =
                may_meet_absent(*ground.ground(), box_of(body, ground), displacement);
            if (is_absent && !held) begin(body);
            if (!is_absent && held) end(body);
        });
    }

    /// Number of bodies currently held.
    std::size_t held_count() const { return held_.size(); }
    /// Whether a body is currently held.
    bool is_held(const btRigidBody& body) const { return find(body) != nullptr; }
    /// Removes a body from the list of held bodies. Call before removing the body from the world.
    void forget(const btRigidBody& body) {
        std::erase_if(held_, [&](const Held& held) { return held.body == &body; });
    }

private:
    struct Held {
        btRigidBody* body;
        btVector3 velocity, spin;
        int activation;
    };

    static Eigen::Vector3d eigen(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
    static Aabb box_of(const btRigidBody& body, const BulletGround& ground) {
        btVector3 low, high;
        body.getAabb(low, high);
        return {ground.to_world(low), ground.to_world(high)};
    }
    template <class Visit>
    static void for_each_moving(btDynamicsWorld& world, Visit visit) {
        btCollisionObjectArray& objects = world.getCollisionObjectArray();
        for (int i = 0; i < objects.size(); ++i) {
            btRigidBody* const body = btRigidBody::upcast(objects[i]);
            if (body != nullptr && !body->isStaticOrKinematicObject()) visit(*body);
        }
    }
    const Held* find(const btRigidBody& body) const {
        for (const Held& held : held_) {
            if (held.body == &body) return &held;
        }
        return nullptr;
    }

    void begin(btRigidBody& body) {
        held_.push_back({&body, body.getLinearVelocity(), body.getAngularVelocity(),
                         body.getActivationState()});
        body.setLinearVelocity(btVector3(0, 0, 0));
        body.setAngularVelocity(btVector3(0, 0, 0));
        body.forceActivationState(DISABLE_SIMULATION);
        tell(body, true);
    }
    void end(btRigidBody& body) {
        const Held held = *find(body);
        forget(body);
        body.forceActivationState(held.activation);
        body.setLinearVelocity(held.velocity);
        body.setAngularVelocity(held.spin);
        body.clearForces();
        tell(body, false);
    }
    void tell(btRigidBody& body, bool is_held) {
        if (!on_held_) return;
        try {
            on_held_(body, is_held);
        } catch (...) {  // an exception of the callback must not abort the step
        }
    }

    std::function<void(btRigidBody&, bool)> on_held_;
    std::vector<Held> held_;
    std::vector<BodyNeed> needs_;
};

}  // namespace terrane::adapters
