// SPDX-License-Identifier: MIT
#include "scene/mesh_objects.h"

#include <terrane/scene/culling.h>
#include <terrane/terrain/progressive_mesh.h>
#include <terrane/terrain/scatter.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <utility>

namespace terrane::tools {
namespace {

// Errors of the levels relative to the size of the object.
constexpr std::array kLevelErrors = {0.001, 0.003, 0.01, 0.03, 0.1};
// A level must have at most this share of the previous level's triangles.
constexpr double kLeastSaving = 0.75;

/// The current level of a mesh with the vertices that it uses.
TriangleMesh level_of(const ProgressiveMesh& progressive, Normals normals) {
    const TriangleMesh& finest = progressive.finest();
    const auto count = static_cast<std::ptrdiff_t>(progressive.vertex_count());
    TriangleMesh level;
    level.positions.assign(finest.positions.begin(), finest.positions.begin() + count);
    level.triangles.assign(progressive.triangles().begin(), progressive.triangles().end());
    if (normals == Normals::with) {
        level.normals.assign(finest.normals.begin(), finest.normals.begin() + count);
    } else {
        join_vertices(level);
        level = without_unused_vertices(level);
    }
    return level;
}

Error about(const std::string& file, const Error& error) {
    return {error.code, file + ": " + error.message};
}

}  // namespace

Result<MeshObjects::Model> MeshObjects::make_model(const TriangleMesh& mesh, Normals normals) {
    TERRANE_TRY(ProgressiveMesh progressive, ProgressiveMesh::create(mesh));
    if (progressive.triangles().empty())
        return fail(ErrorCode::invalid_argument, "an object must have triangles and an extent");
    const Aabb box = bounding_box(progressive.finest().positions);
    Model model;
    model.centre = 0.5 * (box.low + box.high);
    model.size = (box.high - box.low).norm();
    model.radius = 0.5 * model.size;
    model.levels.push_back(level_of(progressive, normals));
    model.errors_m.push_back(0.0);
    for (const double error : kLevelErrors) {
        progressive.set_error(error * model.size);
        const auto before = static_cast<double>(model.levels.back().triangles.size());
        const auto count = static_cast<double>(progressive.triangles().size());
        if (count > kLeastSaving * before) continue;
        model.levels.push_back(level_of(progressive, normals));
        model.errors_m.push_back(progressive.error_m());
    }
    return model;
}

MeshObjects::Instance MeshObjects::make_instance(std::size_t model, const Pose& world_from_object,
                                                 double scale) const {
    const Model& of = models_[model];
    const WorldPos centre_world = world_from_object * Eigen::Vector3d(scale * of.centre);
    const double distance = (centre_world - view_.eye_world).norm() - scale * of.radius;
    return {world_from_object, scale, static_cast<std::uint32_t>(model),
            scale * view_.pixels_per_radian() / std::max(distance, view_.near_distance)};
}

// Demands the levels finer than the coarsest one.
void MeshObjects::demand_levels(const Instance& instance) {
    const Model& model = models_[instance.model];
    for (std::size_t i = model.levels.size() - 1; i > 0; --i) {
        const double error_px = model.errors_m[i] * instance.px_per_m;
        if (error_px <= max_error_px_) return;
        demands_.push_back(
            {.threshold_px = error_px,
             .triangles = static_cast<std::uint32_t>(model.levels[i - 1].triangles.size() -
                                                     model.levels[i].triangles.size())});
    }
}

Result<void> MeshObjects::add_scattered(const HeightSource& source, const SceneScatter& wanted,
                                        const Scatter& scatter) {
    const Model& model = models_[wanted.mesh];
    const ViewVolume volume(view_);
    TERRANE_TRY(const double range,
                sight_range(wanted, model.size, max_error_px_ / view_.pixels_per_radian(),
                            source.extent()));
    const std::optional<ScatterRange> squares = scatter.squares_within(view_.eye_world, range);
    if (!squares) return {};
    // of an object's points from its origin
    const double reach = (model.centre.norm() + model.radius) * wanted.settings.max_scale;
    const auto is_in_sight = [&](const ScatterSquare& square) {
        if (scatter.distance_to(square, view_.eye_world) > range) return false;
        const WorldRect rect = scatter.rect_of(square);
        const HeightInterval heights = source.interval(rect);
        const Eigen::Vector3d margin = Eigen::Vector3d::Constant(reach);
        return volume.meets(Aabb{Eigen::Vector3d(rect.west, rect.south, heights.low) - margin,
                                 Eigen::Vector3d(rect.east, rect.north, heights.high) + margin});
    };
    for (std::int32_t y = squares->low.y; y <= squares->high.y; ++y) {
        for (std::int32_t x = squares->low.x; x <= squares->high.x; ++x) {
            if (!is_in_sight({x, y})) continue;
            TERRANE_TRY(const std::vector<ScatterPoint> points, scatter.objects_in({x, y}));
            for (const ScatterPoint& point : points) {
                const Pose pose = pose_of(point);
                const Instance instance = make_instance(wanted.mesh, pose, point.scale);
                const double absence_px = model.size * instance.px_per_m;
                const BoundingSphere sphere{pose * Eigen::Vector3d(point.scale * model.centre),
                                            point.scale * model.radius};
                if (absence_px <= max_error_px_ || !volume.meets(sphere)) continue;
                instances_.push_back(instance);
                demands_.push_back({.threshold_px = absence_px,
                                    .triangles = static_cast<std::uint32_t>(
                                        model.levels.back().triangles.size())});
                demand_levels(instance);
            }
        }
    }
    return {};
}

Result<MeshObjects> MeshObjects::create(std::shared_ptr<const HeightSource> source,
                                        const SceneObjects& objects, const View& view,
                                        double max_error_px, Normals normals) {
    MeshObjects made(view, max_error_px);
    for (std::size_t i = 0; i < objects.meshes.size(); ++i) {
        Result<Model> model = make_model(objects.meshes[i], normals);
        if (!model) return tl::unexpected(about(objects.files[i], model.error()));
        made.models_.push_back(*std::move(model));
    }
    for (const SceneObject& object : objects.objects) {
        const Instance instance =
            made.make_instance(object.mesh, object.world_from_object, object.scale);
        made.instances_.push_back(instance);
        made.least_triangles_ += made.models_[object.mesh].levels.back().triangles.size();
        made.demand_levels(instance);
    }
    made.placed_count_ = made.instances_.size();
    // more triangles than any budget are refused by the caller
    constexpr std::size_t kMost = std::numeric_limits<std::uint32_t>::max();
    made.demands_.push_back(
        {.threshold_px = std::numeric_limits<double>::infinity(),
         .triangles = static_cast<std::uint32_t>(std::min(made.least_triangles_, kMost))});
    for (const SceneScatter& wanted : objects.scatters) {
        const Result<Scatter> scatter = Scatter::create(source, wanted.settings);
        if (!scatter) return tl::unexpected(about(objects.files[wanted.mesh], scatter.error()));
        const Result<void> added = made.add_scattered(*source, wanted, *scatter);
        if (!added) return tl::unexpected(about(objects.files[wanted.mesh], added.error()));
    }
    return made;
}

MeshObjectCounts MeshObjects::append_to(IndexedMesh& mesh, double threshold_px) const {
    MeshObjectCounts counts;
    // demands below the target have not been made
    counts.error_px = std::max(threshold_px, max_error_px_);
    for (std::size_t i = 0; i < instances_.size(); ++i) {
        const Instance& instance = instances_[i];
        const Model& model = models_[instance.model];
        if (i >= placed_count_ && model.size * instance.px_per_m <= counts.error_px) {
            ++counts.left_out;
            continue;
        }
        std::size_t k = model.levels.size() - 1;
        while (k > 0 && model.errors_m[k] * instance.px_per_m > counts.error_px) --k;
        const TriangleMesh& level = model.levels[k];
        const auto first = static_cast<std::uint32_t>(mesh.vertices_world.size());
        for (const Eigen::Vector3d& p : level.positions) {
            mesh.vertices_world.push_back(instance.world_from_object *
                                          Eigen::Vector3d(instance.scale * p));
        }
        const Eigen::Matrix3f rotation = instance.world_from_object.rotation.cast<float>();
        for (const Eigen::Vector3f& normal : level.normals)
            mesh.normals.push_back((rotation * normal).normalized());
        for (const auto& [a, b, c] : level.triangles)
            mesh.triangles.push_back({first + a, first + b, first + c});
        ++counts.objects;
        counts.triangles += level.triangles.size();
    }
    return counts;
}

}  // namespace terrane::tools
