// SPDX-License-Identifier: MIT
#include "volume/frame_mesh.h"

#include "support/meshes/mesh_distance.h"

#include <algorithm>
#include <map>
#include <sstream>
#include <utility>

namespace terrane::test {
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

void FrameMesh::add_finest(const Lattice& lattice, const Chunk& chunk) {
    const auto add = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                         const Eigen::Vector3d& c) {
        const auto first = static_cast<std::uint32_t>(positions.size());
        positions.insert(positions.end(), {a, b, c});
        triangles.push_back({first, first + 1, first + 2});
    };
    const auto sample = [&](int column, int row) {
        return Eigen::Vector3d(lattice.x(chunk.corner.x + column * chunk.step),
                               lattice.y(chunk.corner.y + row * chunk.step),
                               lattice.quantum * chunk.heights[sample_index(column, row)]);
    };
    for (int row = 0; row < kChunkCells; ++row) {
        for (int i = 0; i < kChunkCells; ++i) {
            const bool cut = cut_to_north_east(i, row);  // corners of chunks are even
            const std::size_t cell = cell_index(i, row);
            if (!chunk.solid || !chunk.solid->is_replaced(cell, false))
                add(sample(i, row), sample(i + 1, row), sample(cut ? i + 1 : i, row + 1));
            if (!chunk.solid || !chunk.solid->is_replaced(cell, true))
                add(sample(i, row + 1), sample(cut ? i : i + 1, row), sample(i + 1, row + 1));
        }
    }
    if (!chunk.solid) return;
    const SolidTriangles& solid = chunk.solid->triangles();
    for (const auto& [a, b, c] : solid.triangles)
        add(solid.vertices_world[a], solid.vertices_world[b], solid.vertices_world[c]);
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

FrameMesh::Nearest FrameMesh::nearest(const Eigen::Vector3d& p_world) const {
    Nearest found;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const auto& [a, b, c] = triangles[i];
        const WorldPos &p = positions[a], &q = positions[b], &r = positions[c];
        const Eigen::Vector3d low = p.cwiseMin(q).cwiseMin(r), high = p.cwiseMax(q).cwiseMax(r);
        const Eigen::Vector3d outside =
            (low - p_world).cwiseMax(p_world - high).cwiseMax(Eigen::Vector3d::Zero());
        if (outside.squaredNorm() >= found.distance * found.distance) continue;
        const double distance = distance_to_triangle(p_world, p, q, r);
        if (distance < found.distance) found = {distance, i};
    }
    return found;
}

}  // namespace terrane::test
