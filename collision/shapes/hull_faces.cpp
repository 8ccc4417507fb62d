// SPDX-License-Identifier: MIT
#include "base/vector_math.h"
#include "shapes/quickhull.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace terrane::internal {
namespace {

class Merger {
public:
    Merger(const std::vector<LatticePoint>& points, const TriangleHull& hull, double tolerance)
        : points_(points),
          hull_(hull),
          tolerance_(tolerance),
          face_(hull.vertices.size(), kNone),
          inside_(points.size(), kNone) {
        for (const TriangleHull::Triangle& t : hull.vertices) {
            normals_.push_back(triangle_normal(points[t[0]], points[t[1]], points[t[2]]));
            sizes_.push_back(length(normals_.back()));
        }
    }

    std::vector<HullFace> run() {
        std::vector<std::uint32_t> order(hull_.vertices.size());
        std::iota(order.begin(), order.end(), 0u);
        std::stable_sort(order.begin(), order.end(),
                         [&](std::uint32_t a, std::uint32_t b) { return sizes_[a] > sizes_[b]; });
        std::vector<HullFace> faces;
        for (const std::uint32_t seed : order) {
            if (face_[seed] != kNone) continue;
            grow(seed);
            std::vector<std::uint32_t> loop = find_loop(seed);
            if (is_convex(loop, normals_[seed] / sizes_[seed])) {
                faces.push_back({normals_[seed] / sizes_[seed], std::move(loop)});
                continue;
            }
            for (const std::uint32_t t : members_) {
                const TriangleHull::Triangle& v = hull_.vertices[t];
                faces.push_back({normals_[t] / sizes_[t], {v[0], v[1], v[2]}});
            }
        }
        return faces;
    }

private:
    void add(std::uint32_t triangle, std::uint32_t seed) {
        face_[triangle] = seed;
        members_.push_back(triangle);
        for (const std::uint32_t vertex : hull_.vertices[triangle]) inside_[vertex] = seed;
    }

    void grow(std::uint32_t seed) {
        members_.clear();
        add(seed, seed);
        for (std::size_t i = 0; i < members_.size(); ++i) {
            for (const std::uint32_t next : hull_.across[members_[i]]) {
                if (face_[next] == kNone && is_flat(next, seed) && stays_disc(next, seed)) {
                    add(next, seed);
                }
            }
        }
    }

    bool is_flat(std::uint32_t triangle, std::uint32_t seed) const {
        const Eigen::Vector3d normal = normals_[seed] / sizes_[seed];
        const LatticePoint& origin = points_[hull_.vertices[seed][0]];
        const TriangleHull::Triangle& v = hull_.vertices[triangle];
        double longest = 0.0;
        for (std::size_t i = 0; i < 3; ++i) {
            const LatticePoint& p = points_[v[i]];
            if (std::abs(dot(normal, difference(origin, p))) > tolerance_) return false;
            longest = std::max(longest, length(difference(p, points_[v[(i + 1) % 3]])));
        }
        // A triangle with an opposite normal is on the back of the hull, or is a sliver, whose normal is unreliable.
        return dot(normal, normals_[triangle]) > 0.0 || sizes_[triangle] <= tolerance_ * longest;
    }

    // A triangle that shares one side with the face must not touch the face elsewhere, or the face would get a hole.
    bool stays_disc(std::uint32_t triangle, std::uint32_t seed) const {
        int shared = 0;
        std::uint32_t apex = kNone;
        for (std::size_t side = 0; side < 3; ++side) {
            if (face_[hull_.across[triangle][side]] != seed) continue;
            ++shared;
            apex = hull_.vertices[triangle][(side + 2) % 3];
        }
        return shared == 2 || (shared == 1 && inside_[apex] != seed);
    }

    std::vector<std::uint32_t> find_loop(std::uint32_t seed) const {
        std::uint32_t first = kNone;
        std::size_t first_side = 0;
        for (std::size_t i = 0; first == kNone; ++i) {
            for (std::size_t side = 0; side < 3; ++side) {
                if (face_[hull_.across[members_[i]][side]] == seed) continue;
                first = members_[i];
                first_side = side;
            }
        }
        std::vector<std::uint32_t> loop;
        std::uint32_t t = first;
        std::size_t side = first_side;
        do {
            loop.push_back(hull_.vertices[t][side]);
            side = (side + 1) % 3;
            // Turns about the start vertex of this side to the next side of the boundary.
            while (face_[hull_.across[t][side]] == seed) {
                const std::uint32_t vertex = hull_.vertices[t][side];
                t = hull_.across[t][side];
                side = 0;
                while (hull_.vertices[t][side] != vertex) ++side;
            }
        } while (t != first || side != first_side);
        return loop;
    }

    bool is_convex(const std::vector<std::uint32_t>& loop, const Eigen::Vector3d& normal) const {
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const LatticePoint& before = points_[loop[i]];
            const LatticePoint& at = points_[loop[(i + 1) % loop.size()]];
            const LatticePoint& after = points_[loop[(i + 2) % loop.size()]];
            const Eigen::Vector3d chord = difference(before, after);
            const double inward = dot(normal, cross(chord, difference(before, at)));
            if (inward > 4.0 * tolerance_ * length(chord)) return false;
        }
        return true;
    }

    const std::vector<LatticePoint>& points_;
    const TriangleHull& hull_;
    double tolerance_;
    std::vector<Eigen::Vector3d> normals_;  // [triangles] length: twice the area
    std::vector<double> sizes_;             // [triangles] lengths of the normals
    std::vector<std::uint32_t> face_;       // [triangles] seed of the triangle's face
    std::vector<std::uint32_t> inside_;     // [points] the last face that the point is in
    std::vector<std::uint32_t> members_;    // triangles of the growing face
};

}  // namespace

std::vector<HullFace> merge_coplanar(const std::vector<LatticePoint>& points,
                                     const TriangleHull& hull, double tolerance) {
    return Merger(points, hull, tolerance).run();
}

namespace {

// A point in the loop of a face. `before` and `after` are the neighbouring nodes of the loop.
struct Node {
    std::uint32_t point;
    std::uint32_t face;
    std::uint32_t before;
    std::uint32_t after;
};

class CollinearPointFilter {
public:
    CollinearPointFilter(const std::vector<LatticePoint>& points, double tolerance,
                         const std::vector<HullFace>& faces)
        : points_(points), tolerance_(tolerance), first_(points.size() + 1, 0) {
        for (const HullFace& face : faces) {
            sizes_.push_back(face.loop.size());
            for (const std::uint32_t point : face.loop) ++first_[point + 1];
        }
        for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
        nodes_of_.resize(first_.back());
        std::vector<std::uint32_t> filled(first_.begin(), first_.end() - 1);
        for (std::uint32_t face = 0; face < faces.size(); ++face) {
            const std::vector<std::uint32_t>& loop = faces[face].loop;
            const auto begin = static_cast<std::uint32_t>(nodes_.size());
            const auto count = static_cast<std::uint32_t>(loop.size());
            for (std::uint32_t i = 0; i < count; ++i) {
                nodes_of_[filled[loop[i]]++] = begin + i;
                nodes_.push_back(
                    {loop[i], face, begin + (i + count - 1) % count, begin + (i + 1) % count});
            }
        }
        dropped_.resize(points.size(), 0);
    }

    bool run_round() {
        bool any = false;
        std::vector<char> stays(points_.size(), 0);
        for (std::uint32_t point = 0; point < points_.size(); ++point) {
            if (dropped_[point] != 0 || stays[point] != 0 || !can_drop(point)) continue;
            any = true;
            dropped_[point] = 1;
            for (std::uint32_t i = first_[point]; i < first_[point + 1]; ++i) {
                const Node& node = nodes_[nodes_of_[i]];
                --sizes_[node.face];
                stays[nodes_[node.before].point] = 1;
                nodes_[node.before].after = node.after;
                nodes_[node.after].before = node.before;
            }
        }
        return any;
    }

    bool is_dropped(std::uint32_t point) const { return dropped_[point] != 0; }

private:
    bool can_drop(std::uint32_t point) const {
        if (first_[point + 1] - first_[point] != 2) return false;
        const Node& a = nodes_[nodes_of_[first_[point]]];
        const Node& b = nodes_[nodes_of_[first_[point] + 1]];
        const std::uint32_t from = nodes_[a.before].point;
        const std::uint32_t to = nodes_[a.after].point;
        if (nodes_[b.before].point != to || nodes_[b.after].point != from) return false;
        if (sizes_[a.face] <= 3 || sizes_[b.face] <= 3) return false;
        const Eigen::Vector3d chord = difference(points_[from], points_[to]);
        const Eigen::Vector3d along = difference(points_[from], points_[point]);
        const double share = std::clamp(dot(chord, along) / dot(chord, chord), 0.0, 1.0);
        return length(along - share * chord) <= 0.5 * tolerance_;
    }

    const std::vector<LatticePoint>& points_;
    double tolerance_;
    std::vector<Node> nodes_;
    std::vector<std::uint32_t> first_;     // [points + 1] start of a point's nodes in nodes_of_
    std::vector<std::uint32_t> nodes_of_;  // nodes, point by point
    std::vector<std::size_t> sizes_;       // [faces] points of the loop
    std::vector<char> dropped_;
};

}  // namespace

void drop_collinear_points(const std::vector<LatticePoint>& points, double tolerance,
                           std::vector<HullFace>& faces) {
    CollinearPointFilter filter(points, tolerance, faces);
    while (filter.run_round()) {
    }
    for (HullFace& face : faces) {
        std::erase_if(face.loop, [&](std::uint32_t p) { return filter.is_dropped(p); });
    }
}

}  // namespace terrane::internal
