// SPDX-License-Identifier: MIT
// Common operations on vectors and poses with only Terrane's headers.
#include <terrane/terrain/view.h>

#include <cmath>
#include <cstdio>

int main() {
    using namespace terrane;
    const Result<View> view = look_at({0, 0, 10}, {0, 100, 10}, 1.0, 640, 480);
    if (!view) return 1;
    const Eigen::Vector3d right = view->forward.cross(view->up);
    const Eigen::Vector3d diagonal = (view->forward + right).normalized();

    // a quarter turn to the left about z: a rotation matrix in Terrane, a quaternion here
    const Eigen::AngleAxisd turn(0.5 * std::acos(-1.0), Eigen::Vector3d::UnitZ());
    Pose world_from_body;
    world_from_body.rotation = turn.toRotationMatrix();
    world_from_body.translation = {1, 2, 3};
    const Eigen::Quaterniond rotation(world_from_body.rotation);
    const Eigen::Isometry3d matrix = Eigen::Translation3d(world_from_body.translation) * rotation;
    const Eigen::Vector3d p_body(1, 0, 0);

    const double off = (right - view->right()).norm() +
                       std::abs(diagonal.dot(view->forward) - std::sqrt(0.5)) +
                       (matrix * p_body - world_from_body * p_body).norm() +
                       (rotation * p_body - Eigen::Vector3d::UnitY()).norm() +
                       (matrix.inverse() * Eigen::Vector3d(1, 3, 3) - p_body).norm();
    std::printf("off by %.1e\n", off);
    return off < 1e-12 ? 0 : 1;
}
