// SPDX-License-Identifier: MIT
#include "frames/object_field.h"

#include "program/geometry.h"

#include <terrane/base/text.h>
#include <terrane/render/upload_levels.h>
#include <terrane/scene/culling.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

namespace terrane::tools {

SquareMaker::SquareMaker(bool has_thread) {
    if (has_thread) thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

SquareMaker::~SquareMaker() = default;

MadeSquare SquareMaker::make(const Request& request) {
    MadeSquare made = {request.scatter, request.square, {}};
    Result<std::vector<ScatterPoint>> points = request.from->objects_in(request.square);
    if (points) made.points = *std::move(points);
    return made;
}

void SquareMaker::run(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [&] { return !requests_.empty(); })) {
        const Request request = requests_.front();
        lock.unlock();
        MadeSquare made = make(request);
        lock.lock();
        made_.push_back(std::move(made));
        requests_.pop_front();
        changed_.notify_all();
        if (stop.stop_requested()) return;
    }
}

void SquareMaker::request(std::size_t scatter, const Scatter& from, const ScatterSquare& square) {
    const Request request = {scatter, &from, square};
    if (!thread_.joinable()) {
        made_.push_back(make(request));
        return;
    }
    const std::lock_guard lock(mutex_);
    requests_.push_back(request);
    changed_.notify_all();
}

void SquareMaker::take(std::size_t most, std::vector<MadeSquare>& made_out) {
    const std::lock_guard lock(mutex_);
    for (; most > 0 && !made_.empty(); --most) {
        made_out.push_back(std::move(made_.front()));
        made_.pop_front();
    }
}

void SquareMaker::finish() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return requests_.empty(); });
}

namespace {

// Most squares requested, and most squares added to the scene, for each scatter in a frame.
constexpr std::size_t kSquaresAFrame = 2;
// With this number of pending requests or more, a frame makes no requests.
constexpr std::size_t kMostPending = 64;
// A square is removed only beyond this multiple of the range, so that squares at its border do not come and go.
constexpr double kKeepRange = 1.1;

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// The error of `result`, with a subject before its message.
template <class T>
tl::unexpected<Error> about(const std::string& what, const Result<T>& result) {
    return fail(result.error().code, what + ": " + result.error().message);
}

}  // namespace

ObjectField::ObjectField(Scene scene, const ObjectFieldSettings& settings)
    : scene_(std::move(scene)),
      max_error_px_(settings.max_error_px),
      shadows_(settings.shadows),
      maker_(std::make_unique<SquareMaker>(settings.has_thread)) {}

Result<ObjectField> ObjectField::create(std::shared_ptr<const HeightSource> source,
                                        const SceneObjects& objects,
                                        const ObjectFieldSettings& settings,
                                        TerrainRenderer* renderer) {
    const SceneSettings of_scene;
    TERRANE_TRY(Scene scene, Scene::create(of_scene));
    ObjectField field(std::move(scene), settings);
    std::vector<ModelId> models;
    TERRANE_TRY(const std::vector<ObjectLevels> levels,
                field.add_models(objects.meshes, objects.coarser, objects.materials, objects.files,
                                 renderer, true, models));
    for (const SceneObject& object : objects.objects) {
        const NodePlace place = {object.world_from_object, object.scale};
        const Result<NodeId> node =
            field.scene_.add(field.scene_.root(), place, ModelNode{.model = models[object.mesh]});
        if (!node) return about(objects.files[object.mesh], node);
    }
    for (const SceneScatter& wanted : objects.scatters) {
        Result<Scatter> scatter = Scatter::create(source, wanted.settings);
        if (!scatter) return about(objects.files[wanted.mesh], scatter);
        // fades included
        const Result<double> range = sight_range(
            wanted, levels[wanted.mesh].model.absence_error_m,
            settings.max_error_px / (of_scene.fade_ratio * settings.picture.pixels_per_radian()),
            source->extent());
        if (!range) return about(objects.files[wanted.mesh], range);
        field.scattered_.push_back(std::make_unique<ScatteredModel>(ScatteredModel{
            .scatter = *std::move(scatter), .model = models[wanted.mesh], .range = *range}));
    }
    return field;
}

// Makes the levels of meshes, uploads them, and adds them to the scene.
Result<std::vector<ObjectLevels>> ObjectField::add_models(
    std::span<const TriangleMesh> meshes, std::span<const std::vector<TriangleMesh>> coarser,
    std::span<const std::vector<MeshMaterial>> materials, std::span<const std::string> files,
    TerrainRenderer* renderer, bool has_impostors, std::vector<ModelId>& models_out) {
    std::vector<ObjectLevels> levels;
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        std::vector<TriangleMesh> all{meshes[i]};
        if (i < coarser.size()) all.insert(all.end(), coarser[i].begin(), coarser[i].end());
        Result<ObjectLevels> made = make_object_levels(all, has_impostors);
        if (!made) return about(files[i], made);
        if (renderer != nullptr) {
            std::span<const MeshMaterial> of_mesh;
            if (i < materials.size()) of_mesh = materials[i];
            if (const Result<void> uploaded = upload_levels(*made, of_mesh, *renderer); !uploaded)
                return about(files[i], uploaded);
        }
        const Result<ModelId> model = scene_.add_model(made->model);
        if (!model) return about(files[i], model);
        models_out.push_back(*model);
        levels.push_back(*std::move(made));
    }
    return levels;
}

Result<ModelId> ObjectField::add_body_model(const MeshModel& model, TerrainRenderer* renderer) {
    TERRANE_TRY(ObjectLevels made, make_object_levels(model.mesh, false));
    if (renderer != nullptr) TERRANE_TRY(upload_levels(made, model.materials, *renderer));
    return scene_.add_model(made.model);
}

Result<NodeModels> ObjectField::add_node_models(const SceneNodes& nodes, TerrainRenderer* renderer,
                                                bool has_impostors) {
    NodeModels made;
    TERRANE_TRY(add_models(nodes.meshes, nodes.coarser, nodes.materials, nodes.files, renderer,
                           has_impostors, made.models));
    if (renderer == nullptr) return made;
    for (const auto& image : nodes.images) {
        TERRANE_TRY(made.images.emplace_back(), renderer->add_particle_image(image));
    }
    return made;
}

Result<NodeModels> ObjectField::add_body_models(const SceneNodes& nodes,
                                                TerrainRenderer* renderer) {
    return add_node_models(nodes, renderer, false);
}

Result<std::vector<NodeId>> ObjectField::add_subtree(const SceneNodes& nodes, std::size_t first,
                                                     const NodeModels& models, NodeId parent,
                                                     const NodePlace& place) {
    std::vector<NodeId> ids;
    for (std::size_t i = first; i < nodes.nodes.size(); ++i) {
        const SceneNode& node = nodes.nodes[i];
        if (i > first && !node.parent) break;  // the next tree
        const auto content = [&](const auto& each) -> NodeContent {
            using Content = std::decay_t<decltype(each)>;
            if constexpr (std::is_same_v<Content, MeshOfNode>) {
                return ModelNode{.model = models.models[each.mesh]};
            } else if constexpr (std::is_same_v<Content, EmitterNode>) {
                EmitterNode emitter = each;
                if (node.image && !models.images.empty())
                    emitter.image = models.images[*node.image];
                return emitter;
            } else {
                return each;
            }
        };
        const Result<NodeId> id =
            scene_.add(i == first ? parent : ids[*node.parent - first],
                       i == first ? place : node.place, std::visit(content, node.content));
        if (!id) {
            if (!ids.empty()) scene_.remove(ids.front());
            return about(node.path, id);
        }
        ids.push_back(*id);
    }
    return ids;
}

namespace {

// Depth of the top of a box below the ground at its corners and its middle, metres; 0 if it is above the ground at one.
double depth_below(const Aabb& box, const HeightSource& source) {
    double least = std::numeric_limits<double>::infinity();
    for (const double east : {0.0, 0.5, 1.0}) {
        for (const double north : {0.0, 0.5, 1.0}) {
            const Eigen::Vector3d size = box.high - box.low;
            const double ground =
                source.height(box.low.x() + east * size.x(), box.low.y() + north * size.y());
            least = std::min(least, ground - box.high.z());
        }
    }
    return std::isfinite(least) ? std::max(least, 0.0) : 0.0;
}

}  // namespace

Result<void> ObjectField::add_nodes(const SceneNodes& nodes, const HeightSource& source,
                                    TerrainRenderer* renderer) {
    TERRANE_TRY(const NodeModels models, add_node_models(nodes, renderer, true));
    for (std::size_t i = 0; i < nodes.nodes.size(); ++i) {
        const SceneNode& node = nodes.nodes[i];
        if (node.parent) continue;
        NodePlace place = node.place;
        if (node.is_on_ground) {
            WorldPos& p = place.parent_from_node.translation;
            const WorldRect& extent = source.extent();
            const bool is_inside = p.x() >= extent.west && p.x() <= extent.east &&
                                   p.y() >= extent.south && p.y() <= extent.north;
            const double height = source.height(p.x(), p.y());
            if (!is_inside || !std::isfinite(height)) {
                return fail(ErrorCode::invalid_argument, node.path + ": there is no ground at x " +
                                                             number_text(p.x()) + " m, y " +
                                                             number_text(p.y()) + " m");
            }
            p.z() += height;
        }
        TERRANE_TRY(const auto ids, add_subtree(nodes, i, models, scene_.root(), place));
        const std::optional<Aabb> bounds = scene_.bounds_world(ids[0]);
        const double depth = bounds ? depth_below(*bounds, source) : 0.0;
        if (depth > 0.0)
            buried_.push_back(fmt::format("{} is {:.3g} m below the ground", node.path, depth));
    }
    return {};
}

// Removes squares out of range, and finds the squares to be requested. Does so again only after the eye has moved by a
// quarter of a square's side.
void ObjectField::find_absent(ScatteredModel& scattered, const WorldPos& eye) {
    const Scatter& scatter = scattered.scatter;
    const double slack = 0.25 * scatter.square_side();
    if (scattered.followed_from && (eye - *scattered.followed_from).norm() < slack) return;
    scattered.followed_from = eye;
    const double range = scattered.range + slack;
    for (auto each = scattered.squares.begin(); each != scattered.squares.end();) {
        const bool is_far = scatter.distance_to(each->first, eye) > kKeepRange * range;
        if (is_far && each->second) scene_.remove(*each->second);
        each = is_far ? scattered.squares.erase(each) : std::next(each);
    }
    scattered.absent.clear();
    const std::optional<ScatterRange> squares = scatter.squares_within(eye, range);
    if (!squares) return;
    std::vector<std::pair<double, ScatterSquare>> found;
    for (std::int32_t y = squares->low.y; y <= squares->high.y; ++y) {
        for (std::int32_t x = squares->low.x; x <= squares->high.x; ++x) {
            const ScatterSquare square = {x, y};
            if (scattered.squares.contains(square)) continue;
            const double distance = scatter.distance_to(square, eye);
            if (distance <= range) found.emplace_back(distance, square);
        }
    }
    std::sort(found.begin(), found.end(), std::greater<>());
    for (const auto& [distance, square] : found) scattered.absent.push_back(square);
}

void ObjectField::follow(const WorldPos& eye, std::size_t most_requests) {
    for (std::size_t i = 0; i < scattered_.size(); ++i) {
        ScatteredModel& scattered = *scattered_[i];
        find_absent(scattered, eye);
        for (std::size_t n = 0; n < most_requests && !scattered.absent.empty(); ++n) {
            const ScatterSquare square = scattered.absent.back();
            scattered.absent.pop_back();
            // skips a square that has been requested already
            if (!scattered.squares.try_emplace(square).second) continue;
            maker_->request(i, scattered.scatter, square);
            ++pending_;
        }
    }
}

void ObjectField::add_made(std::size_t most) {
    made_.clear();
    maker_->take(most, made_);
    pending_ -= made_.size();
    for (const MadeSquare& made : made_) {
        ScatteredModel& scattered = *scattered_[made.scatter];
        const auto place = scattered.squares.find(made.square);
        // the square may have been removed, or added by an earlier request
        if (place == scattered.squares.end() || place->second) continue;
        std::vector<PlacedObject> objects;
        for (const ScatterPoint& point : made.points.value_or(std::vector<ScatterPoint>())) {
            objects.push_back({.position = point.position_world,
                               .scale = static_cast<float>(point.scale),
                               .rotation = {0.0f, 0.0f, static_cast<float>(point.half_turn_sine),
                                            static_cast<float>(point.half_turn_cosine)}});
        }
        const Result<NodeId> node =
            scene_.add(scene_.root(), {},
                       InstancesNode{.model = scattered.model, .objects = std::move(objects)});
        if (!made.points || !node) ++counts_.failed_squares;
        if (node) place->second = *node;
    }
}

void ObjectField::load_all(const View& view) {
    constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();
    follow(view.eye_world, kAll);
    maker_->finish();
    add_made(kAll);
}

std::span<const TriangleDemand> ObjectField::cull(const View& view, const HorizonMap* horizon_map) {
    const Clock::time_point start = Clock::now();
    const std::span<const TriangleDemand> demands =
        scene_.begin_frame(view, max_error_px_, shadows_, horizon_map);
    counts_.occluded = scene_.counts().occluded;
    counts_.occluded_share = scene_.counts().occluded_share;
    counts_.ms += ms_since(start);
    return demands;
}

std::span<const TriangleDemand> ObjectField::begin_frame(const View& view,
                                                         const HorizonMap* horizon_map) {
    const Clock::time_point start = Clock::now();
    // no new requests while the thread is behind
    if (pending_ < kMostPending) follow(view.eye_world, kSquaresAFrame);
    add_made(kSquaresAFrame * scattered_.size());
    counts_.ms = ms_since(start);
    return cull(view, horizon_map);
}

std::span<const TriangleDemand> ObjectField::begin_again(const View& view) {
    return cull(view, nullptr);
}

SceneDraws ObjectField::end_frame(double threshold_px) {
    const Clock::time_point start = Clock::now();
    const SceneDraws draws = scene_.end_frame(threshold_px);
    counts_.ms += ms_since(start);
    const SceneCounts& counts = scene_.counts();
    counts_.drawn = counts.drawn;
    counts_.culled = counts.objects - counts.in_view - counts.occluded;
    counts_.left_out = counts.left_out;
    counts_.triangles = counts.triangles;
    return draws;
}

}  // namespace terrane::tools
