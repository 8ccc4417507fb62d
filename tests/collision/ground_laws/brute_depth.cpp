// SPDX-License-Identifier: MIT
#include "collision/ground_laws/brute_force.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

namespace terrane::test {
namespace {

template <class Real>
constexpr Real kFar = std::numeric_limits<Real>::max();

// Squared distance to a triangle if the projection is inside; edges are tested separately.
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

namespace {

using Real = long double;
using V = Vec<Real>;

constexpr Real kParallel = 1e-20L;  // squared sine below which directions are parallel

// A pair of features. Its gap after a translation d is n.d - b; for round features it is the length of the component of
// a + d perpendicular to `along`, less the radius.
struct Pair {
    bool is_round = false;
    V n = V::Zero();
    Real b = 0;
    V a = V::Zero(), along = V::Zero();
    Real radius = 0;

    Real gap(const V& d, V& normal_out) const {
        if (!is_round) {
            normal_out = n;
            return n.dot(d) - b;
        }
        V across = a + d;
        across -= along.dot(across) * along;
        const Real size = across.norm();
        normal_out = size > 0 ? V(across / size) : V::UnitZ();
        return size - radius;
    }
};

class Pairs {
public:
    explicit Pairs(Real largest) : largest_(largest) {}

    void add_plane(const V& n, Real b) {
        Pair pair;
        pair.n = n;
        pair.b = b;
        add(pair);
    }
    // `along` is the edge direction of one of the features, or zero.
    void add_round(const V& a, const V& along, Real radius) {
        Pair pair;
        pair.is_round = true;
        pair.a = a - along.dot(a) * along;
        pair.along = along;
        pair.radius = radius;
        add(pair);
    }
    const std::vector<Pair>& all() const { return pairs_; }

private:
    void add(const Pair& pair) {
        V normal;
        if (std::abs(pair.gap(V::Zero(), normal)) > largest_) return;
        constexpr Real kSame = 1e-14L;
        for (const Pair& other : pairs_) {
            if (other.is_round == pair.is_round && (other.n - pair.n).norm() < kSame &&
                (other.a - pair.a).norm() < kSame && std::abs(other.b - pair.b) < kSame &&
                (other.along.cross(pair.along).norm() < kSame &&
                 std::abs(other.along.norm() - pair.along.norm()) < kSame)) {
                return;
            }
        }
        pairs_.push_back(pair);
    }

    Real largest_;
    std::vector<Pair> pairs_;
};

struct Support {
    Real least = std::numeric_limits<Real>::max(), most = -std::numeric_limits<Real>::max();
};

template <class Points>
Support support(const Points& points, const V& n) {
    Support s;
    for (const V& p : points) {
        s.least = std::min(s.least, n.dot(p));
        s.most = std::max(s.most, n.dot(p));
    }
    return s;
}

void pair_with(const PosedPart<Real>& part, const SoupTriangle<Real>& t, Pairs& pairs) {
    constexpr Real kSlack = 1e-13L;
    const Real radius(part.part->radius);
    const auto add = [&](V n) {
        if (n.z() < 0) n = -n;
        pairs.add_plane(n, support(t.v, n).most - support(part.points, n).least + radius);
    };
    add((t.v[1] - t.v[0]).cross(t.v[2] - t.v[0]).normalized());
    for (const auto& [i, j, k] : part.part->triangles) {
        const V n =
            (part.points[j] - part.points[i]).cross(part.points[k] - part.points[i]).normalized();
        const Support s = support(part.points, n);
        const Real at = n.dot(part.points[i]);
        // only faces with the solid above and the outside below
        if ((n.z() > 0 && at - s.least > kSlack) || (n.z() < 0 && s.most - at > kSlack)) continue;
        if (n.z() != 0) add(n);
    }
    for (const auto& [i, j] : part.part->edges) {
        const V edge = part.points[j] - part.points[i];
        for (std::size_t k = 0; k < 3; ++k) {
            const V& a = t.v[k];
            const V& b = t.v[(k + 1) % 3];
            V n = (b - a).cross(edge);
            const Real size = n.norm();
            if (!(size > 1e-12L * edge.norm() * (b - a).norm()) || n.z() == 0) continue;
            n /= n.z() < 0 ? -size : size;
            if (support(t.v, n).most - n.dot(a) > kSlack ||
                n.dot(part.points[i]) - support(part.points, n).least > kSlack) {
                continue;
            }
            add(n);
        }
        if (radius == 0) continue;
        for (std::size_t k = 0; k < 3; ++k) {
            if (i != j) pairs.add_round(part.points[i] - t.v[k], edge.normalized(), radius);
            const V along = (t.v[(k + 1) % 3] - t.v[k]).normalized();
            for (const V& p : part.points) {
                pairs.add_round(p - t.v[k], V::Zero(), radius);
                pairs.add_round(p - t.v[k], along, radius);
            }
        }
    }
}

// The shortest translation after which one to three pairs touch, if all multipliers are >= 0.
std::optional<V> shortest_for(const std::array<const Pair*, 3>& active, std::size_t count,
                              Real largest) {
    std::array<V, 3> n;
    std::array<Real, 3> b{}, multipliers{};
    V d = V::Zero();
    bool is_straight = true;
    for (std::size_t i = 0; i < count; ++i) is_straight = is_straight && !active[i]->is_round;
    for (int round = 0; round < 60; ++round) {
        for (std::size_t i = 0; i < count; ++i) {
            const Real gap = active[i]->gap(d, n[i]);
            b[i] = n[i].dot(d) - gap;
        }
        // Solves for the multipliers of n.d = b by Cramer's rule.
        V next;
        if (count == 1) {
            multipliers[0] = b[0];
            next = b[0] * n[0];
        } else if (count == 2) {
            const Real c = n[0].dot(n[1]), determinant = n[0].cross(n[1]).squaredNorm();
            if (determinant < kParallel) return {};
            multipliers[0] = (b[0] - c * b[1]) / determinant;
            multipliers[1] = (b[1] - c * b[0]) / determinant;
            next = multipliers[0] * n[0] + multipliers[1] * n[1];
        } else {
            const V c01 = n[0].cross(n[1]), c12 = n[1].cross(n[2]), c20 = n[2].cross(n[0]);
            const Real volume = c01.dot(n[2]);
            if (volume * volume < kParallel) return {};
            next = (b[0] * c12 + b[1] * c20 + b[2] * c01) / volume;
            multipliers = {next.dot(c12) / volume, next.dot(c20) / volume, next.dot(c01) / volume};
        }
        if (!(next.squaredNorm() < 16 * largest * largest)) return {};
        const bool is_done = is_straight || (next - d).squaredNorm() < 1e-32L;
        d = next;
        if (!is_done) continue;
        for (std::size_t i = 0; i < count; ++i) {
            if (multipliers[i] < -1e-12L) return {};
        }
        if (d.squaredNorm() > largest * largest) return {};
        return d;
    }
    return {};
}

}  // namespace

long double brute_depth(const Soup& soup, const OracleShape& shape, const Pose& pose,
                        long double largest) {
    Pairs pairs(largest);
    for (const OraclePart& of : shape.parts) {
        const PosedPart<Real> part(of, pose.rotation, V::Zero());
        const V reach = V::Constant(largest);
        soup.visit<Real>(pose.translation, part.low - reach, part.high + reach,
                         part.low.z() - largest,
                         [&](const SoupTriangle<Real>& t) { pair_with(part, t, pairs); });
    }
    std::vector<V> candidates;
    const std::vector<Pair>& all = pairs.all();
    const auto take = [&](const std::array<const Pair*, 3>& active, std::size_t count) {
        if (const std::optional<V> d = shortest_for(active, count, largest)) {
            candidates.push_back(*d);
        }
    };
    for (std::size_t i = 0; i < all.size(); ++i) {
        take({&all[i]}, 1);
        for (std::size_t j = i + 1; j < all.size(); ++j) {
            take({&all[i], &all[j]}, 2);
            for (std::size_t k = j + 1; k < all.size(); ++k) take({&all[i], &all[j], &all[k]}, 3);
        }
    }
    std::sort(candidates.begin(), candidates.end(),
              [](const V& a, const V& b) { return a.squaredNorm() < b.squaredNorm(); });
    for (const V& d : candidates) {
        if (is_deeper<double>(soup, shape, pose, d.cast<double>(), 1e-8)) continue;
        if (!is_deeper<Real>(soup, shape, pose, d, 1e-12L)) return d.norm();
    }
    return std::numeric_limits<Real>::infinity();
}

// Source: I. Rechenberg. Evolutionsstrategie. 1973 (a random walk that keeps improvements; its step grows after each
// improvement and shrinks otherwise).

namespace {

struct Translation {
    Eigen::Vector3d d = Eigen::Vector3d::Zero();
    double size = 0.0;
};

}  // namespace

double sampled_depth(const Soup& soup, const OracleShape& shape, const Pose& pose, double known,
                     const SampledDepthSettings& settings, Random& random,
                     Eigen::Vector3d* best_out) {
    constexpr double kSeparatedLift = 1e-10;  // lifts up to this count as separated
    // The shortest separating translation for a horizontal offset, if shorter than `less_than`.
    const auto measure = [&](double x, double y, double less_than, Translation& out) {
        const double square = less_than * less_than - x * x - y * y;
        if (!(square > 0.0)) return false;
        const Eigen::Vector3d offset(x, y, 0.0);
        if (is_deeper<double>(soup, shape, pose, offset, std::sqrt(square))) return false;
        const double lift = brute_lift<double>(soup, shape, pose, offset, 0.0);
        out.d = {x, y, std::max(0.0, lift - kSeparatedLift)};
        out.size = out.d.norm();
        return out.size < less_than;
    };
    Translation best;
    best.size = known;
    const auto improve = [&](const Translation& found) {
        if (!(found.size < best.size)) return;
        best = found;
        if (best_out != nullptr) *best_out = found.d;
    };

    // Offsets whose translations are at most 1.2 times the known length are candidates for refinement.
    std::vector<Translation> starts;
    for (int i = 0; i < settings.samples; ++i) {
        const double angle = random.between(0.0, 6.283185307179586);
        const double r = known * std::sqrt(random.between(0.0, 1.0));
        Translation found;
        if (!measure(r * std::cos(angle), r * std::sin(angle), 1.2 * known, found)) continue;
        improve(found);
        starts.push_back(found);
    }
    std::sort(starts.begin(), starts.end(),
              [](const Translation& a, const Translation& b) { return a.size < b.size; });
    if (starts.size() > static_cast<std::size_t>(settings.starts)) {
        starts.resize(static_cast<std::size_t>(settings.starts));
    }
    for (Translation at : starts) {
        double step = 0.05 * known;
        for (int i = 0; i < settings.refinements && step > 1e-10 * known; ++i) {
            const double angle = random.between(0.0, 6.283185307179586);
            const double size = step * random.between(0.1, 1.0);
            Translation found;
            if (measure(at.d.x() + size * std::cos(angle), at.d.y() + size * std::sin(angle),
                        at.size, found)) {
                at = found;
                step *= 2.0;
            } else {
                step *= 0.84;
            }
        }
        improve(at);
    }
    return best.size;
}

}  // namespace terrane::test
