// SPDX-License-Identifier: MIT
#include "volume/frame_mesh.h"

#include <algorithm>
#include <limits>
#include <map>
#include <sstream>
#include <utility>

namespace terrane::test {
namespace {

double distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                           const Eigen::Vector3d& b) {
    const Eigen::Vector3d along = b - a;
    const double square = along.squaredNorm();
    const double t = square > 0.0 ? std::clamp((p - a).dot(along) / square, 0.0, 1.0) : 0.0;
    return (p - a - t * along).norm();
}

}  // namespace

double distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                            const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    const double square = normal.squaredNorm();
    const double of_edges = std::min(
        {distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
    if (square == 0.0) return of_edges;
    const bool is_over = (b - a).cross(p - a).dot(normal) >= 0.0 &&
                         (c - b).cross(p - b).dot(normal) >= 0.0 &&
                         (a - c).cross(p - c).dot(normal) >= 0.0;
    return is_over ? std::abs((p - a).dot(normal)) / std::sqrt(square) : of_edges;
}

FrameMesh::FrameMesh(const TerrainMesh& mesh) {
    std::map<std::array<double, 3>, std::uint32_t> numbers;
    const auto number_of = [&](const WorldPos& p) {
        const auto next = static_cast<std::uint32_t>(positions.size());
        const auto [found, is_new] = numbers.try_emplace({p.x(), p.y(), p.z()}, next);
        if (is_new) positions.push_back(p);
        return found->second;
    };
    if (mesh.resident == nullptr) return;
    const Lattice& lattice = mesh.resident->lattice();
    for (const MeshChunk& part : mesh.chunks) {
        const Chunk& chunk = *part.chunk;
        const auto sample = [&](std::uint16_t i) {
            return number_of({lattice.x(chunk.corner.x + i % kChunkSamples * chunk.step),
                              lattice.y(chunk.corner.y + i / kChunkSamples * chunk.step),
                              part.displayed_height(i, lattice.quantum)});
        };
        for (std::uint32_t i = 0; i < part.index_count; i += 3) {
            const auto* corners = &mesh.indices[part.first_index + i];
            triangles.push_back({sample(corners[0]), sample(corners[1]), sample(corners[2])});
        }
    }
    for (const MeshSolid& solid : mesh.solids) {
        const auto& vertices = solid.chunk->solid->triangles().vertices_world;
        const auto add = [&](MeshSolid::Triangles of_part) {
            for (const auto& [a, b, c] : of_part) {
                triangles.push_back(
                    {number_of(vertices[a]), number_of(vertices[b]), number_of(vertices[c])});
            }
        };
        add(solid.triangles);
        for (const MeshSolid::Triangles& cap : solid.caps) add(cap);
    }
}

std::string FrameMesh::find_flaw(const TerrainMesh& mesh) const {
    std::ostringstream out;
    if (triangles.size() != mesh.triangle_count) {
        out << triangles.size() << " triangles, the mesh says " << mesh.triangle_count;
        return out.str();
    }
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    edges.reserve(3 * triangles.size());
    for (const auto& [a, b, c] : triangles) {
        if (a == b || b == c || c == a) return "a triangle has two equal vertices";
        edges.insert(edges.end(), {{a, b}, {b, c}, {c, a}});
    }
    std::ranges::sort(edges);
    const Lattice& lattice = mesh.resident->lattice();
    const double west = lattice.x(lattice.west()), east = lattice.x(lattice.east());
    const double south = lattice.y(lattice.south()), north = lattice.y(lattice.north());
    const auto place = [&](std::uint32_t v) {
        out << "(" << positions[v].x() << ", " << positions[v].y() << ", " << positions[v].z()
            << ")";
    };
    for (std::size_t i = 0; i < edges.size(); ++i) {
        const auto [a, b] = edges[i];
        const bool is_double = i + 1 < edges.size() && edges[i + 1] == edges[i];
        const bool has_opposite = std::ranges::binary_search(edges, std::pair(b, a));
        if (!is_double && has_opposite) continue;
        const WorldPos &p = positions[a], &q = positions[b];
        const bool is_border =
            (p.x() == west && q.x() == west) || (p.x() == east && q.x() == east) ||
            (p.y() == south && q.y() == south) || (p.y() == north && q.y() == north);
        if (is_border && !is_double) continue;
        out << (is_double ? "two triangles on one side of the edge " : "an open edge ");
        place(a);
        out << " to ";
        place(b);
        return out.str();
    }
    return "";
}

double FrameMesh::distance(const Eigen::Vector3d& p_world) const {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [a, b, c] : triangles) {
        const WorldPos &p = positions[a], &q = positions[b], &r = positions[c];
        const Eigen::Vector3d low = p.cwiseMin(q).cwiseMin(r), high = p.cwiseMax(q).cwiseMax(r);
        const Eigen::Vector3d outside =
            (low - p_world).cwiseMax(p_world - high).cwiseMax(Eigen::Vector3d::Zero());
        if (outside.squaredNorm() >= least * least) continue;
        least = std::min(least, distance_to_triangle(p_world, p, q, r));
    }
    return least;
}

}  // namespace terrane::test
