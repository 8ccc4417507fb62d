// SPDX-License-Identifier: MIT
#include "base/vector_math.h"

#include <terrane/base/text.h>
#include <terrane/terrain/view.h>

#include <cmath>
#include <numbers>
#include <string>

namespace terrane {
namespace {

using internal::tangent;

Eigen::Vector3d cross(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return {a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(),
            a.x() * b.y() - a.y() * b.x()};
}

Eigen::Vector3d unit(const Eigen::Vector3d& v) { return v / v.norm(); }

}  // namespace

Eigen::Vector3d View::right() const { return cross(forward, up); }

double View::pixels_per_radian() const {
    return static_cast<double>(height_px) / (2.0 * tangent(0.5 * vertical_fov));
}

std::array<float, 16> View::view_matrix() const {
    std::array<float, 16> matrix{};
    const Eigen::Vector3d axes[3] = {right(), up, -forward};
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 3; ++column)
            matrix[4 * column + row] = static_cast<float>(axes[row][static_cast<int>(column)]);
    }
    matrix[15] = 1.0f;
    return matrix;
}

std::array<float, 16> View::projection_matrix(double near_plane, double far_plane) const {
    const double scale = 2.0 * pixels_per_radian() / height_px;  // 1 / tan(vertical_fov / 2)
    const double ratio = near_plane / far_plane;                 // 0 for an infinite far plane
    std::array<float, 16> matrix{};
    matrix[0] = static_cast<float>(scale * height_px / width_px);
    matrix[5] = static_cast<float>(scale);
    matrix[10] = static_cast<float>(-(1.0 + ratio) / (1.0 - ratio));
    matrix[11] = -1.0f;
    matrix[14] = static_cast<float>(-2.0 * near_plane / (1.0 - ratio));
    return matrix;
}

Result<void> View::validate() const {
    const auto refuse = [](const std::string& message) -> Result<void> {
        return fail(ErrorCode::invalid_argument, message);
    };
    for (const double coordinate : {eye_world.x(), eye_world.y(), eye_world.z()}) {
        if (!(std::abs(coordinate) <= kFarthestEye)) {
            return refuse("the eye must be within 2^60 m of 0 along each axis, got " +
                          number_text(coordinate));
        }
    }
    if (!forward.allFinite() || std::abs(forward.norm() - 1.0) > 1e-6) {
        return refuse("forward must have unit length, got " + number_text(forward.norm()));
    }
    if (!up.allFinite() || std::abs(up.norm() - 1.0) > 1e-6 || std::abs(up.dot(forward)) > 1e-6) {
        return refuse("up must have unit length and be square to forward, got length " +
                      number_text(up.norm()) + " and cosine " + number_text(up.dot(forward)));
    }
    if (!(vertical_fov >= kLeastFieldOfView &&
          vertical_fov <= std::numbers::pi - kLeastFieldOfView)) {
        return refuse("the vertical field of view must be 1e-06 to pi - 1e-06, got " +
                      number_text(vertical_fov));
    }
    if (width_px < 1 || height_px < 1) {
        return refuse("the picture must have at least 1 x 1 pixels, got " +
                      std::to_string(width_px) + " x " + std::to_string(height_px));
    }
    if (!(near_distance > 0.0) || !std::isfinite(near_distance)) {
        return refuse("near_distance must be > 0 m, got " + number_text(near_distance));
    }
    return {};
}

Eigen::Vector3d direction_through(const View& view, double x_px, double y_px) {
    const double right = x_px - 0.5 * static_cast<double>(view.width_px);
    const double up = 0.5 * static_cast<double>(view.height_px) - y_px;
    return unit(view.pixels_per_radian() * view.forward + right * view.right() + up * view.up);
}

Result<View> look_at(const WorldPos& eye_world, const WorldPos& target_world, double vertical_fov,
                     int width_px, int height_px) {
    View view;
    view.eye_world = eye_world;
    view.vertical_fov = vertical_fov;
    view.width_px = width_px;
    view.height_px = height_px;
    const Eigen::Vector3d displacement = target_world - eye_world;
    const double distance = displacement.norm();
    if (!(distance > 0.0) || !std::isfinite(distance)) {
        return fail(ErrorCode::invalid_argument,
                    "the eye and the point looked at must be finite and apart");
    }
    view.forward = displacement / distance;
    const bool is_vertical = std::abs(view.forward.x()) + std::abs(view.forward.y()) < 1e-9;
    const Eigen::Vector3d hint =
        is_vertical ? Eigen::Vector3d(0.0, 1.0, 0.0) : Eigen::Vector3d(0.0, 0.0, 1.0);
    const Eigen::Vector3d right = unit(cross(view.forward, hint));
    view.up = unit(cross(right, view.forward));
    TERRANE_TRY(view.validate());
    return view;
}

Frustum make_frustum(const View& view) {
    const double half_height = tangent(0.5 * view.vertical_fov);
    const double half_width =
        half_height * static_cast<double>(view.width_px) / static_cast<double>(view.height_px);
    const Eigen::Vector3d right = view.right();
    // the inward normal of the plane through the eye that contains forward - inward * extent and the other axis
    const auto plane = [&](const Eigen::Vector3d& inward, double extent) {
        return Eigen::Vector3d(unit(inward + view.forward * extent));
    };
    return {{plane(right, half_width), plane(-right, half_width), plane(view.up, half_height),
             plane(-view.up, half_height)}};
}

}  // namespace terrane
