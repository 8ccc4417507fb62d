// SPDX-License-Identifier: MIT
//
// Time of a step of Bullet's world with bodies on Terrane's shape (BulletGround with BulletContacts) beside Bullet's
// own btHeightfieldTerrainShape on the same heights and diagonals: medians of steps that take turns.
//
//   bullet_adapter_benchmark [--quick]
#include "benchmark/collision/adapter_drop.h"
#include "benchmark/collision/bullet_shapes.h"

#include <terrane/adapters/bullet_bodies.h>
#include <terrane/adapters/bullet_contacts.h>

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <optional>

namespace terrane::bench {
namespace {

class BulletBodiesOnGround {
public:
    BulletBodiesOnGround(const ContactMap& map, const AdapterDrop& drop, bool is_ours,
                         bool has_contacts)
        : map_(map),
          is_ours_(is_ours),
          world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
        world_.setGravity(btVector3(0, 0, btScalar(-9.81)));
        btCollisionShape* shape = &field_.field;
        if (is_ours) {
            if (has_contacts) contacts_.emplace(dispatcher_);
            ours_.set_ground(map.ground);
            shape = &ours_;
        }
        ground_ = std::make_unique<btRigidBody>(
            btRigidBody::btRigidBodyConstructionInfo(0, nullptr, shape));
        if (!is_ours) ground_->setWorldTransform(field_.place);
        world_.addRigidBody(ground_.get());
        for (std::size_t i = 0; i < drop.places.size(); ++i) {
            shapes_.push_back(make_bullet_shape(drop.shapes[i]));
            btVector3 inertia(0, 0, 0);
            shapes_.back()->calculateLocalInertia(100, inertia);
            bodies_.push_back(
                std::make_unique<btRigidBody>(btRigidBody::btRigidBodyConstructionInfo(
                    100, nullptr, shapes_.back().get(), inertia)));
            Pose pose;
            pose.translation = drop.places[i];
            bodies_.back()->setWorldTransform(to_bullet(pose));
            bodies_.back()->setAngularVelocity(to_bullet(drop.spins[i]));
            bodies_.back()->setActivationState(DISABLE_DEACTIVATION);
            world_.addRigidBody(bodies_.back().get());
        }
    }
    ~BulletBodiesOnGround() {
        for (const auto& body : bodies_) world_.removeRigidBody(body.get());
        world_.removeRigidBody(ground_.get());
    }
    BulletBodiesOnGround(const BulletBodiesOnGround&) = delete;
    BulletBodiesOnGround& operator=(const BulletBodiesOnGround&) = delete;

    void step() {
        if (is_ours_) keeper_.hold(world_, ours_, 1.0 / 60.0);
        world_.stepSimulation(btScalar(1.0 / 60.0), 0);
    }
    std::size_t below() const {
        std::size_t count = 0;
        for (const auto& body : bodies_) {
            const btVector3 p = body->getWorldTransform().getOrigin();
            if (map_.is_below({double(p.x()), double(p.y()), double(p.z())})) ++count;
        }
        return count;
    }

private:
    const ContactMap& map_;
    bool is_ours_;
    BulletGround field_{map_.table};
    adapters::BulletGround ours_;
    adapters::BulletBodies keeper_;
    btDefaultCollisionConfiguration configuration_;
    btCollisionDispatcher dispatcher_{&configuration_};
    std::optional<adapters::BulletContacts> contacts_;
    btDbvtBroadphase broadphase_;
    btSequentialImpulseConstraintSolver solver_;
    btDiscreteDynamicsWorld world_;
    std::unique_ptr<btRigidBody> ground_;
    std::vector<std::unique_ptr<btConvexShape>> shapes_;
    std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

void measure(bool is_quick) {
    const ContactMap map = make_contact_map(is_quick ? 513 : 1025, 1.0);
    const std::size_t count = is_quick ? 20 : 1000;
    const int steps = is_quick ? 20 : 300;
    for (const DropKind& kind : drop_kinds()) {
        const AdapterDrop drop = lay_out_adapter_drop(map, kind, count);
        BulletBodiesOnGround ours(map, drop, true, true), theirs(map, drop, false, false);
        compare_steps(bullet_name().c_str(), kind.name, count, steps, ours, theirs);
    }
    const AdapterDrop drop = lay_out_adapter_drop(map, drop_kinds().back(), count);
    BulletBodiesOnGround ours(map, drop, true, false), theirs(map, drop, false, false);
    std::printf("by triangles alone, without BulletContacts:\n");
    compare_steps(bullet_name().c_str(), "mixed", count, steps, ours, theirs);
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    terrane::bench::Arguments arguments(argc, argv, "bullet_adapter_benchmark [--quick]");
    const bool is_quick = arguments.has("--quick");
    arguments.finish();
    terrane::bench::measure(is_quick);
    return 0;
}
