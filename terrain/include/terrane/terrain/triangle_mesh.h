// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>

#include <array>
#include <cstdint>
#include <vector>

namespace terrane {

/// An indexed triangle mesh of an object, with vertex attributes.
///
/// A vertex has one position and one value of each attribute. Where an attribute jumps, as at a crease, at a seam of
/// texture coordinates or between materials, several vertices have the same position.
struct TriangleMesh {
    /// Three indices of vertices.
    using Triangle = std::array<std::uint32_t, 3>;

    std::vector<Eigen::Vector3d> positions;  ///< metres, in the object's frame
    std::vector<Eigen::Vector3f> normals;    ///< [positions] unit length, or empty
    /// [positions] right and up, 0 to 1 from the lower left corner of an image to its upper right one; or empty.
    std::vector<Eigen::Vector2f> texture_coordinates;
    /// [positions] red, green, blue, opacity with display gamma, or empty.
    std::vector<std::array<std::uint8_t, 4>> colours;
    std::vector<Triangle> triangles;  ///< indices of positions; counter-clockwise from outside
    /// [positions] index of the material, or empty: 0. A triangle has the material of its first vertex.
    std::vector<std::uint16_t> materials = {};

    /// Open surfaces, non-manifold edges, unused vertices, triangles without area or with a repeated vertex are valid.
    ///
    /// Fails: invalid_argument, naming the first vertex or triangle, for a position or attribute that is not finite, a
    ///        position beyond kLargestMeshCoordinate, an attribute neither empty nor as long as positions, or an index
    ///        out of range
    Result<void> validate() const;
};

/// Largest absolute coordinate of a position, metres.
inline constexpr double kLargestMeshCoordinate = 1e6;

/// The mesh with only the vertices that its triangles use, in the same order, with their attributes and materials.
///
/// Requires: a valid mesh
/// Cost:     O(vertices + triangles)
TriangleMesh without_unused_vertices(const TriangleMesh& mesh);

}  // namespace terrane
