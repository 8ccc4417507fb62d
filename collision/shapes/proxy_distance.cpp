// SPDX-License-Identifier: MIT
//
// Sources: Ericson. Real-Time Collision Detection. 2005, section 5.1.5 (nearest point of a triangle, by regions).
//          Hormann, Agathos. The point in polygon problem for arbitrary polygons. 2001 (winding numbers by crossings).
#include "base/aabb_tree.h"
#include "shapes/proxy_parts.h"
#include "shapes/query_shapes.h"

#include <algorithm>
#include <map>
#include <queue>
#include <tuple>
#include <utility>

namespace terrane::internal {
namespace {

double box_distance(const Aabb& box, const Eigen::Vector3d& p) {
    double square = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double gap = std::max({box.low[axis] - p[axis], p[axis] - box.high[axis], 0.0});
        square += gap * gap;
    }
    return std::sqrt(square);
}

/// 1 if the directed edge a -> b, projected along z, crosses the ray from p along +x upward in y, -1 if downward, else
/// 0. Computed from the lower end, so that both triangles of an edge agree.
int crossing(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& p) {
    const bool is_a_above = a.y() > p.y(), is_b_above = b.y() > p.y();
    if (is_a_above == is_b_above) return 0;
    const Eigen::Vector3d& low = is_a_above ? b : a;
    const Eigen::Vector3d& high = is_a_above ? a : b;
    const double side =
        (high.x() - low.x()) * (p.y() - low.y()) - (p.x() - low.x()) * (high.y() - low.y());
    if (!(side > 0.0)) return 0;
    return is_b_above ? 1 : -1;
}

bool has_balanced_edges(const std::vector<SolidMesh::Triangle>& triangles) {
    // One entry per use of an edge: its vertex indices in ascending order, and +1 if the triangle traverses it from the
    // lower index to the higher, else -1. The mesh is balanced if the entries of each edge sum to 0.
    std::vector<std::pair<std::pair<std::uint32_t, std::uint32_t>, int>> edges;
    edges.reserve(3 * triangles.size());
    for (const SolidMesh::Triangle& t : triangles) {
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t a = t[i], b = t[(i + 1) % 3];
            edges.push_back({std::minmax(a, b), a < b ? 1 : -1});
        }
    }
    std::sort(edges.begin(), edges.end());
    for (std::size_t i = 0; i < edges.size();) {
        int sum = 0;
        const auto edge = edges[i].first;
        for (; i < edges.size() && edges[i].first == edge; ++i) sum += edges[i].second;
        if (sum != 0) return false;
    }
    return !edges.empty();
}

}  // namespace

SolidMesh make_solid_mesh(const TriangleMesh& mesh) {
    SolidMesh made;
    std::map<std::tuple<double, double, double>, std::uint32_t> known;
    std::vector<std::uint32_t> welded;
    welded.reserve(mesh.positions.size());
    for (const Eigen::Vector3d& p : mesh.positions) {
        const auto [at, is_new] = known.try_emplace({p.x() + 0.0, p.y() + 0.0, p.z() + 0.0},
                                                    static_cast<std::uint32_t>(made.points.size()));
        if (is_new) made.points.push_back(p);
        welded.push_back(at->second);
    }
    Aabb all = empty_box();
    std::vector<Aabb> boxes;
    for (const TriangleMesh::Triangle& t : mesh.triangles) {
        const SolidMesh::Triangle w{welded[t[0]], welded[t[1]], welded[t[2]]};
        if (w[0] == w[1] || w[1] == w[2] || w[2] == w[0]) continue;
        made.triangles.push_back(w);
        Aabb box = empty_box();
        for (const std::uint32_t corner : w) {
            include(made.points[corner], 0.0, box);
            include(made.points[corner], 0.0, all);
        }
        boxes.push_back(box);
    }
    if (boxes.empty()) return made;
    made.extent = (all.high - all.low).maxCoeff();
    made.tree = make_aabb_tree(boxes);
    made.is_closed = has_balanced_edges(made.triangles);
    return made;
}

NearestTriangle find_nearest(const SolidMesh& mesh, const Eigen::Vector3d& p) {
    NearestTriangle best;
    visit_leaves_up_to(
        std::span(mesh.tree), kInfinity, [&](const Aabb& box) { return box_distance(box, p); },
        [&](std::uint32_t item) {
            const double distance = distance_to_triangle(p, mesh.corners(item));
            if (distance < best.distance || (distance == best.distance && item < best.triangle)) {
                best = {item, distance};
            }
            return best.distance;
        });
    return best;
}

bool is_inside(const SolidMesh& mesh, const Eigen::Vector3d& p) {
    int winding = 0;
    visit_leaves(
        std::span(mesh.tree),
        [&](const Aabb& box) {
            return box.low.x() <= p.x() && p.x() <= box.high.x() && box.low.y() <= p.y() &&
                   p.y() <= box.high.y() && box.high.z() >= p.z();
        },
        [&](std::uint32_t item) {
            const auto [a, b, c] = mesh.corners(item);
            const int turns = crossing(a, b, p) + crossing(b, c, p) + crossing(c, a, p);
            if (turns == 0) return;
            const Eigen::Vector3d normal = cross(b - a, c - a);
            // Counts a triangle above p: the normal's z has the sign of `turns`, which makes the test one of height.
            if (dot(a - p, normal) * (turns > 0 ? 1.0 : -1.0) > 0.0) winding += turns;
        });
    return winding != 0;
}

double signed_volume(const SolidMesh& mesh) {
    double sum = 0.0;
    const Eigen::Vector3d& origin = mesh.points[mesh.triangles[0][0]];
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto [a, b, c] = mesh.corners(i);
        sum += dot(a - origin, cross(b - origin, c - origin));
    }
    return sum / 6.0;
}

// Bounds of the one-sided Hausdorff distance from a hull's faces to a solid.
//
// Sources:    Tang, Lee, Kim. Interactive Hausdorff distance computation for general polygonal models. SIGGRAPH 2009
//             (upper bounds of sub-triangles by one triangle of the other mesh; culling).
// Deviations: distances are to the solid, not to its surface: a sub-triangle within a ball inside the solid has
//             distance 0.
//
// The distance to one triangle is a convex function, so that its maximum over a sub-triangle is at a corner. The
// triangle nearest to the centroid of the sub-triangle gives the bound.

namespace {

constexpr std::size_t kMaxPieces = 20'000;  // limit of sub-triangles per hull

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
            // The ball around the centroid is inside the solid: no point is farther from the solid than from the ball.
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
            // Bisects the longest side.
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
