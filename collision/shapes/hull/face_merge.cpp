// SPDX-License-Identifier: MIT
#include "shapes/hull/face_merge.h"

#include "base/vector_math.h"

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
        // An opposite normal is the back of the hull, unless the triangle is a sliver without a normal.
        return dot(normal, normals_[triangle]) > 0.0 || sizes_[triangle] <= tolerance_ * longest;
    }

    // A triangle with one side in the face must not touch it elsewhere, or there would be a hole.
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
            // Around the vertex where this side begins, to the next side of the boundary.
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
    std::vector<std::uint32_t> face_;       // [triangles] seed of the face
    std::vector<std::uint32_t> inside_;     // [points] the last face that the point is in
    std::vector<std::uint32_t> members_;    // triangles of the growing face
};

}  // namespace

std::vector<HullFace> merge_coplanar(const std::vector<LatticePoint>& points,
                                     const TriangleHull& hull, double tolerance) {
    return Merger(points, hull, tolerance).run();
}

}  // namespace terrane::internal
