// SPDX-License-Identifier: MIT
#include "mesh/ply.h"

#include "output/output_file.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <unordered_map>

namespace terrane::tools {
namespace {

// A displayed sample. Chunks with different heights at one lattice point do not share the vertex, so that a crack
// shows in the file.
struct Shown {
    LatticePoint point;
    std::uint64_t height_bits = 0;
    friend bool operator==(const Shown&, const Shown&) = default;
};

struct ShownHash {
    std::size_t operator()(const Shown& shown) const {
        std::uint64_t h = static_cast<std::uint64_t>(shown.point.x) * 0x9e3779b97f4a7c15u;
        h = (h ^ (h >> 29) ^ static_cast<std::uint64_t>(shown.point.y)) * 0xbf58476d1ce4e5b9u;
        return static_cast<std::size_t>(h ^ (h >> 32));
    }
};

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
    std::unordered_map<Shown, std::uint32_t, ShownHash> numbers;
    numbers.reserve(mesh.triangle_count);
    welded.triangles.reserve(mesh.triangle_count);
    for (const MeshChunk& part : mesh.chunks) {
        const Chunk& chunk = *part.chunk;
        const auto number_of = [&](std::uint16_t sample) {
            const int column = sample % kChunkSamples;
            const int row = sample / kChunkSamples;
            const LatticePoint point{chunk.corner.x + chunk.step * column,
                                     chunk.corner.y + chunk.step * row};
            // + 0.0 turns -0.0 into +0.0
            const double height = part.displayed_height(sample, lattice.quantum) + 0.0;
            const auto next = static_cast<std::uint32_t>(welded.vertices_world.size());
            const auto [place, is_new] =
                numbers.try_emplace({point, std::bit_cast<std::uint64_t>(height)}, next);
            if (is_new) {
                welded.vertices_world.emplace_back(lattice.x(point.x), lattice.y(point.y), height);
            }
            return place->second;
        };
        const std::span<const std::uint16_t> indices =
            mesh.indices.subspan(part.first_index, part.index_count);
        for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
            const std::uint32_t a = number_of(indices[i]);
            const std::uint32_t b = number_of(indices[i + 1]);
            const std::uint32_t c = number_of(indices[i + 2]);
            welded.triangles.push_back({a, b, c});
        }
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
                    "element face {}\n"
                    "property list uchar uint vertex_indices\n"
                    "end_header\n",
                    mesh.vertices_world.size(), mesh.triangles.size()));
    std::string bytes;
    for (const WorldPos& p_world : mesh.vertices_world) {
        bytes.clear();
        for (int axis = 0; axis < 3; ++axis) append(bytes, p_world[axis]);
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
