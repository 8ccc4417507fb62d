// SPDX-License-Identifier: MIT
#include "scene/scene_objects.h"

#include "program/json_values.h"
#include "scene/mesh_files.h"
#include "scene/raster_options.h"

#include <terrane/base/text.h>
#include <terrane/terrain/crease_normals.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint64_t kMostBands = 65535;

Parsed<SurfaceRect> read_rect(const Json& object) {
    const Parsed<std::array<double, 4>> edges = read_array<4>(object, "rect");
    if (!edges) return wrong(edges.error());
    const auto [west, south, east, north] = *edges;
    if (!(west <= east && south <= north)) {
        return wrong(fmt::format(
            "rect must be [west, south, east, north] with west <= east and south <= north, got {}",
            shown(object["rect"])));
    }
    if (!object.contains("friction")) return wrong("friction is missing");
    SurfaceRect rect{.rect = {west, south, east, north}};
    const Parsed<double> friction = read_in_range(object, "friction", 0.0, 0.0, 1e6);
    if (!friction) return wrong(friction.error());
    rect.properties.friction = *friction;
    const Parsed<double> restitution =
        read_in_range(object, "restitution", rect.properties.restitution, 0.0, 1.0);
    if (!restitution) return wrong(restitution.error());
    rect.properties.restitution = *restitution;
    return rect;
}

}  // namespace

Parsed<SceneSurface> read_surface(const Json& value, const std::string& folder) {
    SceneSurface surface;
    if (value.is_string() && !value.get<std::string>().empty()) {
        surface.raster = raster_path(folder, value.get<std::string>());
        return surface;
    }
    if (!value.is_array()) {
        return wrong("surface must be a path or a list of rectangles, got " + shown(value));
    }
    for (const Json& each : value) {
        const std::string path = fmt::format("surface[{}]", surface.rects.size());
        const Parsed<void> good = check_keys(each, path, {"rect", "friction", "restitution"});
        if (!good) return wrong(good.error());
        const Parsed<SurfaceRect> rect = read_rect(each);
        if (!rect) return wrong(path + "." + rect.error());
        surface.rects.push_back(*rect);
    }
    return surface;
}

Parsed<SceneImagery> read_imagery(const Json& value, const std::string& folder) {
    SceneImagery imagery;
    const auto is_path = [](const Json& text) {
        return text.is_string() && !text.get<std::string>().empty();
    };
    if (value.is_object()) {
        if (const Parsed<void> good =
                check_keys(value, "imagery", {"file", "bands", "limits", "percentiles", "gamma"});
            !good)
            return wrong(good.error());
    }
    const Json file = value.is_object() ? value.value("file", Json()) : value;
    if (!is_path(file)) {
        return wrong("imagery must be a path or an object with a file, got " + shown(value));
    }
    imagery.raster = raster_path(folder, file.get<std::string>());
    if (!value.is_object()) return imagery;
    ImageryRasterSettings& settings = imagery.settings;
    for (const auto& [name, pair] :
         {std::pair{"limits", &settings.limits}, std::pair{"percentiles", &settings.percentiles}}) {
        if (!value.contains(name)) continue;
        const Parsed<std::array<double, 2>> numbers = read_array<2>(value, name);
        if (!numbers) return wrong("imagery." + numbers.error());
        *pair = *numbers;
    }
    const Parsed<double> gamma = read_in_range(value, "gamma", settings.gamma, 0.1, 10.0);
    if (!gamma) return wrong("imagery." + gamma.error());
    settings.gamma = *gamma;
    if (!value.contains("bands")) return imagery;
    const Json& bands = value["bands"];
    const auto is_band = [](const Json& band) {
        return band.is_number_unsigned() && band.get<std::uint64_t>() <= kMostBands;
    };
    if (!bands.is_array() || (bands.size() != 1 && bands.size() != 3) ||
        !std::ranges::all_of(bands, is_band)) {
        return wrong("imagery.bands must be 1 or 3 numbers of bands, got " + shown(bands));
    }
    for (const Json& band : bands) settings.bands.push_back(band.get<int>());
    return imagery;
}

Parsed<SceneMaterials> read_materials(const Json& value) {
    const auto known =
        check_keys(value, "materials", {"palette", "snow_line_m", "rock_slope", "occlusion"});
    if (!known) return wrong(known.error());
    SceneMaterials materials;
    if (const auto palette = value.find("palette"); palette != value.end()) {
        const auto* const found =
            std::ranges::find_if(kPaletteNames, [&](const char* name) { return *palette == name; });
        if (found == kPaletteNames.end()) {
            return wrong(fmt::format("materials.palette must be one of {}, got {}",
                                     fmt::join(kPaletteNames, ", "), shown(*palette)));
        }
        materials.palette = static_cast<GroundPalette>(found - kPaletteNames.begin());
    }
    struct Figure {
        const char* key;
        std::optional<double>* value;
        double low, high;
    };
    for (const Figure& figure : {Figure{"snow_line_m", &materials.snow_line, -1e9, 1e9},
                                 Figure{"rock_slope", &materials.rock_slope, 0.0, 100.0},
                                 Figure{"occlusion", &materials.occlusion, 0.0, 1.0}}) {
        if (!value.contains(figure.key)) continue;
        const Parsed<double> number =
            read_in_range(value, figure.key, 0.0, figure.low, figure.high);
        if (!number) return wrong("materials." + number.error());
        *figure.value = *number;
    }
    return materials;
}

Parsed<SceneWater> read_water(const Json& value) {
    const auto known = check_keys(value, "water", {"level_m", "waves"});
    if (!known) return wrong(known.error());
    if (!value.contains("level_m")) return wrong("water.level_m is missing");
    SceneWater water;
    const Parsed<double> level = read_in_range(value, "level_m", 0.0, -1e9, 1e9);
    if (!level) return wrong("water." + level.error());
    water.level = *level;
    const auto waves = value.find("waves");
    if (waves == value.end()) return water;
    if (!waves->is_boolean())
        return wrong("water.waves must be true or false, got " + shown(*waves));
    water.has_waves = waves->get<bool>();
    return water;
}

Result<std::shared_ptr<const ImagerySource>> open_imagery(const SceneImagery& imagery,
                                                          const DemInfo* dem) {
    ImageryRasterSettings settings = imagery.settings;
    if (dem != nullptr) settings.aligned_with = *dem;
    return ImageryRaster::open(imagery.raster, settings);
}

Result<std::shared_ptr<const SurfaceMap>> open_surface(const SceneSurface& surface,
                                                       const DemInfo* dem) {
    if (surface.raster.empty()) return SurfaceMap::from_rects(surface.rects);
    SurfaceRasterSettings settings;
    settings.numbers = SurfaceNumbers::friction;
    if (dem != nullptr && !dem->crs.empty()) settings.aligned_with = *dem;
    return SurfaceRaster::open(surface.raster, settings);
}

namespace {

using Json = nlohmann::ordered_json;

constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

// Default error of a mesh's proxy, relative to the mesh's largest extent.
constexpr double kUsualProxyShare = 0.03;

double largest_extent(const TriangleMesh& mesh) {
    if (mesh.positions.empty()) return 0.0;
    Eigen::Vector3d low = mesh.positions[0], high = low;
    for (const Eigen::Vector3d& p : mesh.positions) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    return (high - low).maxCoeff();
}

/// The error of an object's proxy; absent if the object is not static.
Parsed<std::optional<double>> read_proxy_error(const Json& object, const TriangleMesh& mesh) {
    bool is_static = false;
    if (const auto found = object.find("static"); found != object.end()) {
        if (!found->is_boolean())
            return wrong("static must be true or false, got " + shown(*found));
        is_static = found->get<bool>();
    }
    if (!is_static) {
        if (object.contains("proxy_error_m")) return wrong("proxy_error_m goes with static true");
        return std::optional<double>();
    }
    const Parsed<double> error =
        read_in_range(object, "proxy_error_m", kUsualProxyShare * largest_extent(mesh), 0.0, 1e6);
    if (!error) return wrong(error.error());
    return std::optional<double>(*error);
}

/// The mesh with its own normals; without, with smooth ones up to the crease angle.
TriangleMesh with_normals(TriangleMesh mesh, double crease_deg) {
    if (mesh.normals.empty()) {
        // a vertex of a plain mesh has no other attribute that would keep it apart
        if (mesh.texture_coordinates.empty() && mesh.materials.empty()) join_vertices(mesh);
        return with_crease_normals(mesh, std::cos(crease_deg * kRadiansPerDegree));
    }
    for (Eigen::Vector3f& normal : mesh.normals) normal.normalize();
    return mesh;
}

}  // namespace

Parsed<MeshName> read_mesh_name(const Json& object, const std::string& folder) {
    const auto found = object.find("mesh");
    if (found == object.end()) return wrong("mesh is missing");
    if (!found->is_string() || found->get_ref<const std::string&>().empty()) {
        return wrong("mesh must be a file, got " + shown(*found));
    }
    MeshName name;
    name.name = found->get<std::string>();
    name.file = (std::filesystem::path(folder) / name.name).string();
    const Parsed<double> crease = read_in_range(object, "crease_deg", kUsualCrease, 0.0, 180.0);
    if (!crease) return wrong(crease.error());
    name.crease_deg = *crease;
    const auto levels = object.find("levels");
    if (levels == object.end()) return name;
    const auto is_file = [](const Json& each) {
        return each.is_string() && !each.get_ref<const std::string&>().empty();
    };
    if (!levels->is_array() || !std::ranges::all_of(*levels, is_file))
        return wrong("levels must be a list of files, got " + shown(*levels));
    for (const Json& each : *levels) {
        name.levels.push_back((std::filesystem::path(folder) / each.get<std::string>()).string());
    }
    return name;
}

Result<MeshModel> read_shaded_model(const std::string& path, double crease_deg) {
    TERRANE_TRY(MeshModel model, read_model(path));
    if (const Result<void> good = model.mesh.validate(); !good) {
        return fail(good.error().code, fmt::format("'{}': {}", path, good.error().message));
    }
    model.mesh = with_normals(std::move(model.mesh), crease_deg);
    return model;
}

namespace {

/// Appends the materials of a level to those of the others; plain ones where a level has none.
void append_materials(MeshModel& level, std::vector<MeshMaterial>& all) {
    const auto first = static_cast<std::uint16_t>(all.size());
    if (level.materials.empty()) level.materials.emplace_back();
    all.insert(all.end(), level.materials.begin(), level.materials.end());
    level.mesh.materials.resize(level.mesh.positions.size());
    for (std::uint16_t& material : level.mesh.materials)
        material = static_cast<std::uint16_t>(material + first);
}

}  // namespace

Parsed<LevelledModel> read_named_mesh(const MeshName& name) {
    Result<MeshModel> finest = read_shaded_model(name.file, name.crease_deg);
    if (!finest) return wrong("mesh: " + finest.error().message);
    LevelledModel model{*std::move(finest)};
    bool has_materials = !model.materials.empty();
    std::vector<MeshModel> coarser;
    for (std::size_t i = 0; i < name.levels.size(); ++i) {
        Result<MeshModel> level = read_shaded_model(name.levels[i], name.crease_deg);
        if (!level) return wrong(fmt::format("levels[{}]: {}", i, level.error().message));
        has_materials = has_materials || !level->materials.empty();
        coarser.push_back(*std::move(level));
    }
    if (has_materials && !coarser.empty()) {
        std::vector<MeshMaterial> all;
        append_materials(model, all);
        for (MeshModel& level : coarser) append_materials(level, all);
        if (all.size() > std::numeric_limits<std::uint16_t>::max())
            return wrong(fmt::format("levels have {} materials", all.size()));
        model.materials = std::move(all);
    }
    for (MeshModel& level : coarser) model.coarser.push_back(std::move(level.mesh));
    return model;
}

namespace {

struct ObjectReader {
    std::string folder;
    SceneObjects made;
    std::vector<MeshName> mesh_names = {};  // [made.meshes]

    /// Index of the mesh that an object names; reads its file if no earlier object names it with this crease angle.
    Parsed<std::size_t> read_mesh_of(const Json& object) {
        const Parsed<MeshName> name = read_mesh_name(object, folder);
        if (!name) return wrong(name.error());
        const auto found = std::ranges::find(mesh_names, *name);
        if (found != mesh_names.end()) return static_cast<std::size_t>(found - mesh_names.begin());
        Parsed<LevelledModel> model = read_named_mesh(*name);
        if (!model) return wrong(model.error());
        made.meshes.push_back(std::move(model->mesh));
        made.materials.push_back(std::move(model->materials));
        made.coarser.push_back(std::move(model->coarser));
        mesh_names.push_back(*name);
        made.files.push_back(name->file);
        made.names.push_back(name->name);
        return made.meshes.size() - 1;
    }

    Parsed<void> read_object(std::size_t entry, const Json& object) {
        SceneObject placed;
        placed.entry = entry;
        const Parsed<std::size_t> mesh = read_mesh_of(object);
        if (!mesh) return wrong(mesh.error());
        placed.mesh = *mesh;
        const Parsed<Pose> pose = read_pose(object, PositionAbsent::is_wrong);
        if (!pose) return wrong(pose.error());
        placed.world_from_object = *pose;
        const Parsed<double> scale = read_in_range(object, "scale", 1.0, 1e-3, 1e3);
        if (!scale) return wrong(scale.error());
        placed.scale = *scale;
        const auto error = read_proxy_error(object, made.meshes[*mesh]);
        if (!error) return wrong(error.error());
        placed.proxy_error = *error;
        made.objects.push_back(placed);
        return {};
    }

    Parsed<void> read_scatter(std::size_t entry, const Json& scatter) {
        SceneScatter scattered;
        scattered.entry = entry;
        const Parsed<std::size_t> mesh = read_mesh_of(scatter);
        if (!mesh) return wrong(mesh.error());
        scattered.mesh = *mesh;
        ScatterSettings& settings = scattered.settings;
        const Parsed<double> density = read_number(scatter, "per_km2");
        if (!density) return wrong(density.error());
        settings.per_km2 = *density;
        if (!(settings.per_km2 > 0.0 && settings.per_km2 <= 1e6)) {
            return wrong(fmt::format("per_km2 must be above 0 and at most 1e6, got {:.6g}",
                                     settings.per_km2));
        }
        const auto range = [&](const char* key, double low, double high, double unit, double& from,
                               double& to) -> Parsed<void> {
            if (!scatter.contains(key)) return {};
            const auto values = read_array<2>(scatter, key);
            if (!values) return wrong(values.error());
            const auto [a, b] = *values;
            if (!(a >= low && b >= a && b <= high)) {
                return wrong(
                    fmt::format("{} must be two numbers from {:.6g} to {:.6g}, the "
                                "smaller one first, got [{:.6g}, {:.6g}]",
                                key, low, high, a, b));
            }
            from = a * unit;
            to = b * unit;
            return {};
        };
        TERRANE_TRY(range("slope_deg", 0.0, 90.0, kRadiansPerDegree, settings.min_slope,
                          settings.max_slope));
        TERRANE_TRY(range("height_m", -1e9, 1e9, 1.0, settings.min_height, settings.max_height));
        TERRANE_TRY(range("scale", 1e-3, 1e3, 1.0, settings.min_scale, settings.max_scale));
        if (const auto seed = scatter.find("seed"); seed != scatter.end()) {
            if (!seed->is_number_unsigned())
                return wrong("seed must be a whole number of at least 0, got " + shown(*seed));
            settings.seed = seed->get<std::uint64_t>();
        }
        const auto error = read_proxy_error(scatter, made.meshes[*mesh]);
        if (!error) return wrong(error.error());
        scattered.proxy_error = *error;
        made.scatters.push_back(scattered);
        return {};
    }
};

}  // namespace

Parsed<SceneObjects> read_objects(const Json& list, const std::string& folder) {
    if (!list.is_array()) return wrong("objects must be a list, got " + shown(list));
    ObjectReader reader = {folder, {}};
    for (std::size_t i = 0; i < list.size(); ++i) {
        const Json& each = list[i];
        std::string path = fmt::format("objects[{}]", i);
        const bool is_scatter = each.is_object() && each.contains("scatter");
        const Parsed<void> known =
            is_scatter ? check_keys(each, path, {"scatter"})
                       : check_keys(each, path,
                                    {"mesh", "levels", "crease_deg", "position", "rotation",
                                     "scale", "static", "proxy_error_m"});
        if (!known) return wrong(known.error());
        if (is_scatter) {
            path += ".scatter";
            const Parsed<void> good =
                check_keys(each["scatter"], path,
                           {"mesh", "levels", "crease_deg", "per_km2", "slope_deg", "height_m",
                            "scale", "seed", "static", "proxy_error_m"});
            if (!good) return wrong(good.error());
        }
        const Parsed<void> read =
            is_scatter ? reader.read_scatter(i, each["scatter"]) : reader.read_object(i, each);
        if (!read) return wrong(path + "." + read.error());
    }
    return std::move(reader.made);
}

Result<double> sight_range(const SceneScatter& scatter, double size, double error_angle,
                           const WorldRect& extent) {
    constexpr double kMostInSight = 4194304.0;  // 2^22
    const double range = size * scatter.settings.max_scale * (1.0 + 1.0 / error_angle);
    const double area_km2 = 1e-6 * std::min(3.2 * range * range, (extent.east - extent.west) *
                                                                     (extent.north - extent.south));
    const double count = area_km2 * scatter.settings.per_km2;
    if (!(count <= kMostInSight)) {
        return fail(
            ErrorCode::invalid_argument,
            "a scatter may have at most 2^22 objects in sight, got about " + number_text(count));
    }
    return range;
}

}  // namespace terrane::tools
