// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangulator.h>

#include <string>
#include <vector>

namespace terrane::bench {

/// A frame's mesh that outlives the next update().
class MeshCopy {
public:
    MeshCopy() = default;
    explicit MeshCopy(const TerrainMesh& mesh);
    MeshCopy(MeshCopy&&) noexcept = default;
    MeshCopy& operator=(MeshCopy&&) noexcept = default;

    /// As a mesh again, valid as long as the copy is.
    TerrainMesh view() const;
    bool is_empty() const { return parts.empty(); }

    std::vector<MeshChunk> parts;  ///< their offsets point into `offsets`
    std::vector<std::uint16_t> indices;
    std::vector<std::vector<float>> offsets;  ///< of each part; empty where it has none

private:
    TerrainMesh numbers_;
};

/// What differs between two meshes of the same resident set, or "" where nothing does: chunks and
/// their order, triangles, offsets of the samples that are used, bit for bit, error_px, status.
std::string find_difference(const TerrainMesh& a, const TerrainMesh& b);

}  // namespace terrane::bench
