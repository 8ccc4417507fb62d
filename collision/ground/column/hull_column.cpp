// SPDX-License-Identifier: MIT
#include "base/vector_math.h"
#include "ground/column/column.h"
#include "ground/column/local_ground.h"
#include "pairs/convex_core.h"

namespace terrane::internal {
namespace {

// Closest points of a hull and the convex hull of `points`, which are relative to `origin`.
ClosestPair find_closest_to(const LocalHull& hull, const Eigen::Vector3d& centre,
                            const Eigen::Vector3d& origin,
                            std::span<const Eigen::Vector3d> points) {
    const Core a = make_core(hull, centre - origin);
    Core b;
    b.shape.vertices = points;
    b.rotation = Eigen::Matrix3d::Identity();
    b.centre = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : points) b.reach = std::max(b.reach, length(p));
    const Closest closest = find_closest(a, b);
    return {closest.on_a + origin, closest.on_b + origin, closest.distance};
}

}  // namespace

Core make_core(const LocalHull& hull, const Eigen::Vector3d& centre) {
    Core core;
    core.shape = *hull.shape;
    core.rotation = hull.rotation;
    core.centre = centre - hull.middle;
    core.reach = length(hull.middle) + length(hull.bounds);
    return core;
}

ClosestPair find_closest_hull(const LocalHull& hull, const Eigen::Vector3d& centre,
                              const Triangle& triangle) {
    const Eigen::Vector3d& origin = triangle.v[0];
    const std::array<Eigen::Vector3d, 3> points = {Eigen::Vector3d::Zero(), triangle.v[1] - origin,
                                                   triangle.v[2] - origin};
    return find_closest_to(hull, centre, origin, points);
}

ClosestPair find_closest_in_column(const LocalHull& hull, const Eigen::Vector3d& centre,
                                   const Triangle& triangle) {
    const Eigen::Vector3d& origin = triangle.v[0];
    std::array<Eigen::Vector3d, 6> points;
    double low = centre[2] - hull.bounds[2] - origin[2];
    for (std::size_t i = 0; i < 3; ++i) {
        points[i] = triangle.v[i] - origin;
        low = std::min(low, points[i][2]);
    }
    // The bottom of the prism is low enough not to affect the closest points.
    low -= 1.0 + length(hull.bounds);
    for (std::size_t i = 0; i < 3; ++i) {
        points[i + 3] = points[i];
        points[i + 3][2] = low;
    }
    return find_closest_to(hull, centre, origin, points);
}

// Sources: G. Snethen. Xenocollide: complex collision made simple. Game Programming Gems 7, 2008 (a portal crossed by a
//          ray and refined by support points).
// Deviations: the ray is the vertical line through the origin; the lift is the height at which it leaves the Minkowski
//             difference, triangle minus hull. The first portal is found in the horizontal plane. The ray has no end,
//             so that the refinement ends exactly on a facet of the difference.

namespace {

// Twice the signed area of (0, a, b) seen from above.
double area(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return a[0] * b[1] - a[1] * b[0];
}

class Portal {
public:
    Portal(const LocalHull& hull, const Eigen::Vector3d& centre, const Triangle& triangle)
        : hull_(hull) {
        for (std::size_t i = 0; i < 3; ++i) corners_[i] = triangle.v[i] - centre;
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d edge = corners_[(i + 1) % 3] - corners_[i];
            size_ = std::max({size_, std::abs(edge[0]), std::abs(edge[1])});
        }
        size_ += hull.bounds[0] + hull.bounds[1];
    }

    // Finds the first portal: three points of the difference, around the vertical in plan. False if there are none.
    //
    // @param lowest a vertex of the hull that does not lie over the triangle
    bool open(const Eigen::Vector3d& lowest) {
        const Eigen::Vector3d inside = (corners_[0] + corners_[1] + corners_[2]) / 3.0 - lowest;
        const Eigen::Vector3d ray(-inside[0], -inside[1], 0.0);
        Eigen::Vector3d right = support(ray);
        if (is_beside(right, ray)) return false;
        // Mirrored if necessary, so that the first point lies to the right of the ray.
        side_ = area(ray, right - inside) <= 0.0 ? 1.0 : -1.0;
        const auto left_of_ray = [&](const Eigen::Vector3d& p) {
            return side_ * area(ray, p - inside) > 0.0;
        };
        Eigen::Vector3d left = right;
        for (int step = 0;; ++step) {
            // The point of the difference that is farthest to the left of the line from `inside` to `right`.
            const Eigen::Vector3d to_right = right - inside;
            const Eigen::Vector3d out(-side_ * to_right[1], side_ * to_right[0], 0.0);
            left = support(out);
            if (is_beside(left, out)) return false;
            if (left_of_ray(left) || step == kSteps) break;
            if (!(dot(out, left - right) > 0.0)) return false;
            right = left;
        }
        for (int step = 0; step < kSteps; ++step) {
            const Eigen::Vector3d side = left - right;
            const Eigen::Vector3d out(side_ * side[1], -side_ * side[0], 0.0);
            if (dot(out, right) >= 0.0) break;
            const Eigen::Vector3d next = support(out);
            if (is_beside(next, out)) return false;
            if (!(dot(out, next - right) > 0.0)) break;
            (left_of_ray(next) ? left : right) = next;
        }
        // Counter-clockwise from above.
        corner_[0] = inside;
        corner_[1] = side_ > 0.0 ? right : left;
        corner_[2] = side_ > 0.0 ? left : right;
        return true;
    }

    // Height at which the vertical leaves the difference; minus infinity if this is proved to be at most `floor`.
    double refine(double floor) {
        double value = -kInfinity;
        double bound = kInfinity;
        for (int step = 0; step < kSteps; ++step) {
            const Eigen::Vector3d n = cross(corner_[1] - corner_[0], corner_[2] - corner_[0]);
            const double areas[3] = {area(corner_[1], corner_[2]), area(corner_[2], corner_[0]),
                                     area(corner_[0], corner_[1])};
            const double total = areas[0] + areas[1] + areas[2];
            if (!(total > 0.0) || !(n[2] > 0.0)) break;
            value =
                (areas[0] * corner_[0][2] + areas[1] * corner_[1][2] + areas[2] * corner_[2][2]) /
                total;
            const Eigen::Vector3d up(n[0] / n[2], n[1] / n[2], 1.0);
            const Eigen::Vector3d next = support(up);
            const double above = dot(up, next);
            if (above <= floor) return -kInfinity;
            bound = std::min(bound, above);
            const double rounding =
                0x1p-51 * (std::abs(value) + (std::abs(up[0]) + std::abs(up[1])) * size_);
            if (above <= value + rounding || !climb(next)) break;
        }
        return std::min(value, bound);
    }

private:
    static constexpr int kSteps = 200;

    // Support point of the difference.
    Eigen::Vector3d support(const Eigen::Vector3d& n) const {
        std::size_t top = 0;
        double highest = dot(n, corners_[0]);
        for (std::size_t i = 1; i < 3; ++i) {
            const double along = dot(n, corners_[i]);
            if (along > highest) {
                highest = along;
                top = i;
            }
        }
        return corners_[top] - hull_.vertex(hull_.lowest(n));
    }

    // Whether the origin lies beyond the support point along a horizontal direction by more than rounding.
    bool is_beside(const Eigen::Vector3d& farthest, const Eigen::Vector3d& n) const {
        const double along = n[0] * farthest[0] + n[1] * farthest[1];
        return along < -0x1p-50 * size_ * (std::abs(n[0]) + std::abs(n[1]));
    }

    // Replaces a corner of the portal by p: the one whose replacement keeps the vertical inside the portal with the
    // largest margin. False if p is a corner already, or if no replacement keeps the vertical inside.
    bool climb(const Eigen::Vector3d& p) {
        if (p == corner_[0] || p == corner_[1] || p == corner_[2]) return false;
        double best = -kInfinity;
        std::size_t worst = 3;
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d& b = corner_[(i + 1) % 3];
            const Eigen::Vector3d& c = corner_[(i + 2) % 3];
            const double of_p = area(b, c);
            const double of_b = area(c, p);
            const double of_c = area(p, b);
            const double total = of_p + of_b + of_c;
            if (!(total > 0.0)) continue;
            const double least = std::min({of_p, of_b, of_c}) / total;
            if (least > best) {
                best = least;
                worst = i;
            }
        }
        if (worst == 3) return false;
        corner_[worst] = p;
        return true;
    }

    const LocalHull& hull_;
    std::array<Eigen::Vector3d, 3> corners_;  ///< of the triangle, relative to the hull's centre
    std::array<Eigen::Vector3d, 3> corner_;   ///< of the portal
    double size_ = 0.0;                       ///< scale of rounding errors, metres
    double side_ = 1.0;                       ///< -1 if mirrored
};

}  // namespace

double compute_hull_lift(const LocalHull& hull, const Eigen::Vector3d& centre,
                         const Triangle& triangle, double floor) {
    // The support point against the triangle's normal gives an upper bound, which is exact if the point lies over the
    // triangle.
    const TrianglePlane plane(triangle);
    const Eigen::Vector3d lowest = hull.vertex(hull.lowest(triangle.normal));
    const Eigen::Vector3d placed = lowest + centre;
    const double bound = plane.above(placed);
    if (bound <= floor) return -kInfinity;
    if (is_over(placed, triangle)) return bound;
    Portal portal(hull, centre, triangle);
    return portal.open(lowest) ? portal.refine(floor) : -kInfinity;
}

}  // namespace terrane::internal
