// SPDX-License-Identifier: MIT
#include "collision/ground_laws/brute_force.h"

namespace terrane::test {
namespace {

template <class Real>
constexpr Real kNone = -std::numeric_limits<Real>::infinity();

// Twice the signed area of (a, b, p) in the plane: >= 0 to the left of ab.
template <class Real>
Real left_of(const Vec<Real>& a, const Vec<Real>& b, const Vec<Real>& p) {
    return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
}

template <class Real>
struct Plane {
    explicit Plane(const SoupTriangle<Real>& t) : a(t.v[0]) {
        const Vec<Real> e = t.v[1] - a, f = t.v[2] - a;
        const Real area = e.x() * f.y() - e.y() * f.x();
        slope_x = (e.z() * f.y() - f.z() * e.y()) / area;
        slope_y = (f.z() * e.x() - e.z() * f.x()) / area;
    }
    Real at(Real x, Real y) const { return a.z() + slope_x * (x - a.x()) + slope_y * (y - a.y()); }
    Vec<Real> a;
    Real slope_x, slope_y;
};

template <class Real>
bool is_over(const Vec<Real>& p, const SoupTriangle<Real>& t) {
    return left_of(t.v[0], t.v[1], p) >= 0 && left_of(t.v[1], t.v[2], p) >= 0 &&
           left_of(t.v[2], t.v[0], p) >= 0;
}

template <class Real>
Real hull_lift(const PosedPart<Real>& part, const SoupTriangle<Real>& t) {
    const Plane<Real> plane(t);
    Real lift = kNone<Real>;
    for (const auto& [i, j] : part.part->edges) {
        const Vec<Real>& from = part.points[i];
        const Vec<Real>& to = part.points[j];
        Real first = 0, last = 1;
        for (std::size_t k = 0; k < 3 && first <= last; ++k) {
            const Real d0 = left_of(t.v[k], t.v[(k + 1) % 3], from);
            const Real d1 = left_of(t.v[k], t.v[(k + 1) % 3], to);
            if (d0 < 0 && d1 < 0)
                last = -1;
            else if (d0 < 0)
                first = std::max(first, d0 / (d0 - d1));
            else if (d1 < 0)
                last = std::min(last, d0 / (d0 - d1));
        }
        if (first > last) continue;
        for (const Real s : {first, last}) {
            const Vec<Real> p = from + s * (to - from);
            lift = std::max(lift, plane.at(p.x(), p.y()) - p.z());
        }
    }
    for (const Vec<Real>& v : t.v) {
        if (v.x() < part.low.x() || v.x() > part.high.x() || v.y() < part.low.y() ||
            v.y() > part.high.y()) {
            continue;
        }
        for (const auto& [i, j, k] : part.part->triangles) {
            const Vec<Real>&a = part.points[i], &b = part.points[j], &c = part.points[k];
            const Real u = left_of(b, c, v), w = left_of(c, a, v), r = left_of(a, b, v);
            const bool is_inside = (u >= 0 && w >= 0 && r >= 0) || (u <= 0 && w <= 0 && r <= 0);
            const Real area = u + w + r;
            if (!is_inside || area == 0) continue;
            lift = std::max(lift, v.z() - (u * a.z() + w * b.z() + r * c.z()) / area);
        }
    }
    return lift;
}

// The lift; if the sphere is beside the triangle, a large negative value that decreases with distance.
template <class Real>
Real sphere_lift_or_miss(const Vec<Real>& centre, Real radius, const SoupTriangle<Real>& t) {
    const Real lift = sphere_lift(centre, radius, t);
    if (lift > kNone<Real>) return lift;
    Real square = std::numeric_limits<Real>::max();
    for (std::size_t k = 0; k < 3; ++k) {
        Vec<Real> edge = t.v[(k + 1) % 3] - t.v[k], from = centre - t.v[k];
        edge.z() = from.z() = 0;
        const Real s = std::clamp(from.dot(edge) / edge.squaredNorm(), Real(0), Real(1));
        square = std::min(square, (from - s * edge).squaredNorm());
    }
    return Real(-1e30) * (1 + std::sqrt(square));
}

// The lift of the spheres along a capsule's core is concave. Lifts up to `least` need not be found, and any lift above
// `enough` may be returned.
template <class Real>
Real capsule_lift(const Vec<Real>& from, const Vec<Real>& to, Real radius,
                  const SoupTriangle<Real>& t, Real least, Real enough) {
    constexpr int kRounds = std::is_same_v<Real, double> ? 60 : 90;
    const Real golden = (std::sqrt(Real(5)) - 1) / 2;
    // Restricts the core to spheres near the triangle.
    Real low = 0, high = 1;
    for (int k = 0; k < 2; ++k) {
        const auto [least_of, most_of] = std::minmax({t.v[0][k], t.v[1][k], t.v[2][k]});
        const Real run = to[k] - from[k];
        const Real west = least_of - radius - from[k], east = most_of + radius - from[k];
        if (run == 0) {
            if (west > 0 || east < 0) return kNone<Real>;
            continue;
        }
        low = std::max(low, std::min(west / run, east / run));
        high = std::min(high, std::max(west / run, east / run));
    }
    if (low > high) return kNone<Real>;
    const Vec<Real> a = from + low * (to - from), b = from + high * (to - from);
    const Plane<Real> plane(t);
    const Real grade = std::sqrt(1 + plane.slope_x * plane.slope_x + plane.slope_y * plane.slope_y);
    const Real top = std::max({t.v[0].z(), t.v[1].z(), t.v[2].z()});
    const Real over = std::max(plane.at(a.x(), a.y()) - a.z(), plane.at(b.x(), b.y()) - b.z());
    if (std::min(over + radius * grade, top - std::min(a.z(), b.z()) + radius) <= least) {
        return kNone<Real>;
    }
    const auto lift_at = [&](Real s) {
        return sphere_lift_or_miss<Real>(from + s * (to - from), radius, t);
    };
    Real best = std::max(lift_at(low), lift_at(high));
    Real s = high - golden * (high - low), u = low + golden * (high - low);
    Real at_s = lift_at(s), at_u = lift_at(u);
    for (int round = 0; round < kRounds && best <= enough; ++round) {
        best = std::max({best, at_s, at_u});
        if (at_s < at_u) {
            low = s;
            s = u;
            at_s = at_u;
            u = low + golden * (high - low);
            at_u = lift_at(u);
        } else {
            high = u;
            u = s;
            at_u = at_s;
            s = high - golden * (high - low);
            at_s = lift_at(s);
        }
    }
    return best > Real(-1e29) ? best : kNone<Real>;
}

template <class Real>
Real part_lift(const PosedPart<Real>& part, const SoupTriangle<Real>& t, Real least, Real enough) {
    if (part.part->radius == 0.0) return hull_lift(part, t);
    const Real radius(part.part->radius);
    if (part.points.size() == 1) return sphere_lift(part.points[0], radius, t);
    return capsule_lift(part.points[0], part.points[1], radius, t, least, enough);
}

}  // namespace

template <class Real>
Real sphere_lift(const Vec<Real>& centre, Real radius, const SoupTriangle<Real>& t) {
    const Plane<Real> plane(t);
    const Real grade = std::sqrt(1 + plane.slope_x * plane.slope_x + plane.slope_y * plane.slope_y);
    const Vec<Real> lowest(centre.x() + radius * plane.slope_x / grade,
                           centre.y() + radius * plane.slope_y / grade, 0);
    if (is_over(lowest, t)) return plane.at(centre.x(), centre.y()) - centre.z() + radius * grade;
    Real lift = kNone<Real>;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec<Real>& a = t.v[k];
        const Vec<Real> edge = t.v[(k + 1) % 3] - a, from = centre - a;
        // over the corner
        const Real rest = radius * radius - from.x() * from.x() - from.y() * from.y();
        if (rest >= 0) lift = std::max(lift, a.z() - centre.z() + std::sqrt(rest));
        // over the edge: the vertical plane cuts the sphere in a disc
        const Real run = std::sqrt(edge.x() * edge.x() + edge.y() * edge.y());
        const Real aside = (edge.x() * from.y() - edge.y() * from.x()) / run;
        const Real square = radius * radius - aside * aside;
        if (square < 0) continue;
        const Real rise = edge.z() / run, slant = std::sqrt(1 + rise * rise);
        const Real foot = (edge.x() * from.x() + edge.y() * from.y()) / run;
        const Real at = foot + std::sqrt(square) * rise / slant;
        if (at < 0 || at > run) continue;
        lift = std::max(lift, a.z() + rise * foot - centre.z() + std::sqrt(square) * slant);
    }
    return lift;
}

namespace {

// The largest lift over all triangles, or the first one above `enough`.
template <class Real>
Real find_lift(const Soup& soup, const OracleShape& shape, const Pose& pose,
               const Vec<Real>& offset, Real least, Real enough) {
    Real lift = least;
    for (const OraclePart& of : shape.parts) {
        const PosedPart<Real> part(of, pose.rotation, offset);
        const Real start = std::isfinite(lift) ? part.low.z() + lift : kNone<Real>;
        soup.visit<Real>(pose.translation, part.low, part.high, start,
                         [&](const SoupTriangle<Real>& t) {
                             if (lift > enough) return;
                             const Real top = std::max({t.v[0].z(), t.v[1].z(), t.v[2].z()});
                             if (top - part.low.z() <= lift) return;
                             lift = std::max(lift, part_lift(part, t, lift, enough));
                         });
    }
    return lift;
}

}  // namespace

template <class Real>
Real brute_lift(const Soup& soup, const OracleShape& shape, const Pose& pose,
                const Vec<Real>& offset, Real least) {
    return find_lift<Real>(soup, shape, pose, offset, least, -kNone<Real>);
}

template <class Real>
bool is_deeper(const Soup& soup, const OracleShape& shape, const Pose& pose,
               const Vec<Real>& offset, Real lift) {
    return find_lift<Real>(soup, shape, pose, offset, lift, lift) > lift;
}

template double sphere_lift(const Vec<double>&, double, const SoupTriangle<double>&);
template long double sphere_lift(const Vec<long double>&, long double,
                                 const SoupTriangle<long double>&);
template double brute_lift(const Soup&, const OracleShape&, const Pose&, const Vec<double>&,
                           double);
template long double brute_lift(const Soup&, const OracleShape&, const Pose&,
                                const Vec<long double>&, long double);
template bool is_deeper(const Soup&, const OracleShape&, const Pose&, const Vec<double>&, double);
template bool is_deeper(const Soup&, const OracleShape&, const Pose&, const Vec<long double>&,
                        long double);

}  // namespace terrane::test
