// SPDX-License-Identifier: MIT
#include "scene/random_scene.h"

#include <cmath>
#include <limits>

namespace terrane::test {

ObjectModel random_model(Random& random, std::uint32_t index) {
    ObjectModel model;
    model.mesh = MeshId{index};
    model.impostor = ImpostorId{index};
    const double size = random.between(0.1, 20.0);
    model.bounds = {
        Eigen::Vector3d::Constant(-size) + random.between(0.0, 0.5) * random.direction(),
        Eigen::Vector3d::Constant(size)};
    double error = random.below(2) == 0 ? 0.0 : random.between(0.001, 0.1);
    std::uint32_t triangles = 1000 + static_cast<std::uint32_t>(random.below(100'000));
    const int count = 1 + random.below(6);
    for (int i = 0; i < count; ++i) {
        const bool is_impostor = i > 0 && i + 1 == count && random.below(2) == 0;
        model.levels.push_back({.error_m = error,
                                .triangles = is_impostor ? 2 : triangles,
                                .mesh_level = static_cast<std::uint32_t>(i),
                                .is_impostor = is_impostor});
        if (i > 0 && !is_impostor)
            model.levels[model.levels.size() - 2].morphs = random.below(2) == 0;
        error = std::max(error, 0.001) * random.between(2.0, 8.0);
        triangles = triangles / 2 + 3;
        triangles -= static_cast<std::uint32_t>(random.below(3));
    }
    model.absence_error_m =
        random.below(5) == 0 ? std::numeric_limits<double>::infinity() : error * 2.0;
    return model;
}

ObjectModel plain_model(std::uint32_t mesh, const Aabb& bounds) {
    ObjectModel model;
    model.mesh = MeshId{mesh};
    model.bounds = bounds;
    model.levels = {{.error_m = 0.0, .triangles = 12}};
    model.absence_error_m = std::numeric_limits<double>::infinity();
    return model;
}

Result<NodeId> add_instances(terrane::Scene& scene, ModelId model,
                             std::span<const PlacedObject> objects) {
    return scene.add(scene.root(), {}, InstancesNode{model, {objects.begin(), objects.end()}});
}

PlacedObject random_object(Random& random, double spread) {
    PlacedObject object;
    object.position = random.between(0.0, spread) * random.direction();
    object.scale = static_cast<float>(std::exp2(random.between(-3.0, 3.0)));
    const Eigen::Vector3d axis = random.direction();
    const double half = random.between(-1.0, 1.0);
    const double sine = std::sqrt(1.0 - half * half);
    object.rotation = {static_cast<float>(axis.x() * sine), static_cast<float>(axis.y() * sine),
                       static_cast<float>(axis.z() * sine), static_cast<float>(half)};
    return object;
}

ObjectModel tree_model() {
    return {.mesh = MeshId{0},
            .impostor = ImpostorId{0},
            .bounds = {{-2.0, -2.0, 0.0}, {2.0, 2.0, 8.0}},
            .levels = {{0.0, 400, 0, false},
                       {0.05, 100, 1, false},
                       {0.15, 30, 2, false},
                       {0.4, 2, 0, true}},
            .absence_error_m = 8.0};
}

ObjectModel rock_model() {
    return {.mesh = MeshId{1},
            .impostor = ImpostorId{1},
            .bounds = {{-0.8, -0.8, 0.0}, {0.8, 0.8, 1.5}},
            .levels = {{0.0, 300, 0, false},
                       {0.02, 80, 1, false},
                       {0.06, 20, 2, false},
                       {0.15, 2, 0, true}},
            .absence_error_m = 1.5};
}

std::vector<PlacedObject> spread_objects(Random& random, int count, double half_side) {
    std::vector<PlacedObject> objects;
    for (int i = 0; i < count; ++i) {
        PlacedObject object;
        const double x = random.between(-half_side, half_side);
        const double y = random.between(-half_side, half_side);
        object.position = {x, y, 20.0 * std::sin(x / 100.0) * std::cos(y / 130.0)};
        object.scale = static_cast<float>(random.between(0.7, 1.4));
        const double half_yaw = random.between(0.0, 3.14159);
        object.rotation = {0.0f, 0.0f, static_cast<float>(std::sin(half_yaw)),
                           static_cast<float>(std::cos(half_yaw))};
        objects.push_back(object);
    }
    return objects;
}

}  // namespace terrane::test
