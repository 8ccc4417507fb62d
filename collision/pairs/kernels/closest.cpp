// SPDX-License-Identifier: MIT
// Sources: E. Gilbert, D. Johnson, S. Keerthi. A fast procedure for computing the distance between
//          complex objects in three-dimensional space. 1988. C. Ericson. Real-time collision detection.
//          2005, sections 5.1.5 and 9.5.
// Deviations: the nearest point of a simplex is the best over all of its corners, edges and faces, so that a degenerate
//             simplex gives at worst a farther point, never a wrong one; and the iteration ends by a certified lower
//             bound from a separating plane.
#include "pairs/kernels/closest.h"

#include <algorithm>
#include <array>

namespace terrane::internal {
namespace {

struct Corner {
    Eigen::Vector3d w = Eigen::Vector3d::Zero();     ///< a minus b
    Eigen::Vector3d on_a = Eigen::Vector3d::Zero();  ///< from the centre of a
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

// From corner i to corner j, shape by shape, so that a shared vertex of a large shape cancels exactly.
Eigen::Vector3d edge_between(const Simplex& y, std::size_t i, std::size_t j) {
    return (y[j].on_a - y[i].on_a) - (y[j].on_b - y[i].on_b);
}

void take(const BarycentricPoint& mix, BarycentricPoint& best) {
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
    v -= (dot(v, e) / square) * e;  // orthogonal to the edge in spite of rounding
    return {{i, j}, {1.0 - s, s}, 2, v, dot(v, v)};
}

BarycentricPoint nearest_of_face(const Simplex& y, std::size_t i, std::size_t j, std::size_t k) {
    BarycentricPoint best = nearest_of_edge(y, i, j);
    take(nearest_of_edge(y, j, k), best);
    take(nearest_of_edge(y, k, i), best);
    // From the two shorter edges: the longer ones of a sliver are nearly parallel.
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
    take(inside, best);
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

// Nearest point of a simplex to the origin. False where the origin is inside a tetrahedron.
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
            take(nearest_of_face(y, f[0], f[1], f[2]), best);
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
    // Interior points: by the cross product, which is accurate for nearly parallel segments too.
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

}  // namespace terrane::internal
