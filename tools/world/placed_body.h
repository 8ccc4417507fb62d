// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/world.h>

#include <span>
#include <vector>

namespace terrane::tools {

/// A body and its state at the start of a run.
struct PlacedBody {
    BodySettings settings;
    BodyState state;
};

/// Adds bodies to a world, in order. Fails as World::add() does.
Result<std::vector<BodyId>> add_bodies(std::span<const PlacedBody> bodies, World& world);

/// Whether a shape touches no body of a world.
bool is_free(const World& world, const Ground& ground, const Shape& shape,
             const Pose& world_from_shape);

}  // namespace terrane::tools
