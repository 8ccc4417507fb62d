// SPDX-License-Identifier: MIT
#include <terrane/terrain/number_text.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cmath>
#include <string>

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

Result<void> check(const TriangleMesh& mesh) {
    const std::size_t vertex_count = mesh.positions.size();
    if (auto ok = check_positions(mesh.positions); !ok) return ok;
    if (auto ok = check_attribute(mesh.normals, vertex_count, "normals"); !ok) return ok;
    if (auto ok = check_attribute(mesh.texture_coordinates, vertex_count, "texture_coordinates");
        !ok)
        return ok;
    if (auto ok = check_attribute(mesh.colours, vertex_count, "colours"); !ok) return ok;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (const std::uint32_t vertex : mesh.triangles[i]) {
            if (vertex < vertex_count) continue;
            return fail(ErrorCode::invalid_argument, "triangle " + number_text(i) +
                                                         " names vertex " + number_text(vertex) +
                                                         " of " + number_text(vertex_count));
        }
    }
    return {};
}

}  // namespace terrane
