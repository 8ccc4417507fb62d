// SPDX-License-Identifier: MIT
#include "objects/object_levels.h"

#include <terrane/scene/bounds.h>
#include <terrane/terrain/progressive_mesh.h>

#include <array>
#include <memory>
#include <utility>

namespace terrane::tools {
namespace {

// Errors of the levels over the size of the object: each at least kLeastLevelRatio of the one before.
constexpr std::array kLevelErrors = {0.001, 0.003, 0.01};
// An impostor takes over where the object is about 50 pixels large, as one whose picture is off by 1 pixel then.
constexpr double kImpostorError = 0.02;
// Meshes of so many triangles have continuous levels where they are near: smaller ones save too little
// (`dense_object_benchmark`).
constexpr std::size_t kLeastContinuous = 5000;
// A level must have at most this share of the triangles of the one before.
constexpr double kLeastSaving = 0.75;

}  // namespace

std::vector<MeshLevel> ObjectLevels::mesh_levels() const {
    std::vector<MeshLevel> levels;
    for (std::size_t i = 0; i < triangles.size(); ++i)
        levels.push_back({.triangles = triangles[i], .morph_targets = morph_targets[i]});
    return levels;
}

Result<ObjectLevels> make_levels(const TriangleMesh& mesh) {
    Result<ProgressiveMesh> progressive = ProgressiveMesh::create(mesh);
    if (!progressive) return tl::unexpected(progressive.error());
    ObjectLevels made;
    made.mesh = progressive->finest();
    if (made.mesh.triangles.empty())
        return fail(ErrorCode::invalid_argument, "an object must have triangles and an extent");
    made.model.bounds = bounding_box(made.mesh.positions);
    const double size = (made.model.bounds.high - made.model.bounds.low).norm();

    const auto add = [&](double error_m) {
        const std::span<const TriangleMesh::Triangle> triangles = progressive->triangles();
        made.model.levels.push_back(
            {.error_m = error_m,
             .triangles = static_cast<std::uint32_t>(triangles.size()),
             .mesh_level = static_cast<std::uint32_t>(made.triangles.size())});
        made.triangles.emplace_back(triangles.begin(), triangles.end());
        made.morph_targets.emplace_back();
    };
    add(0.0);
    for (const double error : kLevelErrors) {
        const std::size_t before = made.triangles.back().size();
        progressive->set_error(error * size);
        const std::size_t count = progressive->triangles().size();
        if (count == 0 || static_cast<double>(count) > kLeastSaving * static_cast<double>(before))
            continue;
        progressive->set_triangle_count(before);
        made.morph_targets.back() = progressive->geomorph_targets(count);
        made.model.levels.back().morphs = true;
        progressive->set_triangle_count(count);
        // The limit that it was contracted to, so that errors keep their ratio.
        add(error * size);
    }
    if (made.triangles.back().size() > 2) {
        made.model.impostor = ImpostorId{0};
        made.model.levels.push_back(
            {.error_m = kImpostorError * size, .triangles = 2, .is_impostor = true});
    }
    if (made.model.levels[0].triangles >= kLeastContinuous) {
        made.model.continuous = std::make_shared<const ProgressiveMesh>(*std::move(progressive));
    }
    made.model.absence_error_m = size;
    if (const Result<void> good = check(made.model); !good) return tl::unexpected(good.error());
    return made;
}

}  // namespace terrane::tools
