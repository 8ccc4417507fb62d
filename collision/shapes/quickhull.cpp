// SPDX-License-Identifier: MIT
#include "shapes/quickhull.h"

#include "base/vector_math.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace terrane::internal {
namespace {

__extension__ using Int128 = __int128;

constexpr int kBits = 60;  // differences fit 61 bits with sign, products 121, minors 122

Int128 minor(const LatticePoint& u, const LatticePoint& v, std::size_t i, std::size_t j) {
    return static_cast<Int128>(u[i]) * v[j] - static_cast<Int128>(u[j]) * v[i];
}

LatticePoint exact_difference(const LatticePoint& a, const LatticePoint& b) {
    return {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
}

}  // namespace

LatticePoints make_lattice_points(std::span<const Eigen::Vector3d> points) {
    LatticePoints result;
    Eigen::Vector3d low = points[0];
    Eigen::Vector3d high = points[0];
    for (const Eigen::Vector3d& p : points) {
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], p[axis]);
            high[axis] = std::max(high[axis], p[axis]);
            result.largest = std::max(result.largest, std::abs(p[axis]));
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        result.extent = std::max(result.extent, high[axis] - low[axis]);
    }
    int exponent = 0;
    std::frexp(result.extent, &exponent);  // extent < 2^exponent
    const int shift = kBits - exponent;
    result.spacing = std::ldexp(1.0, -shift);
    result.tolerance =
        std::min(std::ldexp(result.largest, shift - 48), std::ldexp(result.extent, shift - 35));

    std::vector<LatticePoint> lattice(points.size());
    std::vector<Eigen::Vector3d> positions(points.begin(), points.end());
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            positions[i][axis] += 0.0;
            const double along = std::ldexp(points[i][axis] - low[axis], shift);
            lattice[i][static_cast<std::size_t>(axis)] =
                static_cast<std::int64_t>(std::floor(along + 0.5));
        }
    }
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        if (lattice[a] != lattice[b]) return lattice[a] < lattice[b];
        const Eigen::Vector3d& p = positions[a];
        const Eigen::Vector3d& q = positions[b];
        if (p[0] != q[0]) return p[0] < q[0];
        if (p[1] != q[1]) return p[1] < q[1];
        return p[2] < q[2];
    });
    for (const std::size_t i : order) {
        if (!result.lattice.empty() && result.lattice.back() == lattice[i]) continue;
        result.lattice.push_back(lattice[i]);
        result.positions.push_back(positions[i]);
    }
    return result;
}

Eigen::Vector3d difference(const LatticePoint& a, const LatticePoint& b) {
    const LatticePoint d = exact_difference(a, b);
    return {static_cast<double>(d[0]), static_cast<double>(d[1]), static_cast<double>(d[2])};
}

Eigen::Vector3d triangle_normal(const LatticePoint& a, const LatticePoint& b,
                                const LatticePoint& c) {
    const LatticePoint u = exact_difference(a, b);
    const LatticePoint v = exact_difference(a, c);
    return {static_cast<double>(minor(u, v, 1, 2)), static_cast<double>(minor(u, v, 2, 0)),
            static_cast<double>(minor(u, v, 0, 1))};
}

int side_of_plane(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c,
                  const LatticePoint& d) {
    const LatticePoint u = exact_difference(a, b);
    const LatticePoint v = exact_difference(a, c);
    const LatticePoint w = exact_difference(a, d);
    // The sum is high 2^64 + low; each minor is split into its upper and lower 64 bits.
    Int128 high = 0;
    Int128 low = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const Int128 m = minor(u, v, (i + 1) % 3, (i + 2) % 3);
        high += (m >> 64) * w[i];
        low += static_cast<Int128>(static_cast<std::uint64_t>(m)) * w[i];
    }
    high += low >> 64;
    if (high != 0) return high > 0 ? 1 : -1;
    return static_cast<std::uint64_t>(low) != 0 ? 1 : 0;
}

int turn(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c, int axis) {
    const auto i = static_cast<std::size_t>((axis + 1) % 3);
    const auto j = static_cast<std::size_t>((axis + 2) % 3);
    const Int128 m = minor(exact_difference(a, b), exact_difference(a, c), i, j);
    return m > 0 ? 1 : m < 0 ? -1 : 0;
}

// Sources: A. M. Andrew. Another efficient algorithm for convex hulls in two dimensions. Information
//          Processing Letters 1979 (make_flat_faces).

namespace {

struct Farthest {
    std::uint32_t point = 0;
    double distance = -1.0;
};

// The first point with the largest `measure`.
template <class Measure>
Farthest find_farthest(std::span<const std::uint32_t> chosen, Measure measure) {
    Farthest best;
    for (const std::uint32_t point : chosen) {
        const double distance = measure(point);
        if (distance > best.distance) best = {point, distance};
    }
    return best;
}

}  // namespace

Simplex find_simplex(const std::vector<LatticePoint>& points, std::span<const std::uint32_t> chosen,
                     double tolerance) {
    Simplex simplex;
    auto& corners = simplex.corners;
    const auto from = [&](std::uint32_t origin) {
        return
            [&, origin](std::uint32_t p) { return length(difference(points[origin], points[p])); };
    };
    corners[0] = find_farthest(chosen, from(chosen[0])).point;
    const Farthest second = find_farthest(chosen, from(corners[0]));
    corners[1] = second.point;
    simplex.thickness = second.distance;
    if (second.distance <= tolerance) return simplex;

    simplex.dimension = 1;
    const LatticePoint& origin = points[corners[0]];
    const Eigen::Vector3d line = difference(origin, points[corners[1]]) / second.distance;
    const Farthest third = find_farthest(chosen, [&](std::uint32_t p) {
        return length(cross(line, difference(origin, points[p])));
    });
    corners[2] = third.point;
    simplex.thickness = third.distance;
    if (third.distance <= tolerance) return simplex;

    simplex.dimension = 2;
    Eigen::Vector3d normal = triangle_normal(origin, points[corners[1]], points[corners[2]]);
    normal /= length(normal);
    const Farthest fourth = find_farthest(chosen, [&](std::uint32_t p) {
        return std::abs(dot(normal, difference(origin, points[p])));
    });
    corners[3] = fourth.point;
    simplex.thickness = fourth.distance;
    if (fourth.distance > tolerance) simplex.dimension = 3;
    return simplex;
}

std::vector<HullFace> make_flat_faces(const std::vector<LatticePoint>& points,
                                      std::span<const std::uint32_t> chosen,
                                      const Simplex& simplex) {
    const auto& corners = simplex.corners;
    Eigen::Vector3d normal =
        triangle_normal(points[corners[0]], points[corners[1]], points[corners[2]]);
    normal /= length(normal);
    int axis = 0;
    for (int i = 1; i < 3; ++i) {
        if (std::abs(normal[i]) > std::abs(normal[axis])) axis = i;
    }
    if (normal[axis] < 0.0) normal = -normal;

    const auto u = static_cast<std::size_t>((axis + 1) % 3);
    const auto v = static_cast<std::size_t>((axis + 2) % 3);
    std::vector<std::uint32_t> sorted(chosen.begin(), chosen.end());
    std::stable_sort(sorted.begin(), sorted.end(), [&](std::uint32_t a, std::uint32_t b) {
        const LatticePoint& p = points[a];
        const LatticePoint& q = points[b];
        return p[u] != q[u] ? p[u] < q[u] : p[v] < q[v];
    });
    std::vector<std::uint32_t> loop;
    const auto walk = [&](std::uint32_t point, std::size_t first) {
        while (loop.size() >= first + 2 &&
               turn(points[loop[loop.size() - 2]], points[loop.back()], points[point], axis) <= 0) {
            loop.pop_back();
        }
        loop.push_back(point);
    };
    for (const std::uint32_t point : sorted) walk(point, 0);  // along the lower side
    const std::size_t upper = loop.size() - 1;
    for (std::size_t i = sorted.size() - 1; i-- > 0;) walk(sorted[i], upper);  // and back
    loop.pop_back();
    if (loop.size() < 3) return {};
    std::vector<HullFace> faces{{normal, loop}, {-normal, loop}};
    std::reverse(faces[1].loop.begin(), faces[1].loop.end());
    return faces;
}

// Sources: C. B. Barber, D. P. Dobkin, H. Huhdanpaa. The quickhull algorithm for convex hulls. ACM
//          Trans. Mathematical Software 1996.
// Deviations: no thick facets: points lie on a lattice and the orientation predicate is exact, with a floating-point
//             filter, so that the surface is closed and convex for every input. Nearly coplanar faces are merged
//             afterwards (merge_coplanar()).

namespace {

struct Face {
    TriangleHull::Triangle vertices{};
    TriangleHull::Triangle across{};
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // not of unit length
    double span = 0.0;                  // product of two sides' 1-norms: errors scale with it
    std::uint32_t first_above = kNone;  // head of the outside set; each point is in one face's set
    std::uint32_t farthest = kNone;     // of the outside set
    double farthest_distance = 0.0;
    bool removed = false;
    std::uint32_t seen_from = kNone;  // the apex that is_visible was computed for
    bool is_visible = false;
};

struct Horizon {
    std::uint32_t from = kNone;
    std::uint32_t to = kNone;
    std::uint32_t outside = kNone;   // the face that is kept
    std::uint32_t outside_side = 0;  // its side from `to` to `from`
};

double sum_of_sizes(const Eigen::Vector3d& v) {
    return std::abs(v[0]) + std::abs(v[1]) + std::abs(v[2]);
}

class Builder {
public:
    explicit Builder(const std::vector<LatticePoint>& points)
        : points_(points), next_(points.size(), kNone), horizon_at_(points.size(), kNone) {}

    void begin(std::array<std::uint32_t, 4> s, std::span<const std::uint32_t> chosen) {
        if (side_of_plane(points_[s[0]], points_[s[1]], points_[s[2]], points_[s[3]]) > 0) {
            std::swap(s[1], s[2]);
        }
        add_face({s[0], s[1], s[2]});
        add_face({s[0], s[3], s[1]});
        add_face({s[1], s[3], s[2]});
        add_face({s[2], s[3], s[0]});
        faces_[0].across = {1, 2, 3};
        faces_[1].across = {3, 2, 0};
        faces_[2].across = {1, 3, 0};
        faces_[3].across = {2, 1, 0};
        for (const std::uint32_t point : chosen) assign_point(point, 0);
    }

    void run() {
        for (std::uint32_t face = 0; face < faces_.size(); ++face) {
            if (!faces_[face].removed && faces_[face].farthest != kNone) add_apex(face);
        }
    }

    TriangleHull result() const {
        TriangleHull hull;
        std::vector<std::uint32_t> index(faces_.size(), kNone);
        std::uint32_t count = 0;
        for (std::size_t i = 0; i < faces_.size(); ++i) {
            if (!faces_[i].removed) index[i] = count++;
        }
        for (const Face& face : faces_) {
            if (face.removed) continue;
            hull.vertices.push_back(face.vertices);
            hull.across.push_back(
                {index[face.across[0]], index[face.across[1]], index[face.across[2]]});
        }
        return hull;
    }

private:
    void add_face(const TriangleHull::Triangle& vertices) {
        Face face;
        face.vertices = vertices;
        const Eigen::Vector3d u = difference(points_[vertices[0]], points_[vertices[1]]);
        const Eigen::Vector3d v = difference(points_[vertices[0]], points_[vertices[2]]);
        face.normal = cross(u, v);
        face.span = sum_of_sizes(u) * sum_of_sizes(v);
        faces_.push_back(face);
    }

    // Whether a point is strictly above a face (exact). The distance is approximate, for choosing the farthest point.
    bool is_above(const Face& face, std::uint32_t point, double& distance_out) const {
        const Eigen::Vector3d w = difference(points_[face.vertices[0]], points_[point]);
        distance_out = dot(face.normal, w);
        // At most ten roundings of terms whose magnitudes add up to at most span times w's 1-norm; allows sixteen.
        const double error = 0x1p-49 * face.span * sum_of_sizes(w);
        if (std::abs(distance_out) > error) return distance_out > 0.0;
        return side_of_plane(points_[face.vertices[0]], points_[face.vertices[1]],
                             points_[face.vertices[2]], points_[point]) > 0;
    }

    // Adds a point to the outside set of the first face, from `first_face` on, that the point lies above. Drops the
    // point if there is no such face.
    void assign_point(std::uint32_t point, std::uint32_t first_face) {
        for (std::uint32_t i = first_face; i < faces_.size(); ++i) {
            Face& face = faces_[i];
            double distance = 0.0;
            if (!is_above(face, point, distance)) continue;
            next_[point] = face.first_above;
            face.first_above = point;
            if (face.farthest == kNone || distance > face.farthest_distance ||
                (distance == face.farthest_distance && point < face.farthest)) {
                face.farthest = point;
                face.farthest_distance = distance;
            }
            return;
        }
    }

    bool sees(std::uint32_t apex, std::uint32_t face) {
        Face& f = faces_[face];
        if (f.seen_from != apex) {
            double distance = 0.0;
            f.seen_from = apex;
            f.is_visible = is_above(f, apex, distance);
        }
        return f.is_visible;
    }

    void find_visible(std::uint32_t apex, std::uint32_t start) {
        visible_.clear();
        horizon_.clear();
        visible_.push_back(start);
        faces_[start].removed = true;
        for (std::size_t i = 0; i < visible_.size(); ++i) {
            const std::uint32_t from = visible_[i];
            for (std::size_t side = 0; side < 3; ++side) {
                const std::uint32_t to = faces_[from].across[side];
                if (faces_[to].removed) continue;
                if (sees(apex, to)) {
                    faces_[to].removed = true;
                    visible_.push_back(to);
                    continue;
                }
                Horizon edge{faces_[from].vertices[side], faces_[from].vertices[(side + 1) % 3], to,
                             0};
                while (faces_[to].vertices[edge.outside_side] != edge.to) ++edge.outside_side;
                horizon_at_[edge.from] = static_cast<std::uint32_t>(horizon_.size());
                horizon_.push_back(edge);
            }
        }
    }

    void add_apex(std::uint32_t start) {
        const std::uint32_t apex = faces_[start].farthest;
        faces_[start].seen_from = apex;
        faces_[start].is_visible = true;
        find_visible(apex, start);
        const auto first_new = static_cast<std::uint32_t>(faces_.size());
        for (const Horizon& edge : horizon_) {
            const auto face = static_cast<std::uint32_t>(faces_.size());
            add_face({edge.from, edge.to, apex});
            faces_[face].across[0] = edge.outside;
            faces_[edge.outside].across[edge.outside_side] = face;
        }
        for (std::uint32_t i = 0; i < horizon_.size(); ++i) {
            const std::uint32_t after = horizon_at_[horizon_[i].to];
            faces_[first_new + i].across[1] = first_new + after;
            faces_[first_new + after].across[2] = first_new + i;
        }
        for (const std::uint32_t face : visible_) {
            for (std::uint32_t p = faces_[face].first_above; p != kNone;) {
                const std::uint32_t following = next_[p];
                if (p != apex) assign_point(p, first_new);
                p = following;
            }
        }
    }

    const std::vector<LatticePoint>& points_;
    std::vector<Face> faces_;
    std::vector<std::uint32_t> next_;        // [points] next in the outside set
    std::vector<std::uint32_t> horizon_at_;  // [points] horizon edge that starts at the point
    std::vector<std::uint32_t> visible_;
    std::vector<Horizon> horizon_;
};

}  // namespace

TriangleHull make_triangle_hull(const std::vector<LatticePoint>& points,
                                std::span<const std::uint32_t> chosen,
                                const std::array<std::uint32_t, 4>& simplex) {
    Builder builder(points);
    builder.begin(simplex, chosen);
    builder.run();
    return builder.result();
}

}  // namespace terrane::internal
