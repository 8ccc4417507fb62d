// SPDX-License-Identifier: MIT
#pragma once

#include "support/random.h"

#include <terrane/scene/scene.h>

#include <span>
#include <vector>

namespace terrane::test {

/// A model with one to six levels, some with an impostor last, some always drawn.
ObjectModel random_model(Random& random, std::uint32_t index);

/// A model of one level that is always drawn.
ObjectModel plain_model(std::uint32_t mesh, const Aabb& bounds);

/// Adds instances below the root.
Result<NodeId> add_instances(terrane::Scene& scene, ModelId model,
                             std::span<const PlacedObject> objects);

PlacedObject random_object(Random& random, double spread);

/// A tree of 8 m: 400, 100 and 30 triangles, an impostor of 2; and a rock of 1.5 m: 300, 80, 20 and an impostor.
ObjectModel tree_model();
ObjectModel rock_model();

/// Objects over a square around the origin, standing upright, with random yaw and scale.
std::vector<PlacedObject> spread_objects(Random& random, int count, double half_side);

}  // namespace terrane::test
