// SPDX-License-Identifier: MIT
#include "mesh/mesh_file.h"

#include "mesh/glb.h"
#include "output/output_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iterator>

namespace terrane::tools {
namespace {

// "7", "7/7", "7//7" or "7/7/7": OBJ counts from 1, and every vertex has its own attributes.
void write_corner(const IndexedMesh& mesh, std::uint32_t vertex, fmt::memory_buffer& line) {
    const std::uint64_t number = std::uint64_t{vertex} + 1;
    fmt::format_to(std::back_inserter(line), " {}", number);
    if (!mesh.texture_coordinates.empty()) {
        fmt::format_to(std::back_inserter(line), "/{}", number);
    } else if (!mesh.normals.empty()) {
        line.push_back('/');
    }
    if (!mesh.normals.empty()) fmt::format_to(std::back_inserter(line), "/{}", number);
}

Result<void> write_obj(const IndexedMesh& mesh, const std::string& path) {
    Result<OutputFile> file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    file->write("# Terrane: metres, x east, y north, z up; counter-clockwise seen from above\n");
    fmt::memory_buffer line;
    for (std::size_t i = 0; i < mesh.vertices_world.size(); ++i) {
        const WorldPos& p_world = mesh.vertices_world[i];
        line.clear();
        fmt::format_to(std::back_inserter(line), "v {} {} {}", p_world.x(), p_world.y(),
                       p_world.z());
        if (!mesh.colours.empty()) {
            const auto& [red, green, blue, opacity] = mesh.colours[i];
            fmt::format_to(std::back_inserter(line), " {:.4f} {:.4f} {:.4f}", red / 255.0,
                           green / 255.0, blue / 255.0);
        }
        line.push_back('\n');
        file->write({line.data(), line.size()});
    }
    for (const Eigen::Vector2f& t : mesh.texture_coordinates)
        file->write(fmt::format("vt {} {}\n", t.x(), t.y()));
    for (const Eigen::Vector3f& n : mesh.normals)
        file->write(fmt::format("vn {} {} {}\n", n.x(), n.y(), n.z()));
    for (const std::array<std::uint32_t, 3>& triangle : mesh.triangles) {
        line.clear();
        line.push_back('f');
        for (const std::uint32_t vertex : triangle) write_corner(mesh, vertex, line);
        line.push_back('\n');
        file->write({line.data(), line.size()});
    }
    return file->commit();
}

}  // namespace

std::optional<MeshFormat> mesh_format(const std::string& path) {
    namespace fs = std::filesystem;
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status)) {
        return MeshFormat::ply;
    }
    std::string ending = fs::path(path).extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (ending == ".ply") return MeshFormat::ply;
    if (ending == ".obj") return MeshFormat::obj;
    if (ending == ".glb") return MeshFormat::glb;
    return std::nullopt;
}

Result<void> write_mesh(const IndexedMesh& mesh, MeshFormat format, const std::string& path) {
    switch (format) {
        case MeshFormat::obj:
            return write_obj(mesh, path);
        case MeshFormat::glb:
            return write_glb(mesh, path);
        case MeshFormat::ply:
            break;
    }
    return write_ply(mesh, path);
}

}  // namespace terrane::tools
