// SPDX-License-Identifier: MIT
#include "math/valid_query.h"

#include "base/vector_math.h"

namespace terrane::internal {

bool is_valid_query(const Shape& shape, const Pose& pose) {
    constexpr double kOrthonormal = 1e-6;
    if (!check(shape) || !is_finite(pose.translation)) return false;
    const Eigen::Matrix3d& m = pose.rotation;
    return is_finite(m.col(0)) && is_finite(m.col(1)) && is_finite(m.col(2)) &&
           column_error(m) <= kOrthonormal && determinant(m) > 0.0;
}

}  // namespace terrane::internal
