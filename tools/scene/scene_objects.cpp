// SPDX-License-Identifier: MIT
#include "scene/scene_objects.h"

#include "scene/mesh/mesh_reader.h"
#include "scene/scene_keys.h"

#include <fmt/format.h>

#include <filesystem>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

// Of the largest extent of a mesh: error of its proxy where none is given.
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

/// The error of an object's proxy; none where it is not static.
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

struct ObjectReader {
    std::string folder;
    SceneObjects made;

    /// Index of the mesh at a key.
    Parsed<std::size_t> read_mesh_of(const Json& object) {
        const auto found = object.find("mesh");
        if (found == object.end()) return wrong("mesh is missing");
        if (!found->is_string() || found->get_ref<const std::string&>().empty()) {
            return wrong("mesh must be a file, got " + shown(*found));
        }
        const std::string file =
            (std::filesystem::path(folder) / found->get<std::string>()).string();
        for (std::size_t i = 0; i < made.files.size(); ++i) {
            if (made.files[i] == file) return i;
        }
        Result<TriangleMesh> mesh = read_mesh(file);
        if (!mesh) return wrong("mesh: " + mesh.error().message);
        if (const Result<void> good = check(*mesh); !good) {
            return wrong(fmt::format("mesh: '{}': {}", file, good.error().message));
        }
        made.meshes.push_back(*std::move(mesh));
        made.files.push_back(file);
        made.names.push_back(found->get<std::string>());
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
        if (auto ok = range("slope_deg", 0.0, 90.0, kRadiansPerDegree, settings.min_slope,
                            settings.max_slope);
            !ok)
            return ok;
        if (auto ok = range("height_m", -1e9, 1e9, 1.0, settings.min_height, settings.max_height);
            !ok)
            return ok;
        if (auto ok = range("scale", 1e-3, 1e3, 1.0, settings.min_scale, settings.max_scale); !ok)
            return ok;
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
            is_scatter
                ? check_keys(each, path, {"scatter"})
                : check_keys(each, path,
                             {"mesh", "position", "rotation", "scale", "static", "proxy_error_m"});
        if (!known) return wrong(known.error());
        if (is_scatter) {
            path += ".scatter";
            const Parsed<void> good = check_keys(each["scatter"], path,
                                                 {"mesh", "per_km2", "slope_deg", "height_m",
                                                  "scale", "seed", "static", "proxy_error_m"});
            if (!good) return wrong(good.error());
        }
        const Parsed<void> read =
            is_scatter ? reader.read_scatter(i, each["scatter"]) : reader.read_object(i, each);
        if (!read) return wrong(path + "." + read.error());
    }
    return std::move(reader.made);
}

}  // namespace terrane::tools
