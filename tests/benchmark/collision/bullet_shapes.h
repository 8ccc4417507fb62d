// SPDX-License-Identifier: MIT
#pragma once

#include "references/reference_maps.h"

#include <terrane/collision/shapes.h>

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <btBulletCollisionCommon.h>

#include <memory>
#include <string>

namespace terrane::bench {

inline btVector3 to_bullet(const Eigen::Vector3d& v) {
    return {btScalar(v.x()), btScalar(v.y()), btScalar(v.z())};
}

/// With version and precision.
std::string bullet_name();

btTransform to_bullet(const Pose& pose);

/// A sphere, a capsule or a box; null for others.
std::unique_ptr<btConvexShape> make_bullet_shape(const Shape& shape);

/// Bullet's own height field with the diamonds of the contact surface, a view of a table that must outlive it, and the
/// world position of its centre.
struct BulletGround {
    explicit BulletGround(const test::HeightTable& table);
    btHeightfieldTerrainShape field;
    btTransform place;
};

}  // namespace terrane::bench
