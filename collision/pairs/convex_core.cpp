// SPDX-License-Identifier: MIT
//
// The point nearest to the origin in an intersection of half-spaces.
//
// Sources:    R. Seidel. Small-dimensional linear programming and convex hulls made easy. Discrete and Computational
//             Geometry 1991 (incremental; solves in one dimension less on a violated plane).
// Deviations: the objective is the distance from the origin, whose minimum on a plane is the foot of the perpendicular;
//             planes are processed in insertion order instead of random order, for determinism.
#include "pairs/convex_core.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

// Relative tolerance of the depths: a plane violated by less counts as satisfied.
constexpr double kSlack = 1e-14;

double slack_of(const HalfSpace& plane) { return kSlack * std::max(1e-3, std::abs(plane.depth)); }

// Finds the shortest translation on the intersection line of planes i and j, inside the first `count` half-spaces.
bool find_on_line(const HalfSpaces& spaces, std::size_t i, std::size_t j, std::size_t count,
                  Eigen::Vector3d& d_out) {
    const HalfSpace& a = spaces.planes[i];
    const HalfSpace& b = spaces.planes[j];
    Eigen::Vector3d along = cross(a.normal, b.normal);
    const double square = dot(along, along);
    if (square < 1e-20) return false;  // parallel planes count as having no solution
    const Eigen::Vector3d foot =
        (a.depth * cross(b.normal, along) + b.depth * cross(along, a.normal)) / square;
    along /= std::sqrt(square);
    double first = -std::numeric_limits<double>::infinity();
    double last = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < count; ++k) {
        if (k == i || k == j) continue;
        const HalfSpace& plane = spaces.planes[k];
        const double rate = dot(plane.normal, along);
        const double rest = plane.depth - dot(plane.normal, foot);
        if (std::abs(rate) < 1e-12) {
            if (rest > slack_of(plane) + 1e-11 * std::abs(plane.depth)) return false;
        } else if (rate > 0.0) {
            first = std::max(first, rest / rate);
        } else {
            last = std::min(last, rest / rate);
        }
    }
    if (first > last) {
        if (first - last > 1e-12) return false;
        first = last = 0.5 * (first + last);
    }
    d_out = foot + std::clamp(0.0, first, last) * along;
    return true;
}

// Finds the shortest translation on plane i, inside the half-spaces before it.
bool find_on_plane(const HalfSpaces& spaces, std::size_t i, Eigen::Vector3d& d_out) {
    d_out = spaces.planes[i].depth * spaces.planes[i].normal;
    for (std::size_t j = 0; j < i; ++j) {
        const HalfSpace& plane = spaces.planes[j];
        if (dot(plane.normal, d_out) >= plane.depth - slack_of(plane)) continue;
        if (!find_on_line(spaces, i, j, j, d_out)) return false;
    }
    return true;
}

}  // namespace

void HalfSpaces::add(const HalfSpace& plane) {
    if (count == kMost) {
        std::move(planes.begin() + 1, planes.end(), planes.begin());
        --count;
    }
    planes[count++] = plane;
}

bool find_shortest(const HalfSpaces& spaces, Eigen::Vector3d& d_out) {
    d_out = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < spaces.count; ++i) {
        const HalfSpace& plane = spaces.planes[i];
        if (dot(plane.normal, d_out) >= plane.depth - slack_of(plane)) continue;
        if (!find_on_plane(spaces, i, d_out)) return false;
    }
    return true;
}

namespace {

constexpr std::array<Polyhedron::Edge, 1> kSegmentEdges = {
    {{0, 1, Polyhedron::kNoFace, Polyhedron::kNoFace}}};
constexpr std::array<std::uint32_t, 3> kSegmentFirst = {0, 1, 2};
constexpr std::array<std::uint32_t, 2> kSegmentNeighbours = {1, 0};
constexpr std::array<std::uint32_t, 2> kPointFirst = {0, 0};

}  // namespace

Core make_core(const PlacedSphere& sphere, CoreStorage& storage_out) {
    storage_out.ends[0] = Eigen::Vector3d::Zero();
    Core core;
    core.shape.vertices = {storage_out.ends.data(), 1};
    core.shape.first_neighbour = kPointFirst;
    core.rotation = Eigen::Matrix3d::Identity();
    core.centre = sphere.centre;
    core.radius = sphere.radius;
    return core;
}

Core make_core(const PlacedCapsule& capsule, CoreStorage& storage_out) {
    storage_out.ends[0] = -capsule.half_axis;
    storage_out.ends[1] = capsule.half_axis;
    Core core;
    core.shape.vertices = storage_out.ends;
    core.shape.edges = kSegmentEdges;
    core.shape.first_neighbour = kSegmentFirst;
    core.shape.neighbours = kSegmentNeighbours;
    core.rotation = Eigen::Matrix3d::Identity();
    core.centre = capsule.centre;
    core.radius = capsule.radius;
    core.reach = length(capsule.half_axis);
    return core;
}

Core make_core(const PlacedBox& box, CoreStorage& storage_out) {
    // A box without extent is treated as a point, because its faces are meaningless.
    if (box.half == Eigen::Vector3d::Zero()) {
        Core point = make_core(PlacedSphere{box.centre, 0.0}, storage_out);
        point.rotation = box.rotation;
        return point;
    }
    return {box_polyhedron(box.half, storage_out.box), box.rotation, box.centre, 0.0,
            length(box.half)};
}

Core make_core(const PlacedHull& hull, CoreStorage&) {
    return {hull.shape, hull.rotation, hull.centre, 0.0, hull.reach};
}

// Sources: E. Gilbert, D. Johnson, S. Keerthi. A fast procedure for computing the distance between complex objects in
//          three-dimensional space. 1988 (GJK).
//          C. Ericson. Real-time collision detection. 2005, sections 5.1.5 (nearest point of a triangle), 9.5 (GJK).
// Deviations: the nearest point of a simplex is the best over all its corners, edges and faces, so that a degenerate
//             simplex gives at worst a farther point, never a wrong one. The iteration stops when a separating plane
//             certifies a lower bound that equals the distance up to rounding.

namespace {

struct Corner {
    Eigen::Vector3d w = Eigen::Vector3d::Zero();     ///< point of a minus point of b
    Eigen::Vector3d on_a = Eigen::Vector3d::Zero();  ///< relative to the centre of a; on_b: of b
    Eigen::Vector3d on_b = Eigen::Vector3d::Zero();
    std::uint32_t a = 0;
    std::uint32_t b = 0;
};

// A point of the simplex in barycentric coordinates.
struct BarycentricPoint {
    std::array<std::size_t, 3> which{};
    std::array<double, 3> share{};
    std::size_t count = 0;
    Eigen::Vector3d v;
    double square = std::numeric_limits<double>::infinity();
};

using Simplex = std::array<Corner, 4>;

// From corner i to corner j. Computed for each shape separately, so that a shared vertex of a large shape cancels
// exactly.
Eigen::Vector3d edge_between(const Simplex& y, std::size_t i, std::size_t j) {
    return (y[j].on_a - y[i].on_a) - (y[j].on_b - y[i].on_b);
}

void keep_nearer(const BarycentricPoint& mix, BarycentricPoint& best) {
    if (mix.square < best.square) best = mix;
}

BarycentricPoint nearest_of_corner(const Simplex& y, std::size_t i) {
    return {{i}, {1.0}, 1, y[i].w, dot(y[i].w, y[i].w)};
}

BarycentricPoint nearest_of_edge(const Simplex& y, std::size_t i, std::size_t j) {
    const Eigen::Vector3d e = edge_between(y, i, j);
    const double square = dot(e, e);
    const double along = -dot(y[i].w, e);
    if (along <= 0.0) return nearest_of_corner(y, i);
    if (along >= square) return nearest_of_corner(y, j);
    const double s = along / square;
    Eigen::Vector3d v = y[i].w + s * e;
    v -= (dot(v, e) / square) * e;  // orthogonal to the edge despite rounding
    return {{i, j}, {1.0 - s, s}, 2, v, dot(v, v)};
}

BarycentricPoint nearest_of_face(const Simplex& y, std::size_t i, std::size_t j, std::size_t k) {
    BarycentricPoint best = nearest_of_edge(y, i, j);
    keep_nearer(nearest_of_edge(y, j, k), best);
    keep_nearer(nearest_of_edge(y, k, i), best);
    // Uses the two shorter edges, because the longer ones of a sliver are nearly parallel.
    std::array<std::size_t, 3> which = {i, j, k};
    const auto square_of = [&](std::size_t a, std::size_t b) {
        const Eigen::Vector3d e = edge_between(y, which[a], which[b]);
        return dot(e, e);
    };
    const double ij = square_of(0, 1), jk = square_of(1, 2), ki = square_of(2, 0);
    if (ij >= jk && ij >= ki) {
        which = {k, i, j};
    } else if (ki >= ij && ki >= jk) {
        which = {j, k, i};
    }
    const Eigen::Vector3d u = edge_between(y, which[0], which[1]);
    const Eigen::Vector3d v = edge_between(y, which[0], which[2]);
    const Eigen::Vector3d n = cross(u, v);
    const double square = dot(n, n);
    if (!(square > 0.0)) return best;
    // From the nearest point of the boundary to the projection of the origin on the plane.
    const Eigen::Vector3d foot = (dot(n, best.v) / square) * n;
    const Eigen::Vector3d step = foot - best.v;
    const double along_u = dot(cross(step, v), n) / square;
    const double along_v = dot(cross(u, step), n) / square;
    BarycentricPoint inside{
        which, {-along_u - along_v, along_u, along_v}, 3, foot, dot(foot, foot)};
    for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < best.count; ++b) {
            if (best.which[b] == which[a]) inside.share[a] += best.share[b];
        }
        if (inside.share[a] <= 0.0) return best;
    }
    keep_nearer(inside, best);
    return best;
}

// Whether the face i, j, k separates the origin from the fourth corner; also true for a flat tetrahedron.
bool is_outside(const Simplex& y, std::size_t i, std::size_t j, std::size_t k, std::size_t fourth,
                double rounding) {
    const Eigen::Vector3d n = cross(edge_between(y, i, j), edge_between(y, i, k));
    const double of_origin = -dot(n, y[i].w);
    const double of_fourth = dot(n, edge_between(y, i, fourth));
    if (of_fourth * of_fourth <= rounding * rounding * dot(n, n)) return true;
    return !(of_origin * of_fourth > 0.0);
}

// Finds the point of a simplex nearest to the origin. False if the origin is inside a tetrahedron.
bool find_nearest(const Simplex& y, std::size_t count, double rounding, BarycentricPoint& best) {
    if (count == 1) {
        best = nearest_of_corner(y, 0);
    } else if (count == 2) {
        best = nearest_of_edge(y, 0, 1);
    } else if (count == 3) {
        best = nearest_of_face(y, 0, 1, 2);
    } else {
        bool is_found = false;
        constexpr std::size_t kFaces[4][4] = {
            {0, 1, 3, 2}, {1, 2, 3, 0}, {2, 0, 3, 1}, {0, 1, 2, 3}};
        for (const std::size_t* f : kFaces) {
            if (!is_outside(y, f[0], f[1], f[2], f[3], rounding)) continue;
            is_found = true;
            keep_nearer(nearest_of_face(y, f[0], f[1], f[2]), best);
        }
        return is_found;
    }
    return true;
}

}  // namespace

Closest find_closest(const Core& a, const Core& b, double enough) {
    constexpr int kSteps = 200;
    const Eigen::Vector3d offset = a.centre - b.centre;
    const double scale = a.reach + b.reach + length(offset);
    const double exact = 1e-15 * scale;
    Simplex y;
    y[0].a = find_extreme(a.shape, a.to_body(-offset));
    y[0].b = find_extreme(b.shape, b.to_body(offset));
    const auto place = [&](Corner& corner) {
        corner.on_a = a.to_axes(a.shape.vertices[corner.a]);
        corner.on_b = b.to_axes(b.shape.vertices[corner.b]);
        corner.w = (corner.on_a - corner.on_b) + offset;
    };
    place(y[0]);
    BarycentricPoint best = nearest_of_corner(y, 0);
    Simplex of_best = y;
    std::size_t count = 1;
    double lower = 0.0;
    double distance = std::sqrt(best.square);
    for (int step = 0; step < kSteps; ++step) {
        if (distance <= exact) break;
        Corner next;
        next.a = find_extreme(a.shape, a.to_body(-best.v));
        next.b = find_extreme(b.shape, b.to_body(best.v));
        place(next);
        lower = std::max(lower, dot(best.v, next.w) / distance);
        if (distance - lower <= exact + 1e-15 * distance || lower > enough) break;
        bool is_known = false;
        for (std::size_t i = 0; i < count; ++i) {
            is_known = is_known || (y[i].a == next.a && y[i].b == next.b);
        }
        if (is_known) break;
        y[count++] = next;
        BarycentricPoint mix;
        if (!find_nearest(y, count, 10.0 * exact, mix)) {
            // The cores overlap; a common point is not computed.
            return {a.vertex(y[0].a), b.vertex(y[0].b), Eigen::Vector3d::UnitZ(), 0.0, 0.0};
        }
        if (!(mix.square < best.square)) break;
        best = mix;
        of_best = y;
        distance = std::sqrt(best.square);
        Simplex kept;
        for (std::size_t i = 0; i < mix.count; ++i) kept[i] = y[mix.which[i]];
        y = kept;
        count = mix.count;
    }
    Closest closest;
    closest.on_a = a.centre;
    closest.on_b = b.centre;
    for (std::size_t i = 0; i < best.count; ++i) {
        const Corner& corner = of_best[best.which[i]];
        closest.on_a += best.share[i] * corner.on_a;
        closest.on_b += best.share[i] * corner.on_b;
    }
    closest.distance = distance;
    if (distance > 0.0) closest.normal = best.v / distance;
    closest.lower = std::min(lower, distance);
    return closest;
}

SegmentPair find_closest_on_segments(const Eigen::Vector3d& p, const Eigen::Vector3d& u,
                                     const Eigen::Vector3d& q, const Eigen::Vector3d& v) {
    const Eigen::Vector3d r = q - p;
    const double uu = dot(u, u);
    const double vv = dot(v, v);
    const auto on_u = [&](double t) {
        return uu > 0.0 ? std::clamp(dot(u, r + t * v) / uu, 0.0, 1.0) : 0.0;
    };
    const auto on_v = [&](double s) {
        return vv > 0.0 ? std::clamp(dot(v, s * u - r) / vv, 0.0, 1.0) : 0.0;
    };
    SegmentPair best;
    double shortest = std::numeric_limits<double>::infinity();
    const auto consider = [&](double s, double t) {
        const Eigen::Vector3d d = (r + t * v) - s * u;
        const double square = dot(d, d);
        if (square < shortest) {
            shortest = square;
            best = {s, t};
        }
    };
    // Interior points use the cross product, which stays accurate for nearly parallel segments.
    const Eigen::Vector3d n = cross(u, v);
    const double nn = dot(n, n);
    if (nn > 0.0) {
        const double s = std::clamp(dot(cross(r, v), n) / nn, 0.0, 1.0);
        const double t = on_v(s);
        consider(on_u(t), t);
    }
    consider(0.0, on_v(0.0));
    consider(1.0, on_v(1.0));
    consider(on_u(0.0), 0.0);
    consider(on_u(1.0), 1.0);
    return best;
}

// Sources: D. Gregorius. The separating axis test between convex polyhedra. GDC 2013 (edges form a facet if their arcs
//          on the Gauss map cross).
//          S. Gottschalk, M. Lin, D. Manocha. OBBTree. SIGGRAPH 1996 (separating axes).
// Deviations: instead of testing all pairs of arcs, each arc of one polyhedron is traced through the normal cones of
//             the other, from vertex to neighbour, so that only crossing arcs are visited.

namespace {

// Polyhedron x in its own frame, and the pose of polyhedron y in that frame.
struct PolyhedronPair {
    const Polyhedron& x;
    const Polyhedron& y;
    Eigen::Matrix3d x_from_y;
    Eigen::Vector3d offset;  ///< origin of y in x's frame
    bool is_x_first;         ///< whether x is shape a of the query

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
        // For a fixed vertex of y the overlap along the arc is a sinusoid with its minimum at an end of the arc: the
        // arc cannot improve the best gap if both ends are worse.
        const Eigen::Vector3d to_y = rotated(pair_.x_from_y, y.vertices[at]) + pair_.offset - p;
        if (best.gap <= 0.0 && std::max(dot(first, to_y), dot(last, to_y)) < best.gap) return;
        // Arcs of y that cross exactly at the start of this arc would be missed by both this arc and the previous one.
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
                if (at_first > slack_) continue;  // already passed; found again only by rounding
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
        constexpr double kParallel = 1e-10;  // sine; below it the ends of the arc suffice
        const Eigen::Vector3d f = rotated(pair_.x_from_y, f_y);
        Eigen::Vector3d m = cross(e, f);
        const double ee = dot(e, e);
        const double mm = dot(m, m);
        if (!(mm > kParallel * kParallel * ee * dot(f, f))) return;
        m /= std::sqrt(mm);
        // Rounding leaves a component of m along the edge, which matters most for nearly parallel edges: removes it.
        m -= (dot(m, e) / ee) * e;
        m /= length(m);
        if (dot(m, towards) < 0.0) m = -m;
        offer(m, p, q_y, best);
    }

    void offer(const Eigen::Vector3d& m, const Eigen::Vector3d& p, const Eigen::Vector3d& q_y,
               Candidate& best) const {
        const Eigen::Vector3d q = rotated(pair_.x_from_y, q_y) + pair_.offset;
        const double gap = dot(m, q - p);
        if (gap > best.gap + preference_) best = {m, gap, pair_.is_x_first};
    }

    const PolyhedronPair& pair_;
    double preference_;
    double slack_;  ///< bound of the rounding error of a product that is 0, metres
};

void test_edges(const PolyhedronPair& pair, double preference, double enough, Candidate& best) {
    ArcWalk walker(pair, preference);
    for (const Polyhedron::Edge& edge : pair.x.edges) {
        const Eigen::Vector3d e = pair.x.vertices[edge.to] - pair.x.vertices[edge.from];
        const double square = dot(e, e);
        if (square == 0.0) continue;
        const Eigen::Vector3d along = e / std::sqrt(square);
        if (edge.left == Polyhedron::kNoFace) {
            // Traces all directions orthogonal to a segment.
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
        // The arcs of one polyhedron suffice; takes the one with fewer edges.
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
