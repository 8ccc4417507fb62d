// SPDX-License-Identifier: MIT
// Sources: D. Gregorius. The separating axis test between convex polyhedra. GDC 2013 (edges meet where
//          their arcs on the Gauss map cross). F. Ramos, S. Gottschalk et al. on separating axes. 1996.
// Deviations: instead of testing all pairs of arcs, each arc of one polyhedron is traced through the normal cones of
//             the other, from vertex to neighbour, so that only crossing arcs are visited.
#include "pairs/kernels/separating_axis.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Polyhedron x in its own frame, and the pose of y in it.
struct PolyhedronPair {
    const Polyhedron& x;
    const Polyhedron& y;
    Eigen::Matrix3d x_from_y;
    Eigen::Vector3d offset;  ///< origin of y in x's frame
    bool is_x_first;         ///< whether x is a of the query

    PolyhedronPair(const Core& core_x, const Core& core_y, bool is_first)
        : x(core_x.shape),
          y(core_y.shape),
          offset(core_x.to_body(core_y.centre - core_x.centre)),
          is_x_first(is_first) {
        for (int i = 0; i < 3; ++i) x_from_y.col(i) = core_x.to_body(core_y.rotation.col(i));
    }
};

// A unit normal out of x, in its frame, and the gap along it.
struct Candidate {
    Eigen::Vector3d out_of_x;
    double gap = -std::numeric_limits<double>::infinity();
    bool is_x_first = true;
};

void test_faces(const PolyhedronPair& pair, double enough, Candidate& best) {
    for (const Polyhedron::Face& face : pair.x.faces) {
        const Eigen::Vector3d direction = rotated_back(pair.x_from_y, -face.normal);
        const double gap = (dot(face.normal, pair.offset) - face.offset) -
                           dot(direction, pair.y.vertices[find_extreme(pair.y, direction)]);
        if (gap > best.gap) {
            best = {face.normal, gap, pair.is_x_first};
            if (gap > enough) return;
        }
    }
}

// Traces the Gauss map arc of an edge of x, from `first` to `last` (less than pi apart), through the normal cones of y.
class ArcWalk {
public:
    // An edge axis replaces the best one only if its gap is larger by more than `preference`.
    ArcWalk(const PolyhedronPair& pair, double preference)
        : pair_(pair), preference_(preference), slack_(0.01 * preference) {}

    void walk(const Polyhedron::Edge& edge, const Eigen::Vector3d& first,
              const Eigen::Vector3d& last, Candidate& best) {
        const Eigen::Vector3d p = pair_.x.vertices[edge.from];
        const Eigen::Vector3d e = pair_.x.vertices[edge.to] - p;
        const Eigen::Vector3d d1 = rotated_back(pair_.x_from_y, -first);
        const Eigen::Vector3d d2 = rotated_back(pair_.x_from_y, -last);
        const Polyhedron& y = pair_.y;
        std::uint32_t at = find_extreme(y, d1);
        // For a fixed vertex of y an overlap along the arc is a sinusoid, which is least at an end of the arc: nothing
        // better can be found where both ends are worse than the best gap.
        const Eigen::Vector3d to_y = rotated(pair_.x_from_y, y.vertices[at]) + pair_.offset - p;
        if (best.gap <= 0.0 && std::max(dot(first, to_y), dot(last, to_y)) < best.gap) return;
        // Arcs that cross just where this one begins would be missed by it and by the previous one.
        for (std::uint32_t k = y.first_neighbour[at]; k < y.first_neighbour[at + 1]; ++k) {
            const Eigen::Vector3d f = y.vertices[y.neighbours[k]] - y.vertices[at];
            if (std::abs(dot(d1, f)) <= slack_) cross_edges(e, p, f, y.vertices[at], first, best);
        }
        for (std::size_t step = 0; step < y.vertices.size(); ++step) {
            const Eigen::Vector3d& q = y.vertices[at];
            double share = std::numeric_limits<double>::infinity();
            std::uint32_t next = at;
            for (std::uint32_t k = y.first_neighbour[at]; k < y.first_neighbour[at + 1]; ++k) {
                const Eigen::Vector3d f = y.vertices[y.neighbours[k]] - q;
                const double at_last = dot(d2, f);
                if (!(at_last > 0.0)) continue;
                const double at_first = dot(d1, f);
                if (at_first > slack_) continue;  // already passed; it returns by rounding only
                const double when = at_first >= 0.0 ? 0.0 : at_first / (at_first - at_last);
                if (when < share) {
                    share = when;
                    next = y.neighbours[k];
                }
            }
            if (next == at) return;
            const Eigen::Vector3d towards = (1.0 - share) * first + share * last;
            cross_edges(e, p, y.vertices[next] - q, q, towards, best);
            at = next;
        }
    }

private:
    void cross_edges(const Eigen::Vector3d& e, const Eigen::Vector3d& p, const Eigen::Vector3d& f_y,
                     const Eigen::Vector3d& q_y, const Eigen::Vector3d& towards, Candidate& best) {
        constexpr double kParallel = 1e-10;  // sine; below it the ends of the arc are as good
        const Eigen::Vector3d f = rotated(pair_.x_from_y, f_y);
        Eigen::Vector3d m = cross(e, f);
        const double ee = dot(e, e);
        const double mm = dot(m, m);
        if (!(mm > kParallel * kParallel * ee * dot(f, f))) return;
        m /= std::sqrt(mm);
        // For nearly parallel edges rounding leaves a component along the edge, where it matters most.
        m -= (dot(m, e) / ee) * e;
        m /= length(m);
        if (dot(m, towards) < 0.0) m = -m;
        take(m, p, q_y, best);
    }

    void take(const Eigen::Vector3d& m, const Eigen::Vector3d& p, const Eigen::Vector3d& q_y,
              Candidate& best) const {
        const Eigen::Vector3d q = rotated(pair_.x_from_y, q_y) + pair_.offset;
        const double gap = dot(m, q - p);
        if (gap > best.gap + preference_) best = {m, gap, pair_.is_x_first};
    }

    const PolyhedronPair& pair_;
    double preference_;
    double slack_;  ///< rounding of a product that is 0, metres
};

void test_edges(const PolyhedronPair& pair, double preference, double enough, Candidate& best) {
    ArcWalk walker(pair, preference);
    for (const Polyhedron::Edge& edge : pair.x.edges) {
        const Eigen::Vector3d e = pair.x.vertices[edge.to] - pair.x.vertices[edge.from];
        const double square = dot(e, e);
        if (square == 0.0) continue;
        const Eigen::Vector3d along = e / std::sqrt(square);
        if (edge.left == Polyhedron::kNoFace) {
            // All directions orthogonal to a segment.
            const Eigen::Vector3d u = any_tangent(along);
            const Eigen::Vector3d v = cross(along, u);
            walker.walk(edge, u, v, best);
            walker.walk(edge, v, -u, best);
            walker.walk(edge, -u, -v, best);
            walker.walk(edge, -v, u, best);
        } else {
            const Eigen::Vector3d& left = pair.x.faces[edge.left].normal;
            const Eigen::Vector3d& right = pair.x.faces[edge.right].normal;
            if (dot(left, right) < -0.5) {
                const Eigen::Vector3d between = cross(along, left);
                walker.walk(edge, left, between, best);
                walker.walk(edge, between, right, best);
            } else {
                walker.walk(edge, left, right, best);
            }
        }
        if (best.gap > enough) return;
    }
}

}  // namespace

double gap_along(const Core& a, const Core& b, const Eigen::Vector3d& normal) {
    const Eigen::Vector3d in_a = a.to_body(normal);
    const Eigen::Vector3d in_b = b.to_body(normal);
    const double lowest = dot(in_a, a.shape.vertices[find_extreme(a.shape, -in_a)]);
    const double highest = dot(in_b, b.shape.vertices[find_extreme(b.shape, in_b)]);
    return (lowest - highest) + dot(normal, a.centre - b.centre);
}

Axis find_separating_axis(const Core& a, const Core& b, double enough) {
    const double preference = kTouchShare * (a.reach + b.reach);
    const PolyhedronPair from_a(a, b, true);
    const PolyhedronPair from_b(b, a, false);
    Candidate best;
    test_faces(from_a, enough, best);
    if (!(best.gap > enough)) test_faces(from_b, enough, best);
    if (!(best.gap > enough)) {
        // The arcs of one polyhedron suffice: those of the one with fewer edges.
        const bool is_a = a.shape.edges.size() <= b.shape.edges.size();
        test_edges(is_a ? from_a : from_b, preference, enough, best);
    }
    Axis axis;
    axis.gap = best.gap;
    if (best.gap > -std::numeric_limits<double>::infinity()) {
        axis.normal =
            best.is_x_first ? Eigen::Vector3d(-a.to_axes(best.out_of_x)) : b.to_axes(best.out_of_x);
    }
    return axis;
}

}  // namespace terrane::internal
