// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>

#include <array>

namespace terrane {

/// Largest absolute coordinate of a viewpoint, metres: squared distances fit into single precision.
inline constexpr double kFarthestEye = 0x1p60;
/// Least vertical field of view, radians, and the least amount by which it is smaller than pi.
inline constexpr double kLeastFieldOfView = 1e-6;

/// What a camera sees.
struct View {
    WorldPos eye_world = WorldPos::Zero();               ///< viewpoint, within kFarthestEye
    Eigen::Vector3d forward = Eigen::Vector3d::UnitY();  ///< unit length
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();       ///< unit length, perpendicular to forward
    double vertical_fov =
        1.0471975511965976;  ///< radians, kLeastFieldOfView to pi - kLeastFieldOfView
    int width_px = 1280;     ///< of the picture
    int height_px = 720;     ///< of the picture
    /// Metres. Screen errors of nearer points are computed for this distance.
    double near_distance = 1.0;

    /// Unit vector to the right of the picture.
    Eigen::Vector3d right() const;
    /// Pixels per radian at the picture's centre: height_px / (2 tan(vertical_fov / 2)).
    double pixels_per_radian() const;

    /// Matrix from world axes, relative to eye_world, to eye axes: x right, y up, z backward. [4][4] column-major, as
    /// OpenGL reads it. It has no translation: subtract eye_world from a position in double, or in integers of the
    /// lattice, before the difference is converted to float.
    std::array<float, 16> view_matrix() const;
    /// Perspective matrix from eye axes to OpenGL's clip space: depth -1 at near_plane, 1 at far_plane. [4][4]
    /// column-major.
    ///
    /// @param near_plane, far_plane distances along `forward`, metres, 0 < near_plane < far_plane; far_plane may be
    ///     infinite
    std::array<float, 16> projection_matrix(double near_plane, double far_plane) const;

    /// Fails: invalid_argument, naming the field, for a view that is out of range or not finite
    Result<void> validate() const;
};

/// A view from an eye to a point. If it looks straight up or down, `up` is north.
/// Fails: invalid_argument if eye and target coincide, the field of view or the eye is out of range, the size is not
/// positive, or anything is not finite.
Result<View> look_at(const WorldPos& eye_world, const WorldPos& target_world, double vertical_fov,
                     int width_px, int height_px);

/// Unit direction from the eye through a point of the picture, in world axes.
///
/// @param x_px, y_px from the left and the top edge; pixel i spans i to i + 1. May be outside the picture
Eigen::Vector3d direction_through(const View& view, double x_px, double y_px);

/// The four side planes of a view, all through the eye. A point p is inside if normals[i].dot(p - eye) >= 0 for all
/// four. Normals have unit length.
struct Frustum {
    std::array<Eigen::Vector3d, 4> normals;  ///< left, right, bottom, top
};
Frustum make_frustum(const View& view);  ///< requires a finite view

}  // namespace terrane
