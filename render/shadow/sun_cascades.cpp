// SPDX-License-Identifier: MIT
//
// Sources: R. Dimitrov. Cascaded Shadow Maps. NVIDIA 2007 (cascades). M. Valient. Stable Rendering of Cascaded Shadow
//          Maps. ShaderX 6, 2008 (a map around a bounding sphere, moved by whole texels).
// Deviations: a cascade is for distances from the eye, not for depths along the view. So a turning eye changes neither
//          the map nor the cascade of a point.
#include "shadow/sun_cascades.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

// Margin around the receivers of a map, texels: snapping to whole texels takes half a texel, the rest is for the
// filter and the receiver's displacement (shadow.glsl).
constexpr double kBorderTexels = 4.0;

// Rows: right, up and towards the sun.
Eigen::Matrix3d axes_towards(const Eigen::Vector3d& direction) {
    const Eigen::Vector3d sun = direction / direction.norm();
    // the world axis that is farthest from the sun's direction
    int least = 0;
    sun.cwiseAbs().minCoeff(&least);
    Eigen::Vector3d right = Eigen::Vector3d::Unit(least).cross(sun);
    right /= right.norm();
    Eigen::Matrix3d axes;
    axes.row(0) = right;
    axes.row(1) = sun.cross(right);
    axes.row(2) = sun;
    return axes;
}

// The smallest sphere around the points of a cone with the apex at the eye that are within `reach` of it: distance of
// its centre along the cone's axis, and radius.
struct ConeSphere {
    double forward = 0.0, radius = 0.0;
};

ConeSphere sphere_around_cone(double half_angle_tangent, double reach) {
    const double cosine = 1.0 / std::sqrt(1.0 + half_angle_tangent * half_angle_tangent);
    // narrow: apex and rim are on the sphere; wide: the rim is a great circle of it
    if (half_angle_tangent <= 1.0) return {0.5 * reach / cosine, 0.5 * reach / cosine};
    return {reach * cosine, reach * cosine * half_angle_tangent};
}

}  // namespace

bool SunCascade::meets(const Aabb& box_world) const {
    const Eigen::Vector3d middle = 0.5 * (box_world.low + box_world.high);
    const Eigen::Vector3d half = 0.5 * (box_world.high - box_world.low);
    const Eigen::Vector3d from_centre = axes * middle - centre;
    const Eigen::Vector3d extent = axes.cwiseAbs() * half;
    return std::abs(from_centre.x()) <= half_side + extent.x() &&
           std::abs(from_centre.y()) <= half_side + extent.y() &&
           from_centre.z() >= -half_side - extent.z();
}

bool SunCascade::meets(const BoundingSphere& ball_world) const {
    const Eigen::Vector3d from_centre = axes * ball_world.centre - centre;
    const double limit = half_side + ball_world.radius;
    return std::abs(from_centre.x()) <= limit && std::abs(from_centre.y()) <= limit &&
           from_centre.z() >= -limit;
}

Eigen::Vector3d SunCascade::centre_from(const WorldPos& eye_world) const {
    return centre - axes * eye_world;
}

std::array<float, 16> SunCascade::clip_from_eye(const WorldPos& eye_world) const {
    const Eigen::Vector3d middle = centre_from(eye_world);
    std::array<float, 16> clip{};
    for (int column = 0; column < 3; ++column) {
        for (int row = 0; row < 3; ++row) {
            // depths are from 0 to 1, the others from -1 to 1
            const double scale = (row == 2 ? 0.5 : 1.0) / half_side;
            clip[static_cast<std::size_t>(4 * column + row)] =
                static_cast<float>(axes(row, column) * scale);
        }
    }
    clip[12] = static_cast<float>(-middle.x() / half_side);
    clip[13] = static_cast<float>(-middle.y() / half_side);
    clip[14] = static_cast<float>(0.5 - 0.5 * middle.z() / half_side);
    clip[15] = 1.0f;
    return clip;
}

std::array<SunCascade, kCascades> make_sun_cascades(const View& view,
                                                    const Eigen::Vector3d& sun_direction,
                                                    double distance, int texels) {
    const Eigen::Matrix3d axes = axes_towards(sun_direction);
    // of the cone through the picture's corners
    const double half_height = std::tan(0.5 * view.vertical_fov);
    const double tangent = half_height * std::hypot(1.0, 1.0 * view.width_px / view.height_px);
    std::array<SunCascade, kCascades> cascades;
    double reach = distance;
    for (int i = kCascades; i-- > 0; reach /= kCascadeRatio) {
        SunCascade& cascade = cascades[static_cast<std::size_t>(i)];
        const ConeSphere sphere = sphere_around_cone(tangent, reach);
        cascade.axes = axes;
        cascade.reach = reach;
        cascade.half_side = sphere.radius * texels / (texels - 2.0 * kBorderTexels);
        const double texel = 2.0 * cascade.half_side / texels;
        cascade.centre = axes * (view.eye_world + sphere.forward * view.forward);
        for (int axis = 0; axis < 2; ++axis)
            cascade.centre[axis] = texel * std::round(cascade.centre[axis] / texel);
    }
    return cascades;
}

}  // namespace terrane::internal
