// SPDX-License-Identifier: MIT
#include "math/valid_query.h"

#include "math/vector_math.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {

bool is_valid_query(const Shape& shape, const Pose& pose) {
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
