// SPDX-License-Identifier: MIT
//
// A scene with its models on a renderer's device; a frame of it within the budget of a mesh.
#include "scene.h"

#include "terrain.h"

#include <terrane/base/text.h>
#include <terrane/terrain/crease_normals.h>
#include <terrane/terrain/primitive_meshes.h>

#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace terrane::python {

UploadedModels::~UploadedModels() {
    Drawing* const drawing = renderer_->find();
    if (drawing == nullptr) return;
    for (const MeshId mesh : meshes_) drawing->renderer.remove_mesh(mesh);
    for (const ImpostorId impostor : impostors_) drawing->renderer.remove_impostor(impostor);
    for (const auto& [image, id] : images_) drawing->renderer.remove_particle_image(id);
}

Result<void> UploadedModels::add(ObjectLevels& levels, const MeshMaterial& material) {
    TERRANE_TRY(upload_levels(levels, {&material, 1}, renderer_->use().renderer));
    meshes_.push_back(levels.model.mesh);
    if (levels.model.impostor) impostors_.push_back(*levels.model.impostor);
    return {};
}

Result<ParticleImageId> UploadedModels::add(TextureImage image) {
    for (const auto& [known, id] : images_) {
        if (known->width == image.width && known->rgba == image.rgba) return id;
    }
    auto made = std::make_shared<const TextureImage>(std::move(image));
    TERRANE_TRY(const ParticleImageId id, renderer_->use().renderer.add_particle_image(made));
    images_.emplace_back(std::move(made), id);
    return id;
}

namespace {

// The least threshold, not below `least_px`, at which the demands take at most `room` triangles.
double threshold_within(std::span<const TriangleDemand> demands, std::size_t room,
                        double least_px) {
    std::vector<TriangleDemand> falling(demands.begin(), demands.end());
    std::sort(falling.begin(), falling.end(), [](const TriangleDemand& a, const TriangleDemand& b) {
        return a.threshold_px > b.threshold_px;
    });
    std::size_t triangles = 0;
    for (const TriangleDemand& demand : falling) {
        if (!(demand.threshold_px > least_px)) break;
        triangles += demand.triangles;
        if (triangles > room) return demand.threshold_px;
    }
    return least_px;
}

}  // namespace

SceneDraws draws_within(Scene& scene, const View& view, const TerrainMesh& mesh, std::size_t budget,
                        double least_px, const std::optional<SunShadows>& shadows) {
    const std::span<const TriangleDemand> demands = scene.begin_frame(view, least_px, shadows);
    const std::size_t room = budget - std::min(budget, mesh.triangle_count);
    return scene.end_frame(
        threshold_within(demands, room, std::max(least_px, mesh.demand_threshold_px)));
}

std::vector<TriangleDemand> demands_of(py::handle scene, const View& view, double least_px) {
    if (!py::isinstance<SceneUse>(scene)) {
        throw py::type_error("scene must be a Scene, got a " +
                             py::cast<std::string>(py::type::of(scene).attr("__name__")));
    }
    auto& held = py::cast<SceneUse&>(scene);
    const auto use = held.change();
    return without_lock([&] {
        const std::span<const TriangleDemand> demands = use->scene.begin_frame(view, least_px);
        return std::vector<TriangleDemand>(demands.begin(), demands.end());
    });
}

namespace {

std::uint8_t read_level(float part, const char* name) {
    if (!(part >= 0.0f && part <= 1.0f)) {
        throw py::value_error(std::string(name) + " must have parts from 0 to 1, got " +
                              number_text(static_cast<double>(part)));
    }
    return static_cast<std::uint8_t>(std::lround(255.0f * part));
}

MeshMaterial read_material(const std::array<float, 3>& colour,
                           const std::array<float, 3>& emission) {
    MeshMaterial material;
    for (std::size_t i = 0; i < 3; ++i) material.colour[i] = read_level(colour[i], "colour");
    material.emission = emission;
    return material;
}

// Makes the levels of a mesh, uploads them, and adds them to the scene.
HeldModel add_levels(const std::shared_ptr<SceneUse>& scene, const TriangleMesh& mesh,
                     const MeshMaterial& material, bool impostor, bool pickable) {
    const auto use = scene->change();
    const auto made = [&]() -> Result<ModelId> {
        TERRANE_TRY(ObjectLevels levels, make_object_levels(mesh, impostor));
        if (pickable) {
            TERRANE_TRY(levels.model.rays, MeshRays::create(mesh));
        }
        TERRANE_TRY(use->uploaded->add(levels, material));
        return use->scene.add_model(levels.model);
    };
    return {scene, value_or_raise(without_lock(made))};
}

// Numbers of shape (n, width) for the n vertices.
std::vector<Eigen::Vector2f> read_coordinates(const py::object& argument) {
    const Doubles array = read_doubles(argument, "texture_coordinates");
    if (array.ndim() != 2 || array.shape(1) != 2)
        throw py::value_error("texture_coordinates must have the shape (n, 2), got " +
                              shape_text(array));
    std::vector<Eigen::Vector2f> coordinates(static_cast<std::size_t>(array.shape(0)));
    for (std::size_t i = 0; i < coordinates.size(); ++i)
        coordinates[i] =
            Eigen::Vector2d(array.data()[2 * i], array.data()[2 * i + 1]).cast<float>();
    return coordinates;
}

std::vector<std::array<std::uint8_t, 4>> read_colours(const py::object& argument) {
    const auto array = read_bytes(argument, "colours");
    if (array.ndim() != 2 || (array.shape(1) != 3 && array.shape(1) != 4))
        throw py::value_error("colours must have the shape (n, 3) or (n, 4), got " +
                              shape_text(array));
    const auto width = static_cast<std::size_t>(array.shape(1));
    std::vector<std::array<std::uint8_t, 4>> colours(static_cast<std::size_t>(array.shape(0)));
    for (std::size_t i = 0; i < colours.size(); ++i) {
        colours[i][3] = 255;
        std::copy_n(array.data() + width * i, width, colours[i].begin());
    }
    return colours;
}

}  // namespace

TextureImage read_image(const py::object& argument, const char* name) {
    const auto array = read_bytes(argument, name);
    const auto is_side = [](py::ssize_t side) { return side >= 1 && side <= kLargestTextureSide; };
    if (array.ndim() != 3 || array.shape(2) != 4 || !is_side(array.shape(0)) ||
        !is_side(array.shape(1))) {
        throw py::value_error(std::string(name) +
                              " must have the shape (height, width, 4), sides 1 to " +
                              number_text(kLargestTextureSide) + ", got " + shape_text(array));
    }
    return {.width = static_cast<int>(array.shape(1)),
            .height = static_cast<int>(array.shape(0)),
            .rgba = {array.data(), array.data() + array.size()}};
}

namespace {

void check_count(std::size_t count, const char* name, std::size_t vertex_count) {
    if (count == vertex_count) return;
    throw py::value_error(std::string(name) + " has " + number_text(count) +
                          " rows, and there are " + number_text(vertex_count) + " vertices");
}

constexpr double kUsualCrease = 0.7;  // radians
constexpr double kMostCrease = 3.1415926535897932;

HeldModel add_model(const std::shared_ptr<SceneUse>& scene, const py::object& vertices,
                    const py::object& triangles, const py::object& normals, double crease,
                    const py::object& colours, const py::object& texture_coordinates,
                    const py::object& texture, const std::array<float, 3>& colour, float roughness,
                    float metal, const std::array<float, 3>& emission,
                    std::optional<float> alpha_cutoff, bool two_sided, bool impostor,
                    bool pickable) {
    TriangleMesh mesh;
    mesh.positions = read_points(vertices, "vertices");
    const std::size_t count = mesh.positions.size();
    mesh.triangles = read_triangles(triangles, "triangles", count);
    if (!(crease >= 0.0 && crease <= kMostCrease))
        throw py::value_error("crease must be 0 to pi, got " + number_text(crease));
    if (!normals.is_none()) {
        for (const Eigen::Vector3d& normal : read_points(normals, "normals"))
            mesh.normals.push_back(normal.cast<float>());
        check_count(mesh.normals.size(), "normals", count);
    }
    if (!colours.is_none()) {
        mesh.colours = read_colours(colours);
        check_count(mesh.colours.size(), "colours", count);
    }
    if (!texture_coordinates.is_none()) {
        mesh.texture_coordinates = read_coordinates(texture_coordinates);
        check_count(mesh.texture_coordinates.size(), "texture_coordinates", count);
    }
    MeshMaterial material = read_material(colour, emission);
    material.roughness = roughness;
    material.metal = metal;
    material.is_two_sided = two_sided;
    material.alpha_cutoff = alpha_cutoff;
    if (!texture.is_none()) {
        if (texture_coordinates.is_none())
            throw py::value_error("a texture needs texture_coordinates");
        material.colour_texture.image =
            std::make_shared<const TextureImage>(read_image(texture, "texture"));
    }
    if (mesh.normals.empty())
        mesh = without_lock([&] { return with_crease_normals(mesh, std::cos(crease)); });
    return add_levels(scene, mesh, material, impostor, pickable);
}

using SceneArgument = const std::shared_ptr<SceneUse>&;
using Triple = std::array<float, 3>;

HeldModel add_primitive(SceneArgument scene, Result<TriangleMesh> mesh,
                        const MeshMaterial& material) {
    return add_levels(scene, value_or_raise(std::move(mesh)), material, false, true);
}

HeldModel add_box(SceneArgument scene, const py::object& half_extents, const Triple& colour,
                  const Triple& emission) {
    return add_primitive(scene, make_box_mesh(read_vector(half_extents, "half_extents")),
                         read_material(colour, emission));
}

HeldModel add_sphere(SceneArgument scene, double radius, const Triple& colour,
                     const Triple& emission) {
    return add_primitive(scene, make_sphere_mesh(radius), read_material(colour, emission));
}

HeldModel add_capsule(SceneArgument scene, double radius, double half_height, const Triple& colour,
                      const Triple& emission) {
    return add_primitive(scene, make_capsule_mesh(radius, half_height),
                         read_material(colour, emission));
}

HeldModel add_cylinder(SceneArgument scene, double radius, double half_height, const Triple& colour,
                       const Triple& emission) {
    return add_primitive(scene, make_cylinder_mesh(radius, half_height),
                         read_material(colour, emission));
}

}  // namespace

void bind_models(SceneClass& scene, py::module_& module) {
    py::class_<HeldModel>(module, "Model",
                          "A mesh of a Scene with its levels of detail, for any number of nodes. "
                          "Keeps its Scene alive.");
    const MeshMaterial defaults;
    const auto part = [&](std::size_t i) {
        return static_cast<float>(defaults.colour[i]) / 255.0f;
    };
    const Triple colour = {part(0), part(1), part(2)};
    scene.def(
        "add_model", &add_model, py::arg("vertices"), py::arg("triangles"), py::kw_only(),
        py::arg("normals") = py::none(), py::arg("crease") = kUsualCrease,
        py::arg("colours") = py::none(), py::arg("texture_coordinates") = py::none(),
        py::arg("texture") = py::none(), py::arg("colour") = colour,
        py::arg("roughness") = defaults.roughness, py::arg("metal") = defaults.metal,
        py::arg("emission") = defaults.emission, py::arg("alpha_cutoff") = py::none(),
        py::arg("two_sided") = defaults.is_two_sided, py::arg("impostor") = true,
        py::arg("pickable") = true,
        R"(Makes the levels of detail of a mesh and uploads them to the renderer: a Model. On the renderer's thread.

vertices      in the model's frame, shape (n, 3), metres
triangles     indices of vertices, shape (m, 3), counter-clockwise from outside
normals       unit, shape (n, 3); None: of the triangles, smooth where they meet at no crease
crease        least angle between triangles that meet at an edge, without normals, radians, 0 to pi
colours       uint8 of shape (n, 3) or (n, 4), red, green, blue, opacity
texture_coordinates  right and up, shape (n, 2), 0 to 1 from the lower left corner of the texture
texture       uint8 of shape (height, width, 4), row 0 at the top; factor of the colours, opacity
colour        of vertices without colours: red, green, blue, 0 to 1
roughness     0 (a mirror) to 1 (matt), with a texture, an alpha_cutoff or emission
metal         1: a metal; 0: none; with those too
emission      light that it emits: red, green, blue; 2 is a white paper in the sun
alpha_cutoff  pixels with less opacity are not drawn, 0 to 1; None: all are
two_sided     whether back faces are drawn
impostor      whether a picture replaces it in the distance
pickable      whether ray() hits it, about 200 bytes a triangle

Raises ValueError for a shape, an index or a number out of range, and a mesh without extent. Without the lock.)");
    const auto add = [&](const char* name, auto function, const char* text, const auto&... sizes) {
        scene.def(name, function, sizes..., py::kw_only(), py::arg("colour") = colour,
                  py::arg("emission") = defaults.emission, text);
    };
    add("add_box", &add_box, R"(A Model of a box around the origin.

half_extents  shape (3,), metres, above 0, to 1e5; colour and emission as of add_model())",
        py::arg("half_extents"));
    add("add_sphere", &add_sphere, R"(A Model of a sphere around the origin.

radius  metres, above 0, to 1e5; colour and emission as of add_model())",
        py::arg("radius"));
    add("add_capsule", &add_capsule,
        R"(A Model of a capsule about z: a cylinder with a half sphere on each end.

radius       metres, above 0, to 1e5
half_height  of the cylinder, metres, 0 to 1e5; colour and emission as of add_model())",
        py::arg("radius"), py::arg("half_height"));
    add("add_cylinder", &add_cylinder, R"(A Model of a cylinder about z with flat ends.

radius       metres, above 0, to 1e5
half_height  metres, above 0, to 1e5; colour and emission as of add_model())",
        py::arg("radius"), py::arg("half_height"));
}

namespace {

constexpr std::array<std::pair<const char*, CullTest>, 2> kCullTests{
    {{"planes", CullTest::planes}, {"exact", CullTest::exact}}};

std::shared_ptr<SceneUse> make_scene(const std::shared_ptr<HeldRenderer>& renderer,
                                     double fade_ratio, const std::string& cull_test,
                                     double far_distance, std::size_t most_continuous) {
    renderer->use();
    const SceneSettings settings{.fade_ratio = fade_ratio,
                                 .cull_test = read_choice(cull_test, "cull_test", kCullTests),
                                 .far_distance = far_distance,
                                 .most_continuous = most_continuous};
    return std::make_shared<SceneUse>(
        "Scene", HeldScene{.scene = value_or_raise(Scene::create(settings)),
                           .uploaded = std::make_unique<UploadedModels>(renderer)});
}

void set_time(SceneUse& scene, double time_s) {
    if (!std::isfinite(time_s))
        throw py::value_error("time_s must be finite, got " + number_text(time_s));
    const auto use = scene.change();
    without_lock([&] { use->scene.set_time(time_s); });
}

py::object counts_of(SceneUse& scene) {
    const SceneCounts counts = scene.read()->scene.counts();
    return make_answer("SceneCounts", counts.objects, counts.in_view, counts.drawn, counts.left_out,
                       counts.continuous, counts.triangles, counts.particles, counts.culled_nodes,
                       counts.casters);
}

}  // namespace

void bind_scene(SceneClass& scene, py::module_& module) {
    const SceneSettings defaults;
    scene.def(py::init(&make_scene), py::arg("renderer"), py::kw_only(),
              py::arg("fade_ratio") = defaults.fade_ratio, py::arg("cull_test") = "planes",
              py::arg("far_distance") = defaults.far_distance,
              py::arg("most_continuous") = defaults.most_continuous,
              R"(An empty scene, for pictures of one renderer.

fade_ratio       width of cross-fades between levels, 1 (none) to 2
cull_test        of instances: "planes" or "exact"
far_distance     beyond which no object is drawn, metres, > 0
most_continuous  objects in a frame with continuous levels of detail

Raises ValueError for a setting out of range and a closed renderer.)");
    bind_models(scene, module);
    bind_nodes(scene, module);
    scene
        .def(
            "set_time", &set_time, py::arg("time_s"),
            R"(Sets the time of emitters, and records their places: after the places of a frame are set, before it is drawn.

time_s  seconds, finite; a jump back forgets the places after it)")
        .def_property_readonly(
            "node_count", [](SceneUse& self) { return self.read()->scene.node_count(); },
            "Number of nodes, the root included.")
        .def_property_readonly(
            "object_count", [](SceneUse& self) { return self.read()->scene.object_count(); },
            "Number of objects and instances in all nodes.")
        .def_property_readonly("counts", &counts_of, "Counts of the last picture: SceneCounts.")
        .def(
            "close", [](SceneUse& self) { self.close(); },
            "Frees its objects, and its models on the renderer if this is the renderer's thread. "
            "Nothing where it is closed.")
        .def_property_readonly(
            "closed", [](const SceneUse& self) { return self.is_closed(); },
            "Whether close() was called.")
        .def("__enter__", [](py::object self) { return self; })
        .def("__exit__", [](SceneUse& self, const py::args&) { self.close(); });
}

}  // namespace terrane::python
