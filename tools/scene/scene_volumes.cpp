// SPDX-License-Identifier: MIT
#include "scene/scene_volumes.h"

#include "options/spelling.h"
#include "query/parsing/shape_parsing.h"
#include "scene/mesh_reading.h"
#include "scene/scene_keys.h"

#if TERRANE_HAS_VOLUME
#include <terrane/collision/convex_hull.h>
#include <terrane/volume/volume_heights.h>
#endif

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

namespace terrane::tools {

#if TERRANE_HAS_VOLUME

struct SceneVolumes {
    std::vector<VolumeOperation> operations;
    std::vector<std::string> shapes;  // names of their kinds
};

namespace {

using Json = nlohmann::ordered_json;

constexpr double kFinestVoxel = 1e-3, kCoarsestVoxel = 1e3;  // metres
constexpr double kDefaultVoxel = 0.5;

Parsed<std::string> read_file_name(const Json& value, const char* kind, const std::string& folder) {
    if (!value.is_string() || value.get<std::string>().empty())
        return wrong(fmt::format("shape.{} must be a path, got {}", kind, shown(value)));
    return (std::filesystem::path(folder) / value.get<std::string>()).string();
}

Parsed<VolumeShape> read_tube(const Json& content, const std::string& path) {
    if (const Parsed<void> good = check_keys(content, path + ".shape.tube", {"path", "radius"});
        !good)
        return wrong(good.error());
    VolumeTube tube;
    const auto points = content.find("path");
    if (points == content.end() || !points->is_array())
        return wrong(path + ".shape.tube.path must be a list of points");
    for (std::size_t i = 0; i < points->size(); ++i) {
        const auto point = numbers_of<3>((*points)[i]);
        if (!point) {
            return wrong(fmt::format("{}.shape.tube.path[{}] must be 3 numbers, got {}", path, i,
                                     shown((*points)[i])));
        }
        tube.path_shape.push_back({(*point)[0], (*point)[1], (*point)[2]});
    }
    const Parsed<double> radius = read_number(content, "radius");
    if (!radius) return wrong(path + ".shape.tube." + radius.error());
    tube.radius = *radius;
    return VolumeShape(std::move(tube));
}

Parsed<VolumeShape> read_mesh_shape(const Json& content, const std::string& path,
                                    const std::string& folder) {
    const Parsed<std::string> file = read_file_name(content, "mesh", folder);
    if (!file) return wrong(path + "." + file.error());
    Result<FileMesh> mesh = read_mesh(*file);
    if (!mesh) return wrong(path + ".shape: " + mesh.error().message);
    return VolumeShape(VolumeMesh{std::move(mesh->points), std::move(mesh->triangles)});
}

/// The closed mesh of a convex hull.
VolumeMesh mesh_of(const ConvexHull& hull) {
    VolumeMesh mesh;
    const auto vertices = hull.vertices();
    mesh.points_shape.assign(vertices.begin(), vertices.end());
    for (std::size_t face = 0; face < hull.face_count(); ++face) {
        const auto corners = hull.face(face);
        for (std::size_t i = 2; i < corners.size(); ++i)
            mesh.triangles.push_back({corners[0], corners[i - 1], corners[i]});
    }
    return mesh;
}

Parsed<VolumeShape> read_volume_shape(const Json& volume, const std::string& path,
                                      const std::string& folder, std::string& kind_out) {
    const auto shape = volume.find("shape");
    if (shape == volume.end()) return wrong(path + ".shape is missing");
    if (!shape->is_object() || shape->size() != 1)
        return wrong(path + ".shape must be an object with one key, got " + shown(*shape));
    const std::string& kind = kind_out = shape->begin().key();
    const Json& content = shape->begin().value();
    const std::string inner = path + ".shape." + kind;
    if (kind == "tube") return read_tube(content, path);
    if (kind == "mesh") return read_mesh_shape(content, path, folder);
    if (kind == "vdb") {
        const Parsed<std::string> file = read_file_name(content, "vdb", folder);
        if (!file) return wrong(path + "." + file.error());
        return VolumeShape(VolumeFile{.path = *file});
    }
    const std::vector<std::pair<std::string, std::initializer_list<std::string_view>>> kinds{
        {"sphere", {"radius"}},
        {"capsule", {"radius", "half_height"}},
        {"box", {"half_extents"}},
        {"hull", {"points"}}};
    const auto known = std::ranges::find(kinds, kind, &decltype(kinds)::value_type::first);
    if (known == kinds.end()) {
        return wrong(path +
                     ".shape must be a sphere, capsule, box, hull, tube, mesh or vdb, got '" +
                     kind + "'");
    }
    if (const Parsed<void> good = check_keys(content, inner, known->second); !good)
        return wrong(good.error());
    const Parsed<Shape> convex = read_shape(volume, "shape");
    if (!convex) return wrong(path + ".shape: " + convex.error());
    if (const auto* sphere = std::get_if<Sphere>(&*convex))
        return VolumeShape(VolumeSphere{sphere->radius});
    if (const auto* capsule = std::get_if<Capsule>(&*convex))
        return VolumeShape(VolumeCapsule{capsule->radius, capsule->half_height});
    if (const auto* box = std::get_if<Box>(&*convex))
        return VolumeShape(VolumeBox{box->half_extents});
    return VolumeShape(mesh_of(std::get<ConvexHull>(*convex)));
}

Parsed<VolumeOperation> read_volume(const Json& volume, const std::string& path,
                                    const std::string& folder, std::string& kind_out) {
    if (const Parsed<void> good =
            check_keys(volume, path, {"op", "shape", "position", "rotation", "voxel_m"});
        !good) {
        return wrong(good.error());
    }
    VolumeOperation operation;
    const auto op = volume.find("op");
    if (op == volume.end()) return wrong(path + ".op is missing");
    if (*op == "remove") {
        operation.op = VolumeOp::remove;
    } else if (*op == "add") {
        operation.op = VolumeOp::add;
    } else {
        return wrong(path + ".op must be remove or add, got " + shown(*op));
    }
    Parsed<VolumeShape> shape = read_volume_shape(volume, path, folder, kind_out);
    if (!shape) return wrong(shape.error());
    operation.shape = *std::move(shape);
    const Parsed<Pose> pose = read_pose(volume, PositionAbsent::is_origin);
    if (!pose) return wrong(path + "." + pose.error());
    operation.world_from_shape = *pose;
    const Parsed<double> voxel =
        read_in_range(volume, "voxel_m", kDefaultVoxel, kFinestVoxel, kCoarsestVoxel);
    if (!voxel) return wrong(path + "." + voxel.error());
    operation.voxel = *voxel;
    if (const Result<void> good = check(operation); !good)
        return wrong(path + ": " + good.error().message);
    return operation;
}

}  // namespace

Parsed<std::shared_ptr<const SceneVolumes>> read_volumes(const Json& list,
                                                         const std::string& folder) {
    if (!list.is_array() || list.empty())
        return wrong("volumes must be a list of at least one volume, got " + shown(list));
    auto volumes = std::make_shared<SceneVolumes>();
    for (const Json& each : list) {
        const std::string path = fmt::format("volumes[{}]", volumes->operations.size());
        std::string kind;
        Parsed<VolumeOperation> operation = read_volume(each, path, folder, kind);
        if (!operation) return wrong(operation.error());
        volumes->operations.push_back(*std::move(operation));
        volumes->shapes.push_back(std::move(kind));
    }
    return std::shared_ptr<const SceneVolumes>(std::move(volumes));
}

double finest_voxel(const SceneVolumes& volumes) {
    return std::ranges::min(volumes.operations, {}, &VolumeOperation::voxel).voxel;
}

Result<std::shared_ptr<const HeightSource>> add_volumes(std::shared_ptr<const HeightSource> heights,
                                                        const SceneVolumes& volumes) {
    const Lattice& lattice = heights->lattice();
    const Result<Volumes> placed =
        Volumes::create(lattice, volumes.operations, {.level = lattice.finest_level});
    if (!placed) {
        // "volume 2: ..." of the library
        std::string message = placed.error().message;
        if (const std::size_t end = message.find(':'); message.starts_with("volume ")) {
            message = "volumes[" + message.substr(7, end - 7) + "]" + message.substr(end);
        }
        return fail(placed.error().code, message);
    }
    auto made = VolumeHeights::create(std::move(heights), *placed);
    if (!made) return tl::unexpected(made.error());
    return std::shared_ptr<const HeightSource>(*std::move(made));
}

std::vector<VolumeSummary> list_volumes(const HeightSource& with, const SceneVolumes& volumes) {
    std::vector<VolumeSummary> list;
    const auto& source = static_cast<const VolumeHeights&>(with);
    for (std::size_t i = 0; i < volumes.operations.size(); ++i) {
        list.push_back({volumes.operations[i].op == VolumeOp::remove ? "remove" : "add",
                        volumes.shapes[i], volumes.operations[i].voxel,
                        source.volumes().operations()[i].bounds()});
    }
    return list;
}

#else

struct SceneVolumes {};

Parsed<std::shared_ptr<const SceneVolumes>> read_volumes(const nlohmann::ordered_json& /*list*/,
                                                         const std::string& /*folder*/) {
    return wrong("volumes need a program that is built with TERRANE_VOLUME");
}

double finest_voxel(const SceneVolumes& /*volumes*/) { return 0.0; }

Result<std::shared_ptr<const HeightSource>> add_volumes(std::shared_ptr<const HeightSource> heights,
                                                        const SceneVolumes& /*volumes*/) {
    return heights;
}

std::vector<VolumeSummary> list_volumes(const HeightSource& /*with*/,
                                        const SceneVolumes& /*volumes*/) {
    return {};
}

#endif

}  // namespace terrane::tools
