// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <array>

namespace terrane::tools {

/// w, x, y, z: the form of rotations in input and output.
using Quaternion = std::array<double, 4>;

/// The rotation of a quaternion of any length above 0.
Eigen::Matrix3d matrix_from_quaternion(const Quaternion& q);

/// The unit quaternion with w >= 0 of a rotation matrix.
Quaternion quaternion_from_matrix(const Eigen::Matrix3d& rotation);

}  // namespace terrane::tools
