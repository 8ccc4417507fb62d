// SPDX-License-Identifier: MIT
//
// Bullet's own height field, with the diagonals of contacts as ours; rays with its accelerator. A pose is queried with
// the algorithm that its world would run for the pair, kept between poses, with an empty manifold.
#include "benchmark/collision/bullet_shapes.h"
#include "benchmark/collision/contact_engine.h"

namespace terrane::bench {
namespace {

class BulletEngine final : public ContactEngine {
public:
    explicit BulletEngine(const test::HeightTable& table)
        : surface_(table), dispatcher_(&configuration_) {
        ground_.setCollisionShape(&surface_.field);
        ground_.setWorldTransform(surface_.place);
    }

    std::string name() const override { return bullet_name(); }
    // Its rays use another surface than its contacts: the diamonds are shifted by a cell.
    Cut cut_of_rays() const override {
        return [](int column, int row) { return !cut_to_north_east(column, row); };
    }
    Cut cut_of_contacts() const override { return cut_as_terrane; }

    double height(double x, double y) override {
        btTransform from = btTransform::getIdentity(), to = btTransform::getIdentity();
        from.setOrigin(to_bullet(WorldPos(x, y, kRayTop)));
        to.setOrigin(to_bullet(WorldPos(x, y, kRayBottom)));
        btCollisionWorld::ClosestRayResultCallback answer(from.getOrigin(), to.getOrigin());
        btCollisionWorld::rayTestSingle(from, to, &ground_, &surface_.field,
                                        ground_.getWorldTransform(), answer);
        return kRayTop + static_cast<double>(answer.m_closestHitFraction) * (kRayBottom - kRayTop);
    }

    bool contacts(const Shape& shape, std::span<const Pose> poses, double /*margin*/,
                  std::span<int> counts_out) override {
        const std::unique_ptr<btConvexShape> convex = make_bullet_shape(shape);
        if (!convex) return false;
        btCollisionObject body;
        body.setCollisionShape(convex.get());
        const btCollisionObjectWrapper body_wrap(nullptr, convex.get(), &body,
                                                 body.getWorldTransform(), -1, -1);
        const btCollisionObjectWrapper ground_wrap(nullptr, &surface_.field, &ground_,
                                                   ground_.getWorldTransform(), -1, -1);
        btCollisionAlgorithm* algorithm = dispatcher_.findAlgorithm(
            &body_wrap, &ground_wrap, nullptr, BT_CONTACT_POINT_ALGORITHMS);
        btManifoldArray manifolds;
        algorithm->getAllContactManifolds(manifolds);
        const btDispatcherInfo settings;
        for (std::size_t i = 0; i < poses.size(); ++i) {
            body.setWorldTransform(to_bullet(poses[i]));
            manifolds[0]->clearManifold();
            btManifoldResult result(&body_wrap, &ground_wrap);
            algorithm->processCollision(&body_wrap, &ground_wrap, settings, &result);
            counts_out[i] = manifolds[0]->getNumContacts();
        }
        algorithm->~btCollisionAlgorithm();
        dispatcher_.freeCollisionAlgorithm(algorithm);
        return true;
    }

    bool casts(const Shape& shape, std::span<const Sweep> sweeps,
               std::span<double> fractions_out) override {
        const std::unique_ptr<btConvexShape> convex = make_bullet_shape(shape);
        if (!convex) return false;
        for (std::size_t i = 0; i < sweeps.size(); ++i) {
            const btTransform from = to_bullet(sweeps[i].start);
            btTransform to = from;
            to.setOrigin(from.getOrigin() + to_bullet(sweeps[i].translation));
            btCollisionWorld::ClosestConvexResultCallback answer(from.getOrigin(), to.getOrigin());
            btCollisionWorld::objectQuerySingle(convex.get(), from, to, &ground_, &surface_.field,
                                                ground_.getWorldTransform(), answer, btScalar(0.0));
            fractions_out[i] =
                answer.hasHit() ? static_cast<double>(answer.m_closestHitFraction) : kNoHit;
        }
        return true;
    }

private:
    BulletGround surface_;
    btCollisionObject ground_;
    btDefaultCollisionConfiguration configuration_;
    btCollisionDispatcher dispatcher_;
};

}  // namespace

std::unique_ptr<ContactEngine> make_bullet_engine(const test::HeightTable& table) {
    return std::make_unique<BulletEngine>(table);
}

}  // namespace terrane::bench
