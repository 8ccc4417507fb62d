// SPDX-License-Identifier: MIT
#include "benchmark/collision/bullet_shapes.h"

#include <algorithm>

namespace terrane::bench {

std::string bullet_name() {
    return "Bullet " + std::to_string(btGetVersion() / 100) + "." +
           std::to_string(btGetVersion() % 100) +
           (sizeof(btScalar) == sizeof(double) ? " (double)" : " (single)");
}

btTransform to_bullet(const Pose& pose) {
    const Eigen::Matrix3d& r = pose.rotation;
    const auto at = [&](int row, int column) { return btScalar(r(row, column)); };
    const btMatrix3x3 turn(at(0, 0), at(0, 1), at(0, 2), at(1, 0), at(1, 1), at(1, 2), at(2, 0),
                           at(2, 1), at(2, 2));
    return btTransform(turn, to_bullet(pose.translation));
}

std::unique_ptr<btConvexShape> make_bullet_shape(const Shape& shape) {
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) {
        return std::make_unique<btSphereShape>(btScalar(sphere->radius));
    }
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
        return std::make_unique<btCapsuleShapeZ>(btScalar(capsule->radius),
                                                 btScalar(2.0 * capsule->half_height));
    }
    if (const Box* box = std::get_if<Box>(&shape)) {
        return std::make_unique<btBoxShape>(to_bullet(box->half_extents));
    }
    return nullptr;
}

BulletGround::BulletGround(const test::HeightTable& table)
    : field(table.columns, table.rows, table.heights.data(),
            btScalar(*std::min_element(table.heights.begin(), table.heights.end())),
            btScalar(*std::max_element(table.heights.begin(), table.heights.end())),
            /*upAxis=*/2, /*flipQuadEdges=*/false),
      place(btTransform::getIdentity()) {
    field.setUseDiamondSubdivision(true);
    field.setFlipTriangleWinding(true);  // else normals point down where z is up
    const auto spacing = btScalar(table.spacing);
    field.setLocalScaling({spacing, spacing, btScalar(1.0)});
    field.setMargin(btScalar(0.0));  // so that the surface is at the heights
    field.buildAccelerator();
    // its frame has its origin in the middle of the box around it
    const auto [low, high] = std::minmax_element(table.heights.begin(), table.heights.end());
    place.setOrigin({btScalar(0.5 * table.spacing * (table.columns - 1)),
                     btScalar(0.5 * table.spacing * (table.rows - 1)),
                     btScalar(0.5) * (btScalar(*low) + btScalar(*high))});
}

}  // namespace terrane::bench
