// SPDX-License-Identifier: MIT
#include "scene/scene_bodies.h"

#include "program/json_values.h"
#include "scene/mesh_files.h"

#include <terrane/collision/collision_proxy.h>

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace terrane::tools {

Result<std::vector<BodyId>> add_bodies(std::span<const PlacedBody> bodies, World& world) {
    std::vector<BodyId> ids;
    ids.reserve(bodies.size());
    for (const PlacedBody& body : bodies) {
        TERRANE_TRY(const BodyId added, world.add(body.settings, body.state));
        ids.push_back(added);
    }
    return ids;
}

bool is_free(const World& world, const Ground& ground, const Shape& shape,
             const Pose& world_from_shape) {
    return world
               .overlaps(ground, shape, world_from_shape, {},
                         {.except = {}, .include_sensors = false, .include_ground = false})
               .touching_count == 0;
}

namespace {

struct ScaledBy {
    double scale;

    Result<ConvexShape> operator()(const Sphere& sphere) const {
        return Sphere{scale * sphere.radius};
    }
    Result<ConvexShape> operator()(const Capsule& capsule) const {
        return Capsule{scale * capsule.radius, scale * capsule.half_height};
    }
    Result<ConvexShape> operator()(const Box& box) const { return Box{scale * box.half_extents}; }
    Result<ConvexShape> operator()(const ConvexHull& hull) const {
        std::vector<Eigen::Vector3d> vertices(hull.vertices().begin(), hull.vertices().end());
        for (Eigen::Vector3d& p : vertices) p *= scale;
        TERRANE_TRY(ConvexHull made, ConvexHull::create(vertices));
        return made;
    }
};

}  // namespace

Result<Compound> make_mesh_body(const TriangleMesh& mesh, const std::string& file,
                                double proxy_error) {
    CollisionProxySettings settings;
    settings.proxy_error = proxy_error;
    settings.max_parts = 256;
    settings.max_hull_vertices = 256;
    settings.must_be_within_error = true;
    const Result<CollisionProxy> proxy = make_collision_proxy(mesh, settings);
    if (!proxy)
        return fail(proxy.error().code, fmt::format("'{}': {}", file, proxy.error().message));
    if (proxy->kind == CollisionProxyKind::open) {
        return fail(ErrorCode::bad_data,
                    fmt::format("'{}' is not closed: it has no inside to be a body", file));
    }
    if (proxy->kind == CollisionProxyKind::surface) {
        return fail(
            ErrorCode::bad_data,
            fmt::format("'{}' is not convex: as a body it needs a proxy error above 0", file));
    }
    if (!(default_contact_tolerance(proxy->shape) > 0.0)) {
        return fail(ErrorCode::bad_data, fmt::format("'{}' has parts without thickness", file));
    }
    return proxy->shape;
}

Result<Compound> scaled(const Compound& compound, double scale) {
    std::vector<CompoundPart> parts;
    for (const CompoundPart& part : compound.parts()) {
        TERRANE_TRY(ConvexShape shape, std::visit(ScaledBy{scale}, part.shape));
        Pose pose = part.body_from_part;
        pose.translation *= scale;
        parts.push_back({std::move(shape), pose});
    }
    return Compound::create(parts);
}

Result<Shape> read_mesh_body(const std::string& path, double proxy_error, double scale) {
    TERRANE_TRY(TriangleMesh mesh, read_mesh(path));
    for (Eigen::Vector3d& p : mesh.positions) p *= scale;
    TERRANE_TRY(const Compound body, make_mesh_body(mesh, path, proxy_error));
    return Shape(body);
}

namespace {

using Json = nlohmann::ordered_json;

constexpr double kMaxSpeed = 1e6;  // m/s and rad/s, the limit of a world

bool is_file_shape(const Json& body) {
    const auto shape = body.find("shape");
    return shape != body.end() && shape->is_object() && shape->contains("file");
}

/// Parses the shape `{"file":..,"proxy_error_m":..}`. @param path_out of the file
Parsed<Shape> read_file_shape(const Json& shape, const std::string& folder, std::string& path_out) {
    const Parsed<void> known = check_keys(shape, "shape", {"file", "proxy_error_m"});
    if (!known) return wrong(known.error());
    const Json& file = shape["file"];
    if (!file.is_string() || file.get<std::string>().empty()) {
        return wrong("shape.file must be a path, got " + shown(file));
    }
    const Parsed<double> error = read_in_range(shape, "proxy_error_m", kUsualProxyError, 0.0, 1e6);
    if (!error) return wrong("shape." + error.error());
    path_out = (std::filesystem::path(folder) / file.get<std::string>()).string();
    Result<Shape> made = read_mesh_body(path_out, *error);
    if (!made) return wrong("shape.file: " + made.error().message);
    return *std::move(made);
}

/// Parses the shape of a body. Messages begin with the key path from the body on: "shape.file".
///
/// @param mesh_file_out path of the mesh; unchanged if the shape has none
Parsed<Shape> read_body_shape(const Json& body, const std::string& folder,
                              std::string& mesh_file_out) {
    if (is_file_shape(body)) return read_file_shape(body["shape"], folder, mesh_file_out);
    Parsed<Shape> shape = read_shape(body, "shape");
    if (!shape) {
        const std::string& said = shape.error();
        return wrong(said.starts_with("shape ") ? said : "shape: " + said);
    }
    if (!(default_contact_tolerance(*shape) > 0.0)) {
        return wrong("shape must have a thickness, got " + shown(body["shape"]));
    }
    return shape;
}

Parsed<BodyType> read_type(const Json& body) {
    const auto found = body.find("type");
    if (found == body.end() || *found == "dynamic") return BodyType::dynamic_body;
    if (*found == "static") return BodyType::static_body;
    if (*found == "kinematic") return BodyType::kinematic_body;
    return wrong("type must be dynamic, static or kinematic, got " + shown(*found));
}

Parsed<Eigen::Vector3d> read_velocity(const Json& body, const char* key, BodyType type) {
    if (!body.contains(key)) return Eigen::Vector3d(Eigen::Vector3d::Zero());
    const Parsed<std::array<double, 3>> values = read_array<3>(body, key);
    if (!values) return wrong(values.error());
    const Eigen::Vector3d velocity((*values)[0], (*values)[1], (*values)[2]);
    if (type == BodyType::static_body && velocity != Eigen::Vector3d::Zero()) {
        return wrong(fmt::format("{} must be 0 of a static body, got {}", key, shown(body[key])));
    }
    if (!(velocity.cwiseAbs().maxCoeff() <= kMaxSpeed)) {
        return wrong(
            fmt::format("{} must be -1e6 to 1e6 along each axis, got {}", key, shown(body[key])));
    }
    return velocity;
}

Parsed<PlacedBody> read_body(const Json& body, const std::string& folder) {
    PlacedBody placed;
    Parsed<Shape> shape = read_body_shape(body, folder, placed.mesh_file);
    if (!shape) return wrong(shape.error());
    placed.settings.shape = *std::move(shape);
    const Parsed<BodyType> type = read_type(body);
    if (!type) return wrong(type.error());
    placed.settings.type = *type;
    if (*type != BodyType::dynamic_body && body.contains("mass")) {
        return wrong(fmt::format("mass is of dynamic bodies only, got {} and type {}",
                                 shown(body["mass"]), shown(body["type"])));
    }
    struct Figure {
        const char* key;
        double* value;
        double low, high;
    };
    for (const Figure& figure : {Figure{"mass", &placed.settings.mass, 1e-9, 1e12},
                                 Figure{"friction", &placed.settings.friction, 0.0, 1e6},
                                 Figure{"restitution", &placed.settings.restitution, 0.0, 1.0}}) {
        const Parsed<double> value =
            read_in_range(body, figure.key, *figure.value, figure.low, figure.high);
        if (!value) return wrong(value.error());
        *figure.value = *value;
    }
    const Parsed<Pose> pose = read_pose(body, PositionAbsent::is_wrong);
    if (!pose) return wrong(pose.error());
    placed.state.pose = *pose;
    const Parsed<Eigen::Vector3d> velocity = read_velocity(body, "velocity", *type);
    if (!velocity) return wrong(velocity.error());
    placed.state.velocity = *velocity;
    const Parsed<Eigen::Vector3d> spin = read_velocity(body, "spin", *type);
    if (!spin) return wrong(spin.error());
    placed.state.angular_velocity = *spin;
    return placed;
}

}  // namespace

Parsed<std::vector<PlacedBody>> read_bodies(const Json& list, const std::string& folder) {
    if (!list.is_array()) return wrong("bodies must be a list, got " + shown(list));
    Result<World> world = World::create({});
    if (!world) return wrong(world.error().message);
    std::vector<PlacedBody> bodies;
    bodies.reserve(list.size());
    for (const Json& each : list) {
        const std::string path = fmt::format("bodies[{}]", bodies.size());
        const Parsed<void> good = check_keys(each, path,
                                             {"shape", "position", "rotation", "velocity", "spin",
                                              "type", "mass", "friction", "restitution", "node"});
        if (!good) return wrong(good.error());
        if (each.contains("shape") && !is_file_shape(each)) {
            const Parsed<void> known = check_shape_keys(each["shape"], path + ".shape");
            if (!known) return wrong(known.error());
        }
        Parsed<PlacedBody> body = read_body(each, folder);
        if (!body) return wrong(path + "." + body.error());
        // the library makes further checks
        const Result<BodyId> added = world->add(body->settings, body->state);
        if (!added) return wrong(path + ": " + added.error().message);
        bodies.push_back(*std::move(body));
    }
    std::vector<std::optional<std::size_t>> roots;
    TERRANE_TRY(auto nodes, read_body_nodes(list, folder, roots));
    const auto shared = std::make_shared<const SceneNodes>(std::move(nodes));
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (!roots[i]) continue;
        bodies[i].nodes = shared;
        bodies[i].node = *roots[i];
    }
    return bodies;
}

}  // namespace terrane::tools
