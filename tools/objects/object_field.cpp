// SPDX-License-Identifier: MIT
#include "objects/object_field.h"

#include <terrane/terrain/number_text.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

namespace terrane::tools {
namespace {

constexpr std::size_t kSquaresAFrame = 2;
// A square goes where it is farther than this share of the range, so that none comes and goes in turn.
constexpr double kKeepRange = 1.1;
constexpr double kMostInSight = 4194304.0;  // 2^22 objects of a scatter

std::array<float, 4> quaternion_of(const Eigen::Matrix3d& rotation) {
    const Eigen::Quaterniond q(rotation);
    return {static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z()),
            static_cast<float>(q.w())};
}

/// Fails as `result`, with what it is about before the message.
template <class T>
tl::unexpected<Error> about(const std::string& what, const Result<T>& result) {
    return fail(result.error().code, what + ": " + result.error().message);
}

/// Puts the meshes and impostors on the device.
Result<void> upload(const SceneObjects& objects, std::vector<ObjectLevels>& levels,
                    TerrainRenderer& renderer) {
    for (std::size_t i = 0; i < levels.size(); ++i) {
        const std::vector<std::span<const TriangleMesh::Triangle>> triangles(
            levels[i].triangles.begin(), levels[i].triangles.end());
        const Result<MeshId> mesh = renderer.add_mesh(objects.meshes[i], triangles);
        if (!mesh) return about(objects.files[i], mesh);
        levels[i].model.mesh = *mesh;
        if (!levels[i].model.impostor) continue;
        const Result<ImpostorId> impostor = renderer.add_impostor(*mesh);
        if (!impostor) return about(objects.files[i], impostor);
        levels[i].model.impostor = *impostor;
    }
    return {};
}

}  // namespace

Result<ObjectField> ObjectField::create(std::shared_ptr<const HeightSource> source,
                                        const SceneObjects& objects, double max_error_px,
                                        const View& picture, TerrainRenderer* renderer) {
    Result<Scene> scene = Scene::create({});
    if (!scene) return tl::unexpected(scene.error());
    ObjectField field(*std::move(scene), max_error_px);
    std::vector<ObjectLevels> levels;
    for (std::size_t i = 0; i < objects.meshes.size(); ++i) {
        Result<ObjectLevels> made = make_levels(objects.meshes[i]);
        if (!made) return about(objects.files[i], made);
        levels.push_back(*std::move(made));
    }
    if (renderer != nullptr) {
        if (auto ok = upload(objects, levels, *renderer); !ok) return tl::unexpected(ok.error());
    }
    std::vector<ModelId> models;
    for (std::size_t i = 0; i < levels.size(); ++i) {
        const Result<ModelId> model = field.scene_.add_model(levels[i].model);
        if (!model) return about(objects.files[i], model);
        models.push_back(*model);
    }
    for (const SceneObject& object : objects.objects) {
        const PlacedObject placed = {.position_world = object.world_from_object.translation,
                                     .scale = static_cast<float>(object.scale),
                                     .rotation = quaternion_of(object.world_from_object.rotation)};
        const Result<GroupId> group = field.scene_.add_group(models[object.mesh], {&placed, 1});
        if (!group) return about(objects.files[object.mesh], group);
    }
    for (const SceneScatter& wanted : objects.scatters) {
        Result<Scatter> scatter = Scatter::create(source, wanted.settings);
        if (!scatter) return about(objects.files[wanted.mesh], scatter);
        // where its absence is within the target
        const double range = levels[wanted.mesh].size * wanted.settings.max_scale *
                             picture.pixels_per_radian() / max_error_px;
        const WorldRect& extent = source->extent();
        const double area_km2 =
            1e-6 * std::min(3.2 * range * range,
                            (extent.east - extent.west) * (extent.north - extent.south));
        if (!(area_km2 * wanted.settings.per_km2 <= kMostInSight)) {
            return fail(ErrorCode::invalid_argument,
                        objects.files[wanted.mesh] +
                            ": a scatter may have at most 2^22 objects in "
                            "sight, got about " +
                            number_text(area_km2 * wanted.settings.per_km2));
        }
        field.strewn_.push_back({*std::move(scatter), models[wanted.mesh], range, {}});
    }
    return field;
}

void ObjectField::add_square(Strewn& strewn, const ScatterSquare& square) {
    const Result<std::vector<ScatterPoint>> points = strewn.scatter.objects_in(square);
    std::vector<PlacedObject> objects;
    if (points) {
        for (const ScatterPoint& point : *points) {
            objects.push_back({.position_world = point.position_world,
                               .scale = static_cast<float>(point.scale),
                               .rotation = {0.0f, 0.0f, static_cast<float>(point.half_turn_sine),
                                            static_cast<float>(point.half_turn_cosine)}});
        }
    }
    const Result<GroupId> group = scene_.add_group(strewn.model, objects);
    if (!points || !group) ++counts_.failed_squares;
    strewn.squares.emplace(square, group.value_or(GroupId{0}));
}

// Adds the nearest squares in range that are absent, and removes those that are out of it.
void ObjectField::follow(Strewn& strewn, const View& view, std::size_t most_squares) {
    const WorldPos& eye = view.eye_world;
    const double slack = 0.25 * strewn.scatter.square_side();
    if (strewn.is_complete && (eye - strewn.followed_from).norm() < slack) return;
    const double range = strewn.range + slack;
    for (auto each = strewn.squares.begin(); each != strewn.squares.end();) {
        const bool is_far = strewn.scatter.distance_to(each->first, eye) > kKeepRange * range;
        if (is_far) scene_.remove_group(each->second);
        each = is_far ? strewn.squares.erase(each) : std::next(each);
    }
    const ScatterSquare low = strewn.scatter.square_at(eye.x() - range, eye.y() - range);
    const ScatterSquare high = strewn.scatter.square_at(eye.x() + range, eye.y() + range);
    std::vector<std::pair<double, ScatterSquare>> absent;
    for (std::int32_t y = low.y; y <= high.y; ++y) {
        for (std::int32_t x = low.x; x <= high.x; ++x) {
            const ScatterSquare square = {x, y};
            if (strewn.squares.contains(square)) continue;
            const double distance = strewn.scatter.distance_to(square, eye);
            if (distance <= range) absent.emplace_back(distance, square);
        }
    }
    const std::size_t count = std::min(most_squares, absent.size());
    std::partial_sort(absent.begin(), absent.begin() + static_cast<std::ptrdiff_t>(count),
                      absent.end());
    for (std::size_t i = 0; i < count; ++i) add_square(strewn, absent[i].second);
    strewn.is_complete = count == absent.size();
    strewn.followed_from = eye;
}

void ObjectField::load_all(const View& view) {
    for (Strewn& strewn : strewn_) follow(strewn, view, static_cast<std::size_t>(-1));
}

std::span<const TriangleDemand> ObjectField::begin_frame(const View& view) {
    const auto start = std::chrono::steady_clock::now();
    for (Strewn& strewn : strewn_) follow(strewn, view, kSquaresAFrame);
    const std::span<const TriangleDemand> demands = scene_.begin_frame(view, max_error_px_);
    counts_.ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    return demands;
}

SceneDraws ObjectField::end_frame(double threshold_px) {
    const auto start = std::chrono::steady_clock::now();
    const SceneDraws draws = scene_.end_frame(threshold_px);
    counts_.ms +=
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    const SceneCounts& counts = scene_.counts();
    counts_.drawn = counts.drawn;
    counts_.culled = counts.objects - counts.in_view;
    counts_.left_out = counts.left_out;
    counts_.triangles = counts.triangles;
    return draws;
}

}  // namespace terrane::tools
