// SPDX-License-Identifier: MIT
#include "scene/body_placement.h"

#include "program/geometry.h"
#include "program/options.h"
#include "scene/scene_bodies.h"
#include "scene/scene_objects.h"
#include "scene/terrain_options.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/terrain/height_source.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

namespace terrane::tools {
namespace {

constexpr std::size_t kMostCrates = 10'000;
constexpr double kLeastHalf = 0.2, kGreatestHalf = 0.5;            // half extents, metres
constexpr double kLeastDensity = 100.0, kGreatestDensity = 400.0;  // kg/m^3
constexpr double kLane = 1.0;         // largest distance from the path of the crates on it, metres
constexpr double kLeastBeside = 5.0;  // least half width of the strip for other crates, metres
constexpr double kAreaOfOne = 8.0;    // least area of the strip for one crate, m^2
constexpr double kApart = 0.2;        // least gap between the crates' bounding discs, metres
constexpr double kGentle = 0.906;     // cosine of the steepest slope that is not avoided
constexpr int kTries = 64;            // positions tried for a crate

double strip_half_width(const CrateLayout& layout) {
    const double area = kAreaOfOne * static_cast<double>(layout.count);
    return std::max(kLeastBeside, 0.5 * area / layout.path.length());
}

/// The point `left` metres to the left of the path's point at `along`.
Eigen::Vector2d point_beside(const Polyline& path, double along, double left) {
    const Eigen::Vector2d direction = path.direction(along);
    return path.at(along) + left * Eigen::Vector2d(-direction.y(), direction.x());
}

/// The pose of a box of half height `half` that lies on the plane of the ground, rotated by `yaw` about the normal.
Pose pose_on(const HeightAnswer& at, const Eigen::Vector2d& p_world, double yaw, double half) {
    const Eigen::Vector3d along =
        Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0.0).cross(at.normal).normalized();
    Pose pose;
    pose.rotation << along, at.normal.cross(along), at.normal;
    pose.translation = WorldPos(p_world.x(), p_world.y(), at.height) + half * at.normal;
    return pose;
}

/// Places crates one by one.
class CratePlacer {
public:
    CratePlacer(const CrateLayout& layout, const Ground& ground, const World& obstacles)
        : layout_(layout),
          ground_(ground),
          obstacles_(obstacles),
          half_width_(strip_half_width(layout)) {}

    /// Places the crate with an index; false if no position is found.
    bool place(std::size_t index) {
        BodyRandom random(layout_.seed, index);
        PlacedBody crate;
        const Eigen::Vector3d half(random.within(kLeastHalf, kGreatestHalf),
                                   random.within(kLeastHalf, kGreatestHalf),
                                   random.within(kLeastHalf, kGreatestHalf));
        crate.settings.shape = Box{half};
        crate.settings.mass = 8.0 * half.prod() * random.within(kLeastDensity, kGreatestDensity);
        for (int i = 0; i < kTries; ++i) {
            const double beside = index % 4 == 0 && i < kTries / 2 ? kLane : half_width_;
            const double along = random.within(0.0, layout_.path.length());
            const double left = random.within(-beside, beside);
            const double yaw = random.within(0.0, 6.283185307179586);
            const Eigen::Vector2d p_world = point_beside(layout_.path, along, left);
            if (!has_room(p_world, half.norm())) continue;
            const HeightAnswer at = ground_.height(p_world.x(), p_world.y());
            has_absent_ground_ = has_absent_ground_ || at.status == QueryStatus::not_resident;
            if (at.status != QueryStatus::ok) continue;
            if (i < kTries / 2 && at.normal.z() < kGentle) continue;
            Pose pose = pose_on(at, p_world, yaw, half.z());
            const LiftAnswer answer = compute_lift(crate.settings.shape, pose, ground_);
            if (answer.status != QueryStatus::ok || !std::isfinite(answer.lift)) continue;
            pose.translation.z() += answer.lift;
            if (!is_free(obstacles_, ground_, crate.settings.shape, pose)) continue;
            crate.state.pose = pose;
            discs_.push_back({p_world, half.norm()});
            crates_.push_back(crate);
            return true;
        }
        return false;
    }

    std::vector<PlacedBody>& crates() { return crates_; }
    bool has_absent_ground() const { return has_absent_ground_; }

private:
    struct Disc {
        Eigen::Vector2d centre_world;
        double radius = 0.0;
    };

    bool has_room(const Eigen::Vector2d& p_world, double radius) const {
        const Eigen::Vector2d start = layout_.path.points().front();
        if ((p_world - start).norm() < layout_.start_radius + radius) return false;
        return std::none_of(discs_.begin(), discs_.end(), [&](const Disc& disc) {
            const double apart = disc.radius + radius + kApart;
            return (disc.centre_world - p_world).squaredNorm() < apart * apart;
        });
    }

    const CrateLayout& layout_;
    const Ground& ground_;
    const World& obstacles_;
    double half_width_ = 0.0;
    bool has_absent_ground_ = false;
    std::vector<Disc> discs_;
    std::vector<PlacedBody> crates_;
};

}  // namespace

void add_crates_option(CLI::App& app, std::size_t& count) {
    add_count(app, "--crates", count, 0,
              "Boxes of random size and mass on and beside the path, at rest on the ground; the "
              "terrain's --seed lays them out",
              kMostCrates);
}

std::vector<BodyNeed> crate_needs(const CrateLayout& layout, const HeightSource& source) {
    std::vector<BodyNeed> needs;
    if (layout.count == 0) return needs;
    const double half_width = strip_half_width(layout);
    const double radius = 1.5 * half_width + 2.0 * kGreatestHalf;
    for (double along = 0.0;; along += half_width) {
        const Eigen::Vector2d p = layout.path.at(along);
        needs.push_back(
            {.centre_world = {p.x(), p.y(), source.height(p.x(), p.y())}, .radius = radius});
        if (along >= layout.path.length()) return needs;
    }
}

CommandResult<std::vector<PlacedBody>> lay_out_crates(const CrateLayout& layout,
                                                      const Ground& ground,
                                                      const World& obstacles) {
    CratePlacer placer(layout, ground, obstacles);
    for (std::size_t i = 0; i < layout.count; ++i) {
        if (placer.place(i)) continue;
        if (placer.has_absent_ground()) {
            return failure(
                fmt::format("the ground along the path, where {} crates are placed, does not fit "
                            "in --memory-mb",
                            layout.count));
        }
        return failure(
            fmt::format("only {} of {} crates find free ground along the path", i, layout.count));
    }
    return std::move(placer.crates());
}

namespace {

// At a scale of 1:
constexpr double kPlace =
    5.0;  // side of the grid square of each body, metres: more than the longest box
constexpr double kClearance = 2.0;  // least height of a start above the ground, metres
constexpr double kFurtherUp =
    10.0;  // range of the heights of starts, metres, so that bodies do not all land at once
constexpr std::uint64_t kLayoutTries = 64;  // positions tried before a body is left out

/// Upper bound of the heights of the contact surface under a disc; absent if part of the disc has no ground.
std::optional<double> ground_below(const Ground& ground, double x, double y, double radius) {
    const CellRange cells{ground.column_at(x - radius), ground.row_at(y - radius),
                          ground.column_at(x + radius), ground.row_at(y + radius)};
    if (ground.height(x, y).status != QueryStatus::ok) return std::nullopt;
    const RangeAnswer range = ground.range(cells);
    if (range.status != QueryStatus::ok) return std::nullopt;
    return ground.lattice().quantum * static_cast<double>(range.high);
}

ConvexHull make_stone(double scale) {
    std::array<Eigen::Vector3d, 6> corners{{{1.2, 0.0, 0.1},
                                            {-0.9, 0.2, 0.0},
                                            {0.0, 1.0, -0.1},
                                            {0.1, -0.8, 0.0},
                                            {0.0, 0.1, 0.7},
                                            {0.0, 0.0, -0.6}}};
    for (Eigen::Vector3d& corner : corners) corner *= scale;
    return ConvexHull::create(corners).value();
}

Compound make_hammer(double scale) {
    std::array<CompoundPart, 2> parts{
        CompoundPart{Box{scale * Eigen::Vector3d(0.3, 0.8, 0.3)}, {}},
        CompoundPart{Capsule{.radius = 0.2 * scale, .half_height = 0.8 * scale}, {}}};
    parts[0].body_from_part.translation = {1.0 * scale, 0.0, 0.0};
    parts[1].body_from_part.rotation << 0.0, 0.0, 1.0,  //
        1.0, 0.0, 0.0,                                  //
        0.0, 1.0, 0.0;
    return Compound::create(parts).value();
}

}  // namespace

Shape shape_of_body(const DropLayout& layout, std::size_t body) {
    constexpr std::array kTurns{DropShape::sphere, DropShape::capsule, DropShape::box};
    const double scale = layout.scale;
    switch (layout.shape == DropShape::mixed ? kTurns[body % kTurns.size()] : layout.shape) {
        case DropShape::capsule:
            return Capsule{.radius = 0.4 * scale, .half_height = 0.8 * scale};
        case DropShape::box:
            return Box{.half_extents = {1.0 * scale, 2.0 * scale, 0.5 * scale}};
        case DropShape::hull:
            return make_stone(scale);
        case DropShape::compound:
            return make_hammer(scale);
        case DropShape::file:
            return layout.file_shape.value();
        case DropShape::sphere:
        case DropShape::mixed:
            break;
    }
    return Sphere{.radius = 0.5 * scale};
}

WorldRect drop_area(const DropLayout& layout, const WorldRect& extent) {
    double place = kPlace * layout.scale;
    if (layout.file_shape) place = std::max(place, 2.5 * bounding_radius(*layout.file_shape));
    const double side = place * std::ceil(std::sqrt(static_cast<double>(layout.count)));
    return square_around(layout.start.value_or(middle_of(extent)), side, extent);
}

std::vector<PlacedBody> lay_out(const DropLayout& layout, const Ground& ground,
                                const World& obstacles) {
    const WorldRect area = drop_area(layout, ground.extent());
    const auto columns =
        static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(layout.count))));
    const double place_x = (area.east - area.west) / static_cast<double>(columns);
    const double place_y = (area.north - area.south) / static_cast<double>(columns);
    std::vector<PlacedBody> bodies;
    for (std::size_t body = 0; body < layout.count; ++body) {
        BodyRandom random(layout.seed, body);
        PlacedBody dropped;
        dropped.settings.shape = shape_of_body(layout, body);
        const double radius = bounding_radius(dropped.settings.shape);
        const std::size_t row_index = body / columns;
        const auto column = static_cast<double>(body % columns);
        const auto row = static_cast<double>(row_index);
        double x = area.west + (column + random.unit()) * place_x;
        double y = area.south + (row + random.unit()) * place_y;
        Pose& pose = dropped.state.pose;
        bool is_placed = false;
        for (std::uint64_t i = 0; i <= kLayoutTries && !is_placed; ++i) {
            if (i > 0) {
                x = random.within(area.west, area.east);
                y = random.within(area.south, area.north);
            }
            const std::optional<double> below = ground_below(ground, x, y, radius);
            if (!below) continue;
            const double z =
                *below + radius + layout.scale * (kClearance + random.within(0.0, kFurtherUp));
            pose.translation = WorldPos(x, y, z);
            pose.rotation = random.rotation();
            is_placed = is_free(obstacles, ground, dropped.settings.shape, pose);
        }
        if (!is_placed) continue;
        dropped.state.velocity = Eigen::Vector3d(0.0, 0.0, -layout.speed);
        dropped.state.angular_velocity = layout.spin * random.direction();
        bodies.push_back(dropped);
    }
    return bodies;
}

namespace {

// Objects are selected again when a body enters another cube of this side, metres.
constexpr double kCube = 8.0;
// Objects are added for the motion of bodies over this time, seconds.
constexpr double kAhead = 0.25;
// Scattered objects have their own layer, which identifies them in a loaded world.
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

/// Whether an object would touch a dynamic body of the world.
bool overlaps_dynamic(const World& world, const Ground& ground, const PlacedBody& object) {
    std::vector<BodyId> touching(64);
    for (;;) {
        const OverlapQueryAnswer answer =
            world.overlaps(ground, object.settings.shape, object.state.pose, touching,
                           {.layers = ~kScatterLayer, .include_ground = false});
        if (answer.touching_count <= touching.size()) {
            touching.resize(answer.count);
            return std::any_of(touching.begin(), touching.end(), [&](BodyId id) {
                return world.settings(id).type == BodyType::dynamic_body;
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
        TERRANE_TRY(const Compound shape, shape_of(object.mesh, *object.proxy_error));
        TERRANE_TRY(const Compound sized, scaled(shape, object.scale));
        made.placed_.push_back(static_body(sized, object.world_from_object, 1));
    }
    for (const SceneScatter& wanted : objects.scatters) {
        if (!wanted.proxy_error) continue;
        TERRANE_TRY(const Compound shape, shape_of(wanted.mesh, *wanted.proxy_error));
        Result<Scatter> scatter = Scatter::create(source, wanted.settings);
        if (!scatter) {
            return fail(scatter.error().code,
                        objects.files[wanted.mesh] + ": " + scatter.error().message);
        }
        const double radius = bounding_radius(shape) * wanted.settings.max_scale;
        made.scatters_.push_back(std::make_unique<StaticScatter>(
            StaticScatter{.scatter = *std::move(scatter), .shape = shape, .radius = radius}));
    }
    return made;
}

// The result is quantised, so that it stays the same while bodies rest or move little.
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

// Finds the scattered objects near bodies, and drops the stored squares that are not near any body.
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
                        TERRANE_TRY(std::vector<ScatterPoint> points,
                                    scatter.scatter.objects_in(square->first));
                        square->second = std::move(points);
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

// Adds an object to the world. Absent if it would overlap a body.
Result<std::optional<BodyId>> ObjectBodies::add(const Key& key, World& world,
                                                const Ground& ground) const {
    const StaticScatter& scatter = *scatters_[key.scatter];
    const ScatterPoint& point = point_of(key);
    TERRANE_TRY(const Compound shape, scaled(scatter.shape, point.scale));
    const PlacedBody body = static_body(shape, pose_of(point), kScatterLayer);
    if (overlaps_dynamic(world, ground, body)) return std::optional<BodyId>();
    TERRANE_TRY(const BodyId added, world.add(body.settings, body.state));
    return added;
}

const ScatterPoint& ObjectBodies::point_of(const Key& key) const {
    return scatters_[key.scatter]->squares.at(key.square)[key.index];
}

// The scattered objects of a world.
std::vector<BodyId> ObjectBodies::objects_of(const World& world) {
    std::vector<BodyId> objects;
    for (std::size_t i = 0; i < world.states().size(); ++i) {
        if (world.states()[i].condition == BodyCondition::removed ||
            world.settings()[i].filter.layers != kScatterLayer)
            continue;
        objects.push_back(world.id(i));
    }
    return objects;
}

void ObjectBodies::take_over() {
    has_followed_ = false;
    near_.clear();
}

// Slots of removed bodies are reused in an order that depends on the order of removal. That is the order of the bodies'
// indices, which a loaded world has too.
Result<void> ObjectBodies::follow(World& world, const Ground& ground) {
    if (scatters_.empty()) return {};
    std::vector<Surroundings> around = surroundings_of(world);
    if (!has_followed_ || around != around_) {
        TERRANE_TRY(const std::set<Key> wanted, find_near(around));
        std::multimap<std::array<double, 3>, BodyId> loaded;  // by position
        if (!has_followed_) {
            for (const BodyId body : objects_of(world))
                loaded.emplace(coordinates(world.state(body).pose.translation), body);
        }
        std::set<BodyId> far;
        for (const auto& [place, body] : loaded) far.insert(body);
        for (const auto& [key, body] : near_) {
            if (body) far.insert(*body);
        }
        std::map<Key, std::optional<BodyId>> near;
        for (const Key& key : wanted) {
            std::optional<BodyId>& body = near[key];
            if (const auto known = near_.find(key); known != near_.end()) {
                body = known->second;
            } else if (const auto found = loaded.find(coordinates(point_of(key).position_world));
                       found != loaded.end()) {
                body = found->second;
                loaded.erase(found);
            }
            if (body) far.erase(*body);
        }
        near_ = std::move(near);
        // the ids come from the world and are valid: removal cannot fail
        for (const BodyId body : far) (void)world.remove(body);
        around_ = std::move(around);
        has_followed_ = true;
    }
    for (auto& [key, body] : near_) {
        if (body) continue;
        TERRANE_TRY(std::optional<BodyId> added, add(key, world, ground));
        body = added;
    }
    return {};
}

}  // namespace terrane::tools
