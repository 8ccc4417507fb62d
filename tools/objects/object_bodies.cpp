// SPDX-License-Identifier: MIT
#include "objects/object_bodies.h"

#include "objects/scatter_pose.h"
#include "scene/mesh/mesh_body.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace terrane::tools {
namespace {

// Objects are chosen anew where a body gets into another cube of this side, metres.
constexpr double kCube = 8.0;
// Seconds ahead for which a body finds its objects in the world.
constexpr double kAhead = 0.25;
// Scattered objects are on a layer of their own, by which a loaded world knows them.
constexpr std::uint32_t kScatterLayer = std::uint32_t{1} << 31;

std::array<double, 3> coordinates(const WorldPos& p_world) {
    return {p_world.x(), p_world.y(), p_world.z()};
}

PlacedBody static_body(const Compound& shape, const Pose& pose, std::uint32_t layers) {
    PlacedBody body;
    body.settings.shape = shape;
    body.settings.type = BodyType::static_body;
    body.settings.filter.layers = layers;
    body.state.pose = pose;
    return body;
}

/// Whether a body of the world that moves would touch an object.
bool overlaps_dynamic(const World& world, const Ground& ground, const PlacedBody& object) {
    std::vector<BodyId> touching(64);
    for (;;) {
        const OverlapQueryAnswer answer =
            world.overlaps(ground, object.settings.shape, object.state.pose, touching,
                           {.layers = ~kScatterLayer, .include_ground = false});
        if (answer.touching_count <= touching.size()) {
            touching.resize(answer.count);
            return std::any_of(touching.begin(), touching.end(), [&](BodyId id) {
                return world.settings()[id.index].type == BodyType::dynamic_body;
            });
        }
        touching.resize(answer.touching_count);
    }
}

}  // namespace

Result<ObjectBodies> ObjectBodies::create(std::shared_ptr<const HeightSource> source,
                                          const SceneObjects* scene_objects) {
    ObjectBodies made;
    if (scene_objects == nullptr) return made;
    const SceneObjects& objects = *scene_objects;
    std::map<std::pair<std::size_t, double>, Compound> shapes;  // by mesh and error
    const auto shape_of = [&](std::size_t mesh, double error) -> Result<Compound> {
        const auto known = shapes.find({mesh, error});
        if (known != shapes.end()) return known->second;
        Result<Compound> shape = make_mesh_body(objects.meshes[mesh], objects.files[mesh], error);
        if (shape) shapes.emplace(std::pair(mesh, error), *shape);
        return shape;
    };
    for (const SceneObject& object : objects.objects) {
        if (!object.proxy_error) continue;
        const Result<Compound> shape = shape_of(object.mesh, *object.proxy_error);
        if (!shape) return tl::unexpected(shape.error());
        const Result<Compound> sized = scaled(*shape, object.scale);
        if (!sized) return tl::unexpected(sized.error());
        made.placed_.push_back(static_body(*sized, object.world_from_object, 1));
    }
    for (const SceneScatter& wanted : objects.scatters) {
        if (!wanted.proxy_error) continue;
        Result<Compound> shape = shape_of(wanted.mesh, *wanted.proxy_error);
        if (!shape) return tl::unexpected(shape.error());
        Result<Scatter> scatter = Scatter::create(source, wanted.settings);
        if (!scatter) {
            return fail(scatter.error().code,
                        objects.files[wanted.mesh] + ": " + scatter.error().message);
        }
        const double radius = bounding_radius(*shape) * wanted.settings.max_scale;
        made.scatters_.push_back(std::make_unique<StaticScatter>(StaticScatter{
            .scatter = *std::move(scatter), .shape = *std::move(shape), .radius = radius}));
    }
    return made;
}

// Quantized, so that bodies at rest and small steps change nothing.
std::vector<ObjectBodies::Surroundings> ObjectBodies::surroundings_of(const World& world) {
    std::vector<Surroundings> around;
    const double corner = 0.5 * std::sqrt(3.0) * kCube;
    for (std::size_t i = 0; i < world.states().size(); ++i) {
        const BodyState& state = world.states()[i];
        if (state.condition == BodyCondition::removed ||
            state.condition == BodyCondition::left_world ||
            world.settings()[i].type != BodyType::dynamic_body)
            continue;
        const Eigen::Vector3d& v = state.velocity;
        const double speed = std::sqrt(v.x() * v.x() + v.y() * v.y() + v.z() * v.z());
        const double reach =
            bounding_radius(world.settings()[i].shape) + 2.0 * corner + kAhead * speed;
        Surroundings of_body;
        for (int axis = 0; axis < 3; ++axis) {
            of_body.cube[static_cast<std::size_t>(axis)] =
                static_cast<std::int64_t>(std::floor(state.pose.translation[axis] / kCube));
        }
        of_body.reach = kCube * std::ceil(reach / kCube);
        around.push_back(of_body);
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    return around;
}

// The objects near bodies; forgets squares that are not.
Result<std::set<ObjectBodies::Key>> ObjectBodies::find_near(std::span<const Surroundings> around) {
    std::set<Key> found;
    for (std::size_t i = 0; i < scatters_.size(); ++i) {
        StaticScatter& scatter = *scatters_[i];
        std::map<ScatterSquare, std::vector<ScatterPoint>> squares;
        for (const Surroundings& body : around) {
            const WorldPos middle = kCube * WorldPos(static_cast<double>(body.cube[0]) + 0.5,
                                                     static_cast<double>(body.cube[1]) + 0.5,
                                                     static_cast<double>(body.cube[2]) + 0.5);
            const double reach = body.reach + scatter.radius;
            const std::optional<ScatterRange> range = scatter.scatter.squares_within(middle, reach);
            if (!range) continue;
            for (std::int32_t y = range->low.y; y <= range->high.y; ++y) {
                for (std::int32_t x = range->low.x; x <= range->high.x; ++x) {
                    const auto [square, is_new] = squares.try_emplace({x, y});
                    const auto known = scatter.squares.find(square->first);
                    if (is_new && known != scatter.squares.end()) {
                        square->second = std::move(known->second);
                    } else if (is_new) {
                        Result<std::vector<ScatterPoint>> points =
                            scatter.scatter.objects_in(square->first);
                        if (!points) return tl::unexpected(points.error());
                        square->second = *std::move(points);
                    }
                    for (std::size_t index = 0; index < square->second.size(); ++index) {
                        const WorldPos& p_world = square->second[index].position_world;
                        if ((p_world - middle).squaredNorm() <= reach * reach)
                            found.insert({i, square->first, index});
                    }
                }
            }
        }
        scatter.squares = std::move(squares);
    }
    return found;
}

// Where the world has such a body already, it is taken.
Result<std::optional<BodyId>> ObjectBodies::add(const Key& key, World& world,
                                                const Ground& ground) {
    const StaticScatter& scatter = *scatters_[key.scatter];
    const ScatterPoint& point = scatter.squares.at(key.square)[key.index];
    if (const auto found = loaded_.find(coordinates(point.position_world));
        found != loaded_.end()) {
        const BodyId id = found->second;
        loaded_.erase(found);
        return id;
    }
    const Result<Compound> shape = scaled(scatter.shape, point.scale);
    if (!shape) return tl::unexpected(shape.error());
    const PlacedBody body = static_body(*shape, pose_of(point), kScatterLayer);
    if (overlaps_dynamic(world, ground, body)) return std::optional<BodyId>();
    const Result<BodyId> added = world.add(body.settings, body.state);
    if (!added) return tl::unexpected(added.error());
    return *added;
}

Result<void> ObjectBodies::follow(World& world, const Ground& ground) {
    if (scatters_.empty()) return {};
    std::vector<Surroundings> around = surroundings_of(world);
    if (!has_followed_ || around != around_) {
        if (!has_followed_) {
            for (std::size_t i = 0; i < world.states().size(); ++i) {
                if (world.states()[i].condition == BodyCondition::removed ||
                    world.settings()[i].filter.layers != kScatterLayer)
                    continue;
                loaded_.emplace(coordinates(world.states()[i].pose.translation), world.id(i));
            }
        }
        const Result<std::set<Key>> wanted = find_near(around);
        if (!wanted) return tl::unexpected(wanted.error());
        for (auto each = near_.begin(); each != near_.end();) {
            const bool is_far = !wanted->contains(each->first);
            // An id that the world gave is valid: nothing to report.
            if (is_far && each->second) (void)world.remove(*each->second);
            each = is_far ? near_.erase(each) : std::next(each);
        }
        for (const Key& key : *wanted) near_.try_emplace(key);
        around_ = std::move(around);
    }
    for (auto& [key, body] : near_) {
        if (body) continue;
        Result<std::optional<BodyId>> added = add(key, world, ground);
        if (!added) return tl::unexpected(added.error());
        body = *added;
    }
    for (const auto& [place, body] : loaded_) (void)world.remove(body);
    loaded_.clear();
    has_followed_ = true;
    return {};
}

}  // namespace terrane::tools
