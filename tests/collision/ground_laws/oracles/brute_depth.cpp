// SPDX-License-Identifier: MIT
#include "brute_depth.h"

#include "brute_lift.h"

#include <Eigen/Geometry>

#include <limits>
#include <optional>

namespace terrane::test {
namespace {

using Real = long double;
using V = Vec<Real>;

constexpr Real kParallel = 1e-20L;  // squared sine below which directions are parallel

// A pair of features, with their gap after a translation d: n.d - b; for round ones the length of the component of a +
// d perpendicular to `along`, less the radius.
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
    // `along` is the direction of the feature that is an edge, or zero.
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
        // only faces whose outside is down
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

// The shortest translation after which all of one to three pairs touch, if all multipliers are >= 0.
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
        // Multipliers for n.d = b, by Cramer's rule.
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

}  // namespace terrane::test
