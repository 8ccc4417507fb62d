// SPDX-License-Identifier: MIT
// Deviation from the sources: the volume is a pyramid without a near plane, in general infinite. As a convex polyhedron
// with few faces it is treated like any other: the axes that can separate it from a box are its own normals, those of
// the box, and products of their edges (the facets of their Minkowski difference).
#include "base/vector_math.h"
#include "culling/extents.h"

#include <terrane/scene/view_volume.h>
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
using internal::rotated;

// Tolerance of comparisons, relative to the sum of the distance from the eye, the size of the bounding volume and the
// far distance. Rounding errors are below 2^-50 of this sum.
constexpr double kViewMargin = 1e-14;
constexpr int kFarPlane = PlaneState::kFarPlane;

}  // namespace

// A box relative to the eye.
struct ViewVolume::LocalBox {
    Eigen::Vector3d centre;
    std::array<Eigen::Vector3d, 3> axes;
    Eigen::Vector3d half_extents;

    double reach(const Eigen::Vector3d& axis) const {
        return std::abs(dot(axis, axes[0])) * half_extents[0] +
               std::abs(dot(axis, axes[1])) * half_extents[1] +
               std::abs(dot(axis, axes[2])) * half_extents[2];
    }
    double size() const { return norm1(half_extents); }
};

ViewVolume::ViewVolume(const View& view, double far_distance) : eye_(view.eye_world) {
    TERRANE_ASSERT(check(view).has_value(), "the view must be valid");
    TERRANE_ASSERT(far_distance > 0.0, "far_distance must be > 0");
    const Frustum frustum = make_frustum(view);
    for (std::size_t i = 0; i < 4; ++i) normals_[i] = frustum.normals[i];
    normals_[kFarPlane] = -view.forward;
    if (std::isfinite(far_distance)) {
        plane_count_ = 5;
        far_ = far_distance;
    }
    // Around the picture: left and bottom, bottom and right, right and top, top and left.
    const std::array<std::array<std::size_t, 2>, 4> pairs = {{{0, 2}, {2, 1}, {1, 3}, {3, 0}}};
    for (std::size_t i = 0; i < 4; ++i) {
        Eigen::Vector3d edge = cross(normals_[pairs[i][0]], normals_[pairs[i][1]]);
        if (dot(edge, view.forward) < 0.0) edge = -edge;
        edges_[i] = edge / length(edge);
        far_corners_[i] = edges_[i] * (far_ / dot(edges_[i], view.forward));
    }
    sides_ = {view.right(), view.up};
}

double ViewVolume::inward(int plane, const Eigen::Vector3d& p) const {
    const double along = dot(normals_[static_cast<std::size_t>(plane)], p);
    return plane == kFarPlane ? along + far_ : along;
}

// extent(normal): largest distance of a point of the bounding volume from its centre along a normal.
template <class Extent>
Containment ViewVolume::test(const Eigen::Vector3d& centre_eye, double size, const Extent& extent,
                             PlaneState& state) const {
    const double margin =
        kViewMargin * (norm1(centre_eye) + size + (plane_count_ > kFarPlane ? far_ : 0.0));
    std::uint32_t left = state.mask & ((1u << plane_count_) - 1u);
    std::uint32_t crossed = 0;
    for (int plane = state.first; left != 0;) {
        const std::uint32_t bit = 1u << plane;
        if ((left & bit) != 0) {
            left &= ~bit;
            const double at = inward(plane, centre_eye);
            const double reach = extent(normals_[static_cast<std::size_t>(plane)]) + margin;
            if (!(at >= -reach)) {
                if (std::isnan(at)) return Containment::intersecting;
                state.first = static_cast<std::uint8_t>(plane);
                return Containment::outside;
            }
            if (!(at >= reach)) crossed |= bit;
        }
        plane = plane + 1 < plane_count_ ? plane + 1 : 0;
    }
    state.mask = static_cast<std::uint8_t>(crossed);
    return crossed == 0 ? Containment::inside : Containment::intersecting;
}

Containment ViewVolume::test_planes(const BoundingSphere& ball_world, PlaneState& state) const {
    return test(
        ball_world.centre - eye_, ball_world.radius,
        [&](const Eigen::Vector3d&) { return ball_world.radius; }, state);
}

Containment ViewVolume::test_planes(const Aabb& box_world, PlaneState& state) const {
    const Eigen::Vector3d low = box_world.low - eye_, high = box_world.high - eye_;
    const Eigen::Vector3d half = 0.5 * (high - low);
    return test(
        0.5 * (low + high), norm1(half),
        [&](const Eigen::Vector3d& normal) { return reach_along(normal, half); }, state);
}

Containment ViewVolume::test_planes(const OrientedBox& box_world, PlaneState& state) const {
    const Eigen::Matrix3d& rotation = box_world.frame_from_box.rotation;
    const LocalBox box = {box_world.frame_from_box.translation - eye_,
                          {rotation.col(0), rotation.col(1), rotation.col(2)},
                          box_world.half_extents};
    return test(
        box.centre, box.size(), [&](const Eigen::Vector3d& normal) { return box.reach(normal); },
        state);
}

// Whether a point is on the inner side of all planes but one, up to rounding.
bool ViewVolume::is_inside_but(int plane, const Eigen::Vector3d& p_eye) const {
    const double margin = kViewMargin * (norm1(p_eye) + far_);
    for (int i = 0; i < plane_count_; ++i) {
        if (i != plane && !(inward(i, p_eye) >= -margin)) return false;
    }
    return true;
}

// The nearest point of the volume is the point itself, or on a face (where the point's projection is in it), or on an
// edge: the smallest of these.
double ViewVolume::squared_distance(const Eigen::Vector3d& p_eye) const {
    if (is_inside_but(-1, p_eye)) return 0.0;
    double least = dot(p_eye, p_eye);  // the apex
    for (int plane = 0; plane < plane_count_; ++plane) {
        const double at = inward(plane, p_eye);
        if (!(at < 0.0) || !(at * at < least)) continue;
        const Eigen::Vector3d on_plane = p_eye - normals_[static_cast<std::size_t>(plane)] * at;
        if (is_inside_but(plane, on_plane)) least = at * at;
    }
    const bool has_far = plane_count_ > kFarPlane;
    for (std::size_t i = 0; i < 4; ++i) {
        const double longest = has_far ? length(far_corners_[i]) : internal::kInfinity;
        const double along = std::clamp(dot(p_eye, edges_[i]), 0.0, longest);
        const Eigen::Vector3d apart = p_eye - edges_[i] * along;
        least = std::min(least, dot(apart, apart));
        if (!has_far) continue;
        const Eigen::Vector3d side = far_corners_[(i + 1) % 4] - far_corners_[i];
        const double share =
            std::clamp(dot(p_eye - far_corners_[i], side) / dot(side, side), 0.0, 1.0);
        const Eigen::Vector3d from_side = p_eye - far_corners_[i] - side * share;
        least = std::min(least, dot(from_side, from_side));
    }
    return least;
}

bool ViewVolume::meets(const BoundingSphere& ball_world) const {
    const Eigen::Vector3d centre = ball_world.centre - eye_;
    const double reach =
        ball_world.radius + kViewMargin * (norm1(centre) + ball_world.radius + far_);
    return !(squared_distance(centre) > reach * reach);
}

// Whether the plane square to the axis through the volume's extreme point separates the two. The volume is infinite
// along its edges where it has no far plane.
bool ViewVolume::is_separated(const LocalBox& box, const Eigen::Vector3d& axis) const {
    const double squared = dot(axis, axis);
    // Products of nearly parallel edges have no direction beyond rounding; others cover them.
    if (!(squared > 1e-20)) return false;
    const double norm = std::sqrt(squared);
    const double at = dot(axis, box.centre);
    const double reach =
        box.reach(axis) + kViewMargin * norm * (norm1(box.centre) + box.size() + far_);
    double low = 0.0, high = 0.0;  // of the volume, along the axis; 0 is the apex
    for (std::size_t i = 0; i < 4; ++i) {
        if (plane_count_ > kFarPlane) {
            const double corner = dot(axis, far_corners_[i]);
            low = std::min(low, corner);
            high = std::max(high, corner);
        } else {
            const double slope = dot(axis, edges_[i]);
            const double rounding = kViewMargin * norm;
            if (slope > rounding) high = internal::kInfinity;
            if (slope < -rounding) low = -internal::kInfinity;
        }
    }
    return at - reach > high || at + reach < low;
}

bool ViewVolume::meets(const LocalBox& box) const {
    for (int plane = 0; plane < plane_count_; ++plane) {
        const Eigen::Vector3d& normal = normals_[static_cast<std::size_t>(plane)];
        const double margin = kViewMargin * (norm1(box.centre) + box.size() + far_);
        if (inward(plane, box.centre) < -(box.reach(normal) + margin)) return false;
    }
    for (const Eigen::Vector3d& axis : box.axes) {
        if (is_separated(box, axis)) return false;
    }
    for (const Eigen::Vector3d& axis : box.axes) {
        for (const Eigen::Vector3d& edge : edges_) {
            if (is_separated(box, cross(axis, edge))) return false;
        }
        if (plane_count_ <= kFarPlane) continue;
        for (const Eigen::Vector3d& side : sides_) {
            if (is_separated(box, cross(axis, side))) return false;
        }
    }
    return true;
}

bool ViewVolume::meets(const Aabb& box_world) const {
    const Eigen::Vector3d low = box_world.low - eye_, high = box_world.high - eye_;
    return meets(
        LocalBox{0.5 * (low + high),
                 {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()},
                 0.5 * (high - low)});
}

bool ViewVolume::meets(const OrientedBox& box_world) const {
    const Eigen::Matrix3d& rotation = box_world.frame_from_box.rotation;
    return meets(LocalBox{box_world.frame_from_box.translation - eye_,
                          {rotation.col(0), rotation.col(1), rotation.col(2)},
                          box_world.half_extents});
}

// Clips the triangle by each plane in turn (I. Sutherland, G. Hodgman. Reentrant Polygon Clipping. CACM 17(1), 1974);
// corners within the margin of a plane count as inside.
bool ViewVolume::meets_triangle(const std::array<Eigen::Vector3d, 3>& corners_eye) const {
    std::array<Eigen::Vector3d, 8> polygon, clipped;
    std::size_t count = 3;
    double size = far_;
    for (std::size_t i = 0; i < 3; ++i) {
        polygon[i] = corners_eye[i];
        size = std::max(size, norm1(corners_eye[i]));
    }
    const double margin = kViewMargin * size;
    for (int plane = 0; plane < plane_count_; ++plane) {
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const Eigen::Vector3d& a = polygon[i];
            const Eigen::Vector3d& b = polygon[(i + 1) % count];
            const double at_a = inward(plane, a) + margin, at_b = inward(plane, b) + margin;
            if (at_a >= 0.0) clipped[kept++] = a;
            if ((at_a >= 0.0) != (at_b >= 0.0))
                clipped[kept++] = a + (b - a) * (at_a / (at_a - at_b));
        }
        if (kept == 0) return false;
        std::copy_n(clipped.begin(), kept, polygon.begin());
        count = kept;
    }
    return true;
}

bool ViewVolume::meets_triangles(const Pose& world_from_object, double scale,
                                 std::span<const Eigen::Vector3d> positions,
                                 std::span<const TriangleMesh::Triangle> triangles) const {
    // Everything is relative to the eye.
    const Eigen::Vector3d origin = world_from_object.translation - eye_;
    const Eigen::Matrix3d rotation = scale * world_from_object.rotation;
    for (const TriangleMesh::Triangle& t : triangles) {
        std::array<Eigen::Vector3d, 3> corners;
        for (std::size_t i = 0; i < 3; ++i)
            corners[i] = rotated(rotation, positions[t[i]]) + origin;
        if (meets_triangle(corners)) return true;
    }
    return false;
}

}  // namespace terrane
