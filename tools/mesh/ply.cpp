// SPDX-License-Identifier: MIT
#include "mesh/ply.h"

#include "output/output_file.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <unordered_map>

namespace terrane::tools {
namespace {

// A displayed position. Chunks with different heights at one lattice point do not share the vertex, so that a crack
// shows in the file.
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

constexpr const char* kNormals = "property float nx\nproperty float ny\nproperty float nz\n";
constexpr const char* kTexture = "property float s\nproperty float t\n";
constexpr const char* kColours = "property uchar red\nproperty uchar green\nproperty uchar blue\n";

/// Appends a number in little-endian order.
template <class T>
void append(std::string& bytes, T value) {
    static_assert(std::endian::native == std::endian::little, "swap the bytes on this processor");
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.append(raw, sizeof value);
}

}  // namespace

IndexedMesh weld(const TerrainMesh& mesh) {
    IndexedMesh welded;
    if (mesh.triangle_count == 0) return welded;
    const Lattice& lattice = mesh.resident->lattice();
    // never iterated: vertices are numbered in the order of their first use by a triangle
    std::unordered_map<Bits, std::uint32_t, BitsHash> numbers;
    numbers.reserve(mesh.triangle_count);
    welded.triangles.reserve(mesh.triangle_count);
    const auto number_of = [&](const WorldPos& p_world) {
        const auto next = static_cast<std::uint32_t>(welded.vertices_world.size());
        const auto [place, is_new] = numbers.try_emplace(bits_of(p_world), next);
        if (is_new) welded.vertices_world.push_back(p_world);
        return place->second;
    };
    for (const MeshChunk& part : mesh.chunks) {
        const Chunk& chunk = *part.chunk;
        const auto number_of_sample = [&](std::uint16_t sample) {
            return number_of({lattice.x(chunk.corner.x + chunk.step * (sample % kChunkSamples)),
                              lattice.y(chunk.corner.y + chunk.step * (sample / kChunkSamples)),
                              part.displayed_height(sample, lattice.quantum)});
        };
        const std::span<const std::uint16_t> indices =
            mesh.indices.subspan(part.first_index, part.index_count);
        for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
            const std::uint32_t a = number_of_sample(indices[i]);
            const std::uint32_t b = number_of_sample(indices[i + 1]);
            const std::uint32_t c = number_of_sample(indices[i + 2]);
            welded.triangles.push_back({a, b, c});
        }
    }
    for (const MeshSolid& solid : mesh.solids) {
        const std::vector<Eigen::Vector3d>& vertices =
            solid.chunk->solid->triangles().vertices_world;
        const auto add = [&](MeshSolid::Triangles triangles) {
            for (const std::array<std::uint32_t, 3>& triangle : triangles) {
                const std::uint32_t a = number_of(vertices[triangle[0]]);
                const std::uint32_t b = number_of(vertices[triangle[1]]);
                const std::uint32_t c = number_of(vertices[triangle[2]]);
                welded.triangles.push_back({a, b, c});
            }
        };
        add(solid.triangles);
        for (const MeshSolid::Triangles& cap : solid.caps) add(cap);
    }
    return welded;
}

Result<void> write_ply(const IndexedMesh& mesh, const std::string& path) {
    Result<OutputFile> file = OutputFile::create(path);
    if (!file) return tl::unexpected<Error>(file.error());
    file->write(
        fmt::format("ply\n"
                    "format binary_little_endian 1.0\n"
                    "comment Terrane: metres, x east, y north, z up\n"
                    "element vertex {}\n"
                    "property double x\n"
                    "property double y\n"
                    "property double z\n"
                    "{}{}{}"
                    "element face {}\n"
                    "property list uchar uint vertex_indices\n"
                    "end_header\n",
                    mesh.vertices_world.size(), mesh.normals.empty() ? "" : kNormals,
                    mesh.texture_coordinates.empty() ? "" : kTexture,
                    mesh.colours.empty() ? "" : kColours, mesh.triangles.size()));
    std::string bytes;
    for (std::size_t i = 0; i < mesh.vertices_world.size(); ++i) {
        bytes.clear();
        for (int axis = 0; axis < 3; ++axis) append(bytes, mesh.vertices_world[i][axis]);
        for (int k = 0; k < 3 && !mesh.normals.empty(); ++k) append(bytes, mesh.normals[i][k]);
        for (int k = 0; k < 2 && !mesh.texture_coordinates.empty(); ++k)
            append(bytes, mesh.texture_coordinates[i][k]);
        for (std::size_t k = 0; k < 3 && !mesh.colours.empty(); ++k)
            append(bytes, mesh.colours[i][k]);
        file->write(bytes);
    }
    for (const std::array<std::uint32_t, 3>& triangle : mesh.triangles) {
        bytes.clear();
        append(bytes, std::uint8_t{3});
        for (const std::uint32_t vertex : triangle) append(bytes, vertex);
        file->write(bytes);
    }
    return file->commit();
}

}  // namespace terrane::tools
