// SPDX-License-Identifier: MIT
#include "scene/scene_nodes.h"

#include "scene/scene_objects.h"

#include <terrane/terrain/primitive_meshes.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostDepth = 64;        // of nested children
constexpr std::size_t kMostNodes = 1u << 16;  // of a scene
constexpr std::array kPrimitives = {"sphere", "box", "capsule", "cylinder"};
constexpr std::array kContents = {"mesh",   "sphere", "box",       "capsule", "cylinder",
                                  "sprite", "switch", "billboard", "emitter"};
constexpr float kSpriteCut = 0.5f;      // opacity below which a sprite is not drawn
constexpr double kLargestSprite = 1e4;  // side, metres

/// [r, g, b], or [r, g, b, opacity], of 0 to 1 with display gamma.
template <std::size_t count>
Parsed<std::array<float, count>> read_colour(const Json& value, const std::string& name) {
    const auto numbers = numbers_of<count>(value);
    std::array<float, count> colour{};
    for (std::size_t i = 0; numbers && i < count; ++i) {
        if (!((*numbers)[i] >= 0.0 && (*numbers)[i] <= 1.0))
            return wrong(name + " must be 0 to 1, got " + shown(value));
        colour[i] = static_cast<float>((*numbers)[i]);
    }
    if (numbers) return colour;
    return wrong(
        fmt::format("{} must be {} numbers from 0 to 1, got {}", name, count, shown(value)));
}

Parsed<Eigen::Vector3d> read_vector(const Json& object, const char* key,
                                    const Eigen::Vector3d& otherwise) {
    if (!object.contains(key)) return otherwise;
    const auto numbers = read_array<3>(object, key);
    if (!numbers) return wrong(numbers.error());
    return Eigen::Vector3d(numbers->data());
}

Parsed<std::array<double, 2>> read_span(const Json& object, const char* key,
                                        const std::array<double, 2>& otherwise) {
    if (!object.contains(key)) return otherwise;
    return read_array<2>(object, key);
}

Parsed<std::uint64_t> read_whole(const Json& object, const char* key, std::uint64_t otherwise) {
    const auto found = object.find(key);
    if (found == object.end()) return otherwise;
    if (!found->is_number_unsigned())
        return wrong(
            fmt::format("{} must be a whole number of at least 0, got {}", key, shown(*found)));
    return found->get<std::uint64_t>();
}

Parsed<SwitchNode> read_switch(const Json& value, const std::string& path) {
    if (const auto good = check_keys(value, path, {"by", "limits", "hysteresis", "fade_ratio"});
        !good)
        return wrong(good.error());
    SwitchNode levels;
    levels.by = SwitchNode::By::distance;
    if (const auto by = value.find("by"); by != value.end()) {
        constexpr std::array<const char*, 3> kNames = {"distance", "centre", "error"};
        const auto found =
            std::ranges::find_if(kNames, [&](const char* name) { return *by == name; });
        if (found == kNames.end())
            return wrong(path + ".by must be distance, centre or error, got " + shown(*by));
        levels.by = static_cast<SwitchNode::By>(found - kNames.begin());
    }
    const auto limits = value.find("limits");
    if (limits == value.end()) return wrong(path + ".limits is missing");
    const auto is_limit = [](const Json& each) { return each.is_number() || each == "always"; };
    if (!limits->is_array() || !std::ranges::all_of(*limits, is_limit))
        return wrong(path + ".limits must be numbers, or \"always\", got " + shown(*limits));
    for (const Json& each : *limits) {
        levels.limits.push_back(each.is_number() ? each.get<double>()
                                                 : std::numeric_limits<double>::infinity());
    }
    const Parsed<double> hysteresis = read_in_range(value, "hysteresis", 1.0, 1.0, 2.0);
    if (!hysteresis) return wrong(path + "." + hysteresis.error());
    levels.hysteresis = *hysteresis;
    const Parsed<double> fade = read_in_range(value, "fade_ratio", 1.0, 1.0, 2.0);
    if (!fade) return wrong(path + "." + fade.error());
    levels.fade_ratio = *fade;
    return levels;
}

Parsed<EmitterNode> read_emitter(const Json& value, const std::string& path) {
    const auto good =
        check_keys(value, path,
                   {"per_s", "life_s", "source_m", "velocity", "spread_m_s", "wind", "drag_s",
                    "acceleration", "radius_m", "colour", "image", "most", "seed"});
    if (!good) return wrong(good.error());
    EmitterNode emitter;
    const auto read_into = [&](const char* key, double& to) -> Parsed<void> {
        if (!value.contains(key)) return {};
        const Parsed<double> number = read_number(value, key);
        if (!number) return wrong(path + "." + number.error());
        to = *number;
        return {};
    };
    const auto vector_into = [&](const char* key, Eigen::Vector3d& to) -> Parsed<void> {
        const Parsed<Eigen::Vector3d> read = read_vector(value, key, to);
        if (!read) return wrong(path + "." + read.error());
        to = *read;
        return {};
    };
    const auto span_into = [&](const char* key, std::array<double, 2>& to) -> Parsed<void> {
        const Parsed<std::array<double, 2>> read = read_span(value, key, to);
        if (!read) return wrong(path + "." + read.error());
        to = *read;
        return {};
    };
    TERRANE_TRY(read_into("per_s", emitter.rate));
    TERRANE_TRY(span_into("life_s", emitter.life));
    TERRANE_TRY(read_into("source_m", emitter.source_radius));
    TERRANE_TRY(vector_into("velocity", emitter.velocity));
    TERRANE_TRY(read_into("spread_m_s", emitter.velocity_spread));
    TERRANE_TRY(vector_into("wind", emitter.wind));
    TERRANE_TRY(read_into("drag_s", emitter.drag_time));
    TERRANE_TRY(vector_into("acceleration", emitter.acceleration));
    TERRANE_TRY(span_into("radius_m", emitter.radius));
    if (const auto colours = value.find("colour"); colours != value.end()) {
        if (!colours->is_array() || colours->size() != 2)
            return wrong(path + ".colour must be two colours [r, g, b, opacity], got " +
                         shown(*colours));
        for (std::size_t i = 0; i < 2; ++i) {
            const auto colour =
                read_colour<4>((*colours)[i], fmt::format("{}.colour[{}]", path, i));
            if (!colour) return wrong(colour.error());
            emitter.colours[i] = *colour;
        }
    }
    const Parsed<std::uint64_t> most = read_whole(value, "most", emitter.most_particles);
    if (!most) return wrong(path + "." + most.error());
    emitter.most_particles = *most;
    const Parsed<std::uint64_t> seed = read_whole(value, "seed", 0);
    if (!seed) return wrong(path + "." + seed.error());
    emitter.seed = *seed;
    return emitter;
}

Parsed<TriangleMesh> read_primitive(const Json& node, const std::string& kind,
                                    const std::string& path) {
    const Json& value = node[kind];
    const std::string here = path + "." + kind;
    const bool is_box = kind == "box", has_height = kind == "capsule" || kind == "cylinder";
    const auto known = is_box       ? check_keys(value, here, {"half_extents"})
                       : has_height ? check_keys(value, here, {"radius", "half_height"})
                                    : check_keys(value, here, {"radius"});
    if (!known) return wrong(known.error());
    const auto number = [&](const char* key) -> Parsed<double> {
        const Parsed<double> read = read_number(value, key);
        return read ? read : wrong(here + "." + read.error());
    };
    Result<TriangleMesh> mesh = TriangleMesh();
    if (is_box) {
        const auto extents = read_array<3>(value, "half_extents");
        if (!extents) return wrong(here + "." + extents.error());
        mesh = make_box_mesh(Eigen::Vector3d(extents->data()));
    } else {
        TERRANE_TRY(const double radius, number("radius"));
        double half_height = 0.0;
        if (has_height) {
            TERRANE_TRY(const double read, number("half_height"));
            half_height = read;
        }
        mesh = kind == "sphere"    ? make_sphere_mesh(radius)
               : kind == "capsule" ? make_capsule_mesh(radius, half_height)
                                   : make_cylinder_mesh(radius, half_height);
    }
    if (!mesh) return wrong(here + "." + mesh.error().message);
    std::array<float, 3> colour{0.8f, 0.78f, 0.74f};
    if (node.contains("colour")) {
        TERRANE_TRY(const auto read, read_colour<3>(node["colour"], path + ".colour"));
        colour = read;
    }
    std::array<std::uint8_t, 4> bytes{0, 0, 0, 255};
    for (std::size_t i = 0; i < 3; ++i)
        bytes[i] = static_cast<std::uint8_t>(std::lround(255.0f * colour[i]));
    mesh->colours.assign(mesh->positions.size(), bytes);
    return *std::move(mesh);
}

/// An upright picture of a sprite: its lower edge is centred at the origin. Its normals point up, so that its light
/// does not depend on the side from which it is seen.
///
/// @param axis of the billboard above it: `up` turns x to the eye, `screen` z
TriangleMesh make_sprite_mesh(double width, double height, BillboardNode::Axis axis) {
    const bool is_up = axis == BillboardNode::Axis::up;
    TriangleMesh mesh;
    for (const auto& [u, v] : {std::pair(0.0f, 0.0f), std::pair(1.0f, 0.0f), std::pair(1.0f, 1.0f),
                               std::pair(0.0f, 1.0f)}) {
        const double right = (u - 0.5) * width, up = v * height;
        mesh.positions.push_back(is_up ? Eigen::Vector3d(0.0, right, up)
                                       : Eigen::Vector3d(right, up, 0.0));
        mesh.normals.push_back(is_up ? Eigen::Vector3f::UnitZ() : Eigen::Vector3f::UnitY());
        mesh.texture_coordinates.emplace_back(u, v);
    }
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

class NodeReader {
public:
    explicit NodeReader(const std::string& folder) : folder_(folder) {}

    /// What a node without a parent is placed in.
    enum class Base { world, body };

    SceneNodes made;

    Parsed<void> read_list(const Json& list, const std::string& path,
                           std::optional<std::size_t> parent, std::size_t depth) {
        if (!list.is_array()) return wrong(path + " must be a list, got " + shown(list));
        if (depth > kMostDepth)
            return wrong(fmt::format("{} is nested more than {} deep", path, kMostDepth));
        for (std::size_t i = 0; i < list.size(); ++i) {
            TERRANE_TRY(read_node(list[i], fmt::format("{}[{}]", path, i), parent, depth));
        }
        return {};
    }

    Parsed<void> read_node(const Json& value, const std::string& path,
                           std::optional<std::size_t> parent, std::size_t depth,
                           Base base = Base::world) {
        const auto known =
            check_keys(value, path,
                       {"position", "rotation", "scale", "on_ground", "children", "mesh", "levels",
                        "crease_deg", "sphere", "box", "capsule", "cylinder", "colour", "sprite",
                        "switch", "billboard", "emitter"});
        if (!known) return wrong(known.error());
        if (made.nodes.size() >= kMostNodes)
            return wrong(fmt::format("{}: a scene has at most {} nodes", path, kMostNodes));
        SceneNode node;
        node.path = path;
        node.parent = parent;
        const bool is_in_world = !parent && base == Base::world;
        const auto pose =
            read_pose(value, is_in_world ? PositionAbsent::is_wrong : PositionAbsent::is_origin);
        if (!pose) return wrong(path + "." + pose.error());
        node.place.parent_from_node = *pose;
        const Parsed<double> scale = read_in_range(value, "scale", 1.0, 1e-3, 1e3);
        if (!scale) return wrong(path + "." + scale.error());
        node.place.scale = *scale;
        if (const auto found = value.find("on_ground"); found != value.end()) {
            if (!found->is_boolean())
                return wrong(path + ".on_ground must be true or false, got " + shown(*found));
            node.is_on_ground = found->get<bool>();
            if (node.is_on_ground && !is_in_world)
                return wrong(path + (parent ? ".on_ground goes only with nodes without a parent"
                                            : ".on_ground does not go with the node of a body"));
        }
        TERRANE_TRY(read_content(value, path, node));
        const std::size_t index = made.nodes.size();
        made.nodes.push_back(std::move(node));
        if (value.contains("sprite")) {
            TERRANE_TRY(add_sprite(value["sprite"], path + ".sprite", index));
        }
        const auto children = value.find("children");
        const std::size_t levels = children == value.end() ? 0 : children->size();
        if (const auto* by = std::get_if<SwitchNode>(&made.nodes[index].content)) {
            if (levels != by->limits.size())
                return wrong(
                    fmt::format("{}.switch needs one child for each of its {} limits, got "
                                "{}",
                                path, by->limits.size(), levels));
        }
        if (children == value.end()) return {};
        return read_list(*children, path + ".children", index, depth + 1);
    }

private:
    Parsed<void> read_content(const Json& value, const std::string& path, SceneNode& node) {
        std::string kind;
        for (const char* each : kContents) {
            if (!value.contains(each)) continue;
            if (!kind.empty())
                return wrong(fmt::format("{} has a {} and a {}: one of them belongs to a child",
                                         path, kind, each));
            kind = each;
        }
        const bool is_primitive = std::ranges::find(kPrimitives, kind) != kPrimitives.end();
        if (value.contains("colour") && !is_primitive)
            return wrong(path + ".colour goes with sphere, box, capsule or cylinder");
        for (const char* key : {"crease_deg", "levels"}) {
            if (value.contains(key) && kind != "mesh")
                return wrong(fmt::format("{}.{} goes with mesh", path, key));
        }
        if (is_primitive) {
            const Json colour = value.contains("colour") ? value["colour"] : Json();
            const std::string text = Json{kind, value[kind], colour}.dump();
            auto known = shapes_.find(text);
            if (known == shapes_.end()) {
                TERRANE_TRY(TriangleMesh mesh, read_primitive(value, kind, path));
                known = shapes_.emplace(text, add_shape(std::move(mesh), {}, path)).first;
            }
            node.content = MeshOfNode{known->second};
        } else if (kind == "mesh") {
            const Parsed<std::size_t> mesh = read_file(value);
            if (!mesh) return wrong(path + "." + mesh.error());
            node.content = MeshOfNode{*mesh};
        } else if (kind == "sprite") {
            const Json& axis = value[kind].is_object() && value[kind].contains("axis")
                                   ? value[kind]["axis"]
                                   : Json("up");
            TERRANE_TRY(node.content, read_axis(axis, path + ".sprite.axis"));
        } else if (kind == "switch") {
            TERRANE_TRY(node.content, read_switch(value[kind], path + ".switch"));
        } else if (kind == "emitter") {
            TERRANE_TRY(node.content, read_emitter(value[kind], path + ".emitter"));
            if (value[kind].contains("image")) {
                TERRANE_TRY(node.image, read_particle_image(value[kind], path + ".emitter"));
            }
        } else if (kind == "billboard") {
            TERRANE_TRY(node.content, read_axis(value[kind], path + ".billboard"));
        }
        return {};
    }

    static Parsed<BillboardNode> read_axis(const Json& axis, const std::string& path) {
        if (axis != "screen" && axis != "up")
            return wrong(path + " must be screen or up, got " + shown(axis));
        return BillboardNode{axis == "up" ? BillboardNode::Axis::up : BillboardNode::Axis::screen};
    }

    /// Adds the picture of a sprite below its billboard.
    Parsed<void> add_sprite(const Json& value, const std::string& path, std::size_t billboard) {
        const auto known = check_keys(value, path, {"image", "size_m", "axis"});
        if (!known) return wrong(known.error());
        TERRANE_TRY(const auto picture, read_picture(value, path));
        const auto size = read_array<2>(value, "size_m");
        if (!size) return wrong(path + "." + size.error());
        for (const double side : *size) {
            if (!(side > 0.0 && side <= kLargestSprite))
                return wrong(path + ".size_m must be above 0 and at most 1e4 m, got " +
                             shown(value["size_m"]));
        }
        const std::string text = value.dump();
        auto shape = shapes_.find(text);
        if (shape == shapes_.end()) {
            MeshMaterial material;
            material.is_two_sided = true;
            material.colour = {255, 255, 255};
            material.colour_texture = {picture, TextureWrap::clamp, TextureWrap::clamp};
            material.alpha_cutoff = kSpriteCut;
            const auto& turning = std::get<BillboardNode>(made.nodes[billboard].content);
            TriangleMesh mesh = make_sprite_mesh((*size)[0], (*size)[1], turning.axis);
            shape = shapes_.emplace(text, add_shape(std::move(mesh), {material}, path)).first;
        }
        SceneNode node;
        node.path = path;
        node.parent = billboard;
        node.content = MeshOfNode{shape->second};
        made.nodes.push_back(std::move(node));
        return {};
    }

    /// Adds the mesh of a primitive or a sprite; returns its index.
    std::size_t add_shape(TriangleMesh mesh, std::vector<MeshMaterial> materials,
                          const std::string& path) {
        made.meshes.push_back(std::move(mesh));
        made.materials.push_back(std::move(materials));
        made.coarser.emplace_back();
        made.files.push_back(path);
        names_.emplace_back();
        return made.meshes.size() - 1;
    }

    /// The image that a sprite or an emitter names; reads its file if no earlier one names it.
    Parsed<std::shared_ptr<const TextureImage>> read_picture(const Json& value,
                                                             const std::string& path) {
        const auto image = value.find("image");
        if (image == value.end() || !image->is_string())
            return wrong(path + ".image must be a file");
        const auto file = image->get<std::string>();
        const auto known = pictures_.find(file);
        if (known != pictures_.end()) return known->second;
        const auto picture = read_image(folder_, file);
        if (!picture)
            return wrong(fmt::format("{}.image '{}': {}", path, file, picture.error().message));
        pictures_.emplace(file, *picture);
        return *picture;
    }

    /// Index of the image of an emitter.
    Parsed<std::size_t> read_particle_image(const Json& value, const std::string& path) {
        TERRANE_TRY(const auto picture, read_picture(value, path));
        const auto found = std::ranges::find(made.images, picture);
        const auto index = static_cast<std::size_t>(found - made.images.begin());
        if (found == made.images.end()) made.images.push_back(picture);
        return index;
    }

    /// Index of the mesh that a node names; reads its file if no earlier node names it with this crease angle.
    Parsed<std::size_t> read_file(const Json& value) {
        const Parsed<MeshName> name = read_mesh_name(value, folder_);
        if (!name) return wrong(name.error());
        const auto found = std::ranges::find(names_, std::optional(*name));
        if (found != names_.end()) return static_cast<std::size_t>(found - names_.begin());
        Parsed<LevelledModel> model = read_named_mesh(*name);
        if (!model) return wrong(model.error());
        made.meshes.push_back(std::move(model->mesh));
        made.materials.push_back(std::move(model->materials));
        made.coarser.push_back(std::move(model->coarser));
        made.files.push_back(name->file);
        names_.emplace_back(*name);
        return made.meshes.size() - 1;
    }

    std::string folder_;
    std::vector<std::optional<MeshName>> names_;  // [made.meshes] none: a primitive or a sprite
    std::map<std::string, std::size_t> shapes_;   // meshes of primitives and sprites, by their text
    std::map<std::string, std::shared_ptr<const TextureImage>> pictures_;  // by the names of files
};

}  // namespace

Parsed<SceneNodes> read_nodes(const Json& list, const std::string& folder) {
    NodeReader reader(folder);
    TERRANE_TRY(reader.read_list(list, "nodes", {}, 0));
    return std::move(reader.made);
}

Parsed<SceneNodes> read_body_nodes(const Json& bodies, const std::string& folder,
                                   std::vector<std::optional<std::size_t>>& roots_out) {
    NodeReader reader(folder);
    roots_out.assign(bodies.size(), std::nullopt);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const auto node = bodies[i].find("node");
        if (node == bodies[i].end()) continue;
        roots_out[i] = reader.made.nodes.size();
        TERRANE_TRY(reader.read_node(*node, fmt::format("bodies[{}].node", i), {}, 0,
                                     NodeReader::Base::body));
    }
    return std::move(reader.made);
}

}  // namespace terrane::tools
