// SPDX-License-Identifier: MIT
#include "record/run_bodies.h"

#include "scene/shape_meshes.h"

#include <algorithm>
#include <utility>

namespace terrane::tools {
namespace {

std::array<double, 3> place_of(const BodyState& state) {
    const WorldPos& p = state.pose.translation;
    return {p.x(), p.y(), p.z()};
}

// One of several shades of wood.
Tint crate_tint(std::size_t index) {
    const float shade = 0.8f + 0.1f * static_cast<float>(index % 4);
    return {shade, shade, shade};
}

}  // namespace

std::vector<std::string> drop_columns() { return {"awake", "touching_pairs", "depth_m"}; }

std::vector<double> drop_figures(const StepFigures& last) {
    return {static_cast<double>(last.awake), static_cast<double>(last.touching_pairs),
            last.max_depth_m};
}

DropBodies::DropBodies(const Terrain& terrain, const World& world, std::size_t first_body,
                       BodyNodes& nodes) {
    const auto settings = world.settings();
    std::size_t body = first_body;
    for (const PlacedBody& placed : terrain.bodies) {
        if (placed.settings.type == BodyType::static_body) fixed_.insert(place_of(placed.state));
        std::size_t found = body;
        while (found < settings.size() &&
               !is_same_shape(settings[found].shape, placed.settings.shape))
            ++found;
        if (found == settings.size()) continue;
        nodes.set_node(found, placed);
        body = found + 1;
    }
}

Result<void> DropBodies::show(const World& world, BodyNodes& nodes) const {
    for (std::size_t body = 0; body < world.states().size(); ++body) {
        const BodyState& state = world.states()[body];
        // the other static bodies stand for objects of the scene
        if (state.condition == BodyCondition::fixed && !fixed_.contains(place_of(state))) continue;
        TERRANE_TRY(nodes.show(body, world.settings()[body].shape, state));
    }
    return {};
}

std::size_t first_crate(BodyId traveller) { return traveller.index + std::size_t{1}; }

std::size_t first_scene_body(BodyId traveller, std::size_t crate_count) {
    return first_crate(traveller) + crate_count;
}

void set_nodes(std::span<const PlacedBody> of_scene, std::size_t first, BodyNodes& nodes) {
    for (std::size_t i = 0; i < of_scene.size(); ++i) nodes.set_node(first + i, of_scene[i]);
}

namespace {

Result<void> show_awake(const World& world, std::size_t body, const Tint& tint, BodyNodes& nodes) {
    BodyState state = world.states()[body];
    // bodies that wake and sleep would flicker
    if (state.condition == BodyCondition::asleep) state.condition = BodyCondition::awake;
    return nodes.show(body, world.settings()[body].shape, state, tint);
}

Result<void> show_character(const World& world, BodyId character, const CharacterGait& gait,
                            BodyNodes& nodes) {
    const BodyState& body = world.state(character);
    return nodes.show(*world.character_settings(character),
                      gait.world_from_capsule(body.pose.translation), gait.walked,
                      body.velocity.head<2>().norm());
}

}  // namespace

Result<void> show_bodies(const World& world, BodyId traveller, std::size_t crate_count,
                         std::size_t scene_count, BodyNodes& nodes) {
    for (std::size_t i = 0; i < crate_count; ++i)
        TERRANE_TRY(show_awake(world, first_crate(traveller) + i, crate_tint(i), nodes));
    for (std::size_t i = 0; i < scene_count; ++i) {
        TERRANE_TRY(show_awake(world, first_scene_body(traveller, crate_count) + i,
                               {1.0f, 1.0f, 1.0f}, nodes));
    }
    return {};
}

Result<void> show_view(const World& world, const CharacterGait& gait, std::size_t scene_count,
                       BodyNodes& nodes) {
    bool has_vehicle = false, has_character = false;
    const std::size_t end = std::max(world.states().size(), nodes.body_end());
    for (std::size_t i = 0; i < end; ++i) {
        const BodyId id = world.id(i);
        if (const VehicleState* const vehicle = world.vehicle(id)) {
            has_vehicle = true;
            TERRANE_TRY(nodes.show(*world.vehicle_settings(id), *vehicle));
        } else if (world.character(id) != nullptr) {
            has_character = true;
            TERRANE_TRY(show_character(world, id, gait, nodes));
        } else if (id.is_valid() &&
                   (i < scene_count || world.states()[i].condition != BodyCondition::fixed)) {
            TERRANE_TRY(show_awake(world, i, {1.0f, 1.0f, 1.0f}, nodes));
            continue;
        }
        nodes.remove(i);
    }
    if (!has_vehicle) nodes.remove_vehicle();
    if (!has_character) nodes.remove_character();
    return {};
}

ReplayBodies::ReplayBodies(const Replay& replay, const Terrain& terrain, BodyNodes nodes)
    : nodes_(std::move(nodes)) {
    const RunSettings& settings = replay.record().settings();
    const World& world = replay.world();
    if (settings.kind == RunKind::drop) {
        drop_.emplace(terrain, world, settings.first_scene_body, nodes_);
        if (!settings.mesh_file.empty())
            nodes_.set_mesh(world.settings()[0].shape, settings.mesh_file, settings.mesh_scale);
        return;
    }
    scene_count_ = terrain.bodies.size();
    if (settings.kind == RunKind::view) {
        set_nodes(terrain.bodies, 0, nodes_);
        return;
    }
    set_nodes(terrain.bodies, first_scene_body(settings.traveller, settings.crate_count), nodes_);
}

Result<void> ReplayBodies::show(const Replay& replay) {
    const RunSettings& settings = replay.record().settings();
    const World& world = replay.world();
    if (drop_) return drop_->show(world, nodes_);
    if (settings.kind == RunKind::view)
        return show_view(world, replay.gait(), scene_count_, nodes_);
    const BodyId traveller = settings.traveller;
    if (settings.kind == RunKind::drive) {
        TERRANE_TRY(nodes_.show(*world.vehicle_settings(traveller), *world.vehicle(traveller)));
    } else {
        TERRANE_TRY(show_character(world, traveller, replay.gait(), nodes_));
    }
    return show_bodies(world, traveller, settings.crate_count, scene_count_, nodes_);
}

}  // namespace terrane::tools
