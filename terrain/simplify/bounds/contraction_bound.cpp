// SPDX-License-Identifier: MIT
//
// Sources: J. Cohen, D. Manocha, M. Olano. Simplifying Polygonal Models Using Successive Mappings. IEEE
// Visualization 1997.
// Deviations: the removed vertex may have any image inside the polygon of its neighbours, because a map that is only
// onto is enough for a Hausdorff distance: so borders and triangles without area need no cases of their own. Half-edge
// contraction, hence no optimization of the new vertex. Where a map is not found the contraction is refused.
//
// The old triangles around u and the new ones around the target v are drawn in one plane: the same polygon of
// neighbours,
// with a fan from the image of u and a fan from v. A point of an old triangle maps to the new triangle over the same
// point of the plane. The displacement is affine on each cell of the overlay, so its extremes are at the cells'
// corners: the image of u, crossings of old with new spokes, and neighbours, where it is 0.
#include "simplify/bounds/contraction_bound.h"

#include "base/vector_math.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

// Height of a new triangle over its longest edge, unless a triangle that it replaces is worse.
constexpr double kMinShape = 0.02;
// Never worse than this: what is computed in the plane would be too inexact for kRounding.
constexpr double kMinShapeEver = 1e-3;
// Least cosine between a new triangle and the direction of projection, and between an old triangle and the new one in
// its place.
constexpr double kMinCosine = 0.2;

}  // namespace

// Twice the signed area.
double ContractionBound::area(const Point& a, const Point& b, const Point& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool ContractionBound::evaluate(std::uint32_t u, const Ring& ring, double limit) {
    if (ring.count < 3 || !set_frame(u, ring) || !are_new_triangles_good(ring) ||
        !is_image_inside(ring))
        return false;
    for (std::size_t i = 0; i < ring.count; ++i) {
        const double x = flat_[i].x - image_.x, y = flat_[i].y - image_.y;
        flat_length_[i] = std::sqrt(x * x + y * y);
    }
    error_ = 0.0;
    bool has_image = false;
    for (std::size_t k = 1; k + 1 < ring.count; ++k) {
        if (!find_corners(ring, k)) return false;
        has_image = has_image || corners_[3].spoke == kEverySpoke;
        bound_triangle(ring, k);
        error_ = std::max(error_, new_bounds_[k].largest());
        if (error_ > limit) return true;
    }
    return has_image;
}

bool ContractionBound::set_frame(std::uint32_t u, const Ring& ring) {
    const std::size_t count = ring.count;
    double square = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        ring_[i] = vertices_[ring.vertices[i]] - vertices_[u];
        square = std::max(square, dot(ring_[i], ring_[i]));
    }
    size_ = 2.0 * std::sqrt(square);
    // The polygon's area vector: the sum over the new triangles, and over the old ones too where u is inside.
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 1; i + 1 < count; ++i)
        sum += cross(ring_[i] - ring_[0], ring_[i + 1] - ring_[0]);
    const double length_of_sum = length(sum);
    if (!(length_of_sum > 1e-12 * square)) return false;
    direction_ = sum / length_of_sum;
    const Eigen::Vector3d x = any_tangent(direction_), y = cross(direction_, x);
    for (std::size_t i = 0; i < count; ++i) flat_[i] = {dot(ring_[i], x), dot(ring_[i], y)};
    image_ = {};
    if (ring.is_closed) return true;
    // u of a border maps to the nearest point of the new edge of the border.
    const std::size_t other = ring.triangles[0] == kNoTriangle ? 1 : count - 1;
    const Eigen::Vector3d edge = ring_[other] - ring_[0];
    const double t = std::clamp(-dot(ring_[0], edge) / dot(edge, edge), 0.0, 1.0);
    image_ = {flat_[0].x + t * (flat_[other].x - flat_[0].x),
              flat_[0].y + t * (flat_[other].y - flat_[0].y)};
    return std::isfinite(t);
}

// The new triangles are counter-clockwise in the plane, and together turn by less than a full turn at the target: then
// the polygon is simple and they are a triangulation of it.
bool ContractionBound::are_new_triangles_good(const Ring& ring) const {
    double worst_old = kMinShape;
    for (std::size_t i = 0; i < ring.count; ++i) {
        if (ring.triangles[i] == kNoTriangle) continue;
        const Eigen::Vector3d& a = ring_[i];
        const Eigen::Vector3d& b = ring_[i + 1 < ring.count ? i + 1 : 0];
        const Eigen::Vector3d edge = b - a, normal = cross(a, b);
        const double longest = std::max({dot(a, a), dot(b, b), dot(edge, edge)});
        worst_old = std::min(worst_old, length(normal) / longest);
    }
    const double least_shape = std::max(worst_old, kMinShapeEver);
    bool was_below = false;
    for (std::size_t i = 1; i + 1 < ring.count; ++i) {
        const Eigen::Vector3d a = ring_[i] - ring_[0], b = ring_[i + 1] - ring_[0],
                              edge = ring_[i + 1] - ring_[i];
        const Eigen::Vector3d normal = cross(a, b), old_normal = cross(ring_[i], ring_[i + 1]);
        const double doubled = length(normal);
        if (!(doubled >= least_shape * std::max({dot(a, a), dot(b, b), dot(edge, edge)})))
            return false;
        if (!(dot(normal, direction_) >= kMinCosine * doubled)) return false;
        if (!(dot(normal, old_normal) >= kMinCosine * doubled * length(old_normal))) return false;
        const double side = area(flat_[0], flat_[1], flat_[i + 1]);
        if (was_below && side >= 0.0) return false;
        was_below = side < 0.0;
    }
    return true;
}

// The fan of the image covers the polygon without leaving it; triangles may have no area.
bool ContractionBound::is_image_inside(const Ring& ring) const {
    for (std::size_t i = 0; i < ring.count; ++i) {
        if (ring.triangles[i] == kNoTriangle) continue;
        const Point &a = flat_[i], &b = flat_[i + 1 < ring.count ? i + 1 : 0];
        const double edge = std::abs(b.x - a.x) + std::abs(b.y - a.y);
        if (!(area(image_, a, b) >= -kPlaceTolerance * size_ * edge)) return false;
    }
    return true;
}

}  // namespace terrane::internal
