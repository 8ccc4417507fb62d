// SPDX-License-Identifier: MIT
#include "benchmark/collision/body_peers.h"
#include "benchmark/collision/bullet_shapes.h"

#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>

#include <vector>

namespace terrane::bench {
namespace {

std::unique_ptr<btBroadphaseInterface> make_bullet(PeerBroadphase kind,
                                                   std::span<const Eigen::Vector3d> centres) {
    if (kind == PeerBroadphase::tree) return std::make_unique<btDbvtBroadphase>();
    Eigen::Vector3d low = centres[0], high = centres[0];
    for (const Eigen::Vector3d& centre : centres) {
        low = low.cwiseMin(centre);
        high = high.cwiseMax(centre);
    }
    const Eigen::Vector3d around = Eigen::Vector3d::Constant(10.0);
    return std::make_unique<btAxisSweep3>(to_bullet(low - around), to_bullet(high + around),
                                          static_cast<unsigned short>(centres.size() + 2));
}

}  // namespace

struct BroadphasePeer::World {
    World(PeerBroadphase kind, double radius, std::span<const Eigen::Vector3d> centres)
        : dispatcher(&configuration),
          broadphase(make_bullet(kind, centres)),
          shape(btScalar(radius)),
          bodies(centres.size()),
          world(&dispatcher, broadphase.get(), &configuration) {
        for (std::size_t i = 0; i < centres.size(); ++i) {
            bodies[i].setCollisionShape(&shape);
            bodies[i].getWorldTransform().setOrigin(to_bullet(centres[i]));
            world.addCollisionObject(&bodies[i]);
        }
    }

    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher;
    std::unique_ptr<btBroadphaseInterface> broadphase;
    btSphereShape shape;
    std::vector<btCollisionObject> bodies;
    btCollisionWorld world;  // destroyed first
};

BroadphasePeer::BroadphasePeer(PeerBroadphase kind, double radius,
                               std::span<const Eigen::Vector3d> centres)
    : world_(std::make_unique<World>(kind, radius, centres)) {}

BroadphasePeer::~BroadphasePeer() = default;

std::size_t BroadphasePeer::step(std::span<const Eigen::Vector3d> centres) {
    for (std::size_t i = 0; i < centres.size(); ++i) {
        world_->bodies[i].getWorldTransform().setOrigin(to_bullet(centres[i]));
    }
    world_->world.performDiscreteCollisionDetection();
    std::size_t touching = 0;
    for (int i = 0; i < world_->dispatcher.getNumManifolds(); ++i) {
        const btPersistentManifold* const manifold =
            world_->dispatcher.getManifoldByIndexInternal(i);
        // It keeps contacts of pairs that are slightly apart.
        for (int k = 0; k < manifold->getNumContacts(); ++k) {
            if (manifold->getContactPoint(k).getDistance() <= btScalar(0.0)) {
                ++touching;
                break;
            }
        }
    }
    return touching;
}

}  // namespace terrane::bench
