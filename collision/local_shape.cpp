// SPDX-License-Identifier: MIT
#include "local_shape.h"

#include <algorithm>

namespace terrane::internal {

Eigen::Vector3d LocalShape::deepest_point(const Eigen::Vector3d& n) const {
    // Below this cosine a feature counts as square to the direction.
    constexpr double kLevel = 1e-9;
    Eigen::Vector3d p = centre;
    if (!is_box) {
        const double along = dot(n, core);
        if (std::abs(along) > kLevel * length(core)) p += along > 0.0 ? -core : core;
        return p - radius * n;
    }
    for (int i = 0; i < 3; ++i) {
        const auto axis = static_cast<std::size_t>(i);
        const double along = dot(n, axes[axis]);
        if (std::abs(along) > kLevel) p += (along > 0.0 ? -half[i] : half[i]) * axes[axis];
    }
    return p;
}

LocalShape make_local_shape(const Shape& shape, const Eigen::Matrix3d& rotation) {
    LocalShape local;
    local.smallest = smallest_half_extent(shape);
    for (int i = 0; i < 3; ++i) local.axes[static_cast<std::size_t>(i)] = rotation.col(i);
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) {
        local.radius = sphere->radius;
    } else if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
        local.radius = capsule->radius;
        local.core = capsule->half_height * rotation.col(2);
    } else {
        local.is_box = true;
        local.half = std::get<Box>(shape).half_extents;
        for (std::size_t k = 0; k < 8; ++k) {
            local.corners[k] = ((k & 1) != 0 ? local.half[0] : -local.half[0]) * local.axes[0] +
                               ((k & 2) != 0 ? local.half[1] : -local.half[1]) * local.axes[1] +
                               ((k & 4) != 0 ? local.half[2] : -local.half[2]) * local.axes[2];
        }
    }
    for (int i = 0; i < 3; ++i) local.bounds[i] = local.extent(Eigen::Vector3d::Unit(i));
    return local;
}

bool is_usable(const Shape& shape, const Pose& pose) {
    constexpr double kOrthonormal = 1e-6;
    if (!check(shape) || !is_finite(pose.translation)) return false;
    const Eigen::Vector3d x = pose.rotation.col(0);
    const Eigen::Vector3d y = pose.rotation.col(1);
    const Eigen::Vector3d z = pose.rotation.col(2);
    const double worst =
        std::max({std::abs(dot(x, x) - 1.0), std::abs(dot(y, y) - 1.0), std::abs(dot(z, z) - 1.0),
                  std::abs(dot(x, y)), std::abs(dot(y, z)), std::abs(dot(z, x))});
    // Written so that NaN is refused.
    return is_finite(x) && is_finite(y) && is_finite(z) && worst <= kOrthonormal &&
           dot(cross(x, y), z) > 0.0;
}

}  // namespace terrane::internal
