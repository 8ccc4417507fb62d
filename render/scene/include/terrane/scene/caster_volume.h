// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/view_volume.h>

#include <array>
#include <cstddef>

namespace terrane {

/// Where a renderer draws shadows, for scenes that give it the casters out of view.
struct SunShadows {
    /// Towards the sun, finite and not zero; of any length.
    Eigen::Vector3d sun_direction = Eigen::Vector3d::UnitZ();
    /// That shadows reach from the eye, metres; 0: no shadows.
    double distance = 0.0;
};

/// Whether direction and distance are in range: the distance above 0 and at most 1e9 m.
bool has_shadows(const SunShadows& shadows);

/// The set of points from which an object can cast a shadow into a view: those whose ray away from the sun meets the
/// points of the view within a distance. It is the convex hull of these points, extended without limit towards the sun.
///
/// Its planes are those of the view that still bound it, and those through an edge of the view along the sun's
/// direction. The tests are conservative, with a margin for rounding of 1e-11 of the distance from the eye: they keep
/// all bounding volumes that meet the set, and some near its edges that do not.
///
/// Threads: any number at once
class CasterVolume {
public:
    /// Requires a view that check() accepts, and has_shadows(shadows).
    CasterVolume(const View& view, const SunShadows& shadows);

    /// Whether a bounding volume has a point in the set.
    bool meets(const BoundingSphere& ball_world) const;
    /// The same of a box along the axes.
    bool meets(const Aabb& box_world) const;
    /// The same of a box with axes of its own.
    bool meets(const OrientedBox& box_world) const;

private:
    // The half-space of the points p with normal.dot(p - eye) >= least.
    struct Plane {
        Eigen::Vector3d normal;  // unit
        double least;
    };
    static constexpr std::size_t kMostPlanes = 13;  // 5 faces and 8 edges of the view

    void add(const Eigen::Vector3d& normal, double least);
    template <class Extent>
    bool meets(const Eigen::Vector3d& centre_eye, double size, const Extent& extent) const;

    WorldPos eye_;
    double size_ = 0.0;  // of the view within the distance, metres
    std::array<Plane, kMostPlanes> planes_;
    std::size_t plane_count_ = 0;
};

}  // namespace terrane
