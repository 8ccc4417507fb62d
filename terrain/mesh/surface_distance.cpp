// SPDX-License-Identifier: MIT
//
// Computes: an upper bound of the Hausdorff distance between two triangle surfaces, by branch and bound.
// Sources:  P. Cignoni, C. Rocchini, R. Scopigno. Metro: Measuring Error on Simplified Surfaces. Computer Graphics
//           Forum 17(2), 1998 (distances of samples). M. Tang, M. Lee, Y. Kim. Interactive Hausdorff Distance
//           Computation for General Polygonal Models. SIGGRAPH 2009 (upper and lower bounds of parts of triangles).
// Deviations: parts are convex polygons, cut along the other surface's triangles, so that the number of parts depends
//             on the number of overlapping triangles and not on the distance.
//
// Proof. The distance from a convex set is a convex function. On a convex polygon it is therefore largest at a corner,
// and the largest distance of the corners from one triangle T of the other surface is an upper bound of the distance of
// every point of the polygon from that surface. Distances at single points are lower bounds of the result; the largest
// one so far, L, is kept. A polygon whose upper bound is at most (1 + kTolerance) L needs no further work. Another one
// is cut by the three planes through T's edges and orthogonal to T. Above T the distance from T is that from its
// plane, so that large parts have tight bounds; the parts outside are compared with the triangles nearest to them. A
// polygon that no plane cuts is halved. The parts of a cut share their corners on the cut, which rounding moves off
// the polygon by less than the margin that is added to the result: 2^-40 of the size of both surfaces.
#include "mesh/surface_distance.h"

#include "base/aabb_tree.h"
#include "mesh/star_mesh.h"

#include <terrane/terrain/surface_distance.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace terrane::internal {
namespace {

constexpr double kTolerance = 0.01;
// Distances below this share of the size of both surfaces are not refined.
constexpr double kLeastDistance = 0x1p-36;
constexpr double kMargin = 0x1p-40;
// Each step leaves parts of at most 5/9 of the area, because they do not contain the middle.
constexpr int kMostSteps = 100;
// A polygon with more corners is halved before it is cut by three planes, each of which adds a corner.
constexpr std::size_t kMostCut = 8;
// A corner counts as on a plane if its height is below this share of the largest one: otherwise rounding would cut off
// slivers without end.
constexpr double kOnPlane = 1e-6;

struct ConvexPart {
    std::array<Eigen::Vector3d, kMostCut + 4> corners;
    std::size_t count = 0;
    int steps = 0;  // that led to this part

    ConvexPart() { corners.fill(Eigen::Vector3d::Zero()); }
    void add(const Eigen::Vector3d& corner) { corners[count++] = corner; }
};

// The parts of a polygon below and above a plane; either may be empty. A corner on the plane belongs to both.
void cut(const ConvexPart& polygon, const Eigen::Vector3d& normal, const Eigen::Vector3d& on_plane,
         ConvexPart& below_out, ConvexPart& above_out) {
    below_out.count = above_out.count = 0;
    std::array<double, kMostCut + 4> heights;
    double largest = 0.0;
    for (std::size_t i = 0; i < polygon.count; ++i) {
        heights[i] = dot(normal, polygon.corners[i] - on_plane);
        largest = std::max(largest, std::abs(heights[i]));
    }
    bool is_below = false, is_above = false;
    for (std::size_t i = 0; i < polygon.count; ++i) {
        if (std::abs(heights[i]) <= kOnPlane * largest) heights[i] = 0.0;
        is_below = is_below || heights[i] < 0.0;
        is_above = is_above || heights[i] > 0.0;
    }
    if (!is_below || !is_above) {
        ConvexPart& whole = is_above ? above_out : below_out;
        whole = polygon;
        return;
    }
    for (std::size_t i = 0; i < polygon.count; ++i) {
        const std::size_t next = i + 1 < polygon.count ? i + 1 : 0;
        const Eigen::Vector3d &a = polygon.corners[i], &b = polygon.corners[next];
        if (heights[i] <= 0.0) below_out.add(a);
        if (heights[i] >= 0.0) above_out.add(a);
        if (!(heights[i] < 0.0 && heights[next] > 0.0) &&
            !(heights[i] > 0.0 && heights[next] < 0.0))
            continue;
        const Eigen::Vector3d crossing = a + (heights[i] / (heights[i] - heights[next])) * (b - a);
        below_out.add(crossing);
        above_out.add(crossing);
    }
}

// Two halves: along a diagonal if there are many corners, otherwise across the longest edge.
void halve(const ConvexPart& polygon, ConvexPart& first_out, ConvexPart& second_out) {
    if (polygon.count > kMostCut) {
        first_out.count = second_out.count = 0;
        const std::size_t middle = polygon.count / 2;
        for (std::size_t i = 0; i <= middle; ++i) first_out.add(polygon.corners[i]);
        for (std::size_t i = middle; i < polygon.count; ++i) second_out.add(polygon.corners[i]);
        second_out.add(polygon.corners[0]);
        return;
    }
    std::size_t from = 0, to = 1;
    double longest = -1.0;
    for (std::size_t i = 0; i < polygon.count; ++i) {
        for (std::size_t k = i + 1; k < polygon.count; ++k) {
            const Eigen::Vector3d across = polygon.corners[k] - polygon.corners[i];
            if (dot(across, across) <= longest) continue;
            longest = dot(across, across);
            from = i;
            to = k;
        }
    }
    const Eigen::Vector3d &a = polygon.corners[from], &b = polygon.corners[to];
    cut(polygon, b - a, 0.5 * (a + b), first_out, second_out);
}

// Finds the nearest triangles of a surface.
class SurfaceTree {
public:
    SurfaceTree(const SurfaceView& surface, const Eigen::Vector3d& origin) {
        std::vector<Aabb> boxes;
        boxes.reserve(surface.triangles.size());
        triangles_.reserve(surface.triangles.size());
        for (const auto& t : surface.triangles) {
            const Corners c = {surface.vertices[t[0]] - origin, surface.vertices[t[1]] - origin,
                               surface.vertices[t[2]] - origin};
            triangles_.push_back(c);
            boxes.push_back(
                {c[0].cwiseMin(c[1]).cwiseMin(c[2]), c[0].cwiseMax(c[1]).cwiseMax(c[2])});
        }
        tree_ = make_aabb_tree(boxes);
    }

    const std::vector<Corners>& triangles() const { return triangles_; }

    // The nearest triangle; of equally near ones, the first that the search finds. `hint` only saves time.
    std::uint32_t nearest(const Eigen::Vector3d& p, std::uint32_t hint,
                          double& distance_out) const {
        std::uint32_t best = hint;
        double least = distance_to_triangle(p, triangles_[hint]);
        const auto bound = [&](const Aabb& box) { return distance_to_box(p, box); };
        visit_leaves_up_to(tree_, least, bound, [&](std::uint32_t item) {
            const double distance = distance_to_triangle(p, triangles_[item]);
            if (distance < least) {
                least = distance;
                best = item;
            }
            return least;
        });
        distance_out = least;
        return best;
    }

private:
    std::vector<Corners> triangles_;
    std::vector<AabbNode> tree_;
};

// Bounds the distance of one surface from another.
class DistanceBound {
public:
    DistanceBound(const SurfaceTree& to, double size) : to_(to), floor_(kLeastDistance * size) {}

    // Raises the lower bound to the distance of a point.
    void add_point(const Eigen::Vector3d& p) {
        double distance = 0.0;
        last_ = to_.nearest(p, last_, distance);
        lower_ = std::max(lower_, distance);
    }

    void add_triangle(const Corners& triangle) {
        ConvexPart whole;
        for (const Eigen::Vector3d& corner : triangle) whole.add(corner);
        stack_.push_back(whole);
        while (!stack_.empty()) {
            const ConvexPart polygon = stack_.back();
            stack_.pop_back();
            add_polygon(polygon);
        }
    }

    double lower() const { return lower_; }
    // The distance of other points is at least this.
    void raise_lower(double distance) { lower_ = std::max(lower_, distance); }
    double upper() const { return upper_; }

private:
    void add_polygon(const ConvexPart& polygon) {
        Eigen::Vector3d middle = Eigen::Vector3d::Zero();
        for (std::size_t i = 0; i < polygon.count; ++i) middle += polygon.corners[i];
        middle /= static_cast<double>(polygon.count);
        add_point(middle);
        const Corners& nearest = to_.triangles()[last_];
        if (accepts(polygon, nearest)) return;
        ConvexPart inside, outside;
        const Eigen::Vector3d normal = cross(nearest[1] - nearest[0], nearest[2] - nearest[0]);
        bool is_cut = false;
        if (polygon.count <= kMostCut && dot(normal, normal) > 0.0) {
            ConvexPart rest = polygon;
            for (std::size_t k = 0; k < 3 && rest.count > 2; ++k) {
                const Eigen::Vector3d &from = nearest[k], &to = nearest[(k + 1) % 3];
                cut(rest, cross(to - from, normal), from, inside, outside);
                is_cut = is_cut || (inside.count > 2 && outside.count > 2);
                // nothing is inside: halved below
                if (inside.count <= 2 && !is_cut) break;
                push(outside, polygon.steps + 1);
                rest = inside;
            }
            if (is_cut) {
                if (rest.count < 3 || accepts(rest, nearest)) return;
                // its middle may be nearest to the same triangle
                halve(rest, inside, outside);
                push(inside, polygon.steps + 1);
                push(outside, polygon.steps + 1);
                return;
            }
        }
        halve(polygon, inside, outside);
        push(inside, polygon.steps + 1);
        push(outside, polygon.steps + 1);
    }

    // Whether the polygon's upper bound needs no refinement, or may have none.
    bool accepts(const ConvexPart& polygon, const Corners& triangle) {
        double largest = 0.0;
        for (std::size_t i = 0; i < polygon.count; ++i)
            largest = std::max(largest, distance_to_triangle(polygon.corners[i], triangle));
        if (largest > std::max(lower_ * (1.0 + kTolerance), floor_) && polygon.steps < kMostSteps)
            return false;
        upper_ = std::max(upper_, largest);
        return true;
    }

    void push(const ConvexPart& part, int steps) {
        if (part.count < 3) return;
        stack_.push_back(part);
        stack_.back().steps = steps;
    }

    const SurfaceTree& to_;
    double floor_;
    double lower_ = 0.0, upper_ = 0.0;
    std::uint32_t last_ = 0;  // the nearest triangle of the last point
    std::vector<ConvexPart> stack_;
};

// Adds the vertices that triangles use.
void add_vertices(const SurfaceView& surface, const Eigen::Vector3d& origin, DistanceBound& to) {
    std::vector<std::uint8_t> is_added(surface.vertices.size(), 0);
    for (const auto& triangle : surface.triangles) {
        for (const std::uint32_t v : triangle) {
            if (is_added[v] == 0) to.add_point(surface.vertices[v] - origin);
            is_added[v] = 1;
        }
    }
}

}  // namespace

double bound_surface_distance(const SurfaceView& a, const SurfaceView& b) {
    if (a.triangles.empty() || b.triangles.empty())
        return a.triangles.size() == b.triangles.size() ? 0.0 : kInfinity;
    const Eigen::Vector3d origin = a.vertices[a.triangles[0][0]];
    const SurfaceTree of_a(a, origin), of_b(b, origin);
    double size = 0.0;
    for (const SurfaceTree* surface : {&of_a, &of_b}) {
        for (const Corners& triangle : surface->triangles()) {
            for (const Eigen::Vector3d& corner : triangle) size = std::max(size, length(corner));
        }
    }
    DistanceBound to_b(of_b, size), to_a(of_a, size);
    // all vertices first: the larger the lower bound, the fewer triangles are cut
    add_vertices(a, origin, to_b);
    add_vertices(b, origin, to_a);
    to_b.raise_lower(to_a.lower());
    for (const Corners& triangle : of_a.triangles()) to_b.add_triangle(triangle);
    to_a.raise_lower(to_b.lower());
    for (const Corners& triangle : of_b.triangles()) to_a.add_triangle(triangle);
    const double upper = std::max(to_b.upper(), to_a.upper());
    return upper * (1.0 + kMargin) + kMargin * size;
}

}  // namespace terrane::internal

namespace terrane {

double bound_surface_distance(const TriangleMesh& a, const TriangleMesh& b) {
    return internal::bound_surface_distance({a.positions, a.triangles}, {b.positions, b.triangles});
}

}  // namespace terrane
