// SPDX-License-Identifier: MIT
#include "brute_gap.h"

#include <Eigen/Geometry>

namespace terrane::test {
namespace {

template <class Real>
constexpr Real kFar = std::numeric_limits<Real>::max();

// Squared distance to a triangle where the projection is inside it; edges are tested separately.
template <class Real>
Real square_to_face(const Vec<Real>& p, const Vec<Real>& a, const Vec<Real>& b,
                    const Vec<Real>& c) {
    const Vec<Real> n = (b - a).cross(c - a);
    const Real size = n.squaredNorm();
    if (size == 0) return kFar<Real>;
    if (n.dot((b - a).cross(p - a)) < 0 || n.dot((c - b).cross(p - b)) < 0 ||
        n.dot((a - c).cross(p - c)) < 0) {
        return kFar<Real>;
    }
    const Real over = n.dot(p - a);
    return over * over / size;
}

template <class Real>
Real square_to_segment(const Vec<Real>& p, const Vec<Real>& a, const Vec<Real>& b) {
    const Vec<Real> along = b - a;
    const Real size = along.squaredNorm();
    const Real s = size > 0 ? std::clamp((p - a).dot(along) / size, Real(0), Real(1)) : Real(0);
    return (a + s * along - p).squaredNorm();
}

template <class Real>
Real square_of_segments(const Vec<Real>& a, const Vec<Real>& b, const Vec<Real>& c,
                        const Vec<Real>& d) {
    Real best = std::min({square_to_segment(a, c, d), square_to_segment(b, c, d),
                          square_to_segment(c, a, b), square_to_segment(d, a, b)});
    const Vec<Real> u = b - a, v = d - c, n = u.cross(v);
    const Real size = n.squaredNorm();
    if (!(size > Real(1e-24) * u.squaredNorm() * v.squaredNorm())) return best;
    const Real s = (c - a).cross(v).dot(n) / size, t = (c - a).cross(u).dot(n) / size;
    if (s > 0 && s < 1 && t > 0 && t < 1) {
        best = std::min(best, (a + s * u - c - t * v).squaredNorm());
    }
    return best;
}

}  // namespace

template <class Real>
Real brute_gap(const Soup& soup, const OracleShape& shape, const Pose& pose, Real largest) {
    Real gap = largest;
    for (const OraclePart& of : shape.parts) {
        const PosedPart<Real> part(of, pose.rotation, Vec<Real>::Zero());
        const Real radius(of.radius);
        const Vec<Real> reach = Vec<Real>::Constant(gap);
        soup.visit<Real>(
            pose.translation, part.low - reach, part.high + reach, part.low.z() - gap,
            [&](const SoupTriangle<Real>& t) {
                const Vec<Real> low = t.v[0].cwiseMin(t.v[1]).cwiseMin(t.v[2]);
                const Vec<Real> high = t.v[0].cwiseMax(t.v[1]).cwiseMax(t.v[2]);
                const Vec<Real> apart =
                    (low - part.high).cwiseMax(part.low - high).cwiseMax(Vec<Real>::Zero());
                if (apart.squaredNorm() > gap * gap) return;
                Real square = kFar<Real>;
                for (const Vec<Real>& p : part.points) {
                    square = std::min(square, square_to_face(p, t.v[0], t.v[1], t.v[2]));
                }
                for (const auto& [i, j, k] : of.triangles) {
                    for (const Vec<Real>& v : t.v) {
                        square = std::min(square, square_to_face(v, part.points[i], part.points[j],
                                                                 part.points[k]));
                    }
                }
                for (const auto& [i, j] : of.edges) {
                    for (std::size_t k = 0; k < 3; ++k) {
                        square = std::min(square, square_of_segments(part.points[i], part.points[j],
                                                                     t.v[k], t.v[(k + 1) % 3]));
                    }
                }
                gap = std::min(gap, std::sqrt(square) - radius);
            });
    }
    return gap;
}

template double brute_gap(const Soup&, const OracleShape&, const Pose&, double);
template long double brute_gap(const Soup&, const OracleShape&, const Pose&, long double);

}  // namespace terrane::test
