// SPDX-License-Identifier: MIT
#include "frames/body_nodes.h"

#include "scene/body_forms.h"
#include "scene/scene_objects.h"
#include "scene/shape_meshes.h"

#include <terrane/terrain/primitive_meshes.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

namespace terrane::tools {
namespace {

constexpr Tint kAwake{1.0f, 1.0f, 1.0f};
constexpr float kAsleep = 0.55f;  // brightness of sleeping bodies
constexpr float kStatic = 0.7f;   // and of static ones

Tint scaled(const Tint& tint, float share) {
    return {share * tint[0], share * tint[1], share * tint[2]};
}

// The chassis and bodywork that collide.
Result<TriangleMesh> make_chassis_proxy(const VehicleSettings& settings) {
    std::vector<CompoundPart> parts{{Box{settings.chassis_half_extents}, Pose{}}};
    parts.insert(parts.end(), settings.bodywork.begin(), settings.bodywork.end());
    TERRANE_TRY(const Compound compound, Compound::create(parts));
    return make_shape_mesh(Shape(compound));
}

// Exhaust whose puffs overlap up to 25 m/s. exhaust_strength() sets its opacity.
//
// @param direction in which it leaves, in the chassis's frame
EmitterNode make_exhaust(const Eigen::Vector3d& direction) {
    EmitterNode smoke;
    smoke.rate = 120.0;
    smoke.life = {0.6, 1.4};
    smoke.source_radius = 0.03;
    smoke.velocity = 1.2 * direction;
    smoke.velocity_spread = 0.25;
    smoke.drag_time = 0.5;
    smoke.acceleration = {0.0, 0.0, 0.6};
    smoke.radius = {0.08, 0.6};
    smoke.colours = {{{0.30f, 0.30f, 0.31f, 0.30f}, {0.50f, 0.50f, 0.50f, 0.0f}}};
    smoke.most_particles = 168;
    smoke.start = 0.0;
    return smoke;
}

// At speed the puffs of a second lie along more metres, so that they are more opaque.
float exhaust_strength(const VehicleState& state) {
    return static_cast<float>(std::min(0.25 + state.chassis.velocity.norm() / 20.0, 1.0));
}

// Dust behind a wheel, lighter than dry ground. dust_strength() sets its opacity.
EmitterNode make_dust(std::size_t wheel, double radius) {
    EmitterNode dust;
    dust.rate = 60.0;
    dust.life = {0.8, 2.0};
    dust.source_radius = 0.3 * radius;
    dust.velocity = {0.0, 0.0, 0.9};
    dust.velocity_spread = 0.9;
    dust.drag_time = 0.6;
    dust.radius = {0.6 * radius, 4.5 * radius};
    dust.colours = {{{0.84f, 0.74f, 0.58f, 0.34f}, {0.88f, 0.81f, 0.69f, 0.0f}}};
    dust.most_particles = 120;
    dust.seed = wheel + 1;
    dust.start = 0.0;
    return dust;
}

// 0 at walking speed, 1 from 14 m/s on.
float dust_strength(const VehicleState& state, const WheelState& wheel) {
    if (!wheel.in_contact) return 0.0f;
    const double speed = state.chassis.velocity.norm() + std::abs(wheel.side_slip);
    return static_cast<float>(std::clamp((speed - 2.0) / 12.0, 0.0, 1.0));
}

}  // namespace

void BodyNodes::set_mesh(const Shape& shape, const std::string& path, double scale) {
    const auto is_known = [&](const Form& form) { return is_same_shape(form.shape, shape); };
    if (std::ranges::any_of(forms_, is_known)) return;
    forms_.push_back({.shape = shape, .mesh_file = path, .scale = scale});
}

void BodyNodes::set_meshes(std::span<const PlacedBody> bodies) {
    for (const PlacedBody& body : bodies) {
        if (!body.mesh_file.empty()) set_mesh(body.settings.shape, body.mesh_file);
    }
}

void BodyNodes::set_node(std::size_t body, const PlacedBody& of_scene) {
    if (of_scene.nodes != nullptr)
        nodes_of_bodies_.insert_or_assign(body, NodeOfBody{of_scene.nodes, of_scene.node});
}

Result<MeshModel> BodyNodes::look_of(const Form& form) const {
    MeshModel look;
    const Box* const box = std::get_if<Box>(&form.shape);
    if (!shows_proxies_ && !form.mesh_file.empty()) {
        TERRANE_TRY(look, read_shaded_model(form.mesh_file));
        for (Eigen::Vector3d& p : look.mesh.positions) p *= form.scale;
    } else if (!shows_proxies_ && box != nullptr) {
        look = make_crate_form(box->half_extents);
    } else {
        TERRANE_TRY(look.mesh, make_shape_mesh(form.shape));
    }
    return look;
}

// The model of a shape, made when it is first needed.
Result<ModelId> BodyNodes::model_of(const Shape& shape) {
    auto form = std::ranges::find_if(
        forms_, [&](const Form& each) { return is_same_shape(each.shape, shape); });
    if (form == forms_.end()) form = forms_.insert(form, {.shape = shape});
    if (form->model) return *form->model;
    TERRANE_TRY(const MeshModel look, look_of(*form));
    TERRANE_TRY(form->model, field_->add_body_model(look, renderer_));
    return *form->model;
}

Result<BodyNodes::Part> BodyNodes::add(ModelId model) {
    Scene& scene = field_->scene();
    TERRANE_TRY(const NodeId node,
                scene.add(scene.root(), {}, ModelNode{.model = model, .tint = kAwake}));
    return Part{node, kAwake, {{node, model}}};
}

Result<BodyNodes::Part> BodyNodes::add(const NodeOfBody& look) {
    const SceneNodes& nodes = *look.nodes;
    auto models = node_models_.find(look.nodes);
    if (models == node_models_.end()) {
        TERRANE_TRY(NodeModels made, field_->add_body_models(nodes, renderer_));
        models = node_models_.emplace(look.nodes, std::move(made)).first;
    }
    Scene& scene = field_->scene();
    Part part;
    part.tint = kAwake;
    TERRANE_TRY(part.node, scene.add(scene.root(), {}, GroupNode{}));
    TERRANE_TRY(const std::vector<NodeId> ids,
                field_->add_subtree(nodes, look.first, models->second, part.node,
                                    nodes.nodes[look.first].place));
    for (std::size_t i = 0; i < ids.size(); ++i) {
        const auto* mesh = std::get_if<MeshOfNode>(&nodes.nodes[look.first + i].content);
        if (mesh != nullptr) part.models.emplace_back(ids[i], models->second.models[mesh->mesh]);
    }
    return part;
}

Result<void> BodyNodes::place(Part& part, const Pose& pose_world, const Tint& tint) {
    Scene& scene = field_->scene();
    TERRANE_TRY(scene.set_place(part.node, {.parent_from_node = pose_world}));
    if (tint == part.tint) return {};
    part.tint = tint;
    for (const auto& [node, model] : part.models)
        TERRANE_TRY(scene.set_content(node, ModelNode{.model = model, .tint = tint}));
    return {};
}

Result<void> BodyNodes::show(std::size_t body, const Shape& shape, const BodyState& state,
                             const Tint& tint) {
    if (state.condition == BodyCondition::left_world || state.condition == BodyCondition::removed) {
        remove(body);
        return {};
    }
    auto known = bodies_.find(body);
    if (known == bodies_.end()) {
        const auto look = nodes_of_bodies_.find(body);
        Part part;
        if (look != nodes_of_bodies_.end() && !shows_proxies_) {
            TERRANE_TRY(part, add(look->second));
        } else {
            TERRANE_TRY(const ModelId model, model_of(shape));
            TERRANE_TRY(part, add(model));
        }
        known = bodies_.emplace(body, std::move(part)).first;
    }
    const float share = state.condition == BodyCondition::asleep  ? kAsleep
                        : state.condition == BodyCondition::fixed ? kStatic
                                                                  : 1.0f;
    return place(known->second, state.pose, scaled(tint, share));
}

void BodyNodes::remove(std::size_t body) {
    const auto known = bodies_.find(body);
    if (known == bodies_.end()) return;
    field_->scene().remove(known->second.node);
    bodies_.erase(known);
}

Result<void> BodyNodes::add(ModelId model, std::size_t count, std::vector<Part>& parts_out) {
    for (; count > 0; --count) {
        TERRANE_TRY(const Part part, add(model));
        parts_out.push_back(part);
    }
    return {};
}

void BodyNodes::remove(std::vector<Part>& parts) {
    for (const Part& part : parts) field_->scene().remove(part.node);
    parts.clear();
}

Result<void> BodyNodes::place(std::vector<Part>& parts, std::span<const Pose> poses_world) {
    for (std::size_t i = 0; i < parts.size(); ++i)
        TERRANE_TRY(place(parts[i], poses_world[i], kAwake));
    return {};
}

namespace {

// Whether two vehicles have the numbers that make_vehicle_form() uses.
bool has_same_form(const VehicleSettings& a, const VehicleSettings& b) {
    const auto is_same = [](const AxleSettings& one, const AxleSettings& other) {
        return one.position == other.position && one.track == other.track;
    };
    return a.chassis_half_extents == b.chassis_half_extents && a.wheel_radius == b.wheel_radius &&
           a.suspension_travel == b.suspension_travel && a.is_tracked == b.is_tracked &&
           std::ranges::equal(a.axles, b.axles, is_same);
}

}  // namespace

// The models of vehicles with these settings, made when they are first needed.
Result<const BodyNodes::VehicleLook*> BodyNodes::look_of(const VehicleSettings& settings) {
    for (const std::unique_ptr<const VehicleLook>& look : vehicle_looks_)
        if (has_same_form(look->settings, settings)) return look.get();
    VehicleForm form;
    if (shows_proxies_) {
        TERRANE_TRY(form.body.mesh, make_chassis_proxy(settings));
        TERRANE_TRY(form.wheel.mesh, make_shape_mesh(Shape(Sphere{settings.wheel_radius})));
    } else {
        TERRANE_TRY(form, make_vehicle_form(settings));
    }
    VehicleLook made{.settings = settings};
    TERRANE_TRY(made.body, field_->add_body_model(form.body, renderer_));
    TERRANE_TRY(made.wheel, field_->add_body_model(form.wheel, renderer_));
    if (form.link) {
        TERRANE_TRY(made.link, field_->add_body_model(*form.link, renderer_));
    }
    if (form.sprocket) {
        TERRANE_TRY(made.sprocket, field_->add_body_model(*form.sprocket, renderer_));
    }
    if (!shows_proxies_) made.exhaust = form.exhaust;
    made.exhaust_direction = form.exhaust_direction;
    vehicle_looks_.push_back(std::make_unique<const VehicleLook>(std::move(made)));
    return vehicle_looks_.back().get();
}

Result<void> BodyNodes::add_vehicle(const VehicleSettings& settings, const VehicleState& state) {
    TERRANE_TRY(const VehicleLook* const look, look_of(settings));
    Vehicle made;
    made.look = look;
    TERRANE_TRY(made.body, add(look->body));
    TERRANE_TRY(add(look->wheel, state.wheels.size(), made.wheels));
    if (look->link)
        TERRANE_TRY(add(*look->link, track_link_poses(settings, state).size(), made.links));
    if (look->sprocket)
        TERRANE_TRY(add(*look->sprocket, sprocket_poses(settings, state).size(), made.sprockets));
    if (look->exhaust) {
        Scene& scene = field_->scene();
        made.exhaust_direction = look->exhaust_direction;
        TERRANE_TRY(made.exhaust,
                    scene.add(made.body.node, {.parent_from_node = {.translation = *look->exhaust}},
                              make_exhaust(look->exhaust_direction)));
        for (std::size_t i = 0; i < state.wheels.size(); ++i) {
            TERRANE_TRY(const NodeId dust,
                        scene.add(scene.root(), {}, make_dust(i, settings.wheel_radius)));
            made.dust.push_back(dust);
        }
    }
    vehicle_ = std::move(made);
    return {};
}

void BodyNodes::remove_vehicle() {
    if (!vehicle_) return;
    field_->scene().remove(vehicle_->body.node);  // with the exhaust
    for (std::vector<Part>* parts : {&vehicle_->wheels, &vehicle_->links, &vehicle_->sprockets})
        remove(*parts);
    for (const NodeId dust : vehicle_->dust) field_->scene().remove(dust);
    vehicle_.reset();
}

Result<void> BodyNodes::show_smoke(const VehicleSettings& settings, const VehicleState& state) {
    Scene& scene = field_->scene();
    if (vehicle_->exhaust) {
        EmitterNode smoke = make_exhaust(vehicle_->exhaust_direction);
        smoke.strength = exhaust_strength(state);
        TERRANE_TRY(scene.set_content(*vehicle_->exhaust, std::move(smoke)));
    }
    for (std::size_t i = 0; i < vehicle_->dust.size(); ++i) {
        const WheelState& wheel = state.wheels[i];
        const WorldPos below =
            wheel.centre_world - Eigen::Vector3d(0.0, 0.0, settings.wheel_radius);
        TERRANE_TRY(scene.set_place(
            vehicle_->dust[i],
            {.parent_from_node = {.translation = wheel.in_contact ? wheel.point_world : below}}));
        EmitterNode dust = make_dust(i, settings.wheel_radius);
        dust.strength = dust_strength(state, wheel);
        TERRANE_TRY(scene.set_content(vehicle_->dust[i], std::move(dust)));
    }
    return {};
}

Result<void> BodyNodes::show(const VehicleSettings& settings, const VehicleState& state) {
    if (vehicle_ && !has_same_form(vehicle_->look->settings, settings)) remove_vehicle();
    if (!vehicle_) TERRANE_TRY(add_vehicle(settings, state));
    const Pose& chassis = state.chassis.pose;
    TERRANE_TRY(place(vehicle_->body, chassis, kAwake));
    for (std::size_t i = 0; i < vehicle_->wheels.size(); ++i)
        TERRANE_TRY(place(vehicle_->wheels[i], wheel_pose(settings, state, i), kAwake));
    if (!vehicle_->links.empty()) {
        TERRANE_TRY(place(vehicle_->links, track_link_poses(settings, state)));
        TERRANE_TRY(place(vehicle_->sprockets, sprocket_poses(settings, state)));
    }
    return show_smoke(settings, state);
}

Result<void> BodyNodes::add_character(const CharacterSettings& settings) {
    if (character_models_.empty() && shows_proxies_) {
        MeshModel capsule;
        TERRANE_TRY(capsule.mesh, make_capsule_mesh(settings.radius, settings.half_height));
        TERRANE_TRY(const ModelId model, field_->add_body_model(capsule, renderer_));
        character_models_.push_back(model);
    } else if (character_models_.empty()) {
        for (const MeshModel& part : make_character_form(settings).parts) {
            TERRANE_TRY(const ModelId model, field_->add_body_model(part, renderer_));
            character_models_.push_back(model);
        }
    }
    for (const ModelId model : character_models_) TERRANE_TRY(add(model, 1, character_));
    return {};
}

Result<void> BodyNodes::show(const CharacterSettings& settings, const Pose& pose_world,
                             double walked, double speed) {
    if (character_.empty()) TERRANE_TRY(add_character(settings));
    if (shows_proxies_) return place(character_, {&pose_world, 1});
    return place(character_, character_part_poses(settings, pose_world, walked, speed));
}

void BodyNodes::remove_character() { remove(character_); }

}  // namespace terrane::tools
