// SPDX-License-Identifier: MIT
#include "mesh/contractor.h"

#include <terrane/base/text.h>
#include <terrane/terrain/simplify.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cmath>
#include <string>

namespace terrane::internal {
namespace {

constexpr double kMaxCoordinate = 0x1p38;
// Corner indices have 32 bits.
constexpr std::size_t kMaxTriangles = 1'000'000'000;

Result<void> check_vertices(std::span<const Eigen::Vector3d> vertices) {
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            const double value = vertices[i][axis];
            if (std::abs(value) <= kMaxCoordinate) continue;
            return fail(ErrorCode::invalid_argument, "coordinates must be within 2^38 m, got " +
                                                         number_text(value) + " at vertex " +
                                                         number_text(i));
        }
    }
    return {};
}

Result<void> check_triangles(const SimplifyInput& input) {
    const std::size_t count = input.vertices.size();
    for (std::size_t i = 0; i < input.triangles.size(); ++i) {
        const std::array<std::uint32_t, 3>& t = input.triangles[i];
        for (const std::uint32_t vertex : t) {
            if (vertex < count) continue;
            return fail(ErrorCode::invalid_argument, "triangle " + number_text(i) +
                                                         " names vertex " + number_text(vertex) +
                                                         " of " + number_text(count));
        }
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
            return fail(ErrorCode::invalid_argument,
                        "triangle " + number_text(i) + " names vertex " +
                            number_text(t[0] == t[1] ? t[0] : t[2]) + " twice");
        }
    }
    return {};
}

Result<void> check_levels(std::span<const SimplifyLevel> levels) {
    for (std::size_t i = 0; i < levels.size(); ++i) {
        if (!(levels[i].error_m >= 0.0)) {
            return fail(ErrorCode::invalid_argument, "error_m must be at least 0, got " +
                                                         number_text(levels[i].error_m) +
                                                         " in level " + number_text(i));
        }
        if (i == 0 || levels[i].error_m >= levels[i - 1].error_m) continue;
        return fail(ErrorCode::invalid_argument, "error_m must not decrease, got " +
                                                     number_text(levels[i].error_m) + " in level " +
                                                     number_text(i) + " after " +
                                                     number_text(levels[i - 1].error_m));
    }
    return {};
}

}  // namespace

Result<void> check_sizes(std::size_t vertex_count, std::size_t triangle_count,
                         std::size_t locked_count) {
    if (locked_count != 0 && locked_count != vertex_count) {
        return fail(ErrorCode::invalid_argument, "locked must have a value for each of " +
                                                     number_text(vertex_count) + " vertices, got " +
                                                     number_text(locked_count));
    }
    if (vertex_count >= ~std::uint32_t{0} || triangle_count > kMaxTriangles) {
        return fail(
            ErrorCode::invalid_argument,
            "a mesh must have fewer than 2^32 - 1 vertices and at most 1e9 triangles, got " +
                number_text(vertex_count) + " and " + number_text(triangle_count));
    }
    return {};
}

Result<void> check_simplify_input(const SimplifyInput& input,
                                  std::span<const SimplifyLevel> levels) {
    TERRANE_TRY(check_sizes(input.vertices.size(), input.triangles.size(), input.locked.size()));
    TERRANE_TRY(check_vertices(input.vertices));
    TERRANE_TRY(check_triangles(input));
    return check_levels(levels);
}

}  // namespace terrane::internal

namespace terrane {
namespace {

template <class Attribute>
Result<void> check_attribute(const std::vector<Attribute>& values, std::size_t vertex_count,
                             const char* name) {
    if (values.empty()) return {};
    if (values.size() != vertex_count) {
        return fail(ErrorCode::invalid_argument,
                    std::string(name) + " must be none or one a vertex, got " +
                        number_text(values.size()) + " of " + number_text(vertex_count));
    }
    if constexpr (requires(const Attribute& value) { value.allFinite(); }) {
        for (std::size_t i = 0; i < values.size(); ++i) {
            if (values[i].allFinite()) continue;
            return fail(
                ErrorCode::invalid_argument,
                std::string(name) + " must be finite, got otherwise at vertex " + number_text(i));
        }
    }
    return {};
}

Result<void> check_positions(const std::vector<Eigen::Vector3d>& positions) {
    for (std::size_t i = 0; i < positions.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            const double value = positions[i][axis];
            if (std::abs(value) <= kLargestMeshCoordinate) continue;
            return fail(ErrorCode::invalid_argument,
                        "coordinates must be within " + number_text(kLargestMeshCoordinate) +
                            " m, got " + number_text(value) + " at vertex " + number_text(i));
        }
    }
    return {};
}

}  // namespace

Result<void> TriangleMesh::validate() const {
    const std::size_t vertex_count = positions.size();
    TERRANE_TRY(check_positions(positions));
    TERRANE_TRY(check_attribute(normals, vertex_count, "normals"));
    TERRANE_TRY(check_attribute(texture_coordinates, vertex_count, "texture_coordinates"));
    TERRANE_TRY(check_attribute(colours, vertex_count, "colours"));
    TERRANE_TRY(check_attribute(materials, vertex_count, "materials"));
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        for (const std::uint32_t vertex : triangles[i]) {
            if (vertex < vertex_count) continue;
            return fail(ErrorCode::invalid_argument, "triangle " + number_text(i) +
                                                         " names vertex " + number_text(vertex) +
                                                         " of " + number_text(vertex_count));
        }
    }
    return {};
}

TriangleMesh without_unused_vertices(const TriangleMesh& mesh) {
    constexpr std::uint32_t kUnused = ~std::uint32_t{0};
    std::vector<std::uint32_t> numbers(mesh.positions.size(), kUnused);
    for (const TriangleMesh::Triangle& t : mesh.triangles) {
        for (const std::uint32_t v : t) numbers[v] = 0;
    }
    TriangleMesh used;
    for (std::size_t v = 0; v < numbers.size(); ++v) {
        if (numbers[v] == kUnused) continue;
        numbers[v] = static_cast<std::uint32_t>(used.positions.size());
        used.positions.push_back(mesh.positions[v]);
        if (!mesh.normals.empty()) used.normals.push_back(mesh.normals[v]);
        if (!mesh.texture_coordinates.empty())
            used.texture_coordinates.push_back(mesh.texture_coordinates[v]);
        if (!mesh.colours.empty()) used.colours.push_back(mesh.colours[v]);
        if (!mesh.materials.empty()) used.materials.push_back(mesh.materials[v]);
    }
    used.triangles = mesh.triangles;
    for (TriangleMesh::Triangle& t : used.triangles) {
        for (std::uint32_t& v : t) v = numbers[v];
    }
    return used;
}

Result<std::vector<SimplifiedMesh>> simplify(const SimplifyInput& input,
                                             std::span<const SimplifyLevel> levels) {
    TERRANE_TRY(internal::check_simplify_input(input, levels));
    std::vector<SimplifiedMesh> result;
    result.reserve(levels.size());
    if (levels.empty()) return result;
    internal::Contractor contractor(input);
    for (const SimplifyLevel& level : levels) {
        const SimplifyStop stop = contractor.contract_to(level);
        result.push_back(contractor.result());
        result.back().stop = stop;
    }
    return result;
}

}  // namespace terrane
