// SPDX-License-Identifier: MIT
#include <terrane/scene/culling.h>
#include <terrane/scene/object_levels.h>
#include <terrane/terrain/progressive_mesh.h>
#include <terrane/terrain/surface_distance.h>
#include <terrane/terrain/texture_shift.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>

namespace terrane {
namespace {

// Errors of the levels relative to the size of the object: each at least kLeastLevelRatio times the previous one.
constexpr std::array kLevelErrors = {0.001, 0.003, 0.01, 0.03, 0.1};
constexpr std::size_t kBeforeImpostor = 3;  // those of them that an impostor follows
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
    const std::span<const double> errors = kLevelErrors;
    for (const double error : has_impostor ? errors.first(kBeforeImpostor) : errors) {
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

namespace {

/// Appends an attribute of a mesh of `count` vertices to the attribute of `before` vertices. A mesh without the
/// attribute gets `usual`; if both lack it, it stays empty.
template <class Value>
void append(std::vector<Value>& to, std::size_t before, const std::vector<Value>& from,
            std::size_t count, const Value& usual) {
    if (to.empty() && from.empty()) return;
    to.resize(before, usual);
    to.insert(to.end(), from.begin(), from.end());
    to.resize(before + count, usual);
}

/// Appends the vertices of a mesh. @return the mesh's triangles, as indices of `all`
std::vector<TriangleMesh::Triangle> append_vertices(TriangleMesh& all, const TriangleMesh& mesh) {
    const std::size_t before = all.positions.size(), count = mesh.positions.size();
    all.positions.insert(all.positions.end(), mesh.positions.begin(), mesh.positions.end());
    append(all.normals, before, mesh.normals, count, Eigen::Vector3f(Eigen::Vector3f::UnitZ()));
    append(all.texture_coordinates, before, mesh.texture_coordinates, count,
           Eigen::Vector2f(Eigen::Vector2f::Zero()));
    append(all.colours, before, mesh.colours, count, {255, 255, 255, 255});
    append(all.materials, before, mesh.materials, count, std::uint16_t{0});
    std::vector<TriangleMesh::Triangle> triangles = mesh.triangles;
    for (TriangleMesh::Triangle& corners : triangles) {
        for (std::uint32_t& corner : corners) corner += static_cast<std::uint32_t>(before);
    }
    return triangles;
}

}  // namespace

Result<ObjectLevels> make_object_levels(std::span<const TriangleMesh> meshes, bool has_impostor) {
    if (meshes.size() == 1) return make_object_levels(meshes[0], has_impostor);
    const auto refuse = [](std::size_t level, const std::string& what) {
        return fail(ErrorCode::invalid_argument, "level " + std::to_string(level) + " " + what);
    };
    if (meshes.empty()) return refuse(0, "is missing");
    ObjectLevels made;
    double error = 0.0;
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        const TriangleMesh& mesh = meshes[i];
        if (const Result<void> good = mesh.validate(); !good)
            return refuse(i, "is invalid: " + good.error().message);
        if (mesh.triangles.empty()) return refuse(i, "has no triangles");
        if (i > 0 && mesh.triangles.size() >= meshes[i - 1].triangles.size()) {
            return refuse(i, "has " + std::to_string(mesh.triangles.size()) +
                                 " triangles, not fewer than the " +
                                 std::to_string(meshes[i - 1].triangles.size()) +
                                 " of the level before");
        }
        if (i > 0) {
            error = std::max({bound_surface_distance(meshes[0], mesh), kLeastLevelRatio * error,
                              std::numeric_limits<double>::min()});
        }
        made.model.levels.push_back({.error_m = error,
                                     .triangles = static_cast<std::uint32_t>(mesh.triangles.size()),
                                     .mesh_level = static_cast<std::uint32_t>(i)});
        made.triangles.push_back(append_vertices(made.mesh, mesh));
        made.morph_targets.emplace_back();
    }
    made.model.bounds = bounding_box(made.mesh.positions);
    const double size = (made.model.bounds.high - made.model.bounds.low).norm();
    if (has_impostor && meshes.back().triangles.size() > 2) {
        error = std::max(kImpostorError * size, kLeastLevelRatio * error);
        made.model.impostor = ImpostorId{0};
        made.model.levels.push_back({.error_m = error, .triangles = 2, .is_impostor = true});
    }
    made.model.absence_error_m = std::max(size, kLeastLevelRatio * error);
    TERRANE_TRY(made.model.validate());
    return made;
}

}  // namespace terrane
