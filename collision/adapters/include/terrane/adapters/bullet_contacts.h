// SPDX-License-Identifier: MIT
#pragma once

// Contacts of Bullet's spheres, capsules and boxes (also as parts of compounds) with a BulletGround, found by Terrane's
// find_contacts() instead of Bullet's per-triangle algorithm:
// - normals lie in the ground's normal cone: no ghost contacts at flat or concave edges or at chunk borders;
// - the ground is solid below the surface: a body at any depth has a contact that pushes it out;
// - a box keeps its full size: Bullet's margin does not round its corners.
// Other shapes (hulls, cylinders, cones, meshes), casts and continuous collision use Bullet's own algorithm over the
// triangles, with its ghost contacts.
//
// Units, frame, absent ground, threads: see bullet_ground.h. Usable with btCollisionDispatcherMt like Bullet's own
// algorithms.

#include <terrane/adapters/bullet_ground.h>
#include <terrane/adapters/sphere_contacts.h>

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btConvexConcaveCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <new>

namespace terrane::adapters {

/// The collision algorithm of one pair, created by BulletContacts.
class BulletGroundAlgorithm final : public btCollisionAlgorithm {
public:
    /// @param is_swapped whether the ground is body 0
    BulletGroundAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                          const btCollisionObjectWrapper* body0,
                          const btCollisionObjectWrapper* body1, bool is_swapped)
        : btCollisionAlgorithm(info), is_swapped_(is_swapped) {
        const auto* const convex = is_swapped ? body1 : body0;
        const auto* const ground = is_swapped ? body0 : body1;
        manifold_ = m_dispatcher->getNewManifold(convex->getCollisionObject(),
                                                 ground->getCollisionObject());
    }
    BulletGroundAlgorithm(const BulletGroundAlgorithm&) = delete;
    BulletGroundAlgorithm& operator=(const BulletGroundAlgorithm&) = delete;
    ~BulletGroundAlgorithm() override { m_dispatcher->releaseManifold(manifold_); }

    /// Finds the contacts of the pair and brings its manifold up to date.
    void processCollision(const btCollisionObjectWrapper* body0,
                          const btCollisionObjectWrapper* body1, const btDispatcherInfo&,
                          btManifoldResult* result) override {
        const btCollisionObjectWrapper& convex = is_swapped_ ? *body1 : *body0;
        const btCollisionObjectWrapper& other = is_swapped_ ? *body0 : *body1;
        const auto& shape = static_cast<const BulletGround&>(*other.getCollisionShape());
        result->setPersistentManifold(manifold_);
        if (shape.ground() == nullptr) {
            manifold_->clearManifold();
            return;
        }
        const btTransform& world_from_ground = other.getWorldTransform();
        const btTransform ground_from_convex =
            world_from_ground.inverseTimes(convex.getWorldTransform());
        std::array<Contact, kMostContacts> contacts;
        const Pose pose = pose_of(*convex.getCollisionShape(), ground_from_convex, shape);
        const ContactAnswer answer = find(*convex.getCollisionShape(), pose, shape, contacts);
        if (answer.status == QueryStatus::invalid) {
            shape.report_refused();
            manifold_->clearManifold();
            return;
        }
        if (answer.status == QueryStatus::not_resident)
            shape.report_absent({pose.translation, pose.translation});

        std::array<btVector3, kMostContacts> points;  // on the convex shape, in Bullet's world
        for (std::size_t i = 0; i < answer.count; ++i)
            points[i] = world_from_ground * shape.to_shape(contacts[i].point_world);
        forget_others(convex, points.data(), answer.count);
        for (std::size_t i = answer.count; i-- > 0;) {  // deepest last: Bullet keeps four points
            const btVector3 normal =
                world_from_ground.getBasis() * BulletGround::to_bullet(contacts[i].normal);
            const auto depth = static_cast<btScalar>(contacts[i].depth);
            // the normal points out of the manifold's second body: the ground, even if the pair is swapped
            result->addContactPoint(normal, points[i] + normal * depth, -depth);
        }
        result->refreshContactPoints();
    }

    /// Returns 1: continuous collision is left to Bullet's casts.
    btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                   btManifoldResult*) override {
        return btScalar(1);
    }
    /// Adds the pair's manifold to a list.
    void getAllContactManifolds(btManifoldArray& manifolds) override {
        manifolds.push_back(manifold_);
    }

    /// Whether this algorithm handles a shape type.
    static bool handles(int shape_type) {
        return shape_type == SPHERE_SHAPE_PROXYTYPE || shape_type == CAPSULE_SHAPE_PROXYTYPE ||
               shape_type == BOX_SHAPE_PROXYTYPE;
    }

private:
    static constexpr std::size_t kMostContacts = 32;

    static Shape shape_of(const btCollisionShape& shape) {
        if (shape.getShapeType() == SPHERE_SHAPE_PROXYTYPE)
            return Sphere{
                static_cast<double>(static_cast<const btSphereShape&>(shape).getRadius())};
        if (shape.getShapeType() == CAPSULE_SHAPE_PROXYTYPE) {
            const auto& capsule = static_cast<const btCapsuleShape&>(shape);
            return Capsule{static_cast<double>(capsule.getRadius()),
                           static_cast<double>(capsule.getHalfHeight())};
        }
        const btVector3 half = static_cast<const btBoxShape&>(shape).getHalfExtentsWithMargin();
        return Box{{half.x(), half.y(), half.z()}};
    }

    // World from shape, orthonormal in double; a capsule's axis becomes z.
    static Pose pose_of(const btCollisionShape& shape, const btTransform& ground_from_shape,
                        const BulletGround& ground) {
        const btQuaternion q = ground_from_shape.getRotation();
        Pose pose;
        pose.rotation =
            Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).normalized().toRotationMatrix();
        pose.translation = ground.to_world(ground_from_shape.getOrigin());
        if (shape.getShapeType() == CAPSULE_SHAPE_PROXYTYPE) {
            const int up = static_cast<const btCapsuleShape&>(shape).getUpAxis();
            const Eigen::Matrix3d turn = pose.rotation;
            for (int i = 0; i < 3; ++i) pose.rotation.col(i) = turn.col((up + 1 + i) % 3);
        }
        return pose;
    }

    ContactAnswer find(const btCollisionShape& convex, const Pose& pose, const BulletGround& ground,
                       std::span<Contact> contacts_out) const {
        const auto margin = static_cast<double>(manifold_->getContactBreakingThreshold());
        if (convex.getShapeType() == SPHERE_SHAPE_PROXYTYPE) {
            const auto radius =
                static_cast<double>(static_cast<const btSphereShape&>(convex).getRadius());
            const auto answer = find_sphere_contacts(*ground.ground(), pose.translation, radius,
                                                     margin, contacts_out);
            if (answer) return *answer;
        }
        return find_contacts(shape_of(convex), pose, *ground.ground(), margin, contacts_out);
    }

    // Removes points of the manifold that have no new contact nearby: they were on other triangles.
    void forget_others(const btCollisionObjectWrapper& convex, const btVector3* points,
                       std::size_t count) {
        const btTransform& body = convex.getCollisionObject()->getWorldTransform();
        const btScalar near = manifold_->getContactBreakingThreshold();
        for (int i = manifold_->getNumContacts(); i-- > 0;) {
            const btVector3 old = body * manifold_->getContactPoint(i).m_localPointA;
            bool is_kept = false;
            for (std::size_t k = 0; k < count && !is_kept; ++k)
                is_kept = points[k].distance2(old) < near * near;
            if (!is_kept) manifold_->removeContactPoint(i);
        }
    }

    btPersistentManifold* manifold_ = nullptr;
    bool is_swapped_ = false;
};

/// Makes a dispatcher find the contacts of spheres, capsules and boxes with every BulletGround by Terrane's algorithm.
/// Other concave shapes keep Bullet's algorithm.
class BulletContacts {
public:
    /// Registers the algorithm with a dispatcher, which must not outlive this object.
    explicit BulletContacts(btCollisionDispatcher& dispatcher) {
        for (const int kind :
             {SPHERE_SHAPE_PROXYTYPE, CAPSULE_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE}) {
            dispatcher.registerCollisionCreateFunc(kind, BulletGround::kShapeType, &direct_);
            dispatcher.registerCollisionCreateFunc(BulletGround::kShapeType, kind, &swapped_);
        }
        swapped_.m_swapped = true;
    }
    BulletContacts(const BulletContacts&) = delete;
    BulletContacts& operator=(const BulletContacts&) = delete;

private:
    struct Create final : btCollisionAlgorithmCreateFunc {
        btCollisionAlgorithm* CreateCollisionAlgorithm(
            btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* body0,
            const btCollisionObjectWrapper* body1) override {
            const auto* const ground = m_swapped ? body0 : body1;
            const bool is_ours = BulletGround::is(*ground->getCollisionShape());
            void* const memory = info.m_dispatcher1->allocateCollisionAlgorithm(
                is_ours ? sizeof(BulletGroundAlgorithm)
                        : sizeof(btConvexConcaveCollisionAlgorithm));
            if (is_ours) return new (memory) BulletGroundAlgorithm(info, body0, body1, m_swapped);
            return new (memory) btConvexConcaveCollisionAlgorithm(info, body0, body1, m_swapped);
        }
    };
    Create direct_, swapped_;
};

}  // namespace terrane::adapters
