// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangle_mesh.h>

#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// A mesh whose vertices of equal position are merged: the topology that contractions use.
struct WeldedMesh {
    std::vector<Eigen::Vector3d> places;         ///< [places] in the order of their first vertices
    std::vector<std::uint32_t> place_of_vertex;  ///< [vertices]
    std::vector<std::uint32_t> first_vertex;     ///< [places + 1] in vertices_of_place
    /// Vertices of each place in increasing order; of those with the same attributes only the first.
    std::vector<std::uint32_t> vertices_of_place;
    std::vector<TriangleMesh::Triangle>
        triangles;                                ///< of places; only those of three different ones
    std::vector<TriangleMesh::Triangle> corners;  ///< [triangles] the same of vertices
    std::vector<std::uint32_t> input_triangles;   ///< [triangles] which of the mesh each is

    std::span<const std::uint32_t> vertices_at(std::uint32_t place) const {
        return std::span(vertices_of_place)
            .subspan(first_vertex[place], first_vertex[place + 1] - first_vertex[place]);
    }
};

/// @param mesh checked
WeldedMesh weld(const TriangleMesh& mesh);

}  // namespace terrane::internal
