// SPDX-License-Identifier: MIT
#include "scene.h"

#include <pybind11/stl.h>

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace terrane::python {
namespace {

NodePlace read_place(const py::object& position, const py::object& rotation, double scale) {
    return {read_pose(position, rotation), scale};
}

NodeId parent_of(const std::shared_ptr<SceneUse>& scene, const HeldNode* parent) {
    if (parent == nullptr) return scene->read()->scene.root();
    if (parent->scene != scene) throw py::value_error("parent is a node of another Scene");
    return parent->id;
}

ModelId model_of(const std::shared_ptr<SceneUse>& scene, const HeldModel& model) {
    if (model.scene != scene) throw py::value_error("model is a model of another Scene");
    return model.id;
}

HeldNode add(const std::shared_ptr<SceneUse>& scene, const HeldNode* parent, const NodePlace& place,
             NodeContent content) {
    const NodeId above = parent_of(scene, parent);
    const auto use = scene->change();
    auto id = without_lock([&] { return use->scene.add(above, place, std::move(content)); });
    return {scene, value_or_raise(std::move(id))};
}

HeldNode add_group(const std::shared_ptr<SceneUse>& scene, const py::object& position,
                   const py::object& rotation, const HeldNode* parent, double scale) {
    return add(scene, parent, read_place(position, rotation, scale), GroupNode{});
}

HeldNode add_object(const std::shared_ptr<SceneUse>& scene, const HeldModel& model,
                    const py::object& position, const py::object& rotation, const HeldNode* parent,
                    double scale, const std::array<float, 3>& tint) {
    return add(scene, parent, read_place(position, rotation, scale),
               ModelNode{.model = model_of(scene, model), .tint = tint});
}

// Rotations must be orthonormal, because instances have quaternions.
std::array<float, 4> quaternion_of(const Eigen::Matrix3d& rotation, std::size_t index) {
    const double error =
        (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    if (!(error <= 1e-6) || !(rotation.determinant() > 0.0)) {
        throw py::value_error("rotations[" + std::to_string(index) +
                              "] must be orthonormal to 1e-6 with determinant 1");
    }
    const Eigen::Quaternionf q(Eigen::Quaterniond(rotation).cast<float>());
    return {q.x(), q.y(), q.z(), q.w()};
}

HeldNode add_instances(const std::shared_ptr<SceneUse>& scene, const HeldModel& model,
                       const py::object& positions, const py::object& rotations,
                       const py::object& scales, const py::object& tints, const HeldNode* parent,
                       const py::object& position, const py::object& rotation, double scale) {
    const Poses poses(positions, rotations, "positions", "rotations");
    const Rows sizes = Rows::numbers(scales, "scales");
    const Rows colours(tints, "tints", 3);
    const Batch batch({&poses.positions(), &poses.rotations(), &sizes, &colours});
    InstancesNode content{.model = model_of(scene, model), .objects = {}};
    content.objects.resize(batch.count());
    for (std::size_t i = 0; i < batch.count(); ++i) {
        const Pose pose = poses[i];
        const Eigen::Vector3f tint = colours.vector(i).cast<float>();
        content.objects[i] = {.position = pose.translation,
                              .scale = static_cast<float>(sizes[i][0]),
                              .rotation = quaternion_of(pose.rotation, i),
                              .tint = {tint.x(), tint.y(), tint.z()}};
    }
    return add(scene, parent, read_place(position, rotation, scale), std::move(content));
}

constexpr std::array<std::pair<const char*, SwitchNode::By>, 3> kCriteria{
    {{"distance", SwitchNode::By::distance},
     {"centre", SwitchNode::By::centre},
     {"error", SwitchNode::By::error}}};

HeldNode add_switch(const std::shared_ptr<SceneUse>& scene, const std::string& by,
                    const std::vector<double>& limits, const py::object& position,
                    const py::object& rotation, const HeldNode* parent, double scale,
                    double hysteresis, double fade_ratio) {
    return add(scene, parent, read_place(position, rotation, scale),
               SwitchNode{.by = read_choice(by, "by", kCriteria),
                          .limits = limits,
                          .hysteresis = hysteresis,
                          .fade_ratio = fade_ratio});
}

constexpr std::array<std::pair<const char*, BillboardNode::Axis>, 2> kAxes{
    {{"screen", BillboardNode::Axis::screen}, {"up", BillboardNode::Axis::up}}};

HeldNode add_billboard(const std::shared_ptr<SceneUse>& scene, const std::string& axis,
                       const py::object& position, const py::object& rotation,
                       const HeldNode* parent, double scale) {
    return add(scene, parent, read_place(position, rotation, scale),
               BillboardNode{.axis = read_choice(axis, "axis", kAxes)});
}

using ColourRange = std::array<std::array<float, 4>, 2>;

HeldNode add_emitter(const std::shared_ptr<SceneUse>& scene, const py::object& position,
                     const py::object& rotation, const HeldNode* parent, double scale, double rate,
                     const std::array<double, 2>& life, double source_radius,
                     const py::object& velocity, double velocity_spread, const py::object& wind,
                     double drag_time, const py::object& acceleration,
                     const std::array<double, 2>& radius, const ColourRange& colours,
                     const py::object& image, float strength, std::size_t most_particles,
                     std::uint64_t seed, double start) {
    EmitterNode emitter{.rate = rate,
                        .life = life,
                        .source_radius = source_radius,
                        .velocity = read_vector(velocity, "velocity"),
                        .velocity_spread = velocity_spread,
                        .wind = read_vector(wind, "wind"),
                        .drag_time = drag_time,
                        .acceleration = read_vector(acceleration, "acceleration"),
                        .radius = radius,
                        .colours = colours,
                        .strength = strength,
                        .most_particles = most_particles,
                        .seed = seed,
                        .start = start};
    if (!image.is_none()) {
        TextureImage pixels = read_image(image, "image");
        const auto use = scene->change();
        emitter.image =
            value_or_raise(without_lock([&] { return use->uploaded->add(std::move(pixels)); }));
    }
    HeldNode node = add(scene, parent, read_place(position, rotation, scale), emitter);
    node.emitter = std::make_shared<EmitterNode>(emitter);
    return node;
}

void set_strength(const HeldNode& node, float strength) {
    if (node.emitter == nullptr) throw py::value_error("this Node is not an emitter");
    const auto use = node.scene->change();
    EmitterNode changed = *node.emitter;
    changed.strength = strength;
    value_or_raise(use->scene.set_content(node.id, changed));
    node.emitter->strength = strength;
}

py::object bounds_of(const HeldNode& node) {
    const auto use = node.scene->change();  // updates what changes have left to do
    const std::optional<Aabb> bounds = use->scene.bounds_world(node.id);
    if (!bounds) return py::none();
    return py::make_tuple(to_array(bounds->low), to_array(bounds->high));
}

py::object ray(const std::shared_ptr<SceneUse>& scene, const py::object& from,
               const py::object& to) {
    const Eigen::Vector3d from_world = read_vector(from, "from_world");
    const Eigen::Vector3d to_world = read_vector(to, "to_world");
    if (!from_world.allFinite()) throw py::value_error("from_world must be finite");
    if (!to_world.allFinite()) throw py::value_error("to_world must be finite");
    const auto use = scene->change();
    const std::optional<SceneHit> hit =
        without_lock([&] { return use->scene.ray(from_world, to_world); });
    if (!hit) return py::none();
    return make_answer("SceneHit", HeldNode{scene, hit->node}, hit->object, hit->fraction,
                       to_array(hit->point_world), to_array(hit->normal), hit->triangle);
}

void bind_node(py::module_& module) {
    py::class_<HeldNode>(module, "Node",
                         "A node of a Scene, which keeps its Scene alive. Nodes of equal identity "
                         "are equal. ValueError where it was removed.")
        .def(
            "set_place",
            [](const HeldNode& node, const py::object& position, const py::object& rotation,
               double scale) {
                const NodePlace place = read_place(position, rotation, scale);
                const auto use = node.scene->change();
                value_or_raise(without_lock([&] { return use->scene.set_place(node.id, place); }));
            },
            py::arg("position"), py::arg("rotation") = py::none(), py::arg("scale") = 1.0,
            R"(Moves the node, with its subtree, to a place in its parent's frame.

position  shape (3,), metres
rotation  a matrix (3, 3) or a unit quaternion w, x, y, z; None: the parent's axes
scale     1e-6 to 1e6)")
        .def("set_strength", &set_strength, py::arg("strength"),
             "Sets the opacity of the particles that an emitter emits from now on, 0 to 1.")
        .def(
            "remove",
            [](const HeldNode& node) {
                const auto use = node.scene->change();
                without_lock([&] { use->scene.remove(node.id); });
            },
            "Removes the node and its subtree. Nothing where it was removed, or is the root.")
        .def_property_readonly(
            "bounds_world", &bounds_of,
            "Lowest and highest corner of a box around the subtree: two arrays of shape (3,), "
            "world, metres; None where it has neither objects nor particles.")
        .def("__eq__",
             [](const HeldNode& a, const py::object& other) {
                 if (!py::isinstance<HeldNode>(other)) return false;
                 const auto& b = py::cast<const HeldNode&>(other);
                 return a.scene == b.scene && a.id == b.id;
             })
        .def("__hash__", [](const HeldNode& node) { return static_cast<std::uint64_t>(node.id); });
}

}  // namespace

void bind_nodes(SceneClass& scene, py::module_& module) {
    bind_node(module);
    const EmitterNode emitter;
    const SwitchNode levels;
    const auto vector = [](const Eigen::Vector3d& v) {
        return py::make_tuple(v.x(), v.y(), v.z());
    };
    const py::tuple origin = py::make_tuple(0.0, 0.0, 0.0);
    scene
        .def_property_readonly(
            "root",
            [](const std::shared_ptr<SceneUse>& self) {
                return HeldNode{self, self->read()->scene.root()};
            },
            "The Node at the world's origin above all others.")
        .def("add_group", &add_group, py::arg("position") = origin,
             py::arg("rotation") = py::none(), py::kw_only(), py::arg("parent") = py::none(),
             py::arg("scale") = 1.0,
             R"(Adds a Node that only places its children.

position  in the parent's frame, shape (3,), metres
rotation  a matrix (3, 3) or a unit quaternion w, x, y, z; None: the parent's axes
parent    a Node of this scene; None: the root
scale     1e-6 to 1e6)")
        .def("add_object", &add_object, py::arg("model"), py::arg("position") = origin,
             py::arg("rotation") = py::none(), py::kw_only(), py::arg("parent") = py::none(),
             py::arg("scale") = 1.0, py::arg("tint") = std::array{1.0f, 1.0f, 1.0f},
             R"(Adds a Node with a model.

model  a Model of this scene
tint   factors of red, green and blue; other arguments as of add_group())")
        .def(
            "add_instances", &add_instances, py::arg("model"), py::arg("positions"),
            py::arg("rotations") = py::none(), py::kw_only(), py::arg("scales") = 1.0,
            py::arg("tints") = py::make_tuple(1.0, 1.0, 1.0), py::arg("parent") = py::none(),
            py::arg("position") = origin, py::arg("rotation") = py::none(), py::arg("scale") = 1.0,
            R"(Adds a Node with many placements of one model, such as the trees of a forest. Not below switches and billboards.

model      a Model of this scene
positions  in the node's frame, shape (n, 3), metres
rotations  matrices (n, 3, 3) or unit quaternions w, x, y, z of shape (n, 4), or one for all; None: the node's axes
scales     shape (n,) or one number, 1e-6 to 1e6
tints      factors of red, green and blue, shape (n, 3) or (3,); other arguments as of add_group())")
        .def(
            "add_switch", &add_switch, py::arg("by"), py::arg("limits"),
            py::arg("position") = origin, py::arg("rotation") = py::none(), py::kw_only(),
            py::arg("parent") = py::none(), py::arg("scale") = 1.0,
            py::arg("hysteresis") = levels.hysteresis, py::arg("fade_ratio") = levels.fade_ratio,
            R"(Adds a Node that draws one of its children: levels of detail, finest first, in the order of their addition.

by          "distance" to the bounding sphere of the levels or "centre", to its centre, metres; or "error": limit i is
            the error of level i + 1, metres
limits      for each level the last distance or error; beyond the last one nothing is drawn. inf: always the last level
hysteresis  a level changes only after its limit is passed by this ratio, 1 to 2
fade_ratio  levels cross-fade while the limit is passed by up to this ratio, 1 to 2; not with hysteresis

Other arguments as of add_group().)")
        .def("add_billboard", &add_billboard, py::arg("axis") = "screen",
             py::arg("position") = origin, py::arg("rotation") = py::none(), py::kw_only(),
             py::arg("parent") = py::none(), py::arg("scale") = 1.0,
             R"(Adds a Node that turns its children towards the viewer.

axis  "screen": x to the right and y to the top of the picture; "up": x towards the eye, about the node's z axis

Other arguments as of add_group().)")
        .def(
            "add_emitter", &add_emitter, py::arg("position") = origin,
            py::arg("rotation") = py::none(), py::kw_only(), py::arg("parent") = py::none(),
            py::arg("scale") = 1.0, py::arg("rate") = emitter.rate, py::arg("life") = emitter.life,
            py::arg("source_radius") = emitter.source_radius,
            py::arg("velocity") = vector(emitter.velocity),
            py::arg("velocity_spread") = emitter.velocity_spread,
            py::arg("wind") = vector(emitter.wind), py::arg("drag_time") = emitter.drag_time,
            py::arg("acceleration") = vector(emitter.acceleration),
            py::arg("radius") = emitter.radius, py::arg("colours") = emitter.colours,
            py::arg("image") = py::none(), py::arg("strength") = emitter.strength,
            py::arg("most_particles") = emitter.most_particles, py::arg("seed") = emitter.seed,
            py::arg("start") = emitter.start,
            R"(Adds a Node that emits particles, as smoke or dust: a function of the time of set_time(). Not below switches and
billboards.

rate             particles a second, 0 to 1e5
life             least and most life of a particle, seconds, 1e-3 to 1e3
source_radius    of the ball of births, metres, 0 to 1e4
velocity         at birth, shape (3,), the node's frame, m/s, within 1e4
velocity_spread  radius of the ball of velocities that are added, m/s, 0 to 1e4
wind             of the air, shape (3,), world axes, m/s, within 1e4
drag_time        seconds after which a particle has a quarter of its speed in the air, 1e-3 to 1e9
acceleration     of gravity and buoyancy, shape (3,), world axes, m/s^2, within 1e4
radius           at birth and at the end of life, metres, 1e-3 to 1e4
colours          at birth and at the end of life: red, green, blue, opacity, 0 to 1
image            of the particles, turned at random: uint8 of shape (height, width, 4), row 0 at the top; if all are opaque, the
                 opacity is that of a soft disc. None: soft discs. Equal images of a scene share their memory
strength         factor of opacity, 0 to 1: see Node.set_strength()
most_particles   of which the youngest are drawn, 1 to 65536
seed             different seeds emit independently
start            time of the first particle, seconds; -inf: there is smoke from the first frame on

Other arguments as of add_group().)")
        .def("ray", &ray, py::arg("from_world"), py::arg("to_world"),
             R"(The first object that a segment hits: a SceneHit, or None. Particles are not hit.

from_world, to_world  shape (3,), metres, finite)");
}

}  // namespace terrane::python
