// SPDX-License-Identifier: MIT
// Source: M. Stamminger, G. Drettakis. Perspective Shadow Maps. SIGGRAPH 2002 (casters are in the convex hull of the
//         receivers and the light).
// Deviation: a plane is any direction that does not turn away from the sun, through the extreme corner of the receivers
//            along it, so that no plane excludes a caster however the corners were rounded.
#include "base/vector_math.h"
#include "culling/extents.h"

#include <terrane/scene/caster_volume.h>
#include <terrane/terrain/assert.h>

#include <algorithm>
#include <cmath>

namespace terrane {
namespace {

using internal::cross;
using internal::dot;
using internal::length;
using internal::norm1;
using internal::reach_along;

// Tolerance of comparisons, relative to the sum of the distance from the eye and the sizes of both volumes.
constexpr double kCasterMargin = 1e-11;
// An edge whose sine with the sun's direction is smaller gives no plane: the direction of their product would have a
// relative rounding error near the margin.
constexpr double kLeastSine = 1e-4;
// An edge bounds the volume where both of its ends are within this share of the receivers' size of the extreme corner.
constexpr double kEdgeTolerance = 1e-9;

constexpr double kMostDistance = 1e9;

}  // namespace

bool has_shadows(const SunShadows& shadows) {
    const double sun_length = length(shadows.sun_direction);
    return std::isfinite(sun_length) && sun_length > 0.0 && shadows.distance > 0.0 &&
           shadows.distance <= kMostDistance;
}

CasterVolume::CasterVolume(const View& view, const SunShadows& shadows) : eye_(view.eye_world) {
    TERRANE_ASSERT(has_shadows(shadows), "direction and distance must be in range");
    const ViewVolume receivers(view, shadows.distance);
    const Eigen::Vector3d sun = shadows.sun_direction / length(shadows.sun_direction);
    // corners of the receivers relative to the eye: the eye itself, then those of the far plane in order around it
    std::array<Eigen::Vector3d, 5> corners;
    corners[0] = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
        corners[i + 1] = receivers.far_corners()[i];
        size_ = std::max(size_, norm1(corners[i + 1]));
    }
    const auto range_along = [&](const Eigen::Vector3d& normal) {
        double low = internal::kInfinity, high = -internal::kInfinity;
        for (const Eigen::Vector3d& corner : corners) {
            low = std::min(low, dot(normal, corner));
            high = std::max(high, dot(normal, corner));
        }
        return std::array{low, high};
    };
    for (const Eigen::Vector3d& normal : receivers.normals()) {
        // a plane that is left towards the sun does not bound the casters
        if (dot(normal, sun) >= 0.0) add(normal, range_along(normal)[0]);
    }
    for (std::size_t i = 0; i < 4; ++i) {
        const std::size_t next = (i + 1) % 4;
        for (const auto& [from, to] :
             {std::array{std::size_t{0}, i + 1}, std::array{i + 1, next + 1}}) {
            const Eigen::Vector3d edge = corners[to] - corners[from];
            const Eigen::Vector3d product = cross(edge, sun);
            const double norm = length(product);
            if (!(norm > kLeastSine * length(edge))) continue;
            const Eigen::Vector3d normal = product / norm;
            const auto [low, high] = range_along(normal);
            const double at_from = dot(normal, corners[from]), at_to = dot(normal, corners[to]);
            const double tolerance = kEdgeTolerance * size_;
            if (std::max(at_from, at_to) <= low + tolerance) add(normal, low);
            if (std::min(at_from, at_to) >= high - tolerance) add(-normal, -high);
        }
    }
}

void CasterVolume::add(const Eigen::Vector3d& normal, double least) {
    // both sides of all 8 edges bound a volume without thickness alone
    if (plane_count_ < kMostPlanes) planes_[plane_count_++] = {normal, least};
}

// extent(normal): largest distance of a point of the bounding volume from its centre along a normal.
template <class Extent>
bool CasterVolume::meets(const Eigen::Vector3d& centre_eye, double size,
                         const Extent& extent) const {
    const double margin = kCasterMargin * (norm1(centre_eye) + size + size_);
    for (std::size_t i = 0; i < plane_count_; ++i) {
        const Plane& plane = planes_[i];
        if (dot(plane.normal, centre_eye) + extent(plane.normal) < plane.least - margin)
            return false;
    }
    return true;
}

bool CasterVolume::meets(const BoundingSphere& ball_world) const {
    return meets(ball_world.centre - eye_, ball_world.radius,
                 [&](const Eigen::Vector3d&) { return ball_world.radius; });
}

bool CasterVolume::meets(const Aabb& box_world) const {
    const Eigen::Vector3d low = box_world.low - eye_, high = box_world.high - eye_;
    const Eigen::Vector3d half = 0.5 * (high - low);
    return meets(0.5 * (low + high), norm1(half),
                 [&](const Eigen::Vector3d& normal) { return reach_along(normal, half); });
}

bool CasterVolume::meets(const OrientedBox& box_world) const {
    const Pose& pose = box_world.frame_from_box;
    const Eigen::Vector3d& half = box_world.half_extents;
    return meets(pose.translation - eye_, norm1(half), [&](const Eigen::Vector3d& normal) {
        return reach_along(internal::rotated_back(pose.rotation, normal), half);
    });
}

}  // namespace terrane
