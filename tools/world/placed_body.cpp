// SPDX-License-Identifier: MIT
#include "world/placed_body.h"

namespace terrane::tools {

Result<std::vector<BodyId>> add_bodies(std::span<const PlacedBody> bodies, World& world) {
    std::vector<BodyId> ids;
    ids.reserve(bodies.size());
    for (const PlacedBody& body : bodies) {
        const Result<BodyId> added = world.add(body.settings, body.state);
        if (!added) return tl::unexpected(added.error());
        ids.push_back(*added);
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

}  // namespace terrane::tools
