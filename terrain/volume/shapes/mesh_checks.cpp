// SPDX-License-Identifier: MIT
#include "shapes/mesh_checks.h"

#include "base/aabb_tree.h"
#include "base/boxes.h"

#include <terrane/terrain/number_text.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace terrane::internal {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using TrianglePair = std::pair<std::uint32_t, std::uint32_t>;

Result<void> check_edges(const VolumeMesh& mesh) {
    using Edge = std::pair<std::uint32_t, std::uint32_t>;
    std::vector<Edge> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (const Triangle& triangle : mesh.triangles) {
        for (std::size_t i = 0; i < 3; ++i) edges.emplace_back(triangle[i], triangle[(i + 1) % 3]);
    }
    std::ranges::sort(edges);
    for (std::size_t i = 0; i < edges.size(); ++i) {
        const Edge& edge = edges[i];
        const char* fault = nullptr;
        if (edge.first == edge.second) fault = "has no length";
        if (i > 0 && edges[i - 1] == edge) fault = "has two triangles on one side";
        if (!std::ranges::binary_search(edges, Edge{edge.second, edge.first}))
            fault = "has one triangle";
        if (fault == nullptr) continue;
        return fail(ErrorCode::bad_data, "the mesh is not closed: its edge from point " +
                                             number_text(edge.first) + " to " +
                                             number_text(edge.second) + " " + fault);
    }
    return {};
}

/// Finds two triangles of which one has an edge that passes through the other, among those whose boxes overlap.
class CrossingSearch {
public:
    explicit CrossingSearch(const VolumeMesh& mesh)
        : mesh_(mesh), boxes_(mesh.triangles.size(), empty_box()) {
        for (std::size_t i = 0; i < boxes_.size(); ++i) {
            for (const std::uint32_t p : mesh.triangles[i])
                include(mesh.points_shape[p], 0.0, boxes_[i]);
        }
    }

    std::optional<TrianglePair> find() const {
        const std::vector<AabbNode> tree = make_aabb_tree(boxes_);
        std::optional<TrianglePair> found;
        for (std::uint32_t i = 0; i < boxes_.size() && !found; ++i) {
            visit_leaves(
                tree, [&](const Aabb& box) { return !found && overlap(box, boxes_[i], 0.0); },
                [&](std::uint32_t j) {
                    if (i < j && (pierces(i, j) || pierces(j, i))) found = TrianglePair{i, j};
                });
        }
        return found;
    }

private:
    // Whether an edge of one triangle passes through the inside of another without a common point.
    bool pierces(std::uint32_t with_edges, std::uint32_t through) const {
        const Triangle& t = mesh_.triangles[through];
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t p = mesh_.triangles[with_edges][i],
                                q = mesh_.triangles[with_edges][(i + 1) % 3];
            if (std::ranges::find(t, p) != t.end() || std::ranges::find(t, q) != t.end()) continue;
            if (side(t[0], t[1], t[2], p) * side(t[0], t[1], t[2], q) >= 0) continue;
            const int first = side(p, q, t[0], t[1]);
            if (first != 0 && first == side(p, q, t[1], t[2]) && first == side(p, q, t[2], t[0]))
                return true;
        }
        return false;
    }

    // Sign of the volume of four points; 0 where rounding may decide.
    int side(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) const {
        const Eigen::Vector3d& origin = mesh_.points_shape[a];
        const Eigen::Vector3d u = mesh_.points_shape[b] - origin,
                              v = mesh_.points_shape[c] - origin;
        const Eigen::Vector3d w = mesh_.points_shape[d] - origin;
        const double volume = dot(cross(u, v), w);
        const double noise = 1e-12 * u.lpNorm<1>() * v.lpNorm<1>() * w.lpNorm<1>();
        return volume > noise ? 1 : volume < -noise ? -1 : 0;
    }

    const VolumeMesh& mesh_;
    std::vector<Aabb> boxes_;
};

Eigen::Vector3d doubled_area(const VolumeMesh& mesh, const Triangle& triangle) {
    const Eigen::Vector3d& a = mesh.points_shape[triangle[0]];
    return cross(mesh.points_shape[triangle[1]] - a, mesh.points_shape[triangle[2]] - a);
}

}  // namespace

Result<void> check_closed(const VolumeMesh& mesh) {
    if (auto ok = check_edges(mesh); !ok) return ok;
    if (const auto pair = CrossingSearch(mesh).find()) {
        return fail(ErrorCode::bad_data,
                    "the mesh crosses itself: an edge of triangle " + number_text(pair->first) +
                        " or " + number_text(pair->second) + " passes through the other");
    }
    double volume = 0.0;
    for (const Triangle& triangle : mesh.triangles) {
        const Eigen::Vector3d from =
            mesh.points_shape[triangle[0]] - mesh.points_shape[mesh.triangles[0][0]];
        volume += dot(from, doubled_area(mesh, triangle)) / 6.0;
    }
    if (volume > 0.0) return {};
    return fail(ErrorCode::bad_data,
                "the mesh is inside out or empty: its volume is " + number_text(volume) + " m^3");
}

double surface_area(const VolumeMesh& mesh) {
    double area = 0.0;
    for (const Triangle& triangle : mesh.triangles) {
        const Eigen::Vector3d doubled = doubled_area(mesh, triangle);
        area += 0.5 * std::sqrt(dot(doubled, doubled));
    }
    return area;
}

}  // namespace terrane::internal
