// SPDX-License-Identifier: MIT
#include "objects/object_levels.h"

#include <terrane/scene/bounds.h>
#include <terrane/terrain/simplify.h>

#include <array>
#include <utility>

namespace terrane::tools {
namespace {

// Errors of the levels over the size of the object: each at least kLeastLevelRatio of the one before.
constexpr std::array kLevelErrors = {0.001, 0.003, 0.01};
// An impostor takes over where the object is about 50 pixels large, as one whose picture is off by 1 pixel then.
constexpr double kImpostorError = 0.02;
// A level must have at most this share of the triangles of the one before.
constexpr double kLeastSaving = 0.75;

/// Without triangles that name a vertex twice, which simplify() refuses.
std::vector<TriangleMesh::Triangle> whole_triangles(const TriangleMesh& mesh) {
    std::vector<TriangleMesh::Triangle> triangles = mesh.triangles;
    std::erase_if(triangles, [](const TriangleMesh::Triangle& t) {
        return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
    });
    return triangles;
}

}  // namespace

Result<ObjectLevels> make_levels(const TriangleMesh& mesh) {
    if (const Result<void> good = check(mesh); !good) return tl::unexpected(good.error());
    ObjectLevels made;
    made.model.bounds = bounding_box(mesh.positions);
    const double size = (made.model.bounds.high - made.model.bounds.low).norm();
    const std::vector<TriangleMesh::Triangle> whole = whole_triangles(mesh);
    if (whole.empty() || !(size > 0.0))
        return fail(ErrorCode::invalid_argument, "an object must have triangles and an extent");
    std::vector<SimplifyLevel> wanted;
    for (const double error : kLevelErrors) wanted.push_back({.error_m = error * size});
    Result<std::vector<SimplifiedMesh>> simplified =
        simplify({.vertices = mesh.positions, .triangles = whole}, wanted);
    if (!simplified) return tl::unexpected(simplified.error());

    const auto add = [&](double error_m, std::vector<TriangleMesh::Triangle> triangles) {
        made.model.levels.push_back(
            {.error_m = error_m,
             .triangles = static_cast<std::uint32_t>(triangles.size()),
             .mesh_level = static_cast<std::uint32_t>(made.triangles.size())});
        made.triangles.push_back(std::move(triangles));
    };
    add(0.0, whole);
    for (std::size_t i = 0; i < simplified->size(); ++i) {
        SimplifiedMesh& level = (*simplified)[i];
        const auto before = static_cast<double>(made.triangles.back().size());
        if (level.triangles.empty() ||
            static_cast<double>(level.triangles.size()) > kLeastSaving * before)
            continue;
        // The limit that it was simplified to, so that errors keep their ratio.
        add(kLevelErrors[i] * size, std::move(level.triangles));
    }
    if (made.triangles.back().size() > 2) {
        made.model.impostor = ImpostorId{0};
        made.model.levels.push_back(
            {.error_m = kImpostorError * size, .triangles = 2, .is_impostor = true});
    }
    made.model.absence_error_m = size;
    if (const Result<void> good = check(made.model); !good) return tl::unexpected(good.error());
    return made;
}

}  // namespace terrane::tools
