// SPDX-License-Identifier: MIT
#include "scene/volume_shapes.h"

#include "query/parsing/shape_parsing.h"
#include "scene/mesh/mesh_reader.h"
#include "scene/scene_keys.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

/// Where a file of a scene is.
std::string in_folder(const std::string& folder, const Json& file) {
    return (std::filesystem::path(folder) / file.get<std::string>()).string();
}

bool is_path(const Json& value) {
    return value.is_string() && !value.get_ref<const std::string&>().empty();
}

VolumeMesh mesh_of(const ConvexHull& hull) {
    VolumeMesh mesh;
    mesh.points_shape.assign(hull.vertices().begin(), hull.vertices().end());
    for (std::size_t i = 0; i < hull.face_count(); ++i) {
        const std::span<const std::uint32_t> face = hull.face(i);
        for (std::size_t k = 2; k < face.size(); ++k) {
            mesh.triangles.push_back({face[0], face[k - 1], face[k]});
        }
    }
    return mesh;
}

Parsed<VolumeShape> read_convex(const Json& volume) {
    const Parsed<Shape> shape = read_shape(volume, "shape");
    if (!shape) return wrong(shape.error());
    if (const auto* sphere = std::get_if<Sphere>(&*shape)) return VolumeSphere{sphere->radius};
    if (const auto* capsule = std::get_if<Capsule>(&*shape)) {
        return VolumeCapsule{capsule->radius, capsule->half_height};
    }
    if (const auto* box = std::get_if<Box>(&*shape)) return VolumeBox{box->half_extents};
    const auto& hull = std::get<ConvexHull>(*shape);
    if (smallest_half_extent(hull) > 0.0) return mesh_of(hull);
    return wrong("hull must have a thickness, its points lie in a plane");
}

Parsed<VolumeShape> read_tube(const Json& tube) {
    const auto path = tube.find("path");
    if (path == tube.end()) return wrong("path is missing");
    if (!path->is_array()) {
        return wrong(fmt::format("path must be a list of points, got {}", shown(*path)));
    }
    VolumeTube made;
    for (const Json& point : *path) {
        const std::optional<std::array<double, 3>> numbers = numbers_of<3>(point);
        if (!numbers) {
            return wrong(fmt::format("path[{}] must be 3 numbers, got {}", made.path_shape.size(),
                                     shown(point)));
        }
        made.path_shape.emplace_back((*numbers)[0], (*numbers)[1], (*numbers)[2]);
    }
    const Parsed<double> radius = read_number(tube, "radius");
    if (!radius) return wrong(radius.error());
    made.radius = *radius;
    return made;
}

Parsed<VolumeShape> read_mesh_shape(const std::string& file) {
    Result<TriangleMesh> mesh = read_mesh(file);
    if (!mesh) return wrong(mesh.error().message);
    return VolumeMesh{std::move(mesh->positions), std::move(mesh->triangles)};
}

}  // namespace

Parsed<SceneVolumeShape> read_volume_shape(const Json& volume, const std::string& path,
                                           const std::string& folder) {
    const auto found = volume.find("shape");
    if (found == volume.end()) return wrong(path + ".shape is missing");
    const Json& shape = *found;
    if (!shape.is_object() || shape.size() != 1) {
        return wrong(
            fmt::format("{}.shape must be an object with one key, got {}", path, shown(shape)));
    }
    SceneVolumeShape made;
    made.kind = shape.begin().key();
    const Json& content = shape.begin().value();
    const std::string inner = path + ".shape." + made.kind;
    const auto take = [&](Parsed<VolumeShape> read,
                          const std::string& at) -> Parsed<SceneVolumeShape> {
        if (!read) return wrong(fmt::format("{}: {}", at, read.error()));
        made.shape = *std::move(read);
        if (const Result<void> good = check({.shape = made.shape}); !good) {
            return wrong(fmt::format("{}: {}", at, good.error().message));
        }
        return std::move(made);
    };
    if (made.kind == "tube") {
        const Parsed<void> good = check_keys(content, inner, {"path", "radius"});
        if (!good) return wrong(good.error());
        return take(read_tube(content), inner);
    }
    if (made.kind == "mesh") {
        if (!is_path(content)) {
            return wrong(fmt::format("{} must be a path, got {}", inner, shown(content)));
        }
        made.file = in_folder(folder, content);
        return take(read_mesh_shape(made.file), inner);
    }
    if (made.kind == "vdb") {
        VolumeFile file;
        const Json* name = &content;
        if (content.is_object()) {
            const Parsed<void> good = check_keys(content, inner, {"file", "grid"});
            if (!good) return wrong(good.error());
            const auto grid = content.find("grid");
            if (grid != content.end() && !grid->is_string()) {
                return wrong(fmt::format("{}.grid must be a name, got {}", inner, shown(*grid)));
            }
            if (grid != content.end()) file.grid = grid->get<std::string>();
            if (!content.contains("file")) return wrong(inner + ".file is missing");
            name = &content.at("file");
        }
        if (!is_path(*name)) {
            return wrong(fmt::format("{} must be a path, got {}", inner, shown(*name)));
        }
        file.path = made.file = in_folder(folder, *name);
        return take(VolumeShape(std::move(file)), inner);
    }
    if (made.kind == "sphere" || made.kind == "capsule" || made.kind == "box" ||
        made.kind == "hull") {
        const Parsed<void> good = check_shape_keys(shape, path + ".shape");
        if (!good) return wrong(good.error());
        return take(read_convex(volume), path + ".shape");
    }
    return wrong(
        fmt::format("{}.shape must be sphere, capsule, box, hull, tube, mesh or vdb, got {}", path,
                    shown(made.kind)));
}

}  // namespace terrane::tools
