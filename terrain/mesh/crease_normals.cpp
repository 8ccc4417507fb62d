// SPDX-License-Identifier: MIT
#include <terrane/terrain/crease_normals.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace terrane {
namespace {

/// A corner of a triangle: 3 * triangle + place.
using Corner = std::uint32_t;

/// Disjoint sets of corners; the first corner of a set names it.
class CornerGroups {
public:
    explicit CornerGroups(std::size_t count) : parent_(count) {
        std::iota(parent_.begin(), parent_.end(), 0u);
    }
    Corner first_of(Corner corner) {
        while (parent_[corner] != corner) {
            parent_[corner] = parent_[parent_[corner]];
            corner = parent_[corner];
        }
        return corner;
    }
    void join(Corner a, Corner b) {
        const auto [low, high] = std::minmax({first_of(a), first_of(b)});
        parent_[high] = low;
    }

private:
    std::vector<Corner> parent_;
};

/// Joins the corners on both sides of each edge that is no crease.
///
/// @param places [vertices] the first vertex at the same position
void join_across_edges(const TriangleMesh& mesh, const std::vector<std::uint32_t>& places,
                       const std::vector<Eigen::Vector3d>& normals, double least_cosine,
                       CornerGroups& groups) {
    // An edge of a triangle: its two vertices, the lower one first, and the corners there.
    struct Side {
        std::array<std::uint32_t, 2> vertices;
        std::array<Corner, 2> corners;
    };
    std::vector<Side> sides;
    sides.reserve(3 * mesh.triangles.size());
    for (Corner i = 0; i < mesh.triangles.size(); ++i) {
        for (Corner k = 0; k < 3; ++k) {
            Side side = {{places[mesh.triangles[i][k]], places[mesh.triangles[i][(k + 1) % 3]]},
                         {3 * i + k, 3 * i + (k + 1) % 3}};
            if (side.vertices[0] > side.vertices[1]) {
                std::swap(side.vertices[0], side.vertices[1]);
                std::swap(side.corners[0], side.corners[1]);
            }
            sides.push_back(side);
        }
    }
    std::ranges::sort(sides, {},
                      [](const Side& side) { return std::pair(side.vertices, side.corners); });
    for (std::size_t i = 1; i < sides.size(); ++i) {
        if (sides[i - 1].vertices != sides[i].vertices) continue;
        const Eigen::Vector3d &a = normals[sides[i - 1].corners[0] / 3],
                              &b = normals[sides[i].corners[0] / 3];
        // the margin is for roundings: a right angle is at most 90 degrees
        if (!(a.dot(b) >= least_cosine - 1e-9)) continue;
        groups.join(sides[i - 1].corners[0], sides[i].corners[0]);
        groups.join(sides[i - 1].corners[1], sides[i].corners[1]);
    }
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

std::vector<std::uint32_t> first_at_position(const TriangleMesh& mesh) {
    const auto less = [&](std::uint32_t a, std::uint32_t b) {
        const Eigen::Vector3d &p = mesh.positions[a], &q = mesh.positions[b];
        return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
    };
    std::vector<std::uint32_t> order(mesh.positions.size()), first(mesh.positions.size());
    std::iota(order.begin(), order.end(), 0u);
    // NaN has no order; a mesh with NaN is refused later, when its points are checked
    if (std::ranges::any_of(mesh.positions, [](const auto& p) { return p != p; })) return order;
    std::ranges::stable_sort(order, less);
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool is_same = i > 0 && mesh.positions[order[i - 1]] == mesh.positions[order[i]];
        first[order[i]] = is_same ? first[order[i - 1]] : order[i];
    }
    return first;
}

TriangleMesh with_crease_normals(const TriangleMesh& mesh, double least_cosine) {
    std::vector<Eigen::Vector3d> normals;  // [triangles] unit, or 0
    for (const auto& [a, b, c] : mesh.triangles) {
        const Eigen::Vector3d& p = mesh.positions[a];
        const Eigen::Vector3d across = (mesh.positions[b] - p).cross(mesh.positions[c] - p);
        const double size = across.norm();
        normals.emplace_back(size > 0.0 ? Eigen::Vector3d(across / size)
                                        : Eigen::Vector3d(0.0, 0.0, 0.0));
    }
    CornerGroups groups(3 * mesh.triangles.size());
    join_across_edges(mesh, first_at_position(mesh), normals, least_cosine, groups);

    TriangleMesh made = mesh;
    constexpr std::uint32_t kNone = ~std::uint32_t{0};
    // the vertices of a group, one for each of the mesh's vertices there: a list
    std::vector<std::uint32_t> first_of(3 * mesh.triangles.size(), kNone);  // [first corners]
    std::vector<std::uint32_t> next(mesh.positions.size(), kNone);          // [vertices made]
    std::vector<std::uint32_t> source(mesh.positions.size(), kNone), group(source);
    std::vector<Eigen::Vector3d> sums(first_of.size(), Eigen::Vector3d::Zero());  // [first corners]
    for (Corner corner = 0; corner < first_of.size(); ++corner) {
        const TriangleMesh::Triangle& triangle = mesh.triangles[corner / 3];
        const std::uint32_t vertex = triangle[corner % 3];
        const Corner first = groups.first_of(corner);
        std::uint32_t own = first_of[first];
        while (own != kNone && source[own] != vertex) own = next[own];
        if (own == kNone && source[vertex] == kNone) {
            own = vertex;
        } else if (own == kNone) {
            own = static_cast<std::uint32_t>(made.positions.size());
            made.positions.push_back(mesh.positions[vertex]);
            if (!mesh.colours.empty()) made.colours.push_back(mesh.colours[vertex]);
            if (!mesh.texture_coordinates.empty())
                made.texture_coordinates.push_back(mesh.texture_coordinates[vertex]);
            if (!mesh.materials.empty()) made.materials.push_back(mesh.materials[vertex]);
            next.push_back(kNone);
            source.push_back(kNone);
            group.push_back(kNone);
        }
        if (source[own] == kNone) {
            source[own] = vertex;
            group[own] = first;
            next[own] = std::exchange(first_of[first], own);
        }
        made.triangles[corner / 3][corner % 3] = own;
        const Eigen::Vector3d& p = mesh.positions[vertex];
        sums[first] += angle_between(mesh.positions[triangle[(corner + 1) % 3]] - p,
                                     mesh.positions[triangle[(corner + 2) % 3]] - p) *
                       normals[corner / 3];
    }
    for (const std::uint32_t first : group) {
        const Eigen::Vector3d sum = first == kNone ? Eigen::Vector3d(0.0, 0.0, 0.0) : sums[first];
        const double size = sum.norm();
        made.normals.push_back(size > 0.0 ? Eigen::Vector3f((sum / size).cast<float>())
                                          : Eigen::Vector3f(0.0f, 0.0f, 1.0f));
    }
    return made;
}

}  // namespace terrane
