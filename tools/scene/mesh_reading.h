// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace terrane::tools {

/// A mesh of a file: its vertices, and triangles; polygons are cut into fans.
struct FileMesh {
    std::vector<Eigen::Vector3d> points;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Reads Wavefront OBJ (positions and faces) or PLY (text or binary little-endian; element vertex with x, y, z, and
/// face with a list), chosen by the ending, .obj or .ply. Points with equal positions become one, so that files that
/// repeat the corners of each triangle are closed, too.
///
/// Fails: io for a file that cannot be read; bad_data, naming the line or the element, for one that is no such mesh
Result<FileMesh> read_mesh(const std::string& path);

}  // namespace terrane::tools
