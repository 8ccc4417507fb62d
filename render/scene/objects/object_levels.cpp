// SPDX-License-Identifier: MIT
#include <terrane/scene/culling.h>
#include <terrane/scene/object_levels.h>
#include <terrane/terrain/progressive_mesh.h>
#include <terrane/terrain/texture_shift.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>

namespace terrane {
namespace {

// Errors of the levels relative to the size of the object: each at least kLeastLevelRatio times the previous one.
constexpr std::array kLevelErrors = {0.001, 0.003, 0.01};
// The impostor replaces the mesh at a size of about 50 pixels, where the impostor's picture is displaced by 1 pixel.
constexpr double kImpostorError = 0.02;
// Meshes of at least this many triangles get continuous levels when near: smaller ones save too little
// (`dense_object_benchmark`).
constexpr std::size_t kLeastContinuous = 5000;
// A level must have at most this share of the previous level's triangles.
constexpr double kLeastSaving = 0.75;

}  // namespace

std::vector<MeshLevel> ObjectLevels::mesh_levels() const {
    std::vector<MeshLevel> levels;
    for (std::size_t i = 0; i < triangles.size(); ++i)
        levels.push_back({.triangles = triangles[i], .morph_targets = morph_targets[i]});
    return levels;
}

namespace {

/// Settings for a mesh with textures: its texture coordinates count as the metres that they span, and no level smears
/// them across a seam.
ProgressiveSettings textured_settings(const TriangleMesh& mesh) {
    ProgressiveSettings settings;
    const Aabb box = bounding_box(mesh.positions);
    const double size = (box.high - box.low).norm();
    settings.texture_coordinate_weight =
        size > 0.0 ? std::min(metres_per_texture_coordinate(mesh) / size, 1e3) : 0.0;
    settings.keeps_seams = true;
    return settings;
}

/// Refines a level until its texture is displaced by at most an error, by bisection of the number of triangles.
///
/// @param before number of triangles of the next finer level
void limit_texture_shift(ProgressiveMesh& progressive, double error_m, std::size_t before) {
    const auto is_good = [&](std::size_t count) {
        progressive.set_triangle_count(count);
        return texture_shift_m(progressive.finest(), progressive.triangles()) <= error_m;
    };
    std::size_t few = progressive.triangles().size(), many = before;
    if (is_good(few)) return;
    while (many - few > 1 + many / 32) {
        const std::size_t middle = few + (many - few) / 2;
        (is_good(middle) ? many : few) = middle;
    }
    progressive.set_triangle_count(many);
}

}  // namespace

Result<ObjectLevels> make_object_levels(const TriangleMesh& mesh, bool has_impostor) {
    const bool has_textures = !mesh.texture_coordinates.empty();
    TERRANE_TRY(ProgressiveMesh progressive,
                ProgressiveMesh::create(
                    mesh, has_textures ? textured_settings(mesh) : ProgressiveSettings()));
    ObjectLevels made;
    made.mesh = progressive.finest();
    if (made.mesh.triangles.empty())
        return fail(ErrorCode::invalid_argument, "an object must have triangles and an extent");
    made.model.bounds = bounding_box(made.mesh.positions);
    const double size = (made.model.bounds.high - made.model.bounds.low).norm();

    const auto add = [&](double error_m) {
        const std::span<const TriangleMesh::Triangle> triangles = progressive.triangles();
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
        progressive.set_error(error * size);
        if (has_textures) limit_texture_shift(progressive, error * size, before);
        const std::size_t count = progressive.triangles().size();
        if (count == 0 || static_cast<double>(count) > kLeastSaving * static_cast<double>(before))
            continue;
        progressive.set_triangle_count(before);
        made.morph_targets.back() = progressive.geomorph_targets(count);
        made.model.levels.back().morphs = true;
        progressive.set_triangle_count(count);
        // the limit of the contraction, not the error that it reached, so that levels keep the ratio of their errors
        add(error * size);
    }
    if (has_impostor && made.triangles.back().size() > 2) {
        made.model.impostor = ImpostorId{0};
        made.model.levels.push_back(
            {.error_m = kImpostorError * size, .triangles = 2, .is_impostor = true});
    }
    // continuous levels are chosen by the error of the shape alone
    if (made.model.levels[0].triangles >= kLeastContinuous && !has_textures) {
        made.model.continuous = std::make_shared<const ProgressiveMesh>(std::move(progressive));
    }
    made.model.absence_error_m = size;
    TERRANE_TRY(made.model.validate());
    return made;
}

}  // namespace terrane
