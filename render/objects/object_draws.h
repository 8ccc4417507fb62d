// SPDX-License-Identifier: MIT
#pragma once

#include "objects/store/impostor_store.h"
#include "objects/store/mesh_store.h"

#include <terrane/scene/mesh_clusters.h>

#include <cstddef>
#include <cstdint>

namespace terrane::internal {

/// Triangles of one mesh for a range of a frame's instances.
struct SolidDraw {
    const StoredMesh* mesh = nullptr;
    GLuint targets = 0;  ///< buffer of the vertices that those of the mesh morph to; 0: none
    bool has_own_vertices = false, has_own_indices = false;  ///< in the frame's stream buffer
    std::size_t vertex_byte = 0, index_byte = 0;
    std::uint32_t index_count = 0, first_instance = 0, instance_count = 0;
    const MeshClusters* clusters = nullptr;        ///< of the triangles; null: all are drawn
    bool has_parts = false;                        ///< drawn by commands of SolidParts
    std::uint32_t first_part = 0, part_count = 0;  ///< of these commands
};

/// The billboards of an impostor, copied to a place of their own with the small ones first.
struct BillboardDraw {
    const StoredImpostor* impostor = nullptr;
    std::uint32_t first_instance = 0, instance_count = 0;
    std::uint32_t first_copy = 0, small_count = 0;
};

}  // namespace terrane::internal
