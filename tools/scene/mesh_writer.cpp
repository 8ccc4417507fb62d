// SPDX-License-Identifier: MIT
#include "program/output_file.h"
#include "scene/mesh_files.h"

#include <terrane/terrain/mesh_buffers.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <limits>
#include <utility>

namespace terrane::tools {
namespace {

constexpr const char* kNormals = "property float nx\nproperty float ny\nproperty float nz\n";
constexpr const char* kTexture = "property float s\nproperty float t\n";
constexpr const char* kColours = "property uchar red\nproperty uchar green\nproperty uchar blue\n";

/// What the coordinates of a mesh are, for a comment.
const char* describe_axes(const IndexedMesh& mesh) {
    return mesh.is_lonlat ? "x longitude, y latitude, degrees in WGS 84; z up, metres"
                          : "metres, x east, y north, z up";
}

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
    TERRANE_TRY(OutputFile file, OutputFile::create(path));
    file.write(fmt::format(
        "ply\n"
        "format binary_little_endian 1.0\n"
        "comment Terrane: {}\n"
        "element vertex {}\n"
        "property double x\n"
        "property double y\n"
        "property double z\n"
        "{}{}{}"
        "element face {}\n"
        "property list uchar uint vertex_indices\n"
        "end_header\n",
        describe_axes(mesh), mesh.vertices_world.size(), mesh.normals.empty() ? "" : kNormals,
        mesh.texture_coordinates.empty() ? "" : kTexture, mesh.colours.empty() ? "" : kColours,
        mesh.triangles.size()));
    std::string bytes;
    for (std::size_t i = 0; i < mesh.vertices_world.size(); ++i) {
        bytes.clear();
        for (int axis = 0; axis < 3; ++axis) append(bytes, mesh.vertices_world[i][axis]);
        for (int k = 0; k < 3 && !mesh.normals.empty(); ++k) append(bytes, mesh.normals[i][k]);
        for (int k = 0; k < 2 && !mesh.texture_coordinates.empty(); ++k)
            append(bytes, mesh.texture_coordinates[i][k]);
        for (std::size_t k = 0; k < 3 && !mesh.colours.empty(); ++k)
            append(bytes, mesh.colours[i][k]);
        file.write(bytes);
    }
    for (const std::array<std::uint32_t, 3>& triangle : mesh.triangles) {
        bytes.clear();
        append(bytes, std::uint8_t{3});
        for (const std::uint32_t vertex : triangle) append(bytes, vertex);
        file.write(bytes);
    }
    return file.commit();
}

// Sources:
//   glTF 2.0 Specification. The Khronos Group, 2021; ISO/IEC 12113:2022.

namespace {

static_assert(std::endian::native == std::endian::little, "glTF is little-endian");

// Constants of the specification.
constexpr std::uint32_t kMagic = 0x46546c67, kVersion = 2;
constexpr std::uint32_t kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
constexpr int kFloat = 5126, kUnsignedInt = 5125, kArrayBuffer = 34962, kElementBuffer = 34963;

template <class T>
std::string_view bytes_of(const T& value) {
    return {reinterpret_cast<const char*>(&value), sizeof value};
}

// Converts a vector to glTF's axes: x east, y up, z south.
template <class Scalar>
Eigen::Matrix<Scalar, 3, 1> to_gltf(const Eigen::Matrix<Scalar, 3, 1>& v) {
    return {v.x(), v.z(), -v.y()};
}

using Point = std::array<float, 3>;

// The JSON chunk.
std::string describe(const Eigen::Vector3d& middle, const Point& low, const Point& high,
                     std::size_t vertex_count, std::size_t index_count, bool has_normals) {
    const std::size_t position_bytes = vertex_count * sizeof(Point);
    const std::size_t index_bytes = index_count * sizeof(std::uint32_t);
    std::string json = R"({"asset":{"version":"2.0","generator":"terrane"},"scene":0,)"
                       R"("scenes":[{"nodes":[0]}],"nodes":[{"name":"terrain","mesh":0,)";
    json += fmt::format(R"("translation":[{},{},{}]}}],)", middle.x(), middle.y(), middle.z());
    json += R"("meshes":[{"primitives":[{"attributes":{"POSITION":0)";
    json += has_normals ? R"(,"NORMAL":2},"indices":1}]}],)" : R"(},"indices":1}]}],)";
    json +=
        fmt::format(R"("accessors":[{{"bufferView":0,"componentType":{},"count":{},"type":"VEC3",)"
                    R"("min":[{},{},{}],"max":[{},{},{}]}},)",
                    kFloat, vertex_count, low[0], low[1], low[2], high[0], high[1], high[2]);
    json += fmt::format(R"({{"bufferView":1,"componentType":{},"count":{},"type":"SCALAR"}})",
                        kUnsignedInt, index_count);
    if (has_normals) {
        json += fmt::format(R"(,{{"bufferView":2,"componentType":{},"count":{},"type":"VEC3"}})",
                            kFloat, vertex_count);
    }
    json += "],";
    const char* const view = R"({{"buffer":0,"byteOffset":{},"byteLength":{},"target":{}}})";
    json += R"("bufferViews":[)" +
            fmt::format(fmt::runtime(view), 0, position_bytes, kArrayBuffer) + "," +
            fmt::format(fmt::runtime(view), position_bytes, index_bytes, kElementBuffer);
    const std::size_t normal_bytes = has_normals ? position_bytes : 0;
    if (has_normals) {
        json += "," + fmt::format(fmt::runtime(view), position_bytes + index_bytes, normal_bytes,
                                  kArrayBuffer);
    }
    return json + fmt::format(R"(],"buffers":[{{"byteLength":{}}}]}})",
                              position_bytes + index_bytes + normal_bytes);
}

}  // namespace

Result<void> write_glb(const IndexedMesh& mesh, const std::string& path) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Eigen::Vector3d lowest = Eigen::Vector3d::Constant(kInfinity), highest = -lowest;
    for (const WorldPos& p_world : mesh.vertices_world) {
        lowest = lowest.cwiseMin(to_gltf(p_world));
        highest = highest.cwiseMax(to_gltf(p_world));
    }
    const Eigen::Vector3d middle = 0.5 * (lowest + highest);
    std::vector<Point> positions;
    positions.reserve(mesh.vertices_world.size());
    Point low{}, high{};
    for (const WorldPos& p_world : mesh.vertices_world) {
        const Eigen::Vector3d p = to_gltf(p_world) - middle;
        const Point point{static_cast<float>(p.x()), static_cast<float>(p.y()),
                          static_cast<float>(p.z())};
        const bool is_first = positions.empty();
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = is_first ? point[axis] : std::min(low[axis], point[axis]);
            high[axis] = is_first ? point[axis] : std::max(high[axis], point[axis]);
        }
        positions.push_back(point);
    }
    const bool has_normals = !mesh.normals.empty();
    std::string json =
        describe(middle, low, high, positions.size(), 3 * mesh.triangles.size(), has_normals);
    json.resize((json.size() + 3) / 4 * 4, ' ');  // the length of a chunk is a multiple of 4
    const std::size_t binary_bytes = (has_normals ? 2 : 1) * positions.size() * sizeof(Point) +
                                     mesh.triangles.size() * sizeof mesh.triangles.front();
    const std::size_t all_bytes = 12 + 8 + json.size() + 8 + binary_bytes;
    if (all_bytes > std::numeric_limits<std::uint32_t>::max()) {
        return fail(ErrorCode::invalid_argument,
                    fmt::format("cannot write '{}': a .glb has less than 4 GiB, got {:.4g} GiB",
                                path, static_cast<double>(all_bytes) / 0x1p30));
    }
    TERRANE_TRY(OutputFile file, OutputFile::create(path));
    for (const std::uint32_t word : {kMagic, kVersion, static_cast<std::uint32_t>(all_bytes),
                                     static_cast<std::uint32_t>(json.size()), kJsonChunk}) {
        file.write(bytes_of(word));
    }
    file.write(json);
    file.write(bytes_of(static_cast<std::uint32_t>(binary_bytes)));
    file.write(bytes_of(kBinaryChunk));
    for (const Point& point : positions) file.write(bytes_of(point));
    for (const auto& triangle : mesh.triangles) file.write(bytes_of(triangle));
    for (const Eigen::Vector3f& normal : mesh.normals) {
        const Eigen::Vector3f n = to_gltf(normal);
        file.write(bytes_of(Point{n.x(), n.y(), n.z()}));
    }
    return file.commit();
}

namespace {

// Writes a corner as "7", "7/7", "7//7" or "7/7/7": OBJ counts from 1, and every vertex has its own attributes.
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
    TERRANE_TRY(OutputFile file, OutputFile::create(path));
    file.write(fmt::format("# Terrane: {}; counter-clockwise from outside\n", describe_axes(mesh)));
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
        file.write({line.data(), line.size()});
    }
    for (const Eigen::Vector2f& t : mesh.texture_coordinates)
        file.write(fmt::format("vt {} {}\n", t.x(), t.y()));
    for (const Eigen::Vector3f& n : mesh.normals)
        file.write(fmt::format("vn {} {} {}\n", n.x(), n.y(), n.z()));
    for (const std::array<std::uint32_t, 3>& triangle : mesh.triangles) {
        line.clear();
        line.push_back('f');
        for (const std::uint32_t vertex : triangle) write_corner(mesh, vertex, line);
        line.push_back('\n');
        file.write({line.data(), line.size()});
    }
    return file.commit();
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
