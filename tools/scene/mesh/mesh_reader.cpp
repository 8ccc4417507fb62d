// SPDX-License-Identifier: MIT
#include "scene/mesh/mesh_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <utility>

namespace terrane::tools {
namespace {

constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 30;

/// Lets corners refer to the first of equal points, and drops triangles that are none then.
void weld_points(TriangleMesh& mesh) {
    const auto less = [&](std::uint32_t a, std::uint32_t b) {
        const Eigen::Vector3d &p = mesh.positions[a], &q = mesh.positions[b];
        return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
    };
    std::vector<std::uint32_t> order(mesh.positions.size()), first(mesh.positions.size());
    std::iota(order.begin(), order.end(), 0u);
    // a NaN has no order; such a mesh is refused later by the check of its points
    if (std::ranges::any_of(mesh.positions, [](const auto& p) { return p != p; })) return;
    std::ranges::stable_sort(order, less);
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool is_same = i > 0 && mesh.positions[order[i - 1]] == mesh.positions[order[i]];
        first[order[i]] = is_same ? first[order[i - 1]] : order[i];
    }
    for (auto& triangle : mesh.triangles) {
        for (std::uint32_t& corner : triangle) corner = first[corner];
    }
    std::erase_if(mesh.triangles,
                  [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
}

Result<std::string> read_bytes(const std::string& path) {
    const auto cannot = [&](const std::string& why) {
        return fail(ErrorCode::io, fmt::format("cannot read mesh '{}': {}", path, why));
    };
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (!std::filesystem::is_regular_file(status)) {
        return cannot(error ? error.message() : "it is not a file");
    }
    if (const auto size = std::filesystem::file_size(path, error); error || size > kMostBytes) {
        return cannot(error ? error.message() : fmt::format("{} bytes, more than 2^30", size));
    }
    std::ifstream file(path, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (!file.good() && !file.eof()) return cannot("it cannot be opened");
    return bytes;
}

}  // namespace

Result<void> add_polygon(const std::vector<std::int64_t>& corners, TriangleMesh& mesh) {
    const auto wrong = [](std::string message) { return fail(ErrorCode::bad_data, message); };
    if (corners.size() < 3) {
        return wrong(fmt::format("a face has {} corners, fewer than 3", corners.size()));
    }
    const auto point_count = static_cast<std::int64_t>(mesh.positions.size());
    for (const std::int64_t corner : corners) {
        if (corner >= 0 && corner < point_count) continue;
        return wrong(fmt::format("a face names point {} of {}", corner, point_count));
    }
    if (corners.size() - 2 > kMostMeshParts - mesh.triangles.size()) {
        return wrong(fmt::format("it has more than {} triangles", kMostMeshParts));
    }
    for (std::size_t i = 2; i < corners.size(); ++i) {
        mesh.triangles.push_back({static_cast<std::uint32_t>(corners[0]),
                                  static_cast<std::uint32_t>(corners[i - 1]),
                                  static_cast<std::uint32_t>(corners[i])});
    }
    return {};
}

namespace {

/// @param parse Result<TriangleMesh>(std::string_view bytes, const std::string& ending)
template <class Parse>
Result<TriangleMesh> read_file(const std::string& path, const Parse& parse) {
    std::string ending = std::filesystem::path(path).extension().string();
    std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
    constexpr std::array<std::string_view, 5> kEndings = {".ply", ".obj", ".glb", ".gltf", ".stl"};
    if (std::ranges::find(kEndings, ending) == kEndings.end()) {
        return fail(ErrorCode::bad_data,
                    fmt::format("mesh '{}' must be a .ply, .obj, .glb, .gltf or .stl file", path));
    }
    const Result<std::string> bytes = read_bytes(path);
    if (!bytes) return tl::unexpected<Error>(bytes.error());
    Result<TriangleMesh> mesh = parse(*bytes, ending);
    if (!mesh) {
        return fail(mesh.error().code,
                    fmt::format("cannot read mesh '{}': {}", path, mesh.error().message));
    }
    if (!mesh->triangles.empty()) return mesh;
    return fail(ErrorCode::bad_data, fmt::format("mesh '{}' has no triangle", path));
}

}  // namespace

Result<TriangleMesh> read_mesh(const std::string& path) {
    return read_file(
        path, [](std::string_view bytes, const std::string& ending) -> Result<TriangleMesh> {
            Result<TriangleMesh> mesh = ending == ".ply" ? parse_ply(bytes)
                                        : ending == ".obj"
                                            ? parse_obj(bytes)
                                            : parse_with_assimp(bytes, ending.substr(1));
            if (!mesh) return mesh;
            mesh->normals.clear();
            mesh->texture_coordinates.clear();
            weld_points(*mesh);
            return mesh;
        });
}

Result<TriangleMesh> read_mesh_with_attributes(const std::string& path) {
    return read_file(path,
                     [](std::string_view bytes, const std::string& ending) -> Result<TriangleMesh> {
                         if (ending == ".ply") return parse_ply(bytes);
                         if (ending == ".obj") return parse_obj_with_attributes(bytes);
                         Result<TriangleMesh> mesh = parse_with_assimp(bytes, ending.substr(1));
                         if (mesh) weld_points(*mesh);
                         return mesh;
                     });
}

}  // namespace terrane::tools
