// SPDX-License-Identifier: MIT
#include "scene/scene_volumes.h"

#include "scene/scene_keys.h"
#include "scene/volume_shapes.h"

#include <terrane/volume/volume_heights.h>

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <utility>
#include <vector>

namespace terrane::tools {

struct SceneVolumes {
    /// What a volume is called in answers and messages.
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

constexpr double kMostVoxel = 1e5;  // metres, what a volume accepts

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

/// All but the shape. Messages begin with the rest of the key path.
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

/// "volumes[2]", with the file that its shape is from.
std::string called(std::size_t index, const SceneVolumes& volumes) {
    const SceneVolumes::Name& name = volumes.names[index];
    if (name.file.empty()) return fmt::format("volumes[{}]", index);
    return fmt::format("volumes[{}], {} '{}'", index, name.kind, name.file);
}

/// The library says "volume 2: "; a scene "volumes[2]: ".
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

/// The box of a mesh without the band of its level set; of other shapes as placed.
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
    const Result<Volumes> none = Volumes::create(lattice, {}, {.level = lattice.finest_level});
    if (!none) return tl::unexpected(none.error());
    return VolumeHeights::create(std::move(ground), *none);
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
