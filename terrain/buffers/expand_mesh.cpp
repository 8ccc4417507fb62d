// SPDX-License-Identifier: MIT
#include "buffers/vertex_normals.h"

#include <terrane/terrain/mesh_buffers.h>

#include <bit>
#include <unordered_map>
#include <vector>

namespace terrane {
namespace {

// A displayed position. Chunks with different heights at one lattice point do not share the vertex, so that a crack
// shows in the mesh.
using Bits = std::array<std::uint64_t, 3>;

Bits bits_of(const WorldPos& p_world) {
    // + 0.0 turns -0.0 into +0.0
    return {std::bit_cast<std::uint64_t>(p_world.x() + 0.0),
            std::bit_cast<std::uint64_t>(p_world.y() + 0.0),
            std::bit_cast<std::uint64_t>(p_world.z() + 0.0)};
}

struct BitsHash {
    std::size_t operator()(const Bits& bits) const {
        std::uint64_t h = bits[0] * 0x9e3779b97f4a7c15u;
        h = (h ^ (h >> 29) ^ bits[1]) * 0xbf58476d1ce4e5b9u;
        h = (h ^ (h >> 31) ^ bits[2]) * 0x94d049bb133111ebu;
        return static_cast<std::size_t>(h ^ (h >> 32));
    }
};

// Numbers vertices in the order of their first use by a triangle; the table is never iterated.
class Welder {
public:
    explicit Welder(TriangleMesh& mesh, std::size_t triangles) : mesh_(mesh) {
        numbers_.reserve(triangles);
        mesh_.triangles.reserve(triangles);
    }

    template <class Normal>
    std::uint32_t number_of(const WorldPos& p_world, const Normal& normal) {
        const auto next = static_cast<std::uint32_t>(mesh_.positions.size());
        const auto [place, is_new] = numbers_.try_emplace(bits_of(p_world), next);
        if (is_new) {
            mesh_.positions.push_back(p_world);
            mesh_.normals.push_back(normal());
        }
        return place->second;
    }

private:
    TriangleMesh& mesh_;
    std::unordered_map<Bits, std::uint32_t, BitsHash> numbers_;
};

}  // namespace

TriangleMesh expand_mesh(const TerrainMesh& mesh) {
    TriangleMesh expanded;
    if (mesh.triangle_count == 0) return expanded;
    const Lattice& lattice = mesh.resident->lattice();
    Welder welder(expanded, mesh.triangle_count);
    for (const MeshChunk& part : mesh.chunks) {
        const Chunk& chunk = *part.chunk;
        const internal::SampleNormals normals(*mesh.resident, chunk);
        const auto number_of = [&](std::uint16_t sample) {
            return welder.number_of(
                {lattice.x(chunk.corner.x + chunk.step * (sample % kChunkSamples)),
                 lattice.y(chunk.corner.y + chunk.step * (sample / kChunkSamples)),
                 part.displayed_height(sample, lattice.quantum)},
                [&] { return normals.at(sample); });
        };
        const std::span<const std::uint16_t> indices =
            mesh.indices.subspan(part.first_index, part.index_count);
        for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
            const std::uint32_t a = number_of(indices[i]);
            const std::uint32_t b = number_of(indices[i + 1]);
            const std::uint32_t c = number_of(indices[i + 2]);
            expanded.triangles.push_back({a, b, c});
        }
    }
    for (const MeshSolid& solid : mesh.solids) {
        const std::vector<Eigen::Vector3d>& vertices =
            solid.chunk->solid->triangles().vertices_world;
        const std::vector<Eigen::Vector3f> normals = internal::solid_normals(solid);
        const auto number_of = [&](std::uint32_t vertex) {
            return welder.number_of(vertices[vertex], [&] { return normals[vertex]; });
        };
        internal::visit_triangles(solid, [&](const std::array<std::uint32_t, 3>& triangle) {
            const std::uint32_t a = number_of(triangle[0]);
            const std::uint32_t b = number_of(triangle[1]);
            const std::uint32_t c = number_of(triangle[2]);
            expanded.triangles.push_back({a, b, c});
        });
    }
    return expanded;
}

}  // namespace terrane
