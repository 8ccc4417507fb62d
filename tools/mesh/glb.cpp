// SPDX-License-Identifier: MIT
//
// Sources:
//   glTF 2.0 Specification. The Khronos Group, 2021; ISO/IEC 12113:2022.
#include "mesh/glb.h"

#include "output/output_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

namespace terrane::tools {
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

// To glTF's axes: x east, y up, z south.
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
    Result<OutputFile> file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    for (const std::uint32_t word : {kMagic, kVersion, static_cast<std::uint32_t>(all_bytes),
                                     static_cast<std::uint32_t>(json.size()), kJsonChunk}) {
        file->write(bytes_of(word));
    }
    file->write(json);
    file->write(bytes_of(static_cast<std::uint32_t>(binary_bytes)));
    file->write(bytes_of(kBinaryChunk));
    for (const Point& point : positions) file->write(bytes_of(point));
    for (const auto& triangle : mesh.triangles) file->write(bytes_of(triangle));
    for (const Eigen::Vector3f& normal : mesh.normals) {
        const Eigen::Vector3f n = to_gltf(normal);
        file->write(bytes_of(Point{n.x(), n.y(), n.z()}));
    }
    return file->commit();
}

}  // namespace terrane::tools
