// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/world.h>
#include <terrane/render/terrain_renderer.h>

#include <vector>

namespace terrane::tools {

/// Appends the solids that draw a body: a hull by its edges. Sleeping bodies are darker, static ones grey.
void add_objects(const Shape& shape, const BodyState& state, std::vector<DrawnObject>& objects);

/// The same in one colour.
void add_objects(const Shape& shape, const Pose& pose, const Colour& colour,
                 std::vector<DrawnObject>& objects);

}  // namespace terrane::tools
