// SPDX-License-Identifier: MIT
#include "commands/drop_bodies.h"

#include "scene/shape_meshes.h"

namespace terrane::tools {
namespace {

std::array<double, 3> place_of(const BodyState& state) {
    const WorldPos& p = state.pose.translation;
    return {p.x(), p.y(), p.z()};
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

}  // namespace terrane::tools
