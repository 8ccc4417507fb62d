// SPDX-License-Identifier: MIT
// Sources: C. B. Barber, D. P. Dobkin, H. Huhdanpaa. The quickhull algorithm for convex hulls. ACM
//          Trans. Mathematical Software 1996.
// Deviations: no thick facets: points lie on a lattice and the orientation predicate is exact, with doubles as a
//             filter, so that the surface is closed and convex for every input. Nearly coplanar faces are merged
//             afterwards (face_merge).
#include "shapes/hull/triangle_hull.h"

#include "base/vector_math.h"

#include <cmath>
#include <cstddef>

namespace terrane::internal {
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
        // Ten roundings of terms with a sum of at most span |w|; the bound allows sixteen.
        const double error = 0x1p-49 * face.span * sum_of_sizes(w);
        if (std::abs(distance_out) > error) return distance_out > 0.0;
        return side_of_plane(points_[face.vertices[0]], points_[face.vertices[1]],
                             points_[face.vertices[2]], points_[point]) > 0;
    }

    // Adds a point to the outside set of the first face from `first_face` on that it is above; drops it if there is
    // none.
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
