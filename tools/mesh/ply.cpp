// SPDX-License-Identifier: MIT
#include "mesh/ply.h"

#include "output/output_file.h"

#include <terrane/terrain/mesh_buffers.h>

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <utility>

namespace terrane::tools {
namespace {

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

IndexedMesh weld(const TerrainMesh& mesh, Normals normals) {
    TriangleMesh expanded = expand_mesh(mesh);
    IndexedMesh welded{std::move(expanded.positions), std::move(expanded.triangles)};
    if (normals == Normals::with) welded.normals = std::move(expanded.normals);
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
