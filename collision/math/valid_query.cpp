// SPDX-License-Identifier: MIT
#include "math/valid_query.h"

#include "base/vector_math.h"

#include <terrane/terrain/lattice.h>

#include <cmath>

namespace terrane::internal {
namespace {

/// False for NaN.
bool is_within(const Eigen::Vector3d& value, double limit) {
    return std::abs(value[0]) <= limit && std::abs(value[1]) <= limit &&
           std::abs(value[2]) <= limit;
}

}  // namespace

bool is_valid_place(const WorldPos& point_world) { return is_within(point_world, kFarthestPlace); }

bool is_valid_query(const Shape& shape, const Pose& pose) {
    constexpr double kOrthonormal = 1e-6;
    if (!check(shape) || !is_valid_place(pose.translation)) return false;
    const Eigen::Matrix3d& m = pose.rotation;
    return is_finite(m.col(0)) && is_finite(m.col(1)) && is_finite(m.col(2)) &&
           column_error(m) <= kOrthonormal && determinant(m) > 0.0;
}

bool is_valid_query(const Shape& shape, const Motion& motion) {
    return is_valid_query(shape, motion.start) && is_valid_place(motion.translation) &&
           is_within(motion.rotation_vector, kMostRotation);
}

bool is_resolved(const Motion& motion, double tolerance) {
    // Neighbouring doubles at x are at most 2^-52 x apart.
    const double limit = 0x1p50 * tolerance;
    return is_within(motion.start.translation, limit) &&
           is_within(motion.start.translation + motion.translation, limit);
}

}  // namespace terrane::internal
