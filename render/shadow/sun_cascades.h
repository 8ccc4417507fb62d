// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/aabb.h>
#include <terrane/terrain/bounding_sphere.h>
#include <terrane/terrain/view.h>

#include <array>

namespace terrane::internal {

/// Cascades of the shadows. Each reaches kCascadeRatio times as far as the one before, the last as far as the shadows.
inline constexpr int kCascades = 3;
inline constexpr double kCascadeRatio = 4.0;

/// A square shadow map along the sun's direction: the part of the ground within a distance of the eye that the view
/// shows, as the sun sees it.
///
/// Side and orientation do not depend on where the view looks, and the map moves by whole texels: so its texels stay on
/// the same ground, and shadows do not swim.
struct SunCascade {
    Eigen::Matrix3d axes;    ///< rows: right, up and towards the sun, world axes
    Eigen::Vector3d centre;  ///< along these axes, metres
    double half_side = 0.0;  ///< metres, of the depths too
    double reach = 0.0;      ///< greatest distance of its receivers from the eye, metres

    /// Whether a caster with this bounding volume can cast a shadow into the map. Conservative: the map's volume is
    /// extended to the sun.
    bool meets(const Aabb& box_world) const;
    bool meets(const BoundingSphere& ball_world) const;

    /// Centre minus the eye along the axes.
    Eigen::Vector3d centre_from(const WorldPos& eye_world) const;
    /// Column-major. Depth is 1 nearest to the sun and 0 farthest.
    std::array<float, 16> clip_from_eye(const WorldPos& eye_world) const;
};

/// The cascades of a view, the nearest first.
///
/// @param sun_direction towards the sun, finite and not zero
/// @param distance      how far the shadows reach from the eye, metres, > 0
/// @param texels        along the side of each map
std::array<SunCascade, kCascades> make_sun_cascades(const View& view,
                                                    const Eigen::Vector3d& sun_direction,
                                                    double distance, int texels);

}  // namespace terrane::internal
