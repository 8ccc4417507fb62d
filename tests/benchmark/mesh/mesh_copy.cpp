// SPDX-License-Identifier: MIT
#include "mesh_copy.h"

#include <algorithm>
#include <bit>
#include <cstddef>

namespace terrane::bench {
namespace {

std::span<const std::uint16_t> indices_of(const TerrainMesh& mesh, const MeshChunk& part) {
    return mesh.indices.subspan(part.first_index, part.index_count);
}

std::string name(const ChunkKey& key) {
    return "chunk (" + std::to_string(key.x) + ", " + std::to_string(key.y) + ") of level " +
           std::to_string(key.level);
}

// Where nothing of a chunk morphs, "no offsets" says the same as offsets of zero.
float offset_of(const MeshChunk& part, std::uint16_t sample) {
    return part.offsets == nullptr ? 0.0f : part.offsets[sample];
}

}  // namespace

MeshCopy::MeshCopy(const TerrainMesh& mesh)
    : parts(mesh.chunks.begin(), mesh.chunks.end()),
      indices(mesh.indices.begin(), mesh.indices.end()),
      offsets(parts.size()),
      numbers_(mesh) {
    constexpr std::size_t kSamples = std::size_t{kChunkSamples} * kChunkSamples;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        MeshChunk& part = parts[i];
        if (part.offsets == nullptr) continue;
        offsets[i].assign(kSamples, 0.0f);
        for (const std::uint16_t sample : indices_of(mesh, part)) {
            offsets[i][sample] = part.offsets[sample];
        }
        part.offsets = offsets[i].data();
    }
}

TerrainMesh MeshCopy::view() const {
    TerrainMesh mesh = numbers_;
    mesh.chunks = parts;
    mesh.indices = indices;
    return mesh;
}

std::string find_difference(const TerrainMesh& a, const TerrainMesh& b) {
    if (a.triangle_count != b.triangle_count) {
        return std::to_string(a.triangle_count) + " and " + std::to_string(b.triangle_count) +
               " triangles";
    }
    if (a.status != b.status) return "two statuses";
    if (std::bit_cast<std::uint64_t>(a.error_px) != std::bit_cast<std::uint64_t>(b.error_px)) {
        return "error_px " + std::to_string(a.error_px) + " and " + std::to_string(b.error_px);
    }
    if (a.chunks.size() != b.chunks.size()) return "another number of chunks";
    for (std::size_t i = 0; i < a.chunks.size(); ++i) {
        const MeshChunk &from = a.chunks[i], &to = b.chunks[i];
        if (from.chunk != to.chunk) return "another order of chunks";
        const auto used = indices_of(a, from), others = indices_of(b, to);
        if (!std::ranges::equal(used, others)) return "other indices in " + name(from.chunk->key);
        for (const std::uint16_t sample : used) {
            if (std::bit_cast<std::uint32_t>(offset_of(from, sample)) !=
                std::bit_cast<std::uint32_t>(offset_of(to, sample))) {
                return "another offset of sample " + std::to_string(sample) + " in " +
                       name(from.chunk->key);
            }
        }
    }
    return "";
}

}  // namespace terrane::bench
