// SPDX-License-Identifier: MIT
#include "scene/scene_volumes.h"

#include "program/json_values.h"
#include "scene/mesh_files.h"

#include <terrane/volume/volume_heights.h>
#include <terrane/volume/volume_shapes.h>

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace terrane::tools {

/// The shape of a volume, and the name of its kind in scene files.
struct SceneVolumeShape {
    std::string kind;  ///< sphere, capsule, box, hull, tube, mesh or vdb
    std::string file;  ///< of a mesh or vdb: its path; else ""
    VolumeShape shape;
};

/// Parses the shape of a volume; see read_volumes(). A hull becomes the closed mesh of its faces.
///
/// @param volume object with the key `shape`
/// @param path   of the volume: "volumes[2]"; errors begin with it
Parsed<SceneVolumeShape> read_volume_shape(const nlohmann::ordered_json& volume,
                                           const std::string& path, const std::string& folder);

namespace {

using Json = nlohmann::ordered_json;

/// The path of a file that a scene names, relative to the scene's folder.
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
        if (const Result<void> good = VolumeOperation{.shape = made.shape}.validate(); !good) {
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

struct SceneVolumes {
    /// Name of a volume in answers and messages.
    struct Name {
        std::string kind, file;
    };
    std::vector<VolumeOperation> operations;
    std::vector<Name> names;  // of each operation
};

struct SceneVolumeField {
    Volumes volumes;
    std::vector<SceneVolumes::Name> names;
    std::vector<Aabb> bounds_world;
};

namespace {

using Json = nlohmann::ordered_json;

constexpr double kMostVoxel = 1e5;  // metres, the limit of a volume

Parsed<VolumeOp> read_op(const Json& volume) {
    const auto found = volume.find("op");
    if (found == volume.end()) return wrong("op is missing");
    if (*found == "remove") return VolumeOp::remove;
    if (*found == "add") return VolumeOp::add;
    return wrong("op must be remove or add, got " + shown(*found));
}

Parsed<double> read_voxel(const Json& volume, double otherwise) {
    if (!volume.contains("voxel_m")) return otherwise;
    const Parsed<double> voxel = read_number(volume, "voxel_m");
    if (voxel && !(*voxel > 0.0 && *voxel <= kMostVoxel)) {
        return wrong(fmt::format("voxel_m must be above 0 and at most {:.6g}, got {:.6g}",
                                 kMostVoxel, *voxel));
    }
    return voxel;
}

/// Parses all keys of a volume except its shape. Messages begin with the key path from the volume on.
Parsed<VolumeOperation> read_operation(const Json& volume) {
    VolumeOperation operation;
    const Parsed<VolumeOp> op = read_op(volume);
    if (!op) return wrong(op.error());
    operation.op = *op;
    const Parsed<double> voxel = read_voxel(volume, operation.voxel);
    if (!voxel) return wrong(voxel.error());
    operation.voxel = *voxel;
    const Parsed<Pose> pose = read_pose(volume, PositionAbsent::is_wrong);
    if (!pose) return wrong(pose.error());
    operation.world_from_shape = *pose;
    return operation;
}

/// Name of a volume in messages: "volumes[2]", or "volumes[2], mesh 'cave.ply'" if its shape is a file.
std::string called(std::size_t index, const SceneVolumes& volumes) {
    const SceneVolumes::Name& name = volumes.names[index];
    if (name.file.empty()) return fmt::format("volumes[{}]", index);
    return fmt::format("volumes[{}], {} '{}'", index, name.kind, name.file);
}

/// Replaces the library's "volume 2: " by the scene's "volumes[2]: ".
Error in_scene(Error error, const SceneVolumes& volumes) {
    constexpr std::string_view kBegin = "volume ";
    if (!error.message.starts_with(kBegin)) return error;
    const char* const begin = error.message.data() + kBegin.size();
    const char* const end = error.message.data() + error.message.size();
    std::size_t index = 0;
    const auto [rest, fault] = std::from_chars(begin, end, index);
    if (fault != std::errc() || index >= volumes.names.size() || rest == end || *rest != ':') {
        return error;
    }
    error.message = called(index, volumes) + std::string(rest, end);
    return error;
}

/// The bounds of a placed volume. A mesh's bounds exclude the band of its level set.
Aabb bounds_of(const VolumeOperation& operation, const PlacedVolume& placed) {
    const auto* mesh = std::get_if<VolumeMesh>(&operation.shape);
    if (mesh == nullptr) return placed.bounds_world();
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Aabb box{Eigen::Vector3d::Constant(kInfinity), Eigen::Vector3d::Constant(-kInfinity)};
    for (const auto& triangle : mesh->triangles) {
        for (const std::uint32_t corner : triangle) {
            const WorldPos p_world = operation.world_from_shape * mesh->points_shape[corner];
            box.low = box.low.cwiseMin(p_world);
            box.high = box.high.cwiseMax(p_world);
        }
    }
    return box;
}

bool is_beside(const Aabb& box, const WorldRect& extent) {
    return box.high.x() < extent.west || box.low.x() > extent.east || box.high.y() < extent.south ||
           box.low.y() > extent.north;
}

Json corner_of(const WorldPos& p_world) { return {p_world.x(), p_world.y(), p_world.z()}; }

}  // namespace

Parsed<std::shared_ptr<const SceneVolumes>> read_volumes(const Json& list,
                                                         const std::string& folder) {
    if (!list.is_array()) return wrong("volumes must be a list, got " + shown(list));
    if (list.empty()) return std::shared_ptr<const SceneVolumes>();
    auto volumes = std::make_shared<SceneVolumes>();
    for (const Json& each : list) {
        const std::string path = fmt::format("volumes[{}]", volumes->operations.size());
        const Parsed<void> good =
            check_keys(each, path, {"op", "shape", "position", "rotation", "voxel_m"});
        if (!good) return wrong(good.error());
        Parsed<VolumeOperation> operation = read_operation(each);
        if (!operation) return wrong(path + "." + operation.error());
        Parsed<SceneVolumeShape> shape = read_volume_shape(each, path, folder);
        if (!shape) return wrong(shape.error());
        operation->shape = std::move(shape->shape);
        volumes->operations.push_back(*std::move(operation));
        volumes->names.push_back({std::move(shape->kind), std::move(shape->file)});
    }
    return volumes;
}

double finest_voxel(const SceneVolumes& volumes) {
    return std::ranges::min_element(volumes.operations, {}, &VolumeOperation::voxel)->voxel;
}

Result<std::shared_ptr<const SceneVolumeField>> place_volumes(const SceneVolumes& volumes,
                                                              const HeightSource& ground) {
    Result<Volumes> placed = Volumes::create(ground.lattice(), volumes.operations,
                                             {.level = ground.lattice().finest_level});
    if (!placed) return tl::unexpected<Error>(in_scene(placed.error(), volumes));
    SceneVolumeField field{*std::move(placed), volumes.names, {}};
    const WorldRect& extent = ground.extent();
    for (std::size_t i = 0; i < volumes.operations.size(); ++i) {
        const Aabb box = bounds_of(volumes.operations[i], field.volumes.operations()[i]);
        if (is_beside(box, extent)) {
            return fail(
                ErrorCode::invalid_argument,
                fmt::format("{} is beside the terrain: it lies in [{:.6g}, {:.6g}, {:.6g}, "
                            "{:.6g}], the terrain in [{:.6g}, {:.6g}, {:.6g}, {:.6g}] "
                            "(west, south, east, north)",
                            called(i, volumes), box.low.x(), box.low.y(), box.high.x(),
                            box.high.y(), extent.west, extent.south, extent.east, extent.north));
        }
        field.bounds_world.push_back(box);
    }
    return std::make_shared<const SceneVolumeField>(std::move(field));
}

Result<std::shared_ptr<const HeightSource>> add_volumes(std::shared_ptr<const HeightSource> ground,
                                                        const SceneVolumeField& field) {
    return make_diggable(std::move(ground), &field);
}

Result<std::shared_ptr<VolumeHeights>> make_diggable(std::shared_ptr<const HeightSource> ground,
                                                     const SceneVolumeField* field) {
    if (field != nullptr) return VolumeHeights::create(std::move(ground), field->volumes);
    const Lattice& lattice = ground->lattice();
    TERRANE_TRY(const Volumes none, Volumes::create(lattice, {}, {.level = lattice.finest_level}));
    return VolumeHeights::create(std::move(ground), none);
}

Json describe_volumes(const SceneVolumeField& field) {
    Json list = Json::array();
    for (std::size_t i = 0; i < field.names.size(); ++i) {
        const bool is_added = field.volumes.operations()[i].op() == VolumeOp::add;
        Json volume;
        volume["op"] = is_added ? "add" : "remove";
        volume["shape"] = field.names[i].kind;
        volume["voxel_m"] = field.volumes.spacing();
        volume["bounds_m"] = {corner_of(field.bounds_world[i].low),
                              corner_of(field.bounds_world[i].high)};
        list.push_back(std::move(volume));
    }
    return list;
}

}  // namespace terrane::tools
