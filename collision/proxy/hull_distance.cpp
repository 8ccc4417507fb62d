// SPDX-License-Identifier: MIT
//
// Computes the one-sided Hausdorff distance from a hull's faces to a solid, between two bounds.
//
// Sources:    Tang, Lee, Kim. Interactive Hausdorff distance computation for general polygonal models. SIGGRAPH 2009
//             (upper bounds of sub-triangles by one triangle of the other mesh; culling).
// Deviations: distances to the solid, not to its surface: a sub-triangle that a ball inside the solid holds has none.
//
// The distance to one triangle is a convex function, so that its largest value over a sub-triangle is at a corner. The
// triangle nearest to the sub-triangle's centroid gives the bound.
#include "proxy/hull_distance.h"

#include "shapes/hull_data.h"

#include <algorithm>
#include <queue>

namespace terrane::internal {
namespace {

constexpr std::size_t kMaxPieces = 20'000;  // sub-triangles of one hull; then `high` stays as it is

struct Piece {
    double bound = 0.0;
    std::size_t order = 0;
    std::array<Eigen::Vector3d, 3> corners;

    bool operator<(const Piece& other) const {
        return bound != other.bound ? bound < other.bound : order > other.order;
    }
};

class OutsideSearch {
public:
    explicit OutsideSearch(const SolidMesh& solid) : solid_(solid) {}

    void add(const std::array<Eigen::Vector3d, 3>& corners) {
        const Eigen::Vector3d middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        const NearestTriangle nearest = find_nearest(solid_, middle);
        double radius = 0.0, bound = 0.0;
        const std::array<Eigen::Vector3d, 3> other = solid_.corners(nearest.triangle);
        for (const Eigen::Vector3d& corner : corners) {
            radius = std::max(radius, length(corner - middle));
            bound = std::max(bound, distance_to_triangle(corner, other));
        }
        bound = std::min(bound, nearest.distance + radius);
        const bool is_middle_inside = is_inside(solid_, middle);
        if (is_middle_inside) {
            if (nearest.distance >= radius) return;  // all of it is inside
            // No point is deeper outside than it is beyond the ball around the centroid.
            bound = std::min(bound, radius - nearest.distance);
        } else if (nearest.distance > found_.low) {
            found_.low = nearest.distance;
            found_.place = middle;
        }
        if (bound > 0.0) pieces_.push({bound, count_++, corners});
    }

    HullDistance run(double enough, double precision, double too_much) {
        while (!pieces_.empty()) {
            const Piece piece = pieces_.top();
            found_.high = piece.bound;
            if (piece.bound <= std::max(enough, found_.low + precision)) break;
            if (found_.low > too_much || count_ > kMaxPieces) break;
            pieces_.pop();
            const auto& [a, b, c] = piece.corners;
            // The longest side is halved.
            const double ab = dot(b - a, b - a), bc = dot(c - b, c - b), ca = dot(a - c, a - c);
            if (ab >= bc && ab >= ca) {
                const Eigen::Vector3d m = 0.5 * (a + b);
                add({a, m, c});
                add({m, b, c});
            } else if (bc >= ca) {
                const Eigen::Vector3d m = 0.5 * (b + c);
                add({a, b, m});
                add({a, m, c});
            } else {
                const Eigen::Vector3d m = 0.5 * (c + a);
                add({a, b, m});
                add({m, b, c});
            }
        }
        if (pieces_.empty()) found_.high = 0.0;
        found_.high = std::max(found_.high, found_.low);
        found_.pieces = count_;
        return found_;
    }

private:
    const SolidMesh& solid_;
    std::priority_queue<Piece> pieces_;
    std::size_t count_ = 0;
    HullDistance found_;
};

template <class Visit>
void visit_face_triangles(const ConvexHull& hull, const Visit& visit) {
    const std::span<const Eigen::Vector3d> v = hull.vertices();
    for (std::size_t face = 0; face < hull.face_count(); ++face) {
        const std::span<const std::uint32_t> loop = hull.face(face);
        for (std::size_t i = 2; i < loop.size(); ++i) {
            visit(std::array{v[loop[0]], v[loop[i - 1]], v[loop[i]]});
        }
    }
}

}  // namespace

HullDistance distance_outside(const SolidMesh& solid, const ConvexHull& hull, double enough,
                              double precision, double too_much) {
    OutsideSearch search(solid);
    visit_face_triangles(hull, [&](const auto& triangle) { search.add(triangle); });
    if (hull.face_count() == 0) {
        const std::span<const Eigen::Vector3d> v = hull.vertices();
        search.add({v.front(), v.back(), v.back()});
    }
    return search.run(enough, precision, too_much);
}

double distance_to_hull(const ConvexHull& hull, const Eigen::Vector3d& p) {
    const std::span<const Eigen::Vector3d> v = hull.vertices();
    if (hull.face_count() == 0) return distance_to_triangle(p, {v.front(), v.back(), v.back()});
    if (hull.face_count() > 2) {
        double highest = -kInfinity;
        for (const Polyhedron::Face& face : polyhedron(hull).faces) {
            highest = std::max(highest, dot(face.normal, p) - face.offset);
        }
        if (!(highest > 0.0)) return 0.0;
    }
    double least = kInfinity;
    visit_face_triangles(hull, [&](const auto& triangle) {
        least = std::min(least, distance_to_triangle(p, triangle));
    });
    return least;
}

double volume_of(const ConvexHull& hull) {
    double sum = 0.0;
    const Eigen::Vector3d& origin = hull.vertices()[0];
    visit_face_triangles(hull, [&](const auto& t) {
        sum += dot(t[0] - origin, cross(t[1] - origin, t[2] - origin));
    });
    return hull.face_count() > 2 ? sum / 6.0 : 0.0;
}

}  // namespace terrane::internal
