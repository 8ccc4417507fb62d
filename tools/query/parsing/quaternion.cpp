// SPDX-License-Identifier: MIT
//
// Sources:
//   S. Shepperd. Quaternion from Rotation Matrix. Journal of Guidance and Control 1, 1978
//   (divides by the largest component).
#include "query/parsing/quaternion.h"

#include <algorithm>
#include <cmath>

namespace terrane::tools {

Eigen::Matrix3d matrix_from_quaternion(const Quaternion& q) {
    const auto [w, x, y, z] = q;
    const double s = 2.0 / (w * w + x * x + y * y + z * z);
    Eigen::Matrix3d rotation;
    rotation(0, 0) = 1.0 - s * (y * y + z * z);
    rotation(0, 1) = s * (x * y - w * z);
    rotation(0, 2) = s * (x * z + w * y);
    rotation(1, 0) = s * (x * y + w * z);
    rotation(1, 1) = 1.0 - s * (x * x + z * z);
    rotation(1, 2) = s * (y * z - w * x);
    rotation(2, 0) = s * (x * z - w * y);
    rotation(2, 1) = s * (y * z + w * x);
    rotation(2, 2) = 1.0 - s * (x * x + y * y);
    return rotation;
}

Quaternion quaternion_from_matrix(const Eigen::Matrix3d& rotation) {
    const auto r = [&](int row, int column) { return rotation(row, column); };
    // four times the square of each component
    const std::array<double, 4> squares{
        1.0 + r(0, 0) + r(1, 1) + r(2, 2), 1.0 + r(0, 0) - r(1, 1) - r(2, 2),
        1.0 - r(0, 0) + r(1, 1) - r(2, 2), 1.0 - r(0, 0) - r(1, 1) + r(2, 2)};
    const auto largest = std::max_element(squares.begin(), squares.end()) - squares.begin();
    const double wx = r(2, 1) - r(1, 2);
    const double wy = r(0, 2) - r(2, 0);
    const double wz = r(1, 0) - r(0, 1);
    const double xy = r(1, 0) + r(0, 1);
    const double xz = r(0, 2) + r(2, 0);
    const double yz = r(2, 1) + r(1, 2);
    Quaternion q{};
    if (largest == 0) {
        q = {squares[0], wx, wy, wz};
    } else if (largest == 1) {
        q = {wx, squares[1], xy, xz};
    } else if (largest == 2) {
        q = {wy, xy, squares[2], yz};
    } else {
        q = {wz, xz, yz, squares[3]};
    }
    double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (q[0] < 0.0) length = -length;
    for (double& component : q) component /= length;
    return q;
}

}  // namespace terrane::tools
