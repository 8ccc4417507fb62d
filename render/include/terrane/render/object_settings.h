// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangle_mesh.h>

#include <array>
#include <cstdint>
#include <span>

namespace terrane {

/// A level of detail of a mesh: triangles over its vertices.
struct MeshLevel {
    std::span<const TriangleMesh::Triangle> triangles = {};  ///< indices of the mesh's vertices
    /// [vertices that the triangles have] the vertex of the next level that each one moves to, as
    /// ProgressiveMesh::geomorph_targets() says; empty: the level does not morph.
    std::span<const std::uint32_t> morph_targets = {};
};

/// Material of an object's mesh.
struct MeshMaterial {
    /// Whether back faces are drawn too, as leaves need; their normals are turned to the eye.
    bool is_two_sided = false;
    /// Red, green and blue with display gamma, 0 to 255, where the mesh has no colours.
    std::array<std::uint8_t, 3> colour{160, 160, 160};
};

/// Settings of an impostor: views of an object that are rendered in advance.
struct ImpostorSettings {
    /// Views around the object's z axis, 4 to 64. More views move less where the viewer goes around it.
    int views_around = 16;
    /// Views from level to vertically above, 1 to 16. 1: a ring, for trees that are seen from the side: the billboard
    /// turns about the object's z axis only. More: a hemisphere; from below, the level views are used.
    int views_above = 4;
    int texels =
        96;  ///< along the side of a view, 8 to 512; memory: 10.7 bytes a texel, with mipmaps
};

}  // namespace terrane
