// SPDX-License-Identifier: MIT
#include "scene/continuous/rock_levels.h"

#include "support/meshes/objects.h"

#include <terrane/scene/culling.h>

#include <algorithm>
#include <utility>

namespace terrane::test {

RockLevels make_rock_levels(int depth, std::uint64_t seed, bool has_impostor, bool morphs) {
    RockLevels rock;
    ProgressiveMesh mesh = ProgressiveMesh::create(make_rock(depth, seed)).value();
    rock.model.bounds = bounding_box(mesh.finest().positions);
    const double size = (rock.model.bounds.high - rock.model.bounds.low).norm();
    for (const double share : {0.0, 0.002, 0.005, 0.015}) {
        mesh.set_error(share * size);
        const auto level = static_cast<std::uint32_t>(rock.triangles.size());
        if (level > 0) rock.model.levels.back().morphs = morphs;
        rock.triangles.emplace_back(mesh.triangles().begin(), mesh.triangles().end());
        rock.model.levels.push_back(
            {share * size, static_cast<std::uint32_t>(rock.triangles.back().size()), level, false});
    }
    if (has_impostor) {
        rock.model.impostor = ImpostorId{0};
        rock.model.levels.push_back({.error_m = 0.03 * size, .triangles = 2, .is_impostor = true});
    }
    rock.model.absence_error_m = size;
    rock.model.continuous = std::make_shared<const ProgressiveMesh>(std::move(mesh));
    return rock;
}

double factor_of(const View& view, const ObjectModel& model, const PlacedObject& object) {
    const Eigen::Vector3d middle = 0.5 * (model.bounds.low + model.bounds.high);
    const Eigen::Quaterniond rotation(object.rotation[3], object.rotation[0], object.rotation[1],
                                      object.rotation[2]);
    const auto scale = static_cast<double>(object.scale);
    const WorldPos centre = object.position_world + rotation.normalized() * (scale * middle);
    const double radius = 0.5 * scale * (model.bounds.high - model.bounds.low).norm();
    const double distance = (centre - view.eye_world).norm() - radius;
    return scale * view.pixels_per_radian() / std::max(distance, view.near_distance);
}

std::size_t granted(std::span<const TriangleDemand> demands, double threshold_px) {
    std::size_t triangles = 0;
    for (const TriangleDemand& demand : demands)
        triangles += demand.threshold_px > threshold_px ? demand.triangles : 0;
    return triangles;
}

}  // namespace terrane::test
